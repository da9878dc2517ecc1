"""`pressure.mp4`: pressure of a contact over time, beside where its points stick and slip, above its force."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from gudgeon.pipeline.plots.base import film, style
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.pressure import Map, colours, maps_of
from gudgeon.pipeline.plots.contact.raster import Raster, raster
from gudgeon.pipeline.plots.contact.slip import SIDE, Slip, counts_text, legend, slips_of, state_map

MOST = 150
"""Frames of a film; of more, some at equal distances."""
LEAST_FRAMES = 5
"""In contact, of a film."""


@dataclass(frozen=True)
class _Film:
    pressed: Map
    slip: Slip | None
    pixels: Raster
    frames: np.ndarray
    """Numbers of the frames shown, from before the first in contact to after the last."""


def draw_pressure_film(drawing: Drawing) -> None:
    """Write one film for each contact with a map that was closed in enough frames."""
    slips = {one.name: one for one in slips_of(drawing)}
    films = [one for found in maps_of(drawing) if (one := _film(found, slips.get(found.name))) is not None]
    for one in films:
        with style.styled(), drawing.file("pressure.mp4", one.pressed.name, len(films)) as path:
            _shoot(path, drawing, one)


def _film(found: Map, slip: Slip | None) -> _Film | None:
    (closed,) = np.nonzero(found.multipliers.any(axis=1))
    if len(closed) < LEAST_FRAMES:
        return None
    first, last = max(0, closed[0] - 1), min(len(found.multipliers) - 1, closed[-1] + 1)
    count = min(MOST, last - first + 1)
    frames = np.unique(np.rint(np.linspace(first, last, count)).astype(int))
    return _Film(found, slip, slip.pixels if slip else raster(found.plane, SIDE), frames)


def _shoot(path: Path, drawing: Drawing, one: _Film) -> None:
    figure, images, force = _figure(drawing, one)
    style.fit(figure)
    canvas = FigureCanvasAgg(figure)
    times = drawing.trajectory.frame_times
    factor, unit = style.time_unit(float(drawing.trajectory.times[-1]))
    mark = force.axvline(0.0, color=style.RED, lw=1.6)
    text = figure.text(0.985, 0.965, "", ha="right", va="center", fontsize=12, fontweight="bold")
    moving: list[tuple[Axes, Artist]] = [*images, (force, mark)]
    for _, artist in moving:
        artist.set_animated(True)
    text.set_animated(True)
    canvas.draw()
    ground = canvas.copy_from_bbox(figure.bbox)
    with film.new_writer(path, len(one.frames)) as writer:
        for frame in one.frames:
            canvas.restore_region(ground)
            _turn_to(one, images, frame)
            mark.set_xdata([times[frame] * factor] * 2)
            said = f"{style.digits(float(times[frame]) * factor)} {unit}"
            text.set_text(said if one.slip is None else f"{counts_text(one.slip.states[frame])}  ·  {said}")
            for axes, artist in moving:
                axes.draw_artist(artist)
            figure.draw_artist(text)
            writer.append_data(np.asarray(canvas.buffer_rgba())[..., :3].copy())


def _turn_to(one: _Film, images: list[tuple[Axes, AxesImage]], frame: int) -> None:
    """Set the maps to a frame."""
    scale, _ = style.prefixed(float(one.pressed.pressure.max()), "Pa")
    images[0][1].set_data(one.pixels.between(one.pressed.pressure[frame]) * scale)
    if one.slip is not None:
        images[1][1].set_data(one.pixels.of_nearest(one.slip.states[frame].astype(float)))


def _figure(drawing: Drawing, one: _Film) -> tuple[Figure, list[tuple[Axes, AxesImage]], Axes]:
    """Return the figure, its maps with their axes, and the axes of the force."""
    found, trajectory = one.pressed, drawing.trajectory
    subtitle = f"{drawing.scene_name}  ·  contact {found.name}, {len(found.plane.shown)} points on body {found.body}"
    title = "Contact pressure" if one.slip is None else "Contact pressure, slip and stick"
    figure = style.new_figure(title, subtitle, dpi=film.DPI * 2)
    places = [0.08, 0.6] if one.slip is not None else [0.08]
    width = 0.34 if one.slip is not None else 0.7
    panels = [figure.add_axes((x, 0.42, width, 0.42)) for x in places]
    top = float(found.pressure.max())
    scale, unit = style.prefixed(top, "Pa")
    image = panels[0].imshow(
        one.pixels.between(found.pressure[one.frames[0]]), extent=one.pixels.extent, origin="lower",
        aspect=found.plane.aspect, interpolation="nearest", cmap=colours(), vmin=0.0, vmax=top * scale,
    )  # fmt: skip
    images = [(panels[0], image)]
    panels[0].set_ylabel(found.plane.labels[1])
    for axes in panels:
        axes.set_xlabel(found.plane.labels[0])
        axes.set_anchor("NW")
        style.plain_axes(axes)
    style.colour_bar(figure, image, f"contact pressure [{unit}]", (places[0] + width + 0.01, 0.42, 0.014, 0.42))
    if one.slip is not None:
        shown = state_map(panels[1], one.slip, int(one.frames[0]))
        assert isinstance(shown, AxesImage)
        images.append((panels[1], shown))
        panels[1].set_yticklabels([])
        legend(panels[1], 1.12)
    force = figure.add_axes((0.08, 0.1, 0.865, 0.18))
    sizes = np.linalg.norm(trajectory.contacts[found.name].force, axis=1)
    times = trajectory.frame_times[one.frames]
    shown_times = style.over_time(trajectory.times, (float(times[0]), float(times[-1])))
    size, name = style.prefixed(float(sizes.max()), "N")
    force.plot(shown_times.values, sizes * size, color=style.BLUE, lw=1.4)
    force.set_ylabel(f"force [{name}]")
    shown_times.finish([force])
    return figure, images, force
