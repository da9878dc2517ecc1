"""What does not change in a run of the loop over ports, built from a system."""

import numpy as np

from gudgeon.solver.integrators.flight import flight, memory_of
from gudgeon.solver.integrators.small.arrays import (
    POSITION,
    STABILISED,
    VELOCITY,
    Arrays,
    Constants,
    Loop,
)
from gudgeon.solver.integrators.small.bounds import body_parts, by_body, largest_flexibilities, largest_norms
from gudgeon.solver.integrators.small.edges import edges_of
from gudgeon.solver.integrators.small.fields import fields_of
from gudgeon.solver.integrators.small.rows import Residual, Rows
from gudgeon.solver.ports.members import contact_ports
from gudgeon.solver.ports.pairs import Pairs
from gudgeon.solver.ports.table import BLOCK, Kind, Ports, block_size
from gudgeon.solver.system.system import System

SLOWEST = 1e-6
"""Least approach speed of a contact, relative to the largest so far, in the loss of its law."""


def constants_of(system: System, ports: Ports, dt: float) -> Constants:
    step, p = flight(system.stiffness, system.damping, dt), len(ports.offset)
    per_port = _per_port(system, ports)
    level, joints = np.full(p, POSITION), np.full(p, -1)
    level[per_port["restitution"] >= 0] = VELOCITY
    lengths = np.zeros(p)
    beta = _delays(system, ports, per_port["delay"])
    moving = [contact.name for contact in system.contacts if contact.master is not None]
    jumps = _jumps(ports, beta, per_port["layer"], dt)
    for name in moving:
        jumps[ports.of(f"surface.{name}")] = jumps[ports.of(f"contact.{name}")].any()
    pairs = ports.pairs
    residual, memory = _residual(ports, beta, jumps, dt)
    flexible = _flexible(pairs, residual, memory[:, 2])
    softness = pairs.matrix(flexible).diagonal()
    for number, held in enumerate(system.driving.joints):
        here = ports.of(f"joint.{held.name}")
        joints[here.start], lengths[here.start] = number, held.joint.rod_length
        if not (softness[here] > 0).all():
            level[here] = STABILISED
    moved = [f"motion.{drive.name}" for drive in system.driving.drives]
    for here in map(ports.of, moved):
        if not (softness[here] > 0).all():
            level[here] = STABILISED
    block, size = _blocks(ports)
    rigid = level == VELOCITY
    inertia = _by_bodies(system, ports, (step.push[0], dt * step.push[1]), level)
    share = np.where(jumps, 1.0, _share(ports, level, per_port["layer"], np.where(rigid, 0.0, softness)))
    parts, near, norms = body_parts(system, ports)
    damped = bool(np.any(memory[:, :2]))
    layer, touching = per_port["layer"], (size > 0) & (per_port["contact"] >= 0)
    yields, columns = _measures(pairs, (flexible, inertia), layer, share, rigid)
    responds = (ports.kind != Kind.GIVEN) & (ports.kind != Kind.SURFACE)
    plain = not moving and _plain(ports, columns, responds, rigid)
    idles = _idles(system, ports, rigid)
    paired = _paired(system, ports, columns, responds, rigid)
    turned = _turned(pairs, residual, moving)
    return Constants(
        dt=np.array([dt]), motion=step.motion, push=step.push, loss=step.loss, stiffness=system.stiffness,
        gravity=system.driving.gravity, rows=_rows(system, ports), parts=parts, near=near,
        norms=norms, reach=largest_flexibilities(ports, block, damped=damped), offset=ports.offset,
        kind=ports.kind, size=size, block=block, level=level, share=share, met=_met(pairs, touching),
        groups=_met(pairs, np.ones(p, np.bool_)),
        pattern=pairs.pattern, inertia=inertia, columns=columns, yields=yields,
        residual=Residual(pairs.pattern, residual, turned), memory=memory, layer=layer,
        law=per_port["law"], knots=np.vstack([np.empty((0, 2)), *system.springs.knots.values()]),
        table=per_port["table"].astype(np.int64), friction=per_port["friction"], belt=per_port["belt"],
        restitution=per_port["restitution"], lengths=lengths, contact=per_port["contact"],
        direction=per_port["direction"], joint=joints, inverse=_inverses(ports, moved, columns),
        drives=ports.numbers(moved), given=np.flatnonzero(ports.kind == Kind.GIVEN),
        touching=np.flatnonzero(touching),
        always=np.flatnonzero((size > 0) & (per_port["contact"] < 0) & responds), joints=np.flatnonzero(joints >= 0),
        **fields_of(system), loaded=_loaded(system, ports), sides=ports.sides, bounces=bool(rigid.any()),
        farthest=np.where(responds, step.push[0].max(initial=0.0), 0.0), damped=damped,
        rigid=system.rigid, floor=SLOWEST, widest=largest_norms(parts, near, norms, touching),
        lossy=bool(system.damping.any()), idles=idles,
        sparse=bool(plain and idles and not damped and (share < 1).all()), divides=_divides(system, rigid, damped),
        edges=(edges := edges_of(system, ports)), edged=bool(len(edges.ports)), slides=bool(moving),
        plain=plain, paired=paired,
    )  # fmt: skip


def _plain(ports: Ports, columns: np.ndarray, responds: np.ndarray, rigid: np.ndarray) -> bool:
    """Return whether all ports that respond, (p,), are unilateral over a symmetric compliance, and none is rigid."""
    unilateral = (ports.kind[responds] == Kind.UNILATERAL).all() and not rigid.any()
    return bool(unilateral) and ports.pairs.mutual(columns, responds)


def _paired(system: System, ports: Ports, columns: np.ndarray, responds: np.ndarray, rigid: np.ndarray) -> bool:
    """Return whether all ports that respond, (p,), are unilateral, or of joints, and none is rigid or meets an edge.

    Functions of traction spaces are moved through each other alone, and forces move unilateral ports and functions
    both ways alike.
    """
    surface, unilateral = ports.kind == Kind.SURFACE, ports.kind == Kind.UNILATERAL
    if not surface.any() or rigid.any() or any(map(system.edged, system.contacts)):
        return False
    if not np.isin(ports.kind[responds], [Kind.UNILATERAL, Kind.BILATERAL]).all():
        return False
    by_functions = columns.reshape(len(surface), -1)[surface]
    return not by_functions[:, responds].any() and ports.pairs.mutual(columns, unilateral | surface)


def _turned(pairs: Pairs, residual: np.ndarray, moving: list[str]) -> np.ndarray:
    """Return the tables of R, (s, t), by rows of what acts, where contacts move over traction spaces, else none."""
    sides = residual if moving else residual[:0]
    return np.array([pairs.turned(side) for side in sides]).reshape(len(sides), pairs.size)


def _idles(system: System, ports: Ports, rigid: np.ndarray) -> bool:
    """Return whether nothing but contact over a compliance or by a law, on faces without edges, acts on bodies."""
    contact = np.isin(ports.kind, [Kind.UNILATERAL, Kind.CONE, Kind.LAW, Kind.RUBBING_LAW])
    return bool(contact.all()) and not rigid.any() and not any(map(system.edged, system.contacts))


def _divides(system: System, rigid: np.ndarray, damped: bool) -> bool:
    """Return whether steps are divided where rigid contact closes: the motion over a part of one is known."""
    driving, damps = system.driving, damped or system.damping.any()
    moves = driving.joints or driving.drives or any(contact.master is not None for contact in system.contacts)
    return bool(rigid.any() and not damps and not moves)


def loop_of(arrays: Arrays, system: System, ports: Ports) -> Loop:
    """Return arrays as the loop takes them; those for parts of steps, which the core sets, and for impacts, to which
    nothing that yields responds, are those of whole steps where steps are not divided, and are not read."""
    constants = arrays.constants
    if not constants.divides:
        return Loop(arrays, arrays, arrays)
    names = ("dt", "motion", "push", "inertia", "columns")
    part = constants._replace(**{name: getattr(constants, name).copy() for name in names})
    rigid, moves = constants.level == VELOCITY, np.ones(ports.rows.shape[1])
    columns = _by_bodies(system, ports, (moves, moves), constants.level)
    for own, to, values in ports.pairs.blocks(columns):
        values *= rigid[own.start : own.stop, None] & rigid[to]
    impact = constants._replace(dt=np.ones(1), columns=columns)
    return Loop(arrays, arrays._replace(constants=part), arrays._replace(constants=impact))


def _by_bodies(system: System, ports: Ports, factors: tuple[np.ndarray, np.ndarray], level: np.ndarray) -> np.ndarray:
    """Return the table of W diag(factor) Wᵀ: by how much forces move ports through coordinates, by the port's level.

    Args:
        factors: For displacements and for velocities, half of which add to what is stabilised, (m,) each.
        level: Of each port, (p,).
    """
    places = [body.coordinates for body in system.bodies.values()]
    rows = [ports.rows.over(at) for at in places]

    def block(own: range, to: np.ndarray) -> np.ndarray:
        moved_by_forces = np.zeros((len(own), len(to)))
        for number in {int(one) for one in ports.sides[own.start] if one >= 0}:
            near = np.flatnonzero((ports.sides[to] == number).any(axis=1))
            moved, placed, faster = rows[number].among(to[near]), level[to[near]], factors[1][places[number]]
            pushes = np.where((placed == VELOCITY)[:, None], faster, factors[0][places[number]])
            pushes = pushes + np.where((placed == STABILISED)[:, None], 0.5 * faster, 0.0)
            products = rows[number].among(np.arange(own.start, own.stop)) @ (moved * pushes).T
            if len(near) == len(to):
                moved_by_forces += products
            else:
                moved_by_forces[:, near] += products
        return moved_by_forces

    return ports.pairs.made(block)


def _flexible(pairs: Pairs, residual: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return the table of the displacement of ports by forces that begin in a step [m/N], by rows of what acts.

    Args:
        residual: By rows of what is moved, by sides, (s, t).
        end: Share of a force at the end of a step that its flexibility has by then, (s, p).
    """
    flexible = np.zeros(pairs.size)
    for side, share in zip(residual, end, strict=True):
        for own, _, values in pairs.blocks(turned := pairs.turned(side)):
            values *= share[own.start : own.stop, None]
        flexible += turned
    return flexible


def _blocks(ports: Ports) -> tuple[np.ndarray, np.ndarray]:
    """Return `block` and `size` of `Constants`."""
    block, size = np.zeros((2, len(ports.offset)), np.int64)
    for item, here in zip(ports.blocks, ports.places, strict=True):
        each = block_size(item)
        first_ports = np.arange(here.start, here.stop, each)
        size[first_ports] = each
        block[here] = np.repeat(first_ports, each)
    return block, size


def _measures(
    pairs: Pairs, tables: tuple[np.ndarray, np.ndarray], layer: np.ndarray, share: np.ndarray, rigid: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the tables `yields` and `columns` of `Constants`.

    Args:
        tables: By the residual flexibility, and by coordinates, (t,) each.
        rigid: Ports of rigid contact, (p,).
    """
    yields, columns = np.zeros(pairs.size), np.zeros(pairs.size)
    blocks = (pairs.blocks(one) for one in (*tables, yields, columns))
    for (own, to, given), (*_, pushed), (*_, out), (*_, whole) in zip(*blocks, strict=True):
        here = slice(own.start, own.stop)
        out[:] = np.where(rigid[to], 0.0, given) + layer[here, None] * (to == np.arange(own.start, own.stop)[:, None])
        whole[:] = share[here, None] * pushed + out
    return yields, columns


def _met(pairs: Pairs, touching: np.ndarray) -> np.ndarray:
    """Return first and last + 1 port of the groups with contacts, (c, 2)."""
    ends = [[own.start, own.stop] for own in pairs.groups if touching[own.start : own.stop].any()]
    return np.array(ends, np.int64).reshape(-1, 2)


def _per_port(system: System, ports: Ports) -> dict[str, np.ndarray]:
    """Return what contacts and springs give to each of their ports."""
    p = len(ports.offset)
    arrays = {name: np.zeros((p, *shape)) for name, shape in _PER_PORT.items()}
    arrays["restitution"][:], contact = -1.0, np.full(p, -1)
    for number, item in enumerate(system.contacts):
        here = ports.of(f"contact.{item.name}")
        contact[here] = number
        normals = contact_ports(ports, item)
        each = (here.stop - here.start) // len(normals)
        rigid = system.rigid_contact[item.rows]
        for b in range(each):
            arrays["restitution"][normals + b] = np.where(rigid, system.restitution[item.rows], -1.0)
        arrays["friction"][normals] = system.friction[item.rows]
        arrays["direction"][here] = ports.blocks[number].directions
        if ports.kind[here.start] in (Kind.LAW, Kind.RUBBING_LAW):
            arrays["law"][normals] = system.law[item.rows]
        else:
            arrays["layer"][normals] = system.layer[item.rows]
            compliance = system.residual.diagonal()[item.rows] + system.layer[item.rows]
            arrays["delay"][normals] = system.dashpot[item.rows] * compliance
        if each > 1:
            settings = system.scene.contact[item.name]
            velocity = np.asarray(getattr(settings.against, "velocity", (0.0, 0.0, 0.0)), float)
            for b in range(1, each):
                arrays["belt"][normals + b] = arrays["direction"][normals + b] @ velocity
    springs, first = system.springs, 0
    for name in system.scene.springs():
        here, rows = ports.of(f"force.{name}"), springs.of(name)
        arrays["law"][here, 0], arrays["law"][here, 1] = springs.stiffness[rows], springs.damping[rows]
        if (knots := springs.knots.get(rows.start)) is not None:
            arrays["table"][here] = first, first + len(knots)
            first += len(knots)
    return arrays | {"contact": contact}


_PER_PORT: dict[str, tuple[int, ...]] = {
    "layer": (), "delay": (), "law": (4,), "table": (2,), "friction": (2,), "belt": (), "restitution": (),
    "direction": (3,),
}  # fmt: skip


def _delays(system: System, ports: Ports, delay: np.ndarray) -> np.ndarray:
    """Return β of r + β ṙ = f on each side of each port [s], (2, p).

    Args:
        delay: Of the dashpots beside the compliance of ports [s], (p,).
    """
    p, bodies = len(ports.offset), list(system.bodies.values())
    beta = np.array([[bodies[b].stiffness_factor if b >= 0 else 0.0 for b in pair] for pair in ports.sides])
    beta = np.maximum(beta.reshape(p, 2).T, delay)
    beta[1] = np.where(ports.sides[:, 1] >= 0, beta[1], beta[0])
    return beta


def _jumps(ports: Ports, beta: np.ndarray, layer: np.ndarray, dt: float) -> np.ndarray:
    """Return which contact ports have a force that jumps when they close, since a dashpot alone resists, (p,).

    It does not where one of two bodies yields without a dashpot.
    """
    jumps = np.zeros(len(layer), np.bool_)
    yields: np.ndarray = np.array([one.diagonal() > 0 for one in ports.by_sides])
    for item, here in zip(ports.blocks, ports.places, strict=True):
        if item.kind == Kind.SURFACE:
            yields[1, ports.of(f"contact.{item.name.partition('.')[2]}")] |= yields[0, here].any()
    slow = beta > 0.5 * dt
    alone = (yields & slow).any(axis=0) & ~(yields & ~slow).any(axis=0)
    for item, here in zip(ports.blocks, ports.places, strict=True):
        if item.kind in (Kind.UNILATERAL, Kind.CONE):
            each = BLOCK.get(item.kind, 1)
            first_ports = np.arange(here.start, here.stop, each)
            jumps[here] = np.repeat(np.take(alone, first_ports) & (layer[first_ports] == 0), each)
    return jumps


def _residual(ports: Ports, beta: np.ndarray, jumps: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Return tables of R by sides of ports [m/N], (s, t), and the memory of r there, (s, 3, p); one side if both agree.

    Args:
        beta: [s], (2, p).
        jumps: Ports whose force is constant in a step, (p,).
    """
    p = len(ports.offset)
    if not ports.flexibility.any():
        return np.zeros((0, ports.pairs.size)), np.zeros((0, 3, p))
    memory = np.stack([memory_of(own, dt) for own in beta])
    for i in np.flatnonzero(jumps):
        memory[:, 2, i] += memory[:, 1, i]
        memory[:, 1, i] = 0.0
    if np.array_equal(beta[0], beta[1]):
        return ports.flexibility.sum(axis=0)[None], memory[:1]
    return ports.flexibility, memory


def _share(ports: Ports, level: np.ndarray, layer: np.ndarray, softness: np.ndarray) -> np.ndarray:
    """Return κ of each port: ½ where the trapezoidal rule holds, which needs a compliance of its own, (p,)."""
    share = np.ones(len(level))
    own = softness + layer > 0
    for item, here in zip(ports.blocks, ports.places, strict=True):
        if item.kind == Kind.GIVEN:
            share[here] = 0.5
            continue
        each = block_size(item)
        first_ports = np.arange(here.start, here.stop, each)
        averaged = own[first_ports] & (level[first_ports] == POSITION)
        share[here] = np.where(np.repeat(averaged, each), 0.5, 1.0)
    for item, here in zip(ports.blocks, ports.places, strict=True):
        if item.kind == Kind.SURFACE:
            points = ports.of(f"contact.{item.name.partition('.')[2]}")
            share[points] = share[here] = 0.5 if own[points].any() or own[here].any() else 1.0
    return share


def _inverses(ports: Ports, moved: list[str], columns: np.ndarray) -> np.ndarray:
    """Return the inverse of each drive's block of the measures per unknown, in the rows of its ports, (p, n).

    Args:
        columns: Measures by unknowns, a table by rows of what acts.
    """
    places = [ports.of(name) for name in moved]
    inverses = np.zeros((len(ports.offset), max((here.stop - here.start for here in places), default=0)))
    for here in places:
        own = np.arange(here.start, here.stop)
        inverses[here, : len(own)] = np.linalg.inv(ports.pairs.matrix(columns).among(own, own).T)
    return inverses


def _rows(system: System, ports: Ports) -> Rows:
    """Return W by the bodies of each port; two bodies whose coordinates follow each other are one part of a row."""
    p = len(ports.offset)
    first, last, at = (np.zeros((p, 2), np.int64) for _ in range(3))
    size = np.zeros(p, np.int64)
    for _, numbers, _, rows in by_body(system, ports):
        size[numbers] += rows.shape[1]
    begin, values = np.cumsum(size) - size, np.zeros(size.sum())
    used = begin.copy()
    for body, numbers, _, rows in by_body(system, ports):
        start, stop = body.coordinates.start, body.coordinates.stop
        values[used[numbers, None] + np.arange(stop - start)] = rows
        second = used[numbers] > begin[numbers]
        follows = second & (last[numbers, 0] == start)
        last[numbers[follows], 0] = stop
        apart, side = numbers[~follows], second[~follows].astype(int)
        first[apart, side], last[apart, side], at[apart, side] = start, stop, used[apart]
        used[numbers] += stop - start
    return Rows(first, last, at, values)


def _loaded(system: System, ports: Ports) -> np.ndarray:
    """Return the ports of joints, given loads and drives."""
    driving = system.driving
    names = [f"joint.{held.name}" for held in driving.joints] + [f"force.{load.name}" for load in driving.given]
    return ports.numbers(names + [f"motion.{drive.name}" for drive in driving.drives])
