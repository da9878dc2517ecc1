"""Springs, equations and ties of a deck as relations of its mesh: sums of displacements of nodes."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from gudgeon.modaldb.records.mesh import Relation
from gudgeon.pipeline.geometry.decks.members.units import mass_scale, refused
from gudgeon.pipeline.geometry.decks.model import AXIAL, Deck, Sum, Term

TRANSLATIONS = 3
SHORT = 1e-9
"""Length of an axial spring, over the largest coordinate, below which it has no direction."""


def relations(
    deck: Deck, leave_out: Sequence[str], points: np.ndarray, new_row: np.ndarray, mass_unit: float | None, path: str
) -> dict[str, Relation]:
    """Return the springs and equations of a deck; arguments as of `attachments`.

    Raises:
        InputError: one that is not left out acts on a rotation or on a node that no solid has.
    """
    folded = {name.casefold() for name in leave_out}
    sums = [item for item in deck.sums if item.keyword.casefold() not in folded]
    springs, constraints = [s for s in sums if s.stiffness is not None], [s for s in sums if s.stiffness is None]
    scale = mass_scale(deck, springs, mass_unit)
    records: dict[str, Relation] = {}
    for name, items in (("springs", springs), ("equations", constraints)):
        if items:
            terms = [_terms(item, deck, points, new_row, path) for item in items]
            stiffness = np.array([_stiffness(item, scale) for item in items])
            records[name] = relation(name[:-1] if name == "springs" else "constraint", terms, stiffness)
    return records


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


def _terms(item: Sum, deck: Deck, points: np.ndarray, new_row: np.ndarray, path: str) -> np.ndarray:
    """Return node of the mesh, direction and coefficient of each term, (t, 3)."""
    rows = deck.rows(np.array([term.node for term in item.terms]), path)
    nodes = new_row[rows]
    if (nodes < 0).any():
        node = item.terms[int(np.argmax(nodes < 0))].node
        raise refused(item, f"node {node} is of no solid, allowed: nodes of the solid")
    if any(term.direction >= TRANSLATIONS for term in item.terms):
        raise refused(item, "acts on a rotation, which nodes of solids do not have; allowed: directions 1 to 3")
    terms = item.terms
    if terms[0].direction == AXIAL:
        axis = points[rows[1]] - points[rows[0]]
        length = float(np.linalg.norm(axis))
        if not length > SHORT * np.abs(points).max():
            raise refused(item, f"its nodes {terms[0].node} and {terms[1].node} are at one place")
        terms = tuple(Term(t.node, k, t.coefficient * c) for t in terms for k, c in enumerate(axis / length))
        nodes = np.repeat(nodes, TRANSLATIONS)
    return np.array([(node, t.direction, t.coefficient) for node, t in zip(nodes.tolist(), terms, strict=True)])


def _stiffness(item: Sum, scale: float) -> float:
    """Return the stiffness of a spring [N/m], whose unit is that of mass over s²; zero of a constraint."""
    stiffness = scale * (item.stiffness or 0.0)
    if not np.isfinite(stiffness) or stiffness < 0:
        raise refused(item, f"a stiffness of {item.stiffness:g} given, allowed: 0 and more")
    return stiffness
