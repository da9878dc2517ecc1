"""The solid of a deck: cells right way round, with all mid-edge nodes; what is folded is refused by its number."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import GMSH_ORDER, HEXAHEDRON20, TETRA10, Cell, mirrored, sides_of
from gudgeon.pipeline.geometry.cells import Block as Rows
from gudgeon.pipeline.geometry.decks.model import IN_FULL, MISSING, Block, Deck

FLAT = 1e-9
"""Least Jacobian at a corner by the longest edge cubed; slivers of aspect 1:1000 are at 1e-6."""
MID_REACH = 0.35
"""How far a mid-edge node may lie from the middle of its chord, by the chord: an arc of 120° is at 0.29."""
FORMULATIONS = {"C3D8I": "incompatible"} | dict.fromkeys(
    ("C3D20R", "SOLID186", "SOLID95", "CHEXA, IN = TWO"), "reduced"
)
"""Of the record, by the name of an element; reduced integration is that of its hexahedra."""
PLAIN = {
    **dict.fromkeys(("C3D8R", "C3D8RT", "C3D20RI"), "reduced integration"),
    "CHEXA, ISOP = REDUCED": "reduced shear or bubble functions",
    **dict.fromkeys(("C3D4H", "C3D8H", "C3D10H", "C3D20H", "C3D15H", "C3D6H"), "a hybrid formulation"),
    "C3D10M": "a modified formulation", "C3D10I": "improved stress", "SOLID45": "extra shapes",
    "SOLID185": "B-bar or enhanced strain",
}  # fmt: skip
"""What other programs do with elements that are computed in full here."""
DROPPING = ("SOLID186", IN_FULL, "SOLID187", "SOLID95", "SOLID92")
"""Quadratic elements that may be written without any mid-edge node."""
COMPLETE = ("hexahedron27", "wedge18", "pyramid14")
"""Cells with nodes in the centres of quadrilateral faces."""


@dataclass(frozen=True)
class Solid:
    """Solid cells of a deck, on its nodes."""

    points: np.ndarray
    """Of the deck, then those that were added in the middle of edges, (n, 3)."""
    deck_count: int
    """Number of those of the deck."""
    blocks: tuple[Rows, ...]
    """Cells by type, with places of nodes."""
    formulations: dict[str, np.ndarray]
    """Cells that are not integrated in full, as of `MeshRecord`."""
    notes: tuple[str, ...]


def solid_of(deck: Deck, points: np.ndarray, path: str) -> Solid:
    """Return the solid of a deck whose nodes are at `points` [m], (n, 3).

    Raises:
        InputError: there is none, its cells do not fit each other, or one has no volume, is folded or twisted.
    """
    solids = [block for block in deck.blocks if block.cell.dimension == 3]
    if not solids:
        have = ", ".join(sorted({block.cell.name for block in deck.blocks})) or "no cells"
        matrices = "" if deck.blocks else '; superelements are of kind "matrices"'
        raise InputError(
            f"{path}: the mesh has no solid cells, it has {have}; allowed: solids of {_allowed()}{matrices}"
        )
    raised = _raised_notes(solids)
    solids = _by_cell(_one_order(solids, path))
    full, points = _with_middles(deck, solids, points)
    blocks: list[Rows] = []
    notes = list(raised)
    formulations: dict[str, list[np.ndarray]] = {}
    start, inside_out = 0, 0
    for block, nodes in zip(solids, full, strict=True):
        nodes = _arranged(block, nodes, points, path)
        nodes, turned = righted(block.cell, nodes, points)
        inside_out += turned
        _refuse_folded(block, nodes, points, path)
        nodes = nodes[_once(nodes, [b.nodes for b in blocks if b.cell is block.cell], block.cell.shape.corners)]
        rows = np.arange(start, start + len(nodes))
        start += len(nodes)
        notes += _formulated(block, rows, formulations)
        blocks.append(Rows(block.cell, rows, nodes))
    if inside_out:
        notes.append(righted_note(inside_out, start))
    joined = {name: np.concatenate(rows) for name, rows in formulations.items()}
    merged = _merged(blocks)
    notes += _single_in_full(merged, joined)
    return Solid(points, len(deck.labels), tuple(merged), joined, tuple(notes))


def _single_in_full(blocks: Sequence[Rows], formulations: dict[str, np.ndarray]) -> list[str]:
    """Take cells without a neighbour out of those of reduced integration, in place; return a line where there are such.

    2 × 2 × 2 points do not see six motions of a hexahedron alone.
    """
    if "reduced" not in formulations:
        return []
    owners, _, shared = sides_of(blocks)
    single = np.setdiff1d(formulations["reduced"], owners[shared > 1])
    if not len(single):
        return []
    formulations["reduced"] = np.setdiff1d(formulations["reduced"], single)
    if not len(formulations["reduced"]):
        del formulations["reduced"]
    return [f"{len(single)} hexahedra of reduced integration share no face with another cell: computed in full"]


def _formulated(block: Block, rows: np.ndarray, formulations: dict[str, list[np.ndarray]]) -> list[str]:
    """Add the cells of a block, `rows`, to those of its formulation; return a line where it is not that of its file."""
    name = FORMULATIONS.get(block.kind)
    if name is not None and (name != "reduced" or block.cell is HEXAHEDRON20):
        formulations.setdefault(name, []).append(rows)
    if block.kind not in PLAIN or block.cell.name == "tetra":
        return []
    return [f"{block.kind}: elements are computed in full, without {PLAIN[block.kind]}"]


def _once(nodes: np.ndarray, before: Sequence[np.ndarray], corners: int) -> np.ndarray:
    """Return the cells (e, a) that are not given twice and not among those `before`, by their corners, ascending."""
    every = np.sort(np.concatenate([*before, nodes])[:, :corners], axis=1)
    indices = np.unique(every, axis=0, return_index=True)[1] - (len(every) - len(nodes))
    return np.sort(indices[indices >= 0])


def _by_cell(solids: Sequence[Block]) -> list[Block]:
    """Return blocks with those of one cell side by side."""
    cells = list(dict.fromkeys(block.cell.name for block in solids))
    return sorted(solids, key=lambda block: cells.index(block.cell.name))


def _merged(blocks: Sequence[Rows]) -> list[Rows]:
    """Return blocks of which those of one cell, side by side, are one."""
    merged: list[Rows] = []
    for block in blocks:
        if merged and merged[-1].cell is block.cell:
            both = merged.pop(), block
            rows, nodes = (np.concatenate(arrays) for arrays in zip(*((b.rows, b.nodes) for b in both), strict=True))
            block = Rows(block.cell, rows, nodes)
        merged.append(block)
    return merged


def _allowed() -> str:
    return "tetrahedra, hexahedra, wedges and pyramids, linear or quadratic"


def _one_order(solids: Sequence[Block], path: str) -> list[Block]:
    """Return blocks whose faces fit each other: linear ones of elements that drop mid-edge nodes become quadratic."""
    quadratic = [block.cell for block in solids if block.cell.quadratic]
    if not quadratic:
        return list(solids)
    centred = [cell.name in COMPLETE for cell in quadratic if cell is not TETRA10]
    if any(centred) and not all(centred):
        names = ", ".join(sorted({cell.name for cell in quadratic}))
        raise InputError(f"{path}: the mesh has {names}, whose faces do not fit; allowed: all with nodes in the centres"
                         " of their faces, or none")  # fmt: skip
    return [block if block.cell.quadratic else _raised(block, quadratic) for block in solids]


def _raised_notes(solids: Sequence[Block]) -> list[str]:
    """Return a line for linear cells among quadratic ones, which become such, but for elements that drop nodes."""
    raised = [block for block in solids if not block.cell.quadratic and block.kind not in DROPPING]
    if len(raised) == len(solids):
        return []
    return [f"{len(block.labels)} linear elements ({block.cell.name}) among quadratic ones are computed as quadratic,"
            " with nodes in the middle of their edges" for block in raised]  # fmt: skip


def _raised(block: Block, quadratic: Sequence[Cell]) -> Block:
    """Return linear cells among quadratic ones as such, their mid-edge nodes left out."""
    cell = next(cell for cell in [*quadratic, *_serendipity()] if cell.shape is block.cell.shape)
    nodes = np.pad(block.nodes, ((0, 0), (0, cell.nodes - block.nodes.shape[1])), constant_values=MISSING)
    return block._replace(cell=cell, nodes=nodes)


@cache
def _serendipity() -> list[Cell]:
    from gudgeon.pipeline.geometry.cells import CELLS

    return [cell for cell in CELLS.values() if cell.dimension == 3 and cell.quadratic and cell.name not in COMPLETE]


def _with_middles(deck: Deck, solids: Sequence[Block], points: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
    """Return places of nodes of each block, and the points with new ones where a mid-edge node is left out.

    An edge of two elements has one node, although only one of them may name it.
    """
    node_rows = [_places(deck, block.nodes) for block in solids]
    if not any((rows < 0).any() for rows in node_rows):
        return node_rows, points
    middles: dict[tuple[int, int], int] = {}
    for block, rows in zip(solids, node_rows, strict=True):
        corners = block.cell.shape.corners
        for k, (a, b) in enumerate(block.cell.shape.edges.tolist()):
            column = corners + k
            if column >= rows.shape[1]:
                break
            ends = np.sort(rows[:, [a, b]], axis=1)
            for end, middle in zip(
                ends[rows[:, column] >= 0].tolist(), rows[rows[:, column] >= 0, column], strict=True
            ):
                middles[end[0], end[1]] = int(middle)
    new: list[np.ndarray] = []
    for block, rows in zip(solids, node_rows, strict=True):
        corners = block.cell.shape.corners
        for row, column in np.argwhere(rows < 0):
            if column < corners + len(block.cell.shape.edges):
                a, b = sorted(rows[row, block.cell.shape.edges[column - corners]].tolist())
                if (a, b) not in middles:
                    middles[a, b] = len(points) + len(new)
                    new.append(0.5 * (points[a] + points[b]))
                rows[row, column] = middles[a, b]
            else:
                rows[row, column] = len(points) + len(new)
                new.append(points[rows[row, :corners]].mean(axis=0))
    return node_rows, np.concatenate([points, np.array(new).reshape(-1, 3)])


def _places(deck: Deck, labels: np.ndarray) -> np.ndarray:
    rows = np.searchsorted(deck.labels, labels)
    rows = np.minimum(rows, len(deck.labels) - 1)
    return np.where((labels == MISSING) & (deck.labels[rows] != labels), -1, rows)


def _arranged(block: Block, nodes: np.ndarray, points: np.ndarray, path: str) -> np.ndarray:
    """Return quadratic cells whose mid-edge nodes lie near their edges.

    Raises:
        InputError: one does not.
    """
    cell = block.cell
    if not cell.quadratic:
        return nodes
    corners, edges = cell.shape.corners, cell.shape.edges
    ends = points[nodes[:, edges]]
    centres, length = ends.mean(axis=2), np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2)
    middle = slice(corners, corners + len(edges))
    off = ((points[nodes[:, middle]] - centres) ** 2).sum(axis=2)
    if cell is TETRA10:
        swapped = nodes[:, GMSH_ORDER]
        off_swapped = ((points[swapped[:, middle]] - centres) ** 2).sum(axis=2)
        better = off_swapped.sum(axis=1) < off.sum(axis=1)
        nodes = np.where(better[:, None], swapped, nodes)
        off = np.where(better[:, None], off_swapped, off)
    misplaced = np.sqrt(off) > MID_REACH * length
    if misplaced.any():
        row, edge = np.argwhere(misplaced)[0]
        a, b = edges[edge] + 1
        raise InputError(
            f"{path}: the mid-edge node of corners {a} and {b} of {cell.name} {block.labels[row]} does not lie near"
            f" that edge; allowed: within {MID_REACH:g} of the edge from its middle, in the order of the format"
        )
    return nodes


@cache
def _around(cell: Cell) -> list[tuple[int, int, int, int]]:
    """Return each corner with three edges and the corners at their ends, right-handed, from the outward sides."""
    follows: dict[int, dict[int, int]] = {}
    for side in cell.shape.sides:
        for k, corner in enumerate(side):
            follows.setdefault(corner, {})[side[(k + 1) % len(side)]] = side[k - 1]
    corners = []
    for corner, turn in follows.items():
        if len(turn) == 3:
            a = next(iter(turn))
            corners.append((corner, a, turn[turn[a]], turn[a]))
    return corners


def righted_note(count: int, total: int) -> str:
    """Return the line about elements that `righted` has turned."""
    return f"{count} of {total} elements were numbered the other way round (negative volume): put right"


def righted(cell: Cell, nodes: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, int]:
    """Return cells of positive volume, and how many were the other way round."""
    volume = np.zeros(len(nodes))
    centre = points[nodes[:, : cell.shape.corners]].mean(axis=1)
    for side in cell.shape.sides:
        corners = points[nodes[:, side]] - centre[:, None]
        middle = corners.mean(axis=1)
        for k in range(len(side)):
            volume += np.einsum("ei,ei->e", np.cross(corners[:, k - 1], corners[:, k]), middle)
    inside_out = volume < 0
    return np.where(inside_out[:, None], nodes[:, mirrored(cell)], nodes), int(inside_out.sum())


def _refuse_folded(block: Block, nodes: np.ndarray, points: np.ndarray, path: str) -> None:
    """Raise an InputError if the Jacobian at a corner is not positive: the tangents of its three edges tell."""
    cell = block.cell
    x = points[nodes]
    edges = {frozenset(ends): cell.shape.corners + k for k, ends in enumerate(cell.shape.edges.tolist())}
    longest = np.linalg.norm(x[:, cell.shape.edges[:, 1]] - x[:, cell.shape.edges[:, 0]], axis=2).max(axis=1)
    for corner, *ends in _around(cell):
        tangents = []
        for end in ends:
            tangent = x[:, end] - x[:, corner]
            if cell.quadratic:
                tangent = 4 * x[:, edges[frozenset((corner, end))]] - 3 * x[:, corner] - x[:, end]
            tangents.append(tangent)
        det = np.einsum("ei,ei->e", np.cross(tangents[0], tangents[1]), tangents[2])
        bad = det <= FLAT * longest**3
        if bad.any():
            row = int(np.argmax(bad))
            source = ", ".join(f"{value:.4g}" for value in x[row].mean(axis=0))
            flat = abs(det[row]) <= FLAT * longest[row] ** 3
            fault = "is flat" if flat else "is folded or twisted, its Jacobian is negative at a corner"
            raise InputError(
                f"{path}: {cell.name} {block.labels[row]} {fault}, about ({source}) m; {int(bad.sum())} of {len(nodes)}"
                f" are so there; allowed: Jacobians above {FLAT:g} × longest edge³"
            )
