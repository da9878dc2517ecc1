"""`impact.mp4` of solid bodies: all bodies in an impact, gaps and deformation magnified alike, above the force."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pyvista as pv
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.plots.base import film, style, view
from gudgeon.pipeline.plots.base.hardest import Hardest, hardest
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.base.surface import Skin, Thread, skin_of, thread_of
from gudgeon.pipeline.plots.contact.force_axes import shown_force
from gudgeon.pipeline.plots.deformation.landing import Landing, landing
from gudgeon.pipeline.plots.deformation.obstacle import FACE, WALL, faces, opposite, planes_of
from gudgeon.pipeline.plots.deformation.solid import Moment, elevation, moment_of
from gudgeon.solver.obstacles.plane import Plane

SIZE = (960, 720)
"""Of the movie [px]."""
BOX = (8, 80, 776, 548)
"""Left, upper, right, lower border of the rendered part [px]."""
FRAMES = 120
TRIANGLES = 20_000
"""Number at which software rendering takes 0.1 s per frame."""
CARRIED = 0.1
"""Way of driven bodies over the size of the smallest body from which on it is shown as it is."""
PASSED = 24
"""Frames whose places the camera sees, of bodies that are carried."""
STEEP, LEVEL = 64.0, 20.0
"""Elevation of the camera [deg] on the side of a contact, and where bodies meet one above the other."""
HEADROOM = 1.35
"""Height of the axes of the force over its largest value: the text stands above the curve."""
LEAST_ELASTIC = 0.05
"""Rigid motion is omitted where it limits the scale to less than this share of the elastic part's own."""


@dataclass(frozen=True)
class Actor:
    """One body in the movie."""

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


@dataclass(frozen=True)
class Script:
    """Content of the movie."""

    actors: list[Actor]
    moment: Moment
    """Of the body with the hardest contact."""
    frames: np.ndarray
    """Numbers of the frames."""
    scale: float
    travels: bool
    """Whether rigid motion is shown, magnified like the deformation, with an obstacle of another shape than a plane."""
    carries: bool
    """Whether rigid motion is shown as it is, with the planes of the scene, since drives carry bodies far."""
    landing: Landing | None
    """How rigid motion is shown where it is magnified otherwise than the deformation, with the planes that press."""
    limit: float
    """Largest elastic displacement [m]."""
    contact: str
    """Name of the hardest contact."""
    meets: bool
    """Whether it is with another body."""
    force: np.ndarray
    """Its size as in `force.png` [N], (s,)."""
    window: str
    """Over which it is a mean."""
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


def draw_movie(drawing: Drawing) -> None:
    """Make one movie of all bodies, if a contact acts on a solid one."""
    struck = [body.name for body in drawing.shaped(drawing.touched(3))]
    if not struck:
        return
    script = _script(drawing, struck)
    with style.styled(), drawing.file("impact.mp4") as path:
        figure, axes = _ground(drawing, script)
        stage = film.Stage(BOX)
        _set_up(stage, script)
        film.shoot(path, figure, BOX, script.frames, _mover(drawing, script, stage), curves=[axes])
        stage.plotter.close()


def _actors(drawing: Drawing) -> list[Actor]:
    """Return all bodies: solids as skins, bars and beams as lines, rigid bodies as points."""
    actors = []
    for body in map(drawing.body, drawing.trajectory.bodies):
        solid = cell_of(body.mesh).dimension == 3 and body.modal.shapes is not None
        actors.append(Actor(*(skin_of(body, TRIANGLES) if solid else thread_of(body)), drawing.position(body.name)))
    return actors


def _script(drawing: Drawing, struck: list[str]) -> Script:
    """Choose frames around the contacts, and one scale for all of them."""
    trajectory = drawing.trajectory
    strongest, lead = _lead(drawing, struck)
    frames, actors = _frames(drawing, struck), _actors(drawing)
    sizes = _extents(actors, frames)
    carries = bool(drawing.scene.get("motion")) and sizes.travel > CARRIED * sizes.smallest
    actor = next(actor for actor in actors if actor.body.name == lead)
    assert isinstance(actor.drawn, Skin)
    moment = moment_of(drawing, drawing.body(lead), actor.body, actor.drawn)
    landed = None if carries else landing(drawing, [(a.body, a.position) for a in actors], frames, moment.frame)
    travels = sizes.together >= LEAST_ELASTIC * sizes.alone and not carries and landed is None
    scale = min(sizes.together, sizes.alone) if travels else sizes.alone
    meets = drawing.scene["contact"][strongest.contact]["against"]["shape"] in ("body", "surface")
    wall = opposite(drawing, strongest.contact, TRIANGLES, scale) if travels and not meets else None
    force, window = shown_force(trajectory, strongest.contact)
    planes = landed.planes if landed is not None else planes_of(drawing) if carries else {}
    return Script(
        actors, moment, frames, scale, travels, carries, landing=landed, limit=sizes.limit, contact=strongest.contact,
        meets=meets, force=np.linalg.norm(force, axis=1), window=window, planes=planes, wall=wall,
    )  # fmt: skip


def _frames(drawing: Drawing, struck: list[str]) -> np.ndarray:
    """Return the numbers of frames around the contacts of bodies; all where there are few."""
    times, forces = drawing.trajectory.frame_times, np.sum([drawing.frame_force(name) for name in struck], axis=0)
    start, stop = style.contact_span(times, forces, 0.35)
    within = np.flatnonzero((times >= start) & (times <= stop))
    if len(within) < FRAMES // 4:
        within = np.arange(len(times))
    return within[film.evenly(len(within), FRAMES)]


def _lead(drawing: Drawing, struck: list[str]) -> tuple[Hardest, str]:
    """Return the largest force of the contacts on bodies, and on which of them: on that of the contact, if it is."""
    contacts = {name: drawing.contacts_on(name) for name in struck}
    strongest = hardest(drawing.trajectory, [contact for touching in contacts.values() for contact in touching])
    assert strongest is not None
    body = drawing.trajectory.contacts[strongest.contact].body
    return strongest, body if body in struck else next(n for n in struck if strongest.contact in contacts[n])


class Extents(NamedTuple):
    """Sizes and displacements of bodies over frames."""

    limit: float
    """Largest elastic displacement [m]."""
    travel: float
    """Largest displacement [m]."""
    smallest: float
    """Size of the smallest body [m]."""
    alone: float
    """Factor of the deformation, and of all displacement together, that can be shown."""
    together: float


def _extents(actors: list[Actor], frames: np.ndarray) -> Extents:
    def largest(displacement: Callable[[int], np.ndarray]) -> float:
        return max(float(np.linalg.norm(displacement(frame), axis=1).max()) for frame in frames)

    travel = max(largest(actor.body.total) for actor in actors)
    solid = [(actor.body.size, largest(actor.body.elastic)) for actor in actors if actor.body.size > 0]
    sizes, limits = zip(*solid, strict=True)
    alone = min(style.nice_scale(style.SHOWN * size, limit) for size, limit in solid if limit > 0)
    return Extents(max(limits), travel, min(sizes), alone, style.nice_scale(style.SHOWN * max(sizes), travel))


def _set_up(stage: film.Stage, script: Script) -> None:
    """Add bodies and obstacles to the scene and aim the camera."""
    moment, plotter, seen, limits = script.moment, stage.plotter, [], (0.0, script.limit or 1.0)
    for actor in script.actors:
        actor.drawn.move(actor.body.nodes + actor.position)
        actor.drawn.colour(np.linalg.norm(actor.body.elastic(moment.frame), axis=1))
        if isinstance(actor.drawn, Skin):
            view.add_skin(plotter, actor.drawn, style.MAGNITUDE, limits, 1.8)
        else:
            view.add_thread(plotter, actor.drawn, style.MAGNITUDE, limits)
        seen.append(actor.drawn.points)
    seen += _add_planes(plotter, script)
    if script.wall is not None:
        plotter.add_mesh(script.wall.surface, color=WALL, culling="front", ambient=0.5, smooth_shading=True)
        view.add_edges(plotter, script.wall.edges, style.FAINT, 2.4)
        seen.append(script.wall.points)
    magnitude = np.linalg.norm(moment.body.elastic(moment.frame), axis=1)
    stacked = (script.meets or script.landing is not None) and abs(moment.outward @ moment.up) > view.STEEP
    raised = elevation(moment.body.nodes, moment.up, magnitude) > 0
    angle = LEVEL if stacked else STEEP if raised else -STEEP
    view.aim(plotter, view.looking(moment.outward, moment.up, -75.0, angle), np.concatenate(seen))


def _add_planes(plotter: pv.Plotter, script: Script) -> list[np.ndarray]:
    """Add planes around the bodies in all frames, and return what is seen of both [m], (n, 3) each."""
    seen: list[np.ndarray] = []
    frames = script.frames[:: max(1, len(script.frames) // PASSED)] if script.carries or script.landing else []
    for actor in script.actors if len(frames) else ():
        scale = 0.0 if script.carries else script.scale
        seen.append(np.concatenate([script.points(actor, frame, scale) for frame in frames]))
        for wall in faces(script.planes.get(actor.body.name, []), seen[-1]):
            plotter.add_mesh(wall, color=FACE, opacity=0.35, ambient=0.4, show_edges=True, edge_color=style.FAINT)
            seen.append(np.asarray(wall.points))
    return seen


def _mover(drawing: Drawing, script: Script, stage: film.Stage) -> Callable[[int], film.Shot]:
    """Return a function that moves all bodies to a frame."""
    trajectory = drawing.trajectory
    shown, time_name = style.time_unit(float(trajectory.times[-1]))
    newtons, force_unit = style.prefixed(float(script.force.max()), "N")

    def turn_to(frame: int) -> film.Shot:
        for actor in script.actors:
            actor.drawn.move(script.points(actor, frame, script.scale))
            actor.drawn.colour(np.linalg.norm(actor.body.elastic(frame), axis=1))
        time = float(trajectory.frame_times[frame])
        force = float(np.interp(time, trajectory.times, script.force)) * newtons
        text = f"{style.digits(time * shown)} {time_name}     {force:.2f} {force_unit}"
        return film.Shot(time * shown, text, stage.photograph())

    return turn_to


def _ground(drawing: Drawing, script: Script) -> tuple[Figure, Axes]:
    """Return the static figure and its axes of the force."""
    trajectory = drawing.trajectory
    figure = style.new_figure(drawing.scene_name, _subtitle(script), width=SIZE[0], height=SIZE[1], dpi=film.DPI)
    axes = figure.add_axes((0.075, 0.085, 0.9, 0.14))
    style.magnitude_bar(figure, script.limit, "elastic displacement", "m", (0.85, 0.31, 0.016, 0.5))
    scale, name = style.prefixed(float(script.force.max()), "N")
    shown, time_name = style.time_unit(float(trajectory.times[-1]))
    axes.fill_between(trajectory.times * shown, script.force * scale, color=style.BLUE, alpha=0.12, lw=0)
    axes.plot(trajectory.times * shown, script.force * scale, color=style.BLUE, lw=1.8)
    ends = trajectory.frame_times[script.frames[[0, -1]]] * shown
    axes.set(xlim=ends, xlabel=f"time [{time_name}]", ylabel=f"force [{name}]")
    axes.set_ylim(0.0, HEADROOM * float(script.force.max()) * scale or 1.0)
    label = f"contact {script.contact}, {script.window}"
    axes.text(0.995, 0.95, label, transform=axes.transAxes, ha="right", va="top", color=style.FAINT)
    return figure, axes


def _subtitle(script: Script) -> str:
    """Return how the bodies and what they meet are drawn."""
    factor = style.magnified(script.scale)
    text = f"gaps and deformation × {factor}" if script.travels else f"elastic deformation × {factor}"
    text += f", {style.CAPPED}  ·  " + "bodies " * (len(script.actors) > 1)
    text += ", ".join(actor.caption for actor in script.actors)
    if script.landing is not None:
        text += f"; rigid motion and gaps × {style.magnified(script.landing.scale)}"
    elif not script.travels:
        text += "; rigid motion as it is" if script.carries else "; rigid motion not shown"
    return text + "; grey: obstacle" * (script.wall is not None or bool(script.planes))
