"""`impact.mp4`: all bodies in an impact, gaps and deformation magnified, above the force, time slowed down around the
contacts; `motion.mp4` of bodies that deform without touching."""

from collections.abc import Callable

import numpy as np
import pyvista as pv
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gudgeon.pipeline.plots.base import film, style, view
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.base.surface import Skin
from gudgeon.pipeline.plots.deformation.obstacle import FACE, WALL, faces
from gudgeon.pipeline.plots.deformation.script import Script, script_of
from gudgeon.pipeline.plots.deformation.solid import elevation

SIZE = (960, 720)
"""Of the movie [px]."""
BOX = (8, 80, 776, 548)
"""Left, upper, right, lower border of the rendered part [px]."""
PASSED = 24
"""Frames whose places the camera sees, of bodies that are carried."""
STEEP, LEVEL, LOW = 64.0, 20.0, 8.0
"""Elevations of the camera [deg] on the side of a contact, and where bodies meet one above the other."""
SIDES = (-75.0, 75.0, -40.0, 40.0, -15.0, 15.0)
"""Angles of the camera about the direction drawn upwards, from the side in contact [deg]; the first that shows it."""
HEADROOM = 1.35
"""Height of the axes of the force over its largest value: the text stands above the curve."""


def draw_movie(drawing: Drawing) -> None:
    """Make one film of all bodies, if one of an extent deforms."""
    if (script := script_of(drawing)) is None:
        return
    with style.styled(), drawing.file("impact.mp4" if script.moment.contact else "motion.mp4") as path:
        figure, axes = _ground(script)
        stage = film.Stage(BOX)
        _set_up(stage, script)
        frames = np.arange(len(script.pace.times))
        film.shoot(path, figure, BOX, frames, _mover(script, stage), curves=[axes])
        stage.plotter.close()


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
    view.aim(plotter, side_of(script), np.concatenate(seen))


def side_of(script: Script) -> view.View:
    """Return the side from which most of the contact is seen, while bodies are apart and at the largest force."""
    moment = script.moment
    magnitude = np.linalg.norm(moment.body.elastic(moment.frame), axis=1)
    stacked = abs(moment.outward @ moment.up) > view.STEEP
    raised = elevation(moment.body.nodes, moment.up, magnitude) > 0
    steep = (STEEP, -STEEP) if raised else (-STEEP, STEEP)
    angles = (LEVEL, -LEVEL, LOW, -LOW) if stacked else (*steep, LEVEL, -LEVEL)
    sides = [view.looking(moment.outward, moment.up, azimuth, angle) for angle in angles for azimuth in SIDES]
    if not isinstance(moment.skin, Skin):
        return max(sides, key=lambda side: _width(moment.body.nodes, side))
    if not moment.contact:
        return sides[0]
    press = script.drawing.presses(moment.body.name)[moment.contact]
    loaded = np.flatnonzero(press.multipliers[moment.frame] > 0)
    actor = next(actor for actor in script.actors if actor.body.name == moment.body.name)
    nearest = [int(np.linalg.norm(actor.body.nodes - press.points[k], axis=1).argmin()) for k in loaded]
    shown = []
    for frame in (0, moment.frame):
        for member in script.actors:
            member.drawn.move(script.points(member, frame, script.scale))
        points = script.points(actor, frame, script.scale)[nearest]
        surfaces = [member.drawn.surface.copy() for member in script.actors if isinstance(member.drawn, Skin)]
        shown.append(view.shares_seen(points, press.outward[loaded], surfaces, sides))
    return sides[view.largest_alike(np.sum(shown, axis=0))]


def _width(nodes: np.ndarray, side: view.View) -> float:
    """Return how far nodes (n, 3) extend across a view [m]."""
    across = nodes - np.outer(nodes @ side.towards, side.towards)
    return float(np.linalg.norm(np.ptp(across, axis=0)))


def _add_planes(plotter: pv.Plotter, script: Script) -> list[np.ndarray]:
    """Add planes around the bodies in all frames, and return what is seen of both [m], (n, 3) each."""
    seen: list[np.ndarray] = []
    count = len(script.pace.times)
    frames = range(0, count, max(1, count // PASSED))
    for actor in script.actors:
        scale = 0.0 if script.carries else script.scale
        seen.append(np.concatenate([script.points(actor, frame, scale) for frame in frames]))
        for wall in faces(script.planes.get(actor.body.name, []), seen[-1]):
            plotter.add_mesh(wall, color=FACE, opacity=0.35, ambient=0.4, show_edges=True, edge_color=style.FAINT)
            seen.append(np.asarray(wall.points))
    return seen


def _mover(script: Script, stage: film.Stage) -> Callable[[int], film.Shot]:
    """Return a function that moves all bodies to a frame."""
    curve = script.curve
    shown, time_name = style.time_unit(float(script.pace.times[-1]))
    factor, unit = style.prefixed(float(curve.values.max()), curve.unit)

    def turn_to(frame: int) -> film.Shot:
        for actor in script.actors:
            actor.drawn.move(script.points(actor, frame, script.scale))
            actor.drawn.colour(np.linalg.norm(actor.body.elastic(frame), axis=1))
        time = float(script.pace.times[frame])
        value = float(np.interp(time, curve.times, curve.values)) * factor
        text = f"{script.pace.text(frame)}{style.digits(time * shown)} {time_name}     {value:.2f} {unit}"
        return film.Shot(time * shown, text, stage.photograph())

    return turn_to


def _ground(script: Script) -> tuple[Figure, Axes]:
    """Return the static figure and its axes of the force."""
    curve = script.curve
    figure = style.new_figure(script.drawing.scene_name, _subtitle(script), width=SIZE[0], height=SIZE[1], dpi=film.DPI)
    axes = figure.add_axes((0.075, 0.085, 0.9, 0.14))
    bar = (0.85, 0.31, 0.016, 0.5)
    style.magnitude_bar(figure, script.limit, "elastic displacement", "m", bar, exceeded=script.exceeded)
    scale, name = style.prefixed(float(curve.values.max()), curve.unit)
    shown, time_name = style.time_unit(float(script.pace.times[-1]))
    axes.fill_between(curve.times * shown, curve.values * scale, color=style.BLUE, alpha=0.12, lw=0)
    axes.plot(curve.times * shown, curve.values * scale, color=style.BLUE, lw=1.8)
    axes.set(xlim=script.pace.times[[0, -1]] * shown, xlabel=f"time [{time_name}]", ylabel=f"{curve.name} [{name}]")
    axes.set_ylim(0.0, HEADROOM * float(curve.values.max()) * scale or 1.0)
    axes.text(0.995, 0.95, curve.label, transform=axes.transAxes, ha="right", va="top", color=style.FAINT)
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
