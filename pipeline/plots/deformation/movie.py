"""`impact.mp4` of a solid body: the knock as it happens, gaps and deformation magnified alike, above the force.

Only the skin moves, in place; titles, colour bar and force curve are drawn once, and each frame is pasted on them.
"""

from collections.abc import Callable
from dataclasses import dataclass

import imageio
import numpy as np
import pyvista as pv
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import findfont
from PIL import Image, ImageDraw, ImageFont

from gudgeon.pipeline.measuring.force_window import hann_filter
from gudgeon.pipeline.plots.base import style, view
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.base.surface import make_skin
from gudgeon.pipeline.plots.contact.force_axes import WINDOW
from gudgeon.pipeline.plots.deformation.solid import Moment, add_colour_bar, drawable, elevation, strongest_moment

SIZE = (960, 720)
"""Of the movie [px]."""
BOX = (8, 80, 776, 548)
"""Left, upper, right, lower border of the rendered part [px]."""
FRAMES, RATE = 120, 25
WALL = "#dfe5ea"
TRIANGLES = 20_000
"""Few enough for 0.1 s a frame in software rendering."""
SHOWN_TRAVEL = 0.2
"""Largest drawn displacement relative to the body's diagonal, rigid motion included."""
SHOWN_ELASTIC = 0.06
LEAST_ELASTIC = 0.35
"""Where travel allows less than this share of the elastic part's own factor, the rigid motion is not shown."""


@dataclass(frozen=True)
class Script:
    """What the movie of one body shows."""

    moment: Moment
    frames: np.ndarray
    """Numbers of the frames."""
    scale: float
    travels: bool
    """Whether rigid motion and the obstacle are shown, magnified like the deformation."""
    limit: float
    """Largest elastic displacement [m]."""


def draw_movie(drawing: Drawing) -> None:
    """Make one movie for each solid body that was touched."""
    for name, body in drawable(drawing):
        count = len(drawing.touched("tetra10"))
        script = write_script(drawing, strongest_moment(drawing, body, TRIANGLES))
        with style.styled(), drawing.file(drawing.file_name("impact", ".mp4", name, count)) as path:
            rate = RATE if len(script.frames) >= FRAMES // 2 else 10
            writer = imageio.get_writer(
                path, fps=rate, codec="libx264", quality=None, macro_block_size=8,
                output_params=["-crf", "24", "-preset", "medium", "-movflags", "+faststart"],
            )  # fmt: skip
            with writer:
                _shoot(drawing, script, writer)


def write_script(drawing: Drawing, moment: Moment) -> Script:
    """Choose frames around the contacts, and one scale for all of them."""
    times, body = drawing.trajectory.frame_times, moment.body
    first, last = style.contact_span(times, drawing.frame_force(body.name), 0.35)
    within = np.flatnonzero((times >= first) & (times <= last))
    if len(within) < FRAMES // 4:
        within = np.arange(len(times))
    frames = within[np.unique(np.linspace(0, len(within) - 1, FRAMES).round().astype(int))]
    size = float(np.linalg.norm(np.ptp(body.nodes, axis=0)))
    limit = max(_longest(body.elastic(frame)) for frame in frames)
    travel = max(_longest(body.total(frame)) for frame in frames)
    alone = style.nice_scale(SHOWN_ELASTIC * size, limit)
    together = style.nice_scale(SHOWN_TRAVEL * size, travel)
    travels = together >= LEAST_ELASTIC * alone
    return Script(moment, frames, min(together, 2 * alone) if travels else alone, travels, limit)


def _longest(displacement: np.ndarray) -> float:
    return float(np.linalg.norm(displacement, axis=1).max())


def _shoot(drawing: Drawing, script: Script, writer: "imageio.core.format.Format.Writer") -> None:
    """Render frame by frame."""
    body, skin = script.moment.body, script.moment.skin
    factor, unit = style.prefixed(script.limit, "m")
    plotter, mesh, edges = _stage(drawing, script)
    curve = windowed_force(drawing, body.name)
    ground, track = _ground(drawing, script, curve, (factor, unit))
    font = ImageFont.truetype(findfont("DejaVu Sans:bold"), 19)
    shown, time_name = style.time_unit(float(drawing.trajectory.times[-1]))
    times = drawing.trajectory.times
    newtons, force_unit = style.prefixed(float(curve.max()), "N")
    for frame in script.frames:
        elastic = body.elastic(frame)
        moved = body.nodes + script.scale * (body.total(frame) if script.travels else elastic)
        points = skin.weights @ moved
        mesh.points = points
        mesh.point_data["Normals"] = skin.normals(points)
        mesh.point_data["magnitude"] = skin.weights @ (np.linalg.norm(elastic, axis=1) * factor)
        edges.points = skin.edge_weights @ moved
        picture = ground.copy()
        picture.paste(Image.fromarray(view.photograph(plotter)), BOX[:2])
        time = float(drawing.trajectory.frame_times[frame])
        pen = ImageDraw.Draw(picture)
        force = float(np.interp([time], times, curve)[0]) * newtons
        text = f"{time * shown:.0f} {time_name}     {force:.2f} {force_unit}"
        pen.text((SIZE[0] - 24, 30), text, font=font, fill=style.INK, anchor="rm")
        x, low, high = track(time)
        pen.line([(x, low), (x, high)], fill=style.RED, width=2)
        writer.append_data(np.asarray(picture))
    plotter.close()


def _stage(drawing: Drawing, script: Script) -> tuple[pv.Plotter, pv.PolyData, pv.PolyData]:
    """Set up body, obstacle and camera."""
    moment, body, skin = script.moment, script.moment.body, script.moment.skin
    plotter = view.new_plotter((BOX[2] - BOX[0], BOX[3] - BOX[1]))
    plotter.enable_anti_aliasing("msaa", multi_samples=4)
    still = np.zeros_like(body.nodes)
    factor, _ = style.prefixed(script.limit, "m")
    mesh = view.skin_mesh(skin, body.nodes, still, 0.0, still[:, 0])
    view.add_skin(plotter, mesh, "magnitude", script.limit * factor)
    edges = view.lines(skin.edge_weights @ body.nodes, skin.segments)
    view.add_lines(plotter, edges, color=style.INK, line_width=1.2)
    seen = [mesh.points]
    wall = _wall(drawing, script) if script.travels else None
    if wall is not None:
        plotter.add_mesh(wall[0], color=WALL, culling="front", ambient=0.5, smooth_shading=True)
        view.add_lines(plotter, wall[1], color=style.FAINT, line_width=1.6)
        seen.append(wall[0].points)
    magnitude = np.linalg.norm(body.elastic(moment.frame), axis=1)
    angle = 64.0 if elevation(body.nodes, moment.up, magnitude) > 0 else -64.0
    view.aim(plotter, view.looking(moment.outward, moment.up, -75.0, angle), np.concatenate(seen))
    return plotter, mesh, edges


def _wall(drawing: Drawing, script: Script) -> tuple[pv.PolyData, pv.PolyData] | None:
    """Return the obstacle opposite the touched surface, its gap magnified, and the obstacle's edges."""
    body = drawing.body(script.moment.body.name)
    contact, surface = view.touched_surface(drawing, body)
    if surface is None:
        return None
    skin = make_skin(body.nodes, surface.facets, TRIANGLES)
    points = view.wall_points(drawing, body, contact, skin.weights @ body.nodes, script.scale)
    rim = view.wall_points(drawing, body, contact, skin.edge_weights @ body.nodes, script.scale)
    if points is None or rim is None:
        return None
    return view.poly(points, skin.triangles), view.lines(rim, skin.segments)


def windowed_force(drawing: Drawing, body: str) -> np.ndarray:
    """Return the magnitude of the resultant of all contacts on a body, windowed [N], (s,)."""
    total = np.sum([contact.force for contact in drawing.contacts_of(body).values()], axis=0)
    return np.linalg.norm(hann_filter(drawing.trajectory.times, total, WINDOW), axis=1)


def _ground(
    drawing: Drawing, script: Script, curve: np.ndarray, unit: tuple[float, str]
) -> tuple[Image.Image, Callable[[float], tuple[float, float, float]]]:
    """Draw all that stands still.

    Returns:
        The picture, and for a time its place on the force curve: across, lower end, upper end [px].
    """
    trajectory = drawing.trajectory
    figure = Figure(figsize=(SIZE[0] / 100, SIZE[1] / 100), dpi=100, facecolor="white")
    figure.text(0.025, 1 - 30 / SIZE[1], drawing.scene_name, fontsize=14, fontweight="bold", va="center")
    what = f"gaps and deformation × {script.scale:g}  ·  grey: rigid obstacle"
    if not script.travels:
        what = f"elastic deformation × {script.scale:g}  ·  rigid motion not shown"
    figure.text(0.025, 1 - 62 / SIZE[1], what, fontsize=10.5, color=style.FAINT, va="center")
    axes = figure.add_axes((0.075, 0.085, 0.9, 0.14))
    add_colour_bar(figure, script.limit * unit[0], f"elastic displacement [{unit[1]}]", (0.85, 0.31, 0.016, 0.5))
    scale, name = style.prefixed(float(curve.max()), "N")
    shown, time_name = style.time_unit(float(trajectory.times[-1]))
    axes.fill_between(trajectory.times * shown, curve * scale, color=style.BLUE, alpha=0.12, lw=0)
    axes.plot(trajectory.times * shown, curve * scale, color=style.BLUE, lw=1.8)
    ends = trajectory.frame_times[script.frames[[0, -1]]] * shown
    axes.set(xlim=ends, xlabel=f"time [{time_name}]", ylabel=f"force [{name}]")
    axes.set_ylim(0.0, 1.1 * float(curve.max()) * scale or 1.0)
    label = f"Hann window of {WINDOW * 1e6:.0f} µs"
    axes.text(0.995, 0.95, label, transform=axes.transAxes, ha="right", va="top", color=style.FAINT)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    image = Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy())
    box = axes.get_window_extent()

    def track(time: float) -> tuple[float, float, float]:
        return axes.transData.transform((time * shown, 0))[0], SIZE[1] - box.y0, SIZE[1] - box.y1

    return image, track
