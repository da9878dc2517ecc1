"""`deformation.png` of a bar (strain) or a beam (deflection) over position and time, beside the contact force."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.contact.force_axes import middles, shown_force
from gudgeon.solver.vectors import unit

LARGE = 1e-2
"""Strain from which the unit is percent."""


@dataclass(frozen=True)
class LineMap:
    """A quantity over the axis of a body and over time."""

    title: str
    what: str
    position: np.ndarray
    """Along the axis, from one end [m], (n,)."""
    values: np.ndarray
    """At each frame, (f, n)."""
    top: float
    """Value of the last colour."""
    factor: float
    """From SI to the label's unit."""
    label: str


def draw_waves(drawing: Drawing) -> None:
    """Draw one picture for each bar or beam that deforms."""
    for body in drawing.shaped(drawing.deformed(1)):
        if body.mesh.volumes:  # A frame has no one axis.
            continue
        line_map = _strain_map(body) if cell_of(body.mesh).axial else _deflection_map(body)
        style.draw(
            drawing.file("deformation.png", body.name, drawing.deformed_count()), _diagram, drawing, body, line_map
        )


def _motion(body: BodyMotion) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return ascending positions [m], (n,), elastic displacements there at all frames [m], (f, n, 3), and the axis."""
    ends = body.nodes[body.mesh.cells[:, :2]]
    direction = unit((ends[:, 1] - ends[:, 0]).sum(axis=0))
    position = (body.nodes - body.nodes[0]) @ direction
    order = np.argsort(position)
    elastic = np.stack([body.elastic(frame) for frame in range(len(body.coordinates))])
    return position[order] - position[order[0]], elastic[:, order], direction


def _strain_map(body: BodyMotion) -> LineMap:
    position, elastic, direction = _motion(body)
    strains = np.gradient(elastic @ direction, position, axis=1)
    # The strain of truncated modes overshoots at the wave front; the 99 % quantile sets the colours.
    top = 1.25 * float(np.percentile(np.abs(strains), 99)) or 1e-12
    factor, name = (1e6, "µm/m") if top < LARGE else (1e2, "%")
    label = f"strain [{name}], tension positive"
    return LineMap("Waves in the bar", "axial strain", position, strains, top, factor, label=label)


def _deflection_map(body: BodyMotion) -> LineMap:
    position, elastic, direction = _motion(body)
    across = elastic - (elastic @ direction)[..., None] * direction
    axis = int(np.abs(across).max(axis=(0, 1)).argmax())
    values = across[..., axis]
    top = float(np.abs(values).max()) or 1e-12
    factor, name = style.prefixed(top, "m")
    quantity = "elastic deflection" if len(body.morph.rigid_twists) else "deflection"
    label = f"{quantity} along {'xyz'[axis]} [{name}]"
    return LineMap("Bending of the beam", quantity, position, values, top, factor, label=label)


def _diagram(drawing: Drawing, body: BodyMotion, line_map: LineMap) -> Figure:
    trajectory = drawing.trajectory
    shown, time_name = style.time_unit(float(trajectory.times[-1]))
    length, length_unit = (1e3, "mm") if line_map.position[-1] < 1 - 1e-9 else (1.0, "m")
    subtitle = (
        f"{drawing.scene_name}  ·  body {body.name}: {line_map.what} over position and time,"
        f" {len(body.modal.angular_frequencies)} modes"
    )
    figure = style.new_figure(line_map.title, subtitle)
    touched = drawing.touched(body.name)
    axes = figure.add_axes((0.095, 0.11, 0.52 if touched else 0.75, 0.72))
    top = line_map.top * line_map.factor
    image = axes.pcolormesh(
        line_map.position * length, trajectory.frame_times * shown, line_map.values * line_map.factor,
        shading="gouraud", cmap=style.SIGNED, vmin=-top, vmax=top, rasterized=True,
    )  # fmt: skip
    style.plain_axes(axes)
    axes.set(xlabel=f"position [{length_unit}]", ylabel=f"time [{time_name}]")
    axes.set_ylim(0, trajectory.times[-1] * shown)
    if touched:
        _force_beside(figure.add_axes((0.655, 0.11, 0.19, 0.72), sharey=axes), drawing, body, shown)
    beyond = np.abs(line_map.values).max() > line_map.top * (1 + 1e-9)
    box = (0.885, 0.11, 0.018, 0.72)
    style.colour_bar(figure, image, line_map.label, box, "both" if beyond else "neither")
    return figure


def _force_beside(axes: Axes, drawing: Drawing, body: BodyMotion, shown: float) -> None:
    """Draw the force of all contacts on the body, with time upwards."""
    trajectory = drawing.trajectory
    total, windows = np.zeros((len(trajectory.times), 3)), set()
    for name, contact in drawing.contacts_on(body.name).items():
        force_of_contact, window = shown_force(trajectory, name)
        total += (1.0 if contact.body == body.name else -1.0) * force_of_contact
        windows.add(window)
    force = np.linalg.norm(total, axis=1)
    scale, name = style.prefixed(float(force.max()), "N")
    times = middles(trajectory.times) * shown
    axes.fill_betweenx(times, force * scale, color=style.BLUE, alpha=0.15, lw=0)
    axes.plot(force * scale, times, color=style.BLUE, lw=1.8)
    axes.tick_params(labelleft=False)
    axes.set(xlabel=f"contact force [{name}]")
    axes.set_xlim(0, 1.1 * float(force.max()) * scale or 1.0)
    if len(windows) == 1:
        axes.set_title(windows.pop(), loc="left", fontsize=9, color=style.FAINT)
