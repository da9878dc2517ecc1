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
    found, points = list[Holding](), dict[str, int]()
    for contact in system.contacts:
        own = _closed(system, ports, contact, every=f"contact.{contact.name}" in closed)
        points[contact.name] = len({port for port, *_ in own} & set(contact_ports(ports, contact).tolist()))
        found += own
    rows, residual = ports.rows.dense(), np.stack([one.dense() for one in ports.by_sides])
    for held, pin in zip(system.driving.joints, system.driving.crank(np.zeros(1))[0], strict=True):
        here = ports.of(f"joint.{held.name}").start
        line = held.anchor + rows[here : here + 2] @ system.position - pin[:2]
        line /= np.linalg.norm(line)
        rows[here] = line @ rows[here : here + 2]
        residual[:, here] = np.einsum("d,sdj->sj", line, residual[:, here : here + 2])
        residual[:, :, here] = np.einsum("d,sid->si", line, residual[:, :, here : here + 2])
        found.append((here, np.inf, 0.0))
    found += [(int(one), np.inf, 0.0) for one in ports.numbers([f"motion.{d.name}" for d in system.driving.drives])]
    springs = ports.numbers([f"force.{name}" for name in system.scene.springs()])
    slopes = system.springs.tension(_elongations(system, ports))[1]
    for port, slope, damper in zip(springs, slopes, system.springs.damping, strict=True):
        if slope > 0 or damper > 0:
            found.append((int(port), float(slope), float(damper)))
    numbers, stiffness, damping = (np.array(part) for part in zip(*found, strict=True)) if found else np.zeros((3, 0))
    return Linearised(
        system, ports, numbers.astype(np.int64), rows=rows, residual=residual, stiffness=stiffness, damping=damping,
        closed=points,
    )  # fmt: skip


Holding = tuple[int, float, float]
"""Number of a port, its stiffness [N/m] and its damping [N s/m]."""


def _closed(system: System, ports: Ports, contact: ContactRows, *, every: bool) -> list[Holding]:
    """Return the ports of the closed points of a contact: those that press, or every one."""
    found, normals = list[Holding](), contact_ports(ports, contact)
    last = ports.of(f"contact.{contact.name}").stop
    each = (last - int(normals[0])) // len(normals)
    beside: Collection[int] = ()
    if contact.master is not None:
        beside = np.flatnonzero(contact.master.weights(system.slid(contact, system.position))[2])
    for normal, row in zip(normals, range(contact.rows.start, contact.rows.stop), strict=True):
        force = float(system.start_forces[row])
        if row - contact.rows.start not in beside and (every or force > 0):
            tangent = _tangent(system, row, force, contact.name)
            damper = float(system.law[row, 3]) if np.isfinite(tangent) else 0.0
            found += [(int(normal), tangent, damper)] + [(int(normal) + b, np.inf, 0.0) for b in range(1, each)]
    return found


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


def places(found: Linearised, name: str, key: str) -> list[Place]:
    """Return the places of `contact.NAME`, `joint.NAME`, `force.NAME`, `motion.NAME`, `probe.NAME` or
    `gauge.BODY.NAME`, one a row; of a joint that holds a body its force and moment.

    `NAME[2]` is the second row of several.

    Raises:
        SceneError: there is none, beginning with the option `key`.
    """
    base, _, number = name.partition("[")
    rows = _all_places(found, name, base, key)
    if len(rows) == 1:
        rows = [replace(rows[0], label=base)]
    if not number:
        return rows
    text = number.removesuffix("]")
    if not text.isdigit() or not 1 <= int(text) <= len(rows):
        raise SceneError(f"{key} '{name}': {base} has rows 1 to {len(rows)}")
    return [rows[int(text) - 1]]


def _all_places(found: Linearised, name: str, base: str, key: str) -> list[Place]:
    """Return all rows of a place, named without the number of one; see `places` for what is raised."""
    system, ports = found.system, found.ports
    read = {f"probe.{n}": n for n, one in system.scene.probe.items()
            if isinstance(one, PointProbe) and one.kind in ("displacement", "rotation")}  # fmt: skip
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
        return gauge_places(found, gauges[base])
    if base in read:
        here, through = system.probes.places[system.probes.names.index(read[base])], probe_ports(system, ports)
        return [Place(f"{base}[{b + 1}]", system.probes.rows[i], np.stack([through[i], 0 * through[i]]), -1)
                for b, i in enumerate(range(here.start, here.stop))]  # fmt: skip
    here = ports.of(base)
    stop = here.start + 1 if base.startswith("joint.") else here.stop
    return [Place(f"{base}[{b + 1}]", found.rows[i], found.residual[:, i], i, base.startswith("motion."))
            for b, i in enumerate(range(here.start, stop))]  # fmt: skip


def read_as(gauge: str) -> str:
    """Return the name by which a gauge, `BODY.NAME`, is read: `gauge.BODY.NAME`, or that of a joint."""
    _, _, own = gauge.partition(".")
    return own if own.startswith(HELD) else f"gauge.{gauge}"


def gauge_places(found: Linearised, gauge: str) -> list[Place]:
    """Return the values of a gauge, `BODY.NAME`, as places where nothing acts; of a joint that holds a body six."""
    system, body, name = found.system, *gauge.split(".", 1)
    numbers = [i for i, one in enumerate(system.gauges) if one == gauge]
    through, unit = gauge_ports(system, found.ports)[numbers], system.bodies[body].modal.gauges[name].unit
    labels, parts = [f"{read_as(gauge)}[{b + 1}]" for b in range(len(numbers))], unit.split(", ")
    units = [parts[b * len(parts) // len(numbers)] for b in range(len(numbers))]
    return [
        Place(label, system.gauge_rows[i], np.stack([line, 0 * line]), -1, unit=one)
        for label, i, line, one in zip(labels, numbers, through, units, strict=True)
    ]


def known(name: str, able: Sequence[str]) -> str:
    """Return what is wrong with a name that is none of those that are able."""
    return f"there is none in the scene, {suggestion(name, able)}it has {', '.join(able) or 'none'}"
