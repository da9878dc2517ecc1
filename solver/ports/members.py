"""The ports that the members of a scene have on its bodies: contacts, joints, loads, drives, springs."""

from collections.abc import Iterator
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np
from scipy import sparse

from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.contact.blocks import full
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.contact.shares import padded
from gudgeon.solver.methods import METHODS
from gudgeon.solver.ports.listing import contact_kind
from gudgeon.solver.ports.table import Kind, PortBlock, Ports, Side, gathered
from gudgeon.solver.system.reactions import MOMENTUM, spring_rows
from gudgeon.solver.system.springs import End
from gudgeon.solver.system.system import System
from gudgeon.solver.vectors import unit


def ports_of(system: System) -> Ports:
    """Return the table of a system's ports: contacts, joints, loads, drives, springs, and surfaces slid over.

    It is kept with the system, whose runs by several steps share it.
    """
    if (ports := _KEPT.get(system)) is None:
        ports = _KEPT[system] = _gathered(system)
    return ports


_KEPT: WeakKeyDictionary[System, Ports] = WeakKeyDictionary()


def _gathered(system: System) -> Ports:
    blocks = [*_contacts(system), *_joints(system), *_given(system), *_drives(system), *_springs(system)]
    blocks += _surfaces(system)
    return gathered(blocks, list(system.bodies.values()), len(system.velocity))


def surface_weights(system: System, ports: Ports, position: np.ndarray) -> np.ndarray | None:
    """Return the weights by which points that slide at a position, (m,), move with functions; None without any, (p, p).

    They are those of one port in itself too: the transposed matrix spreads forces on points over the functions.
    """
    moving = [contact for contact in system.contacts if contact.master is not None]
    if not moving:
        return None
    weight = np.eye(len(ports.offset))
    for contact in moving:
        surface = contact.master
        assert surface is not None
        numbers, values, beside = surface.weights(system.slid(contact, position))
        normals = contact_ports(ports, contact)
        for axis, functions in enumerate(function_ports(ports, contact)):
            for normal, functions_of, value in zip(normals[~beside], numbers[~beside], values[~beside], strict=True):
                weight[normal + axis, functions[functions_of.ravel()]] = value.ravel()
    return weight


def with_surfaces(system: System, ports: Ports, position: np.ndarray) -> Ports:
    """Return the table with rows of points that slide as they are at a position, (m,): with those of functions."""
    if (weight := surface_weights(system, ports, position)) is None:
        return ports
    V, U = (s.dense() for s in ports.by_sides)
    U = U + V @ (weight - np.eye(len(weight))).T
    return replace(
        ports, rows=full(weight @ ports.rows), flexibility=ports.pairs.held(np.stack([weight @ V, weight @ U])),
        weights={name: sparse.csr_array(w @ weight.T) for name, w in ports.weights.items()},
    )  # fmt: skip


def tangents(normals: np.ndarray, line: np.ndarray | None = None) -> np.ndarray:
    """Return two unit vectors across each normal, right-handed with it, (c, 2, 3).

    Args:
        normals: Unit vectors, (c, 3).
        line: Direction of the first, made orthogonal to the normals; default: the axis farthest from each normal.
    """
    axes = np.eye(3)[np.abs(normals).argmin(axis=1)] if line is None else np.broadcast_to(unit(line), normals.shape)
    s = axes - np.einsum("ci,ci->c", axes, normals)[:, None] * normals
    s = s / np.linalg.norm(s, axis=1, keepdims=True)
    return np.stack([s, np.cross(normals, s)], axis=1)


def _contacts(system: System) -> Iterator[PortBlock]:
    for contact in system.contacts:
        settings = system.scene.contact[contact.name]
        kind = contact_kind(settings)
        directions = contact.directions[:, None, :]
        if settings.friction is not None:
            line = settings.friction.direction if contact.master is None else tuple(contact.master.direction)
            across = tangents(contact.directions, None if line is None else np.asarray(line, float))
            directions = np.concatenate([directions, across], axis=1)
        each = directions.shape[1]
        offset = np.zeros((len(contact.points), each))
        offset[:, 0] = system.gap[contact.rows]
        flexible = METHODS[settings.method].flexible
        sides = tuple(
            _contact_side(system.bodies[side[0]], side[1:4], side[4] * directions, flexible=flexible)
            for side in contact.sides
        )
        if contact.master is not None:
            sides += (_nothing_of(system.bodies[contact.master.body], offset.size),)
        yield PortBlock(f"contact.{contact.name}", kind, sides, offset.ravel(), directions.reshape(-1, 3))


def _nothing_of(body: FlexibleBody, count: int) -> Side:
    """Return a side without rows: the body is moved through other ports."""
    return Side(body, np.zeros((count, body.rigid_count)), np.empty((count, 0), np.int64), np.empty((count, 0)))


def _surfaces(system: System) -> Iterator[PortBlock]:
    """Yield the functions of traction spaces over which points slide; their displacement is inward.

    With friction each line of functions across has three rows of ports: along the normal, then along both tangents.
    """
    for contact in system.contacts:
        if (surface := contact.master) is None:
            continue
        body, spans = system.bodies[surface.body], system.bodies[surface.body].modal.tangential_spans
        flexible, columns = METHODS[system.scene.contact[contact.name].method].flexible, surface.counts[0]
        wrenches, rows = surface.resultant[:, None], surface.order[:, None]
        if surface.tangential is not None:
            wrenches = np.concatenate([wrenches, surface.tangential], axis=1)
        each, index = wrenches.shape[1], np.empty((wrenches[..., 0].size, 0), np.int64)
        if surface.interface in body.modal.interface_rows:
            rows = rows + body.modal.interface_rows[surface.interface][0]
            if each > 1:
                across = spans[surface.interface][0] + 2 * surface.order[:, None] + np.arange(2)
                rows = np.concatenate([rows, across], axis=1)
            index = rows.reshape(-1, columns, each).transpose(0, 2, 1).reshape(-1, 1)
        wrenches = wrenches.reshape(-1, columns, each, 6).transpose(0, 2, 1, 3).reshape(-1, 6)
        side = Side(body, -body.wrench_rows(wrenches), index, -np.ones(index.shape), flexible)
        yield PortBlock(f"surface.{contact.name}", Kind.SURFACE, (side,), np.zeros(len(index)))


def _contact_side(
    body: FlexibleBody, placement: tuple[str, sparse.csr_matrix, np.ndarray], directions: np.ndarray, *, flexible: bool
) -> Side:
    """Return the displacement of points along directions, (c, d, 3); at: interface, shares of its points, places."""
    (interface, weights, points), (count, each) = placement, directions.shape[:2]
    rigid = body.rigid_rows(np.repeat(points, each, axis=0), directions.reshape(-1, 3))
    if body.modal.residual_flexibility is None and not len(body.modal.angular_frequencies):
        return Side(body, rigid, np.empty((count * each, 0), np.int64), np.empty((count * each, 0)), flexible)
    start, _ = body.modal.interface_rows[interface]
    # The normal row acts along the outward normal, also where that of a curved obstacle differs slightly; of points
    # that are pressed at a slant, along the obstacle's.
    numbers, amounts = padded(weights)
    normals = body.modal.interfaces[interface].normals[numbers]
    sense = np.sign(np.einsum("ci,cni->cn", directions[:, 0], normals))
    if each == 1:
        return Side(body, rigid, start + numbers, amounts * sense, flexible)
    index = body.contact_places(interface).reshape(-1, 3)[numbers]
    weight = np.einsum("cdi,cnai->cdna", directions, body.contact_frame(interface)[numbers])
    weight[:, 0] = sense[..., None] * np.array([1.0, 0.0, 0.0])
    weight *= amounts[:, None, :, None]
    k = index.shape[1] * 3
    return Side(body, rigid, np.repeat(index.reshape(count, k), each, axis=0), weight.reshape(-1, k), flexible)


def _joints(system: System) -> Iterator[PortBlock]:
    for point in system.driving.joints:
        body = system.bodies[point.joint.body]
        along, lateral = point.joint.axes
        mix = np.array([lateral, along])
        side = _load_side(body, point.joint.interface, body.wrench_rows(point.resultant), mix)
        yield PortBlock(f"joint.{point.name}", Kind.BILATERAL, (side,), point.anchor.copy())


def _given(system: System) -> Iterator[PortBlock]:
    for load, rows in system.driving.given_rows():
        body, count = system.bodies[load.body], rows.stop - rows.start
        side = _load_side(body, load.interface, body.wrench_rows(load.resultant), load.mix)
        yield PortBlock(f"force.{load.name}", Kind.GIVEN, (side,), np.zeros(count))


def _drives(system: System) -> Iterator[PortBlock]:
    for drive in system.driving.drives:
        body = system.bodies[drive.body]
        side = _load_side(body, drive.interface, body.wrench_rows(drive.resultant), drive.mix)
        yield PortBlock(f"motion.{drive.name}", Kind.DRIVEN, (side,), np.zeros(len(drive.mix)))


def _load_side(body: FlexibleBody, interface: str | None, rigid: np.ndarray, mix: np.ndarray) -> Side:
    """Return rows mixed from the rows of a load or of a traction space, (n, k)."""
    if interface is None or interface not in body.modal.interface_rows:
        return Side(body, rigid, np.empty((len(mix), 0), np.int64), np.empty((len(mix), 0)))
    start, _ = body.modal.interface_rows[interface]
    if mix.shape[0] == mix.shape[1] and np.array_equal(mix, np.eye(len(mix))):
        return Side(body, rigid, start + np.arange(len(mix))[:, None], np.ones((len(mix), 1)))
    return Side(body, rigid, np.tile(start + np.arange(mix.shape[1]), (len(mix), 1)), mix)


def _springs(system: System) -> Iterator[PortBlock]:
    springs = system.springs
    for name, ends in zip(system.scene.springs(), springs.ends, strict=True):
        sides = [_spring_side(system.bodies[end.body], end) for end in ends]
        yield PortBlock(f"force.{name}", Kind.SPRING, tuple(sides), springs.stretch[springs.of(name)])


def _spring_side(body: FlexibleBody, end: End) -> Side:
    if end.interface is None:
        return Side(body, end.rigid, np.empty((len(end.rigid), 0), np.int64), np.empty((len(end.rigid), 0)))
    return _load_side(body, end.interface, end.rigid, end.mix)


def start_unknowns(system: System, ports: Ports) -> np.ndarray:
    """Return the forces of all ports at the start [N], (p,); zero on functions, which take those of the points."""
    forces, driving = np.zeros(len(ports.offset)), system.driving
    for contact in system.contacts:
        normals = contact_ports(ports, contact)
        forces[normals] = system.start_forces[contact.rows]
        if system.scene.contact[contact.name].friction is not None:
            forces[normals + 1], forces[normals + 2] = system.start_friction[contact.rows].T
    names = [f"joint.{j.name}" for j in driving.joints] + [f"force.{j.name}" for j in driving.given]
    forces[ports.numbers(names + [f"motion.{d.name}" for d in driving.drives])] = system.loads
    forces[ports.numbers([f"force.{name}" for name in system.scene.springs()])] = system.start_pulls
    return forces


def probe_ports(system: System, ports: Ports) -> np.ndarray:
    """Return what the residual flexibility adds to each value of the probes per force of each port, (P, p)."""
    probes = system.probes
    per_force = np.zeros((len(probes.offset), len(ports.offset)))
    for name, span, readings in zip(probes.names, probes.places, probes.readings, strict=True):
        of = getattr(system.scene.probe[name], "of", "")
        if of.startswith("force.") and of.partition(".")[2] in system.springs.names:
            spring_ports = ports.of(of)
            per_force[span.start : span.start + spring_ports.stop - spring_ports.start] = ports.residual[spring_ports]
        if of.startswith("body."):
            for k, row in enumerate(spring_rows(of.partition(".")[2], system.springs)):
                port = ports.of(f"force.{system.springs.names[row]}").start
                port += row - system.springs.of(system.springs.names[row]).start
                per_force[span.start + MOMENTUM + k] = ports.residual[port]
        for sign, within, reading in readings:
            residual = system.bodies[reading.body].modal.residual_flexibility
            if residual is not None and reading.body in ports.weights:
                values = slice(span.start + within.start, span.start + within.stop)
                per_force[values] += sign * reading.mix @ residual[reading.index] @ ports.weights[reading.body]
    return per_force


def gauge_ports(system: System, ports: Ports) -> np.ndarray:
    """Return the quasi-static value of each gauge per force of each port, (G, p)."""
    blocks = [np.zeros((0, len(ports.offset)))]
    for name, body in system.bodies.items():
        for gauge in body.modal.gauges.values():
            read = name in ports.weights and gauge.residual.size > 0  # Not read of modes that contain the rows.
            blocks.append(
                gauge.residual @ ports.weights[name] if read else np.zeros((len(gauge.rows), len(blocks[0].T)))
            )
    return np.vstack(blocks)


def function_ports(ports: Ports, contact: ContactRows) -> np.ndarray:
    """Return the ports of the functions that a contact slides over, (1 or 3, F): along normals, and both tangents."""
    span, surface = ports.of(f"surface.{contact.name}"), contact.master
    assert surface is not None
    columns, lines = surface.counts
    return np.arange(span.start, span.stop).reshape(lines, -1, columns).transpose(1, 0, 2).reshape(-1, lines * columns)


def contact_ports(ports: Ports, contact: ContactRows) -> np.ndarray:
    """Return the number of the normal port of each row of a contact, (c,)."""
    span = ports.of(f"contact.{contact.name}")
    return np.arange(span.start, span.stop)[:: (span.stop - span.start) // len(contact.points)]
