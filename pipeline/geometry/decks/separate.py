"""One of several bodies of a deck that has no parts: the solid elements of a set."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.decks.model import (
    MISSING,
    Block,
    Coupling,
    Deck,
    Omission,
    PointMass,
    RigidLink,
    Sum,
    TiedSurfaces,
)

Member = Coupling | RigidLink | PointMass | Sum | TiedSurfaces
M = TypeVar("M", bound=Member)
PIECE = "piece"
"""Beginning of the names of pieces without a set of their own, which a number follows."""
MOST_LISTED = 12
"""Sets that a message names."""


def of_elements(deck: Deck, name: str, path: str) -> Deck:
    """Return a deck with the solid elements of a set alone, and what it says of their nodes.

    Raises:
        InputError: there is no such set, or it has no solid elements.
    """
    solids = [block for block in deck.blocks if block.cell.dimension == 3]
    members = _elements_by_name(deck, solids, name)
    blocks = [block for block in (_members(block, members) for block in solids) if len(block.labels)]
    if not blocks:
        raise InputError(f'{path}: has no part = "{name}" and no set of solid elements of this name; it has'
                         f" {_listed(dict.fromkeys([*_solid_sets(deck, solids), *bodies_of(deck)]))}")  # fmt: skip
    nodes, every = _nodes(blocks), _nodes(solids)
    side = _Side(deck, set(nodes.tolist()), set(np.setdiff1d(every, nodes).tolist()))
    # Masses come last: they follow the points that couplings and links of the body lead.
    couplings, links, ties = side.kept(deck.couplings), side.kept(deck.links), side.kept(deck.ties)
    sums, masses = side.kept(deck.sums), side.kept(deck.masses)
    return replace(
        deck, blocks=(*blocks, *_faces(deck, nodes)), couplings=couplings, links=links, ties=ties, sums=sums,
        masses=masses, omissions=(*deck.omissions, *side.joining), side_sets=_side_sets(deck, blocks),
    )  # fmt: skip


def _faces(deck: Deck, nodes: np.ndarray) -> list[Block]:
    """Return the faces and lines of a deck whose nodes are all among some, by type."""
    others = [block for block in deck.blocks if block.cell.dimension < 3]
    chosen = [_members(block, block.labels[np.isin(block.nodes, nodes).all(axis=1)]) for block in others]
    return [block for block in chosen if len(block.labels)]


def _side_sets(deck: Deck, blocks: Sequence[Block]) -> dict[str, np.ndarray]:
    """Return the sets of faces of some elements that are not empty."""
    labels = np.concatenate([block.labels for block in blocks])
    sides = {key: rows[np.isin(rows[:, 0], labels)] for key, rows in deck.side_sets.items()}
    return {key: rows for key, rows in sides.items() if len(rows)}


def bodies_of(deck: Deck) -> list[str]:
    """Return the names of the bodies of a deck, connected pieces that share no node: of the set of elements that each
    is, or `piece1`, `piece2`, …; none if its solid is of one piece."""
    solids = [block for block in deck.blocks if block.cell.dimension == 3]
    if not solids:
        return []
    labels, pieces = np.concatenate([block.labels for block in solids]), _pieces(deck, solids)
    count = int(pieces.max()) + 1
    sizes, named = np.bincount(pieces), dict[int, str]()
    for name, members in deck.element_sets.items():
        set_pieces = np.unique(pieces[np.isin(labels, members)])
        if len(set_pieces) == 1 and np.isin(labels, members).sum() == sizes[set_pieces[0]]:
            named.setdefault(int(set_pieces[0]), name)
    return [named.get(piece, f"{PIECE}{piece + 1}") for piece in range(count)] if count > 1 else []


class _Side:
    """Nodes of a body and of the others, with the points that members lead by them."""

    def __init__(self, deck: Deck, nodes: set[int], others: set[int]) -> None:
        self._deck, self._own, self._others = deck, nodes, others
        self.joining: list[Omission] = []

    def kept(self, items: Sequence[M]) -> tuple[M, ...]:
        """Return the members of a kind that are the body's, or nobody's; those that join it with another are noted."""
        members: list[M] = []
        for item in items:
            nodes, lead = self._nodes_of(item)
            foreign, native = bool(nodes & self._others), bool(nodes & self._own)
            if foreign and native and item.source is not None:
                text = "joins the body with another one of the deck"
                self.joining.append(Omission(item.keyword, item.source, text))
            if not foreign:
                members.append(item)
            (self._others if foreign else self._own).update(lead)
        return tuple(members)

    def _nodes_of(self, item: Member) -> tuple[set[int], set[int]]:
        """Return the nodes by which a member belongs to a body, and those that it leads or is led by."""
        if isinstance(item, Coupling):
            return self._of_set(item.surface), {item.reference}
        if isinstance(item, RigidLink):
            return set(item.nodes), set(item.nodes)
        if isinstance(item, PointMass):
            return {item.node}, set()
        if isinstance(item, Sum):
            return {term.node for term in item.terms}, set()
        return self._of_set(item.slave) | self._of_set(item.master), set()

    def _of_set(self, name: str) -> set[int]:
        nodes = self._deck.node_sets.get(name, np.empty(0, np.int64))
        sides = self._deck.side_sets.get(name, np.empty((0, 2), np.int64))
        blocks = [_members(block, sides[:, 0]) for block in self._deck.blocks] if len(sides) else []
        return {*nodes.tolist(), *_nodes(blocks).tolist()}


def _elements_by_name(deck: Deck, solids: Sequence[Block], name: str) -> np.ndarray:
    """Return the labels of the elements of a set, or of the piece `piece1`, `piece2`, …, (k,)."""
    for key, members in deck.element_sets.items():
        if key.casefold() == name.casefold():
            return members
    position = name.casefold().removeprefix(PIECE)
    if not solids or not position.isdecimal() or position == name:
        return np.empty(0, np.int64)
    return np.concatenate([block.labels for block in solids])[_pieces(deck, solids) == int(position) - 1]


def _members(block: Block, labels: np.ndarray) -> Block:
    on = np.isin(block.labels, labels)
    return block._replace(labels=block.labels[on], nodes=block.nodes[on])


def _nodes(blocks: Sequence[Block]) -> np.ndarray:
    nodes = np.unique(np.concatenate([np.empty(0, np.int64), *(block.nodes.ravel() for block in blocks)]))
    return nodes[nodes != MISSING]


def _pieces(deck: Deck, solids: Sequence[Block]) -> np.ndarray:
    """Return the connected piece of each element, block by block, counted from 0 in this order, (e,)."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    corners = [np.searchsorted(deck.labels, block.nodes[:, : block.cell.shape.corners]) for block in solids]
    leads = np.concatenate([np.repeat(nodes[:, 0], nodes.shape[1]) for nodes in corners])
    ends, size = np.concatenate([nodes.ravel() for nodes in corners]), len(deck.labels)
    piece_of = connected_components(coo_matrix((np.ones(len(leads)), (leads, ends)), (size, size)), directed=False)[1]
    component_of = np.concatenate([piece_of[nodes[:, 0]] for nodes in corners])
    _, index, inverse = np.unique(component_of, return_index=True, return_inverse=True)
    return np.asarray(np.argsort(np.argsort(index))[inverse])


def _solid_sets(deck: Deck, solids: Sequence[Block]) -> list[str]:
    labels = np.concatenate([np.empty(0, np.int64), *(block.labels for block in solids)])
    return [name for name, members in deck.element_sets.items() if np.isin(members, labels).any()]


def _listed(names: Collection[str]) -> str:
    suffix = f" and {len(names) - MOST_LISTED} more" if len(names) > MOST_LISTED else ""
    return f"the sets {', '.join([*names][:MOST_LISTED])}{suffix}" if names else "none"
