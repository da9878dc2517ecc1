"""The shapes that bodies start with: those that joints, loads, gravity and inertia give them in the rigid motion.

In the motion of a mechanism whose bodies do not vibrate, elastic coordinates q follow what acts on them:
Λ q = f + Gᵀ λ, where f has loads, gravity and the inertia of the rigid motion, and λ are the forces of the joints of
bodies that keep their shape. With elastic coordinates of the mass τ² Λ, τ far above the periods of their modes, the
equations of motion give the forces of bodies that hardly deform further, and what is out of balance, τ² q̈ =
Λ⁻¹ (f + Gᵀ λ) − q: the shape is where it vanishes on the joints, by Anderson's mixing of these changes (D. G. Anderson,
J. ACM 12 (1965) 547), which converges where the changes alone do not, as of bodies that rotation stiffens.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.solver import core
from gudgeon.solver.integrators.turning.arrays import SPEED, SPIN, TURN, WIDTH, Model, Work
from gudgeon.solver.integrators.turning.energy import bodies_of, inertia_factor, modal_parts

HEAVY = 1e9
"""Factor on the mass of elastic coordinates that are to keep their values, on the mass of bodies whose velocity is
given, and on the inertia of those whose angular velocity is given."""
SLOWER = 1e3
"""τ over the reciprocal frequency of a body's slowest mode."""
SETTLED, ACCEPTED = 1e-11, 1e-6
"""Change of a shape over its size at which the search ends, and up to which it counts where it ends by the number of
its steps."""
STEPS = 100
UNFELT = 1e-6
"""Displacement over the size of the mechanism of which a shape counts as one at least."""
ASIDE, DRIVEN = 1e-4, 1e-3
"""Change of a shape over its size by which its stability is looked at, and growth of what leaves it, over its return by
the stiffness of its body alone, from which on it is not stable."""
AHEAD = 1e-3
"""Rotation, or motion over the size of the mechanism, over which the rate of the shapes is found."""
LONG = 1e9
"""Time over which a mechanism moves by less than that which is at rest [s]."""


class Moment(NamedTuple):
    """Drives (d, 3) and loads (l,) at a time."""

    drives: np.ndarray
    amounts: np.ndarray


def stiff(model: Model) -> Model:
    """Return a model whose elastic coordinates hardly move: their mass is larger."""
    return model._replace(modal_root=model.modal_root * np.sqrt(HEAVY))


def without_rates(model: Model, work: Work, state: np.ndarray) -> None:
    """Set the modal momenta such that no elastic coordinate changes, and the spins that the angular velocities have."""
    core.Turning(model, work).observe(state)
    for b in map(int, np.flatnonzero(model.elastic[:, 0])):
        m, spin = int(model.elastic[b, 0]), slice(WIDTH * b + SPIN, WIDTH * b + SPIN + 3)
        turn, L = work.turn[b], inertia_factor(model, work, b)
        omega = np.linalg.solve((L @ L.T)[m:, m:], turn.T @ state[spin])
        _set_momenta(model, work, state, b, np.concatenate([np.zeros(m), omega]))


def _set_momenta(model: Model, work: Work, state: np.ndarray, b: int, rates: np.ndarray) -> None:
    """Set the modal momenta and the spin of a body of modal rates and angular velocity along its axes, (m + 3,)."""
    m, spin, L = int(model.elastic[b, 0]), slice(WIDTH * b + SPIN, WIDTH * b + SPIN + 3), inertia_factor(model, work, b)
    momenta = L @ (L.T @ rates)
    state[spin] = work.turn[b] @ momenta[m:]
    modal_parts(model, state, b)[1][:] = momenta[:m]


class Shapes:
    """Finds the shapes of a mechanism's bodies in its motion."""

    def __init__(self, model: Model, work: Work) -> None:
        self._model, self._work = model, work
        used = np.arange(model.modal_stiffness.shape[1]) < model.elastic[:, :1]
        masses = np.einsum("bkl,bkl->bk", model.modal_root, model.modal_root)
        slowest = np.where(used, masses, 0.0).max(axis=1, initial=0.0) / np.where(
            used, model.modal_stiffness, np.inf
        ).min(axis=1, initial=np.inf)
        self._squares = SLOWER**2 * slowest
        """τ² of each body [s²], (n,)."""
        roots = np.sqrt(self._squares[:, None] * np.where(used, model.modal_stiffness, 0.0))
        self._slow = model._replace(modal_root=np.ascontiguousarray(roots[:, :, None] * np.eye(roots.shape[1])))
        self._turning = core.Turning(self._slow, work)
        self._flexible = [int(b) for b in np.flatnonzero(model.elastic[:, 0])]
        self._ends = np.cumsum(model.elastic[self._flexible, 0])[:-1]

    def start(self, state: np.ndarray, moment: Moment) -> bool:
        """Give the bodies of a state, which obeys the joints and whose shapes keep, their shapes and their rates; False
        where there are none that are stable: the state is then as it was."""
        before = state.copy()
        if self.settle(state, moment) and self._stable(state, moment):
            self._follow(state, moment)
            return True
        state[:] = before
        return False

    def settle(self, state: np.ndarray, moment: Moment) -> bool:
        """Give the bodies of a state their shapes; False where none are found: the state is then as it was."""
        before, changes, shapes, worst = state.copy(), [], [], np.inf
        for _ in range(STEPS):
            shape = self._shape(state)
            changes.append(self._change(state, moment))
            shapes.append(shape + changes[-1])
            size = max(float(np.abs(shapes[-1]).max()), np.finfo(float).tiny)
            worst = float(np.abs(changes[-1]).max()) / size
            if worst <= SETTLED or not np.isfinite(worst):
                break
            mixed = shapes[-1]
            if len(changes) > 1:
                steps = np.diff(changes, axis=0).T
                weights = np.linalg.lstsq(steps, changes[-1], rcond=1e-12)[0]
                mixed = mixed - np.diff(shapes, axis=0).T @ weights
            self._set(state, mixed, moment)
        if worst <= ACCEPTED:
            return True
        state[:] = before
        return False

    def _stable(self, state: np.ndarray, moment: Moment) -> bool:
        """Return whether what acts on the bodies drives no further what leaves the shapes of a state."""
        shape, change = self._shape(state), self._change(state, moment)
        floor = UNFELT * self._model.size * np.sqrt(self._model.mass.sum())
        size = ASIDE * max(float(np.abs(shape).max()), floor)
        columns = np.empty((len(shape), len(shape)))
        for k, unit in enumerate(np.eye(len(shape))):
            beside = state.copy()
            self._turning.observe(state)
            self._set(beside, shape + size * unit, moment)
            columns[:, k] = (self._change(beside, moment) - change) / size
        self._turning.observe(state)
        return bool(np.linalg.eigvals(columns).real.max() < DRIVEN)

    def _follow(self, state: np.ndarray, moment: Moment) -> None:
        """Let the shapes of a state, which `settle` found, change as the motion changes them; loads stay."""
        rates = self._rates(state, moment)
        for b, coordinates in zip(self._flexible, np.split(rates, self._ends), strict=True):
            omega = self._work.turn[b].T @ self._work.omega[b]
            _set_momenta(self._slow, self._work, state, b, np.concatenate([coordinates, omega]))
        self._turning.match(state, moment.drives)
        self._turning.observe(state)
        omegas, modal = self._work.omega.copy(), self._work.modal[:, 3:].copy()
        core.Turning(self._model, self._work).observe(state)
        for b in self._flexible:
            velocities = np.concatenate([modal[b, : self._model.elastic[b, 0]], self._work.turn[b].T @ omegas[b]])
            _set_momenta(self._model, self._work, state, b, velocities)

    def _rates(self, state: np.ndarray, moment: Moment) -> np.ndarray:
        """Return the rates of the shapes along the motion, (e,), by those before and behind; zero where there are none.
        Poses and angular velocities of the state are left in `Work`."""
        self._turning.begin(state, *moment)
        slope = self._work.slopes[0].copy()
        speeds, changes = (bodies_of(self._model, x)[:, SPEED : SPEED + 3] / self._model.size for x in (state, slope))
        turned = np.einsum("bij,bj->bi", self._model.inverse, bodies_of(self._model, slope)[:, SPIN:])
        swiftest = max(np.abs(x).max() for x in (speeds, self._work.omega))
        swiftest = max(swiftest, np.sqrt(max(np.abs(x).max() for x in (changes, turned))))
        spacing, shapes = AHEAD / max(swiftest, AHEAD / LONG), []
        for h in (-spacing, spacing) if 0 < spacing < LONG else ():
            beside = state + h * slope
            turns = bodies_of(self._model, beside)[:, TURN : TURN + 4]
            turns /= np.linalg.norm(turns, axis=1, keepdims=True)
            drives = moment.drives @ np.array([[1.0, 0.0, 0.0], [h, 1.0, 0.0], [0.5 * h**2, h, 1.0]])
            self._turning.observe(beside)
            self._set(beside, self._shape(state), ahead := Moment(np.ascontiguousarray(drives), moment.amounts))
            if self.settle(beside, ahead):
                shapes.append(self._shape(beside))
        self._turning.observe(state)
        return (shapes[1] - shapes[0]) / (2 * spacing) if len(shapes) == 2 else np.zeros(len(self._shape(state)))

    def _shape(self, state: np.ndarray) -> np.ndarray:
        """Return the elastic coordinates of all bodies, (e,)."""
        return np.concatenate([modal_parts(self._model, state, b)[0] for b in self._flexible])

    def _set(self, state: np.ndarray, shape: np.ndarray, moment: Moment) -> None:
        """Give bodies a shape, close the joints and let velocities obey them."""
        omegas = self._work.omega.copy()
        for b, coordinates in zip(self._flexible, np.split(shape, self._ends), strict=True):
            modal_parts(self._model, state, b)[0][:] = coordinates
        self._turning.close(state, moment.drives)
        self._turning.observe(state)
        for b, turn in enumerate(self._work.turn):
            m = int(self._model.elastic[b, 0])
            L = inertia_factor(self._slow, self._work, b)
            inertia = (L @ L.T)[m:, m:] if m else self._model.inertia[b]
            state[WIDTH * b + SPIN : WIDTH * b + SPIN + 3] = turn @ inertia @ turn.T @ omegas[b]
        self._turning.match(state, moment.drives)
        without_rates(self._slow, self._work, state)

    def _change(self, state: np.ndarray, moment: Moment) -> np.ndarray:
        """Return what the shapes lack, Λ⁻¹ (f + Gᵀ λ) − q, (e,)."""
        self._turning.observe(state)
        self._turning.begin(state, moment.drives, moment.amounts)
        slope, changes = self._work.slopes[0], []
        for b in self._flexible:
            m, spin = int(self._model.elastic[b, 0]), slice(WIDTH * b + SPIN, WIDTH * b + SPIN + 3)
            turn = self._work.turn[b]
            L = inertia_factor(self._slow, self._work, b)
            rates = turn.T @ slope[spin] - np.cross(turn.T @ self._work.omega[b], turn.T @ state[spin])
            momenta = np.concatenate([modal_parts(self._model, slope, b)[1], rates])
            changes.append(self._squares[b] * np.linalg.solve(L @ L.T, momenta)[:m])
        return np.concatenate(changes)
