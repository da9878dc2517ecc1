"""Named parts of a deck on the boundary and in the volume of its mesh, and what of the deck the mesh leaves out."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.decks.model import Deck, Omission, Source

MOST_CORNERS = 4
"""Corners of a facet."""
NONE = -1
"""In place of a corner that a facet does not have."""


class Omissible(InputError):
    """What a deck says cannot be part of its body, and may be left out."""

    def __init__(self, text: str, keywords: tuple[str, ...]) -> None:
        super().__init__(text)
        self.keywords = keywords
        """Entries of `geometry.leave_out` that leave it out."""


def left_out(deck: Deck, leave_out: Sequence[str], path: str) -> list[str]:
    """Return a line for what a deck says and the body does not have.

    Args:
        leave_out: Keywords that are left out on purpose.

    Raises:
        InputError: the body would have another mass or stiffness with a thing that is not among them, or one of them is
            not in the deck.
    """
    altering = [omission for omission in deck.omissions if omission.alters]
    taken = _taken_over(deck)
    have = list(dict.fromkeys(omission.keyword for omission in (*altering, *taken)))
    _refuse_unknown(leave_out, have, path)
    allowed = {name.casefold() for name in leave_out}
    if missed := [omission for omission in altering if omission.keyword.casefold() not in allowed]:
        keywords = tuple(dict.fromkeys(omission.keyword for omission in missed))
        raise Omissible(f"{path}: {_not_taken_over(missed, leave_out, path)}", keywords)
    altering += [omission for omission in taken if omission.keyword.casefold() in allowed]
    notes = [f"{_where(o.source, path)}{o.keyword} is left out: {o.text}" for o in altering]
    return [*notes, *_noted([omission for omission in deck.omissions if not omission.alters])]


def _refuse_unknown(leave_out: Sequence[str], have: Sequence[str], path: str) -> None:
    """Refuse keywords that a deck, which has others, does not have."""
    folded = {name.casefold() for name in have}
    for name in leave_out:
        if name.casefold() not in folded:
            names = ", ".join(have) or "nothing that alters the body"
            raise InputError(f"{path}: geometry.leave_out: '{name}' given, the deck has {names}")


def _taken_over(deck: Deck) -> list[Omission]:
    """Return what a body has of a deck beside its solid, as it is called where the body shall not have it."""
    return [Omission(m.keyword, m.source, "the body has nothing in its place") for m in deck.members if m.source]


def _noted(silent: Sequence[Omission]) -> list[str]:
    """Return a line for what a scene states itself."""
    names = ", ".join(dict.fromkeys(f"{o.keyword} (line {o.source.line})" for o in silent))
    return [f"not taken over: {names}; {silent[0].text}"] if silent else []


def _not_taken_over(missed: Sequence[Omission], leave_out: Sequence[str], path: str) -> str:
    names = list(dict.fromkeys(omission.keyword for omission in missed))
    entries = ", ".join(f'"{name}"' for name in [*leave_out, *names])
    others = f" (and {', '.join(names[1:])})" if names[1:] else ""
    return (
        f"{_where(missed[0].source, path)}{missed[0].keyword}{others} is not taken over: {missed[0].text};"
        f" geometry.leave_out = [{entries}] leaves it out"
    )


def stated_materials(deck: Deck, path: str) -> list[dict[str, Any]]:
    """Return the constants of each material of a deck, in its units, with the place of the material."""
    return [{"place": _where(source, path), **constants} for source, constants in deck.materials if constants]


def _where(source: Source, path: str) -> str:
    file = "" if source.path == path else f"{source.path}: "
    return f"{file}line {source.line}: " if source.line else file


def facet_corners(facets: np.ndarray) -> np.ndarray:
    """Return the corners of facets (f, s) of which smaller ones repeat their last node, (f, 4), −1 where there is none.

    A facet has 3, 6 nodes with three corners or 4, 8, 9 with four.
    """
    repeats = np.cumprod(facets[:, ::-1] == facets[:, -1:], axis=1).sum(axis=1)
    counts = facets.shape[1] - repeats + 1
    corners = np.full((len(facets), MOST_CORNERS), NONE)
    width = min(MOST_CORNERS, facets.shape[1])
    corners[:, :width] = facets[:, :width]
    if width == MOST_CORNERS:
        corners[np.isin(counts, (3, 6)), 3] = NONE
    return corners


def named_facets(
    deck: Deck, facets: np.ndarray, new_row: np.ndarray, dimension: int, deck_nodes: int
) -> dict[str, np.ndarray]:
    """Return which boundary facets belong to each name of a deck: sets of elements, of sides, then of nodes.

    Args:
        facets: Edges (f, 3), corners first, or facets as of `facet_corners`.
        new_row: Row in the mesh of each place in the deck, −1 where it is not used.
        dimension: Of the facets, 1 or 2.
        given: Nodes of the mesh from this number on are none of the deck's.
    """
    corners = facet_corners(facets) if dimension == 2 else facets[:, :2]
    members: dict[str, np.ndarray] = {}
    for name, labels in deck.element_sets.items():
        rows = [_rows(deck, block.nodes[np.isin(block.labels, labels)][:, : block.cell.shape.corners], new_row)
                for block in deck.blocks if block.cell.dimension == dimension]  # fmt: skip
        if sum(map(len, rows)):
            members[name] = _matching(corners, rows)
    for name, sides in deck.side_sets.items() if dimension == 2 else ():
        matching = _matching(corners, _sides(deck, sides, new_row))
        members[name] = members.get(name, np.zeros(len(facets), bool)) | matching
    for name, labels in deck.node_sets.items():
        rows = np.searchsorted(deck.labels, labels)
        present = deck.labels[np.minimum(rows, len(deck.labels) - 1)] == labels
        chosen_nodes = np.zeros(max(deck_nodes, int(facets.max(initial=0)) + 1) + 1, bool)
        chosen = new_row[rows[present]]
        chosen_nodes[chosen[chosen >= 0]] = True
        chosen_nodes[deck_nodes:] = True
        complete = np.asarray(chosen_nodes[facets].all(axis=1))
        members.setdefault(name, complete)
    return {name: chosen for name, chosen in members.items() if chosen.any()}


def named_cells(
    deck: Deck, blocks: Sequence[tuple[np.ndarray, np.ndarray]], new_row: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the cells of each named volume of a deck.

    Args:
        blocks: Numbers and corners of cells in the mesh, by type.
        new_row: As of `named_facets`.
    """
    volumes: dict[str, np.ndarray] = {}
    solids = [block for block in deck.blocks if block.cell.dimension == 3]
    for name, labels in deck.element_sets.items():
        chosen = [_rows(deck, block.nodes[np.isin(block.labels, labels)][:, : block.cell.shape.corners], new_row)
                  for block in solids]  # fmt: skip
        if not sum(map(len, chosen)):
            continue
        numbers = []
        for rows, corners in blocks:
            same = [some for some in chosen if some.shape[1] == corners.shape[1]]
            if sum(map(len, same)):
                numbers.append(rows[_matching(corners, same)])
        volumes[name] = np.sort(np.concatenate([np.empty(0, np.int64), *numbers]))
    return volumes


def _rows(deck: Deck, labels: np.ndarray, new_row: np.ndarray) -> np.ndarray:
    return new_row[np.searchsorted(deck.labels, labels)]


def _matching(corners: np.ndarray, rows: Sequence[np.ndarray]) -> np.ndarray:
    """Return which rows of corners (f, c) have the same nodes as one of other rows, narrower ones without an order."""
    width = corners.shape[1]
    wide = [np.pad(some, ((0, 0), (0, width - some.shape[1])), constant_values=NONE) for some in rows if len(some)]
    if not wide:
        return np.zeros(len(corners), bool)
    both = np.sort(np.concatenate([corners, *wide]), axis=1)
    code = np.unique(both, axis=0, return_inverse=True)[1].ravel()
    return np.isin(code[: len(corners)], code[len(corners) :])


def _sides(deck: Deck, sides: np.ndarray, new_row: np.ndarray) -> list[np.ndarray]:
    """Return the corners of faces of solid elements."""
    rows = []
    for block in deck.blocks:
        if block.cell.dimension != 3:
            continue
        for face, corners in enumerate(block.cell.shape.sides):
            owners = sides[sides[:, 1] == face, 0]
            rows.append(_rows(deck, block.nodes[np.isin(block.labels, owners)][:, corners], new_row))
    return rows
