"""Springs and equations of bulk data of Nastran: CELAS1, CELAS2, CBUSH, RROD and MPC."""

from collections.abc import Mapping, Sequence, Set

import numpy as np

from gudgeon.pipeline.geometry.decks.axes import in_system
from gudgeon.pipeline.geometry.decks.model import AXIAL, BASIC, Sum, Term
from gudgeon.pipeline.geometry.decks.nastran.bulk import FIELDS, Card
from gudgeon.pipeline.geometry.decks.nastran.grids import Grids

TERMS = (1, 4)
"""Fields of a line, from 0, at which terms of an equation begin."""
ROUND_OFF = 1e-9
"""Of an arm across an axis, over its largest component."""
DIRECTIONS = 6
"""Directions of a grid point."""


def read_sums(by_name: Mapping[str, Sequence[Card]], grids: Grids, chosen: Set[int] | None) -> list[Sum]:
    """Return springs, rods and equations, by the cards of each name.

    None of the equations of a deck with several sets of them, of which its cases choose several or are not known, and
    of a CBUSH that damps.

    Args:
        chosen: Sets of equations that its cases choose; None of bulk data alone.

    Raises:
        InputError: a card is wrong, or a property is not there.
    """
    springs = _springs(by_name) + [
        spring for card in by_name.get("CBUSH", []) for spring in _bush(card, by_name, grids)
    ]
    rods = [_rod(card) for card in by_name.get("RROD", [])]
    equations = [card for card in by_name.get("MPC", []) if chosen is None or card.integer(0) in chosen]
    if by_name.get("MPCADD") or len({card.integer(0) for card in equations}) > 1:
        return springs + rods
    return springs + rods + [_equation(card) for card in equations]


def _rod(card: Card) -> Sum:
    """Return the constraint of a rigid rod, whose ends keep their distance."""
    return Sum((Term(card.integer(1), AXIAL, -1.0), Term(card.integer(2), AXIAL, 1.0)), None, "RROD", card.source)


def _bush(card: Card, by_name: Mapping[str, Sequence[Card]], grids: Grids) -> list[Sum]:
    """Return the springs of a CBUSH along and about its axes; none of one that damps, is nonlinear or not half way.

    Raises:
        InputError: its property or its axes are missing.
    """
    label = card.integer(1, card.integer(0))
    properties = [p for p in by_name.get("PBUSH", []) if p.integer(0) == label]
    if not properties:
        raise card.source.error(f"CBUSH {card.integer(0)} names PBUSH {label}, which the deck does not have")
    stiffness = _bush_stiffness(properties[0])
    nonlinear = label in {p.integer(0) for p in by_name.get("PBUSHT", [])}
    if nonlinear or stiffness is None or card.text(8) not in ("", "0.5", ".5") or card.text(9) not in ("", "-1"):
        return []
    a, b = card.integer(2), card.integer(3, 0)
    x_a = grids.position(a, card.source)
    x_b = grids.position(b, card.source) if b else x_a
    axes = _bush_axes(card, grids, x_a, x_b, stiffness)
    middle = 0.5 * (x_a + x_b)
    ends = [(node, sign, arm) for node, sign, arm in ((a, 1.0, middle - x_a), (b, -1.0, middle - x_b)) if node]
    return [_bush_sum(card, ends, k, axes[:, k % 3], float(stiffness[k])) for k in np.flatnonzero(stiffness).tolist()]


def _bush_stiffness(card: Card) -> np.ndarray | None:
    """Return the stiffness of a PBUSH along and about its axes, (6,); None of one that damps or has mass."""
    stiffness = np.zeros(6)
    for k, word in enumerate(card.fields):
        if word.upper() not in ("K", "B", "GE", "M"):
            continue
        values = np.array([card.real(k + 1 + d) for d in range(6)])
        if word.upper() == "K":
            stiffness = values
        elif values.any():
            return None
    return stiffness


def _bush_sum(
    card: Card, ends: Sequence[tuple[int, float, np.ndarray]], direction: int, axis: np.ndarray, stiffness: float
) -> Sum:
    """Return the spring of a CBUSH along an axis at its middle, or about it.

    Args:
        ends: Grid point, sign and arm to the middle of each.
        direction: Of the spring, 0 to 5.
        axis: Unit vector, (3,).
        stiffness: In the file's units.
    """
    terms = []
    for node, sign, arm in ends:
        turns = axis if direction >= 3 else np.cross(arm, axis)
        turns = np.where(np.abs(turns) > ROUND_OFF * np.abs(arm).max(initial=0.0), turns, 0.0)
        vector = sign * np.concatenate([axis * (direction < 3), turns])
        terms += [Term(node, BASIC + d, c) for d, c in enumerate(vector.tolist()) if c]
    return Sum(tuple(terms), stiffness, "CBUSH", card.source)


def _bush_axes(card: Card, grids: Grids, x_a: np.ndarray, x_b: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Return the axes of a CBUSH as columns, (3, 3): of a system, or along its line and a vector or a grid point."""
    if card.text(7):
        return grids.axes_at(card.integer(7), x_a, card.source)
    along = x_b - x_a
    length = float(np.linalg.norm(along))
    if not length > 0:
        raise card.source.error(f"CBUSH {card.integer(0)} has its ends at one place and no coordinate system (CID)")
    if card.text(4) and not card.text(5) and not card.text(6) and "." not in card.text(4):
        across = grids.position(card.integer(4), card.source) - x_a
    elif any(card.text(k) for k in (4, 5, 6)):
        across = np.array([card.real(k) for k in (4, 5, 6)])
    elif not stiffness[[1, 2, 4, 5]].any():
        across = np.eye(3)[int(np.abs(along).argmin())]
    else:
        raise card.source.error(f"CBUSH {card.integer(0)} has stiffness across its line and no direction for it")
    return in_system(np.zeros(3), along, across, card.source)


def _springs(by_name: Mapping[str, Sequence[Card]]) -> list[Sum]:
    """Return the springs between grid points, but for those whose stiffness PELAST varies."""
    pairs = [(card, k) for card in by_name.get("PELAS", []) for k in (0, 4) if card.text(k)]
    properties = {card.integer(k): card.real(k + 1) for card, k in pairs}
    nonlinear = {card.integer(0) for card in by_name.get("PELAST", [])}
    linear = [card for card in by_name.get("CELAS1", []) if card.integer(1, card.integer(0)) not in nonlinear]
    springs = [_spring(card, properties) for card in [*linear, *by_name.get("CELAS2", [])]]
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
