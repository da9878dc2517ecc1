"""What a film of bodies shows: its times, its bodies, how their motion is magnified, and the obstacles beside them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.hardest import Hardest, hardest
from gudgeon.pipeline.plots.base.pace import Pace, at_times, closed_spans, pace_of
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.base.surface import Skin, Thread, skin_of, thread_of
from gudgeon.pipeline.plots.contact.force_axes import shown_force
from gudgeon.pipeline.plots.deformation.landing import Landing, landing
from gudgeon.pipeline.plots.deformation.obstacle import opposite, planes_of
from gudgeon.pipeline.plots.deformation.solid import Moment, moment_of
from gudgeon.solver.obstacles.plane import Plane

FRAMES, LEAST_FRAMES = 120, 40
"""Frames of a film at most and at least; between, twice as many as the run has stored."""
TRIANGLES = 20_000
"""Number at which software rendering takes 0.1 s per frame."""
CARRIED = 0.1
"""Way of driven bodies over the size of the smallest body from which on it is shown as it is."""
LEAST_ELASTIC = 0.05
"""Rigid motion is omitted where it limits the scale to less than this share of the elastic part's own."""
COMMON = 99.0
"""Percentile of the points' largest displacements in the film that has the last colour."""
FLIGHT = 1.0
"""Least time shown before and after the contacts, of the time between the first and the last."""


@dataclass(frozen=True)
class Actor:
    """One body in the film."""

    body: BodyMotion
    """On the points of what is drawn."""
    drawn: Skin | Thread
    position: np.ndarray
    """Of its origin in the scene [m], (3,)."""

    @property
    def caption(self) -> str:
        """The body's name, and what it is drawn as if that is not its surface."""
        if isinstance(self.drawn, Skin):
            return self.body.name
        return f"{self.body.name} (drawn as {'a line' if self.drawn.lines else 'points'})"


class Curve(NamedTuple):
    """What is drawn over time below the bodies."""

    times: np.ndarray
    """[s], (t,)"""
    values: np.ndarray
    """(t,)"""
    unit: str
    name: str
    """Of the axis."""
    label: str


@dataclass(frozen=True)
class Script:
    """Content of the film."""

    drawing: Drawing
    """With the frames of the film."""
    pace: Pace
    actors: list[Actor]
    moment: Moment[Skin | Thread]
    """Of the body with the hardest contact, or without contact of the one that deforms most."""
    scale: float
    travels: bool
    """Whether rigid motion is shown, magnified like the deformation, with an obstacle of another shape than a plane."""
    carries: bool
    """Whether rigid motion is shown as it is, with the planes of the scene, since drives carry bodies far."""
    landing: Landing | None
    """How rigid motion is shown where it is magnified otherwise than the deformation, with the planes that press."""
    limit: float
    """Elastic displacement of the last colour [m]."""
    exceeded: bool
    """Whether some are larger."""
    curve: Curve
    meets: bool
    """Whether the hardest contact is with another body."""
    planes: dict[str, list[Plane]]
    """Those that are drawn, by the body that meets them."""
    wall: Skin | None
    """The obstacle opposite the contact surface, where rigid motion is magnified like the deformation."""

    def points(self, actor: Actor, frame: int, scale: float) -> np.ndarray:
        """Return where the points of a body are drawn [m], (p, 3), its deformation magnified by `scale`."""
        if self.landing is not None:
            return self.landing.places(actor.body, actor.position, frame, scale)
        moved = scale * (actor.body.total(frame) if self.travels else actor.body.elastic(frame))
        return actor.body.nodes + actor.position + (moved + actor.body.rigid(frame) if self.carries else moved)


class Extents(NamedTuple):
    """Sizes and displacements of bodies over frames."""

    limit: float
    """Elastic displacement of all but a few points [m]."""
    largest: float
    """Of all of them [m]."""
    travel: float
    """Largest displacement [m]."""
    smallest: float
    """Size of the smallest body [m]."""
    alone: float
    """Factor of the deformation, and of all displacement together, that can be shown."""
    together: float


def script_of(drawing: Drawing) -> Script | None:
    """Choose the times of the film, and one scale for all of them; None where no body with an extent moves."""
    lead = _lead(drawing)
    if lead is None or len(drawing.trajectory.frame_times) < 2:
        return None
    strongest, name = lead
    pace = _pace(drawing, strongest)
    drawing = at_times(drawing, pace.times)
    if strongest is not None:
        strongest = hardest(drawing.trajectory, [strongest.contact])
    actors = _actors(drawing, [*drawing.trajectory.bodies])
    sizes = _extents(actors, np.arange(len(pace.times)))
    if sizes is None:
        return None
    actor = next(actor for actor in actors if actor.body.name == name)
    moment = moment_of(drawing, drawing.body(name), actor.body, actor.drawn)
    return Script(
        drawing, pace, actors, moment, limit=sizes.limit, exceeded=sizes.largest > sizes.limit * (1 + 1e-9),
        curve=_curve(drawing, actors, strongest), **_magnified(drawing, actors, moment, sizes, strongest),
    )  # fmt: skip


def _magnified(
    drawing: Drawing, actors: Sequence[Actor], moment: Moment[Skin | Thread], sizes: Extents, strongest: Hardest | None
) -> dict[str, Any]:
    """Return how the motion of bodies is magnified, and the obstacles beside them, as `Script` names them."""
    carries, landed, frames = False, None, np.arange(len(drawing.trajectory.frame_times))
    if drawing.scene.get("motion"):
        carries = sizes.travel > CARRIED * sizes.smallest
    if not carries:
        landed = landing(drawing, [(a.body, a.position) for a in actors], frames, moment.frame, strongest)
    travels = sizes.together >= LEAST_ELASTIC * sizes.alone and not carries and landed is None
    scale = min(sizes.together, sizes.alone) if travels else sizes.alone
    meets = strongest is not None and _against(drawing, strongest.contact) in ("body", "surface")
    wall = opposite(drawing, strongest.contact, TRIANGLES, scale) if travels and strongest and not meets else None
    planes = landed.planes if landed is not None else planes_of(drawing) if carries else {}
    return {
        "scale": scale, "travels": travels, "carries": carries, "landing": landed, "meets": meets, "planes": planes,
        "wall": wall,
    }  # fmt: skip


def _against(drawing: Drawing, contact: str) -> str:
    return drawing.scene["contact"][contact]["against"]["shape"]


def _lead(drawing: Drawing) -> tuple[Hardest | None, str] | None:
    """Return the largest force of the contacts on bodies that deform, and on which of them, that of the contact if it
    is one; without contact the body that deforms most."""
    deformed = [name for dimension in (3, 2, 1) for name in drawing.deformed(dimension)]
    deformed = [body.name for body in drawing.shaped(deformed)]
    contacts = {name: drawing.contacts_on(name) for name in deformed}
    strongest = hardest(drawing.trajectory, [contact for touching in contacts.values() for contact in touching])
    if strongest is None:
        return (None, deformed[0]) if deformed else None
    body = drawing.trajectory.contacts[strongest.contact].body
    return strongest, body if body in deformed else next(n for n in deformed if strongest.contact in contacts[n])


def _pace(drawing: Drawing, strongest: Hardest | None) -> Pace:
    """Return the times of the film: around the contacts of a run, half of them while bodies touch."""
    trajectory = drawing.trajectory
    start, stop = float(trajectory.frame_times[0]), float(trajectory.frame_times[-1])
    spans = closed_spans(trajectory, trajectory.contacts) if strongest is not None else []
    count = int(np.clip(2 * len(trajectory.frame_times), LEAST_FRAMES, FRAMES))
    if strongest is None or not spans:
        return pace_of((start, stop), [], count)
    flight = FLIGHT * (spans[-1][1] - spans[0][0])
    span = max(start, spans[0][0] - flight), min(stop, spans[-1][1] + flight)
    return pace_of(span, spans, count, [strongest.time])


def _actors(drawing: Drawing, names: Sequence[str]) -> list[Actor]:
    """Return bodies: solids and plates as skins, bars and beams as lines, rigid bodies as points."""
    actors = []
    for body in map(drawing.body, names):
        skinned = cell_of(body.mesh).dimension > 1 and body.modal.shapes is not None and body.modal.shapes.size
        actors.append(Actor(*(skin_of(body, TRIANGLES) if skinned else thread_of(body)), drawing.position(body.name)))
    return actors


def _extents(actors: list[Actor], frames: np.ndarray) -> Extents | None:
    def largest(displacement: Callable[[int], np.ndarray]) -> float:
        return max(float(np.linalg.norm(displacement(frame), axis=1).max()) for frame in frames)

    travel = max(largest(actor.body.total) for actor in actors)
    peaks = [np.max([np.linalg.norm(a.body.elastic(f), axis=1) for f in frames], axis=0) for a in actors]
    solid = [(actor.body.size, values) for actor, values in zip(actors, peaks, strict=True) if actor.body.size > 0]
    if not solid or not any(values.any() for _, values in solid):
        return None
    sizes, values = zip(*solid, strict=True)
    limit = max(float(np.percentile(value, COMMON)) for value in values)
    tops = [float(value.max()) for value in values]
    alone = min(style.nice_scale(style.SHOWN * size, top) for size, top in zip(sizes, tops, strict=True) if top > 0)
    together = style.nice_scale(style.SHOWN * max(sizes), travel)
    return Extents(limit, max(tops), travel, min(sizes), alone, together)


def _curve(drawing: Drawing, actors: Sequence[Actor], strongest: Hardest | None) -> Curve:
    """Return the force of the hardest contact, or without contact the largest elastic displacement."""
    trajectory = drawing.trajectory
    if strongest is not None:
        force, window = shown_force(trajectory, strongest.contact)
        return Curve(trajectory.times, np.linalg.norm(force, axis=1), "N", "force",
                     f"contact {strongest.contact}, {window}")  # fmt: skip
    frames = range(len(trajectory.frame_times))
    tops = [max(float(np.linalg.norm(a.body.elastic(k), axis=1).max()) for a in actors) for k in frames]
    return Curve(trajectory.frame_times, np.array(tops), "m", "deformation", "largest elastic displacement")
