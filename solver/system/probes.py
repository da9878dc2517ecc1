"""Compiled probes: rows of what they read over coordinates, rates and contact forces."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gudgeon.solver.bodies.placing import own_vectors, turned_vectors
from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.contact.shares import shared_columns
from gudgeon.solver.errors import SceneError
from gudgeon.solver.scene.probe import DistanceProbe, ForceProbe, PointProbe
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.system.reactions import reaction_rows
from gudgeon.solver.system.springs import Springs
from gudgeon.solver.vectors import unit

UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2", "rotation": "rad"}
AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Reading:
    """What one end of a probe reads of a body: k values."""

    body: str
    rigid: np.ndarray
    """Value per rigid coordinate, (k, r)."""
    elastic: np.ndarray
    """Value per elastic coordinate, (k, m)."""
    index: np.ndarray
    """Rows of the body's residual flexibility, (n,)."""
    mix: np.ndarray
    """Value per displacement of these rows, (k, n)."""
    columns: tuple[str, ...]
    place: np.ndarray
    """Where it reads, as the scene places the body [m], (3,)."""
    snapped: float
    """Distance of that place from the one asked for [m]."""


@dataclass(frozen=True)
class Probes:
    """All probes of a scene with P values at a sample."""

    names: list[str]
    places: list[slice]
    """Values of each probe."""
    rows: np.ndarray
    """Value per coordinate, (P, m)."""
    rates: np.ndarray
    """Value per rate of a coordinate, (P, m)."""
    pressed: np.ndarray
    """Value per contact force, (P, c)."""
    offset: np.ndarray
    """(P,)"""
    readings: list[tuple[tuple[float, slice, Reading], ...]]
    """Of each probe, sign, values and reading of what takes part by displacements, for the residual flexibility."""
    columns: list[tuple[str, ...]]
    snapped: list[float]

    def values(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return what coordinates and rates contribute, (t, P), of states (t, m)."""
        return self.offset + q @ self.rows.T + v @ self.rates.T


def compile_probes(
    scene: Scene, bodies: Mapping[str, FlexibleBody], contacts: list[ContactRows], springs: Springs, size: int
) -> Probes:
    """Build the probes of a scene.

    Raises:
        SceneError: a probe names what does not exist or cannot be read.
    """
    count = sum(len(contact.points) for contact in contacts)
    blocks = [_block(scene, name, bodies, contacts, springs, (size, count)) for name in scene.probe]
    ends = np.cumsum([0, *(len(block.offset) for block in blocks)])
    spans = [slice(int(a), int(b)) for a, b in pairwise(ends)]
    return Probes(
        names=list(scene.probe), places=spans,
        rows=np.vstack([np.empty((0, size)), *(block.rows for block in blocks)]),
        rates=np.vstack([np.empty((0, size)), *(block.rates for block in blocks)]),
        pressed=np.vstack([np.empty((0, count)), *(block.pressed for block in blocks)]),
        offset=np.concatenate([np.empty(0), *(block.offset for block in blocks)]),
        readings=[block.readings[0] for block in blocks], columns=[block.columns[0] for block in blocks],
        snapped=[block.snapped[0] for block in blocks],
    )  # fmt: skip


def _block(
    scene: Scene,
    name: str,
    bodies: Mapping[str, FlexibleBody],
    contacts: list[ContactRows],
    springs: Springs,
    shape: tuple[int, int],
) -> Probes:
    """Return one probe; shape: numbers of coordinates and contact rows."""
    probe = scene.probe[name]
    if isinstance(probe, ForceProbe):
        return _force_block(scene, name, bodies, (contacts, springs), shape)
    readings = [(1.0, _reading(scene, f"probe.{name}", probe, bodies))]
    if isinstance(probe, DistanceProbe):
        partner = PointProbe(kind="displacement", body=probe.against, interface=probe.against_interface,
                           at=probe.against_at)  # fmt: skip
        readings.append((-1.0, _reading(scene, f"probe.{name}", partner, bodies, "against_")))
    k = len(readings[0][1].mix)
    rows, per_force = np.zeros((k, shape[0])), np.zeros((k, shape[1]))
    for sign, reading in readings:
        body = bodies[reading.body]
        if len(reading.mix) != k:
            raise SceneError(
                f"probe.{name}: one of its ends is a contact point, which is read along its normal alone; a distance"
                " needs interfaces of kind 'mean' or 'tie', or rigid bodies"
            )
        rows[:, body.rigid] += sign * reading.rigid
        rows[:, body.elastic] += sign * reading.elastic
        _add_pressed(per_force, sign, reading, body, contacts)
    offset = readings[0][1].place - readings[1][1].place if len(readings) > 1 else np.zeros(k)
    terms = tuple((sign, slice(0, k), reading) for sign, reading in readings)
    columns, snapped = [readings[0][1].columns], [max(r.snapped for _, r in readings)]
    still, span = np.zeros_like(rows), slice(0, k)
    if probe.kind in ("velocity", "acceleration"):
        # The rates of the coordinates, then the displacement that R adds: its rate is that of its samples.
        rows, still, per_force = still, rows, np.vstack([0 * per_force, per_force])
        rows, still, span = np.vstack([rows, rows]), np.vstack([still, 0 * still]), slice(0, 2 * k)
        terms, offset = tuple((sign, slice(k, 2 * k), reading) for sign, reading in readings), np.zeros(2 * k)
    return Probes(
        [name], [span], rows, still, pressed=per_force, offset=offset, readings=[terms], columns=columns,
        snapped=snapped,
    )  # fmt: skip


def _add_pressed(
    per_force: np.ndarray, sign: float, reading: Reading, body: FlexibleBody, contacts: list[ContactRows]
) -> None:
    """Add the displacements of a reading by contact forces on the body's residual flexibility [m/N], (k, c)."""
    R = body.modal.residual_flexibility
    if R is None or not len(reading.index):
        return
    for contact in contacts:
        for owner, interface, point_weights, *_ in contact.sides:
            if owner == reading.body:
                block = shared_columns(point_weights, R[reading.index, slice(*body.modal.interface_rows[interface])])
                # A contact force acts against the outward normal, R's rows along it.
                per_force[:, contact.rows] -= sign * reading.mix @ block


def _force_block(
    scene: Scene,
    name: str,
    bodies: Mapping[str, FlexibleBody],
    members: tuple[list[ContactRows], Springs],
    shape: tuple[int, int],
) -> Probes:
    """Return the values from which a force follows: elongations and rates, moments of contact forces, or a momentum."""
    probe = scene.probe[name]
    assert isinstance(probe, ForceProbe)
    kind, _, owner = probe.of.partition(".")
    contacts, springs = members
    rows = rates = np.zeros((0, shape[0]))
    per_force, offset, readings = np.zeros((0, shape[1])), np.zeros(0), ()
    if kind == "force" and owner in springs.names:
        span = springs.of(owner)
        W = springs.rows[span]
        rows, rates = np.vstack([W, 0 * W]), np.vstack([0 * W, W])
        per_force, offset = np.zeros((len(rows), shape[1])), np.append(springs.stretch[span], np.zeros(len(W)))
    elif kind == "body":
        rows, rates, offset = reaction_rows(f"probe.{name}.of", bodies[owner], springs, shape[0])
        per_force = np.zeros((len(rows), shape[1]))
    elif kind == "contact":
        contact = next(c for c in contacts if c.name == owner)
        per_force = np.zeros((4, shape[1]))
        points = own_vectors(scene.body[contact.body], contact.points)
        per_force[0, contact.rows], per_force[1:, contact.rows] = 1.0, points.T
        rows, rates, offset = np.zeros((4, shape[0])), np.zeros((4, shape[0])), np.zeros(4)
    return Probes(
        [name], [slice(len(offset))], rows, rates, pressed=per_force, offset=offset, readings=[readings],
        columns=[AXES], snapped=[0.0],
    )  # fmt: skip


def _reading(
    scene: Scene,
    scene_key: str,
    probe: PointProbe | DistanceProbe,
    bodies: Mapping[str, FlexibleBody],
    prefix: str = "",
) -> Reading:
    body, turns = bodies[probe.body], probe.kind == "rotation"
    direction = getattr(probe, "direction", None)
    axes = np.eye(3) if direction is None else unit(direction)[None]
    columns = AXES if direction is None else ("along",)
    placed = np.asarray(scene.body[probe.body].position)
    if probe.interface is None:
        if len(body.modal.angular_frequencies):
            have = ", ".join([*body.modal.loads, *body.modal.interfaces]) or "none that is read"
            raise SceneError(
                f"{scene_key}.{prefix}interface: body '{probe.body}' is elastic; name an interface of its component, it"
                f" has {have}"
            )
        point = turned_vectors(scene.body[probe.body], probe.at or (0.0, 0.0, 0.0))
        rigid = axes @ body.twists[:, 3:].T if turns else body.rigid_rows(np.repeat(point[None], len(axes), 0), axes)
        none = np.empty(0, np.int64)
        return Reading(probe.body, rigid, np.zeros((len(axes), 0)), none, mix=np.zeros((len(axes), 0)), columns=columns,
                       place=point + placed, snapped=0.0)  # fmt: skip
    if probe.interface in body.modal.loads:
        load = body.modal.loads[probe.interface]
        if len(load.rows) < (6 if turns else 3):
            needed = "'tie'" if turns else "'mean' or 'tie'"
            raise SceneError(
                f"{scene_key}.{prefix}interface: '{probe.interface}' cannot be read so; kind {needed} is needed"
            )
        load_rows = load.rows[3:] if turns else load.rows[:3]
        wrench = load.resultant[3:] if turns else load.resultant[:3]
        start = body.modal.interface_rows[probe.interface][0] + (3 if turns else 0)
        return Reading(
            probe.body, body.wrench_rows(axes @ wrench), axes @ load_rows, np.arange(start, start + 3), mix=axes,
            columns=columns, place=load.point + placed, snapped=0.0,
        )  # fmt: skip
    offset = None if probe.at is None else turned_vectors(scene.body[probe.body], probe.at)
    return _at_point(scene_key + f".{prefix}", probe, body, (placed, offset), direction)


def _at_point(
    scene_key: str, probe: PointProbe | DistanceProbe, body: FlexibleBody,
    positions: tuple[np.ndarray, np.ndarray | None], direction: tuple[float, ...] | None,
) -> Reading:  # fmt: skip
    """Return the reading of the contact point of an interface that is nearest to the coordinates asked for.

    Args:
        positions: Of the body's origin, and the coordinates asked for relative to it, along the scene's axes [m].
    """
    placed, offset = positions
    name, points = probe.interface, body.morph.points.get(probe.interface or "")
    if name is None or points is None or name not in body.modal.interfaces:
        have = ", ".join([*body.modal.loads, *body.modal.interfaces]) or "none"
        raise SceneError(
            f"{scene_key}interface: body '{body.name}' has no interface '{name}' to be read, it has {have}"
        )
    if probe.kind == "rotation":
        raise SceneError(f"{scene_key}interface: '{name}' has contact points, which do not turn; kind 'tie' is needed")
    if offset is None and len(points) > 1:
        raise SceneError(f"{scene_key}at: '{name}' has {len(points)} contact points; give coordinates near one of them")
    distance = np.linalg.norm(points - (points[0] if offset is None else offset), axis=1)
    nearest = int(distance.argmin())
    modes = body.modal.interfaces[name]
    normal = body.outward(name)[nearest]
    sign = 1.0 if direction is None else float(unit(direction) @ normal)
    if abs(abs(sign) - 1) > 1e-3:
        raise SceneError(
            f"{scene_key}direction: the contact point of '{name}' is read along its normal"
            f" {np.round(normal, 6).tolist()} alone"
        )
    sign = float(np.sign(sign))
    rigid = body.rigid_rows(points[nearest][None], sign * normal[None])
    start, _ = body.modal.interface_rows[name]
    return Reading(
        body.name, rigid, sign * modes.rows[nearest][None], np.array([start + nearest]), mix=np.array([[sign]]),
        columns=("normal",) if direction is None else ("along",), place=points[nearest] + placed,
        snapped=float(distance[nearest]),
    )  # fmt: skip
