"""What may touch in a mechanism: sections of journals, and contact points of bodies before rigid obstacles."""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.contact.bores import ElasticBore
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.turning.arrays import JOURNAL, NONE, PLANE
from gudgeon.solver.integrators.turning.flexible.frame import Frame
from gudgeon.solver.integrators.turning.parts import Point
from gudgeon.solver.integrators.turning.touching.track import Track
from gudgeon.solver.integrators.turning.touching.worn import WornSection, check_cells, worn_arrays, worn_section
from gudgeon.solver.integrators.turning.touching.yielding import Yielding, yielding_arrays, yielding_of
from gudgeon.solver.joints.clearance import STICKING, Clearance
from gudgeon.solver.laws.base import Coefficients
from gudgeon.solver.methods import METHODS
from gudgeon.solver.obstacles import Bore, Plane
from gudgeon.solver.scene.contact import Contact
from gudgeon.solver.system.system import System
from gudgeon.solver.vectors import frame_along, unit

TOUCHING = 1e-9
"""Depth over the size of the mechanism up to which points touch and do not penetrate at the start."""
USUAL = 1e-4
"""Indentation over the radius of gyration at which a law gives the stiffness by which points stick."""
WAY = 1e-3
"""Way over which the direction of friction follows at least, over the radius of gyration: where points slide, steps are
about six times its time."""
Ends = tuple[Point, Point]
"""On the other side, and the own one."""
Rubbing = tuple[float, float, float, float]


class Section(NamedTuple):
    """One place that may touch."""

    owner: str
    """Its joint or contact."""
    size: tuple[float, float, float]
    """Clearance, radius, place along the axis [m]."""
    law: Coefficients
    friction: Rubbing = (0.0, 1.0, 0.0, 0.0)
    """See `Model.touch_friction`."""
    belt: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Velocity of the obstacle's surface [m/s]."""
    shape: int = JOURNAL
    pair: int = NONE
    """Of markers."""
    worn: WornSection | None = None
    """Its wear and worn shape; None where wear is not asked for."""
    yielding: Yielding | None = None
    """Its elastic bearing; None of a law."""


def of_journal(name: str, joint: Clearance, pair: int, bore: ElasticBore | None) -> list[Section]:
    """Return the sections of a joint with clearance, which share its law.

    Args:
        bore: Of its elastic bearing.

    Raises:
        SceneError: the bearing does not carry its load, or has too few places for the cells of its wear.
    """
    if bore is not None:
        yielding = yielding_of(name, joint, bore)
        worn, law = worn_section(joint, 0, yielding.pressed), yielding.law
        assert worn is not None
        check_cells(name, worn, bore)
        size = (joint.clearance, joint.radius, 0.0)
        return [Section(name, size, law, joint.rubbing(law), pair=pair, worn=worn, yielding=yielding)]
    assert joint.law is not None
    law, fraction = joint.law.coefficients(), 1 / len(joint.sections)
    mu, speed, stiffness, turning = joint.rubbing(law)
    law = law._replace(stiffness=fraction * law.stiffness, damping=fraction * law.damping)
    friction = (mu, speed, fraction * stiffness, turning)
    return [
        Section(name, (joint.clearance, joint.radius, section), law, friction, pair=pair, worn=worn_section(joint, i))
        for i, section in enumerate(joint.sections)
    ]


def of_contact(
    contact: ContactRows, system: System, names: list[str], centres: np.ndarray, frames: list[Frame]
) -> list[tuple[Ends, np.ndarray, Section]]:
    """Return markers, their axes (2, 3, 3) and the section of each point of a contact with the ground by a law.

    Args:
        names: Of the bodies.
        centres: Their centres of mass as the scene places them [m], (n, 3).

    Raises:
        SceneError: friction is not what bodies that turn have, or a record has not what a turning body needs.
    """
    body_id, settings = names.index(contact.body), system.scene.contact[contact.name]
    body, against = system.bodies[contact.body], settings.against
    if not isinstance(against, Bore | Plane) or by_flexibility(settings, frames[body_id]):
        return []
    if isinstance(against, Plane):
        axis, origin, size, shape = unit(against.normal), np.asarray(against.point, float), (0.0, 0.0, 0.0), PLANE
    else:
        axis, origin = unit(against.axis), np.asarray(against.origin, float)
        size, shape = (against.radius, 0.0, 0.0), JOURNAL
    rows = rows_of(body, frames[body_id], contact)
    laws, belt = [Coefficients(*map(float, row)) for row in system.law[contact.rows]], belt_of(settings)
    placed = contact.points + np.asarray(system.scene.body[contact.body].position)
    result = []
    for point, point_rows, law in zip(placed, rows, laws, strict=True):
        along = (point - origin) @ axis
        ground = point - along * axis if shape == PLANE else origin + along * axis
        ends = (
            Point(NONE, ground),
            Point(body_id, point - centres[body_id], point_rows, np.zeros((6, *2 * point_rows.shape[1:]))),
        )
        axes = np.array([frame_along(axis), np.eye(3)])
        friction = rubbing_of(contact.name, settings, law, body)
        result.append((ends, axes, Section(contact.name, size, law, friction, belt, shape)))
    return result


def by_flexibility(settings: Contact, frame: Frame) -> bool:
    """Whether points press on an obstacle of the ground by flexibilities, see `surfaces`, not by a law."""
    return settings.law is None or (METHODS[settings.method].flexible and len(frame.stiffness) > 0)


def rubbing_of(name: str, settings: Contact, law: Coefficients, body: FlexibleBody) -> Rubbing:
    """Return the friction of the points of a contact, see `Model.touch_friction`.

    Args:
        law: By which a point presses.

    Raises:
        SceneError: it has two coefficients.
    """
    friction = settings.friction
    if friction is None:
        return 0.0, 1.0, 0.0, 0.0
    if friction.sliding < friction.static:
        raise SceneError(
            f"contact.{name}.friction.kinetic: {friction.sliding:g} given and static {friction.static:g}, and"
            " bodies turn by any angle (integrator 'turning'), where friction has one coefficient; remove kinetic"
        )
    if friction.speed is not None:
        return friction.static, friction.speed, 0.0, 0.0
    stiffness = STICKING * law.exponent * law.stiffness * (USUAL * body.gyration) ** (law.exponent - 1)
    return friction.static, 1.0, friction.stiffness or stiffness, WAY * body.gyration


def belt_of(settings: Contact) -> tuple[float, float, float]:
    """Return the velocity of the surface that points of a contact rub on, which lies in its plane [m/s]."""
    against = settings.against
    if not isinstance(against, Plane) or settings.friction is None:
        return 0.0, 0.0, 0.0
    normal, velocity = unit(against.normal), np.asarray(against.velocity, float)
    x, y, z = map(float, velocity - (velocity @ normal) * normal)
    return x, y, z


def section_arrays(sections: list[Section]) -> dict[str, np.ndarray]:
    """Return the arrays of sections, by their names in `Model`."""
    arrays = {
        "touch_pair": np.array([s.pair for s in sections], np.int64),
        "touch_shape": np.array([s.shape for s in sections], np.int64),
        "touch_size": np.array([s.size for s in sections], float).reshape(-1, 3),
        "touch_law": np.array([s.law for s in sections], float).reshape(-1, 4),
        "touch_friction": np.array([s.friction for s in sections], float).reshape(-1, 4),
        "touch_belt": np.array([s.belt for s in sections], float).reshape(-1, 3),
    }
    tables = [s.yielding.table if s.yielding else None for s in sections]
    return arrays | worn_arrays([s.worn for s in sections]) | yielding_arrays(tables)


def refuse_overlap(system: System, depths: np.ndarray, tracks: list[Track], size: float) -> None:
    """Raise a SceneError where points of a contact are inside their obstacle as the joints place the bodies.

    Args:
        depths: Of all sections [m], (c,).
        size: Of the mechanism [m].
    """
    for contact, track in zip(system.contacts, tracks, strict=True):
        gaps, against = depths[track.sections], system.scene.contact[contact.name].against
        if (overlapping := gaps > TOUCHING * size).any():
            partner = getattr(against, "body", contact.body)
            room = against.clearance.format(name=contact.name, body=partner)
            raise SceneError(
                f"contact.{contact.name}: {int(overlapping.sum())} of {len(gaps)} points start inside the obstacle, the"
                f" worst by {gaps.max():.3g} m; move body.{contact.body}.position, or {room}"
            )


def rows_of(body: FlexibleBody, frame: Frame, contact: ContactRows) -> np.ndarray:
    """Return the displacement of the points of a contact per elastic coordinate, (c, 6, m): a point has no rotation."""
    m, c = len(frame.stiffness), len(contact.points)
    rows = np.zeros((c, 6, m))
    if not m:
        return rows
    modes = body.modal.interfaces[contact.interface]
    if modes.tangents is None or modes.tangential_rows is None:
        raise SceneError(
            f"contact.{contact.name}: the record of the modes of body '{body.name}' has no tangential rows of"
            f" '{contact.interface}', which a body that turns needs; run the stage modes of this scene again"
        )
    rows[:, :3] = modes.normals[:, :, None] * modes.rows[:, None]
    rows[:, :3] += np.einsum("cti,ctm->cim", modes.tangents, modes.tangential_rows)
    for point, moved in zip(contact.points, rows, strict=True):
        moved[:3] -= frame.shift + np.cross(frame.turn, point - body.morph.centre, axisa=0, axisc=0)
    return rows
