"""Gauges of bodies that turn: what the modes lack of the static answer to rotation and to forces at interfaces.

The load by a rotation ω is ρ C x with C = ω² 1 − ω ωᵀ. The inertia of linear and angular accelerations balances the
forces, and is part of the answer to them. What is left out varies slowly beside the modes that are left out.
"""

from collections.abc import Mapping

import numpy as np

from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.turning.arrays import PLACE, SPIN, TURN, Model
from gudgeon.solver.integrators.turning.build import Linkage
from gudgeon.solver.integrators.turning.energy import bodies_of
from gudgeon.solver.integrators.turning.flexible.acting import forces_of_elements, forces_of_joints
from gudgeon.solver.integrators.turning.probes import States
from gudgeon.solver.integrators.turning.rotation import matrices
from gudgeon.solver.obstacles import Plane
from gudgeon.solver.obstacles.bore import Bore


def squares_of(model: Model, states: np.ndarray, b: int) -> np.ndarray:
    """Return C of a body at states, ω of its undeformed inertia, in its own axes [rad²/s²], (s, 3, 3)."""
    body_states = bodies_of(model, states)[:, b]
    spin = np.einsum("sij,si->sj", matrices(body_states[:, TURN : TURN + 4]), body_states[:, SPIN : SPIN + 3])
    omega = spin @ model.inverse[b].T
    return (omega**2).sum(axis=1)[:, None, None] * np.eye(3) - omega[:, :, None] * omega[:, None, :]


class Statics:
    """Bodies that deform and have gauges."""

    def __init__(self, linkage: Linkage, model: Model) -> None:
        """Find them.

        Raises:
            SceneError: a record was made before centrifugal loads were part of it.
        """
        self._linkage, self._model = linkage, model
        self._bodies: list[tuple[str, int]] = []
        for b, (name, body) in enumerate(linkage.system.bodies.items()):
            if not body.modal.gauges or not len(body.modal.angular_frequencies):
                continue
            if any(gauge.centrifugal is None for gauge in body.modal.gauges.values()):
                raise SceneError(
                    f"body.{name}.gauges: the record of its modes, {body.morph.modes_key[:12]}, has no static answer of"
                    " gauges to rotation; compute it again"
                )
            self._bodies.append((name, b))

    def values(
        self, states: States, holds: np.ndarray, amounts: np.ndarray, contact_forces: Mapping[str, np.ndarray]
    ) -> np.ndarray:
        """Return what all gauges of the system lack at states, (s, G).

        Args:
            holds: As `Reading.holds`, (s, J, 6).
            amounts: Of the loads, (s, l).
            contact_forces: Forces on the points of each contact [N], (s, c).
        """
        system = self._linkage.system
        readings, owners = (
            np.zeros((len(states.samples), len(system.gauges))),
            [gauge.partition(".")[0] for gauge in system.gauges],
        )
        for name, b in self._bodies:
            body = system.bodies[name]
            columns = np.flatnonzero([owner == name for owner in owners])
            tensors = np.concatenate([g.centrifugal for g in body.modal.gauges.values() if g.centrifugal is not None])
            readings[:, columns] = np.einsum("sij,kij->sk", squares_of(self._model, states.samples, b), tensors)
            context = self._linkage, self._model, states
            acting = forces_of_joints(*context, holds, name) + forces_of_elements(*context, amounts, name)
            for interface, forces in acting:
                readings[:, columns] += forces @ _residual(body, interface).T
            for contact in system.contacts:
                if contact.body == name:
                    readings[:, columns] += self._touched(states, b, contact, contact_forces[contact.name])
        return readings

    def _touched(self, states: States, b: int, contact: ContactRows, forces: np.ndarray) -> np.ndarray:
        """Return what the gauges of a body lack of the forces of a plane or a bore on its points, (s, G)."""
        system = self._linkage.system
        body, obstacle = system.bodies[contact.body], system.scene.contact[contact.name].against
        if not isinstance(obstacle, Plane | Bore) or not forces.any():
            return np.zeros((len(forces), sum(len(gauge.rows) for gauge in body.modal.gauges.values())))
        body_states = bodies_of(self._model, states.samples)[:, b]
        turn, arms = matrices(body_states[:, TURN : TURN + 4]), contact.points - body.morph.centre
        positions = body_states[:, None, PLACE : PLACE + 3] + np.einsum("sij,cj->sci", turn, arms)
        directions = obstacle.direction(positions.reshape(-1, 3)).reshape(positions.shape)
        local_forces = forces[:, :, None] * np.einsum("sij,sci->scj", turn, directions)
        along = np.einsum("scj,caj->sca", local_forces, body.contact_frame(contact.interface))
        return along.reshape(len(forces), -1) @ _columns(body, body.contact_places(contact.interface)).T


def _residual(body: FlexibleBody, interface: str) -> np.ndarray:
    """Return what the gauges of a body lack per force at an interface, (G, k); zero where the record has no R."""
    start, _ = body.modal.interface_rows[interface]
    return _columns(body, start + np.arange(len(body.modal.loads[interface].rows)))


def _columns(body: FlexibleBody, rows: np.ndarray) -> np.ndarray:
    """Return what the gauges of a body lack per force of rows of R, (G, k); zero of those that have no part of R."""
    blocks = [
        gauge.residual[:, rows] if gauge.residual.shape[1] else np.zeros((len(gauge.rows), len(rows)))
        for gauge in body.modal.gauges.values()
    ]
    return np.concatenate(blocks)
