"""Point masses and couplings of a deck as attachments of its mesh: what a body has of them, or why it cannot."""

from collections.abc import Iterator, Sequence

import numpy as np

from gudgeon.modaldb.records.mesh import Attachment
from gudgeon.pipeline.geometry.decks.members.units import mass_scale, refused
from gudgeon.pipeline.geometry.decks.model import Coupling, Deck, PointMass

ON_A_LINE = 1e-6
"""Extent across a line, by that along it, below which nodes do not determine a rotation."""
MOST_NODES = 3000
"""Nodes that share a mass: all pairs of them get an entry of the mass matrix."""


def attachments(
    deck: Deck, leave_out: Sequence[str], points: np.ndarray, new_row: np.ndarray, mass_unit: float | None, path: str
) -> dict[str, Attachment]:
    """Return the point masses and couplings of a deck by names such as `rbe2_9001` and `node_59`.

    Args:
        deck: What the file says.
        leave_out: Keywords that are left out on purpose.
        points: Positions of the deck's nodes [m], (n, 3).
        new_row: Row in the mesh of each node of the deck, −1 where no solid has it.
        mass_unit: Kilograms per unit of mass of the file; None: kilograms, if its densities are in kg/m³.
        path: Of the file.

    Raises:
        InputError: a mass or a coupling that is not left out cannot be taken over.
    """
    folded = {name.casefold() for name in leave_out}
    couplings = [c for c in deck.couplings if c.source is not None and c.keyword.casefold() not in folded]
    masses = [m for m in deck.masses if m.keyword.casefold() not in folded]
    unit = mass_scale(deck, masses, mass_unit)
    at_node = _node_masses(masses, unit)
    leading = [c.reference for c in couplings]
    records: dict[str, Attachment] = {}
    for coupling in couplings:
        if leading.count(coupling.reference) > 1:
            raise refused(coupling, f"node {coupling.reference} leads several sets, allowed: one")
        nodes = _coupled(deck, coupling, new_row, path)
        row = int(deck.rows(np.array([coupling.reference]), path)[0])
        if new_row[row] >= 0:
            if coupling.tie == "rbe3":
                raise refused(coupling, f"its node {coupling.reference} is one of the solid, allowed: another node")
            nodes = np.union1d(nodes, new_row[row])
        elif coupling.tie == "rbe3" and coupling.reference not in at_node:
            continue  # A point without mass follows the body and alters nothing.
        point_mass = at_node.get(coupling.reference, 0.0) if new_row[row] < 0 else 0.0
        _refuse_nodes(coupling, points[np.isin(new_row, nodes)], point_mass)
        records[f"{coupling.tie}_{coupling.reference}"] = Attachment(nodes, points[row], coupling.tie, point_mass)
    return records | _on_nodes(deck, masses, at_node, points=points, new_row=new_row, path=path, leading=leading)


def _node_masses(masses: Sequence[PointMass], unit: float) -> dict[int, float]:
    """Return the sum of the masses at each node [kg]."""
    at_node: dict[int, float] = {}
    for mass in masses:
        if not np.isfinite(unit * mass.mass) or mass.mass < 0:
            raise refused(mass, f"a mass of {mass.mass:g} given, allowed: 0 and more")
        at_node[mass.node] = at_node.get(mass.node, 0.0) + unit * mass.mass
    return at_node


def _on_nodes(
    deck: Deck, masses: Sequence[PointMass], at_node: dict[int, float], *, points: np.ndarray, new_row: np.ndarray,
    path: str, leading: Sequence[int],
) -> dict[str, Attachment]:  # fmt: skip
    """Return the masses on nodes of the solid; others are those of the nodes that lead couplings."""
    records: dict[str, Attachment] = {}
    for mass in masses:
        row = int(deck.rows(np.array([mass.node]), path)[0])
        if new_row[row] >= 0:
            node = np.array([new_row[row]])
            records[f"node_{mass.node}"] = Attachment(node, points[row], "node", at_node[mass.node])
        elif mass.node not in leading:
            raise refused(mass, f"node {mass.node} is of no solid, and no coupling leads it")
    return records


def with_middles(record: Attachment, edges: np.ndarray, middles: np.ndarray) -> Attachment:
    """Return an attachment with nodes that the reader put in the middle of edges between its nodes.

    Args:
        record: An attachment of several nodes.
        edges: Nodes of the edges, (k, 2).
        middles: Node in the middle of each, (k,).
    """
    if record.kind == "node":
        return record
    covered = np.isin(edges, record.nodes).all(axis=1)
    return Attachment(np.union1d(record.nodes, middles[covered]), record.point, record.kind, record.mass)


def attached_notes(records: dict[str, Attachment]) -> Iterator[str]:
    """Yield a line for each attachment, with its mass in kg."""
    for name, record in records.items():
        has = f" with {record.mass:.4g} kg" if record.mass else ""
        yield f"{name} of the deck is part of the body: {len(record.nodes)} node{'s' * (len(record.nodes) > 1)}{has}"


def _coupled(deck: Deck, coupling: Coupling, new_row: np.ndarray, path: str) -> np.ndarray:
    """Return the nodes of the mesh that a coupling names."""
    from gudgeon.pipeline.geometry.decks.abaqus.rest import nodes_of_sides

    if coupling.surface in deck.side_sets:
        labels = nodes_of_sides(deck.side_sets[coupling.surface], deck.blocks)
    else:
        labels = deck.node_sets.get(coupling.surface, np.empty(0, np.int64))
    nodes = new_row[deck.rows(np.unique(labels), path)]
    if not len(nodes) or (nodes < 0).any():
        missing = (
            f"{int((nodes < 0).sum())} of its {len(nodes)} nodes are of no solid" if len(nodes) else "it has no nodes"
        )
        raise refused(coupling, f"{missing}, allowed: nodes of the solid")
    return np.sort(nodes)


def _refuse_nodes(coupling: Coupling, positions: np.ndarray, mass: float) -> None:
    """Refuse a coupling whose nodes (k, 3) do not determine the rotation of its point, or are too many for a mass."""
    if mass and len(positions) > MOST_NODES:
        raise refused(coupling, f"its mass would couple {len(positions)} nodes, allowed: {MOST_NODES}")
    spread = np.linalg.svd(positions - positions.mean(axis=0), compute_uv=False) if len(positions) > 2 else np.zeros(2)
    if not spread[1] > ON_A_LINE * spread[0]:
        raise refused(coupling, "its nodes are fewer than three or lie on a line")
