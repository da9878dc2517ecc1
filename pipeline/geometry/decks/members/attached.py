"""Point masses and couplings of a deck as attachments of its mesh: what a body has of them, or why it cannot."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.mesh import Attachment
from gudgeon.pipeline.geometry.decks.members.carriers import FEW, Carrier, Placed, carrier_by_label
from gudgeon.pipeline.geometry.decks.members.units import kept, mass_scale, refused
from gudgeon.pipeline.geometry.decks.model import Deck, PointMass

MOST_NODES = 3000
"""Nodes that share a mass: all pairs of them get an entry of the mass matrix."""


class Lump(NamedTuple):
    """A mass with its centre and inertia."""

    mass: float
    """[kg]"""
    centre: np.ndarray
    """[m], (3,)."""
    inertia: np.ndarray
    """About the centre [kg m^2], (3, 3)."""


def attachments(
    deck: Deck, leave_out: Sequence[str], carriers: Sequence[Carrier], placed: Placed
) -> dict[str, Attachment]:
    """Return the point masses and couplings of a deck by names such as `rbe2_9001` and `node_59`.

    Args:
        deck: What the file says.
        leave_out: Keywords that are left out on purpose.
        carriers: Of the deck.
        placed: Nodes of the deck.

    Raises:
        InputError: a mass or a coupling that is not left out cannot be taken over.
    """
    masses = kept(deck.masses, leave_out)
    scale = mass_scale(deck, masses, placed.mass_unit)
    owners = carrier_by_label(carriers)
    carried: dict[str, list[Lump]] = {}
    on_nodes: dict[str, Attachment] = {}
    for mass in masses:
        row = int(deck.rows(np.array([mass.node]), placed.path)[0])
        node, owner = int(placed.new_row[row]), owners.get(mass.node)
        lump = _lump(mass, placed.points[row], scale, placed.unit)
        if node >= 0 and (mass.plain or owner is None):
            _refuse_rotations(mass)
            name = f"node_{mass.node}"
            before = on_nodes[name].mass if name in on_nodes else 0.0
            on_nodes[name] = Attachment(np.array([node]), lump.centre, "node", before + lump.mass)
        elif owner is None:
            raise refused(mass, f"node {mass.node} is of no solid, and no coupling leads it")
        else:
            carried.setdefault(owner.name, []).append(lump)
    records = {carrier.name: _carrying(carrier, carried.get(carrier.name, [])) for carrier in carriers}
    return {name: record for name, record in records.items() if record is not None} | on_nodes


def _carrying(carrier: Carrier, lumps: Sequence[Lump]) -> Attachment | None:
    """Return a carrier with its masses; None of one that alters nothing, or that constraints hold together.

    Raises:
        InputError: its nodes do not determine a rotation, or are too many for a mass.
    """
    if carrier.kind == "rbe3" and not lumps:
        return None  # A point without mass follows the body.
    if not carrier.turns:
        if lumps or len(carrier.nodes) < 2:
            raise refused(carrier.item, FEW)
        return None
    if lumps and len(carrier.nodes) > MOST_NODES:
        raise refused(carrier.item, f"its mass would couple {len(carrier.nodes)} nodes, allowed: {MOST_NODES}")
    return _attachment(carrier, lumps)


def _lump(mass: PointMass, position: np.ndarray, scale: float, unit: float) -> Lump:
    """Return a mass in SI units.

    Raises:
        InputError: it is negative, or its inertia is that of no body.
    """
    if not np.isfinite(scale * mass.mass) or mass.mass < 0:
        raise refused(mass, f"a mass of {mass.mass:g} given, allowed: 0 and more")
    inertia = np.array(mass.inertia or np.zeros(9), float).reshape(3, 3) * scale * unit**2
    if any(mass.inertia) and not np.linalg.eigvalsh(inertia)[0] >= -1e-9 * np.abs(inertia).max():
        raise refused(mass, "its inertia is negative about an axis; allowed: moments of inertia of a body")
    return Lump(scale * mass.mass, position + unit * np.array(mass.offset), inertia)


def _refuse_rotations(mass: PointMass) -> None:
    """Refuse a mass that turns on a node of the solid."""
    if not mass.plain:
        raise refused(mass, f"a mass with offset or inertia on node {mass.node} of a solid, which has no rotation;"
                            " allowed: on a node that a rigid element or a coupling leads")  # fmt: skip


def _attachment(carrier: Carrier, lumps: Sequence[Lump]) -> Attachment:
    """Return a carrier with its masses as one, at their centre."""
    mass = float(sum(lump.mass for lump in lumps))
    centre = sum((lump.mass * lump.centre for lump in lumps), np.zeros(3)) / mass if mass else carrier.point
    if len(lumps) == 1:
        centre = lumps[0].centre
    inertia = np.zeros((3, 3))
    for lump in lumps:
        arm = lump.centre - centre
        inertia += lump.inertia + lump.mass * ((arm @ arm) * np.eye(3) - np.outer(arm, arm))
    return Attachment(carrier.nodes, centre, carrier.kind, mass, carrier.weights, inertia if inertia.any() else None)


def with_middles(record: Attachment, edges: np.ndarray, middles: np.ndarray) -> Attachment:
    """Return an attachment with nodes that the reader put in the middle of edges between its nodes.

    Args:
        record: An attachment of several nodes.
        edges: Nodes of the edges, (k, 2).
        middles: Node in the middle of each, (k,).
    """
    if record.kind != "rbe2":
        return record  # A mean is that of the file's nodes.
    covered = np.isin(edges, record.nodes).all(axis=1)
    return replace(record, nodes=np.union1d(record.nodes, middles[covered]))


def attached_notes(records: dict[str, Attachment]) -> Iterator[str]:
    """Yield a line for each attachment, with its mass in kg."""
    for name, record in records.items():
        has = f" with {record.mass:.4g} kg" if record.mass else ""
        has += " and inertia" if record.inertia is not None else ""
        yield f"{name} of the deck is part of the body: {len(record.nodes)} node{'s' * (len(record.nodes) > 1)}{has}"
