"""Springs and equations of bulk data of Nastran: CELAS1, CELAS2 and MPC."""

from collections.abc import Mapping, Sequence

from gudgeon.pipeline.geometry.decks.bulk import FIELDS, Card
from gudgeon.pipeline.geometry.decks.model import Sum, Term

TERMS = (1, 4)
"""Fields of a line, from 0, at which terms of an equation begin."""
DIRECTIONS = 6
"""Directions of a grid point."""


def read_sums(by_name: Mapping[str, Sequence[Card]]) -> list[Sum]:
    """Return springs and equations, by the cards of each name.

    None where a grid point has directions of its own (CD), where WTMASS scales masses, and none of the equations of a
    deck with several sets of them, of which its cases choose.

    Raises:
        InputError: a card is wrong, or a property is not there.
    """
    turned = any(card.text(5) not in ("", "0") for name in ("GRID", "GRDSET") for card in by_name.get(name, []))
    scaled = any(card.text(0).upper() == "WTMASS" for card in by_name.get("PARAM", []))
    if turned or scaled:
        return []
    springs = _springs(by_name)
    equations = by_name.get("MPC", [])
    if by_name.get("MPCADD") or len({card.integer(0) for card in equations}) > 1:
        return springs
    return springs + [_equation(card) for card in equations]


def _springs(by_name: Mapping[str, Sequence[Card]]) -> list[Sum]:
    """Return the springs between grid points."""
    pairs = [(card, k) for card in by_name.get("PELAS", []) for k in (0, 4) if card.text(k)]
    properties = {card.integer(k): card.real(k + 1) for card, k in pairs}
    springs = [_spring(card, properties) for name in ("CELAS1", "CELAS2") for card in by_name.get(name, [])]
    return [spring for spring in springs if spring is not None]


def _spring(card: Card, properties: Mapping[int, float]) -> Sum | None:
    """Return a spring between two displacements, or one and the ground; None of one between scalar points."""
    if card.name == "CELAS2":
        stiffness = card.real(1)
    elif (label := card.integer(1, card.integer(0))) in properties:
        stiffness = properties[label]
    else:
        raise card.source.error(f"{card.name} {card.integer(0)} names PELAS {label}, which the deck does not have")
    terms = []
    for k, sign in ((2, 1.0), (4, -1.0)):
        node, direction = card.integer(k, 0), card.text(k + 1)
        if not node:
            continue
        if direction not in "123456"[:DIRECTIONS] or not direction:
            return None
        terms.append(Term(node, int(direction) - 1, sign))
    return Sum(tuple(terms), stiffness, card.name, card.source) if terms else None


def _equation(card: Card) -> Sum:
    """Return an equation: grid point, direction and coefficient of each term, two in a line after a blank field."""
    terms = []
    for k in range(len(card.fields)):
        if k % FIELDS not in TERMS or not card.text(k):
            continue
        direction = card.integer(k + 1, 0)
        if not 1 <= direction <= DIRECTIONS:
            raise card.source.error(f"MPC {card.integer(0)}: direction {card.text(k + 1)!r}; allowed: 1 to 6")
        terms.append(Term(card.integer(k), direction - 1, card.real(k + 2)))
    if not terms or not terms[0].coefficient:
        raise card.source.error(f"MPC {card.integer(0)}: the coefficient of the first term is 0 or missing")
    return Sum(tuple(term for term in terms if term.coefficient), None, "MPC", card.source)
