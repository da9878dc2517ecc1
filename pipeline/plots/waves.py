"""`deformation.png` of a body on a line mesh: its strain over position and time, beside the contact force."""

import numpy as np
from matplotlib.figure import Figure

from pipeline.filters import hann_filter
from pipeline.plots import style
from pipeline.plots.curves import WINDOW
from pipeline.plots.drawing import BodyMotion, Drawing


def draw_waves(drawing: Drawing) -> None:
    """Draw one picture for each body on a line mesh that was touched."""
    bodies = drawing.touched("line3")
    others = len(drawing.touched("tetra10"))
    for name in bodies:
        body = drawing.body(name)
        if body.modal.shapes is None or not body.modal.shapes.size:
            continue
        with style.styled(), drawing.file(drawing.file_name("deformation", ".png", name, len(bodies) + others)) as path:
            style.save(_diagram(drawing, body), path)


def strain(body: BodyMotion) -> tuple[np.ndarray, np.ndarray]:
    """Return positions along the bar [m], (n,), and axial strain at each frame [1], (f, n)."""
    ends = body.nodes[body.mesh.cells[:, :2]]
    direction = (ends[:, 1] - ends[:, 0]).sum(axis=0)
    direction = direction / np.linalg.norm(direction)
    position = (body.nodes - body.nodes[0]) @ direction
    order = np.argsort(position)
    position = position[order] - position[order[0]]
    axial = np.stack([body.elastic(frame)[order] @ direction for frame in range(len(body.coordinates))])
    return position, np.gradient(axial, position, axis=1)


def _diagram(drawing: Drawing, body: BodyMotion) -> Figure:
    trajectory = drawing.trajectory
    position, strains = strain(body)
    # Strain of truncated modes overshoots at the front; the bulk of the wave sets the colours.
    top = 1.25 * float(np.percentile(np.abs(strains), 99)) or 1e-12
    shown, time_name = style.time_unit(float(trajectory.times[-1]))
    length, length_unit = (1e3, "mm") if position[-1] < 1 - 1e-9 else (1.0, "m")
    factor = 1e6
    subtitle = (
        f"{drawing.scene_name}  ·  body {body.name}: axial strain over position and time,"
        f" {len(body.modal.angular_frequencies)} modes"
    )
    figure = style.new_figure("Waves in the bar", subtitle)
    axes = figure.add_axes((0.095, 0.11, 0.52, 0.72))
    image = axes.pcolormesh(
        position * length, trajectory.frame_times * shown, strains * factor,
        shading="gouraud", cmap=style.SIGNED, vmin=-top * factor, vmax=top * factor, rasterized=True,
    )  # fmt: skip
    style.plain_axes(axes)
    axes.set(xlabel=f"position [{length_unit}]", ylabel=f"time [{time_name}]")
    beside = figure.add_axes((0.655, 0.11, 0.19, 0.72), sharey=axes)
    total = np.sum([contact.force for contact in drawing.contacts_of(body.name).values()], axis=0)
    windowed = np.linalg.norm(hann_filter(trajectory.times, total, WINDOW), axis=1)
    scale, unit = style.prefixed(float(windowed.max()), "N")
    beside.fill_betweenx(trajectory.times * shown, windowed * scale, color=style.BLUE, alpha=0.15, lw=0)
    beside.plot(windowed * scale, trajectory.times * shown, color=style.BLUE, lw=1.8)
    beside.tick_params(labelleft=False)
    beside.set(xlabel=f"contact force [{unit}]", ylim=(0, trajectory.times[-1] * shown))
    beside.set_xlim(0, 1.1 * float(windowed.max()) * scale or 1.0)
    beside.set_title(f"Hann window of {WINDOW * 1e6:.0f} µs", loc="left", fontsize=9, color=style.FAINT)
    bar = figure.colorbar(image, cax=figure.add_axes((0.885, 0.11, 0.018, 0.72)), extend="both")
    bar.set_label("strain [µm/m], tension positive")
    bar.outline.set_visible(False)  # type: ignore[operator]
    return figure
