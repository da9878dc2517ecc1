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
    def rows(self) -> np.ndarray:
        """∂g/∂q, full as the matrices of regimes, (c, n)."""
        return self.system.rows.dense()

    @cached_property
    def tangents(self) -> np.ndarray:
        """Displacement along the lines of friction, (c, n)."""
        return self.system.tangents.dense()

    @cached_property
    def compliance(self) -> np.ndarray:
        """R + surface layer [m/N], (c, c)."""
        return self.system.compliance.dense()

    @cached_property
    def frictional(self) -> np.ndarray:
        """Rows with friction, (c,) bool."""
        return self.system.friction[:, 0] > 0

    @cached_property
    def alone(self) -> np.ndarray:
        """Rows whose gap does not change by other rows' forces through R, (c,) bool."""
        return ~self.system.residual.beside_diagonal()

    def regime(self, state: Conditions, p: np.ndarray, zero: Set[int] = frozenset()) -> Regime:
        """Return the equations for displacements from a state p, (n,), at which the gaps of rows `zero` are zero."""
        gaps = self.system.gap + self.rows @ p
        gaps[[row for row in zero if self.alone[row]]] = 0.0
        linear, soft, hard, stuck = self._linear(state, p, gaps)
        forces, tangential = self._forces(state, linear, soft, hard, stuck)
        watched, events = self._watched(state, gaps, forces, tangential)
        return Regime(linear, forces, tangential, watched, events)

    def _linear(
        self, state: Conditions, p: np.ndarray, gaps: np.ndarray
    ) -> tuple[Linear, np.ndarray, np.ndarray, np.ndarray]:
        system, springs = self.system, self.system.springs
        closed = state.status == Status.CLOSED
        soft = np.flatnonzero(closed & ~system.rigid_contact)
        hard = np.flatnonzero(closed & system.rigid_contact)
        stuck = hard[self.frictional[hard] & (state.slip[hard] == 0)]
        compliance = self.compliance[np.ix_(soft, soft)]
        inverse = np.linalg.inv(compliance) if len(soft) else np.zeros((0, 0))
        both = np.zeros((len(soft) + len(springs.stiffness),) * 2)
        both[: len(soft), : len(soft)] = 0.5 * (inverse + inverse.T)
        both[len(soft) :, len(soft) :] = np.diag(springs.stiffness)
        drag = (state.slip[hard] * system.friction[hard, 1])[:, None] * self.tangents[hard]
        linear = Linear(
            stiffness=system.stiffness, force=system.driving.gravity - system.stiffness * p,
            rows=np.vstack([self.rows[soft], springs.rows]),
            offsets=np.concatenate([gaps[soft], springs.stretch + springs.rows @ p]), springs=both,
            dampers=np.concatenate([system.dashpot[soft], springs.damping]),
            rigid=np.vstack([self.rows[hard], self.tangents[stuck]]),
            pushed=np.vstack([self.rows[hard] - drag, self.tangents[stuck]]),
        )  # fmt: skip
        return linear, soft, hard, stuck

    def _forces(
        self, state: Conditions, linear: Linear, soft: np.ndarray, hard: np.ndarray, stuck: np.ndarray
    ) -> tuple[Probe, Probe]:
        c, n = self.rows.shape
        normal, tangential = np.zeros((2, c, 1 + 2 * n))
        if len(soft):
            inverse, rows = linear.springs[: len(soft), : len(soft)], linear.rows[: len(soft)]
            elastic = inverse @ linear.offsets[: len(soft)], inverse @ rows
            normal[soft] = -np.column_stack([*elastic, linear.dampers[: len(soft), None] * rows])
        if len(linear.rigid):
            free = acceleration(linear)
            solve = -np.linalg.solve(linear.rigid @ linear.pushed.T, linear.rigid)
            rigid_forces = Probe.of(solve @ free.constant, solve @ free.position, solve @ free.velocity).matrix
            normal[hard], tangential[stuck] = rigid_forces[: len(hard)], rigid_forces[len(hard) :]
            for row in hard[state.slip[hard] != 0]:
                tangential[row] = -state.slip[row] * self.system.friction[row, 1] * normal[row]
        return Probe(normal), Probe(tangential)

    def _watched(
        self, state: Conditions, gaps: np.ndarray, forces: Probe, tangential: Probe
    ) -> tuple[Probe, list[tuple[Watch, int]]]:
        system, n = self.system, self.rows.shape[1]
        gap_rows = Probe.of(gaps, self.rows, np.zeros_like(self.rows)).matrix
        functions: list[tuple[Watch, int, np.ndarray]] = []
        for row, status in enumerate(state.status):
            gap, couple = gap_rows[row], self.compliance[row]
            if status == Status.OPEN:
                # Its gap with the forces of closed points through R.
                functions.append((Watch.CLOSES, row, gap + couple @ forces.matrix))
            elif status == Status.SLACK:
                force = 1 / couple[row] * gap
                force[1 + n :] = system.dashpot[row] * self.rows[row]
                functions += [(Watch.CLOSES, row, force), (Watch.LEAVES, row, -gap)]
            elif status == Status.CLOSED:
                normal, drag = forces.matrix[row], tangential.matrix[row]
                functions.append((Watch.OPENS, row, normal))
                sign, limit = state.slip[row], system.friction[row, 0]
                if self.frictional[row] and sign:
                    slide = np.concatenate([[-system.belt[row]], np.zeros(n), self.tangents[row]])
                    functions.append((Watch.STICKS, row, sign * slide))
                elif self.frictional[row]:
                    functions += [
                        (Watch.SLIPS_BACK, row, limit * normal - drag),
                        (Watch.SLIPS_AHEAD, row, limit * normal + drag),
                    ]
        watched = np.array([function for _, _, function in functions]).reshape(-1, 1 + 2 * n)
        return Probe(watched), [(kind, row) for kind, row, _ in functions]


def acceleration(linear: Linear) -> Probe:
    """Return p̈ without the forces of rigid rows, as a function of displacement and velocity."""
    through = linear.rows.T @ linear.springs
    position = -through @ linear.rows - np.diag(linear.stiffness)
    velocity = -(linear.rows.T * linear.dampers) @ linear.rows
    return Probe.of(linear.force - through @ linear.offsets, position, velocity)


def at_start(system: System) -> Conditions:
    """Return the conditions of the static equilibrium at the start: rows are closed where they carry a force."""
    closed = system.start_forces > 0
    return Conditions(np.where(closed, Status.CLOSED, Status.OPEN).astype(np.int64), np.zeros(len(closed), np.int64))
