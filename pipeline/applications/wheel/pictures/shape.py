"""`wheel.png`: the whole tuned wheel in the nodal-diameter mode with the largest response."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from PIL.Image import Image

from gudgeon.modaldb.records.cyclic import CyclicHarmonic, CyclicRecord, WheelRecord
from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.applications.wheel.pictures.curves import harmonic_of
from gudgeon.pipeline.geometry.cells import Block, cell_blocks
from gudgeon.pipeline.geometry.symmetry import CyclicSymmetry
from gudgeon.pipeline.plots.base import style, view
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.base.surface import make_skin

TRIANGLES = 250_000
"""Target number of flat triangles."""
SHOWN = 0.07
"""Largest drawn displacement, relative to the wheel's diameter."""
MERGE = 0.7390851e-6
"""Nodes closer than this times the wheel's diameter are merged; no round number, so that no coordinate lies between two
cells of the rounding."""


def draw_wheel(drawing: Drawing) -> None:
    """Draw the mode of the engine order's harmonic closest to the peak of the tuned wheel's response."""
    wheel: WheelRecord = drawing.store.get(drawing.key, "wheel", only=["excitation", "tuned"])
    cyclic: CyclicRecord = drawing.store.get(wheel.modes_key, "cyclic")
    mesh: MeshRecord = drawing.store.get(cyclic.mesh_key, "mesh")
    harmonic = cyclic.harmonics[str(harmonic_of(wheel.engine_order, cyclic.sectors))]
    peak = wheel.excitation[np.hypot(wheel.tuned[:, 0, 0], wheel.tuned[:, 0, 1]).argmax()]
    mode = int(np.abs(harmonic.angular_frequencies - peak).argmin())
    style.draw(drawing.file("wheel.png"), lambda: _picture(drawing.scene_name, mesh, cyclic, harmonic, mode))


def whole_wheel(
    mesh: MeshRecord, cyclic: CyclicRecord, harmonic: CyclicHarmonic, mode: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return nodes [m] (n, 3), cells (e, 10) and one mode [kg^-½] (n, 3) of all sectors, common nodes merged."""
    axis, origin = tuple(cyclic.axis.tolist()), cyclic.origin
    symmetry = CyclicSymmetry(sectors=cyclic.sectors, axis=axis)
    shape = harmonic.real[:, :, mode].astype(complex)
    if harmonic.imaginary is not None:
        shape += 1j * harmonic.imaginary[:, :, mode]
    nodes, fields, R = [], [], np.eye(3)
    for sector in range(cyclic.sectors):
        nodes.append((mesh.nodes - origin) @ R.T + origin)
        fields.append(np.real(np.exp(1j * harmonic.harmonic * sector * symmetry.angle) * shape) @ R.T)
        R = symmetry.rotation @ R
    positions = np.concatenate(nodes)
    cell = np.round(positions / (MERGE * np.ptp(positions, axis=0).max())).astype(np.int64)
    _, representative, merged = np.unique(cell, axis=0, return_index=True, return_inverse=True)
    offsets = len(mesh.nodes) * np.arange(cyclic.sectors)
    cells = merged.ravel()[(mesh.cells + offsets[:, None, None]).reshape(-1, mesh.cells.shape[1])]
    return positions[representative], cells, np.concatenate(fields)[representative]


def _picture(scene: str, mesh: MeshRecord, cyclic: CyclicRecord, harmonic: CyclicHarmonic, mode: int) -> Figure:
    nodes, cells, field = whole_wheel(mesh, cyclic, harmonic, mode)
    size, largest = float(np.ptp(nodes, axis=0).max()), float(np.linalg.norm(field, axis=1).max())
    axial = field @ cyclic.axis / largest
    blocks = cell_blocks(replace(mesh, nodes=nodes, cells=cells))
    image = _render(nodes, blocks, field * (SHOWN * size / largest), axial, cyclic.axis)
    hertz = float(harmonic.angular_frequencies[mode]) / (2 * np.pi)
    n = harmonic.harmonic
    figure = style.new_figure(
        f"{n} nodal diameter{'s' if n != 1 else ''}, {style.quantity(hertz, 'Hz')}",
        f"{scene}  ·  tuned wheel of {cyclic.sectors} sectors, mode {mode + 1} of harmonic {n}"
        f"  ·  {len(nodes):,} nodes, of which {len(mesh.nodes):,} were computed",
    )
    style.show_image(figure, image, (0.02, 0.06))
    colours = ScalarMappable(Normalize(-1.0, 1.0), style.SIGNED)
    style.colour_bar(figure, colours, "axial displacement / largest displacement", style.BAR)
    return figure


def _render(
    nodes: np.ndarray, blocks: Sequence[Block], shown: np.ndarray, axial: np.ndarray, axis: np.ndarray
) -> Image:
    skin = make_skin(nodes, blocks, TRIANGLES, {"shown": shown, "axial": axial})
    skin.move(skin.points + skin.take("shown"))
    skin.colour(skin.take("axial"))
    plotter = view.new_plotter(style.IMAGE)
    view.add_skin(plotter, skin, style.SIGNED, (-1.0, 1.0), 2.0)
    view.aim(plotter, view.looking(axis, axis, 0.0, 38.0), skin.points)
    return view.photograph(plotter, style.IMAGE, last=True)
