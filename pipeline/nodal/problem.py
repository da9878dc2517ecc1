"""What the full-FE run integrates: one or two bodies, contacts, loads and a rod. Plain arrays and callables."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse

ROUND_OFF = 1e-9
"""Share of a body's largest mass-normalised rigid coordinate below which another is none."""


@dataclass(frozen=True)
class NodalLoad:
    """A load that is no contact."""

    row: np.ndarray
    """Nodal forces per unit of the load, (dofs,)."""
    mean: Callable[[np.ndarray], np.ndarray]
    """Given times (t + 1,) [s], returns the mean of the load over each interval between them, (t,)."""


@dataclass(frozen=True)
class NodalBody:
    """A linear elastic body in all its dofs; those that are held have been taken out.

    `rigid` and `suppressed` together are mass-orthonormal and span all rigid motions that the body has; both are None
    where it has none.
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
    """Φ_r: rigid motions that it may make, (dofs, r)."""
    suppressed: np.ndarray | None = None
    """Φ_o: rigid motions that it may not make, (dofs, k)."""
    twists: np.ndarray | None = None
    """The columns of `rigid` as translation and rotation about the centre [kg^-½, kg^-½ m^-1], (r, 6)."""
    loads: tuple[NodalLoad, ...] = ()

    def load_means(self, times: np.ndarray) -> np.ndarray:
        """Return the mean of each load over each interval between times (t + 1,) [s], (t, l)."""
        return np.array([load.mean(times) for load in self.loads]).reshape(len(self.loads), len(times) - 1).T

    def load_rows(self) -> np.ndarray:
        """Return the nodal forces per unit of each load, (l, dofs)."""
        return np.array([load.row for load in self.loads]).reshape(len(self.loads), self.K.shape[0])

    def centre_motion(self, motion: np.ndarray) -> np.ndarray:
        """Return velocity, displacement since the start and velocity at the start of the centre of mass, (3, 6).

        Args:
            motion: Displacements and velocities now, (2, dofs).
        """
        if self.rigid is None or self.twists is None:
            return np.zeros((3, 6))
        zero = np.zeros(len(self.rigid))
        u, v = (zero if x is None else x for x in (self.displacement, self.velocity))
        rates = np.array([motion[1], motion[0] - u, v]) @ (self.M @ self.rigid)
        rates[np.abs(rates) < ROUND_OFF * np.abs(rates).max(axis=1, initial=0.0, keepdims=True)] = 0.0
        return rates @ self.twists


@dataclass(frozen=True)
class SlidingSurface:
    """A surface of the master over which the points of a contact slide, g = g₀ + G u − N(σ) B u_master."""

    rows: sparse.csr_matrix
    """B: outward normal displacement of each of its functions, (F, dofs of the master)."""
    weights: Callable[[float], tuple[np.ndarray, np.ndarray]]
    """N(σ): given a distance slid [m], returns numbers and values of the functions that each point touches, (c, s);
    a point that is not on the surface has the number −1 throughout."""
    slide: np.ndarray
    """σ = slide @ u of the slave, (dofs,)."""


@dataclass(frozen=True)
class NodalContact:
    """Points of the slave against something rigid, or against a surface of the master. c: points."""

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
    """A massless rod from a point of the slave to a pin that moves as given, in one plane."""

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
    """Bodies and what acts on them, for a time [s]."""

    slave: NodalBody
    """The body with the contact points."""
    contacts: dict[str, NodalContact]
    duration: float
    master: NodalBody | None = None
    """The body with the surfaces over which points slide."""
    rod: NodalRod | None = None
    frames: int = 0
    """Number of equally spaced times, the last at the end, at which the masters' surfaces are kept."""


@dataclass(frozen=True)
class PointContact:
    """Points at which fixed rows of bodies meet, or a row meets something rigid. c: points."""

    rows: tuple[sparse.csr_matrix | None, ...]
    """∂g/∂u of each body of the problem, (c, dofs); None of one that has no part in it."""
    gap: np.ndarray
    """g₀: gaps where u = 0 [m], (c,)."""
    directions: np.ndarray
    """Direction of each point's force on `body`, (c, 3)."""
    body: int
    """Number of the body that has the contact in the scene."""
    other: int | None = None
    """Number of the body that it is against; None for something rigid."""
    law: np.ndarray | None = None
    """K, n, χ, c of F = max(0, K dⁿ (1 + χ ḋ/v⁻) + c ḋ) at each point, (c, 4); None where nothing yields but bodies."""


@dataclass(frozen=True)
class PointProblem:
    """Bodies that meet at fixed points, for a time [s]. Loads are constant; all contacts have laws, or none has."""

    bodies: tuple[NodalBody, ...]
    contacts: dict[str, PointContact]
    duration: float
    flying: bool = False
    """Whether nothing but one contact acts, so that there is a restitution."""
