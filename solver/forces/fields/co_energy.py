"""Co-energies of charged conductors over the pose of a body, as arrays that the core reads.

At given potentials V of some conductors and given charges Q of the others, which float,

  G(pose) = ½ V_pᵀ C_pp V_p − ½ (Q − C_fp V_p)ᵀ C_ff⁻¹ (Q − C_fp V_p)

has ∂G/∂pose as its generalised force: −G is what the body sees as potential energy, with the sources that hold the
potentials. On a grid of poses it is one tensor cubic spline, so that the force is conservative; without floating
conductors the same as of splines of C. A pose has three translations and a rotation vector.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.field import POSE_AXES
from gudgeon.solver import core
from gudgeon.solver.errors import SceneError

GRID, VOLTAGE, CHARGE, ADHESION = range(4)
"""Kinds: a spline on a grid; parallel plates at a given voltage or charge; a sphere and a plane that adhere."""
HEAD, SIZE, OUT = 21, 8, 8
"""Numbers of a field: whole ones, others; of what is found of it: G, its gradient over six motions, and `LEFT`."""
LEFT = 7
"""Where it stands, zero or 1 + the axis along which the pose left the grid; 7 of plates that touch."""
DEGREE = 3


class CoEnergies(NamedTuple):
    """Fields of a scene, f of them."""

    head: np.ndarray
    """Kind, number of axes, first coefficient; of each axis its place in the pose, first knot, values, (f, HEAD)."""
    size: np.ndarray
    """Motions off the axes that are allowed [m, rad]; of plates gap [m], normal, ½ ε A V² or −Q²/(2 ε A), and the gap
    at which they touch [m]; of what adheres gap, normal, 2 π w R [N] and range [m], (f, SIZE)."""
    data: np.ndarray
    """Knots and coefficients of all."""

    def one(self, i: int) -> "CoEnergies":
        """Return one of them alone."""
        return CoEnergies(self.head[i : i + 1], self.size[i : i + 1], self.data)

    @property
    def most(self) -> int:
        """Coefficients that a pose takes part in, at most."""
        return 4 ** int(self.head[:, 1].max(initial=0))


def co_energy_values(C: np.ndarray, potentials: np.ndarray, charges: np.ndarray) -> np.ndarray:
    """Return G [J] of capacitance matrices (…, k, k), (…).

    Args:
        potentials: [V], (k,); NaN of floating conductors.
        charges: Of floating conductors [C], (k,).
    """
    floats = np.isnan(potentials)
    V = potentials[~floats]
    co_energy = 0.5 * np.einsum("i,...ij,j->...", V, C[..., ~floats, :][..., :, ~floats], V)
    if floats.any():
        net_charges = charges[floats] - C[..., floats, :][..., :, ~floats] @ V
        solved = np.linalg.solve(C[..., floats, :][..., :, floats], net_charges[..., None])[..., 0]
        co_energy = co_energy - 0.5 * (net_charges * solved).sum(axis=-1)
    return co_energy


def grid_field(
    axes: dict[str, np.ndarray], values: np.ndarray, off_axis: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return head, size and data of a field on a grid.

    Args:
        axes: Values of each axis, ascending, at least four, in the order of `POSE_AXES`.
        values: G at the grid's points [J], (n₁, …, n_d).
        off_axis: Translation [m] and rotation [rad] allowed along axes that the grid has not.
    """
    from scipy.interpolate import make_interp_spline  # Late: few runs have fields, and it takes a tenth of a second.

    head, parts, coefficients, used = np.zeros(HEAD, np.int64), [], values, 0
    head[0], head[1] = GRID, len(axes)
    for number, (name, nodes) in enumerate(axes.items()):
        spline = make_interp_spline(nodes, coefficients, k=DEGREE, axis=number)
        coefficients = np.moveaxis(np.asarray(spline.c), 0, number)
        head[3 + 3 * number : 6 + 3 * number] = POSE_AXES.index(name), used, len(nodes)
        parts.append(np.asarray(spline.t, float))
        used += len(spline.t)
    head[2] = used
    size = np.zeros(SIZE)
    size[:2] = off_axis
    return head, size, np.concatenate([*parts, np.ascontiguousarray(coefficients).ravel()])


def respaced(head: np.ndarray, data: np.ndarray, chosen: Callable[[int], np.ndarray]) -> None:
    """Replace the coefficients of a field on a grid by those of splines through some of its values alone.

    Values are taken at the means of the knots of each coefficient (Greville), which are as many as the poses of the
    grid, a little apart from them.

    Args:
        head: Of the field, (HEAD,).
        data: Knots and coefficients of all fields, changed in place.
        chosen: Returns the numbers of the values along an axis that are taken, of their count.
    """
    from scipy.interpolate import BSpline, make_interp_spline

    counts = [int(head[5 + 3 * a]) for a in range(head[1])]
    span = slice(int(head[2]), int(head[2]) + int(np.prod(counts)))
    coefficients = data[span].reshape(counts)
    for a, count in enumerate(counts):
        knots = data[head[4 + 3 * a] : head[4 + 3 * a] + count + DEGREE + 1]
        averages = np.array([knots[i + 1 : i + 1 + DEGREE].mean() for i in range(count)])
        few = chosen(count)
        values = BSpline(knots, np.moveaxis(coefficients, a, 0), DEGREE)(averages)
        coarse = make_interp_spline(averages[few], values[few], k=min(DEGREE, len(few) - 1))(averages)
        fitted = make_interp_spline(averages, coarse, k=DEGREE, t=knots)
        coefficients = np.moveaxis(np.asarray(fitted.c), 0, a)
    data[span] = coefficients.ravel()


def plates_field(
    gaps: tuple[float, float], normal: np.ndarray, strength: float, *, charged: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return head, size and data of parallel plates.

    Args:
        gaps: At the start, and at which the plates touch [m].
        strength: ½ ε A V² [N m²], or −Q²/(2 ε A) of charged ones [N].
    """
    head, size = np.zeros(HEAD, np.int64), np.zeros(SIZE)
    head[0] = CHARGE if charged else VOLTAGE
    size[2], size[3:6], size[6], size[7] = gaps[0], normal, strength, gaps[1]
    return head, size, np.empty(0)


def adhesion_field(
    gap: float, normal: np.ndarray, pull: float, reach: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return head, size and data of a sphere that adheres to a plane at a gap [m].

    G is pull · reach/(1 + gap/reach) [J], and pull · (reach − gap) where they touch.
    """
    head, size = np.zeros(HEAD, np.int64), np.zeros(SIZE)
    head[0] = ADHESION
    size[2], size[3:6], size[6], size[7] = gap, normal, pull, reach
    return head, size, np.empty(0)


def joined(fields: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> CoEnergies:
    """Return all fields of a scene."""
    heads, sizes, data, used = [], [], [np.empty(0)], 0
    for head, size, values in fields:
        head = head.copy()
        head[2] += used
        for a in range(head[1]):
            head[4 + 3 * a] += used
        used += len(values)
        heads.append(head)
        sizes.append(size)
        data.append(values)
    return CoEnergies(
        np.array(heads, np.int64).reshape(-1, HEAD), np.array(sizes).reshape(-1, SIZE), np.concatenate(data)
    )


def basis_shape(fields: CoEnergies) -> tuple[int, int]:
    """Return the shape of the work array of `evaluate`."""
    return 9, max(32, fields.most)


def values(fields: CoEnergies, i: int, poses: np.ndarray) -> np.ndarray:
    """Return what `evaluate` finds of a field at poses (n, 6), (n, OUT)."""
    out = np.zeros((len(poses), OUT))
    core.set_field_values(fields, i, np.ascontiguousarray(poses, float), np.empty(basis_shape(fields)), out)
    return out


def refuse_outside(name: str, fields: CoEnergies, i: int, code: int, pose: np.ndarray) -> None:
    """Raise a SceneError for a field whose body is outside as the run starts.

    Args:
        code: Number of `LEFT`.
        pose: At the start, (6,).
    """
    axis, unit, head = POSE_AXES[code - 1], "m" if code <= 3 else "rad", fields.head[i]
    ends = "-"
    for a in range(head[1]):
        if head[3 + 3 * a] == code - 1:
            ends = f"{fields.data[head[4 + 3 * a]]:.6g} to {fields.data[head[4 + 3 * a] + head[5 + 3 * a]]:.6g} {unit}"
    raise SceneError(
        f"force.{name}.start: the body is at {axis} = {pose[code - 1]:.6g} {unit} of the field as the run starts,"
        f" outside of the grid of poses, {ends}"
    )


def left_text(name: str, fields: CoEnergies, i: int, pose: np.ndarray, time: float) -> str:
    """Return what a run says that ended since a body left a field.

    Args:
        pose: The last good one, (6,): the axis is that whose end is nearest.
        time: [s]
    """
    head, size = fields.head[i], fields.size[i]
    if head[0] != GRID:
        return f"the plates of force.{name} touch at t = {time:.6g} s"
    ends = np.array([[-half_range, half_range] for half_range in (*3 * [size[0]], *3 * [size[1]])])
    for a in range(head[1]):
        axis, start, count = head[3 + 3 * a : 6 + 3 * a]
        ends[axis] = fields.data[start], fields.data[start + count]
    margins = np.minimum(pose - ends[:, 0], ends[:, 1] - pose) / np.ptp(ends, axis=1)
    axis = int(margins.argmin())
    unit = "m" if axis < 3 else "rad"
    return (
        f"force.{name}: the body left the grid of poses along {POSE_AXES[axis]} at t = {time:.6g} s, at"
        f" {pose[axis]:.6g} {unit}; widen the table [poses] of its field, or stop the body before by a contact"
    )
