"""Tied surfaces of a deck as constraints of its mesh: a node of the slave moves with the nearest point of the master.

u_s = Σ N_a(ξ) u_a, N the shape functions of the master's facet and ξ where the node's distance from it is least. A node
that lies off the master is moved onto it, so that the constraints leave all rigid motions free.
"""

from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np
from scipy.spatial import cKDTree

from gudgeon.modaldb.records.mesh import Relation
from gudgeon.pipeline.geometry.cells import FACETS, TRIANGLE, Cell, blocks_of
from gudgeon.pipeline.geometry.decks.members.related import relation
from gudgeon.pipeline.geometry.decks.members.units import refused
from gudgeon.pipeline.geometry.decks.model import Deck, TiedSurfaces

TOLERANCE = 0.05
"""Distance within which nodes are tied, over the size of the master's facets, as in Abaqus."""
CANDIDATES = 12
"""Facets among which the nearest one is sought, by their middles."""
STEPS = 20
"""Of Gauss and Newton's method; straight facets take one."""
ROUND_OFF = 1e-9
"""Shares of a node that are zero, and distances over the size of facets that are not told."""
CORNERS = {3: [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], 4: [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]}
"""Of the reference triangle and quadrilateral."""
SPANS = {3: "00 10 01", 4: "00 10 01 11", 6: "00 10 01 20 11 02", 8: "00 10 01 20 11 02 21 12",
         9: "00 10 01 20 11 02 21 12 22"}  # fmt: skip
"""Exponents of ξ and η in the shape functions of facets by their number of nodes."""


def tied_relations(
    deck: Deck, leave_out: Sequence[str], nodes: np.ndarray, surfaces: Mapping[str, np.ndarray],
    sets: Mapping[str, np.ndarray], unit: float,
) -> tuple[dict[str, Relation], list[str]]:  # fmt: skip
    """Return the constraints of a deck's ties by names such as `tie_SEAM`, and a line for each.

    Args:
        deck: What the file says.
        leave_out: Keywords that are left out on purpose.
        nodes: Positions [m], (n, 3); those of slaves are moved onto their masters.
        surfaces: Boundary facets of each name, (f, s).
        sets: Nodes of the mesh of each named set of nodes, (k,).
        unit: Metres per unit of length of the file.

    Raises:
        InputError: a surface is not on the boundary, or no node of the slave lies near the master.
    """
    folded = {name.casefold() for name in leave_out}
    records: dict[str, Relation] = {}
    notes: list[str] = []
    for tie in deck.ties:
        if tie.keyword.casefold() in folded:
            continue
        slave = _slave_nodes(tie, surfaces, sets)
        master = {name.casefold(): facets for name, facets in surfaces.items()}.get(tie.master.casefold())
        if master is None:
            raise refused(tie, f"'{tie.master}' has no face on the boundary, allowed: a surface of the solid")
        terms, distances, note = _tied(tie, nodes, np.setdiff1d(slave, master), master, unit)
        nodes[list(distances)] = list(distances.values())
        name = f"tie_{tie.name}"
        records[name if name not in records else f"{name}_{len(records)}"] = relation(
            "constraint", terms, np.zeros(len(terms))
        )
        notes.append(note)
    return records, notes


def _slave_nodes(
    tie: TiedSurfaces, surfaces: Mapping[str, np.ndarray], sets: Mapping[str, np.ndarray]
) -> np.ndarray:  # fmt: skip
    """Return the nodes of a tie's slave, (k,)."""
    name = tie.slave.casefold()
    named = [members.ravel() for group in (surfaces, sets) for key, members in group.items() if key.casefold() == name]
    if not named:
        raise refused(tie, f"'{tie.slave}' has no node on the boundary, allowed: a surface of the solid")
    return np.unique(np.concatenate(named))


def _tied(
    tie: TiedSurfaces, nodes: np.ndarray, slave: np.ndarray, facets: np.ndarray, unit: float
) -> tuple[list[np.ndarray], dict[int, np.ndarray], str]:
    """Return the terms of each sum (t, 3), where tied nodes have to be, and the line that says how many there are."""
    corners = nodes[facets[:, :3]]
    size = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())
    tolerance = TOLERANCE * size if tie.tolerance is None else unit * tie.tolerance
    points, shares = nearest_points(nodes, facets, nodes[slave])
    distances = np.linalg.norm(points - nodes[slave], axis=1)
    tied_rows = np.flatnonzero(distances <= max(tolerance, ROUND_OFF * size))
    if not len(tied_rows):
        raise refused(tie, f"no node of '{tie.slave}' lies within {tolerance:.3g} m of '{tie.master}', the nearest is"
                           f" {distances.min(initial=np.inf):.3g} m away")  # fmt: skip
    if not tie.moved and distances[tied_rows].max() > ROUND_OFF * size:
        raise refused(tie, f"ADJUST=NO, and nodes lie up to {distances[tied_rows].max():.3g} m off '{tie.master}';"
                           " allowed: nodes on it, or ADJUST=YES, which moves them")  # fmt: skip
    terms = []
    for row in tied_rows.tolist():
        masters, weights = shares[row]
        for direction in range(3):
            slave_term = [(float(slave[row]), direction, 1.0)]
            others = zip(masters.tolist(), weights.tolist(), strict=True)
            terms.append(np.array([*slave_term, *((node, direction, -weight) for node, weight in others)]))
    off = distances[tied_rows].max()
    moved = f", moved onto it by up to {off:.3g} m" if off > ROUND_OFF * size else ""
    count = len(slave) - len(tied_rows)
    loose = f"; {count} others lie farther off than {tolerance:.3g} m" if count else ""
    note = f"{len(tied_rows)} nodes of '{tie.slave}' are tied to '{tie.master}'{moved}{loose}"
    return terms, {int(slave[row]): points[row] for row in tied_rows.tolist()}, note


def nearest_points(
    nodes: np.ndarray, facets: np.ndarray, targets: np.ndarray
) -> tuple[np.ndarray, list[tuple[np.ndarray, np.ndarray]]]:
    """Return the nearest point of a surface to each target, (k, 3), with the nodes there and their shares.

    Args:
        nodes: Positions [m], (n, 3).
        facets: Nodes of the surface's facets, (f, s).
        targets: Positions [m], (k, 3).
    """
    middles = np.empty((len(facets), 3))
    blocks = blocks_of(facets, FACETS)
    for block in blocks:
        middles[block.rows] = nodes[block.nodes[:, : block.cell.shape.corners]].mean(axis=1)
    count = min(CANDIDATES, len(facets))
    candidates = cKDTree(middles).query(targets, k=count)[1].reshape(len(targets), count)
    shortest, points = np.full(len(targets), np.inf), np.empty((len(targets), 3))
    shares = [(np.empty(0, np.int64), np.empty(0))] * len(targets)
    for block in blocks:
        local = np.full(len(facets), -1)
        local[block.rows] = np.arange(len(block.rows))
        targets_of, ranks = np.nonzero(local[candidates] >= 0)
        chosen = block.nodes[local[candidates[targets_of, ranks]]]
        N, positions = _projected(block.cell, nodes[chosen], targets[targets_of])
        distances = np.linalg.norm(positions - targets[targets_of], axis=1)
        for k, target in enumerate(targets_of.tolist()):
            if distances[k] < shortest[target]:
                shortest[target], points[target] = distances[k], positions[k]
                used = np.abs(N[k]) > ROUND_OFF
                shares[target] = chosen[k, used], N[k, used]
    return points, shares


def _projected(cell: Cell, x: np.ndarray, targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return shape functions (k, a) and position (k, 3) of the nearest point of each facet (k, a, 3) to its target."""
    triangle = cell.shape is TRIANGLE
    X = np.full((len(x), 2), 1 / 3 if triangle else 0.0)
    for _ in range(STEPS):
        N, dN = _shape_functions(cell, X)
        tangents = np.einsum("kai,kaj->kij", x, dN)
        gap = targets - np.einsum("ka,kai->ki", N, x)
        gram = np.einsum("kij,kil->kjl", tangents, tangents)
        step = np.linalg.solve(gram, np.einsum("kij,ki->kj", tangents, gap)[..., None])[..., 0]
        X = X + step
        if triangle:
            X = np.clip(X, 0.0, None)
            X = X / np.maximum(X.sum(axis=1, keepdims=True), 1.0)
        else:
            X = np.clip(X, -1.0, 1.0)
    N = _shape_functions(cell, X)[0]
    return N, np.einsum("ka,kai->ki", N, x)


def _shape_functions(cell: Cell, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return N (k, a) and ∂N/∂ξ (k, a, 2) of a facet at ξ (k, 2)."""
    inverse, powers = _nodal_basis(cell)
    i, j = powers.T
    ξ, η = X[:, :1], X[:, 1:]
    monomials = ξ**i * η**j
    dξ = i * ξ ** np.maximum(i - 1, 0) * η**j
    dη = j * ξ**i * η ** np.maximum(j - 1, 0)
    return monomials @ inverse, np.stack([dξ @ inverse, dη @ inverse], axis=2)


@cache
def _nodal_basis(cell: Cell) -> tuple[np.ndarray, np.ndarray]:
    """Return the coefficients of a facet's shape functions, a column each, and the exponents of its monomials."""
    corners = np.array(CORNERS[cell.shape.corners])
    positions = [*corners, *(corners[around].mean(axis=0) for around in cell.centres)]
    ξ, η = np.array(positions).T
    powers = np.array([[int(a), int(b)] for a, b in SPANS[cell.nodes].split()])
    i, j = powers.T
    return np.linalg.inv(ξ[:, None] ** i * η[:, None] ** j), powers
