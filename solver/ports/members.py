"""The ports that the members of a scene have on its bodies: contacts, joints, loads, drives, springs."""

from collections.abc import Iterator
from dataclasses import replace

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
    """Return the table of a system's ports: contacts, joints, loads, drives, springs, and surfaces slid over."""
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
        over = contact.master
        assert over is not None
        numbers, values, beside = over.weights(system.slid(contact, position))
        normals = contact_ports(ports, contact)
        for axis, functions in enumerate(function_ports(ports, contact)):
            for normal, number, value in zip(normals[~beside], numbers[~beside], values[~beside], strict=True):
                weight[normal + axis, functions[number.ravel()]] = value.ravel()
    return weight


def with_surfaces(system: System, ports: Ports, position: np.ndarray) -> Ports:
    """Return the table with rows of points that slide as they are at a position, (m,): with those of functions."""
    if (weight := surface_weights(system, ports, position)) is None:
        return ports
    own, other = (one.dense() for one in ports.by_sides)
    other = other + own @ (weight - np.eye(len(weight))).T
    return replace(
        ports, rows=full(weight @ ports.rows), flexibility=ports.pairs.held(np.stack([weight @ own, weight @ other])),
        weights={name: sparse.csr_array(found @ weight.T) for name, found in ports.weights.items()},
    )  # fmt: skip


def tangents(normals: np.ndarray, line: np.ndarray | None = None) -> np.ndarray:
    """Return two unit vectors across each normal, right-handed with it, (c, 2, 3).

    Args:
        normals: Unit vectors, (c, 3).
        line: Direction of the first, made orthogonal to the normals; default: the axis farthest from each normal.
    """
    axes = np.eye(3)[np.abs(normals).argmin(axis=1)] if line is None else np.broadcast_to(unit(line), normals.shape)
    first = axes - np.einsum("ci,ci->c", axes, normals)[:, None] * normals
    first = first / np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normals, first)], axis=1)


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
        if (over := contact.master) is None:
            continue
        body, spans = system.bodies[over.body], system.bodies[over.body].modal.tangential_spans
        flexible, columns = METHODS[system.scene.contact[contact.name].method].flexible, over.counts[0]
        wrenches, rows = over.resultant[:, None], over.order[:, None]
        if over.tangential is not None:
            wrenches = np.concatenate([wrenches, over.tangential], axis=1)
        each, index = wrenches.shape[1], np.empty((wrenches[..., 0].size, 0), np.int64)
        if over.interface in body.modal.interface_rows:
            rows = rows + body.modal.interface_rows[over.interface][0]
            if each > 1:
                across = spans[over.interface][0] + 2 * over.order[:, None] + np.arange(2)
                rows = np.concatenate([rows, across], axis=1)
            index = rows.reshape(-1, columns, each).transpose(0, 2, 1).reshape(-1, 1)
        wrenches = wrenches.reshape(-1, columns, each, 6).transpose(0, 2, 1, 3).reshape(-1, 6)
        side = Side(body, -body.wrench_rows(wrenches), index, -np.ones(index.shape), flexible)
        yield PortBlock(f"surface.{contact.name}", Kind.SURFACE, (side,), np.zeros(len(index)))


def _contact_side(
    body: FlexibleBody, at: tuple[str, sparse.csr_matrix, np.ndarray], directions: np.ndarray, *, flexible: bool
) -> Side:
    """Return the displacement of points along directions, (c, d, 3); at: interface, shares of its points, places."""
    (interface, share, places), (count, each) = at, directions.shape[:2]
    rigid = body.rigid_rows(np.repeat(places, each, axis=0), directions.reshape(-1, 3))
    if body.modal.residual_flexibility is None and not len(body.modal.angular_frequencies):
        return Side(body, rigid, np.empty((count * each, 0), np.int64), np.empty((count * each, 0)), flexible)
    first, _ = body.modal.interface_rows[interface]
    # The normal row acts along the outward normal, also where that of a curved obstacle differs slightly; of points
    # that are pressed at a slant, along the obstacle's.
    numbers, amounts = padded(share)
    normals = body.modal.interfaces[interface].normals[numbers]
    sense = np.sign(np.einsum("ci,cni->cn", directions[:, 0], normals))
    if each == 1:
        return Side(body, rigid, first + numbers, amounts * sense, flexible)
    index = body.contact_places(interface).reshape(-1, 3)[numbers]
    weight = np.einsum("cdi,cnai->cdna", directions, body.contact_frame(interface)[numbers])
    weight[:, 0] = sense[..., None] * np.array([1.0, 0.0, 0.0])
    weight *= amounts[:, None, :, None]
    k = index.shape[1] * 3
    return Side(body, rigid, np.repeat(index.reshape(count, k), each, axis=0), weight.reshape(-1, k), flexible)


def _joints(system: System) -> Iterator[PortBlock]:
    for held in system.driving.joints:
        body = system.bodies[held.joint.body]
        along, lateral = held.joint.axes
        mix = np.array([lateral, along])
        side = _load_side(body, held.joint.interface, body.wrench_rows(held.resultant), mix)
        yield PortBlock(f"joint.{held.name}", Kind.BILATERAL, (side,), held.anchor.copy())


def _given(system: System) -> Iterator[PortBlock]:
    for load, at in system.driving.given_rows():
        body, count = system.bodies[load.body], at.stop - at.start
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
    first, _ = body.modal.interface_rows[interface]
    if mix.shape[0] == mix.shape[1] and np.array_equal(mix, np.eye(len(mix))):
        return Side(body, rigid, first + np.arange(len(mix))[:, None], np.ones((len(mix), 1)))
    return Side(body, rigid, np.tile(first + np.arange(mix.shape[1]), (len(mix), 1)), mix)


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
    found, driving = np.zeros(len(ports.offset)), system.driving
    for contact in system.contacts:
        normals = contact_ports(ports, contact)
        found[normals] = system.start_forces[contact.rows]
        if system.scene.contact[contact.name].friction is not None:
            found[normals + 1], found[normals + 2] = system.start_friction[contact.rows].T
    names = [f"joint.{one.name}" for one in driving.joints] + [f"force.{one.name}" for one in driving.given]
    found[ports.numbers(names + [f"motion.{one.name}" for one in driving.drives])] = system.loads
    found[ports.numbers([f"force.{name}" for name in system.scene.springs()])] = system.start_pulls
    return found


def probe_ports(system: System, ports: Ports) -> np.ndarray:
    """Return what the residual flexibility adds to each value of the probes per force of each port, (P, p)."""
    probes = system.probes
    found = np.zeros((len(probes.offset), len(ports.offset)))
    for name, here, parts in zip(probes.names, probes.places, probes.readings, strict=True):
        of = getattr(system.scene.probe[name], "of", "")
        if of.startswith("force.") and of.partition(".")[2] in system.springs.names:
            own = ports.of(of)
            found[here.start : here.start + own.stop - own.start] = ports.residual[own]
        if of.startswith("body."):
            for number, row in enumerate(spring_rows(of.partition(".")[2], system.springs)):
                port = ports.of(f"force.{system.springs.names[row]}").start
                port += row - system.springs.of(system.springs.names[row]).start
                found[here.start + MOMENTUM + number] = ports.residual[port]
        for sign, _, one in parts:
            residual = system.bodies[one.body].modal.residual_flexibility
            if residual is not None and one.body in ports.weights:
                found[here] += sign * one.mix @ residual[one.index] @ ports.weights[one.body]
    return found


def gauge_ports(system: System, ports: Ports) -> np.ndarray:
    """Return the quasi-static value of each gauge per force of each port, (G, p)."""
    parts = [np.zeros((0, len(ports.offset)))]
    for name, body in system.bodies.items():
        for gauge in body.modal.gauges.values():
            known = name in ports.weights and gauge.residual.size > 0  # Not read of modes that contain the rows.
            parts.append(
                gauge.residual @ ports.weights[name] if known else np.zeros((len(gauge.rows), len(parts[0].T)))
            )
    return np.vstack(parts)


def function_ports(ports: Ports, contact: ContactRows) -> np.ndarray:
    """Return the ports of the functions that a contact slides over, (1 or 3, F): along normals, and both tangents."""
    here, over = ports.of(f"surface.{contact.name}"), contact.master
    assert over is not None
    columns, lines = over.counts
    return np.arange(here.start, here.stop).reshape(lines, -1, columns).transpose(1, 0, 2).reshape(-1, lines * columns)


def contact_ports(ports: Ports, contact: ContactRows) -> np.ndarray:
    """Return the number of the normal port of each row of a contact, (c,)."""
    here = ports.of(f"contact.{contact.name}")
    return np.arange(here.start, here.stop)[:: (here.stop - here.start) // len(contact.points)]
