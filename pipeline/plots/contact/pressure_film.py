"""`pressure.mp4`: pressure of a contact over time, beside where its points stick and slip, above its force."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from gudgeon.pipeline.plots.base import film, style
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.maps import Map, maps_of
from gudgeon.pipeline.plots.contact.pressure import colours
from gudgeon.pipeline.plots.contact.slip import counts_text, legend, state_map

MOST = 150
"""Frames of a film; of more, some at equal distances."""
LEAST_FRAMES = 5
"""In contact, of a film."""
LETTERS = 33
"""Height of the text of a frame [px]."""


def draw_pressure_film(drawing: Drawing) -> None:
    """Write one film for each contact with a map that was closed in enough frames."""
    maps = [c for c in maps_of(drawing) if np.count_nonzero(c.multipliers.any(axis=1)) >= LEAST_FRAMES]
    for contact in maps:
        with style.styled(), drawing.file("pressure.mp4", contact.name, len(maps)) as path:
            _shoot(path, drawing, contact)


def _shoot(path: Path, drawing: Drawing, contact: Map) -> None:
    """Write a film of the frames from before the first in contact to after the last."""
    (closed,) = np.nonzero(contact.multipliers.any(axis=1))
    start, stop = max(0, closed[0] - 1), min(len(contact.multipliers), closed[-1] + 2)
    frames = start + film.evenly(stop - start, MOST)
    figure, images, force = _figure(drawing, contact, frames)
    turn_to = _mover(drawing, contact, [image for _, image in images])
    film.shoot(path, figure, (0, 0, 0, 0), frames, turn_to, curves=[force], moving=images, letters=LETTERS)


def _mover(drawing: Drawing, contact: Map, images: list[AxesImage]) -> Callable[[int], film.Shot]:
    """Return a function that sets the maps to a frame."""
    scale, _ = style.prefixed(float(contact.pressure.max()), "Pa")
    factor, unit = style.time_unit(float(drawing.trajectory.times[-1]))

    def turn_to(frame: int) -> film.Shot:
        time = float(drawing.trajectory.frame_times[frame]) * factor
        text = f"{style.digits(time)} {unit}"
        images[0].set_data(contact.pixels.between(contact.pressure[frame]) * scale)
        if contact.states is not None:
            images[1].set_data(contact.pixels.of_nearest(contact.states[frame].astype(float)))
            text = f"{counts_text(contact.states[frame])}  ·  {text}"
        return film.Shot(time, text)

    return turn_to


def _figure(drawing: Drawing, contact: Map, frames: np.ndarray) -> tuple[Figure, list[tuple[Axes, AxesImage]], Axes]:
    """Return the figure, its maps with their axes, and the axes of the force."""
    trajectory, pixels, slips = drawing.trajectory, contact.pixels, contact.states is not None
    points = f"{len(contact.chart.shown)} points on body {contact.body}"
    title = "Contact pressure, slip and stick" if slips else "Contact pressure"
    figure = style.new_figure(title, f"{drawing.scene_name}  ·  contact {contact.name}, {points}", dpi=film.DPI * 2)
    width = 0.34 if slips else 0.7
    panels = [figure.add_axes((x, 0.42, width, 0.42)) for x in ([0.08, 0.6] if slips else [0.08])]
    top = float(contact.pressure.max())
    scale, unit = style.prefixed(top, "Pa")
    pressure = pixels.between(contact.pressure[frames[0]])
    images = [pixels.draw(panels[0], pressure, points=False, cmap=colours(), vmin=0.0, vmax=top * scale)]
    panels[0].set_ylabel(contact.chart.labels[1])
    style.colour_bar(figure, images[0], f"contact pressure [{unit}]", (0.08 + width + 0.01, 0.42, 0.014, 0.42))
    if contact.states is not None:
        images.append(state_map(panels[1], pixels, contact.states[frames[0]]))
        panels[1].set_yticklabels([])
        legend(panels[1], 1.12)
    force = figure.add_axes((0.08, 0.1, 0.865, 0.18))
    sizes = np.linalg.norm(trajectory.contacts[contact.name].force, axis=1)
    start, stop = trajectory.frame_times[frames[[0, -1]]].tolist()
    abscissa = style.over_time(trajectory.times, (start, stop))
    newtons, name = style.prefixed(float(sizes.max()), "N")
    force.plot(abscissa.values, sizes * newtons, color=style.BLUE, lw=1.4)
    force.set_ylabel(f"force [{name}]")
    abscissa.finish([force])
    return figure, [*zip(panels, images, strict=True)], force
