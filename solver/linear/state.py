"""A system linearised at its start: which ports hold, and the compliance of each.

A port that holds has the displacement u = W q + R f = −S(s) f with S = 1/(k + c s) of a spring, the layer of a contact,
the tangent of a law at its force, and zero of joints, driven bodies and contacts without a layer.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gudgeon.solver.bodies.holding import HELD
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.errors import SceneError
from gudgeon.solver.ports.members import (
    contact_ports,
    gauge_ports,
    ports_of,
    probe_ports,
    start_unknowns,
    with_surfaces,
)
from gudgeon.solver.ports.rest import at_rest
from gudgeon.solver.ports.table import Kind, Ports
from gudgeon.solver.scene.probe import PointProbe
from gudgeon.solver.scene.refusals import suggestion
from gudgeon.solver.system.bases.swaps import refuse_swaps
from gudgeon.solver.system.system import System


@dataclass(frozen=True)
class Linearised:
    """All ports of a system with m coordinates at a state; a of p ports hold."""

    system: System
    ports: Ports
    holding: np.ndarray
    """Numbers of the ports that hold, (a,)."""
    rows: np.ndarray
    """W of all ports; of a joint along its rod, (p, m)."""
    residual: np.ndarray
    """R [m/N], (2, p, p), as in `Ports`."""
    stiffness: np.ndarray
    """k of the holding ports [N/m]; infinite where nothing yields, (a,)."""
    damping: np.ndarray
    """c of the holding ports [N s/m], (a,)."""
    closed: dict[str, int]
    """Number of closed points of each contact."""

    def compliance(self, s: complex) -> np.ndarray:
        """Return S(s) of the holding ports [m/N], (a,); of a damper without stiffness at s = 0 infinity."""
        with np.errstate(divide="ignore"):
            return 1 / (self.stiffness + self.damping * s)


def linearised(system: System, closed: Collection[str] = ()) -> Linearised:
    """Linearise a system at its start.

    Contacts hold at the points that press in its static equilibrium, those named at all their points. Where there is
    friction, closed points stick.

    Args:
        closed: Names `contact.NAME` of contacts whose points are all closed.

    Raises:
        SceneError: there is no such contact, or a law without stiffness holds at no force.
    """
    refuse_swaps(system, "a linear analysis is of one basis")
    system = at_rest(system)
    ports = with_surfaces(system, ports_of(system), system.position)
    contacts = [f"contact.{name}" for name in system.scene.contact]
    for name in closed:
        if name not in contacts:
            raise SceneError(f"--closed '{name}': {known(name, contacts)}")
    holdings, points = list[Holding](), dict[str, int]()
    for contact in system.contacts:
        closed_ports = _closed(system, ports, contact, every=f"contact.{contact.name}" in closed)
        points[contact.name] = len({port for port, *_ in closed_ports} & set(contact_ports(ports, contact).tolist()))
        holdings += closed_ports
    rows, residual = ports.rows.dense(), np.stack([s.dense() for s in ports.by_sides])
    for crank, pin in zip(system.driving.joints, system.driving.crank(np.zeros(1))[0], strict=True):
        row = ports.of(f"joint.{crank.name}").start
        line = crank.anchor + rows[row : row + 2] @ system.position - pin[:2]
        line /= np.linalg.norm(line)
        rows[row] = line @ rows[row : row + 2]
        residual[:, row] = np.einsum("d,sdj->sj", line, residual[:, row : row + 2])
        residual[:, :, row] = np.einsum("d,sid->si", line, residual[:, :, row : row + 2])
        holdings.append((row, np.inf, 0.0))
    holdings += [
        (int(number), np.inf, 0.0) for number in ports.numbers([f"motion.{d.name}" for d in system.driving.drives])
    ]
    springs = ports.numbers([f"force.{name}" for name in system.scene.springs()])
    slopes = system.springs.tension(_elongations(system, ports))[1]
    for port, slope, damper in zip(springs, slopes, system.springs.damping, strict=True):
        if slope != 0 or damper > 0:
            holdings.append((int(port), float(slope), float(damper)))
    numbers, stiffness, damping = (
        (np.array(column) for column in zip(*holdings, strict=True)) if holdings else np.zeros((3, 0))
    )
    return Linearised(
        system, ports, numbers.astype(np.int64), rows=rows, residual=residual, stiffness=stiffness, damping=damping,
        closed=points,
    )  # fmt: skip


Holding = tuple[int, float, float]
"""Number of a port, its stiffness [N/m] and its damping [N s/m]."""


def _closed(system: System, ports: Ports, contact: ContactRows, *, every: bool) -> list[Holding]:
    """Return the ports of the closed points of a contact: those that press, or every one."""
    holdings, normals = list[Holding](), contact_ports(ports, contact)
    stop = ports.of(f"contact.{contact.name}").stop
    each = (stop - int(normals[0])) // len(normals)
    beside: Collection[int] = ()
    if contact.master is not None:
        beside = np.flatnonzero(contact.master.weights(system.slid(contact, system.position))[2])
    for normal, row in zip(normals, range(contact.rows.start, contact.rows.stop), strict=True):
        force = float(system.start_forces[row])
        if row - contact.rows.start not in beside and (every or force > 0):
            tangent = _tangent(system, row, force, contact.name)
            damper = float(system.law[row, 3]) if np.isfinite(tangent) else 0.0
            holdings += [(int(normal), tangent, damper)] + [(int(normal) + b, np.inf, 0.0) for b in range(1, each)]
    return holdings


def _tangent(system: System, row: int, force: float, name: str) -> float:
    """Return the stiffness of one contact point at a force [N/m]; infinite where only R yields."""
    K, n = system.law[row, :2]
    if system.layer[row] > 0:
        return 1 / float(system.layer[row])
    if K <= 0:
        return np.inf
    if n == 1:
        return float(K)
    if not force > 0:
        raise SceneError(
            f"contact.{name}.law: its stiffness is zero without a force; load the contact at the start (run.start ="
            " 'rest'), or leave it open"
        )
    return float(n * K ** (1 / n) * force ** (1 - 1 / n))


def _elongations(system: System, ports: Ports) -> np.ndarray:
    """Return the elongations of all springs at the start [m], (b,)."""
    forces = start_unknowns(system, ports)
    springs = ports.numbers([f"force.{name}" for name in system.scene.springs()])
    return (ports.offset + ports.rows @ system.position + ports.residual @ forces)[springs]


@dataclass(frozen=True)
class Place:
    """Where a force acts or a displacement is read."""

    label: str
    row: np.ndarray
    """Over the coordinates, (m,)."""
    residual: np.ndarray
    """Displacement there by a force on either side of each port [m/N], (2, p)."""
    port: int
    """Its number among the ports; −1 of a probe."""
    given: bool = False
    """Whether its displacement is given, so that a response is that per displacement."""
    unit: str = ""
    """Of a gauge, its own; empty where a displacement is read."""


def places(state: Linearised, name: str, key: str) -> list[Place]:
    """Return the places of `contact.NAME`, `joint.NAME`, `force.NAME`, `motion.NAME`, `probe.NAME` or
    `gauge.BODY.NAME`, one a row; of a joint that holds a body its force and moment.

    `NAME[2]` is the second row of several.

    Raises:
        SceneError: there is none, beginning with the option `key`.
    """
    base, _, index = name.partition("[")
    rows = _all_places(state, name, base, key)
    if len(rows) == 1:
        rows = [replace(rows[0], label=base)]
    if not index:
        return rows
    text = index.removesuffix("]")
    if not text.isdigit() or not 1 <= int(text) <= len(rows):
        raise SceneError(f"{key} '{name}': {base} has rows 1 to {len(rows)}")
    return [rows[int(text) - 1]]


def _all_places(state: Linearised, name: str, base: str, key: str) -> list[Place]:
    """Return all rows of a place, named without the number of one; see `places` for what is raised."""
    system, ports = state.system, state.ports
    read = {f"probe.{n}": n for n, p in system.scene.probe.items()
            if isinstance(p, PointProbe) and p.kind in ("displacement", "rotation")}  # fmt: skip
    gauges = {read_as(name): name for name in system.gauges}
    able = [block.name for block in ports.blocks if block.kind != Kind.SURFACE] + list(read) + list(gauges)
    if base not in able:
        probe = system.scene.probe.get(base.removeprefix("probe.")) if base.startswith("probe.") else None
        if probe is not None:
            raise SceneError(
                f"{key} '{name}': a probe of {probe.kind} is not read here; allowed: probes of displacement and"
                " rotation, contacts, joints, forces, motions and gauges; --quantity gives velocities and accelerations"
            )
        raise SceneError(f"{key} '{name}': {known(base, able)}")
    if base in gauges:
        return gauge_places(state, gauges[base])
    if base in read:
        span, through = system.probes.places[system.probes.names.index(read[base])], probe_ports(system, ports)
        return [Place(f"{base}[{b + 1}]", system.probes.rows[i], np.stack([through[i], 0 * through[i]]), -1)
                for b, i in enumerate(range(span.start, span.stop))]  # fmt: skip
    span = ports.of(base)
    stop = span.start + 1 if base.startswith("joint.") else span.stop
    return [Place(f"{base}[{b + 1}]", state.rows[i], state.residual[:, i], i, base.startswith("motion."))
            for b, i in enumerate(range(span.start, stop))]  # fmt: skip


def read_as(gauge: str) -> str:
    """Return the name by which a gauge, `BODY.NAME`, is read: `gauge.BODY.NAME`, or that of a joint."""
    _, _, label = gauge.partition(".")
    return label if label.startswith(HELD) else f"gauge.{gauge}"


def gauge_places(state: Linearised, gauge: str) -> list[Place]:
    """Return the values of a gauge, `BODY.NAME`, as places where nothing acts; of a joint that holds a body six."""
    system, body, name = state.system, *gauge.split(".", 1)
    numbers = [i for i, g in enumerate(system.gauges) if g == gauge]
    through, unit = gauge_ports(system, state.ports)[numbers], system.bodies[body].modal.gauges[name].unit
    labels, unit_names = [f"{read_as(gauge)}[{b + 1}]" for b in range(len(numbers))], unit.split(", ")
    units = [unit_names[b * len(unit_names) // len(numbers)] for b in range(len(numbers))]
    return [
        Place(label, system.gauge_rows[i], np.stack([line, 0 * line]), -1, unit=unit)
        for label, i, line, unit in zip(labels, numbers, through, units, strict=True)
    ]


def known(name: str, able: Sequence[str]) -> str:
    """Return what is wrong with a name that is none of those that are able."""
    return f"there is none in the scene, {suggestion(name, able)}it has {', '.join(able) or 'none'}"
