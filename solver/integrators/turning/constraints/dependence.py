"""How near rows of joints are to depend on each other, whatever masses and units: in a metric of motions alone.

A translation by the size of the mechanism, a rotation by one radian and a deformation by that size have length 1; each
row is scaled to length 1. In the metric of the inertia, which the time loop solves in, rows of a light body between
heavy ones are nearly parallel everywhere.
"""

from itertools import pairwise

import numpy as np
from scipy import linalg

from gudgeon.solver.integrators.turning.arrays import NONE, Model, Work
from gudgeon.solver.integrators.turning.energy import inertia_factor

NEAR = 1e-3
"""Pivot over the largest one of a run, below which a position counts as singular."""


def roots(model: Model) -> list[np.ndarray]:
    """Return the motions of each body that have length 1: velocity, angular velocity, modal rates, (6 + m,) each."""
    # A coordinate of unit modal mass moves its body by about 1/√mass.
    return [
        np.concatenate([np.full(3, model.size), np.ones(3), np.full(int(count), model.size * np.sqrt(mass))])
        for count, mass in zip(model.elastic[:, 0], model.mass, strict=True)
    ]


def spans(model: Model) -> list[slice]:
    """Return the part of each body among the velocities of all, 6 + m numbers each."""
    ends = np.cumsum([0, *(6 + model.elastic[:, 0])])
    return [slice(*two) for two in pairwise(ends)]


def rigid_columns(model: Model) -> np.ndarray:
    """Return which motions of these are those of rigid bodies, (6 n + E's,)."""
    return np.concatenate([np.arange(6 + int(count)) < 6 for count in model.elastic[:, 0]])


def kinematic_rows(model: Model, work: Work) -> np.ndarray:
    """Return the change of all rows with these motions, of the poses that `work` has, (m, 6 n + E's)."""
    return _rows(model, work, [np.diag(r) for r in roots(model)])


def jacobian(model: Model, work: Work) -> np.ndarray:
    """Return them each scaled to length 1, (m, 6 n + E's)."""
    return unit_rows(kinematic_rows(model, work))


class Dependence:
    """Whether a run passes positions in which joints depend on each other."""

    def __init__(self, model: Model, work: Work, rank: int) -> None:
        """
        Args:
            rank: Of the rows elsewhere.
        """
        self._model, self._work, self._rank = model, work, rank
        self._usual = 0.0

    def passes(self, smallest: float, near: bool, higher: bool) -> bool:
        """Return whether a step that is taken, whose end `work` has, passes such a position.

        Args:
            smallest: Least pivot of its stages in the metric of the inertia. Its ratio to that of its end is that of
                the pivots of motions alone.
            near: Whether it may: this pivot is small beside those of other steps.
            higher: Whether this pivot is much larger than those before, so that those of motions alone are read again.
        """
        if higher:
            self._usual = max(self._usual, self._pivot(jacobian(self._model, self._work)))
        if not near:
            return False
        pivot, inertial = self._pivot(jacobian(self._model, self._work)), self._pivot(self._inertial())
        return pivot * min(1.0, smallest / inertial) < NEAR * self._usual

    def _pivot(self, rows: np.ndarray) -> float:
        """Return the square of the sine of the least angle of an independent row to those before it."""
        diagonal = np.abs(linalg.qr(rows.T, mode="r", pivoting=True)[0].diagonal())
        return float(diagonal[self._rank - 1] ** 2)

    def _inertial(self) -> np.ndarray:
        """Return the rows, of length 1 in the metric of the inertia."""
        model, work = self._model, self._work
        return unit_rows(_rows(model, work, [_inverse_root(model, work, b) for b in range(len(model.mass))]))


def _rows(model: Model, work: Work, scales: list[np.ndarray]) -> np.ndarray:
    """Return the rows in a metric whose inverse has these roots of each body."""
    m, columns = len(model.row_terms), spans(model)
    rows = np.zeros((m, columns[-1].stop))
    for i in range(m):
        for p, b in enumerate(work.block_owner[i]):
            if b != NONE:
                rows[i, columns[b]] += work.block[i, p, : len(scales[b])] @ scales[b]
    return rows


def unit_rows(rows: np.ndarray) -> np.ndarray:
    """Return rows scaled to length 1, but those of zeros."""
    lengths = np.linalg.norm(rows, axis=1, keepdims=True)
    return rows / np.where(lengths > 0, lengths, 1.0)


def _inverse_root(model: Model, work: Work, b: int) -> np.ndarray:
    """Return N with N Nᵀ the inverse of a body's inertia, of the pose that `work` has, (6 + m, 6 + m)."""
    m = int(model.elastic[b, 0])
    root = np.zeros((6 + m, 6 + m))
    root[:3, :3] = np.eye(3) / np.sqrt(model.mass[b])
    if m:
        inverse = np.linalg.inv(inertia_factor(model, work, b)).T
        root[3:6, 3:], root[6:, 3:] = work.turn[b] @ inverse[m:], inverse[:m]
        return root
    values, vectors = np.linalg.eigh(work.back[b])
    root[3:, 3:] = (vectors * np.sqrt(values)) @ vectors.T
    return root
