"""Which contacts are closed or slip, and the equations of motion under these conditions."""

from collections.abc import Set
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property

import numpy as np

from gudgeon.solver.integrators.event.basis import Linear
from gudgeon.solver.integrators.event.motion import Probe
from gudgeon.solver.system.system import System


class Status(IntEnum):
    """Condition of a contact row."""

    OPEN = 0
    CLOSED = 1
    SLACK = 2
    """The surface is still indented, but its dashpot balances its spring: no force."""
    IMPLIED = 3
    """Rigid and touching, held by other rows: of the four feet of a box three carry."""


class Watch(IntEnum):
    """Events; each is the time at which a function falls below zero."""

    CLOSES = 0
    OPENS = 1
    LEAVES = 2
    """A slack surface has recovered."""
    SLIPS_BACK = 3
    """The static limit is reached by a positive friction force."""
    SLIPS_AHEAD = 4
    """The static limit is reached by a negative friction force."""
    STICKS = 5


@dataclass
class Conditions:
    """Conditions of all c rows."""

    status: np.ndarray
    """`Status` of each row, (c,)."""
    slip: np.ndarray
    """Sign of the sliding velocity, 0 where it sticks or has no friction, (c,)."""

    def key(self) -> bytes:
        """Return a key that is different for different conditions."""
        return self.status.tobytes() + self.slip.tobytes()


@dataclass(frozen=True)
class Regime:
    """The equations under given conditions, and the functions whose zeros are events."""

    linear: Linear
    forces: Probe
    """Normal force of every row [N], (c,)."""
    tangential: Probe
    """Friction force of every row [N], (c,)."""
    watched: Probe
    events: list[tuple[Watch, int]]


@dataclass(frozen=True)
class Equations:
    """A system, from which regimes are built."""

    system: System

    @cached_property
    def frictional(self) -> np.ndarray:
        """Rows with friction, (c,) bool."""
        return self.system.friction[:, 0] > 0

    @cached_property
    def alone(self) -> np.ndarray:
        """Rows whose gap does not change by other rows' forces through R, (c,) bool."""
        R = self.system.residual
        return ~np.any(R - np.diag(R.diagonal()), axis=1)

    def regime(self, now: Conditions, p: np.ndarray, zero: Set[int] = frozenset()) -> Regime:
        """Return the equations for displacements from a state p, (n,), at which the gaps of rows `zero` are zero."""
        gaps = self.system.gap + self.system.rows @ p
        gaps[[row for row in zero if self.alone[row]]] = 0.0
        linear, soft, hard, stuck = self._linear(now, p, gaps)
        forces, tangential = self._forces(now, linear, soft, hard, stuck)
        watched, events = self._watched(now, gaps, forces, tangential)
        return Regime(linear, forces, tangential, watched, events)

    def _linear(
        self, now: Conditions, p: np.ndarray, gaps: np.ndarray
    ) -> tuple[Linear, np.ndarray, np.ndarray, np.ndarray]:
        system, springs = self.system, self.system.springs
        closed = now.status == Status.CLOSED
        soft = np.flatnonzero(closed & ~system.rigid_contact)
        hard = np.flatnonzero(closed & system.rigid_contact)
        stuck = hard[self.frictional[hard] & (now.slip[hard] == 0)]
        compliance = system.compliance[np.ix_(soft, soft)]
        inverse = np.linalg.inv(compliance) if len(soft) else np.zeros((0, 0))
        both = np.zeros((len(soft) + len(springs.stiffness),) * 2)
        both[: len(soft), : len(soft)] = 0.5 * (inverse + inverse.T)
        both[len(soft) :, len(soft) :] = np.diag(springs.stiffness)
        drag = (now.slip[hard] * system.friction[hard, 1])[:, None] * system.tangents[hard]
        linear = Linear(
            stiffness=system.stiffness, force=system.driving.gravity - system.stiffness * p,
            rows=np.vstack([system.rows[soft], springs.rows]),
            offsets=np.concatenate([gaps[soft], springs.stretch + springs.rows @ p]), springs=both,
            dampers=np.concatenate([system.dashpot[soft], springs.damping]),
            rigid=np.vstack([system.rows[hard], system.tangents[stuck]]),
            pushed=np.vstack([system.rows[hard] - drag, system.tangents[stuck]]),
        )  # fmt: skip
        return linear, soft, hard, stuck

    def _forces(
        self, now: Conditions, linear: Linear, soft: np.ndarray, hard: np.ndarray, stuck: np.ndarray
    ) -> tuple[Probe, Probe]:
        c, n = self.system.rows.shape
        normal, tangential = _nothing(c, n), _nothing(c, n)
        if len(soft):
            inverse, rows = linear.springs[: len(soft), : len(soft)], linear.rows[: len(soft)]
            normal.constant[soft] = -inverse @ linear.offsets[: len(soft)]
            normal.position[soft] = -inverse @ rows
            normal.velocity[soft] = -linear.dampers[: len(soft), None] * rows
        if len(linear.rigid):
            free = acceleration(linear)
            solve = -np.linalg.solve(linear.rigid @ linear.pushed.T, linear.rigid)
            held = Probe(solve @ free.constant, solve @ free.position, solve @ free.velocity)
            _put(normal, hard, held[np.arange(len(hard))])
            _put(tangential, stuck, held[np.arange(len(hard), len(linear.rigid))])
            for row in hard[now.slip[hard] != 0]:
                factor = -now.slip[row] * self.system.friction[row, 1]
                one = normal[[row]]
                _put(tangential, np.array([row]), Probe(*(factor * part for part in vars(one).values())))
        return normal, tangential

    def _watched(
        self, now: Conditions, gaps: np.ndarray, forces: Probe, tangential: Probe
    ) -> tuple[Probe, list[tuple[Watch, int]]]:
        system = self.system
        couple = system.compliance
        found: list[tuple[Watch, int, tuple[np.ndarray, np.ndarray, np.ndarray]]] = []
        for row, status in enumerate(now.status):
            gap = (gaps[row], system.rows[row], np.zeros_like(system.rows[row]))
            if status == Status.OPEN:
                # Its gap with the forces of closed points through R.
                lifted = tuple(own + couple[row] @ part for own, part in zip(gap, vars(forces).values(), strict=True))
                found.append((Watch.CLOSES, row, lifted))  # type: ignore[arg-type]
            elif status == Status.SLACK:
                stiffness = 1 / couple[row, row]
                rate = system.dashpot[row] * system.rows[row]
                found.append((Watch.CLOSES, row, (stiffness * gap[0], stiffness * gap[1], rate)))
                found.append((Watch.LEAVES, row, (-gap[0], -gap[1], gap[2])))
            elif status == Status.CLOSED:
                normal = tuple(part[row] for part in vars(forces).values())
                found.append((Watch.OPENS, row, normal))  # type: ignore[arg-type]
                if self.frictional[row]:
                    found += self._friction(now, row, normal, tuple(p[row] for p in vars(tangential).values()))
        watched = Probe(*(np.array([entry[2][part] for entry in found]) for part in range(3)))
        if not found:
            watched = _nothing(0, system.rows.shape[1])
        return watched, [(kind, row) for kind, row, _ in found]

    def _friction(self, now: Conditions, row: int, normal: tuple, drag: tuple) -> list:  # type: ignore[type-arg]
        system = self.system
        if now.slip[row]:
            sign, line = now.slip[row], system.tangents[row]
            return [(Watch.STICKS, row, (-sign * system.belt[row], np.zeros_like(line), sign * line))]
        limit = system.friction[row, 0]
        return [
            (kind, row, tuple(limit * n - sign * t for n, t in zip(normal, drag, strict=True)))
            for kind, sign in ((Watch.SLIPS_BACK, 1.0), (Watch.SLIPS_AHEAD, -1.0))
        ]


def acceleration(linear: Linear) -> Probe:
    """Return p̈ without the forces of rigid rows, as a function of displacement and velocity."""
    through = linear.rows.T @ linear.springs
    position = -through @ linear.rows - np.diag(linear.stiffness)
    velocity = -(linear.rows.T * linear.dampers) @ linear.rows
    return Probe(linear.force - through @ linear.offsets, position, velocity)


def _nothing(count: int, size: int) -> Probe:
    return Probe(np.zeros(count), np.zeros((count, size)), np.zeros((count, size)))


def _put(target: Probe, rows: np.ndarray, values: Probe) -> None:
    for whole, part in zip(vars(target).values(), vars(values).values(), strict=True):
        whole[rows] = part


def all_open(system: System) -> Conditions:
    """Return the conditions without contact."""
    return Conditions(np.full(len(system.gap), Status.OPEN, np.int64), np.zeros(len(system.gap), np.int64))
