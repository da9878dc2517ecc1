"""Stress on the surfaces of a body's gauges at frames of a trajectory, and the forces on the rows of its residual
flexibility that it needs: of contacts, and of given loads."""

from collections.abc import Callable
from fnmatch import fnmatch

import numpy as np

from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.modaldb.records.traction import spread
from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.interfaces.stress_recovery import COMPONENTS, von_mises
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.contact.pairs import faced
from gudgeon.solver.contact.shares import shared_columns
from gudgeon.solver.forces import OverTime
from gudgeon.solver.forces.external import ExternalForce
from gudgeon.solver.forces.gas import GasPressure
from gudgeon.solver.forces.moving import MovingForce
from gudgeon.solver.scene.contact import MasterSurface, OtherBody
from gudgeon.solver.scene.scene import Scene

READ = ("interface_rows", "tangential_spans", "loads", "tractions")
"""Fields of the modes that forces are put on rows with, but for gauges."""


def row_forces(
    drawing: Drawing, body: BodyMotion, modal: ModalRecord, acts: Callable[[str], bool] = lambda contact: True
) -> np.ndarray:
    """Return the force on each row of R at each frame, (f, C); a contact pushes against the outward normal.

    Friction is left out, see `friction_contacts`.

    Args:
        modal: With the fields `READ`, turned as the scene places the body.
        acts: Whether a contact counts, by its name.

    Raises:
        StageError: a force acts on an interface of the body that neither the record nor the scene has at frames: that
            of a spring, a joint, a motion, a field, one that a caller sets, or of a contact on its traction space.
    """
    scene = Scene.model_validate(drawing.scene)
    _refuse_unknown(scene, body.name)
    forces = np.zeros((len(drawing.trajectory.frame_times), modal.row_count))
    for name, force in scene.given().items():
        if force.body == body.name and (interface := getattr(force, "interface", None)) is not None:
            applied = _given(force, drawing.trajectory.frame_times, scene, name, modal)
            forces[:, slice(*modal.interface_rows[interface])] += applied
    for name, contact in drawing.trajectory.contacts.items():
        against = scene.contact[name].against
        if not acts(name):
            continue
        if contact.body == body.name:
            forces[:, slice(*modal.interface_rows[contact.interface])] -= contact.multipliers
        if isinstance(against, MasterSurface) and against.body == body.name:
            raise StageError(f"the trajectory does not hold the forces of contact {name} on '{against.interface}'")
        if isinstance(against, OtherBody) and against.body == body.name:
            forces[:, slice(*modal.interface_rows[against.interface])] -= _on_points(drawing, scene, name)
    return forces


def friction_contacts(drawing: Drawing, body: BodyMotion, modal: ModalRecord) -> list[str]:
    """Return the contacts on a body with friction forces on rows of R, which the record does not have at frames."""
    contacts = drawing.scene.get("contact", {})
    rough = [name for name in drawing.contacts_on(body.name) if contacts[name].get("friction") is not None]
    return rough if modal.tangential_spans else []


def _refuse_unknown(scene: Scene, body: str) -> None:
    """Raise a StageError where a force acts on an interface of a body that is not known at frames."""
    known_forces = scene.given().keys() - scene.external().keys()
    members = {f"force.{name}": force for name, force in scene.force.items() if name not in known_forces}
    members |= {f"joint.{name}": joint for name, joint in scene.joint.items()}
    acting = [n for n, m in members.items() if body in (getattr(m, "body", None), getattr(m, "against", None))]
    acting += [f"motion.{name}" for name, motion in scene.motion.items() if motion.body == body and motion.interface]
    if acting:
        raise StageError(f"the trajectory does not hold {acting[0]} on body {body} at frames")


def _given(
    force: GasPressure | MovingForce | ExternalForce | OverTime, times: np.ndarray, scene: Scene, name: str,
    modal: ModalRecord,
) -> np.ndarray:  # fmt: skip
    """Return the forces on the rows of the interface of a load at times [s], (t, k), from its definition."""
    if isinstance(force, GasPressure):
        return force.over_angle()(scene.cranks()[force.joint].angle(times))[:, None]
    if isinstance(force, MovingForce):
        return spread(modal.tractions[force.interface], force.places(times), -force.amounts(times))
    assert isinstance(force, OverTime)
    return (force.amounts(times, f"force.{name}")[:, None] * force.share()) @ force.mix()


def _on_points(drawing: Drawing, scene: Scene, name: str) -> np.ndarray:
    """Return the forces of a contact on the points of its other body, in their order, (f, k), as its run shares them:
    each point presses on the points of the facet that it meets, or on the one that it is paired with."""
    contact, against = drawing.trajectory.contacts[name], scene.contact[name].against
    assert isinstance(against, OtherBody)
    sides = _points_of(drawing, contact.body), _points_of(drawing, against.body)
    placed = contact.points + drawing.position(contact.body)
    partner, _ = faced(scene, name, sides, placed)
    return shared_columns(partner.share.T.tocsr(), contact.multipliers)


def _points_of(drawing: Drawing, name: str) -> FlexibleBody:
    """Return a body of contact points, without motions."""
    modal, none = drawing.modes(name, ["interfaces"]), np.zeros((0, 6))
    return FlexibleBody(
        name, drawing.trajectory.bodies[name], drawing.design(name), modal, twists=none, damping=None, first=0
    )


def stress_gauges(drawing: Drawing, body: BodyMotion) -> list[str]:
    """Return the gauges of stress on surfaces of a body, without reading large arrays."""
    paths = [path for path in drawing.store.sizes(body.morph.modes_key) if fnmatch(path, "gauges/*/nodes")]
    gauges = drawing.store.get(body.morph.modes_key, "modes", only=paths).gauges if paths else {}
    return [name for name, gauge in gauges.items() if gauge.unit == "Pa"]


def equivalent_stress(drawing: Drawing, body: BodyMotion, frame: int) -> np.ndarray:
    """Return the von Mises stress at the nodes [Pa], (n,), NaN where no gauge has it; see `nodal_stress` for errors."""
    return von_mises(nodal_stress(drawing, body)(frame))


def nodal_stress(drawing: Drawing, body: BodyMotion) -> Callable[[int], np.ndarray]:
    """Return a function of the frame: the stress at the nodes [Pa], (n, 6), NaN where no gauge has it, in the body's
    own axes: rows q + residual λ.

    Raises:
        StageError: see `row_forces`.
    """
    modal = _gauged(drawing, body)
    local = any(gauge.residual.shape[1] for gauge in modal.gauges.values())
    forces = row_forces(drawing, body, modal) if local else np.empty(0)

    def at(frame: int) -> np.ndarray:
        q = body.coordinates[frame, len(body.morph.rigid_twists) :]
        values = np.full((len(body.nodes), len(COMPONENTS)), np.nan)
        for gauge in modal.gauges.values():
            stress = gauge.rows @ q
            if gauge.residual.shape[1]:
                stress = stress + gauge.residual @ forces[frame]
            values[gauge.nodes] = stress.reshape(-1, len(COMPONENTS))
        return values

    return at


def left_out(drawing: Drawing, body: BodyMotion) -> str:
    """Return what the stress of a body lacks, to be written beside it; empty if nothing."""
    rough = friction_contacts(drawing, body, _gauged(drawing, body))
    return f"without the local stress of friction at {', '.join(rough)}" if rough else ""


def _gauged(drawing: Drawing, body: BodyMotion) -> ModalRecord:
    """Return the gauges of stress on surfaces of a body, and what forces are put on their columns with."""
    names = [f"gauges/{name}" for name in stress_gauges(drawing, body)]
    return drawing.modes(body.name, [*names, *READ])
