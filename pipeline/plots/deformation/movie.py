"""`impact.mp4` of solid bodies: all bodies in an impact, gaps and deformation magnified alike, above the force."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pyvista as pv
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.plots.base import film, style, view
from gudgeon.pipeline.plots.base.hardest import hardest
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.base.surface import Skin, Thread, skin_of, thread_of
from gudgeon.pipeline.plots.contact.force_axes import shown_force
from gudgeon.pipeline.plots.deformation.landing import Landing, landing
from gudgeon.pipeline.plots.deformation.obstacle import FACE, WALL, faces, opposite
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
    """Those of all contacts, by the body that meets them."""
    wall: Skin | None
    """The obstacle opposite the contact surface, where rigid motion is magnified like the deformation."""


def draw_movie(drawing: Drawing) -> None:
    """Make one movie of all bodies, if a contact acts on a solid one."""
    struck = [body.name for body in drawing.shaped(drawing.touched(3))]
    if not struck:
        return
    script = _script(drawing, struck)
    with style.styled(), drawing.file("impact.mp4") as path:
        figure, axes = _ground(drawing, script)
        stage = film.Stage(BOX, [axes])
        _set_up(stage, script)
        film.shoot(path, figure, stage, script.frames, _mover(drawing, script))


def _actors(drawing: Drawing) -> list[Actor]:
    """Return all bodies: solids as skins, bars and beams as lines, rigid bodies as points."""
    found = []
    for name in drawing.trajectory.bodies:
        body = drawing.body(name)
        if cell_of(body.mesh).dimension == 3 and body.modal.shapes is not None:
            found.append(Actor(*skin_of(body, TRIANGLES), drawing.position(name)))
        else:
            found.append(Actor(*thread_of(body), drawing.position(name)))
    return found


def _script(drawing: Drawing, struck: list[str]) -> Script:
    """Choose frames around the contacts, and one scale for all of them."""
    trajectory = drawing.trajectory
    most = hardest(trajectory, [contact for name in struck for contact in drawing.contacts_on(name)])
    assert most is not None
    lead = next((name for name in struck if name == trajectory.contacts[most.contact].body), None)
    lead = lead or next(name for name in struck if most.contact in drawing.contacts_on(name))
    times, pressed = trajectory.frame_times, np.sum([drawing.frame_force(name) for name in struck], axis=0)
    first, last = style.contact_span(times, pressed, 0.35)
    within = np.flatnonzero((times >= first) & (times <= last))
    if len(within) < FRAMES // 4:
        within = np.arange(len(times))
    frames = within[np.unique(np.linspace(0, len(within) - 1, FRAMES).round().astype(int))]
    actors = _actors(drawing)
    solid = [actor for actor in actors if actor.body.size > 0]
    limits = [max(_longest(actor.body.elastic(frame)) for frame in frames) for actor in solid]
    travel = max(_longest(actor.body.total(frame)) for actor in actors for frame in frames)
    sizes = [style.SHOWN * actor.body.size for actor in solid]
    alone = min(style.nice_scale(size, limit) for size, limit in zip(sizes, limits, strict=True) if limit > 0)
    together = style.nice_scale(max(sizes), travel)
    carries = bool(drawing.scene.get("motion")) and travel > CARRIED * min(actor.body.size for actor in solid)
    actor = next(actor for actor in actors if actor.body.name == lead)
    assert isinstance(actor.drawn, Skin)
    moment = moment_of(drawing, drawing.body(lead), actor.body, actor.drawn)
    places = [(one.body, one.position) for one in actors]
    falls = None if carries else landing(drawing, places, frames, moment.frame)
    travels = together >= LEAST_ELASTIC * alone and not carries and falls is None
    scale = min(together, alone) if travels else alone
    meets = drawing.scene["contact"][most.contact]["against"]["shape"] in ("body", "surface")
    wall = opposite(drawing, most.contact, TRIANGLES, scale) if travels and not meets else None
    force, window = shown_force(trajectory, most.contact)
    return Script(
        actors, moment, frames, scale, travels, carries, landing=falls, limit=max(limits), contact=most.contact,
        meets=meets, force=np.linalg.norm(force, axis=1), window=window, planes=_planes(drawing), wall=wall,
    )  # fmt: skip


def _planes(drawing: Drawing) -> dict[str, list[Plane]]:
    """Return the planes that contacts of a scene meet, by body."""
    found: dict[str, list[Plane]] = {}
    for contact in drawing.scene["contact"].values():
        if contact["against"]["shape"] == "plane":
            found.setdefault(contact["body"], []).append(Plane.model_validate(contact["against"]))
    return found


def _longest(displacement: np.ndarray) -> float:
    return float(np.linalg.norm(displacement, axis=1).max())


def _set_up(stage: film.Stage, script: Script) -> None:
    """Add bodies and obstacle to the scene and aim the camera."""
    moment, plotter, seen = script.moment, stage.plotter, []
    for actor in script.actors:
        actor.drawn.move(actor.body.nodes + actor.position)
        actor.drawn.colour(np.linalg.norm(actor.body.elastic(moment.frame), axis=1))
        if isinstance(actor.drawn, Skin):
            view.add_skin(plotter, actor.drawn, style.MAGNITUDE, (0.0, script.limit or 1.0), 1.8)
        else:
            view.add_thread(plotter, actor.drawn, style.MAGNITUDE, (0.0, script.limit or 1.0))
        seen.append(actor.drawn.points)
    if script.carries:
        passed = script.frames[:: max(1, len(script.frames) // PASSED)]
        for actor in script.actors:
            swept = np.concatenate([actor.drawn.points + actor.body.rigid(frame) for frame in passed])
            seen.append(swept)
            for face in faces(script.planes.get(actor.body.name, []), swept):
                plotter.add_mesh(face, color=FACE, opacity=0.35, ambient=0.4, show_edges=True, edge_color=style.FAINT)
                seen.append(np.asarray(face.points))
    if script.landing is not None:
        _add_planes(plotter, script, script.landing, seen)
    if (wall := script.wall) is not None:
        plotter.add_mesh(wall.surface, color=WALL, culling="front", ambient=0.5, smooth_shading=True)
        view.add_edges(plotter, wall.edges, style.FAINT, 2.4)
        seen.append(wall.points)
    magnitude = np.linalg.norm(moment.body.elastic(moment.frame), axis=1)
    stacked = (script.meets or script.landing is not None) and abs(moment.outward @ moment.up) > view.STEEP
    angle = LEVEL if stacked else STEEP
    angle = angle if elevation(moment.body.nodes, moment.up, magnitude) > 0 or stacked else -angle
    view.aim(plotter, view.looking(moment.outward, moment.up, -75.0, angle), np.concatenate(seen))


def _add_planes(plotter: pv.Plotter, script: Script, falls: Landing, seen: list[np.ndarray]) -> None:
    """Add the planes that press, around the bodies in all frames, and what is seen of both to `seen`."""
    passed = script.frames[:: max(1, len(script.frames) // PASSED)]
    for actor in script.actors:
        swept = [falls.places(actor.body, actor.position, frame, script.scale) for frame in passed]
        seen.append(np.concatenate(swept))
        for face in faces(falls.planes.get(actor.body.name, []), seen[-1]):
            plotter.add_mesh(face, color=FACE, opacity=0.35, ambient=0.4, show_edges=True, edge_color=style.FAINT)
            seen.append(np.asarray(face.points))


def _mover(drawing: Drawing, script: Script) -> Callable[[int], film.Shot]:
    """Return a function that moves all bodies to a frame."""
    trajectory = drawing.trajectory
    shown, time_name = style.time_unit(float(trajectory.times[-1]))
    newtons, force_unit = style.prefixed(float(script.force.max()), "N")

    def turn_to(frame: int) -> film.Shot:
        for actor in script.actors:
            elastic = actor.body.elastic(frame)
            if script.landing is not None:
                actor.drawn.move(script.landing.places(actor.body, actor.position, frame, script.scale))
                actor.drawn.colour(np.linalg.norm(elastic, axis=1))
                continue
            moved = script.scale * (actor.body.total(frame) if script.travels else elastic)
            moved = moved + actor.body.rigid(frame) if script.carries else moved
            actor.drawn.move(actor.body.nodes + actor.position + moved)
            actor.drawn.colour(np.linalg.norm(elastic, axis=1))
        time = float(trajectory.frame_times[frame])
        force = float(np.interp(time, trajectory.times, script.force)) * newtons
        return film.Shot(time * shown, f"{style.digits(time * shown)} {time_name}     {force:.2f} {force_unit}")

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
    factor, falls = style.magnified(script.scale), script.landing
    what = f"gaps and deformation × {factor}" if script.travels else f"elastic deformation × {factor}"
    what += f", {style.CAPPED}  ·  "
    what += "bodies " * (len(script.actors) > 1) + ", ".join(_caption(actor) for actor in script.actors)
    if falls is not None:
        what += f"; rigid motion and gaps × {style.magnified(falls.scale)}"
    elif not script.travels:
        what += "; rigid motion as it is" if script.carries else "; rigid motion not shown"
    grey = script.wall is not None or (falls is not None and falls.planes) or (script.carries and script.planes)
    return what + "; grey: obstacle" * bool(grey)


def _caption(actor: Actor) -> str:
    """Return a body's name, and what it is drawn as if that is not its surface."""
    if isinstance(actor.drawn, Skin):
        return actor.body.name
    return f"{actor.body.name} (drawn as {'a line' if actor.drawn.lines else 'points'})"
