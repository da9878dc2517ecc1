"""Films: what moves and time marks on curves over a static figure.

Titles, colour bars and curves are drawn once, and each frame is drawn on them. Arrows are drawn in 2-D, so that only
the bodies are rendered: rendering takes most of the time.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import imageio
import numpy as np
import pyvista as pv
from matplotlib.artist import Artist
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
"""Frames per second of a film, and of one with fewer than `FEW` frames."""
FEW = 60
UPPER = 25
"""Distance of a frame's text from the upper border [px], as that of the title."""
HEAD, HALF, THICK = 20, 9, 3
"""Length and half width of an arrow's head, and half width of its shaft [px]."""
Box = tuple[int, int, int, int]
"""Left, upper, right, lower border in the film [px]."""


@dataclass(frozen=True)
class Shot:
    """What one frame shows."""

    abscissa: float
    """Of the time mark on the curves."""
    text: str
    image: Image.Image | None = None
    """At the upper left corner of the moving part."""
    arrows: Sequence[tuple[np.ndarray, np.ndarray, str]] = ()
    """Tail and tip [px], at one height, and text."""


@dataclass(frozen=True)
class Stage:
    """A rendered scene, empty at first."""

    box: Box
    """Its place in the film."""

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

    def photograph(self) -> Image.Image:
        """Render the scene."""
        return view.photograph(self.plotter, self.size)

    def pixel(self, point: np.ndarray) -> np.ndarray:
        """Return the pixel of a point in the film, (2,)."""
        return view.pixel(self.plotter, self.size, point) + self.box[:2]


def evenly(count: int, limit: int) -> np.ndarray:
    """Return the numbers of at most `limit` of so many frames, at equal distances, the first and last among them."""
    return np.unique(np.linspace(0, count - 1, min(limit, count)).round().astype(int))


def shoot(
    path: Path, figure: Figure, box: Box, frames: np.ndarray, turn_to: Callable[[int], Shot], *,
    curves: Sequence[Axes], moving: Sequence[tuple[Axes, Artist]] = (), letters: int = 20,
) -> None:  # fmt: skip
    """Write a film.

    Args:
        figure: The static part.
        box: Where the image of each shot is.
        frames: Numbers of the frames.
        turn_to: Moves the scene and the artists to a frame.
        curves: Of one abscissa, with a time mark.
        moving: Artists in the figure that a frame changes, with their axes.
        letters: Height of the text [px].
    """
    style.fit(figure)
    canvas, scale = FigureCanvasAgg(figure), figure.dpi / DPI
    for _, artist in moving:
        artist.set_animated(True)
    canvas.draw()
    ground = canvas.copy_from_bbox(figure.bbox)
    font = ImageFont.truetype(findfont("DejaVu Sans:bold"), letters)
    writer = imageio.get_writer(
        path, fps=RATE if len(frames) >= FEW else SLOW, codec="libx264", quality=None, macro_block_size=8,
        output_params=["-crf", "24", "-preset", "veryfast", "-movflags", "+faststart"],
    )  # fmt: skip
    with writer:
        for frame in frames:
            shot = turn_to(int(frame))
            canvas.restore_region(ground)
            for axes, artist in moving:
                axes.draw_artist(artist)
            picture = Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy())
            if shot.image is not None:
                picture.paste(shot.image, box[:2])
            for tail, tip, text in shot.arrows:
                _draw_arrow(picture, tail, tip, text)
            pen, corner = ImageDraw.Draw(picture), (picture.width - 24, UPPER * scale)
            pen.text(corner, shot.text, font=font, fill=style.INK, anchor="rm")
            for axes in curves:
                x, area = axes.transData.transform((shot.abscissa, 0))[0], axes.get_window_extent()
                ends = [(x, picture.height - area.y0), (x, picture.height - area.y1)]
                pen.line(ends, fill=style.RED, width=round(2 * scale))
            writer.append_data(np.asarray(picture))


def _draw_arrow(picture: Image.Image, tail: np.ndarray, tip: np.ndarray, text: str) -> None:
    """Draw a horizontal arrow between two points [px], with smooth edges, and its text above."""
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
    anchor, align = ("lm", "left") if away > 0 else ("rm", "right")
    ImageDraw.Draw(picture).multiline_text(
        (tip[0] + 6 * away, tip[1] - 34), text, font=font, fill=style.RED, anchor=anchor, align=align
    )
