"""`modes.png` of a part: its lowest modes with their frequencies, drawn like its deformation."""

from collections.abc import Callable, Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation

from gudgeon.pipeline.geometry.cells import FLAT_TRIANGLES, cell_of
from gudgeon.pipeline.plots.base import style, view
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.base.surface import skin_of
from gudgeon.solver.vectors import unit

SHOWN = 6
"""Number of modes."""
COLUMNS = 3
TRIANGLES = 30_000
"""Target number of flat triangles of a solid."""
PANEL = (500, 430)
"""Size of the picture of a mode [px]."""
TOWARDS = np.array([0.55, -0.75, 0.38])
"""From a solid to the camera."""
KINDS = ("points", "line", "plane part", "solid")
"""What a part is called by the dimension of its cells."""
RIGID = 1e-6
"""Frequency, of the highest one, up to which a mode is a rigid motion."""


def draw_modes(drawing: Drawing) -> None:
    """Draw one picture for each elastic part; bodies of one component share it."""
    components = dict(_parts(drawing))
    for name, body in components.items():
        style.draw(drawing.file("modes.png", name, len(components)), _picture, drawing, name, body)


def _parts(drawing: Drawing) -> Iterator[tuple[str, BodyMotion]]:
    """Yield name and a body of each component with elastic modes; one without cells has nothing to draw."""
    seen: set[str] = set()
    for body in drawing.shaped(drawing.trajectory.bodies):
        if cell_of(body.mesh).dimension and body.morph.modes_key not in seen and len(body.modal.angular_frequencies):
            seen.add(body.morph.modes_key)
            yield drawing.scene.get("body", {}).get(body.name, {}).get("component") or body.name, body


def lowest(body: BodyMotion) -> np.ndarray:
    """Return the numbers of a body's lowest elastic modes, not its static shapes."""
    omega = body.modal.angular_frequencies
    normal = omega[: body.modal.normal_count or len(omega)]
    order = np.argsort(normal, kind="stable")
    return order[normal[order] > RIGID * omega.max()][:SHOWN]


def _picture(drawing: Drawing, name: str, body: BodyMotion) -> Figure:
    numbers, panel = lowest(body), _panel(body)
    kind = KINDS[cell_of(body.mesh).dimension]
    rows = -(-len(numbers) // COLUMNS)
    how = "shape over the axis" if kind == "line" and not body.mesh.volumes else style.CAPPED
    height = 200 + 500 * rows
    figure = style.new_figure("Modes", f"{drawing.scene_name}  ·  part {name} ({kind})  ·  {how}", height=height)
    for rank, mode in enumerate(numbers):
        row, column = divmod(rank, COLUMNS)
        box = (0.02 + 0.325 * column, 1 - (210 + 500 * row + PANEL[1]) / height, 0.31, PANEL[1] / height)
        axes = figure.add_axes(box)
        panel(axes, int(mode))
        axes.set(xticks=[], yticks=[])
        style.plain_axes(axes)
        hertz = body.modal.angular_frequencies[mode] / (2 * np.pi)
        axes.set_title(f"{rank + 1}: {style.quantity(float(hertz), 'Hz')}", loc="left", fontsize=10, fontweight="bold")
    return figure


def _panel(body: BodyMotion) -> Callable[[Axes, int], None]:
    """Return a function that draws a mode of a body, by its number, on axes."""
    if (dimension := cell_of(body.mesh).dimension) == 1:
        return _frame(body) if body.mesh.volumes else _line(body)
    return _plane(body) if dimension == 2 else _solid(body)


def _scaled(body: BodyMotion, mode: int) -> np.ndarray:
    """Return the shape of a mode whose largest displacement is the largest drawn one [m], (n, 3)."""
    assert body.modal.shapes is not None
    shape = body.modal.shapes[:, :, mode]
    return shape * (style.SHOWN * body.size / (float(np.linalg.norm(shape, axis=1).max()) or 1.0))


def _solid(body: BodyMotion) -> Callable[[Axes, int], None]:
    skinned, skin = skin_of(body, TRIANGLES)

    def draw(axes: Axes, mode: int) -> None:
        moved = _scaled(skinned, mode)
        skin.move(skinned.nodes + moved)
        skin.colour(np.linalg.norm(moved, axis=1))
        plotter = view.new_plotter(PANEL)
        view.add_skin(plotter, skin, style.MAGNITUDE, (0.0, style.SHOWN * body.size), 2.0)
        view.aim(plotter, view.View(unit(TOWARDS), np.array([0.0, 0.0, 1.0])), skin.points)
        axes.imshow(np.asarray(view.photograph(plotter, PANEL, last=True)))

    return draw


def _plane(body: BodyMotion) -> Callable[[Axes, int], None]:
    def draw(axes: Axes, mode: int) -> None:
        moved = _scaled(body, mode)
        positions, size = body.nodes[:, :2] + moved[:, :2], np.linalg.norm(moved, axis=1)
        flat = Triangulation(positions[:, 0], positions[:, 1], body.mesh.cells[:, FLAT_TRIANGLES].reshape(-1, 3))
        axes.tripcolor(flat, size, shading="gouraud", cmap=style.MAGNITUDE)
        axes.set_aspect("equal")

    return draw


def _line(body: BodyMotion) -> Callable[[Axes, int], None]:
    """Draw a shape over the position along the axis: a bar's motion along it, a beam's largest one across."""
    ends = body.nodes[body.mesh.cells[:, :2]]
    along = unit((ends[:, 1] - ends[:, 0]).sum(axis=0))
    position = (body.nodes - body.nodes[0]) @ along
    order = np.argsort(position)

    def draw(axes: Axes, mode: int) -> None:
        shape = _scaled(body, mode)
        across = shape - np.outer(shape @ along, along)
        axis = int(np.abs(across).max(axis=0).argmax())
        axial = cell_of(body.mesh).axial
        values, label = (shape @ along, "along the axis") if axial else (across[:, axis], f"along {'xyz'[axis]}")
        axes.plot(position[order], values[order], color=style.BLUE, lw=1.8)
        axes.axhline(0.0, color=style.FAINT, lw=0.7)
        axes.set_ylim(-1.1 * float(np.abs(values).max()), 1.1 * float(np.abs(values).max()))
        axes.set_title(label, loc="right", fontsize=style.LEAST_TEXT, color=style.FAINT)

    return draw


def _frame(body: BodyMotion) -> Callable[[Axes, int], None]:
    """Draw the members of a frame from above and aside, at rest and moved."""
    across = unit(np.cross([0.0, 0.0, 1.0], TOWARDS))
    flat = np.column_stack([across, np.cross(unit(TOWARDS), across)])

    def draw(axes: Axes, mode: int) -> None:
        for points, colour, width in (
            (body.nodes, style.FAINT, 0.8),
            (body.nodes + _scaled(body, mode), style.BLUE, 2),
        ):
            ends = (points @ flat)[body.mesh.cells]
            axes.plot(ends[:, :, 0].T, ends[:, :, 1].T, color=colour, lw=width, solid_capstyle="round")
        axes.set_aspect("equal")

    return draw
