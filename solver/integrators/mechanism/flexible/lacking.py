"""How much of the static compliance that joints meet a body's modes lack.

A joint acts on a body that deforms through its modes alone. Under the forces λ of the joints at its interfaces, which
its inertia balances, the whole body has the strain energy ½ λᵀ B G Bᵀ λ, its modes ½ λᵀ W Λ⁻¹ Wᵀ λ, and what they lack
is ½ λᵀ R λ with the residual flexibility R of its record (docs/theory.md). Λ and R are those of free bodies.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.types import Json
from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.integrators.mechanism.arrays import TURN, Model
from gudgeon.solver.integrators.mechanism.build import Linkage
from gudgeon.solver.integrators.mechanism.energy import bodies_of
from gudgeon.solver.integrators.mechanism.probes import States, point_motions
from gudgeon.solver.integrators.mechanism.rotation import matrices

SAID = 0.01
"""Share of the strain energy from which on it is said."""


class Pushed(NamedTuple):
    """An interface of a body that a joint holds."""

    pair: int
    side: int
    """0: the other marker of the joint, 1: its own."""
    interface: str


def joint_lacks(linkage: Linkage, model: Model, states: States, holds: np.ndarray) -> tuple[Json, list[str]]:
    """Return the quantity `joint_lack` of each body that joints hold at interfaces, and what is to be said of it.

    It is the largest energy ½ λᵀ R λ over the largest whole one at the samples. Bodies whose record drops R have none.

    Args:
        holds: As `Reading.holds`, (1 + s, J, 6).
    """
    found: Json = {}
    notes = []
    for name, body in linkage.system.bodies.items():
        held = _held(linkage, name)
        if not held or body.modal.residual_flexibility is None or not len(body.modal.angular_frequencies):
            continue
        forces = np.hstack([_forces(linkage, model, states, holds[:, one.pair], one) for one in held])[1:]
        lack, carried = _compliances(body, [one.interface for one in held])
        lost, kept = (0.5 * np.einsum("si,ij,sj->s", forces, matrix, forces) for matrix in (lack, carried))
        whole = float((lost + kept).max(initial=0.0))
        share = max(0.0, float(lost.max())) / whole if whole > 0 else 0.0
        found[f"{name}.joint_lack"] = {"value": share, "unit": "1"}
        if share > SAID:
            component = linkage.system.scene.component_of(name)
            notes.append(
                f"body.{name}: its modes lack {share:.2g} of the strain energy that the forces of its joints would"
                f" cause as static ones; increase component.{component}.modes.fixed_count, or set reduction"
                " 'rubin-macneal', whose shapes lack none"
            )
    return found, notes


def _held(linkage: Linkage, body: str) -> list[Pushed]:
    """Return the interfaces of a body that joints hold."""
    found = []
    for name, pair in linkage.pairs.items():
        joint = linkage.system.scene.joint[name]
        for side, owner, interface in (
            (1, getattr(joint, "body", None), getattr(joint, "interface", None)),
            (0, getattr(joint, "against", None), getattr(joint, "against_interface", None)),
        ):
            if owner == body and interface is not None:
                found.append(Pushed(pair, side, interface))
    return found


def _forces(linkage: Linkage, model: Model, states: States, wrenches: np.ndarray, one: Pushed) -> np.ndarray:
    """Return force and moment of a joint on an interface in the axes of its body at all states, as many as the
    interface has rows, (1 + s, 3 or 6)."""
    force, moment = wrenches[:, :3], wrenches[:, 3:]
    if one.side == 0:
        own, other = (_places(linkage, model, states, one.pair, side) for side in (1, 0))
        force, moment = -force, -moment - np.cross(own - other, force)
    b = linkage.markers[one.pair][one.side].owner
    turn = matrices(bodies_of(model, states.samples)[:, b, TURN : TURN + 4])
    both = [np.einsum("sij,si->sj", turn, part) for part in (force, moment)]
    rows = len(list(linkage.system.bodies.values())[b].modal.loads[one.interface].rows)
    return np.hstack(both)[:, :rows]


def _places(linkage: Linkage, model: Model, states: States, pair: int, side: int) -> np.ndarray:
    """Return where a marker of a pair is [m], (1 + s, 3)."""
    point = linkage.markers[pair][side]
    if point.owner < 0:
        return np.tile(point.arm, (len(states.samples), 1))
    return point_motions(model, states, point)[0]


def _compliances(body: FlexibleBody, interfaces: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return R and the static compliance W Λ⁻¹ Wᵀ of the modes over the rows of interfaces, (k, k) each."""
    rows = np.vstack([body.modal.loads[name].rows for name in interfaces])
    lack = np.block([[body.residual(one, other) for other in interfaces] for one in interfaces])
    return lack, (rows / body.modal.angular_frequencies**2) @ rows.T
