"""Capacitances of conductors over the pose of those that move: tensor cubic splines, and forces as their gradient.

The pose is a translation [m] and a rotation vector [rad] from the place in the scene. With the co-energy
W = ½ Vᵀ C(pose) V the generalised force at given potentials is ∂W/∂pose = ½ Vᵀ (∂C/∂pose) V, also where some of the
potentials are those of floating conductors (with given charges the energy that they keep changes, the force does not).
Since one C is differentiated, work around a closed path is zero but for round-off.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.field import POSE_AXES, PoseGridRecord
from gudgeon.solver.errors import SolverError

DEGREE = 3
SMALL = 1e-4
"""Rotation [rad] below which series replace quotients of small numbers."""


class Interaction(NamedTuple):
    """What acts on the moving conductors at a pose."""

    co_energy: float
    """½ Vᵀ C V [J]."""
    gradient: np.ndarray
    """Generalised forces: of the grid's axes, in their order [N, N m/rad], (axes,)."""
    force: np.ndarray
    """[N], (3,); 0 along directions that have no axis in the grid."""
    torque: np.ndarray
    """About the moved pivot [N m], (3,); 0 where the grid has no rotation."""
    potentials: np.ndarray
    """Of all conductors, those of floating ones found [V], (k,)."""


@dataclass(frozen=True)
class PoseField:
    """Capacitance matrix interpolated over a grid of poses."""

    axes: Mapping[str, np.ndarray]
    """Grid values of each axis that has them, ascending, at least four, in the order of `POSE_AXES`."""
    values: np.ndarray
    """C at the grid's points [F], (n₁, …, n_d, k, k)."""

    @classmethod
    def of(cls, record: PoseGridRecord) -> "PoseField":
        """Return the field of a record."""
        shape = tuple(map(len, record.axes.values()))
        return cls(record.axes, record.capacitance.reshape(*shape, *record.capacitance.shape[1:]))

    @cached_property
    def splines(self) -> tuple[list[np.ndarray], np.ndarray]:
        """Knots of each axis, and the tensor's coefficients, of the shape of the values."""
        from scipy.interpolate import make_interp_spline  # Late, as in `co_energy`.

        knots, coefficients = [], self.values
        for i, nodes in enumerate(self.axes.values()):
            spline = make_interp_spline(nodes, coefficients, k=min(DEGREE, len(nodes) - 1), axis=i)
            knots.append(np.asarray(spline.t))
            coefficients = np.moveaxis(np.asarray(spline.c), 0, i)
        return knots, coefficients

    def capacitance(self, pose: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
        """Return C [F] (k, k) and its derivatives by the grid's axes [F/m, F/rad], (axes, k, k).

        Raises:
            SolverError: the pose is outside of the grid, not a number, or has a component that the grid has not.
        """
        knots, coefficients = self.splines
        rows = [_basis(t, x) for t, x in zip(knots, self._place(pose), strict=True)]
        local = coefficients[tuple(slice(start, start + len(values)) for start, values, _ in rows)]
        value = local
        for _, values, _ in rows:
            value = np.tensordot(values, value, axes=(0, 0))
        slopes = []
        for chosen in range(len(rows)):
            slope = local
            for i, (_, values, derivatives) in enumerate(rows):
                slope = np.tensordot(derivatives if i == chosen else values, slope, axes=(0, 0))
            slopes.append(slope)
        return value, np.array(slopes)

    def interaction(
        self, pose: Mapping[str, float], potentials: np.ndarray, charges: np.ndarray | None = None
    ) -> Interaction:
        """Return co-energy and forces at a pose; see `capacitance` for what is raised.

        Args:
            potentials: [V], (k,); NaN for floating conductors.
            charges: Of floating conductors [C], (k,); default: 0.
        """
        C, slopes = self.capacitance(pose)
        V = potentials_of(C, potentials, np.zeros(len(C)) if charges is None else charges)
        gradient = 0.5 * np.einsum("i,aij,j->a", V, slopes, V)
        by_axis = dict(zip(self.axes, gradient, strict=True))
        force, turning = (
            np.array([by_axis.get(name, 0.0) for name in names]) for names in (POSE_AXES[:3], POSE_AXES[3:])
        )
        rotation = np.array([pose.get(name, 0.0) for name in POSE_AXES[3:]])
        torque = np.linalg.solve(left_jacobian(rotation).T, turning) if turning.any() else turning
        return Interaction(float(0.5 * V @ C @ V), gradient, force, torque, V)

    def _place(self, pose: Mapping[str, float]) -> list[float]:
        for name, value in pose.items():
            if name not in self.axes and value != 0:
                raise SolverError(f"pose: {name} = {value:g} given; the grid has the axes {', '.join(self.axes)} only")
        coordinates = []
        for name, nodes in self.axes.items():
            value = float(pose.get(name, 0.0))
            if not nodes[0] <= value <= nodes[-1]:
                unit = "m" if name in POSE_AXES[:3] else "rad"
                raise SolverError(
                    f"pose: {name} = {value:.6g} {unit} is outside of the grid, {nodes[0]:.6g} to {nodes[-1]:.6g}"
                )
            coordinates.append(value)
        return coordinates


def potentials_of(C: np.ndarray, potentials: np.ndarray, charges: np.ndarray) -> np.ndarray:
    """Return all potentials [V] of conductors, (k,): NaN stands for a floating one, whose charge [C] is given."""
    floating = np.isnan(potentials)
    V = np.where(floating, 0.0, potentials)
    if floating.any():
        V[floating] = np.linalg.solve(C[np.ix_(floating, floating)], (charges - C @ V)[floating])
    return V


def left_jacobian(rotation: np.ndarray) -> np.ndarray:
    """Return J, (3, 3), with which a rotation vector θ (3,) that changes turns at the angular velocity J dθ/dt."""
    angle = float(np.linalg.norm(rotation))
    x, y, z = rotation
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < SMALL:
        return np.eye(3) + skew / 2 + skew @ skew / 6
    return np.eye(3) + (1 - np.cos(angle)) / angle**2 * skew + (angle - np.sin(angle)) / angle**3 * skew @ skew


def _basis(knots: np.ndarray, x: float) -> tuple[int, np.ndarray, np.ndarray]:
    """Return the first spline that is not zero at x, and values and derivatives of all that are not (de Boor 1972)."""
    degree = int(np.searchsorted(knots, knots[0], side="right")) - 1
    last_span = len(knots) - degree - 2
    span = min(max(int(np.searchsorted(knots, x, side="right")) - 1, degree), last_span)
    values, slopes = np.ones(1), np.zeros(1)
    for order in range(1, degree + 1):
        lower = values
        knots_below = knots[span - order + 1 : span + 1]
        knots_above = knots[span + 1 : span + order + 1]
        ratio = lower / (knots_above - knots_below)
        values = np.zeros(order + 1)
        values[:-1] += ratio * (knots_above - x)
        values[1:] += ratio * (x - knots_below)
        if order == degree:
            slopes = np.zeros(order + 1)
            slopes[:-1] -= degree * ratio
            slopes[1:] += degree * ratio
    return span - degree, values, slopes


def cell_errors(axes: Sequence[np.ndarray], values: np.ndarray) -> np.ndarray:
    """Return the estimated error of the interpolated C in each cell, relative to the largest |C|, (n₁ − 1, …, n_d − 1).

    Along one axis after the other, the splines of every second point are compared with the points between them. Of
    fourth order, those of all points have a sixteenth of that error; the fifteenth part is taken. A cell has the sum
    over the axes, of each the largest at its corners.
    """
    from scipy.interpolate import make_interp_spline

    total = np.zeros([len(nodes) - 1 for nodes in axes])
    scale = np.abs(values).max()
    for i, nodes in enumerate(axes):
        coarse = np.unique([*range(0, len(nodes), 2), len(nodes) - 1])
        spline = make_interp_spline(nodes[coarse], np.take(values, coarse, axis=i), k=min(3, len(coarse) - 1), axis=i)
        missed = np.abs(np.asarray(spline(nodes)) - values).max(axis=(-2, -1)) / 15 / scale
        for j in range(len(axes)):
            low, high = (np.take(missed, np.arange(a, missed.shape[j] + a - 1), axis=j) for a in (0, 1))
            missed = np.maximum(low, high)
        total += missed
    return total
