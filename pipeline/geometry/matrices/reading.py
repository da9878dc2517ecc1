"""From the files of a body's matrices to its mesh record: degrees of freedom, units, named sets."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy import sparse
from scipy.spatial import ConvexHull, QhullError

from gudgeon.modaldb.records.mesh import GENERALISED, MeshRecord, Surface, SystemMatrices, Triangle
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import CELLS, NODES, TETRA10, WEDGE6, Cell
from gudgeon.pipeline.geometry.decks.model import MISSING, Block, Deck, Scope
from gudgeon.pipeline.geometry.decks.reading import FAMILIES, WHOLE, read_deck
from gudgeon.pipeline.geometry.decks.solids import righted, righted_note
from gudgeon.pipeline.geometry.matrices.ansys import read_full, read_sub
from gudgeon.pipeline.geometry.matrices.exodus import read_reduced
from gudgeon.pipeline.geometry.matrices.model import Given, MatrixFiles
from gudgeon.pipeline.geometry.matrices.nastran import read_dmig, read_op4
from gudgeon.pipeline.geometry.matrices.rows import centre_of_mass, matrix_rows, to_basic_axes
from gudgeon.pipeline.geometry.matrices.skin import boundary, nodal_areas
from gudgeon.pipeline.geometry.matrices.text_matrix import read_text_matrices
from gudgeon.pipeline.geometry.shape_fit import fit_shape
from gudgeon.pipeline.geometry.surfaces import SurfaceRule, cylindrical, distance, true_surface

EXODUS = (".nc4", ".e", ".exo", ".ex2", ".exii", ".g", ".gen")
BOTH = (".full", ".sub", *EXODUS)
"""Endings of files that hold stiffness and mass."""
TEXT, BULK = (".sti", ".mtx"), (".bdf", ".nas", ".dat", ".pch", ".dmig")
ZERO_AREA = 1e-9
"""Area of a node over the largest one of its surface, of nodes that stand for none: corners of six-node facets."""
BOUNDARY, MOST_NAMED = "boundary", 200
"""Name of the set of all nodes of a superelement, and nodes up to which each has a name."""
DIRECTIONS = 3
"""Translations of a node."""
OFF_SHAPE = 1e-5
"""Farthest that a set may lie from its declared shape, over the shape's or the set's size."""


def read_matrices(files: MatrixFiles) -> MeshRecord:
    """Return the record of a body; in SI units.

    Raises:
        InputError: a file is missing or damaged, or they do not fit each other.
    """
    matrices, model = _given(files), read_model(files.model, Scope(files.part, files.instance))
    dofs = matrix_rows(files, matrices, model)
    if Path(files.stiffness).suffix.lower() not in TEXT:
        matrices = to_basic_axes(files, matrices, dofs, model)
    system, node_rows, blocks = _system(files, matrices, dofs, model)
    points = files.unit * model.points[node_rows]
    new_row = np.full(len(model.labels), -1)
    new_row[node_rows] = np.arange(len(node_rows))
    turned = [righted(block.cell, new_row[block.nodes], points) for block in blocks]
    blocks = [block._replace(nodes=nodes) for block, (nodes, _) in zip(blocks, turned, strict=True)]
    inside_out, cell = sum(count for _, count in turned), _common_cell(blocks)
    remarks = {"notes": [righted_note(inside_out, sum(len(b.nodes) for b in blocks))]} if inside_out else {}
    cells = np.concatenate([b.nodes for b in blocks]) if cell.dimension else np.arange(len(points))[:, None]
    centre = points.mean(axis=0) if blocks else centre_of_mass(system, points)
    surfaces = _surfaces(files, model, (points, centre), new_row, blocks, cell)
    return MeshRecord(points, cells, cell.name, surfaces, system=system, remarks=remarks)


def read_model(path: str, scope: Scope = WHOLE) -> Deck:
    """Return nodes, solids and sets of a deck; cells whose mid-edge nodes are left out have their corners.

    Args:
        scope: Which of several bodies it is.

    Raises:
        InputError: it is missing, damaged or of another kind.
    """
    if (ending := Path(path).suffix.lower()) not in FAMILIES:
        raise InputError(f"{path}: '{ending}' given as geometry.model; allowed: {', '.join(FAMILIES)}")
    deck = read_deck(path, scope)
    solids = [block for block in deck.blocks if block.cell.dimension == 3]
    return replace(deck, blocks=tuple(_linear(b) if (b.nodes == MISSING).any() else b for b in solids))


def _linear(block: Block) -> Block:
    corners = block.cell.shape.corners
    cell = next(c for c in CELLS.values() if c.shape is block.cell.shape and c.nodes == corners)
    return block._replace(cell=cell, nodes=block.nodes[:, :corners])


def surfaces_of(path: str, model: Deck, unit: float) -> dict[str, Surface]:
    """Return the named sets of a model, of all of its nodes, with the true shapes that fit them.

    Args:
        path: Of its file.
        unit: Metres per unit of length.
    """
    files = MatrixFiles(
        stiffness=path, mass=None, dofs=None, model=path, part=None, instance=None, stiffness_name=None, mass_name=None,
        unit=unit, mass_unit=1.0, surfaces={},
    )  # fmt: skip
    blocks = [block._replace(nodes=model.rows(block.nodes, path)) for block in model.blocks]
    rows = np.arange(len(model.labels))
    points = unit * model.points
    return _surfaces(files, model, (points, points.mean(axis=0)), rows, blocks, _common_cell(blocks))


def _common_cell(blocks: list[Block]) -> Cell:
    """Return the type of the elements where all have one; pictures take six nodes for those of a triangle."""
    cells = {block.cell for block in blocks}
    return cells.pop() if len(cells) == 1 and WEDGE6 not in cells else NODES


def _given(files: MatrixFiles) -> Given:
    ending, mass = Path(files.stiffness).suffix.lower(), files.mass or files.stiffness
    names = files.stiffness_name, files.mass_name
    if ending in TEXT:
        if files.mass is None:
            raise InputError(f"{files.stiffness}: holds one matrix; geometry.mass is missing")
        return read_text_matrices(files.stiffness, mass, files.dofs)
    if ending == ".op4":
        return read_op4(files.stiffness, mass, names, files.dofs)
    if ending not in (*BULK, *BOTH):
        raise InputError(f"{files.stiffness}: '{ending}' given; allowed: {', '.join((*TEXT, '.op4', *BULK, *BOTH))}")
    if files.dofs is not None:
        raise InputError(f"{files.dofs}: given, but {files.stiffness} names nodes and directions itself")
    if ending in BULK:
        return read_dmig(files.stiffness, mass, names)
    if files.mass is not None:
        raise InputError(f"{files.mass}: given, but {files.stiffness} holds both matrices; remove geometry.mass")
    if ending in EXODUS:
        return read_reduced(files.stiffness, names)
    return read_sub(files.stiffness) if ending == ".sub" else read_full(files.stiffness)


def _system(
    files: MatrixFiles, matrices: Given, dofs: np.ndarray, model: Deck
) -> tuple[SystemMatrices, np.ndarray, list[Block]]:
    """Return matrices in SI units on the nodes that are kept, these nodes, and elements by rows of the model.

    Rows without any entry, such as rotations of solids, are left out. Nodes without any row stay where an element
    has them: they are held. Of a superelement no element stays: what is between its nodes is condensed.
    """
    alive = np.flatnonzero(np.abs(matrices.K).sum(axis=1) + np.abs(matrices.M).sum(axis=1))
    if not len(alive):
        raise InputError(f"{files.stiffness}: all entries are zero")
    dofs = dofs[alive]
    generalised = dofs[:, 1] == GENERALISED
    elements = () if generalised.any() or model.retained is not None else model.blocks
    blocks = [block._replace(nodes=model.rows(block.nodes, files.model)) for block in elements]
    rows = np.unique(np.concatenate([dofs[~generalised, 0], *(block.nodes.ravel() for block in blocks)]))
    if not len(rows):
        raise InputError(f"{files.stiffness}: has no row of a node; allowed: superelements with boundary nodes")
    _refuse_eliminated(files, model, dofs, blocks)
    order = np.lexsort((dofs[:, 1], dofs[:, 0], generalised))
    dofs, alive = dofs[order], alive[order]
    # An entry between rotations or generalised coordinates, which have no unit here, has one length more for each.
    scale = sparse.diags(np.where(dofs[:, 1] > 2, files.unit, 1.0) * np.sqrt(files.mass_unit))
    K, M = (sparse.csr_matrix(scale @ A[alive][:, alive] @ scale) for A in (matrices.K, matrices.M))
    nodes = np.where(dofs[:, 1] == GENERALISED, 0, np.searchsorted(rows, dofs[:, 0]))
    return SystemMatrices(nodes, dofs[:, 1], model.labels[rows], upper_triangle(K), upper_triangle(M)), rows, blocks


def _refuse_eliminated(files: MatrixFiles, model: Deck, dofs: np.ndarray, blocks: list[Block]) -> None:
    """Raise an InputError if rows of nodes that a coupling or equation expresses by others are missing."""
    used = [np.unique(block.nodes) for block in blocks] or [np.empty(0, int)]
    nodes = np.intersect1d(model.rows(model.dependent, files.model), np.concatenate(used))
    rows = np.bincount(dofs[dofs[:, 1] < DIRECTIONS, 0], minlength=len(model.labels))
    if (gone := nodes[rows[nodes] < DIRECTIONS]).size:
        raise InputError(
            f"{files.stiffness}: has no row of {len(gone)} nodes that a coupling or equation of {files.model} expresses"
            f" by others, such as node {model.labels[gone[0]]}; allowed: matrices written without couplings, which an"
            " interface of kind 'tie' makes"
        )


def _surfaces(
    files: MatrixFiles,
    model: Deck,
    body: tuple[np.ndarray, np.ndarray],
    new_row: np.ndarray,
    blocks: list[Block],
    cell: Cell,
) -> dict[str, Surface]:
    """Return the named sets as curved facets of tet10, or as nodes with areas and normals.

    Args:
        body: Its nodes [m], (n, 3), and a point that its outward normals point away from [m], (3,).
    """
    points = body[0]
    facets, surfaces = boundary(blocks), {}
    shapes = files.surfaces
    sets = {} if blocks else _nodes_by_name(model.labels[new_row >= 0], new_row[new_row >= 0])
    sets |= {name: new_row[model.rows(labels, files.model)] for name, labels in model.node_sets.items()}
    for name, nodes in (sets | {name: np.empty(0, int) for name in model.side_sets}).items():
        if name in model.side_sets:
            sides = model.side_sets[name] @ [10, 1]
            chosen = [some.nodes[np.isin(some.owners @ [10, 1], sides)] for some in facets]
            nodes = np.unique(np.concatenate([np.empty(0, int), *(some.ravel() for some in chosen)]))
        else:
            nodes = np.unique(nodes[nodes >= 0])
            chosen = [some.nodes[np.isin(some.nodes, nodes).all(axis=1)] for some in facets]
        if len(nodes):
            surfaces[name] = _surface(body, nodes, chosen, cell, shapes.get(name, {}))
    if missing := shapes.keys() - surfaces.keys():
        have = ", ".join(sorted(surfaces)) or "none"
        raise InputError(f"{files.model}: has no set '{min(missing)}', of which geometry.surfaces states the shape;"
                         f" it has {have}")  # fmt: skip
    for name, shape in shapes.items():
        _check_shape(files, name, points[np.unique(surfaces[name].facets)], shape)
    return surfaces


def _nodes_by_name(labels: np.ndarray, rows: np.ndarray) -> dict[str, np.ndarray]:
    """Return the sets of nodes without elements, as superelements have: all of them, and each where they are few."""
    each = {f"node_{label}": rows[k : k + 1] for k, label in enumerate(labels.tolist())}
    return {BOUNDARY: rows, **(each if len(rows) <= MOST_NAMED else {})}


def _surface(
    body: tuple[np.ndarray, np.ndarray], nodes: np.ndarray, facets: list[np.ndarray], cell: Cell, shape: SurfaceRule
) -> Surface:
    points, _ = body
    if cell is TETRA10 and sum(map(len, facets)):
        triangles = np.concatenate(facets)
        a, b, c = np.moveaxis(points[triangles[:, :3]], 1, 0)
        normals = np.cross(b - a, c - a)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        fitted = fit_shape(points[triangles].reshape(-1, 3), np.repeat(normals, triangles.shape[1], axis=0)).shape
        return Surface(triangles, shape or fitted)
    areas, vectors = nodal_areas(points, facets)
    sizes = np.linalg.norm(vectors[nodes], axis=1)
    bearing = (areas[nodes] > ZERO_AREA * areas[nodes].max(initial=0.0)) & (sizes > 0)
    if not bearing.any():
        return _loose(*body, nodes, shape)
    normals = np.zeros((len(nodes), 3))
    normals[bearing] = vectors[nodes][bearing] / sizes[bearing, None]
    shape = shape or fit_shape(points[nodes[bearing]], normals[bearing]).shape
    return Surface(nodes[:, None], shape, np.where(bearing, areas[nodes], 0.0), normals)


def _check_shape(files: MatrixFiles, name: str, nodes: np.ndarray, shape: SurfaceRule) -> None:
    off, size = float(distance(nodes, shape).max()), shape.get("radius", float(np.ptp(nodes, axis=0).max()))
    if off > OFF_SHAPE * size:
        raise InputError(
            f"{files.model}: set '{name}' lies up to {off:.3g} m off its {shape['kind']}, allowed:"
            f" {OFF_SHAPE * size:.3g} m; check geometry.unit and the shape, which is in metres"
        )


def _loose(points: np.ndarray, middle: np.ndarray, nodes: np.ndarray, shape: SurfaceRule) -> Surface:
    """Return a set of nodes that bounds no element: equal shares of the area that it spans, of 1 m² if it spans none.

    Normals point away from the middle of the body: those of its plane, or of the shape that is declared. They are
    unknown where a plane contains the middle, or all nodes are on a cylinder.
    """
    positions = points[nodes]
    centred = positions - positions.mean(axis=0)
    _, spread, axes = np.linalg.svd(np.concatenate([centred, np.zeros((3, 3))]), full_matrices=False)
    flat = spread[2] <= 1e-6 * spread[1]
    normals, area = None, 1.0
    if len(nodes) > 2 and spread[1] > 1e-6 * spread[0]:
        try:
            area = float(ConvexHull(centred @ axes[:2].T).volume)
        except QhullError:
            area = 1.0
        if flat and not shape:
            normals = _away(positions, middle, axes[2])
    if shape.get("kind") == "plane":
        normals = _away(positions, middle, np.asarray(shape["normal"], float))
    elif shape and abs(float(np.mean(cylindrical(points, shape)[0])) / shape["radius"] - 1) > OFF_SHAPE:
        outside = float(np.mean(cylindrical(points, shape)[0])) > shape["radius"]
        away = positions - np.asarray(shape["origin"])
        normals = true_surface(positions, -away if outside else away, shape)[1]
    return Surface(nodes[:, None], shape, np.full(len(nodes), area / len(nodes)), normals)


def _away(positions: np.ndarray, middle: np.ndarray, normal: np.ndarray) -> np.ndarray | None:
    """Return the normals of a plane (k, 3) on the side away from a point; None where it contains the point."""
    height = float((positions.mean(axis=0) - middle) @ normal)
    if abs(height) <= OFF_SHAPE * float(np.linalg.norm(normal)) * float(np.abs(positions - middle).max()):
        return None
    return np.broadcast_to(np.sign(height) * normal / np.linalg.norm(normal), positions.shape).copy()


def upper_triangle(A: sparse.csr_matrix) -> Triangle:
    """Return the upper triangle of a symmetric matrix, without zeros."""
    upper = sparse.triu(A).tocoo()
    nonzero = upper.data != 0
    return Triangle(upper.row[nonzero].astype(np.int64), upper.col[nonzero].astype(np.int64), upper.data[nonzero])
