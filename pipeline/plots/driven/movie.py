"""`cycle.mp4` of a driven scene: the whole run, bodies around the driven one cut open, beside its curves."""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gudgeon.pipeline.plots.base import film, style, view
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.drive import Cycle, drive_of, frame_degrees, own_cycle, shown_angle
from gudgeon.pipeline.plots.driven.assembly import Assembly, arrows, assemble
from gudgeon.pipeline.plots.driven.cycle import draw_panels

SIZE = (1280, 720)
"""Of the movie [px]."""
BOX = (150, 84, 550, 640)
"""Left, upper, right, lower border of the rendered part [px]."""
LIFT = 3e-3
"""Distance of edges before their faces, relative to the driven body's diagonal; without it they flicker."""
FRAMES = 240
TRIANGLES = 16_000
"""Target number of flat triangles of each body."""
COMMON = 95
"""Percentile of a body's largest displacements over the frames that has the last colour."""
WHERE = ((0.61, 0.98), 0.845)
"""Left and right border of the curves, and upper one, in the movie."""


def draw_cycle_movie(drawing: Drawing) -> None:
    """Make one movie of a driven scene, with one scale and one range of colours."""
    if not drawing.contacts_of(drive_of(drawing).body):
        return
    frames = film.evenly(len(drawing.trajectory.frame_times), FRAMES)
    if (assembly := assemble(drawing, TRIANGLES, frames.tolist())) is None:
        return
    along, run = assembly.drive.along, own_cycle(drawing)
    tops = {
        name: float(np.percentile([member.moved(frame, along, 1.0)[1].max() for frame in frames], COMMON))
        for name, member in assembly.parts.items()
    }
    with style.styled(), drawing.file("cycle.mp4") as path:
        figure, curves = _ground(drawing, assembly, run, tops)
        stage = film.Stage(BOX)
        _set_up(stage, assembly, frames, tops)
        film.shoot(path, figure, BOX, frames, _mover(drawing, assembly, run, stage), curves=curves)
        stage.plotter.close()


def _set_up(stage: film.Stage, assembly: Assembly, frames: np.ndarray, tops: dict[str, float]) -> None:
    """Add the bodies to the scene and aim the camera at their places in all frames."""
    seen = []
    for frame in frames[:: max(1, len(frames) // 24)]:
        assembly.turn_to(frame)
        seen += [member.skin.points for member in assembly.parts.values()]
    for name, member in assembly.parts.items():
        view.add_skin(stage.plotter, member.skin, member.colours, (0.0, tops[name] or 1.0), 2.4)
    view.aim(stage.plotter, assembly.view, np.concatenate(seen))


def _mover(drawing: Drawing, assembly: Assembly, run: Cycle, stage: film.Stage) -> Callable[[int], film.Shot]:
    """Return a function that moves the bodies to a frame."""
    angles = frame_degrees(drawing, assembly.drive)

    def turn_to(frame: int) -> film.Shot:
        assembly.turn_to(frame)
        for member in assembly.parts.values():
            member.skin.edges.points += LIFT * assembly.size * assembly.view.towards
        degrees = float(angles[frame])
        force = float(np.interp(degrees, run.degrees, run.side_force))
        text = f"{shown_angle(degrees, 0):>3}° crank angle     side force {style.signed(force / 1e3, 2)} kN"
        image = stage.photograph()
        forces = [(stage.pixel(tail), stage.pixel(tip), name) for tail, tip, name in arrows(drawing, assembly, frame)]
        return film.Shot(degrees, text, image, forces)

    return turn_to


def _ground(drawing: Drawing, assembly: Assembly, run: Cycle, tops: dict[str, float]) -> tuple[Figure, list[Axes]]:
    """Return the static figure and its axes of the curves."""
    text = f"gaps, tilt, lateral motion and deformation × {style.magnified(assembly.scale)}"
    figure = style.new_figure(drawing.scene_name, text, width=SIZE[0], height=SIZE[1], dpi=film.DPI)
    for k, (name, top) in enumerate(tops.items()):
        box, colours = (0.03 + 0.26 * k, 0.072, 0.22, 0.018), assembly.parts[name].colours
        style.magnitude_bar(figure, top, f"{name}: elastic, across", "m", box, colours=colours, exceeded=True)
    panels = draw_panels(drawing, figure, [run], run.span, WHERE)
    panels[-1].set_xlabel(f"crank angle [deg]  ·  {run.window}")
    return figure, panels
