"""Points of a deck that move with nodes of its solid: those of rigid elements, joined where they share nodes, and those
of mean motions.

Rigid elements that share a point which no solid has, or a node whose rotation both have, are one rigid body.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from gudgeon.pipeline.geometry.decks.members.motion import mean_motion
from gudgeon.pipeline.geometry.decks.members.units import kept, refused
from gudgeon.pipeline.geometry.decks.model import Coupling, Deck, RigidLink

ON_A_LINE = 1e-6
"""Extent across a line, by that along it, below which nodes do not determine a rotation."""
FEW = "its nodes are fewer than three or lie on a line"


@dataclass(frozen=True)
class Placed:
    """Nodes of a deck in metres and in its mesh."""

    points: np.ndarray
    """Positions of the deck's nodes [m], (n, 3)."""
    new_row: np.ndarray
    """Row in the mesh of each node of the deck, −1 where no solid has it."""
    unit: float
    """Metres per unit of length of the file."""
    mass_unit: float | None
    """Kilograms per unit of mass of the file; None: kilograms, if its densities are in kg/m³."""
    path: str
    """Of the file."""


@dataclass(frozen=True)
class Carrier:
    """Nodes of the mesh, and the points of the deck that move with them."""

    name: str
    kind: str
    """`rbe2` or `rbe3`."""
    nodes: np.ndarray
    """Of the mesh, ascending, (k,)."""
    positions: np.ndarray
    """Of these nodes [m], (k, 3)."""
    weights: np.ndarray | None
    """In the mean motion, (k,); None of equal ones."""
    labels: frozenset[int]
    """Of the deck's nodes that move with them."""
    point: np.ndarray
    """Of the node that leads them [m], (3,)."""
    item: Coupling | RigidLink

    @property
    def turns(self) -> bool:
        """Whether its nodes determine a rotation."""
        return spans(self.positions)

    def motion(self, point: np.ndarray) -> np.ndarray:
        """Return the share of each node's displacement in each motion of a point [m], (6, k, 3)."""
        return mean_motion(self.positions, point, self.weights)


def spans(positions: np.ndarray) -> bool:
    """Return whether positions (k, 3) are three or more that are not on a line."""
    if len(positions) < 3:
        return False
    spread = np.linalg.svd(positions - positions.mean(axis=0), compute_uv=False)
    return bool(spread[1] > ON_A_LINE * spread[0])


def carriers_of(deck: Deck, leave_out: Sequence[str], placed: Placed) -> list[Carrier]:
    """Return the carriers of a deck, rigid bodies first.

    Args:
        deck: What the file says.
        leave_out: Keywords that are left out on purpose.
        placed: Its nodes.

    Raises:
        InputError: a rigid element or coupling that is not left out cannot be taken over.
    """
    couplings = [c for c in kept(deck.couplings, leave_out) if c.source is not None]
    links = kept(deck.links, leave_out)
    means = [c for c in couplings if c.tie == "rbe3"]
    rigid: list[Coupling | RigidLink] = [*(c for c in couplings if c.tie == "rbe2"), *links]
    _refuse_leaders(deck, means, couplings, placed)
    mean_carriers = [_mean_carrier(deck, mean, placed) for mean in means]
    members = [_labels(deck, item) for item in rigid]
    points = _points(deck, couplings)
    carriers = []
    for group in _groups(deck, rigid, members, placed):
        labels = np.unique(np.concatenate([members[k] for k in group]))
        carrier = _rigid_carrier(deck, rigid[group[0]], labels, points, placed)
        if not _moves_with_mean(carrier, mean_carriers):
            carriers.append(carrier)
    return carriers + mean_carriers


def _refuse_leaders(deck: Deck, means: Sequence[Coupling], couplings: Sequence[Coupling], placed: Placed) -> None:
    """Refuse mean motions whose point is one of the solid, or leads another set too."""
    leaders = [c.reference for c in couplings]
    for mean in means:
        if leaders.count(mean.reference) > 1:
            raise refused(mean, f"node {mean.reference} leads several sets, allowed: one")
        if placed.new_row[deck.rows(np.array([mean.reference]), placed.path)[0]] >= 0:
            raise refused(mean, f"its node {mean.reference} is one of the solid, allowed: another node")


def _moves_with_mean(carrier: Carrier, means: list[Carrier]) -> bool:
    """Return whether a rigid body moves with the point of a mean motion, which then has its points.

    Raises:
        InputError: it moves with several, or with nodes of the solid too.
    """
    led = [k for k, mean in enumerate(means) if mean.labels & carrier.labels]
    if led and (len(led) > 1 or len(carrier.nodes)):
        mean = means[led[0]]
        label = min(mean.labels & carrier.labels)
        raise refused(carrier.item, f"it shares node {label} with {mean.item.keyword}, allowed: a rigid body that moves"
                                    " with one mean motion or with nodes of the solid")  # fmt: skip
    for k in led:
        means[k] = replace(means[k], labels=means[k].labels | carrier.labels)
    return bool(led)


def _points(deck: Deck, couplings: Sequence[Coupling]) -> set[int]:
    """Return labels of nodes that may be of no solid: leading ones, and those with masses, springs or equations."""
    points = {c.reference for c in couplings} | {mass.node for mass in deck.masses}
    return points | {term.node for item in deck.sums for term in item.terms} | {n for k in deck.links for n in k.nodes}


def _labels(deck: Deck, item: Coupling | RigidLink) -> np.ndarray:
    """Return labels of the nodes of a rigid element, the leading one too."""
    if isinstance(item, RigidLink):
        return np.unique(np.array(item.nodes, np.int64))
    labels = coupled_labels(deck, item)
    _refuse_nothing(item, labels)
    return np.union1d(labels, item.reference)


def coupled_labels(deck: Deck, coupling: Coupling) -> np.ndarray:
    """Return labels of the nodes of a coupling's set, ascending."""
    from gudgeon.pipeline.geometry.decks.abaqus.rest import nodes_of_sides

    if coupling.surface in deck.side_sets:
        return nodes_of_sides(deck.side_sets[coupling.surface], deck.blocks)
    if coupling.surface in deck.node_sets:
        return np.unique(deck.node_sets[coupling.surface])
    elements = deck.element_sets.get(coupling.surface, np.empty(0, np.int64))
    labels = [block.nodes[np.isin(block.labels, elements)].ravel() for block in deck.blocks]
    return np.setdiff1d(np.concatenate([np.empty(0, np.int64), *labels]), [0])


def _refuse_nothing(item: Coupling, labels: np.ndarray) -> None:
    if not len(labels):
        raise refused(item, "it has no nodes, allowed: nodes of the solid")


def _groups(
    deck: Deck, items: Sequence[Coupling | RigidLink], members: Sequence[np.ndarray], placed: Placed
) -> list[list[int]]:
    """Return the numbers of rigid elements that are one body.

    Raises:
        InputError: two share a node of the solid about which they would turn.
    """
    if not items:
        return []
    labels = np.unique(np.concatenate(members))
    columns = [np.searchsorted(labels, some) for some in members]
    counts = [len(some) for some in columns]
    sharing = sparse.csr_matrix(
        (np.ones(sum(counts)), (np.repeat(np.arange(len(items)), counts), np.concatenate(columns))),
        shape=(len(items), len(labels)),
    )
    shared = np.flatnonzero(np.asarray(sharing.sum(axis=0)).ravel() > 1)
    solid = placed.new_row[deck.rows(labels[shared], placed.path)] >= 0
    for column in shared[solid].tolist():
        for k in sharing[:, [column]].nonzero()[0].tolist():
            item = items[k]
            if not (isinstance(item, RigidLink) or item.turns):
                raise refused(item, f"its node {labels[column]} is of another rigid element too, whose rotation it"
                                    " does not have; allowed: nodes of one")  # fmt: skip
    owner = connected_components(sharing @ sharing.T, directed=False)[1]
    return [np.flatnonzero(owner == k).tolist() for k in range(int(owner.max()) + 1)]


def _rigid_carrier(
    deck: Deck, item: Coupling | RigidLink, labels: np.ndarray, points: set[int], placed: Placed
) -> Carrier:
    """Return the carrier of rigid elements that are one body, of which `item` is the leading one."""
    rows = deck.rows(labels, placed.path)
    nodes = placed.new_row[rows]
    foreign = [label for label in labels[nodes < 0].tolist() if label not in points]
    if foreign:
        count = len(coupled_labels(deck, item)) if isinstance(item, Coupling) else len(labels)
        raise refused(item, f"{len(foreign)} of its {count} nodes are of no solid, allowed: nodes of the solid")
    reference = item.reference if isinstance(item, Coupling) else int(labels[np.argmin(nodes)])
    order = np.argsort(nodes[nodes >= 0])
    return Carrier(
        name=f"rbe2_{reference}", kind="rbe2", nodes=nodes[nodes >= 0][order], weights=None, item=item,
        positions=placed.points[rows[nodes >= 0]][order], labels=frozenset(labels.tolist()),
        point=placed.points[deck.rows(np.array([reference]), placed.path)[0]],
    )  # fmt: skip


def _mean_carrier(deck: Deck, coupling: Coupling, placed: Placed) -> Carrier:
    """Return the carrier of a mean motion."""
    labels = coupled_labels(deck, coupling)
    _refuse_nothing(coupling, labels)
    rows = deck.rows(labels, placed.path)
    nodes = placed.new_row[rows]
    if (nodes < 0).any():
        raise refused(coupling, f"{int((nodes < 0).sum())} of its {len(nodes)} nodes are of no solid, allowed: nodes of"
                                " the solid")  # fmt: skip
    order = np.argsort(nodes)
    weights = None
    if coupling.weights is not None:
        weights = np.array([coupling.weights[label] for label in labels[order].tolist()])
        if not (weights > 0).all():
            raise refused(coupling, f"a weight of {weights.min():g} given, allowed: above 0")
        weights = None if np.ptp(weights) == 0 else weights
    return Carrier(
        name=f"rbe3_{coupling.reference}", kind="rbe3", nodes=nodes[order], positions=placed.points[rows[order]],
        weights=weights, labels=frozenset([coupling.reference]), item=coupling,
        point=placed.points[deck.rows(np.array([coupling.reference]), placed.path)[0]],
    )  # fmt: skip


def carrier_by_label(carriers: Sequence[Carrier]) -> Mapping[int, Carrier]:
    """Return the carrier of each of the deck's nodes that moves with one."""
    return {label: carrier for carrier in carriers for label in carrier.labels}
