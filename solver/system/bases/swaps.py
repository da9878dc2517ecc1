"""The bases of a body between which a run changes as a moving force passes, each a system of its own.

At a change the displacement of the old basis is projected on the new one, and so is the velocity,

  q_new = V_newᵀ M V_old q_old,  q̇_new = V_newᵀ M V_old q̇_old  (Wu & Mani),

with V_newᵀ M V_old from the record. Normal modes are in all bases and go on as they are.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from gudgeon.modaldb.records.modes import SwapModes
from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.moving import MovingForce
from gudgeon.solver.system.bases.nested import restricted
from gudgeon.solver.system.compile import assembled
from gudgeon.solver.system.system import System

ROUND_OFF = 1e-9
"""Of the place of a force over the spacing of splines: a force so near to a border has passed it."""


@dataclass(frozen=True)
class Basis:
    """What a run has of all coordinates while the force is on one part of the traction space."""

    system: System
    columns: np.ndarray
    """Numbers of its coordinates among all, ascending."""


@dataclass(frozen=True)
class Swaps:
    """A system whose basis changes as a force passes over a body."""

    whole: System
    """Of the coordinates of all bases, which are not independent: for rows and results alone, and not in equilibrium at
    the start but by `begun`."""
    body: str
    name: str
    """Of the force."""
    force: MovingForce
    modes: SwapModes

    def numbers(self, times: np.ndarray) -> np.ndarray:
        """Return the numbers of the bases at times [s], (t,), from 1 on."""
        space = self.whole.bodies[self.body].modal.tractions[self.modes.interface]
        borders = self.modes.borders - ROUND_OFF * space.spacing[1]
        return 1 + np.searchsorted(borders, self.force.places(times)[:, 1], side="right")

    def basis(self, basis_number: int) -> Basis:
        """Return a basis by its number."""
        columns, bodies, size = list[np.ndarray](), {}, 0
        for name, body in self.whole.bodies.items():
            retained, modal = np.arange(len(body.modal.angular_frequencies)), body.modal
            if name == self.body:
                retained = np.flatnonzero((self.modes.number == 0) | (self.modes.number == basis_number))
                modal = restricted(modal, retained)
            bodies[name] = replace(body, modal=modal, first=size)
            size = bodies[name].elastic.stop
            columns += [np.arange(body.rigid.start, body.rigid.stop), body.elastic.start + retained]
        return Basis(assembled(self.whole.scene, bodies, self.whole.terms), np.concatenate(columns))

    def carried(self, old: Basis, new: Basis, states: np.ndarray) -> np.ndarray:
        """Return states of one basis, (k, m), in another, (k, n)."""
        full_states = np.zeros((len(states), len(self.whole.velocity)))
        full_states[:, old.columns] = states
        elastic = self.whole.bodies[self.body].elastic
        full_states[:, elastic] = full_states[:, elastic] @ self.modes.overlap
        return full_states[:, new.columns]


def swaps_of(system: System) -> Swaps | None:
    """Return how the basis of a system changes; None where it does not.

    Raises:
        SceneError: no moving force tells the basis, or the scene has what cannot change its basis.
    """
    changing = {name: body.modal.swap for name, body in system.bodies.items() if body.modal.swap is not None}
    if not changing:
        return None
    (body, modes), *others = changing.items()
    forces = {name: force for name, force in system.scene.moving().items() if force.body in changing}
    if others or len(forces) != 1:
        raise SceneError(
            f"body.{body}: its basis changes as a moving force passes, and {len(changing)} bodies with such bases have"
            f" {len(forces)} moving forces, needed: one of each"
        )
    name, force = next(iter(forces.items()))
    if force.interface != modes.interface:
        raise SceneError(
            f"force.{name}.interface: '{force.interface}' given, the bases of body '{body}' are of a force on"
            f" '{modes.interface}'"
        )
    return Swaps(system, body, name, force, modes)


def begun(system: System) -> System:
    """Return a system whose start is that of its first basis; itself where its basis does not change."""
    if (swaps := swaps_of(system)) is None:
        return system
    basis = swaps.basis(int(swaps.numbers(np.zeros(1))[0]))
    position, velocity = np.zeros((2, len(system.velocity)))
    position[basis.columns], velocity[basis.columns] = basis.system.position, basis.system.velocity
    return replace(
        system, position=position, velocity=velocity, loads=basis.system.loads, start_pulls=basis.system.start_pulls
    )


def refuse_swaps(system: System, cause: str) -> None:
    """Raise a SceneError where the basis of a body changes; `cause` says for what that cannot be."""
    names: Mapping[str, str] = {name: system.scene.component_of(name) for name in system.bodies}
    for name, body in system.bodies.items():
        if body.modal.swap is not None:
            raise SceneError(f"component.{names[name]}.modes.swap: {cause}; leave it out")
