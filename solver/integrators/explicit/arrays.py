"""The arrays of the explicit time loop, as `core/explicit/march.hpp` has them."""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.contact.compliance import Compliance
from gudgeon.solver.contact.lcp import ActiveSet
from gudgeon.solver.integrators.impact_log import ImpactLog


class Constants(NamedTuple):
    """Constants of a run. Shapes: m coordinates, c contact rows, r rigid coordinates."""

    dt: float
    flight: np.ndarray
    """Propagator entries q←q, q←q̇, q̇←q, q̇←q̇ over dt, (4, m)."""
    half: np.ndarray
    """The same over dt/2, (4, m)."""
    stiffness: np.ndarray
    """ω² [rad²/s²], zero for rigid coordinates, (m,)."""
    rows: np.ndarray
    """∂g/∂q, (c, m)."""
    span: np.ndarray
    """First and last + 1 coordinate on which each row depends, (c, 2)."""
    narrow: bool
    """Whether rows depend on few of the coordinates, so that columns are not used."""
    columns: np.ndarray
    """The same by coordinate, (m, c)."""
    reach: np.ndarray
    """Largest |∂g/∂q| of any row, (m,): a bound of the closing speed of any gap between impulses."""
    gap: np.ndarray
    """g₀ [m], (c,)."""
    compliance: np.ndarray
    """C [m/N], (c, c); only its diagonal is used where `coupled` is false."""
    matrix: Compliance
    """C, for the contact problem of coupled points."""
    coupled: bool
    dashpot: np.ndarray
    """d [N s/m], (c,)."""
    normals: np.ndarray
    """Direction of each row's force on its body, (c, 3)."""
    contact: np.ndarray
    """Contact number of each row, (c,)."""
    rigid: np.ndarray
    """Numbers of the rigid coordinates, (r,)."""


class State(NamedTuple):
    """Variables of a run, updated in place."""

    q: np.ndarray
    v: np.ndarray
    active: ActiveSet
    """Active set of the last solution, from which the next one starts."""
    multipliers: np.ndarray
    """λ [N] of the last impulse, (c,)."""
    gaps: np.ndarray
    """g + C λ [m] of the last impulse, (c,)."""
    free: np.ndarray
    """Gaps without the forces of an impulse [m], (c,)."""
    jump: np.ndarray
    """Change of q̇ by an impulse, (m,)."""
    carried: np.ndarray
    """Gap [m] of the only point at the next impulse and its rate [m/s], where the last one acted; else NaN, (2,)."""
    ends: np.ndarray
    """q and q̇ at the end of a sample, half a step before the next impulse, (2, m)."""
    impulses: np.ndarray
    """Σ λ dt of each row [N s], (c,)."""
    work: np.ndarray
    """Work of contacts on each rigid coordinate, then on all coordinates together [J], (r + 1,)."""
    energy: np.ndarray
    """Kinetic, strain, contact, dissipated at the last impulse [J], (4,)."""
    counts: np.ndarray
    """Active rows, impulses in contact, pivots, number of the impulse at which C was singular, (4,)."""
    extreme: np.ndarray
    """As in `Outcome`, (4,)."""
    log: ImpactLog
