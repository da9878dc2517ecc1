"""Elastic bearings: their potential over the offset of the journal, as a table, and the pressure behind it.

A round journal at an offset e overlaps the place i of the bore by e·u_i − c − h_i. Forces λ ≥ 0 part both, and yield by
the bore's compliance R: g = R λ − (e·u − c − h) ≥ 0, λ ≥ 0, λᵀ g = 0. ½ λᵀ R λ has the gradient Σ λ_i u_i, so that
the bearing keeps energy. It is tabulated as the indentation δ of a linear law K δ that has the same energy,
δ = √(2 V/K), and below the first touch continued by the gap of the nearest place with the same slope:

    H(e) = |e| − c − δ(ρ, θ),   ρ = |e| − e₀(θ)

with e₀ the offset at which the bore is first touched. δ and e₀ are tensor quintic splines, whose force has three
continuous derivatives, so that steps of high order pass from cell to cell. The law's loss acts on the way along the
normal. What the table says at an offset: `core/ports/worn.hpp`.
"""

from math import factorial
from typing import NamedTuple

import numpy as np
from scipy import linalg
from scipy.interpolate import CubicSpline, make_interp_spline
from scipy.optimize import nnls

from gudgeon.solver.contact.bores import ElasticBore
from gudgeon.solver.errors import SceneError
from gudgeon.solver.joints.clearance import Clearance
from gudgeon.solver.laws.base import Coefficients
from gudgeon.solver.laws.restitution import loss_of_restitution

BELOW, ABOVE, AROUND = 12, 48, 120
"""Values along ρ before and after the first touch, and around."""
DEGREE = 5
EXCHANGES = 60
"""Of the active set, before the least-squares solution takes over."""
CLOSED = 1e-12
"""Overlap over the largest one that is none."""
SPARE = 1.05
"""Force up to which the table reaches, over the largest one that is asked for."""
DEEPEST = 0.1
"""Largest offset beyond the first touch over the radius of the journal: the bore is linear."""


class Pressed:
    """A bore before a round journal."""

    def __init__(self, bore: ElasticBore, clearance: float, worn: np.ndarray | None = None) -> None:
        """
        Args:
            clearance: [m].
            worn: Depth of evenly spaced cells from angle zero [m], (cells,); None of a round bore.
        """
        self.bore = bore
        self.turns = np.column_stack([np.cos(bore.angles), np.sin(bore.angles)])
        self.gap = np.full(len(bore.angles), clearance)
        if worn is not None:
            at = 2 * np.pi / len(worn) * np.arange(len(worn) + 1)
            self.gap += np.maximum(CubicSpline(at, np.append(worn, worn[0]), bc_type="periodic")(bore.angles), 0.0)

    def forces(self, offset: np.ndarray) -> np.ndarray:
        """Return the forces of all places at an offset (2,) [m], (p,) [N]."""
        R, over = self.bore.compliance, self.turns @ offset - self.gap
        slight = CLOSED * float(np.abs(over).max())
        active, found = over > slight, np.zeros(len(over))
        for _ in range(EXCHANGES):
            if not active.any():
                return found
            where = np.flatnonzero(active)
            own = linalg.solve(R[np.ix_(where, where)], over[where], assume_a="pos", check_finite=False)
            found[:] = 0.0
            found[where] = own
            missed = ~active & (over - R[:, where] @ own > slight)
            if (own >= 0).all() and not missed.any():
                return found
            active = (active & (found >= 0)) | missed
        lower = linalg.cholesky(R, lower=True)
        return nnls(lower.T, linalg.solve_triangular(lower, over, lower=True), maxiter=10**5)[0]

    def potential(self, offset: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the energy [J] at an offset (2,) [m], and the force on the bore, (2,) [N]."""
        forces = self.forces(offset)
        pressed = forces > 0
        return 0.5 * float(forces[pressed] @ (self.turns @ offset - self.gap)[pressed]), forces @ self.turns

    def first_touch(self, angle: float) -> tuple[float, int]:
        """Return the offset at which a journal that moves along an angle touches [m], and the place."""
        along = np.cos(self.bore.angles - angle)
        ways = np.where(along > 0.1, self.gap / np.maximum(along, 0.1), np.inf)
        return float(ways.min()), int(ways.argmin())


class Table(NamedTuple):
    """Of one bearing."""

    reach: np.ndarray
    """ρ, ascending [m], (BELOW + ABOVE,)."""
    touch: np.ndarray
    """Coefficients of e₀ in each cell [m], of falling powers of the way from its lower angle, (AROUND, DEGREE + 1)."""
    depth: np.ndarray
    """Of δ, of falling powers along ρ and θ, (BELOW + ABOVE − 1, AROUND, DEGREE + 1, DEGREE + 1)."""
    stiffness: float
    """K [N/m]."""


class Yielding(NamedTuple):
    """The elastic bearing of a section."""

    pressed: Pressed
    table: Table
    law: Coefficients
    load: float
    """Largest force that it is tabulated for [N]."""


def yielding_of(name: str, joint: Clearance, bore: ElasticBore) -> Yielding:
    """Return the elastic bearing of a joint, worn as its scene says.

    Raises:
        SceneError: its load presses it beyond the model.
    """
    bearing, wear = joint.bearing, joint.wear
    assert bearing is not None
    worn = wear.on_cells(wear.bearing_depth[0]) if wear is not None and wear.bearing_depth else None
    pressed = Pressed(bore, joint.clearance, worn)
    table = table_of(pressed, joint.radius, bearing.load, f"joint.{name}.bearing")
    law = Coefficients(table.stiffness, 1.0, loss_of_restitution(bearing.restitution), 0.0)
    return Yielding(pressed, table, law, bearing.load)


def table_of(pressed: Pressed, radius: float, load: float, where: str) -> Table:
    """Return the table of a bearing up to a load [N].

    Raises:
        SceneError: it would be pressed by more than a tenth of the radius [m].
    """
    angles = 2 * np.pi / AROUND * np.arange(AROUND + 1)
    turns = np.column_stack([np.cos(angles), np.sin(angles)])[:-1]
    touches = [pressed.first_touch(angle) for angle in angles[:-1]]
    onset = np.array([one for one, _ in touches])
    top = max(
        _reach(pressed, turn, first, SPARE * load, DEEPEST * radius)
        for turn, first in zip(turns[:: AROUND // 8], onset[:: AROUND // 8], strict=True)
    )
    if top >= DEEPEST * radius:
        raise SceneError(
            f"{where}.load: {load:g} N given, which presses the journal by more than {DEEPEST:g} of its radius into its"
            " bearing, beyond the model; give a stiffer bearing, or a smaller load"
        )
    graded = (np.arange(-BELOW, ABOVE) / (ABOVE - 1)) ** 2
    reach = np.where(np.arange(-BELOW, ABOVE) < 0, -graded * min(1.0, 0.5 * onset.min() / top), graded) * top
    energy = np.array([[pressed.potential((first + at) * turn)[0] for turn, first in zip(turns, onset, strict=True)]
                       for at in reach])  # fmt: skip
    stiffness = float(2 * energy[-1].mean() / top**2)
    single = np.array([pressed.bore.compliance[place, place] for _, place in touches])
    depth = np.sqrt(2 * energy / stiffness)
    for k, (turn, first) in enumerate(zip(turns, onset, strict=True)):
        free = reach <= 0
        gaps = pressed.gap - (first + reach[free])[:, None] * (pressed.turns @ turn)
        depth[free, k] = -gaps.min(axis=1) / np.sqrt(stiffness * single[k])
    touch = _coefficients(angles, np.append(onset, onset[0]), "periodic")
    around = _coefficients(angles, np.column_stack([depth, depth[:, :1]]).T, "periodic")
    both = _coefficients(reach, np.moveaxis(around, -1, 0), None)
    return Table(reach, touch.T.copy(), both.transpose(1, 3, 0, 2).copy(), stiffness)


def _coefficients(at: np.ndarray, values: np.ndarray, ends: str | None) -> np.ndarray:
    """Return coefficients of the spline through values (n, …), of falling powers, (DEGREE + 1, n − 1, …)."""
    spline = make_interp_spline(at, values, DEGREE, bc_type=ends)
    return np.stack([spline(at[:-1], power) / factorial(power) for power in range(DEGREE, -1, -1)])


def _reach(pressed: Pressed, turn: np.ndarray, first: float, load: float, most: float) -> float:
    """Return how far beyond the first touch a load presses [m]; `most` at most."""
    low, high = 0.0, 1e-4 * first
    while high < most and float(pressed.potential((first + high) * turn)[1] @ turn) < load:
        low, high = high, 2 * high
    if high >= most and float(pressed.potential((first + most) * turn)[1] @ turn) < load:
        return most
    for _ in range(30):
        middle = 0.5 * (low + high)
        if float(pressed.potential((first + middle) * turn)[1] @ turn) < load:
            low = middle
        else:
            high = middle
    return high


def yielding_arrays(every: list[Table | None]) -> dict[str, np.ndarray]:
    """Return the arrays of all tables, and the number of the table of each section, −1 without one."""
    tables, has = [one for one in every if one is not None], np.array([one is not None for one in every], bool)
    return {
        "yielding": np.where(has, np.cumsum(has) - 1, -1).astype(np.int64),
        "yielding_reach": np.array([one.reach for one in tables]).reshape(-1, BELOW + ABOVE),
        "yielding_touch": np.array([one.touch for one in tables]).reshape(-1, AROUND, DEGREE + 1),
        "yielding_depth": np.array([one.depth for one in tables]).reshape(
            -1, BELOW + ABOVE - 1, AROUND, DEGREE + 1, DEGREE + 1
        ),
    }
