"""Springs, equations and ties of a deck as relations of its mesh: sums of displacements of nodes."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from gudgeon.modaldb.records.mesh import Relation
from gudgeon.pipeline.geometry.decks.members.carriers import Carrier, Placed, carrier_by_label
from gudgeon.pipeline.geometry.decks.members.units import kept, mass_scale, refused
from gudgeon.pipeline.geometry.decks.model import AXIAL, BASIC, Deck, Sum, Term

TRANSLATIONS = 3
SHORT = 1e-9
"""Length of an axial spring, over the largest coordinate, below which it has no direction."""
ROUND_OFF = 1e-12
"""Coefficients of a sum, over the largest one, that are zero."""


def relations(deck: Deck, leave_out: Sequence[str], carriers: Sequence[Carrier], placed: Placed) -> dict[str, Relation]:
    """Return the springs and equations of a deck, and rigid elements on a line; arguments as of `attachments`.

    Raises:
        InputError: one that is not left out acts on a rotation that its node does not have or on a node that no solid
            has.
    """
    sums = kept(deck.sums, leave_out)
    springs, constraints = [s for s in sums if s.stiffness is not None], [s for s in sums if s.stiffness is None]
    scale = mass_scale(deck, springs, placed.mass_unit)
    owners = carrier_by_label(carriers)
    records: dict[str, Relation] = {}
    for name, items in (("springs", springs), ("equations", constraints)):
        if items:
            terms = [_terms(item, deck, owners, placed) for item in items]
            stiffness = np.array([_stiffness(item, scale) for item in items])
            records[name] = relation(name[:-1] if name == "springs" else "constraint", terms, stiffness)
    return records | _bars(carriers)


def _bars(carriers: Sequence[Carrier]) -> dict[str, Relation]:
    """Return the constraints of rigid bodies on nodes of a line."""
    bars = [row for carrier in carriers if carrier.kind == "rbe2" and not carrier.turns for row in _bar(carrier)]
    return {"bars": relation("constraint", bars, np.zeros(len(bars)))} if bars else {}


def relation(kind: str, terms: Sequence[np.ndarray], stiffness: np.ndarray) -> Relation:
    """Return the record of sums, each by node, direction and coefficient of its terms, (t, 3)."""
    rows = np.repeat(np.arange(len(terms)), [len(item) for item in terms])
    table = np.concatenate(terms)
    return Relation(kind, rows, table[:, 0].astype(np.int64), table[:, 1].astype(np.int64), table[:, 2], stiffness)


def related_notes(records: Mapping[str, Relation]) -> Iterator[str]:
    """Yield a line for each relation."""
    for name, record in records.items():
        count = len(record.stiffness)
        if record.kind == "spring":
            stiffest = record.stiffness.max()
            yield f"{count} spring{'s' * (count > 1)} of the deck, up to {stiffest:.4g} N/m, part of the body"
        elif name == "equations":
            yield f"{count} equation{'s' * (count > 1)} of the deck between displacements of the body's nodes"
        elif name == "bars":
            yield f"rigid elements of the deck on nodes of a line, {count} constraint{'s' * (count > 1)} of the body"


def _terms(item: Sum, deck: Deck, owners: Mapping[int, Carrier], placed: Placed) -> np.ndarray:
    """Return node of the mesh, direction and coefficient of each term, (t, 3)."""
    rows = deck.rows(np.array([term.node for term in item.terms]), placed.path)
    vectors = [_vector(term, deck) for term in item.terms]
    if item.terms[0].direction == AXIAL:
        axis = placed.points[rows[1]] - placed.points[rows[0]]
        length = float(np.linalg.norm(axis))
        if not length > SHORT * np.abs(placed.points).max():
            nodes = f"{item.terms[0].node} and {item.terms[1].node}"
            raise refused(item, f"its nodes {nodes} are at one place")
        vectors = [np.concatenate([term.coefficient * axis / length, np.zeros(3)]) for term in item.terms]
    table = [np.empty((0, 3))]
    for term, row, vector in zip(item.terms, rows.tolist(), vectors, strict=True):
        node, owner = int(placed.new_row[row]), owners.get(term.node)
        turns = vector[TRANSLATIONS:].any()
        if node >= 0 and not turns:
            table.append(_rows(np.array([node]), vector[None, :TRANSLATIONS]))
        elif owner is None or not owner.turns:
            if node >= 0:
                raise refused(item, "acts on a rotation, which nodes of solids do not have; allowed: directions 1 to 3")
            raise refused(item, f"node {term.node} is of no solid, allowed: nodes of the solid, or one that leads them")
        else:
            scaled = vector * np.repeat([1.0, placed.unit], TRANSLATIONS)
            motion = owner.motion(placed.points[row])
            table.append(_rows(owner.nodes, np.einsum("j,jki->ki", scaled, motion)))
    return _summed(np.concatenate(table))


def _vector(term: Term, deck: Deck) -> np.ndarray:
    """Return a term's coefficients of the translation and rotation of its node along x, y, z, (6,)."""
    vector = np.zeros(6)
    if term.direction != AXIAL:
        half = slice(0, 3) if term.direction % BASIC < TRANSLATIONS else slice(3, 6)
        axes = np.eye(3) if term.direction >= BASIC else deck.directions.get(term.node, np.eye(3))
        vector[half] = term.coefficient * axes[:, term.direction % TRANSLATIONS]
    return vector


def _rows(nodes: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return node, direction and coefficient of each component of vectors at nodes, (3 k, 3)."""
    directions = np.tile(np.arange(TRANSLATIONS), len(nodes))
    return np.column_stack([np.repeat(nodes, TRANSLATIONS), directions, vectors.ravel()])


def _summed(table: np.ndarray) -> np.ndarray:
    """Return terms (t, 3), those of one displacement added, in the order of their first ones, without zeros."""
    _, index, inverse = np.unique(table[:, :2], axis=0, return_index=True, return_inverse=True)
    sums = np.bincount(inverse.ravel(), table[:, 2], len(index))
    order = np.argsort(index)
    order = order[np.abs(sums[order]) > ROUND_OFF * np.abs(sums).max(initial=0.0)]
    return np.column_stack([table[index[order], :2], sums[order]])


def _bar(carrier: Carrier) -> list[np.ndarray]:
    """Return constraints of a rigid body on nodes of a line: its ends keep their distance, others move with both."""
    _, line = np.linalg.svd(carrier.positions - carrier.positions.mean(axis=0))[1:]
    heights = carrier.positions @ line[0]
    a, b = int(heights.argmin()), int(heights.argmax())
    length = heights[b] - heights[a]
    nodes, bars = carrier.nodes, []
    if length > SHORT * np.abs(carrier.positions).max():
        axis = (carrier.positions[b] - carrier.positions[a]) / length
        bars.append(_summed(_rows(nodes[[a, b]], np.stack([-axis, axis]))))
    for k in range(len(nodes)):
        t = (heights[k] - heights[a]) / length if bars else 0.0
        if k == a or (k == b and bars):
            continue
        for direction in range(TRANSLATIONS):
            shares = [(nodes[k], direction, 1.0), (nodes[a], direction, t - 1.0), (nodes[b], direction, -t)]
            bars.append(_summed(np.array([row for row in shares if row[2]])))
    return bars


def _stiffness(item: Sum, scale: float) -> float:
    """Return the stiffness of a spring [N/m], whose unit is that of mass over s²; zero of a constraint."""
    stiffness = scale * (item.stiffness or 0.0)
    if not np.isfinite(stiffness) or stiffness < 0:
        raise refused(item, f"a stiffness of {item.stiffness:g} given, allowed: 0 and more")
    return stiffness
