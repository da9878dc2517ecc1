"""Traction spaces: smooth tractions on a surface over which points of another body slide.

Chart and splines are those of `modaldb.records.traction`. Row a is the mean normal displacement under its unit
traction, ∫ N_a n·u dA / ∫ N_a dA, over the curved facets with their true outward normal n. Where the surface extends
beyond the space, the splines next to its edges keep their tails, so that a force there is as smooth as one inside;
where the surface ends, they are cut off and joined with their neighbours so that they act at their centres, see
`end_splines`. On a patch, functions that find no surface are those of their nearest one, moved alike.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.modaldb.records.modes import SplineGrid, TractionModes
from gudgeon.modaldb.records.traction import SUPPORT, along_direction, chart_coordinates, spline_weights
from gudgeon.modaldb.records.types import Json
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.cells import FACET_WIDTH, cell_of, corner_triangles
from gudgeon.pipeline.geometry.surfaces import find_surface
from gudgeon.pipeline.interfaces.end_splines import placed_tractions
from gudgeon.pipeline.interfaces.height_field import distance, nearest_kept, patch_chart
from gudgeon.pipeline.interfaces.points import facet_points, surface_points
from gudgeon.pipeline.scenes.interface import Interface

MOST_FUNCTIONS = 1000
"""Of one component: R has a row for each, and each needs a static solution."""
PIECES_PER_SPACING = 2
"""Quadrature triangles along one knot interval at least: splines are smooth pieces between knots."""
LEAST_SHARE = 1e-4
"""Least share of a knot rectangle that a function must have on the mesh; one cut at a corner has 1/24²."""
IN_PLANE = 1e-3
"""Largest normal part of the unit vector `along` of a plane."""
KEYS = {"cylinder": ("sector_deg", "height"), "plane": ("along", "extent")}
"""Keys of an interface that are for one shape only."""
BATCH = 40_000
"""Quadrature points at once: about 100 MB of work arrays."""


@dataclass(frozen=True)
class TractionSpace(SplineGrid):
    """A traction space on a mesh."""

    areas: np.ndarray
    """∫ N_a dA [m^2], (f,)."""
    weights: sparse.csr_matrix
    """Mean normal displacement under each unit traction per nodal displacement, node by node, (f, 3n)."""
    resultant: np.ndarray
    """Force and moment about the component's origin of each unit traction [1, m], (f, 6)."""
    placing: sparse.csr_matrix
    """D of the tractions that the end of the surface cuts off, see `end_splines`, (f, f)."""
    dropped: int = 0
    """Functions of a patch that find no surface."""
    off: float = 0.0
    """Largest distance of nodes from the height of a patch [m]."""

    def rows(self, model: FEModel) -> sparse.csr_matrix:
        """B: mean normal displacement under each unit traction as a matrix on the dofs, (f, dofs)."""
        return model.on_dofs(self.weights)

    def modes(self, rows: np.ndarray) -> TractionModes:
        """Return the record with the functions' displacement per coordinate, (f, m)."""
        return TractionModes(self.chart, self.start, self.spacing, self.counts, rows, self.resultant)

    def across(self, mesh: MeshRecord, surface: Surface) -> "AcrossNormals":
        """Return the same functions as tractions across the normal: along the chart's `along` and normal × it."""
        along = along_direction(self.chart)

        def turned(elements: np.ndarray, axis: int) -> np.ndarray:
            areas = np.linalg.norm(elements, axis=-1, keepdims=True)
            normals = elements / areas
            t1 = along - (normals @ along)[..., None] * normals
            t1 /= np.linalg.norm(t1, axis=-1, keepdims=True)
            return np.asarray(areas * (np.cross(normals, t1) if axis else t1))

        rows, resultants = list[sparse.csr_matrix](), list[np.ndarray]()
        for axis in range(2):
            direction = partial(turned, axis=axis)
            areas, weights, moments, _ = _integrals(mesh, surface, self, direction)
            placed = self.placing @ sparse.diags(1 / np.where(areas > 0, areas, 1.0))
            rows.append(sparse.csr_matrix(placed @ weights))
            resultants.append(placed @ moments)
        order = np.arange(2 * self.size).reshape(2, -1).T.ravel()
        return AcrossNormals(sparse.csr_matrix(sparse.vstack(rows, format="csr")[order]), np.stack(resultants, axis=1))

    @property
    def centres(self) -> np.ndarray:
        """Coordinates of the functions' centres, scaled so that the space is [−1, 1], (f, 2)."""
        axes = [2 * (np.arange(count) - 1) / (count - 3) - 1 for count in self.counts]
        return np.column_stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")])


@dataclass(frozen=True)
class AcrossNormals:
    """The functions of a traction space as tractions across the normal, along which friction acts."""

    weights: sparse.csr_matrix
    """Mean displacement along t1 and t2 of the first function, then of the second, and so on, (2f, 3n)."""
    resultant: np.ndarray
    """Force and moment about the component's origin of each unit traction [1, m], (f, 2, 6)."""


def traction_space(mesh: MeshRecord, interface: Interface, key: str) -> TractionSpace:
    """Return the traction space of an interface of kind `traction`; `key` is its key in the scene, for messages.

    Raises:
        InputError: the surface is no height over a plane, the space is not on it, or it has too many functions.
    """
    surface = find_surface(mesh, interface.surface, f"{key}.surface")
    grid = _grid(mesh, surface, interface, key)
    areas, weights, moments, first_moments = _integrals(mesh, surface, grid)
    smallest, active = LEAST_SHARE * float(grid.spacing.prod()), np.arange(grid.size)
    patch = grid.chart["kind"] == "patch"
    if patch and (areas >= smallest).any():
        active = nearest_kept(grid.counts, areas >= smallest)
    elif areas.min() < smallest:
        i, j = divmod(int(areas.argmin()), int(grid.counts[1]))
        limits = "sector_deg and height" if grid.chart["kind"] == "cylinder" else "extent"
        position = grid.start + (np.array([i, j]) - 1) * grid.spacing
        raise InputError(
            f"{key}: {int((areas < smallest).sum())} functions of the traction space find no surface, such as the one"
            f" at ({position[0]:.4g}, {position[1]:.4g}) m across and along; keep {limits} within '{interface.surface}'"
        )
    on_surface = areas >= smallest
    centroids = np.where(on_surface[:, None], first_moments / np.where(on_surface, areas, 1.0)[:, None], np.nan)
    placing = placed_tractions(grid, centroids, active)
    placed = placing @ sparse.diags(1 / np.where(on_surface, areas, 1.0))
    off = distance(grid.chart, mesh.nodes[np.unique(surface.facets)]) if patch else 0.0
    return TractionSpace(
        **vars(grid), areas=areas[active], weights=sparse.csr_matrix(placed @ weights), resultant=placed @ moments,
        placing=placing, dropped=int((~on_surface).sum()), off=off,
    )  # fmt: skip


def refuse_too_many(spaces: dict[str, TractionSpace], key: str) -> None:
    """Refuse traction spaces of a component, with key `key`, that together have more than MOST_FUNCTIONS functions.

    Raises:
        InputError: they have.
    """
    total = sum(space.size for space in spaces.values())
    if total > MOST_FUNCTIONS:
        each = ", ".join(f"{space.size} in {name}" for name, space in spaces.items())
        raise InputError(
            f"{key}: {total} traction functions ({each}), at most {MOST_FUNCTIONS} in a component; spacings"
            f" {_coarsening(spaces.values()):.3g} times as large fit"
        )


def refuse_unresolved(spaces: dict[str, TractionSpace], key: str) -> None:
    """Refuse traction spaces of a component, with key `key`, that have more functions than nodes under them.

    Raises:
        InputError: one has.
    """
    for name, space in spaces.items():
        nodes = len(np.unique(space.weights.indices // 3))
        if space.size > nodes:
            raise InputError(
                f"{key}.{name}: {space.size} traction functions on {nodes} nodes, which do not determine them; use a"
                " larger spacing or a finer mesh"
            )


def _grid(mesh: MeshRecord, surface: Surface, interface: Interface, key: str) -> SplineGrid:
    if not cell_of(mesh).solid or surface.facets.shape[1] < FACET_WIDTH:
        raise InputError(f"{key}: a traction space needs a surface of a solid, '{interface.surface}' is none")
    kind = surface.shape.get("kind")
    if kind == "cylinder" and interface.along is not None and interface.sector_deg is None:
        kind = "patch"
    build = {"cylinder": _cylinder, "plane": _plane}.get(str(kind), patch_chart)
    for name in KEYS["plane" if kind == "cylinder" else "cylinder"]:
        if getattr(interface, name) is not None:
            allowed = "planes and patches" if kind == "cylinder" else "cylinders"
            have = kind if kind in ("cylinder", "plane") else "patch, for it is declared as neither cylinder nor plane"
            raise InputError(f"{key}.{name}: is for {allowed}, '{interface.surface}' is a {have}")
    chart, low, high = build(mesh, surface, interface, key)
    assert interface.spacing is not None
    # Round-off must not add an interval where the spacing divides the length.
    intervals = np.maximum(np.ceil((high - low) / np.array(interface.spacing) - 1e-9), 1).astype(int)
    grid = SplineGrid(chart, low, (high - low) / intervals, intervals + 3)
    if grid.size > MOST_FUNCTIONS:
        fits = _coarsening([grid]) * grid.spacing
        raise InputError(
            f"{key}.spacing: {grid.counts[0]} × {grid.counts[1]} = {grid.size} functions, at most {MOST_FUNCTIONS};"
            f" spacing = [{fits[0]:.4g}, {fits[1]:.4g}] m fits"
        )
    return grid


def _coarsening(grids: Iterable[SplineGrid]) -> float:
    """Return the factor on the spacings of grids with which they have few enough functions."""

    def size(factor: float) -> int:
        return sum(int((np.ceil((grid.counts - 3) / factor).astype(int) + 3).prod()) for grid in grids)

    factor = 1.0
    while size(factor) > MOST_FUNCTIONS and factor < 1e6:
        factor *= 1.02
    return 1.01 * factor


def _cylinder(
    mesh: MeshRecord, surface: Surface, interface: Interface, key: str
) -> tuple[Json, np.ndarray, np.ndarray]:
    """Return chart, least and largest coordinates of a space on a cylinder."""
    if interface.sector_deg is None:
        raise InputError(
            f"{key}.sector_deg: is missing; a traction space on a cylinder needs it, or `along` for a patch of it"
        )
    start, stop = np.radians(interface.sector_deg)
    if stop - start > 2 * np.pi * (1 + 1e-12):
        raise InputError(f"{key}.sector_deg: {list(interface.sector_deg)} given, allowed is one turn at most")
    shape = surface.shape
    axis = np.asarray(shape["axis"], float)
    chart = {
        "kind": "cylinder",
        "axis": (axis / np.linalg.norm(axis)).tolist(),
        "origin": [float(x) for x in shape["origin"]],
        "radius": float(shape["radius"]),
        "middle": float((start + stop) / 2),
    }
    heights = chart_coordinates(chart, mesh.nodes[np.unique(surface.facets)])[:, 1]
    low, high = interface.height or (float(heights.min()), float(heights.max()))
    half = chart["radius"] * (stop - start) / 2
    return chart, np.array([-half, low]), np.array([half, high])


def _plane(mesh: MeshRecord, surface: Surface, interface: Interface, key: str) -> tuple[Json, np.ndarray, np.ndarray]:
    """Return chart, least and largest coordinates of a space on a plane; across × along is the outward normal."""
    if interface.along is None:
        raise InputError(f"{key}.along: is missing; a traction space on a plane needs the direction of sliding")
    outward = surface_points(mesh.nodes, surface)[1].sum(axis=0)
    normal = np.asarray(surface.shape["normal"], float)
    normal = normal / np.linalg.norm(normal) * np.sign(normal @ outward)
    length = float(np.linalg.norm(interface.along))
    if length == 0 or abs(np.dot(interface.along, normal)) > IN_PLANE * length:
        direction = list(interface.along)
        raise InputError(
            f"{key}.along: {direction} given, it must be a direction in the plane of '{interface.surface}'"
        )
    along = np.array(interface.along) - normal * np.dot(interface.along, normal)
    along /= np.linalg.norm(along)
    chart = {
        "kind": "plane",
        "origin": [float(x) for x in surface.shape["origin"]],
        "normal": normal.tolist(),
        "across": np.cross(along, normal).tolist(),
        "along": along.tolist(),
    }
    if interface.extent is not None:
        low, high = np.array(interface.extent).T
        return chart, low, high
    coordinates = chart_coordinates(chart, mesh.nodes[np.unique(surface.facets)])
    return chart, coordinates.min(axis=0), coordinates.max(axis=0)


def _integrals(
    mesh: MeshRecord,
    surface: Surface,
    grid: SplineGrid,
    turned: Callable[[np.ndarray], np.ndarray] = lambda elements: elements,
) -> tuple[np.ndarray, sparse.csr_matrix, np.ndarray, np.ndarray]:
    """Integrate over the facets: ∫ N_a dA (f,), ∫ N_a t N_b dA (f, 3n), force and moment of N_a t (f, 6), and N_a times
    the coordinates of the chart (f, 2).

    Args:
        turned: Returns t dA of n dA, (…, 3); t is the outward normal n by default.
    """
    corners = mesh.nodes[corner_triangles(surface.facets)[0]]
    edge = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()
    facets = surface.facets[_near(mesh.nodes, grid, edge)[surface.facets].any(axis=1)]
    pieces = int(np.ceil(PIECES_PER_SPACING * edge / grid.spacing.min()))
    areas, resultants, first_moments = np.zeros(grid.size), np.zeros((grid.size, 6)), np.zeros((grid.size, 2))
    total = sparse.csr_matrix((grid.size, 3 * len(mesh.nodes)))
    at_once = max(BATCH // (6 * pieces**2), 1)
    for start in range(0, len(facets), at_once):
        some = facets[start : start + at_once]
        for block in facet_points(mesh.nodes, replace(surface, facets=some), pieces):
            points, elements = block.points.reshape(-1, 3), block.vectors.reshape(-1, 3)
            coordinates, sizes = chart_coordinates(grid.chart, points), np.linalg.norm(elements, axis=1)
            splines = spline_matrix(grid, coordinates, tails=True)
            splines.eliminate_zeros()
            areas += splines.T @ sizes
            first_moments += splines.T @ (coordinates * sizes[:, None])
            elements = turned(elements)
            resultants += splines.T @ np.column_stack([elements, np.cross(points, elements)])
            total += splines.T @ _displacements(block.N, block.nodes, elements, 3 * len(mesh.nodes))
    return areas, total, resultants, first_moments


def _near(nodes: np.ndarray, grid: SplineGrid, edge: float) -> np.ndarray:
    """Return which nodes may belong to a facet on which some function is not zero, (n,)."""
    coordinates, margin = chart_coordinates(grid.chart, nodes), 3 * grid.spacing + edge
    end = grid.start + grid.spacing * (grid.counts - 3)
    return np.all((coordinates > grid.start - margin) & (coordinates < end + margin), axis=1)


def _displacements(N: np.ndarray, facets: np.ndarray, elements: np.ndarray, size: int) -> sparse.csr_matrix:
    """Return t·u dA at all quadrature points as a matrix on nodal displacements, (f·q, 3n)."""
    count, width = N.shape[1], 3 * len(N)
    values = elements.reshape(len(facets), count, 1, 3) * N.T[:, :, None]
    columns = np.repeat((3 * facets[:, :, None] + np.arange(3)).reshape(len(facets), 1, width), count, axis=1)
    starts = width * np.arange(len(elements) + 1)
    return sparse.csr_matrix((values.ravel(), columns.ravel(), starts), shape=(len(elements), size))


def spline_matrix(grid: SplineGrid, coordinates: np.ndarray, *, tails: bool = False) -> sparse.csr_matrix:
    """Return all functions at points (p, 2), see `spline_weights`, as a matrix, (p, f)."""
    numbers, values = spline_weights(grid, coordinates, tails=tails)
    starts = SUPPORT * np.arange(len(coordinates) + 1)
    return sparse.csr_matrix((values.ravel(), numbers.ravel(), starts), shape=(len(coordinates), grid.size))
