"""Friction with sticking: when a section of a journal slips and when it sticks again, and what its spring stores.

A tangential spring of stiffness k holds a section that sticks, and gives way where its force reaches μ F: the cone with
tangential compliance (P. A. Cundall and O. D. L. Strack, Géotechnique 29 (1979) 47-65), by default as stiff as round
contacts that stick (R. D. Mindlin, J. Appl. Mech. 16 (1949) 259-268). While it slips the spring is stretched by μ F/k
along s/|s| and moves with the contact by that rate, so that the slip itself has the speed

    λ = v · s/|s| − μ Ḟ/k.

It sticks again where λ falls below zero, with s = (μ F/k) s/|s|. A contact begins slipping along its velocity. Where
the direction of sliding changes, that of friction follows over a way of μ F/k and 2 % of the clearance: over the first
alone steps would be those of a much stiffer system.
"""

import numpy as np

from gudgeon.solver.integrators.turning.arrays import DEFLECTION, Model, Work, pushes_of
from gudgeon.solver.integrators.turning.touching.columns import ALONG, DEFLECTING, FORCE, GRIP


def differentiation(count: int) -> np.ndarray:
    """Return the matrix of the derivative at evenly spaced values over [0, 1], (count, count), by their polynomial."""
    x = np.linspace(0.0, 1.0, count)
    differences = x[:, None] - x + np.eye(count)
    weights = 1.0 / differences.prod(axis=1)
    D = weights / weights[:, None] / differences
    np.fill_diagonal(D, 0.0)
    np.fill_diagonal(D, -D.sum(axis=1))
    return D


def polynomial(values: np.ndarray, position: float) -> float:
    """Return the value at a place of [0, 1] of the polynomial through evenly spaced ones."""
    x = np.linspace(0.0, 1.0, len(values))
    differences = position - x
    if (coincident := np.flatnonzero(differences == 0)).size:
        return float(values[coincident[0]])
    weights = 1.0 / ((x[:, None] - x + np.eye(len(x))).prod(axis=1) * differences)
    return float(weights @ values / weights.sum())


class Cones:
    """The cones of all sections."""

    def __init__(self, model: Model, work: Work, looks: int) -> None:
        """
        Args:
            looks: Times of a step at which sections are looked at.
        """
        self._model, self._work = model, work
        self._rates = differentiation(looks)
        self.sections = np.flatnonzero(model.touch_friction[:, 2] > 0)

    def margins(self, looks: np.ndarray, span: float) -> dict[int, np.ndarray]:
        """Return of each cone that presses what is above zero while it goes on to stick or to slip, (looks,) each.

        Args:
            looks: What sections do at the looks, (looks, c, columns).
            span: From the first look to the last [s].
        """
        margins = {}
        for i in (int(s) for s in self.sections if self._work.touching[s]):
            if not self._work.slipping[i]:
                margins[i] = looks[:, i, GRIP]
                continue
            mu, _, stiffness, _ = self._model.touch_friction[i]
            margins[i] = looks[:, i, ALONG] - mu / stiffness * (self._rates @ looks[:, i, FORCE]) / span
        return margins

    def begin(self, i: int, looked: np.ndarray, state: np.ndarray) -> None:
        """Let a contact that begins slip along its velocity."""
        if self._model.touch_friction[i, 2] == 0:
            return
        v = looked[DEFLECTING : DEFLECTING + 2]  # Of a spring without deflection, whether it sticks or not.
        speed = float(np.linalg.norm(v))
        self._work.slipping[i] = speed > 0
        self._set(i, state, v / speed * self._usual(i) if speed > 0 else np.zeros(2))

    def end(self, i: int, state: np.ndarray) -> None:
        """Let the spring of a contact that ends be relaxed."""
        self._work.slipping[i] = False
        self._set(i, state, np.zeros(2))

    def turn(self, i: int, looked: np.ndarray, state: np.ndarray) -> None:
        """Let a section slip that sticks, or the other way round."""
        if self._work.slipping[i]:
            mu, _, stiffness, _ = self._model.touch_friction[i]
            s = self._of(state)[i]
            self._set(i, state, s * (mu * looked[FORCE] / stiffness / max(float(np.linalg.norm(s)), 1e-300)))
        self._work.slipping[i] = not self._work.slipping[i]

    def _usual(self, i: int) -> float:
        """Return a deflection that keeps a direction [m]."""
        return float(self._model.touch_friction[i, 3])

    def _of(self, state: np.ndarray) -> np.ndarray:
        return pushes_of(state, len(self._model.touch_pair))[:, DEFLECTION : DEFLECTION + 2]

    def _set(self, i: int, state: np.ndarray, deflection: np.ndarray) -> None:
        self._of(state)[i] = deflection


def stored(model: Model, work: Work) -> np.ndarray:
    """Return what the tangential springs store in a state that was observed [J], (c,)."""
    mu, stiffness = model.touch_friction[:, 0], model.touch_friction[:, 2]
    spring_force = stiffness * np.linalg.norm(work.deflection, axis=1)
    force = np.where(work.slipping > 0, mu * work.touch[:, FORCE], spring_force)
    return np.divide(0.5 * force**2, stiffness, out=np.zeros_like(force), where=stiffness > 0)
