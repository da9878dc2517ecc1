"""Serial chains of revolute joints: motion, the regressor of the wrench on their base, and its parameters.

The wrench that a chain exerts on its base is linear in mass m, first moments m c and inertia about the joint's point o
of each link (W. Khalil and E. Dombre, Modeling, Identification and Control of Robots, 2002, chapter 12). With R from
the link's axes to the scene's, a the acceleration of o less gravity, ω and α of the link,

  f = m a + (α̃ + ω̃ ω̃) R (m c),   n_o = R (m c) × a + R I α′ + ω × R I ω′,   ω′ = Rᵀ ω,  α′ = Rᵀ α,

and about the base point b n = n_o + (o − b) × f: w = Y(q, q̇, q̈) p. On the base acts −w.
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

PER_LINK = 10
NAMES = ("m", "mx", "my", "mz", "Ixx", "Iyy", "Izz", "Ixy", "Iyz", "Izx")
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))
DEPENDENT = 1e-9
"""Diagonal of R over the largest one below which a parameter depends on others."""


@dataclass(frozen=True)
class Chain:
    """n links, each turning on the one before; all along the axes of the scene at q = 0."""

    axes: np.ndarray
    """Unit vectors of the joints, (n, 3)."""
    points: np.ndarray
    """A point of each joint's axis [m], (n, 3)."""
    masses: np.ndarray
    """[kg], (n,)."""
    centres: np.ndarray
    """Centres of mass [m], (n, 3)."""
    inertias: np.ndarray
    """About the centres [kg m^2], (n, 3, 3)."""
    base: np.ndarray
    """Point about which moments are taken [m], (3,)."""

    def parameters(self) -> np.ndarray:
        """Return p of the links, (10 n,), by `NAMES`, about the joints' points."""
        p = []
        for mass, centre, point, inertia in zip(self.masses, self.centres, self.points, self.inertias, strict=True):
            arm = centre - point
            about = inertia + mass * ((arm @ arm) * np.eye(3) - np.outer(arm, arm))
            p.append([mass, *(mass * arm), *(about[i, j] for i, j in PAIRS)])
        return np.concatenate(p)

    def motion(self, q: np.ndarray, rates: np.ndarray, seconds: np.ndarray) -> "Motion":
        """Return the motion of the links at joint angles (s, n), their rates and second rates."""
        count, n = q.shape
        turn, omega, alpha = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3)), np.zeros((count, 3))
        position, acceleration, before = np.tile(self.points[0], (count, 1)), np.zeros((count, 3)), self.points[0]
        motions: list[list[np.ndarray]] = [[], [], [], [], []]
        for i in range(n):
            lever = np.einsum("sij,j->si", turn, self.points[i] - before)
            acceleration = acceleration + np.cross(alpha, lever) + np.cross(omega, np.cross(omega, lever))
            position, before = position + lever, self.points[i]
            line = np.einsum("sij,j->si", turn, self.axes[i])
            alpha = alpha + line * seconds[:, i : i + 1] + np.cross(omega, line) * rates[:, i : i + 1]
            omega = omega + line * rates[:, i : i + 1]
            turn = turn @ turned(self.axes[i], q[:, i])
            for series, value in zip(motions, (turn, position, omega, alpha, acceleration), strict=True):
                series.append(value)
        return Motion(*(np.stack(series, axis=1) for series in motions))

    def regressor(
        self,
        q: np.ndarray,
        rates: np.ndarray,
        seconds: np.ndarray,
        gravity: np.ndarray,
        carried: np.ndarray | None = None,
    ) -> np.ndarray:
        """Return Y at joint angles (s, n), their rates and second rates, (s, 6, 10 n).

        Args:
            gravity: [m/s^2], (3,).
            carried: Acceleration and angular acceleration of the base about its point, small motions of a base that
                yields, (s, 6); default: none.
        """
        count, n = q.shape
        m, Y = self.motion(q, rates, seconds), np.zeros((count, 6, PER_LINK * n))
        for i in range(n):
            R, lever, omega, alpha = m.turn[:, i], m.place[:, i] - self.base, m.omega[:, i], m.alpha[:, i]
            acceleration = m.pull[:, i] - gravity
            if carried is not None:
                acceleration, alpha = (
                    acceleration + carried[:, :3] + np.cross(carried[:, 3:], lever),
                    alpha + carried[:, 3:],
                )
            spin = crossed(omega)
            f = np.zeros((count, 3, PER_LINK))
            f[:, :, 0], f[:, :, 1:4] = acceleration, (crossed(alpha) + spin @ spin) @ R
            moment = np.zeros((count, 3, PER_LINK))
            moment[:, :, 1:4] = -crossed(acceleration) @ R
            back_omega, back_alpha = (np.einsum("sji,sj->si", R, w) for w in (omega, alpha))
            moment[:, :, 4:] = R @ inertial(back_alpha) + spin @ R @ inertial(back_omega)
            columns = slice(PER_LINK * i, PER_LINK * (i + 1))
            Y[:, :3, columns], Y[:, 3:, columns] = f, moment + crossed(lever) @ f
        return Y


@dataclass(frozen=True)
class Motion:
    """Of n links at s samples."""

    turn: np.ndarray
    """R, (s, n, 3, 3)."""
    place: np.ndarray
    """Of the joints' points [m], (s, n, 3)."""
    omega: np.ndarray
    alpha: np.ndarray
    pull: np.ndarray
    """Acceleration of the joints' points [m/s^2], (s, n, 3)."""


def turned(axis: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Return rotations about an axis, (s, 3, 3)."""
    K = crossed(axis[None])[0]
    return np.eye(3) + np.sin(angles)[:, None, None] * K + (1 - np.cos(angles))[:, None, None] * (K @ K)


def crossed(vectors: np.ndarray) -> np.ndarray:
    """Return the matrices of the cross product with vectors (s, 3), (s, 3, 3)."""
    matrices = np.zeros((len(vectors), 3, 3))
    x, y, z = vectors.T
    matrices[:, 0, 1], matrices[:, 0, 2], matrices[:, 1, 2] = -z, y, -x
    return matrices - matrices.transpose(0, 2, 1)


def inertial(vectors: np.ndarray) -> np.ndarray:
    """Return the matrices of I v over xx, yy, zz, xy, yz, zx of I, (s, 3, 6)."""
    matrices = np.zeros((len(vectors), 3, 6))
    for column, (i, j) in enumerate(PAIRS):
        matrices[:, i, column] += vectors[:, j]
        if i != j:
            matrices[:, j, column] += vectors[:, i]
    return matrices


@dataclass(frozen=True)
class Base:
    """Base parameters: what a regressor tells of p."""

    independent: np.ndarray
    """Numbers of the parameters whose columns are independent, (b,), ascending."""
    grouping: np.ndarray
    """Base parameters per parameter, (b, 10 n): of the independent ones, and of those that are grouped with them."""

    def completed(self, values: np.ndarray, drawn: np.ndarray) -> np.ndarray:
        """Return the parameters nearest to those of a drawing (10 n,) that have some base parameters (b,).

        A base that moves shows more than one at rest: what base parameters do not tell is that of the drawing.
        """
        return drawn + np.linalg.pinv(self.grouping) @ (values - self.grouping @ drawn)


def base_parameters(Y: np.ndarray) -> Base:
    """Return the base parameters of a regressor (s, 6, k) at motions that excite all, by QR with pivoting."""
    rows = Y.reshape(-1, Y.shape[2])
    scale = np.linalg.norm(rows, axis=0)
    seen = np.flatnonzero(scale > DEPENDENT * scale.max())
    R, order = linalg.qr(rows[:, seen] / scale[seen], mode="r", pivoting=True)
    size = np.abs(np.diag(R[: len(seen)]))
    count = int((size > DEPENDENT * size[0]).sum())
    independent, dependent = seen[order[:count]], seen[order[count:]]
    grouping = np.zeros((count, Y.shape[2]))
    grouping[np.arange(count), independent] = 1.0
    weights = linalg.solve_triangular(R[:count, :count], R[:count, count : len(seen)])
    grouping[:, dependent] = weights / scale[independent][:, None] * scale[dependent]
    arranged = np.argsort(independent)
    return Base(independent[arranged], grouping[arranged])


@dataclass(frozen=True)
class Identified:
    """Base parameters by least squares."""

    values: np.ndarray
    """(b,)"""
    condition: float
    """Of the regressor with columns of unit length."""
    residual: np.ndarray
    """rms of each component of the wrench that is left [N, N m], (6,)."""


def identified(Y: np.ndarray, wrenches: np.ndarray, base: Base, levels: np.ndarray) -> Identified:
    """Return the base parameters that fit wrenches (s, 6) best.

    Args:
        levels: Noise of each component [N, N m], by which rows are weighted, (6,).
    """
    weighted = Y[:, :, base.independent] / levels[:, None]
    rows = weighted.reshape(-1, weighted.shape[2])
    scale = np.linalg.norm(rows, axis=0)
    values, _, _, s = np.linalg.lstsq(rows / scale, (wrenches / levels).ravel(), rcond=None)
    values = values / scale
    residual = wrenches - Y[:, :, base.independent] @ values
    return Identified(values, float(s[0] / s[-1]), np.sqrt((residual**2).mean(axis=0)))
