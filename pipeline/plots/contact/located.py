"""Contacts with located impacts, prepared for drawing: impacts, force, and motion of the points in contact."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gudgeon.modaldb.records.modes import InterfaceModes
from gudgeon.modaldb.records.trajectory import ContactHistory, Trajectory
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.solver.obstacles import obstacle_of
from gudgeon.solver.vectors import length_across

BRIEF = 5.0
"""Sample intervals: of a shorter impact samples resolve only the impulse, not the force."""
FEW = 20.0
"""Sample intervals that a picture covers at least."""
MARGIN = 0.25
"""Margin before the first impact and after the last, of the time between them."""
SHARE = 0.05
"""Share of all impulse above which brief impacts are drawn by their impulses."""
ALONE = 0.6
"""Margin of a single impact, of its duration."""


@dataclass(frozen=True)
class Side:
    """A point in contact."""

    body: str
    interface: str
    point: int
    """Its number among the interface's."""

    @property
    def label(self) -> str:
        """Body and interface."""
        return f"{self.body}, {self.interface}"


@dataclass(frozen=True)
class Touch:
    """A contact at its point of largest impulse."""

    name: str
    trajectory: Trajectory
    side: Side
    partner: Side | None
    """On the other body; None against an obstacle."""
    direction: np.ndarray
    """Unit vector of the normal force on the body, (3,)."""
    gap: float
    """At the start [m]."""

    @property
    def contact(self) -> ContactHistory:
        """History of the contact."""
        return self.trajectory.contacts[self.name]

    @property
    def interval(self) -> float:
        """Sample interval [s]."""
        return float(self.trajectory.times[1] - self.trajectory.times[0])

    @cached_property
    def impacts(self) -> np.ndarray:
        """Impacts as in `Trajectory.impacts`, (b, 9)."""
        return self.trajectory.impacts[self.name]

    @cached_property
    def brief(self) -> np.ndarray:
        """Whether each impact is drawn by its impulse alone: it has no duration, or samples do not resolve it, (b,)."""
        lengths = self.impacts[:, 1] - self.impacts[:, 0]
        return (self.impacts[:, 3] == 0) | (lengths < BRIEF * self.interval)

    @property
    def impulsive(self) -> bool:
        """Whether the impulses of brief impacts are large enough to be drawn."""
        return bool(self.impacts[self.brief, 2].sum() > SHARE * self.impacts[:, 2].sum())

    @cached_property
    def lasting_force(self) -> np.ndarray:
        """Force along the direction in lasting impacts, zero in samples that brief impacts reach [N], (s,)."""
        force = self.contact.force @ self.direction
        if not self.brief.any():
            return force
        ends, lasting = self.trajectory.times, np.zeros(len(force), bool)
        for impact in self.impacts[~self.brief]:
            lasting |= (ends - self.interval >= impact[0] - 1e-9 * self.interval) & (ends <= impact[1] + self.interval)
        for impact in self.impacts[self.brief]:
            lasting &= (ends < impact[0]) | (ends - self.interval > impact[1])
        return np.where(lasting, force, 0.0)

    @property
    def span(self) -> tuple[float, float]:
        """Time span of the picture [s]: the impacts with a margin, or the whole run if they are short."""
        end = float(self.trajectory.times[-1])
        start, stop = float(self.impacts[:, 0].min()), float(self.impacts[:, 1].max())
        if stop - start < FEW * self.interval:
            return 0.0, end
        margin = (ALONE if len(self.impacts) == 1 else MARGIN) * (stop - start)
        return max(0.0, start - margin), min(end, stop + margin)


@dataclass(frozen=True)
class Course:
    """Motion of a point along one direction."""

    label: str
    times: np.ndarray
    """[s], (t,)"""
    place: np.ndarray
    """Position relative to its start [m], (t,)."""


def touches(drawing: Drawing) -> list[Touch]:
    """Return the contacts with impacts that the scene describes."""
    contacts = [touch_of(drawing, name) for name, impacts in drawing.trajectory.impacts.items() if len(impacts)]
    return [touch for touch in contacts if touch is not None]


def touch_of(drawing: Drawing, name: str) -> Touch | None:
    """Return a contact at its point of largest impulse; None if the scene does not describe its obstacle or points."""
    contact, settings = drawing.trajectory.contacts[name], drawing.scene.get("contact", {}).get(name)
    if settings is None or settings["against"]["shape"] == "surface":
        return None
    point = int(contact.multipliers.sum(axis=0).argmax()) if contact.multipliers.size else 0
    side, against = Side(contact.body, contact.interface, point), settings["against"]
    placed = contact.points + drawing.position(contact.body)
    if against["shape"] != "body":
        obstacle = obstacle_of(against)
        direction, gap = obstacle.direction(placed)[point], float(obstacle.gap(placed)[point])
        return Touch(name, drawing.trajectory, side, None, direction, gap)
    direction = -drawing.body(contact.body).modal.interfaces[contact.interface].normals[point]
    far = placed[point] - _placed(drawing, against["body"], against["interface"])
    partner = Side(against["body"], against["interface"], int(length_across(far, direction).argmin()))
    return Touch(name, drawing.trajectory, side, partner, direction, float(far[partner.point] @ direction))


def course(
    drawing: Drawing, side: Side, direction: np.ndarray, forces: np.ndarray | None, *, start: float = 0.0
) -> Course:
    """Return the motion of a point along a direction, at samples for a rigid body and at frames for an elastic one.

    Args:
        forces: Outward forces on the interface's residual flexibility at each frame [N], (f, c).
        start: Position at the start [m].
    """
    body, trajectory = drawing.body(side.body), drawing.trajectory
    if not len(body.modal.angular_frequencies):
        times, displacement = trajectory.times, rigid_course(drawing, side, direction)[0]
    else:
        interface = body.modal.interfaces[side.interface]
        count = len(body.morph.rigid_twists)
        rigid = body.coordinates[:, :count] @ (body.morph.rigid_twists @ _wrench(drawing, side, direction))
        outward = body.coordinates[:, count:] @ interface.rows[side.point]
        if forces is not None:
            outward = outward + forces @ _residual(drawing, body, side, interface)
        times, displacement = trajectory.frame_times, rigid + outward * (interface.normals[side.point] @ direction)
    return _course(drawing, side, times, displacement, start)


def _course(drawing: Drawing, side: Side, times: np.ndarray, displacement: np.ndarray, start: float) -> Course:
    """Return a course from the displacement of a point [m] at times [s], (t,) each, and its position undeformed [m].

    It begins at the start of the run unless loads deform the body there, which the record does not have.
    """
    run, elastic = drawing.scene["run"], len(drawing.modes(side.body, ["angular_frequencies"]).angular_frequencies)
    loaded = any(run["gravity"]) or drawing.scene["force"] or drawing.scene["motion"]
    if elastic and run["start"] == "rest" and loaded:
        return Course(side.label, times, displacement + start)
    return Course(side.label, np.append(0.0, times), np.append(0.0, displacement) + start)


def rigid_course(drawing: Drawing, side: Side, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return shift and speed of a point of a rigid body along a direction at samples [m, m/s], (s,) each."""
    wrench = _wrench(drawing, side, direction)
    motion = drawing.trajectory.motion.get(side.body, np.zeros((len(drawing.trajectory.times), 12)))
    return motion[:, :6] @ wrench, motion[:, 6:] @ wrench


def _wrench(drawing: Drawing, side: Side, direction: np.ndarray) -> np.ndarray:
    """Return the motion of a point along a direction per translation and rotation of the centre, (6,)."""
    morph = drawing.design(side.body, ["points", "centre"])
    return np.concatenate([direction, np.cross(morph.points[side.interface][side.point] - morph.centre, direction)])


def normal_courses(drawing: Drawing, touch: Touch) -> list[Course]:
    """Return the motion of both points along the contact's direction, relative to the start of the other point."""
    flexible = drawing.scene["contact"][touch.name].get("method") == "residual"
    forces = -touch.contact.multipliers if flexible else None
    path, times = touch.contact.path, touch.trajectory.times
    if path is not None:
        sides = [(touch.side, touch.gap)] + ([(touch.partner, 0.0)] if touch.partner else [])
        return [
            _course(drawing, side, times, displacement, start)
            for (side, start), displacement in zip(sides, path.T, strict=True)
        ]
    near_course = course(drawing, touch.side, touch.direction, forces, start=touch.gap)
    if touch.partner is None:
        return [near_course]
    if forces is not None:
        # Of the point of the body opposite each point of the other.
        mine = touch.contact.points + drawing.position(touch.side.body)
        far = _placed(drawing, touch.partner.body, touch.partner.interface)[:, None] - mine[None]
        forces = forces[:, length_across(far, touch.direction).argmin(axis=1)]
    return [near_course, course(drawing, touch.partner, touch.direction, forces)]


def _residual(drawing: Drawing, body: BodyMotion, side: Side, interface: InterfaceModes) -> np.ndarray:
    """Return the row of R of a point [m/N], (c,); zero if the reduction stores none."""
    modal = drawing.store.get(body.morph.modes_key, "modes", only=["residual_flexibility", "interface_rows"])
    if modal.residual_flexibility is None:
        return np.zeros(len(interface.nodes))
    start, stop = modal.interface_rows[side.interface]
    return modal.residual_flexibility[start + side.point, start:stop]


def _placed(drawing: Drawing, body: str, interface: str) -> np.ndarray:
    """Return the positions of an interface's points at the start [m], (c, 3)."""
    return drawing.design(body, ["points"]).points[interface] + drawing.position(body)
