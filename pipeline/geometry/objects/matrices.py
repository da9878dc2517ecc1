"""Stiffness and mass that Python gives, dense or sparse, as the files of a body of matrices."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import write_text
from gudgeon.pipeline.geometry.decks.model import Deck
from gudgeon.pipeline.geometry.matrices.model import checked_symmetric
from gudgeon.pipeline.geometry.objects.mesh import deck_of_object, digest, is_mesh

DIRECTIONS = (3, 6)
"""Degrees of freedom of a node."""
ABAQUS = {"tetra": "C3D4", "tetra10": "C3D10", "hexahedron": "C3D8", "hexahedron20": "C3D20", "wedge": "C3D6",
          "wedge15": "C3D15"}  # fmt: skip
"""Names of the elements of a deck; what they are integrated by is in the matrices."""


class Body(NamedTuple):
    """Matrices with the nodes of their rows: three or six directions of each node, node by node."""

    K: sparse.csr_matrix
    """Stiffness [N/m], (N, N)."""
    M: sparse.csr_matrix
    """Mass [kg], (N, N)."""
    points: np.ndarray
    """Nodes [m], (n, 3)."""
    elements: Mapping[str, np.ndarray]
    """Rows of the nodes of solid elements by type, (e, a)."""
    sets: Mapping[str, np.ndarray]
    """Rows of nodes by name."""


def body_of(stiffness: Any, mass: Any, nodes: Any, sets: Mapping[str, Any], key: str) -> Body:
    """Return matrices and nodes of Python as a body.

    Args:
        stiffness, mass: Arrays or sparse matrices, (N, N), N = 3 n or 6 n.
        nodes: Nodal positions [m], (n, 3), a mesh, or the basis of scikit-fem that the matrices were assembled on.
        sets: Rows of nodes, or a mask of them, by name.
        key: Of the geometry, for messages.

    Raises:
        InputError: the matrices are not square, symmetric and finite, of unlike shapes, or do not fit the nodes.
    """
    K, M = (_matrix(A, f"{key}.{name}") for name, A in (("stiffness", stiffness), ("mass", mass)))
    if K.shape != M.shape:
        raise InputError(f"{key}.mass: has the shape {M.shape}, the stiffness {K.shape}; allowed: one shape for both")
    if hasattr(nodes, "nodal_dofs"):
        K, M, points, members = _of_basis(K, M, nodes, key)
        elements: dict[str, np.ndarray] = {}
    elif is_mesh(nodes):
        points, elements, members = _of_deck(deck_of_object(nodes, f"{key}.model"), key)
    else:
        points, elements, members = _positions(nodes, key), {}, {}
    if K.shape[0] not in [d * len(points) for d in DIRECTIONS]:
        raise InputError(
            f"{key}.stiffness: has {K.shape[0]} rows; allowed: {3 * len(points)} or {6 * len(points)}, three or six"
            f" directions of each of the {len(points)} nodes"
        )
    rows = {name: _rows(chosen, len(points), f"{key}: set '{name}'") for name, chosen in sets.items()}
    return Body(K, M, points, elements, {**members, **rows})


def _matrix(A: Any, key: str) -> sparse.csr_matrix:
    array = A if sparse.issparse(A) else np.atleast_2d(np.asarray(A))
    if array.dtype.kind not in "fiu" or array.ndim != 2:
        raise InputError(f"{key}: a {type(A).__name__} of {array.dtype} given; allowed: a real matrix, dense or sparse")
    A = sparse.csr_matrix(array, dtype=float)
    if A.shape[0] != A.shape[1] or not A.shape[0]:
        raise InputError(f"{key}: has the shape {A.shape}; allowed: a square matrix")
    return checked_symmetric(A, key)


def _positions(nodes: Any, key: str) -> np.ndarray:
    try:
        points = np.asarray(nodes, float)
    except (TypeError, ValueError):
        points = np.empty((0, 0))
    if points.ndim != 2 or points.shape[1] != 3 or not len(points) or not np.isfinite(points).all():
        raise InputError(
            f"{key}.model: a {type(nodes).__name__} of shape {points.shape} given; allowed: positions of nodes [m],"
            " (n, 3), all finite, a mesh, or a basis of scikit-fem"
        )
    return points


def _rows(chosen: Any, count: int, source: str) -> np.ndarray:
    rows = np.asarray(chosen)
    rows = np.flatnonzero(rows) if rows.dtype == bool and rows.shape == (count,) else rows
    if rows.dtype.kind not in "iu" or rows.ndim != 1 or not len(rows) or rows.min() < 0 or rows.max() >= count:
        raise InputError(
            f"{source}: {str(chosen)[:60]} given; allowed: rows of nodes, whole numbers from 0 to {count - 1}"
        )
    return np.unique(rows)


def _of_basis(
    K: sparse.csr_matrix, M: sparse.csr_matrix, basis: Any, key: str
) -> tuple[sparse.csr_matrix, sparse.csr_matrix, np.ndarray, dict[str, np.ndarray]]:
    """Return the matrices of a vector basis of nodal elements in the order of nodes, its nodes and named boundaries."""
    groups = [np.asarray(g) for g in (basis.nodal_dofs, basis.edge_dofs, basis.facet_dofs, basis.interior_dofs)]
    groups = [group.T for group in groups if group.size]
    if {group.shape[1] for group in groups} != {3} or basis.doflocs.shape[0] != 3:
        raise InputError(f"{key}.model: a basis of other than one node a vertex, edge, face or cell, or not in space;"
                         " allowed: an ElementVector of Lagrange elements on a mesh in space")  # fmt: skip
    dofs = np.concatenate(groups)
    if dofs.size != K.shape[0]:
        raise InputError(f"{key}.stiffness: has {K.shape[0]} rows, the basis has {dofs.size} degrees of freedom")
    order, node = dofs.ravel(), np.empty(dofs.size, int)
    node[order] = np.repeat(np.arange(len(dofs)), 3)
    sets = {name: np.unique(node[basis.get_dofs(name).all()]) for name in basis.mesh.boundaries or {}}
    K, M = (sparse.csr_matrix(A[order][:, order]) for A in (K, M))
    return K, M, basis.doflocs[:, dofs[:, 0]].T, sets


def _of_deck(deck: Deck, key: str) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return nodes, solid elements and named sets of nodes of a mesh; sets of facets have their mid-edge nodes, too."""
    solids = [block for block in deck.blocks if block.cell.dimension == 3]
    if wrong := [block.cell.name for block in solids if block.cell.name not in ABAQUS]:
        raise InputError(f"{key}.model: has elements of type {wrong[0]}; allowed: {', '.join(ABAQUS)}")
    elements = {block.cell.name: np.searchsorted(deck.labels, block.nodes) for block in solids}
    sets = {name: np.searchsorted(deck.labels, labels) for name, labels in deck.node_sets.items()}
    for name, labels in deck.element_sets.items():
        facets = [b.nodes[np.isin(b.labels, labels)].ravel() for b in deck.blocks if b.cell.dimension == 2]
        if sum(map(len, facets)):
            chosen = np.isin(deck.labels, np.concatenate(facets))
            for block in (block for block in solids if block.cell.quadratic):
                rows, ends = elements[block.cell.name], block.cell.shape.edges
                middles = rows[:, block.cell.shape.corners :][:, : len(ends)]
                chosen[middles[chosen[rows[:, ends]].all(axis=2)]] = True
            sets[name] = np.flatnonzero(chosen)
    return deck.points, elements, sets


def write_body(body: Body, folder: Path) -> dict[str, str]:
    """Write the files of a body, under names by their content, and return them by the keys of a geometry."""
    files = {"stiffness": _write_matrix(body.K, folder, "stiffness"), "mass": _write_matrix(body.M, folder, "mass")}
    arrays = [body.points, *body.elements.values(), *body.sets.values()]
    path = folder / f"nodes-{digest(arrays, body.elements, body.sets)}.inp"
    if not path.is_file():
        lines = ["*NODE", *(f"{k}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(body.points.tolist(), 1))]
        start = 1
        for name, rows in body.elements.items():
            lines.append(f"*ELEMENT, TYPE={ABAQUS[name]}")
            lines += [",\n".join(_wrapped([k, *(row + 1)])) for k, row in enumerate(rows, start)]
            start += len(rows)
        for name, rows in body.sets.items():
            lines += [f"*NSET, NSET={name}", *_wrapped(rows + 1)]
        write_text(path, "\n".join(lines) + "\n")
    return {key: str(file) for key, file in (files | {"model": path}).items()}


def _wrapped(numbers: Any) -> list[str]:
    """Return numbers in lines of at most 16, as decks have them."""
    texts = [str(int(label)) for label in numbers]
    return [", ".join(texts[k : k + 16]) for k in range(0, len(texts), 16)]


def _write_matrix(A: sparse.csr_matrix, folder: Path, name: str) -> Path:
    """Write the lower triangle of a symmetric matrix with its whole diagonal, which tells its size."""
    lower = sparse.tril(A, -1).tocoo()
    diagonal = np.arange(A.shape[0])
    rows, columns = np.concatenate([diagonal, lower.row]), np.concatenate([diagonal, lower.col])
    values = np.concatenate([A.diagonal(), lower.data])
    path = folder / f"{name}-{digest([rows, columns, values])}.mtx"
    if not path.is_file():
        entries = zip((rows + 1).tolist(), (columns + 1).tolist(), values.tolist(), strict=True)
        write_text(path, "".join(f"{i} {j} {value!r}\n" for i, j, value in entries))
    return path
