"""The implicit integrator for every feature: builds the arrays of the loop over ports from a system."""

import numpy as np

from gudgeon.solver.contact.compliance import fixed
from gudgeon.solver.contact.lcp import empty_set
from gudgeon.solver.integrators.flight import flight
from gudgeon.solver.integrators.general.arrays import (
    POSITION,
    SLIPS,
    STABILISED,
    VELOCITY,
    Arrays,
    Constants,
    Found,
    Given,
    Problem,
    Rows,
    State,
)
from gudgeon.solver.integrators.general.kernel import march
from gudgeon.solver.integrators.general.solve import WINDOW
from gudgeon.solver.integrators.impact_log import Located, impact_log
from gudgeon.solver.integrators.outcome import Outcome, Samples
from gudgeon.solver.integrators.uncoupled import SLOWEST
from gudgeon.solver.ports.members import contact_ports, gauge_ports, ports_of, probe_ports
from gudgeon.solver.ports.table import BLOCK, Kind, Ports, block_size
from gudgeon.solver.result import Result
from gudgeon.solver.system.system import System


class General:
    """A run of steps `dt`."""

    failure = Result.NOT_CONVERGED

    def __init__(self, system: System, dt: float) -> None:
        self._system, self._dt = system, dt
        self.ports = ports_of(system)
        constants = _constants(system, self.ports, dt)
        state = _state(system, self.ports, constants)
        normals = [contact_ports(self.ports, contact) for contact in system.contacts]
        self._normals = np.concatenate([np.empty(0, np.int64), *normals]).astype(np.int64)
        log = impact_log([int(rows[0]) for rows in normals], dt, system.window)
        self.arrays = Arrays(constants, state, _problem(constants), log)
        self._located = Located(log)
        loaded, contacts = len(constants.loaded), max(1, len(system.contacts))
        self._bare = Found(
            forces=np.zeros((1, contacts, 3)), energies=np.zeros((1, 5)), loads=np.zeros((1, loaded)),
            q=np.zeros((1, len(state.q))), v=np.zeros((1, len(state.q))), ports=np.zeros((1, len(state.unknown))),
            lengths=np.zeros((1, len(state.pin))),
        )  # fmt: skip
        self._nothing = Given(np.zeros((1, len(constants.given))), np.zeros((1, 0, 4)), np.zeros((1, 0)))
        self._driven = bool(system.driving.joints or system.driving.drives)
        self._slips: list[list[tuple[float, bool]]] = [[] for _ in system.contacts]
        self._gauges = gauge_ports(system, self.ports)
        self._probes = probe_ports(system, self.ports)

    def advance(self, first: int, stride: int, out: Samples) -> bool:
        """Fill samples of `stride` steps; False where the run cannot continue."""
        system, state, count = self._system, self.arrays.state, len(out.forces)
        found = Found(
            forces=out.forces, energies=out.energies, loads=out.loads, q=np.zeros((count, len(state.q))),
            v=np.zeros((count, len(state.q))), ports=np.zeros((count, len(state.unknown))),
            lengths=np.zeros((count, len(state.pin))),
        )  # fmt: skip
        sound = march(self.arrays, self._drive(first, count * stride), first, stride, found)
        self._take_slips()
        pressed = found.ports[:, self._normals]
        out.set_states(slice(None), system, found.q, found.v, pressed)
        if len(system.probes.names):
            contacts = pressed @ system.probes.pressed.T
            out.probes[:] = system.probes.values(found.q, found.v) + np.where(
                self._probes.any(axis=1), found.ports @ self._probes.T, contacts
            )
        out.gauges[:] = found.q @ system.gauge_rows.T + found.ports @ self._gauges.T
        out.snapshots[:, 2 * len(system.rigid) :] = found.lengths
        out.peaks.keep_highest(first // stride, out.forces, found.q, found.v, pressed)
        if sound and not self._located.take():
            self.failure = Result.IMPACTS
            return False
        return bool(sound)

    def advance_bare(self, first: int, count: int, applied: np.ndarray) -> bool:
        """Take steps without histories; False where the run cannot continue.

        Args:
            applied: Given loads [N], NaN: as the scene gives them, (g,).
        """
        given = self._nothing
        if self._driven or (len(applied) and np.isnan(applied).any()):
            given = self._drive(first, count)
            given = given._replace(loads=np.where(np.isnan(applied), given.loads, applied))
        elif count > 1 or len(applied):
            given = Given(np.tile(applied, (count, 1)), np.zeros((count, 0, 4)), np.zeros((count, 0)))
        # What it sums up of forces and loads is not read.
        sound = march(self.arrays, given, first, count, self._bare)
        self._take_slips()
        if not self._located.take():
            self.failure = Result.IMPACTS
            return False
        return bool(sound)

    def _take_slips(self) -> None:
        """Take the changes between slip and stick of the last steps."""
        kept = self.arrays.state.slips
        if not kept[0, 0]:
            return
        for contact, time, begins in kept[1 : int(kept[0, 0]) + 1]:
            self._slips[int(contact)].append((float(time), bool(begins)))
        kept[0, 0] = 0.0

    def _drive(self, first: int, count: int) -> Given:
        """Return what the scene gives in some steps."""
        driving, dt, constants = self._system.driving, self._dt, self.arrays.constants
        start = dt * np.arange(first, first + count)
        loads, j, wanted = driving.loads(start, dt), 2 * len(driving.joints), driving.driven(start + dt)
        ahead = np.where(constants.level[constants.drives] == STABILISED, 0.5 * dt, 0.0)
        given = loads[:, j : j + len(constants.given)]
        return Given(given, driving.crank(start + dt), wanted[:, :, 0] + ahead * wanted[:, :, 1])

    def impacts(self) -> list[np.ndarray]:
        return self._located.impacts()

    def outcome(self) -> Outcome:
        state, ports, system = self.arrays.state, self.ports, self._system
        drags = np.zeros((len(self._normals), 3))
        directions = self.arrays.constants.direction
        for row, normal in enumerate(self._normals):
            for b in range(normal + 1, normal + BLOCK.get(Kind(ports.kind[normal]), 1)):
                drags[row] += state.impulses[b] * directions[b]
        springs = [-state.impulses[ports.of(f"force.{name}")] for name in system.scene.springs()]
        return Outcome(
            q=state.q, v=state.v, multipliers=state.unknown[self._normals], impulses=state.impulses[self._normals],
            extreme=state.extreme, counts=state.counts, drags=drags if drags.any() else np.empty(0),
            springs=np.concatenate([np.empty(0), *springs]), slips=self._slips,
        )  # fmt: skip


def _constants(system: System, ports: Ports, dt: float) -> Constants:
    step, p = flight(system.stiffness, system.damping, dt), len(ports.offset)
    per_port = _per_port(system, ports)
    level, joints = np.full(p, POSITION), np.full(p, -1)
    level[per_port["restitution"] >= 0] = VELOCITY
    lengths = np.zeros(p)
    beta = _delays(system, ports, per_port["delay"])
    jumps = _jumps(ports, beta, per_port["layer"], dt)
    residual, memory = _residual(ports, beta, jumps, dt)
    flexible = np.einsum("sij,sj->ij", residual, memory[:, 2]) if len(residual) else np.zeros((p, p))
    for number, held in enumerate(system.driving.joints):
        here = ports.of(f"joint.{held.name}")
        joints[here.start], lengths[here.start] = number, held.joint.rod_length
        if not (flexible.diagonal()[here] > 0).all():
            level[here] = STABILISED
    moved = [f"motion.{drive.name}" for drive in system.driving.drives]
    for here in map(ports.of, moved):
        if not (flexible.diagonal()[here] > 0).all():
            level[here] = STABILISED
    block = np.zeros(p, np.int64)
    size = np.zeros(p, np.int64)
    for item, here in zip(ports.blocks, ports.places, strict=True):
        each = block_size(item)
        first = np.arange(here.start, here.stop, each)
        size[first] = each
        block[here] = np.repeat(first, each)
    rigid = level == VELOCITY
    inertia, faster = (_by_bodies(system, ports, factor) for factor in (step.push[0], dt * step.push[1]))
    inertia[level == STABILISED] += 0.5 * faster[level == STABILISED]
    inertia[rigid] = faster[rigid]
    flexible[rigid] = 0.0
    share = np.where(jumps, 1.0, _share(ports, level, per_port["layer"], flexible))
    matrix = inertia * share + flexible + np.diag(per_port["layer"])
    responds = ports.kind != Kind.GIVEN
    scale, among = np.sqrt(np.abs(matrix.diagonal()[responds])), matrix[np.ix_(responds, responds)]
    symmetric = bool((np.abs(among - among.T) <= 1e-12 * np.outer(scale, scale)).all())
    return Constants(
        dt=dt, motion=step.motion, push=step.push, loss=step.loss, stiffness=system.stiffness,
        gravity=system.driving.gravity, rows=_rows(system, ports), norm=np.linalg.norm(ports.rows, axis=1),
        reach=np.abs(residual).max(axis=(0, 2), initial=0.0) if p else np.zeros(0), offset=ports.offset,
        kind=ports.kind, size=size, block=block, level=level, share=share, inertia=inertia.T.copy(),
        columns=matrix.T.copy(), residual=residual, memory=memory, layer=per_port["layer"],
        law=per_port["law"], knots=np.vstack([np.empty((0, 2)), *system.springs.knots.values()]),
        table=per_port["table"].astype(np.int64), friction=per_port["friction"], belt=per_port["belt"],
        restitution=per_port["restitution"], lengths=lengths, contact=per_port["contact"],
        direction=per_port["direction"], joint=joints, inverse=_inverses(ports, moved, matrix),
        drives=ports.numbers(moved), given=np.flatnonzero(~responds),
        touching=np.flatnonzero((size > 0) & (per_port["contact"] >= 0)),
        always=np.flatnonzero((size > 0) & (per_port["contact"] < 0) & responds), joints=np.flatnonzero(joints >= 0),
        loaded=_loaded(system, ports), sides=ports.sides, farthest=float(step.push[0].max(initial=0.0)),
        damped=bool(np.any(memory[:, :2])), bounces=bool(rigid.any()), rigid=system.rigid, floor=SLOWEST,
        plain=bool(symmetric and (ports.kind[responds] == Kind.UNILATERAL).all() and not rigid.any()),
    )  # fmt: skip


def _by_bodies(system: System, ports: Ports, factor: np.ndarray) -> np.ndarray:
    """Return W diag(factor) Wᵀ, (p, p): ports that share no body do not act on each other through coordinates."""
    found = np.zeros((len(ports.offset),) * 2)
    for number, body in enumerate(system.bodies.values()):
        near, here = np.flatnonzero((ports.sides == number).any(axis=1)), body.coordinates
        rows = ports.rows[near, here]
        found[np.ix_(near, near)] += (rows * factor[here]) @ rows.T
    return found


def _per_port(system: System, ports: Ports) -> dict[str, np.ndarray]:
    """Return what contacts and springs give to each of their ports."""
    p = len(ports.offset)
    found = {name: np.zeros((p, *shape)) for name, shape in _PER_PORT.items()}
    found["restitution"][:], contact = -1.0, np.full(p, -1)
    for number, item in enumerate(system.contacts):
        here = ports.of(f"contact.{item.name}")
        contact[here] = number
        normals = contact_ports(ports, item)
        each = (here.stop - here.start) // len(normals)
        rigid = system.rigid_contact[item.rows]
        for b in range(each):
            found["restitution"][normals + b] = np.where(rigid, system.restitution[item.rows], -1.0)
        found["friction"][normals] = system.friction[item.rows]
        found["direction"][here] = ports.blocks[number].directions
        if ports.kind[here.start] in (Kind.LAW, Kind.RUBBING_LAW):
            found["law"][normals] = system.law[item.rows]
        else:
            found["layer"][normals] = system.layer[item.rows]
            compliance = system.compliance.diagonal()[item.rows]
            found["delay"][normals] = system.dashpot[item.rows] * compliance
        if each > 1:
            settings = system.scene.contact[item.name]
            velocity = np.asarray(getattr(settings.against, "velocity", (0.0, 0.0, 0.0)), float)
            for b in range(1, each):
                found["belt"][normals + b] = found["direction"][normals + b] @ velocity
    springs, first = system.springs, 0
    for name in system.scene.springs():
        here, rows = ports.of(f"force.{name}"), springs.of(name)
        found["law"][here, 0], found["law"][here, 1] = springs.stiffness[rows], springs.damping[rows]
        if (knots := springs.knots.get(rows.start)) is not None:
            found["table"][here] = first, first + len(knots)
            first += len(knots)
    return found | {"contact": contact}


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
    """Return which contact ports have a force that jumps when they close, since a dashpot alone resists, (p,)."""
    found = np.zeros(len(layer), np.bool_)
    for item, here in zip(ports.blocks, ports.places, strict=True):
        if item.kind in (Kind.UNILATERAL, Kind.CONE):
            each = BLOCK.get(item.kind, 1)
            first = np.arange(here.start, here.stop, each)
            found[here] = np.repeat((beta[:, first].max(axis=0) > 0.5 * dt) & (layer[first] == 0), each)
    return found


def _residual(ports: Ports, beta: np.ndarray, jumps: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Return R by sides of ports [m/N], (s, p, p), and the memory of r on them, (s, 3, p); one side if both are alike.

    Args:
        beta: [s], (2, p).
        jumps: Ports whose force is constant in a step, (p,).
    """
    p = len(ports.offset)
    if not ports.residual.any():
        return np.zeros((0, p, p)), np.zeros((0, 3, p))
    memory = np.stack([_memory(own, dt) for own in beta])
    for i in np.flatnonzero(jumps):
        memory[:, 2, i] += memory[:, 1, i]
        memory[:, 1, i] = 0.0
    if np.array_equal(beta[0], beta[1]):
        return ports.residual.sum(axis=0)[None], memory[:1]
    return ports.residual, memory


def _memory(beta: np.ndarray, dt: float) -> np.ndarray:
    """Return what r + β ṙ = f keeps of r, of f at the start and of f at the end of a step, f linear in it, (3, n)."""
    ratio = beta / dt
    with np.errstate(divide="ignore"):
        kept = np.exp(-1 / ratio)
    gone = ratio * (1 - kept)
    return np.array([kept, gone - kept, 1 - gone])


def _share(ports: Ports, level: np.ndarray, layer: np.ndarray, flexible: np.ndarray) -> np.ndarray:
    """Return κ of each port: ½ where the trapezoidal rule holds, which needs a compliance of its own, (p,)."""
    share = np.ones(len(level))
    own = flexible.diagonal() + layer > 0
    for item, here in zip(ports.blocks, ports.places, strict=True):
        if item.kind == Kind.GIVEN:
            continue
        each = block_size(item)
        first = np.arange(here.start, here.stop, each)
        averaged = own[first] & (level[first] == POSITION)
        share[here] = np.where(np.repeat(averaged, each), 0.5, 1.0)
    return share


def _inverses(ports: Ports, moved: list[str], matrix: np.ndarray) -> np.ndarray:
    """Return the inverse of each drive's block of the measures per unknown, in the rows of its ports, (p, n)."""
    places = [ports.of(name) for name in moved]
    found = np.zeros((len(matrix), max((here.stop - here.start for here in places), default=0)))
    for here in places:
        found[here, : here.stop - here.start] = np.linalg.inv(matrix[here, here])
    return found


def _rows(system: System, ports: Ports) -> Rows:
    """Return W by the bodies of each port."""
    p, bodies = len(ports.offset), list(system.bodies.values())
    first, last, at = (np.zeros((p, 2), np.int64) for _ in range(3))
    values, used = [np.empty(0)], 0
    for i in range(p):
        for side, number in enumerate(ports.sides[i]):
            if number >= 0:
                here = bodies[number].coordinates
                first[i, side], last[i, side], at[i, side] = here.start, here.stop, used
                values.append(ports.rows[i, here])
                used += here.stop - here.start
    return Rows(first, last, at, np.concatenate(values))


def _loaded(system: System, ports: Ports) -> np.ndarray:
    """Return the ports of joints, given loads and drives."""
    driving = system.driving
    names = [f"joint.{held.name}" for held in driving.joints] + [f"force.{load.name}" for load in driving.given]
    return ports.numbers(names + [f"motion.{drive.name}" for drive in driving.drives])


def _state(system: System, ports: Ports, constants: Constants) -> State:
    p, m, contacts, joints = len(ports.offset), len(system.velocity), len(system.contacts), len(system.driving.joints)
    sides = len(constants.residual)
    unknown = np.zeros(p)
    for item in system.contacts:
        unknown[contact_ports(ports, item)] = system.start_forces[item.rows]
    unknown[constants.loaded] = system.loads
    for name in system.scene.springs():
        unknown[ports.of(f"force.{name}")] = system.start_pulls[system.springs.of(name)]
    held = np.tile(unknown, (sides, 1)) if sides else np.zeros((0, p))
    response = np.einsum("sij,sj->i", constants.residual, held) if sides else np.zeros(p)
    displacement = ports.offset + ports.rows @ system.position + response
    parts = np.zeros(5)
    stored = 0.5 * float(unknown @ response)
    pulled = [displacement[ports.of(f"force.{name}")] for name in system.scene.springs()]
    parts[:3] = (
        0.5 * float(system.velocity @ system.velocity),
        0.5 * float(system.stiffness @ system.position**2) + stored
        + system.springs.energy(np.concatenate([np.empty(0), *pulled])),
        system.start_contact_energy - 0.5 * float(system.start_forces @ system.residual @ system.start_forces),
    )  # fmt: skip
    pin = system.driving.crank(np.zeros(1))[0]
    acts, numbers = np.zeros(p + 1, np.int64), np.flatnonzero(unknown)
    acts[0], acts[1 : len(numbers) + 1] = len(numbers), numbers
    zeros = {name: np.zeros(p) for name in _ZERO_AT_START}
    return State(
        q=system.position.copy(), v=system.velocity.copy(), before=np.zeros((2, m)), force=np.zeros(m),
        pressed=np.zeros(m), unknown=unknown, held=held, known=np.zeros((sides, p)), acts=acts,
        listed=acts * (sides > 0),
        listed_known=np.zeros(p + 1, np.int64), displacement=np.stack([displacement, displacement]),
        response=np.stack([response, response]), anchor=displacement.copy(), sliding=np.zeros(p, np.bool_),
        fastest=np.zeros(1), wanted=np.zeros(len(constants.drives)),
        rod=np.zeros((joints, 3)), pin=pin.reshape(joints, 4), travel=np.zeros(2),
        acting=np.zeros(contacts), struck=np.zeros(contacts, np.bool_), peak=np.zeros((contacts, 2)),
        slips=np.zeros((SLIPS + 1 if contacts else 1, 3)), closing=np.full(p, -1.0),
        stored=np.array([stored]), work=np.zeros(len(system.rigid) + 1), parts=parts,
        extreme=np.array([parts.sum(), 0.0, 0.0, 0.0]), counts=np.zeros(6, np.int64), **zeros,
    )  # fmt: skip


_ZERO_AT_START = ("last", "mean", "extra", "gap", "measure", "approach", "margin", "sudden", "rate", "impulses")


def _problem(constants: Constants) -> Problem:
    p = len(constants.offset)
    return Problem(
        awake=np.zeros((2, p), np.bool_), ports=np.zeros(p, np.int64), size=np.zeros(5, np.int64),
        columns=np.zeros((p, p)), active=empty_set(p if constants.plain else 0), runs=np.zeros((p, 2), np.int64),
        matrix=fixed(constants.columns)._replace(candidate=np.ones(p, np.bool_)), free=np.zeros(p), x=np.zeros(p),
        y=np.zeros(p), start=np.zeros(p),
        weight=np.zeros(p), slipped=np.zeros(p, np.bool_),
        past=np.zeros((3, p)), changes=np.zeros((3, WINDOW, p)), products=np.zeros((WINDOW, WINDOW)),
        gram=np.zeros((WINDOW, WINDOW + 1)),
    )  # fmt: skip
