"""The discrete-gradient integrator: energy to round-off at any step, second order in time."""

import numpy as np

from gudgeon.solver import capabilities
from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.discrete_gradient import kernel as gradient_steps
from gudgeon.solver.integrators.outcome import Outcome, Samples
from gudgeon.solver.integrators.polynomial_response import free, responses
from gudgeon.solver.integrators.uncoupled import SLOWEST, uncoupled
from gudgeon.solver.result import Result
from gudgeon.solver.system.system import System

MOST_IMPACTS = 100_000
"""Kept; what comes after is counted only."""


class DiscreteGradient(capabilities.DiscreteGradient):
    """A run of steps `dt`."""

    failure = Result.NOT_CONVERGED

    def __init__(self, system: System, dt: float) -> None:
        self._system, self._place = system, uncoupled(system)
        rows, omega = self._place.rows, self._place.omega
        c, times = len(rows), np.array([dt])
        y, v = responses(omega, 0, times)
        push = np.array([y[0, 0], v[0, 0]])
        self._step = gradient_steps.Step(
            dt, free(omega, times)[:, 0].copy(), push, self._place.constant, np.ascontiguousarray(rows), system.gap,
            (rows * push[0]) @ rows.T, _laws(system), SLOWEST, omega**2, self._place.modes.T @ system.position,
        )  # fmt: skip
        start, speed = self._place.modes.T @ system.position, self._place.modes.T @ system.velocity
        begun = 0.5 * float(speed @ speed) + 0.5 * float((omega * start) @ (omega * start))
        running = np.zeros((c, 7))
        running[:, 0] = -1.0
        self._state = gradient_steps.State(
            start, speed, -(system.gap + rows @ start), np.zeros(c), np.zeros(c), np.array([0.0, 0.0, 0.0, begun, 0.0]),
            np.zeros(3, np.int64), running, np.zeros((MOST_IMPACTS if c else 0, 8)), np.zeros(c),
        )  # fmt: skip
        self._time = 0.0

    def advance(self, first: int, stride: int, out: Samples) -> bool:
        """Advance `len(out.forces)` samples of `stride` steps; False where a force could not be found.

        Args:
            first: Number of the first step.
            out: Filled, but for what this integrator has none of.
        """
        system, modes, n = self._system, self._place.modes, len(self._state.y)
        pressed, y, v = np.zeros((len(out.forces), len(system.gap))), *np.zeros((2, len(out.forces), n))
        found = gradient_steps.Samples(pressed, out.energies, y, v)
        sound = gradient_steps.march(self._step, self._state, first, stride, found)
        for number, item in enumerate(system.contacts):
            out.forces[:, number] = pressed[:, item.rows] @ item.directions
        p, speed, r = y @ modes.T, v @ modes.T, len(system.rigid)
        out.snapshots[:, :r], out.snapshots[:, r : 2 * r] = p[:, system.rigid], speed[:, system.rigid]
        if out.gauges.shape[1]:
            out.gauges[:] = p @ system.gauge_rows.T + pressed @ system.gauge_residual.T
        self._time = (first + stride * len(out.forces)) * self._step.dt
        return bool(sound)

    def outcome(self) -> Outcome:
        """Return where the run stands."""
        state, system, none = self._state, self._system, np.empty(0)
        found = state.impacts[: min(int(state.counts[2]), len(state.impacts))]
        going = [np.concatenate([[i], entry]) for i, entry in enumerate(state.running) if entry[0] >= 0]
        for entry in going:
            entry[2] = self._time
        every = np.array([*found, *going]).reshape(-1, 8)
        impacts = []
        for item in system.contacts:
            mine = every[(every[:, 0] >= item.rows.start) & (every[:, 0] < item.rows.stop), 1:]
            impacts.append(mine[np.argsort(mine[:, 0], kind="stable")])
        starts = every[:, 1].min() if len(every) else -1.0
        ends = every[:, 2].max() if len(every) else -1.0
        balance = state.balance
        extreme = np.array(
            [balance[3], balance[1], balance[2], float(max(state.depth.max(initial=0.0), 0.0)), starts, ends]
        )
        counts = np.array([0, int(state.counts[0]), int(state.counts[1]), -1])
        modes = self._place.modes
        return Outcome(
            modes @ state.y, modes @ state.v, state.force.copy(), state.impulses.copy(), extreme, counts, none, none,
            np.zeros(max(1, len(system.contacts))), impacts=impacts, work={"impacts": int(state.counts[2])},
        )  # fmt: skip


def _laws(system: System) -> np.ndarray:
    """Return the law of every row, linear where it has none, (c, 4).

    Raises:
        SceneError: a law and R stand one behind the other.
    """
    laws = system.law.copy()
    series = system.residual.diagonal()
    for item in system.contacts:
        rows = np.arange(item.rows.start, item.rows.stop)
        nonlinear = rows[(laws[rows, 0] > 0) & (system.layer[rows] == 0)]
        if len(nonlinear) and series[nonlinear].any():
            raise SceneError(
                f"contact.{item.name}.law: 'discrete-gradient' takes a law without R; use method 'penalty', or"
                " integrator 'collocation'"
            )
        linear = np.setdiff1d(rows, nonlinear)
        compliance = system.compliance.diagonal()[linear]
        laws[linear, 0], laws[linear, 1] = 1 / compliance, 1.0
    return laws
