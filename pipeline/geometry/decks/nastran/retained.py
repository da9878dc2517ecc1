"""Degrees of freedom that a superelement retains: sets of Nastran, scalar points, and the rows of EXTRN."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace

import numpy as np

from gudgeon.pipeline.geometry.decks.model import SCALAR, Deck
from gudgeon.pipeline.geometry.decks.nastran.bulk import Card

MODAL, PAIRS, LISTED = "QSET", ("ASET", "BSET", "CSET", "QSET"), ("ASET1", "BSET1", "CSET1", "QSET1")
"""Sets of generalised coordinates, and those whose union is the analysis set: pairs of point and components, or
components and points."""
SUPPORTS = ("SUPORT", "SUPORT1")
"""Pairs, of the latter behind a number."""
COMPONENTS = "0123456"


def with_retained(deck: Deck, by_name: Mapping[str, list[Card]]) -> Deck:
    """Return a deck with its scalar points, and with what its sets or its EXTRN retain.

    Raises:
        InputError: a card is wrong.
    """
    modal = _union(by_name, (MODAL, f"{MODAL}1"))
    scalars = {label for card in by_name.get("SPOINT", []) for label in card.listed(0)}
    scalars |= {label for label, direction in modal if direction == SCALAR}
    ordered = [pair for card in by_name.get("EXTRN", []) for pair in _pairs(card, 0)]
    if not ordered and (sets := _union(by_name, (*PAIRS, *LISTED))):
        # Supports are in the analysis set, too, where one is stated.
        ordered = sorted(sets | _union(by_name, SUPPORTS))
    return replace(
        deck,
        scalar_points=np.array(sorted(scalars), np.int64),
        generalised=np.array(sorted(pair for pair in modal if pair[1] != SCALAR), np.int64).reshape(-1, 2),
        retained=np.array(ordered, np.int64) if ordered else None,
    )


def _union(by_name: Mapping[str, list[Card]], names: Collection[str]) -> set[tuple[int, int]]:
    return {pair for name in names for card in by_name.get(name, []) for pair in _members(card)}


def _members(card: Card) -> Iterator[tuple[int, int]]:
    """Yield label and direction of each degree of freedom of a set."""
    if card.name == "SUPORT1":
        yield from _pairs(card, 1)
    elif card.name in LISTED:
        for label in card.listed(1):
            yield from ((label, direction) for direction in _directions(card, 0))
    else:
        yield from _pairs(card, 0)


def _pairs(card: Card, start: int) -> Iterator[tuple[int, int]]:
    for k in range(start, len(card.fields), 2):
        if card.text(k):
            yield from ((card.integer(k), direction) for direction in _directions(card, k + 1))


def _directions(card: Card, k: int) -> list[int]:
    """Return the directions that field k says by components 0 to 6; blank is a scalar point."""
    text = card.text(k) or "0"
    if not set(text) <= set(COMPONENTS):
        raise card.source.error(f"{card.name} has {text!r} in field {k + 2}, expected components 1 to 6, or 0")
    return sorted({int(component) - 1 for component in text})
