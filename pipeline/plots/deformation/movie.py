"""`impact.mp4` of a solid body: its motion in an impact, gaps and deformation magnified alike, above the force."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gudgeon.pipeline.measuring.force_window import hann_filter
from gudgeon.pipeline.plots.base import film, style, view
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.base.surface import Skin, make_skin
from gudgeon.pipeline.plots.contact.force_axes import WINDOW
from gudgeon.pipeline.plots.deformation.solid import Moment, elevation, strongest_moment

SIZE = (960, 720)
"""Of the movie [px]."""
BOX = (8, 80, 776, 548)
"""Left, upper, right, lower border of the rendered part [px]."""
FRAMES = 120
WALL = "#dfe5ea"
TRIANGLES = 20_000
"""Number at which software rendering takes 0.1 s per frame."""
SHOWN_TRAVEL = 0.2
"""Largest drawn displacement relative to the body's diagonal, rigid motion included."""
SHOWN_ELASTIC = 0.06
LEAST_ELASTIC = 0.35
"""Rigid motion is omitted where it limits the scale to less than this share of the elastic part's own."""


@dataclass(frozen=True)
class Script:
    """Content of the movie of one body."""

    moment: Moment
    frames: np.ndarray
    """Numbers of the frames."""
    scale: float
    travels: bool
    """Whether rigid motion and the obstacle are shown, magnified like the deformation."""
    limit: float
    """Largest elastic displacement [m]."""
    force: np.ndarray
    """Magnitude of the resultant of all contacts on the body within a window [N], (s,)."""


def draw_movie(drawing: Drawing) -> None:
    """Make one movie for each solid body with contact."""
    names = drawing.touched("tetra10")
    for body in drawing.shaped(names):
        script = _script(drawing, strongest_moment(drawing, body, TRIANGLES))
        with style.styled(), drawing.file("impact.mp4", body.name, len(names)) as path:
            figure, axes = _ground(drawing, script)
            stage = film.Stage(BOX, [axes])
            _set_up(stage, script, _wall(drawing, body, script.scale) if script.travels else None)
            film.shoot(path, figure, stage, script.frames, _mover(drawing, script))


def _script(drawing: Drawing, moment: Moment) -> Script:
    """Choose frames around the contacts, and one scale for all of them."""
    times, body = drawing.trajectory.frame_times, moment.body
    first, last = style.contact_span(times, drawing.frame_force(body.name), 0.35)
    within = np.flatnonzero((times >= first) & (times <= last))
    if len(within) < FRAMES // 4:
        within = np.arange(len(times))
    frames = within[np.unique(np.linspace(0, len(within) - 1, FRAMES).round().astype(int))]
    limit = max(_longest(body.elastic(frame)) for frame in frames)
    travel = max(_longest(body.total(frame)) for frame in frames)
    alone = style.nice_scale(SHOWN_ELASTIC * body.size, limit)
    together = style.nice_scale(SHOWN_TRAVEL * body.size, travel)
    travels = together >= LEAST_ELASTIC * alone
    total = np.sum([contact.force for contact in drawing.contacts_of(body.name).values()], axis=0)
    force = np.linalg.norm(hann_filter(drawing.trajectory.times, total, WINDOW), axis=1)
    return Script(moment, frames, min(together, 2 * alone) if travels else alone, travels, limit, force)


def _longest(displacement: np.ndarray) -> float:
    return float(np.linalg.norm(displacement, axis=1).max())


def _set_up(stage: film.Stage, script: Script, wall: Skin | None) -> None:
    """Add body and obstacle to the scene and aim the camera."""
    moment, skin, plotter = script.moment, script.moment.skin, stage.plotter
    magnitude = np.linalg.norm(moment.body.elastic(moment.frame), axis=1)
    skin.move(moment.body.nodes)
    skin.colour(magnitude)
    view.add_skin(plotter, skin, style.MAGNITUDE, (0.0, script.limit or 1.0), 1.8)
    seen = [skin.points]
    if wall is not None:
        plotter.add_mesh(wall.surface, color=WALL, culling="front", ambient=0.5, smooth_shading=True)
        view.add_edges(plotter, wall.edges, style.FAINT, 2.4)
        seen.append(wall.points)
    angle = 64.0 if elevation(moment.body.nodes, moment.up, magnitude) > 0 else -64.0
    view.aim(plotter, view.looking(moment.outward, moment.up, -75.0, angle), np.concatenate(seen))


def _mover(drawing: Drawing, script: Script) -> Callable[[int], film.Shot]:
    """Return a function that moves the body to a frame."""
    trajectory, body = drawing.trajectory, script.moment.body
    shown, time_name = style.time_unit(float(trajectory.times[-1]))
    newtons, force_unit = style.prefixed(float(script.force.max()), "N")

    def turn_to(frame: int) -> film.Shot:
        elastic = body.elastic(frame)
        script.moment.skin.move(body.nodes + script.scale * (body.total(frame) if script.travels else elastic))
        script.moment.skin.colour(np.linalg.norm(elastic, axis=1))
        time = float(trajectory.frame_times[frame])
        force = float(np.interp(time, trajectory.times, script.force)) * newtons
        return film.Shot(time * shown, f"{time * shown:.0f} {time_name}     {force:.2f} {force_unit}")

    return turn_to


def _wall(drawing: Drawing, body: BodyMotion, scale: float) -> Skin | None:
    """Return the obstacle opposite the contact surface, with gaps g magnified by s: x − s g(x) ∇g(x)."""
    contact = drawing.strongest_contact(body.name)
    surface = body.surface(drawing.trajectory.contacts[contact].interface)
    obstacle = view.obstacle_at(drawing, contact)
    if surface is None or obstacle is None:
        return None
    wall = make_skin(body.nodes, surface.facets, TRIANGLES, {})
    placed = wall.points + drawing.position(body.name)
    wall.move(wall.points - scale * obstacle.gap(placed)[:, None] * obstacle.direction(placed))
    return wall


def _ground(drawing: Drawing, script: Script) -> tuple[Figure, Axes]:
    """Return the static figure and its axes of the force."""
    trajectory = drawing.trajectory
    what = f"gaps and deformation × {script.scale:g}  ·  grey: rigid obstacle"
    if not script.travels:
        what = f"elastic deformation × {script.scale:g}  ·  rigid motion not shown"
    figure = style.new_figure(drawing.scene_name, what, width=SIZE[0], height=SIZE[1], dpi=film.DPI)
    axes = figure.add_axes((0.075, 0.085, 0.9, 0.14))
    style.magnitude_bar(figure, script.limit, "elastic displacement", "m", (0.85, 0.31, 0.016, 0.5))
    scale, name = style.prefixed(float(script.force.max()), "N")
    shown, time_name = style.time_unit(float(trajectory.times[-1]))
    axes.fill_between(trajectory.times * shown, script.force * scale, color=style.BLUE, alpha=0.12, lw=0)
    axes.plot(trajectory.times * shown, script.force * scale, color=style.BLUE, lw=1.8)
    ends = trajectory.frame_times[script.frames[[0, -1]]] * shown
    axes.set(xlim=ends, xlabel=f"time [{time_name}]", ylabel=f"force [{name}]")
    axes.set_ylim(0.0, 1.1 * float(script.force.max()) * scale or 1.0)
    label = f"Hann window of {WINDOW * 1e6:.0f} µs"
    axes.text(0.995, 0.95, label, transform=axes.transAxes, ha="right", va="top", color=style.FAINT)
    return figure, axes
