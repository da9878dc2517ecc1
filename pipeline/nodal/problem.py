"""Bodies, contacts, loads and a rod as the full FE integrates them: plain arrays and callables."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse

ROUND_OFF = 1e-9
"""Mass-normalised rigid coordinates below this share of the body's largest are zero."""


@dataclass(frozen=True)
class NodalLoad:
    """A load other than contact, as k generalised forces."""

    rows: np.ndarray
    """Nodal forces per unit of each, (k, dofs)."""
    amounts: Callable[[np.ndarray], np.ndarray]
    """Generalised forces at given times [s], (t,) → (t, k)."""
    travels: str = ""
    """Name of a moving force, whose deflection is a quantity of the run."""


@dataclass(frozen=True)
class NodalBody:
    """A linear elastic body with all its dofs but those that supports hold.

    `rigid` and `suppressed` together are mass-orthonormal and span all rigid motions; both are None without any.
    """

    name: str
    K: sparse.csr_matrix
    """[N/m], (dofs, dofs)"""
    M: sparse.csr_matrix
    """[kg], (dofs, dofs)"""
    velocity: np.ndarray | None = None
    """At the start [m/s], (dofs,); None at rest."""
    displacement: np.ndarray | None = None
    """At the start [m], (dofs,); None undeformed."""
    damping: float = 0.0
    """β of C = β K [s]."""
    rigid: np.ndarray | None = None
    """Φ_r: rigid motions that are free, (dofs, r)."""
    suppressed: np.ndarray | None = None
    """Φ_o: rigid motions that the scene suppresses, (dofs, k)."""
    twists: np.ndarray | None = None
    """The columns of `rigid` as translation and rotation about the centre [kg^-½, kg^-½ m^-1], (r, 6)."""
    loads: tuple[NodalLoad, ...] = ()

    @property
    def start(self) -> np.ndarray:
        """Displacements [m] and velocities [m/s] at the start, (2, dofs)."""
        zero = np.zeros(self.K.shape[0])
        return np.array([zero if x is None else x for x in (self.displacement, self.velocity)], float)

    def alpha(self, step: float) -> float:
        """Return α of S = M + α K, ¼ h² + ½ h β [s²]."""
        return step**2 / 4 + step * self.damping / 2

    def all_rigid(self) -> np.ndarray:
        """Return all rigid motions, the free ones first, (dofs, k)."""
        blocks = [motions for motions in (self.rigid, self.suppressed) if motions is not None]
        return np.column_stack([np.zeros((self.K.shape[0], 0)), *blocks])

    def load_means(self, times: np.ndarray) -> np.ndarray:
        """Return the generalised forces at the middle of each interval between times (t + 1,) [s], (t, l)."""
        middles = 0.5 * (times[1:] + times[:-1])
        return np.hstack([np.zeros((len(middles), 0)), *(load.amounts(middles) for load in self.loads)])

    def load_rows(self) -> np.ndarray:
        """Return the nodal forces per unit of each generalised force, (l, dofs)."""
        return np.vstack([np.zeros((0, self.K.shape[0])), *(load.rows for load in self.loads)])

    def centre_motion(self, motion: np.ndarray) -> np.ndarray:
        """Return velocity, displacement since the start and velocity at the start of the centre of mass, (3, 6).

        Args:
            motion: Displacements and velocities now, (2, dofs).
        """
        if self.rigid is None or self.twists is None:
            return np.zeros((3, 6))
        u, v = self.start
        rates = np.array([motion[1], motion[0] - u, v]) @ (self.M @ self.rigid)
        rates[np.abs(rates) < ROUND_OFF * np.abs(rates).max(axis=1, initial=0.0, keepdims=True)] = 0.0
        return rates @ self.twists

    def rigid_velocities(self, motion: np.ndarray) -> np.ndarray:
        """Return the velocities of the free rigid motions at the start and now [m kg^½/s], (2, r).

        Args:
            motion: Displacements and velocities now, (2, dofs).
        """
        if self.rigid is None:
            return np.zeros((2, 0))
        return np.array([self.start[1], motion[1]]) @ (self.M @ self.rigid)


@dataclass(frozen=True)
class SlidingSurface:
    """A surface of the master over which the points of a contact slide, g = g₀ + G u − N(σ) B u_master."""

    rows: sparse.csr_matrix
    """B: outward normal displacement of each of its functions, (F, dofs of the master)."""
    weights: Callable[[float], tuple[sparse.csr_matrix, np.ndarray]]
    """Given a sliding distance [m], returns N(σ), zero beside the surface, (c, F), and which points are on it, (c,)."""
    slide: np.ndarray
    """σ = slide @ u of the slave, (dofs,)."""


@dataclass(frozen=True)
class NodalContact:
    """Points of the slave against a rigid obstacle, or against a surface of the master. c: points."""

    G: sparse.csr_matrix
    """∂g/∂u of the slave, (c, dofs)."""
    gap: np.ndarray
    """g₀: gaps of the undeformed bodies where u = 0 [m], (c,)."""
    stiffness: np.ndarray
    """κ of each point's surface layer [N/m], (c,)."""
    directions: np.ndarray
    """Direction of each point's force on the slave, (c, 3)."""
    surface: SlidingSurface | None = None


@dataclass(frozen=True)
class NodalRod:
    """A massless rod in one plane, from a point of the slave to a crank pin with prescribed motion."""

    name: str
    rows: np.ndarray
    """J: displacement of the point, lateral and along, (2, dofs)."""
    point: np.ndarray
    """P where u = 0, lateral and along [m], (2,)."""
    length: float
    """[m]"""
    crank: Callable[[np.ndarray], np.ndarray]
    """Given times (t,) [s], returns lateral and along position [m] of the pin and their rates [m/s], (t, 4)."""
    directions: np.ndarray
    """Unit vectors lateral and along, (2, 3)."""


@dataclass(frozen=True)
class NodalProblem:
    """Bodies with sliding points, surface layers, a joint or a moving force."""

    slave: NodalBody
    """The body with the contact points or the moving force."""
    contacts: dict[str, NodalContact]
    duration: float
    """[s]"""
    master: NodalBody | None = None
    """The body with the surfaces over which points slide."""
    rod: NodalRod | None = None
    frames: int = 0
    """Number of equally spaced times, the last at the end, at which displacements of surfaces and forces are kept."""
    window: float | None = None
    """Of forces and impacts [s]; None: what the run resolves."""


@dataclass(frozen=True)
class PointContact:
    """Contact of fixed points of a body with points of another, or with a rigid obstacle. c: points."""

    rows: tuple[sparse.csr_matrix | None, ...]
    """∂g/∂u of each body of the problem, (c, dofs); None of bodies that do not take part."""
    gap: np.ndarray
    """g₀: gaps where u = 0 [m], (c,)."""
    directions: np.ndarray
    """Direction of each point's force on `body`, (c, 3)."""
    body: int
    """Number of the body that has the contact in the scene."""
    other: int | None = None
    """Number of the other body; None for a rigid obstacle."""
    law: np.ndarray | None = None
    """K, n, χ, c of F = max(0, K dⁿ (1 + χ ḋ/v⁻) + c ḋ) at each point, (c, 4); None of rigid contact."""


@dataclass(frozen=True)
class PointProblem:
    """Bodies with contact at fixed points and constant loads; all contacts have laws, or none has."""

    bodies: tuple[NodalBody, ...]
    contacts: dict[str, PointContact]
    duration: float
    """[s]"""
    flying: bool = False
    """Whether one contact is all that acts, so that a restitution is defined."""
    window: float | None = None
    """Of forces and impacts [s]; None: what the run resolves."""
