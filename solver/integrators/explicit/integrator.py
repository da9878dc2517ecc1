"""The explicit integrator: an impulse in the middle of each step, exact flight between."""

import numpy as np

from gudgeon.solver import capabilities, core
from gudgeon.solver.contact.compliance import fixed
from gudgeon.solver.contact.lcp import empty_set
from gudgeon.solver.integrators.explicit.arrays import Constants, State
from gudgeon.solver.integrators.impact_log import Located, impact_log
from gudgeon.solver.integrators.outcome import Outcome, Samples
from gudgeon.solver.integrators.polynomial_response import free
from gudgeon.solver.result import Result
from gudgeon.solver.system.system import System

NARROW = 8
"""Rows are short that depend on an eighth of the coordinates on average."""


class Explicit(capabilities.Explicit):
    """A run of the explicit integrator."""

    failure = Result.DEPENDENT_ROWS

    def __init__(self, system: System, dt: float) -> None:
        self._system = system
        self._constants = _constants(system, dt)
        self._state = _state(system, dt)
        self._loop = core.Explicit(self._constants, self._state)
        self._located = Located(self._state.log)

    def advance(self, start_step: int, stride: int, out: Samples) -> bool:
        """Fill forces, energies and gauges of samples of `stride` steps; False where the run cannot continue.

        Energies and gauges are those of a sample's last impulse, half a step before its end, where probes are read.
        """
        # The loop reads no gauges and probes: with any it is called for one sample at a time, with the same bits.
        system = self._system
        pieces, sound = len(out.forces) if system.gauges or system.probes.names else 1, True
        for indices in np.array_split(np.arange(len(out.forces)), pieces):
            span, start = slice(indices[0], indices[-1] + 1), start_step + int(indices[0]) * stride
            sound = self._loop.march(out.part(span), start, stride)
            if not sound:
                break
            if system.gauges:
                out.gauges[indices[0]] = self._gauges()
            if system.probes.names:
                q, v = self._end()
                moved = system.probes.values(q[None], v[None])[0]
                out.probes[indices[0]] = moved + system.probes.pressed @ self._state.multipliers
        if sound and not self._located.take():
            self.failure = Result.IMPACTS
            return False
        return sound

    def _gauges(self) -> np.ndarray:
        """Return the gauges at the last impulse, (G,): the coordinates have moved on from it by half a step."""
        state, (_, qv, _, vv) = self._state, self._constants.flight
        coordinates = self._system.gauge_rows @ (vv * state.q - qv * state.v)
        return coordinates + self._system.gauge_residual @ state.multipliers + self._system.gauge_weights

    def impacts(self) -> list[np.ndarray]:
        return self._located.impacts()

    def _end(self) -> tuple[np.ndarray, np.ndarray]:
        """Return q and q̇ at the end of the last step, half a step before the next impulse, where the state is."""
        state, (qq, qv, vq, vv) = self._state, self._constants.half
        return vv * state.q - qv * state.v, qq * state.v - vq * state.q

    def outcome(self) -> Outcome:
        """Return the motion at the end of the last step."""
        state, (q, v) = self._state, self._end()
        return Outcome(
            q=q, v=v, multipliers=state.multipliers, impulses=state.impulses, extreme=state.extreme, counts=state.counts
        )


def _constants(system: System, dt: float) -> Constants:
    rows, compliance = system.rows.dense(), system.compliance.dense()
    row_bounds = np.abs(rows).max(axis=0, initial=0.0)
    depends = rows != 0.0
    stop = depends.shape[1] - depends[:, ::-1].argmax(axis=1)
    span = np.where(depends.any(axis=1)[:, None], np.column_stack([depends.argmax(axis=1), stop]), 0)
    narrow = bool(NARROW * (span[:, 1] - span[:, 0]).sum() <= depends.size)
    return Constants(
        dt=dt, flight=free(np.sqrt(system.stiffness), dt), half=free(np.sqrt(system.stiffness), dt / 2),
        stiffness=system.stiffness,
        rows=rows, span=span, narrow=narrow,
        columns=np.ascontiguousarray(rows.T), reach=row_bounds,
        gap=system.gap, compliance=compliance, matrix=fixed(compliance), coupled=system.coupled,
        dashpot=system.dashpot, normals=system.directions, contact=system.contact_of, rigid=system.rigid,
    )  # fmt: skip


def _state(system: System, dt: float) -> State:
    """Return the state at the first impulse, half a step after the start."""
    half = free(np.sqrt(system.stiffness), dt / 2)
    v0 = system.velocity
    c, energy = len(system.gap), 0.5 * float(v0 @ v0)
    return State(
        q=half[1] * v0, v=half[3] * v0, active=empty_set(c), multipliers=np.zeros(c), gaps=np.zeros(c),
        free=np.empty(c), jump=np.zeros(len(v0)), carried=np.full(2, np.nan), ends=np.zeros((2, len(v0))),
        impulses=np.zeros(c), work=np.zeros(len(system.rigid) + 1), energy=np.array([energy, 0.0, 0.0, 0.0]),
        counts=np.zeros(4, np.int64), extreme=np.array([energy, 0.0, 0.0, 0.0]),
        log=impact_log(system.first_rows, dt, system.window),
    )  # fmt: skip
