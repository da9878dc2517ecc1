"""Checks of a mesh: one connected piece, elements of positive volume."""

from collections.abc import Sequence

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import cell_of

FLAT = 1e-9
"""Least Jacobian of an element by its extent cubed, in a plane squared; slivers of aspect 1:1000 are at 1e-6."""


def refuse_pieces(mesh: MeshRecord, key: str, tied: Sequence[np.ndarray] = (), *, remedy: str = "") -> None:
    """Refuse a mesh of several pieces: each would have its own rigid motions; `key` is its file or component's key.

    Args:
        tied: Nodes that move as one rigid body, which joins their pieces, (k,) each.
        remedy: What else is allowed, the end of a message.

    Raises:
        InputError: a node has no position or no element, or the elements fall into pieces that share no node.
    """
    cells, count = mesh.cells, len(mesh.nodes)
    finite = np.isfinite(mesh.nodes).all(axis=1)
    if not finite.all():
        raise InputError(f"{key}: node {int(np.argmin(finite))} of the mesh has no finite position")
    pieces, piece_of = pieces_of(mesh, [*tied, *_links(mesh)])
    if pieces == 1:
        return
    used = np.zeros(count, bool)
    used[cells] = True
    if not used.all():
        raise InputError(
            f"{key}: {int((~used).sum())} of {count} nodes of the mesh belong to no element, the first is number"
            f" {int(np.argmin(used))} (from 0)"
        )
    sizes = np.bincount(piece_of[cells[:, 0]], minlength=pieces)
    smallest = int(sizes.argmin())
    on = [name for name, s in sorted(mesh.surfaces.items()) if (piece_of[s.facets] == smallest).any()]
    centre = mesh.nodes[piece_of == smallest].mean(axis=0)
    surfaces = f"surface {', '.join(on)}" if on else "no named surface"
    raise InputError(
        f"{key}: the mesh falls into {pieces} pieces that share no node; the smallest, {sizes[smallest]} of"
        f" {len(cells)} elements about {_text(centre)}, has {surfaces}; allowed: one solid{remedy}"
        + (", or a frame whose pieces an interface of tie 'rbe2' joins" if cell_of(mesh).spatial else "")
    )


def pieces_of(mesh: MeshRecord, links: Sequence[np.ndarray] = ()) -> tuple[int, np.ndarray]:
    """Return the number of pieces that share no node, and that of each node, (n,).

    Args:
        links: Nodes that belong to one piece, (k,) each.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    cells, count = mesh.cells, len(mesh.nodes)
    first_nodes = np.repeat(cells[:, 0], cells.shape[1])
    starts = np.concatenate([first_nodes, *(np.repeat(nodes[:1], len(nodes)) for nodes in links)])
    ends = np.concatenate([cells.ravel(), *links])
    pairs = coo_matrix((np.ones(starts.size, bool), (starts, ends)), shape=(count, count))
    return connected_components(pairs, directed=False)


def _links(mesh: MeshRecord) -> list[np.ndarray]:
    """Return the nodes that a rigid element, a spring or a constraint of a mesh's file joins, (k,) each."""
    links = [a.nodes for a in mesh.attachments.values() if a.kind == "rbe2"]
    for record in mesh.relations.values():
        links += np.split(record.nodes, np.searchsorted(record.rows, np.arange(1, len(record.stiffness))))
    return links


def refuse_degenerate(x: np.ndarray, det: np.ndarray, numbers: np.ndarray) -> None:
    """Refuse elements without volume, or without area in a plane, and inverted ones.

    Args:
        x: Nodes of the elements [m], (e, a, 3) or (e, a, 2).
        det: det(∂x/∂ξ) at their quadrature points, (e, q).
        numbers: Of the elements in their mesh, (e,), for messages.

    Raises:
        InputError: there is one; its number, position and Jacobian.
    """
    relative = det.min(axis=1) / np.ptp(x, axis=1).max(axis=1) ** x.shape[2]
    sound = relative > FLAT
    if sound.all():
        return
    worst = int(np.argmin(relative))
    size, power = ("volume", "cubed") if x.shape[2] == 3 else ("area", "squared")
    fault = "is inverted" if relative[worst] < -FLAT else f"has no {size}"
    raise InputError(
        f"mesh: element {numbers[worst]} {fault}, about {_text(x[worst].mean(axis=0))}; its least Jacobian is"
        f" {relative[worst]:.2g} of its extent {power}, allowed: above {FLAT:g}"
    )


def _text(position: np.ndarray) -> str:
    """Return a position [m] as text."""
    return f"({', '.join(f'{value:.4g}' for value in position)}) m"
