"""The skin of a solid for drawing: flat triangles and sharp edges, with the fields of the solid's nodes on them.

VTK interpolates nodal fields wherever it divides, cuts or slices. With the mode shapes as fields, a skin is therefore
drawn at any frame without interpolation weights.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pyvista as pv

from gudgeon.pipeline.geometry.cells import PYRAMID13, PYRAMID14, WEDGE6, Block, cell_blocks, cell_of, mirrored
from gudgeon.pipeline.plots.base.run import BodyMotion

CELLS = {
    "triangle": pv.CellType.TRIANGLE, "triangle6": pv.CellType.QUADRATIC_TRIANGLE, "quad": pv.CellType.QUAD,
    "quad8": pv.CellType.QUADRATIC_QUAD, "quad9": pv.CellType.BIQUADRATIC_QUAD,
    "tetra": pv.CellType.TETRA, "tetra10": pv.CellType.QUADRATIC_TETRA, "hexahedron": pv.CellType.HEXAHEDRON,
    "hexahedron20": pv.CellType.QUADRATIC_HEXAHEDRON, "hexahedron27": pv.CellType.TRIQUADRATIC_HEXAHEDRON,
    "wedge": pv.CellType.WEDGE, "wedge15": pv.CellType.QUADRATIC_WEDGE,
    "wedge18": pv.CellType.BIQUADRATIC_QUADRATIC_WEDGE, "pyramid": pv.CellType.PYRAMID,
    "pyramid13": pv.CellType.QUADRATIC_PYRAMID,
}  # fmt: skip
"""Kind of cell in VTK by its name."""
DRAWN = {PYRAMID14: PYRAMID13}
"""Cells that are drawn by others of fewer nodes."""
VTK_ORDER = {PYRAMID14: list(range(13)), WEDGE6: mirrored(WEDGE6)}
"""Nodes in the order in which VTK's faces look outward: of linear wedges it is the mirror image."""
SHARP = 25.0
"""Angle between normals of triangles above which their common edge is sharp [deg]."""
LEVELS = (3, 2, 1)
"""Numbers of divisions of a facet into four."""
PLACE = "place"
"""Field of the positions: VTK stores points that it adds in single precision, but fields in double."""

EMPTY: Mapping[str, np.ndarray] = MappingProxyType({})


class Skin(NamedTuple):
    """Flat triangles of a body's surface, split where it is sharp, and its sharp edges."""

    surface: pv.PolyData
    edges: pv.PolyData

    @property
    def points(self) -> np.ndarray:
        """Points of the triangles, then of the edges [m], (p, 3)."""
        return np.concatenate([mesh.points for mesh in self])

    def take(self, name: str) -> np.ndarray:
        """Return a field at all points, (p, ...), and remove it from the skin."""
        return np.concatenate([mesh.point_data.pop(name) for mesh in self if mesh.n_points])

    def move(self, points: np.ndarray) -> None:
        """Move all points (p, 3), and update the normals of the triangles."""
        count = self.surface.n_points
        self.surface.points, self.edges.points = points[:count], points[count:]
        # VTK returns old normals if there are any.
        self.surface.point_data.pop("Normals", None)
        turned = self.surface.compute_normals(cell_normals=False, consistent_normals=False)
        self.surface.point_data["Normals"] = turned.point_data["Normals"]
        self.surface.point_data.active_normals_name = "Normals"

    def colour(self, values: np.ndarray) -> None:
        """Set the values that colour the triangles, (p,); those of the edges are ignored."""
        self.surface.point_data["magnitude"] = values[: self.surface.n_points]


class Thread(NamedTuple):
    """The nodes of a bar or a beam with lines between them, or the points of a rigid body."""

    surface: pv.PolyData
    lines: bool

    @property
    def points(self) -> np.ndarray:
        """(p, 3) [m]"""
        return np.asarray(self.surface.points)

    def move(self, points: np.ndarray) -> None:
        """Move all points (p, 3)."""
        self.surface.points = points

    def colour(self, values: np.ndarray) -> None:
        """Set the values that colour the points, (p,)."""
        self.surface.point_data["magnitude"] = values


class Cut(NamedTuple):
    """A plane along which a body is cut open."""

    origin: np.ndarray
    keep: np.ndarray
    """Unit normal, towards the part that is kept, (3,)."""


def make_skin(
    nodes: np.ndarray, blocks: Sequence[Block], triangles: int, fields: Mapping[str, np.ndarray], cut: Cut | None = None
) -> Skin:
    """Return the skin of solid cells or of facets of a body with nodes (n, 3).

    Args:
        triangles: Target number of flat triangles; the finest division with no more is used.
        fields: Values at the nodes by name, (n, ...); the skin has their values at its points, (p, k).
        cut: The body ends there with a plane face.
    """
    cells = [(CELLS[DRAWN.get(cell, cell).name], rows[:, VTK_ORDER.get(cell, slice(None))]) for cell, _, rows in blocks]
    grid = pv.UnstructuredGrid(dict(cells), nodes)
    grid.point_data[PLACE] = nodes
    for name, values in fields.items():
        grid.point_data[name] = values.reshape(len(nodes), -1) if values.ndim > 1 else values
    facets = _divided(grid, 0).n_cells
    level = next((level for level in LEVELS if 4**level * facets <= triangles), 0)
    closed = _divided(grid, level)
    closed.points = closed.point_data[PLACE]
    edges = closed.extract_feature_edges(SHARP, non_manifold_edges=False, manifold_edges=False)
    if cut is not None:
        rim = closed.slice(cut.keep, origin=cut.origin)
        edges = edges.clip(cut.keep, origin=cut.origin, invert=False).append_polydata(rim)
        # Clipping merges points at one place, so it precedes the split at sharp edges.
        closed = closed.clip(cut.keep, origin=cut.origin, invert=False).triangulate()
    surface = closed.compute_normals(
        cell_normals=False, split_vertices=True, feature_angle=SHARP, consistent_normals=False
    )
    return Skin(surface if cut is None else surface.append_polydata(grid.slice(cut.keep, origin=cut.origin)), edges)


def skin_of(
    body: BodyMotion, triangles: int, fields: Mapping[str, np.ndarray] = EMPTY, cut: Cut | None = None
) -> tuple[BodyMotion, Skin]:
    """Return the motion of the points of a solid's skin, and the skin itself, see `make_skin`."""
    assert body.modal.shapes is not None
    skin = make_skin(body.nodes, cell_blocks(body.mesh), triangles, {**fields, "shapes": body.modal.shapes}, cut)
    return body.on(skin.points, skin.take("shapes")), skin


def thread_of(body: BodyMotion) -> tuple[BodyMotion, Thread]:
    """Return the motion of the nodes of a body without volume, and what is drawn of it."""
    cells, lines = body.mesh.cells, cell_of(body.mesh).dimension == 1
    points = pv.PolyData(body.nodes.copy())
    if lines:
        points = pv.PolyData(body.nodes.copy(), lines=np.column_stack([np.full(len(cells), 2), cells[:, :2]]).ravel())
    if body.modal.shapes is None or not body.modal.shapes.size:
        rigid = replace(body.modal, shapes=np.zeros((len(body.nodes), 3, len(body.modal.angular_frequencies))))
        body = replace(body, modal=rigid)
    return body, Thread(points, lines)


def _divided(grid: pv.UnstructuredGrid, level: int) -> pv.PolyData:
    surface = grid.extract_surface(
        nonlinear_subdivision=level, algorithm="dataset_surface", pass_pointid=False, pass_cellid=False
    )
    return surface if surface.is_all_triangles else surface.triangulate()
