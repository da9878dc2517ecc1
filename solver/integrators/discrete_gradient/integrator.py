"""The discrete-gradient integrator: exact energy at any step, second order in time."""

import numpy as np

from gudgeon.solver import capabilities
from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.balance import LOST
from gudgeon.solver.integrators.discrete_gradient import kernel
from gudgeon.solver.integrators.impact_log import Located, impact_log
from gudgeon.solver.integrators.outcome import START_ENERGY, Outcome, Samples
from gudgeon.solver.integrators.polynomial_response import free, responses
from gudgeon.solver.integrators.uncoupled import SLOWEST, uncoupled
from gudgeon.solver.result import Result
from gudgeon.solver.system.system import System


class DiscreteGradient(capabilities.DiscreteGradient):
    """A run of steps `dt`."""

    failure = Result.NOT_CONVERGED

    def __init__(self, system: System, dt: float) -> None:
        self._system, self._place = system, uncoupled(system)
        rows, omega, start = self._place.rows, self._place.omega, self._place.start
        c, push = len(rows), np.array(responses(omega, 0, np.array([dt])))[:, 0, 0].copy()
        self._step = kernel.Step(
            dt=dt, free=free(omega, dt), push=push, constant=self._place.constant, rows=rows,
            gap=system.gap, reach=(rows * push[0]) @ rows.T, law=_laws(system), floor=SLOWEST, stiffness=omega**2,
            start=start, contact=system.contact_of, directions=system.directions,
        )  # fmt: skip
        balance = np.zeros(LOST + 1)
        balance[START_ENERGY] = self._place.energy
        self._state = kernel.State(
            y=start.copy(), v=self._place.speed.copy(), depth=-(system.gap + rows @ start),
            force=system.start_forces.copy(), approach=np.zeros(c), fastest=np.zeros(1), balance=balance,
            counts=np.zeros(2, np.int64), impulses=np.zeros(c), log=impact_log(system.first_rows, dt, system.window),
        )  # fmt: skip
        self._located = Located(self._state.log)

    def advance(self, first: int, stride: int, out: Samples) -> bool:
        """Fill all but the loads of samples of `stride` steps; False where the run cannot continue."""
        system, modes, n = self._system, self._place.modes, len(self._state.y)
        pressed, y, v = np.zeros((len(out.forces), len(system.gap))), *np.zeros((2, len(out.forces), n))
        found = kernel.Samples(pressed, out.energies, y, v)
        sound = kernel.march(self._step, self._state, first, stride, found)
        for number, item in enumerate(system.contacts):
            out.forces[:, number] = pressed[:, item.rows] @ item.directions
        p, v = y @ modes.T, v @ modes.T
        out.set_states(slice(None), system, p, v, pressed)
        out.peaks.keep_highest(first // stride, out.forces, p, v, pressed)
        if sound and not self._located.take():
            self.failure = Result.IMPACTS
            return False
        return bool(sound)

    def impacts(self) -> list[np.ndarray]:
        return self._located.impacts()

    def outcome(self) -> Outcome:
        state, modes = self._state, self._place.modes
        in_contact, iterations = map(int, state.counts)
        extreme = np.array([*state.balance[:LOST], state.depth.max(initial=0.0)])
        return Outcome(
            q=modes @ state.y, v=modes @ state.v, multipliers=state.force.copy(), impulses=state.impulses.copy(),
            extreme=extreme, counts=np.array([0, in_contact, iterations, -1]),
        )  # fmt: skip


def _laws(system: System) -> np.ndarray:
    """Return the law of every row, a linear one where the scene states none, (c, 4).

    Raises:
        SceneError: a row has a law in series with R.
    """
    laws = system.law.copy()
    series = system.residual.diagonal()
    for item in system.contacts:
        rows = np.arange(item.rows.start, item.rows.stop)
        nonlinear = rows[(laws[rows, 0] > 0) & (system.layer[rows] == 0)]
        if len(nonlinear) and series[nonlinear].any():
            raise SceneError(
                f"contact.{item.name}.law: integrator 'discrete-gradient' needs a law without R; use method 'penalty',"
                " or integrator 'collocation'"
            )
        linear = np.setdiff1d(rows, nonlinear)
        compliance = system.compliance.diagonal()[linear]
        laws[linear, 0], laws[linear, 1] = 1 / compliance, 1.0
    return laws
