"""One table of the ports of a system: contact points, joints, loads and springs.

The displacement u of a port i is

    uᵢ = offsetᵢ + Wᵢ q + Σ_b Vᵢᵇᵀ R_b Σⱼ Vⱼᵇ fⱼ

with W over the coordinates of its bodies, R_b the residual flexibility of a body over its interfaces and Vᵢᵇ the few
rows of it that the port is made of. A force f of the port acts as Wᵀ f on the coordinates. R is gathered once per body.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from itertools import pairwise

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.modes import InterfaceModes, TractionModes
from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.contact.blocks import Blocks, summed
from gudgeon.solver.ports.pairs import Pairs, coupled_ports


class Kind(IntEnum):
    """How a port responds to its displacement."""

    UNILATERAL = 0
    """0 ≤ f ⊥ gap ≥ 0, over a compliance."""
    CONE = 1
    """Three ports: a unilateral one, then two along its tangents, with Coulomb friction."""
    LAW = 2
    """A contact law."""
    RUBBING_LAW = 3
    """Three ports: a contact law, then two tangents with Coulomb friction."""
    SPRING = 4
    """A linear spring with a dashpot."""
    BILATERAL = 5
    """Two ports: a point whose distance from a driven point is constant."""
    GIVEN = 6
    """A force prescribed over time."""
    DRIVEN = 7
    """A displacement prescribed over time; the ports of one motion respond together."""
    SURFACE = 8
    """A function of a traction space over which points slide: it takes their forces and has no response of its own."""


BLOCK = {Kind.CONE: 3, Kind.RUBBING_LAW: 3, Kind.BILATERAL: 2}
"""Ports that respond together, where there is more than one; of a driven interface all."""


@dataclass(frozen=True)
class Side:
    """What n ports are made of on one body with r rigid coordinates: k rows of its residual flexibility each."""

    body: FlexibleBody
    rigid: np.ndarray
    """Displacement per rigid coordinate, (n, r)."""
    index: np.ndarray
    """Rows of the residual flexibility, (n, k)."""
    weight: np.ndarray
    """Their weights, (n, k)."""
    flexible: bool = True
    """Whether the residual flexibility takes part."""

    def elastic(self) -> np.ndarray:
        """Return the displacement per elastic coordinate, (n, m)."""
        shapes = elastic_rows(self.body)
        return np.einsum("nk,nkm->nm", self.weight, shapes[self.index])


@dataclass(frozen=True)
class PortBlock:
    """The n ports of one member of the scene."""

    name: str
    """`contact.NAME`, `joint.NAME`, `force.NAME`, `motion.NAME`, or `surface.NAME`: what a contact slides over."""
    kind: Kind
    sides: tuple[Side, ...]
    offset: np.ndarray
    """Displacement at q = 0 [m], (n,)."""
    directions: np.ndarray | None = None
    """Of the force on the first body, (n, 3); None where it is generalised."""


@dataclass(frozen=True)
class Ports:
    """All p ports of a system with m coordinates."""

    blocks: list[PortBlock]
    places: list[slice]
    """Ports of each block."""
    kind: np.ndarray
    """`Kind` of each port, (p,)."""
    offset: np.ndarray
    """[m], (p,)."""
    rows: Blocks
    """W, (p, m)."""
    sides: np.ndarray
    """Number of each port's bodies among those of the system, −1 where it has one only, or one twice, (p, 2)."""
    pairs: Pairs
    """Which ports share a body."""
    flexibility: np.ndarray
    """Tables of the displacement of port i, by rows, by a force on either side of port j [m/N], (2, n)."""
    weights: dict[str, sparse.csr_array] = field(repr=False)
    """V of each body whose residual flexibility takes part, (C, p)."""

    @property
    def by_sides(self) -> tuple[Blocks, Blocks]:
        """Displacement of port i, in its row, by a force on the first and on the second side of port j [m/N]."""
        near_side, far_side = (self.pairs.matrix(t) for t in self.flexibility)
        return near_side, far_side

    @property
    def residual(self) -> Blocks:
        """R: the displacement of port i by a force of port j [m/N], (p, p)."""
        return self.pairs.matrix(self.flexibility.sum(axis=0))

    def of(self, name: str) -> slice:
        """Return the ports of a member."""
        return self.places[[block.name for block in self.blocks].index(name)]

    def numbers(self, names: Sequence[str]) -> np.ndarray:
        """Return the numbers of the ports of some members, one member after the other."""
        ranges = [np.arange(self.of(name).start, self.of(name).stop) for name in names]
        return np.concatenate([np.empty(0, np.int64), *ranges]).astype(np.int64)


def block_size(block: PortBlock) -> int:
    """Return how many ports of a member respond together."""
    return len(block.offset) if block.kind == Kind.DRIVEN else BLOCK.get(block.kind, 1)


def elastic_rows(body: FlexibleBody) -> np.ndarray:
    """Return the displacement of all rows of a body's residual flexibility per elastic coordinate, (C, m)."""
    modal = body.modal
    rows = np.zeros((modal.row_count, len(modal.angular_frequencies)))
    for name, interface in {**modal.interfaces, **modal.tractions, **modal.loads}.items():
        if len(interface.rows):
            rows[slice(*modal.interface_rows[name])] = interface.rows
        if isinstance(interface, InterfaceModes | TractionModes) and interface.tangential_rows is not None:
            across = interface.tangential_rows
            rows[slice(*modal.tangential_spans[name])] = across.reshape(-1, rows.shape[1])
    return rows


def gathered(blocks: Sequence[PortBlock], bodies: Sequence[FlexibleBody], size: int) -> Ports:
    """Build the table of some members' ports.

    Args:
        bodies: Of the system, in the order of its coordinates.
        size: Number of coordinates.
    """
    ends = np.cumsum([0, *(len(block.offset) for block in blocks)])
    spans = [slice(int(start), int(stop)) for start, stop in pairwise(ends)]
    count, numbers = int(ends[-1]), {body.name: i for i, body in enumerate(bodies)}
    rows, sides = list[tuple[slice, slice, np.ndarray]](), np.full((count, 2), -1)
    for block, span in zip(blocks, spans, strict=True):
        for side_id, side in enumerate(block.sides):
            rows.append((span, side.body.coordinates, np.hstack([side.rigid, side.elastic()])))
            if side_id == 0 or side.body is not block.sides[0].body:
                sides[span, side_id] = numbers[side.body.name]
    weights = {body.name: V for body in bodies if (V := _weights(blocks, spans, body)) is not None}
    pairs = coupled_ports(sides, all_couple=any(block.kind == Kind.SURFACE for block in blocks))
    return Ports(
        blocks=list(blocks), places=spans, rows=summed((count, size), rows), sides=sides, pairs=pairs, weights=weights,
        flexibility=_flexibility(bodies, weights, sides, pairs),
        kind=np.repeat([int(block.kind) for block in blocks], np.diff(ends)).astype(np.int64),
        offset=np.concatenate([np.empty(0), *(block.offset for block in blocks)]),
    )  # fmt: skip


def _flexibility(
    bodies: Sequence[FlexibleBody], weights: dict[str, sparse.csr_array], sides: np.ndarray, pairs: Pairs
) -> np.ndarray:
    """Return R of all bodies by sides of ports as tables, (2, n)."""
    tables, ports_of, shared = np.zeros((2, pairs.size)), dict[int, np.ndarray](), dict[int, np.ndarray]()
    for body_id, body in enumerate(bodies):
        R = body.modal.residual_flexibility
        if R is not None and body.name in weights:
            port_weights = weights[body.name]
            ports_of[body_id] = np.unique(port_weights.indices)
            V_T = port_weights[:, ports_of[body_id]].T.tocsr()
            matrix = V_T @ (V_T @ R).T  # R is symmetric.
            shared[body_id] = 0.5 * (matrix + matrix.T)
    for ports, columns, values in pairs.blocks(tables):
        for body_id in {int(s) for s in sides[ports.start] if s in ports_of}:
            rows, (_, positions, columns_of) = (
                np.searchsorted(ports_of[body_id], ports), np.intersect1d(columns, ports_of[body_id], True, True)
            )  # fmt: skip
            on_body = np.isin(ports, ports_of[body_id])
            for side in range(2):
                of_body = sides[columns[positions], side] == body_id
                entries = _entries(np.flatnonzero(on_body), positions[of_body])
                values[side][entries] += shared[body_id][_entries(rows[on_body], columns_of[of_body])]
    return tables


def _entries(rows: np.ndarray, columns: np.ndarray) -> tuple[slice | np.ndarray, ...]:
    """Return an index of some rows and columns of a matrix, of slices where they follow each other."""
    both = [slice(int(a[0]), int(a[-1]) + 1) if len(a) and (np.diff(a) == 1).all() else a for a in (rows, columns)]
    return tuple(both) if any(isinstance(index, slice) for index in both) else np.ix_(rows, columns)


def _weights(blocks: Sequence[PortBlock], spans: Sequence[slice], body: FlexibleBody) -> sparse.csr_array | None:
    """Return V of a body, (C, p); None where no residual flexibility takes part."""
    if body.modal.residual_flexibility is None:
        return None
    rows, columns, values = [np.empty(0, np.int64)], [np.empty(0, np.int64)], [np.empty(0)]
    for block, span in zip(blocks, spans, strict=True):
        for side in block.sides:
            if side.body is body and side.flexible:
                rows.append(side.index.ravel())
                columns.append(np.repeat(np.arange(span.start, span.stop), side.index.shape[1]))
                values.append(side.weight.ravel())
    shape = len(body.modal.residual_flexibility), spans[-1].stop if spans else 0
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return sparse.csr_array(entries, shape=shape)
