"""`cycle.mp4` of a driven scene: the whole run, what surrounds the driven body cut open, beside its curves.

Only skins move, in place; titles, colour bars and curves are drawn once, and each frame is pasted on them. Arrows are
drawn flat: what is rendered stays as small as its bodies, and rendering takes most of the time.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import imageio
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import findfont
from PIL import Image, ImageDraw, ImageFont

from gudgeon.pipeline.plots.base import style, view
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.force_axes import WINDOW
from gudgeon.pipeline.plots.deformation.solid import add_colour_bar
from gudgeon.pipeline.plots.driven.assembly import Assembly, arrows, assemble, meshes, place
from gudgeon.pipeline.plots.driven.cycle import PANELS, draw_gas, draw_panel, span_of, stacked
from gudgeon.pipeline.plots.driven.drive import Cycle, cycles, drive_of, frame_degrees, shown_angle

SIZE = (1280, 720)
"""Of the movie [px]."""
BOX = (150, 84, 550, 640)
"""Left, upper, right, lower border of the rendered part [px]."""
FINER = 1.5
"""It is rendered so much larger and averaged, which takes half the time of VTK's own smoothing."""
LIFT = 3e-3
"""Edges stand so far before their faces, relative to the driven body's diagonal, or they would flicker."""
FRAMES, RATE = 240, 24
TRIANGLES = 16_000
"""Of each body, where its facets are not more."""
COMMON = 95
"""Percentile of a body's largest displacement over the frames that has the last colour; rare ones go beyond."""
WHERE = (0.61, 0.37, 0.09, 0.845)
"""Left border, width, lower and upper border of the curves."""


@dataclass(frozen=True)
class Script:
    """What the movie shows."""

    assembly: Assembly
    run: Cycle
    frames: np.ndarray
    """Numbers of the frames."""
    tops: dict[str, float]
    """Elastic displacement of each body that has the last colour [m]."""


def draw_cycle_movie(drawing: Drawing) -> None:
    """Make one movie of a driven scene."""
    if not drawing.contacts_of(drive_of(drawing).body):
        return
    script = write_script(drawing)
    if script is None:
        return
    with style.styled(), drawing.file("cycle.mp4") as path:
        rate = RATE if len(script.frames) >= FRAMES // 4 else 10
        writer = imageio.get_writer(
            path, fps=rate, codec="libx264", quality=None, macro_block_size=8,
            output_params=["-crf", "24", "-preset", "veryfast", "-movflags", "+faststart"],
        )  # fmt: skip
        with writer:
            _shoot(drawing, script, writer)


def write_script(drawing: Drawing) -> Script | None:
    """Choose frames of the whole run, and one scale and one set of colours for all of them."""
    count = len(drawing.trajectory.frame_times)
    frames = np.unique(np.linspace(0, count - 1, min(FRAMES, count)).round().astype(int))
    assembly = assemble(drawing, TRIANGLES, frames.tolist())
    if assembly is None:
        return None
    along = assembly.drive.along
    tops = {
        name: float(np.percentile([part.moved(frame, along, 1.0)[1].max() for frame in frames], COMMON))
        for name, part in assembly.parts.items()
    }
    return Script(assembly, cycles(replace(drawing, compare={}))[0], frames, tops)


def _shoot(drawing: Drawing, script: Script, writer: "imageio.core.format.Format.Writer") -> None:
    """Render frame by frame."""
    assembly, run = script.assembly, script.run
    stage = _Stage(script)
    ground, tracks = _ground(drawing, script)
    font = ImageFont.truetype(findfont("DejaVu Sans:bold"), 20)
    angles = frame_degrees(drawing, assembly.drive)
    for frame in script.frames:
        stage.turn_to(frame)
        picture = ground.copy()
        picture.paste(stage.photograph(), BOX[:2])
        for tail, tip, text in arrows(drawing, assembly, frame):
            start, end = (stage.pixel(point) + BOX[:2] for point in (tail, tip))
            _draw_arrow(picture, start, end, text)
        degrees = float(angles[frame])
        force = float(np.interp(degrees, run.degrees, run.side_force))
        pen = ImageDraw.Draw(picture)
        text = f"{shown_angle(run.drive, degrees, 0):>3}° crank angle     side force {style.signed(force / 1e3, 2)} kN"
        pen.text((SIZE[0] - 24, 32), text, font=font, fill=style.INK, anchor="rm")
        for track in tracks:
            x, low, high = track(degrees)
            pen.line([(x, low), (x, high)], fill=style.RED, width=2)
        writer.append_data(np.asarray(picture))
    stage.close()


class _Stage:
    """Bodies and camera, of which frame after frame is photographed."""

    def __init__(self, script: Script) -> None:
        self._script = script
        assembly = script.assembly
        self._size = (BOX[2] - BOX[0], BOX[3] - BOX[1])
        self._plotter = view.new_plotter((round(FINER * self._size[0]), round(FINER * self._size[1])))
        self._plotter.disable_anti_aliasing()
        self._meshes = {name: meshes(part) for name, part in assembly.parts.items()}
        for name, (mesh, edges) in self._meshes.items():
            view.add_skin(self._plotter, mesh, "magnitude", 1.0, assembly.parts[name].colours)
            view.add_lines(self._plotter, edges, color=style.INK, line_width=2.4)
        seen = []
        for frame in script.frames[:: max(1, len(script.frames) // 24)]:
            seen += [part.moved(frame, assembly.drive.along, assembly.scale)[0] for part in assembly.parts.values()]
        view.aim(self._plotter, assembly.view, np.concatenate(seen))

    def turn_to(self, frame: int) -> None:
        """Move all to where it is at a frame."""
        assembly = self._script.assembly
        for name, part in assembly.parts.items():
            points, magnitude = part.moved(frame, assembly.drive.along, assembly.scale)
            mesh, edges = self._meshes[name]
            place(part, mesh, edges, points, magnitude / (self._script.tops[name] or 1.0))
            edges.points = edges.points + LIFT * assembly.size * assembly.view.towards

    def photograph(self) -> Image.Image:
        """Return the picture as it stands now."""
        return Image.fromarray(view.photograph(self._plotter)).resize(self._size, Image.Resampling.LANCZOS)

    def pixel(self, point: np.ndarray) -> np.ndarray:
        """Return where a point is in that picture [px], (2,)."""
        return view.pixel(self._plotter, point) / FINER

    def close(self) -> None:
        """Let the window go."""
        self._plotter.close()


def _draw_arrow(picture: Image.Image, tail: np.ndarray, tip: np.ndarray, text: str) -> None:
    """Draw a level arrow between two places [px], with smooth edges, and its text above."""
    length, away = abs(tail[0] - tip[0]), float(np.sign(tail[0] - tip[0]))
    head, half, thick = 20, 9, 3
    size = (int(length) + 1, 2 * half + 1)
    mask = Image.new("L", (4 * size[0], 4 * size[1]))
    pen = ImageDraw.Draw(mask)
    pen.polygon([(0, 4 * half), (4 * head, 0), (4 * head, 8 * half)], fill=255)
    pen.rectangle([(4 * head, 4 * (half - thick)), (4 * size[0], 4 * (half + thick))], fill=255)
    mask = mask.resize(size, Image.Resampling.LANCZOS)
    if away < 0:
        mask = mask.transpose(Image.Transpose.FLIP_LEFT_RIGHT)
    corner = (round(min(tail[0], tip[0])), round(tip[1]) - half)
    picture.paste(Image.new("RGB", size, style.RED), corner, mask)
    font = ImageFont.truetype(findfont("DejaVu Sans:bold"), 15)
    place_of_text = (tip[0] + 6 * away, tip[1] - 34)
    anchor, align = ("lm", "left") if away > 0 else ("rm", "right")
    ImageDraw.Draw(picture).multiline_text(place_of_text, text, font=font, fill=style.RED, anchor=anchor, align=align)


def _ground(
    drawing: Drawing, script: Script
) -> tuple[Image.Image, list[Callable[[float], tuple[float, float, float]]]]:
    """Draw all that stands still.

    Returns:
        The picture, and for each panel the place of a crank angle: across, lower end, upper end [px].
    """
    assembly, run = script.assembly, script.run
    figure = Figure(figsize=(SIZE[0] / 100, SIZE[1] / 100), dpi=100, facecolor="white")
    figure.text(0.02, 1 - 32 / SIZE[1], drawing.scene_name, fontsize=15, fontweight="bold", va="center")
    what = f"gaps, tilt, lateral motion and deformation × {assembly.scale:g}"
    figure.text(0.02, 1 - 64 / SIZE[1], what, fontsize=11, color=style.FAINT, va="center")
    for number, (name, top) in enumerate(script.tops.items()):
        factor, unit = style.prefixed(top, "m")
        box = (0.03 + 0.26 * number, 0.072, 0.22, 0.018)
        label = f"{name}: elastic, across [{unit}]"
        add_colour_bar(figure, top * factor, label, box, assembly.parts[name].colours, beyond=True)
    left, width, low, high = WHERE
    found = []
    for panel, box in zip(PANELS, stacked(left, width, low, high), strict=True):
        axes = figure.add_axes(box)
        draw_panel(axes, panel, [run], span_of(run))
        axes.yaxis.set_label_coords(-0.115, 0.5)
        if panel is PANELS[0]:
            draw_gas(drawing, axes, run, label=True)
        if panel is PANELS[-1]:
            axes.set_xlabel(f"crank angle [deg]  ·  Hann window of {WINDOW * 1e6:.0f} µs")
        else:
            axes.tick_params(labelbottom=False)
        found.append(axes)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    image = Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy())

    def track(number: int, degrees: float) -> tuple[float, float, float]:
        box = found[number].get_window_extent()
        return found[number].transData.transform((degrees, 0))[0], SIZE[1] - box.y0, SIZE[1] - box.y1

    return image, [lambda degrees, k=k: track(k, degrees) for k in range(len(found))]
