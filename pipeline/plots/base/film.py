"""Movies: a rendered scene and time marks on curves over a static figure.

Titles, colour bars and curves are drawn once, and each frame is pasted on them. Arrows are drawn in 2-D, so that only
the bodies are rendered: rendering takes most of the time.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import imageio
import numpy as np
import pyvista as pv
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import findfont
from PIL import Image, ImageDraw, ImageFont

from gudgeon.pipeline.plots.base import style, view

FINER = 1.5
"""Factor by which the rendered scene is larger before it is averaged; half the time of VTK's own smoothing."""
DPI = 100
RATE, SLOW = 25, 10
"""Frames per second of a movie, and of one with fewer than `FEW` frames."""
FEW = 60
UPPER = 25
"""Distance of a frame's text from the upper border [px], as that of the title."""
HEAD, HALF, THICK = 20, 9, 3
"""Length and half width of an arrow's head, and half width of its shaft [px]."""


@dataclass(frozen=True)
class Stage:
    """The moving parts: a scene, empty at first, its place in the movie, and the curves with a time mark."""

    box: tuple[int, int, int, int]
    """Left, upper, right, lower border of the scene in the movie [px]."""
    curves: Sequence[Axes]
    """Of one figure, with one abscissa."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the scene [px]."""
        return self.box[2] - self.box[0], self.box[3] - self.box[1]

    @cached_property
    def plotter(self) -> pv.Plotter:
        """The scene."""
        plotter = view.new_plotter(self.size, FINER)
        plotter.disable_anti_aliasing()
        return plotter


@dataclass(frozen=True)
class Shot:
    """Time mark, text and arrows of one frame."""

    abscissa: float
    """Of the time mark on the curves."""
    text: str
    arrows: Sequence[tuple[np.ndarray, np.ndarray, str]] = field(default=())
    """Tail and tip [m], horizontal on the screen, and text."""


def new_writer(path: Path, frames: int) -> Any:
    """Return a context that takes the pictures of a movie of so many frames."""
    return imageio.get_writer(
        path, fps=RATE if frames >= FEW else SLOW, codec="libx264", quality=None, macro_block_size=8,
        output_params=["-crf", "24", "-preset", "veryfast", "-movflags", "+faststart"],
    )  # fmt: skip


def shoot(path: Path, figure: Figure, stage: Stage, frames: np.ndarray, turn_to: Callable[[int], Shot]) -> None:
    """Write a movie.

    Args:
        figure: The static part.
        frames: Numbers of the frames.
        turn_to: Moves the scene to a frame and returns its mark, text and arrows.
    """
    style.fit(figure)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    ground = Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy())
    font = ImageFont.truetype(findfont("DejaVu Sans:bold"), 20)
    with new_writer(path, len(frames)) as writer:
        for frame in frames:
            shot, picture = turn_to(frame), ground.copy()
            picture.paste(view.photograph(stage.plotter, stage.size), stage.box[:2])
            for tail, tip, text in shot.arrows:
                ends = [view.pixel(stage.plotter, stage.size, point) + stage.box[:2] for point in (tail, tip)]
                _draw_arrow(picture, ends[0], ends[1], text)
            pen = ImageDraw.Draw(picture)
            pen.text((picture.width - 24, UPPER), shot.text, font=font, fill=style.INK, anchor="rm")
            for axes in stage.curves:
                x, box = axes.transData.transform((shot.abscissa, 0))[0], axes.get_window_extent()
                pen.line([(x, picture.height - box.y0), (x, picture.height - box.y1)], fill=style.RED, width=2)
            writer.append_data(np.asarray(picture))
    stage.plotter.close()


def _draw_arrow(picture: Image.Image, tail: np.ndarray, tip: np.ndarray, text: str) -> None:
    """Draw a horizontal arrow between two places [px], with smooth edges, and its text above."""
    length, away = abs(tail[0] - tip[0]), float(np.sign(tail[0] - tip[0]))
    size = (int(length) + 1, 2 * HALF + 1)
    mask = Image.new("L", (4 * size[0], 4 * size[1]))
    pen = ImageDraw.Draw(mask)
    pen.polygon([(0, 4 * HALF), (4 * HEAD, 0), (4 * HEAD, 8 * HALF)], fill=255)
    pen.rectangle([(4 * HEAD, 4 * (HALF - THICK)), (4 * size[0], 4 * (HALF + THICK))], fill=255)
    mask = mask.resize(size, Image.Resampling.LANCZOS)
    if away < 0:
        mask = mask.transpose(Image.Transpose.FLIP_LEFT_RIGHT)
    corner = (round(min(tail[0], tip[0])), round(tip[1]) - HALF)
    picture.paste(Image.new("RGB", size, style.RED), corner, mask)
    font = ImageFont.truetype(findfont("DejaVu Sans:bold"), 15)
    place = (tip[0] + 6 * away, tip[1] - 34)
    anchor, align = ("lm", "left") if away > 0 else ("rm", "right")
    ImageDraw.Draw(picture).multiline_text(place, text, font=font, fill=style.RED, anchor=anchor, align=align)
