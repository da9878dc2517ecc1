"""Wear of contacts: force times sliding distance at every point, and over the traction spaces that points slide over.

Of every frame each point's impulse ∫ F dt is that of the integrator, to round-off. It slides by the mean speed of the
frame's samples, weighted by the resultant of the contact: V = k/H ∫ F |v| dt is exact where the speed is constant over
a frame. Speeds are those of the rigid motions; what the surfaces slide by deforming is neglected. Points that stick
slide by nothing, although what they stick by vibrates.
"""

from collections.abc import Sequence

import numpy as np

from gudgeon.modaldb.records.types import Json
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.integrators.outcome import Samples
from gudgeon.solver.integrators.steps import Schedule
from gudgeon.solver.obstacles import Plane
from gudgeon.solver.results.contact_events import Quantity, named
from gudgeon.solver.system.system import System

STICKS = 0.999
"""Friction over its limit, at both ends of a frame, below which a point sticks in that frame, if it is slow."""
SLOW = 1e-2
"""Mean speed of a point over a frame below which it is slow, over its largest."""


def wears(system: System) -> bool:
    """Whether a contact of a scene wears."""
    return any(c.wear is not None for c in system.scene.contact.values())


def rubbed(
    system: System, schedule: Schedule, samples: Samples, impulses: np.ndarray, forces: tuple[np.ndarray, np.ndarray]
) -> Json:
    """Return what contacts that wear rubbed, `CONTACT` → sums.

    Args:
        impulses: Of every point until the end of each frame [N s], (f, c).
        forces: Normal force and friction of every point at each frame [N], (f, c) and (f, c, 3).

    Returns:
        `load_distance`: force times sliding distance of each point [N m]; `against_load_distance`: the same of each
        function of the traction space, in the order of the record, where the points slide over one.
    """
    sums: Json = {}
    for i, contact in enumerate(system.contacts):
        wear = system.scene.contact[contact.name].wear
        if wear is None:
            continue
        span = slice(0, len(impulses) * schedule.samples_per_frame)
        resultants = np.linalg.norm(samples.forces[span, i], axis=1)
        counts = schedule.interval * np.arange(1, len(resultants) + 1) > wear.after
        speeds = _speeds(system, contact, samples.snapshots[span])
        shape = len(impulses), schedule.samples_per_frame
        weights = _weights(resultants.reshape(shape), counts.reshape(shape))
        normal_impulses = np.diff(impulses[:, contact.rows], axis=0, prepend=0.0)
        mean_speeds = np.einsum("fs,fsc->fc", weights, speeds.reshape(*shape, -1))
        slide = np.maximum(normal_impulses, 0.0) * mean_speeds
        if contact.name in system.rubbing:
            slow = mean_speeds < SLOW * speeds.max(axis=0, initial=0.0)
            slide[slow & _stuck(system, contact, *forces)] = 0.0
        sums[contact.name] = {"load_distance": slide.sum(axis=0).tolist()}
        if contact.master is not None:
            positions = _places(system, contact, samples.snapshots[span]).reshape(shape)
            mean_positions = (weights * positions).sum(axis=1) / np.maximum(weights.sum(axis=1), np.finfo(float).tiny)
            sums[contact.name]["against_load_distance"] = _over_functions(contact, mean_positions, slide).tolist()
    return sums


def _stuck(system: System, contact: ContactRows, normal: np.ndarray, friction: np.ndarray) -> np.ndarray:
    """Return whether points stick at the start and at the end of each frame, (f, c)."""
    limits = system.friction[contact.rows, 1] * normal[:, contact.rows]
    at_ends = np.linalg.norm(friction[:, contact.rows], axis=2) < STICKS * limits
    at_ends[1:] &= at_ends[:-1].copy()
    at_ends[0] = False
    return at_ends


def worn_quantities(system: System, sums: Json) -> Json:
    """Return volumes and the largest depths that the run wears off, `CONTACT.name` → {"value", "unit"}."""
    json: Json = {}
    for contact in system.contacts:
        wear = system.scene.contact[contact.name].wear
        if wear is None or contact.areas is None:
            continue
        slide = np.array(sums[contact.name]["load_distance"])
        volumes = wear.coefficient / wear.hardness * slide
        with np.errstate(divide="ignore", invalid="ignore"):
            depths = np.where(contact.areas > 0, volumes / contact.areas, 0.0)
        values: dict[str, Quantity] = {"load_distance": (float(slide.sum()), "N m")}
        values |= {"wear_volume": (float(volumes.sum()), "m^3"), "wear_depth": (float(depths.max()), "m")}
        if contact.master is not None:
            volume = wear.against_coefficient / wear.hardness * float(slide.sum())
            values["against_wear_volume"] = (volume, "m^3")
        json |= named(contact.name, values)
    return json


def _weights(forces: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return the weight of each sample in its frame, (f, s): share of the resultant, where the sample counts."""
    total = forces.sum(axis=1, keepdims=True)
    even = np.full(forces.shape, 1.0 / forces.shape[1])
    return np.where(total > 0, forces / np.where(total > 0, total, 1.0), even) * counts


def _speeds(system: System, contact: ContactRows, snapshots: np.ndarray) -> np.ndarray:
    """Return the mean sliding speed of each point in every sample interval [m/s], (s, c)."""
    velocity = np.zeros((len(snapshots) + 1, len(contact.points), 3))
    placed = contact.points + np.asarray(system.scene.body[contact.body].position)
    sides: Sequence[tuple[str | None, float]] = (
        (contact.body, 1.0), (None if contact.master is None else contact.master.body, -1.0),
        (None if contact.other is None else contact.other.body, -1.0),
    )  # fmt: skip
    for name, sign in sides:
        if name is not None and system.bodies[name].rigid_count:
            centre = system.bodies[name].morph.centre + np.asarray(system.scene.body[name].position)
            motion = _motions(system, name, snapshots, rates=True)
            arms = placed - centre
            velocity += sign * (motion[:, None, :3] + np.cross(motion[:, None, 3:], arms[None]))
    against = system.scene.contact[contact.name].against
    if isinstance(against, Plane):
        velocity -= np.asarray(against.velocity, float)
    along = np.einsum("sci,ci->sc", velocity, contact.directions)
    speeds = np.linalg.norm(velocity - along[:, :, None] * contact.directions, axis=2)
    return 0.5 * (speeds[:-1] + speeds[1:])


def _motions(system: System, name: str, snapshots: np.ndarray, *, rates: bool) -> np.ndarray:
    """Return motions of a body's centre, or their rates, at the start and at the end of every sample, (s + 1, 6)."""
    body, r = system.bodies[name], len(system.rigid)
    columns = np.searchsorted(system.rigid, np.arange(len(system.velocity))[body.rigid])
    start = (system.velocity if rates else system.position)[body.rigid]
    return body.centre_motion(np.vstack([start, snapshots[:, (r if rates else 0) + columns]]))


def _places(system: System, contact: ContactRows, snapshots: np.ndarray) -> np.ndarray:
    """Return how far the points have slid along their traction space in the middle of each sample [m], (s,)."""
    assert contact.master is not None
    slid = np.zeros(len(snapshots) + 1)
    for name, sign in ((contact.body, 1.0), (contact.master.body, -1.0)):
        if system.bodies[name].rigid_count:
            slid += sign * _motions(system, name, snapshots, rates=False)[:, :3] @ contact.master.direction
    return 0.5 * (slid[:-1] + slid[1:])


def _over_functions(contact: ContactRows, positions: np.ndarray, slide: np.ndarray) -> np.ndarray:
    """Return what points at places (f,) rubbed (f, c) over the functions of their traction space [N m], (F,)."""
    surface = contact.master
    assert surface is not None
    distribution = np.zeros(len(surface.order))
    for position, amounts in zip(positions, slide, strict=True):
        if amounts.any():
            numbers, weights, beside = surface.weights(float(position))
            np.add.at(distribution, numbers, weights * np.where(beside, 0.0, amounts)[:, None, None])
    return distribution[np.argsort(surface.order)]
