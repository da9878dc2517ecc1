"""The time loop: exact modal flight between kicks, contact quasi-static at each kick. One compiled function.

A kick stands in the middle of each step; between two kicks every coordinate moves by its own exact 2×2 propagator:

    q, q̇ ← flight over dt          g = g₀ + rows q
    λ from the contact              q̇ ← q̇ + dt rowsᵀ λ

Position and velocity are synchronous at half a kick, where energy is measured: ½ q̇ᵀq̇ + ½ Σ ω² q² + ½ λᵀ C λ.
A contact of several coupled points is a linear complementarity problem; where C is diagonal each point has its own
spring, λ = ⟨−g/C − d ġ⟩, with an optional dashpot d taken implicitly in its own row.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from gudgeon.solver.compiled import FAST
from gudgeon.solver.contact.compliance import Compliance
from gudgeon.solver.contact.lcp import solve_lcp

GAP_TOLERANCE = 1e-12
"""Violation of a gap that counts as none, relative to the largest gap: four digits above round-off of rows·q."""

WIDE = 16
"""Contact rows from which gaps are summed column by column."""
KINETIC, STRAIN, CONTACT, DISSIPATED = 0, 1, 2, 3


class Law(NamedTuple):
    """What stays constant in a run. Shapes: m coordinates, c contact rows, k contacts."""

    dt: float
    flight: np.ndarray
    """Propagator entries q←q, q←q̇, q̇←q, q̇←q̇ over dt, (4, m)."""
    stiffness: np.ndarray
    """ω² [rad²/s²], zero for rigid coordinates, (m,)."""
    rows: np.ndarray
    """∂g/∂q, (c, m)."""
    columns: np.ndarray
    """The same by coordinate, (m, c)."""
    reach: np.ndarray
    """Largest |∂g/∂q| of any row, (m,): bounds how fast a gap can close in flight."""
    gap: np.ndarray
    """g₀ [m], (c,)."""
    compliance: np.ndarray
    """C [m/N], (c, c); its diagonal only is used where `coupled` is false."""
    matrix: Compliance
    """The same for the contact problem of coupled points."""
    coupled: bool
    dashpot: np.ndarray
    """d [N s/m], (c,)."""
    normals: np.ndarray
    """Direction of each row's force on its body, (c, 3)."""
    contact: np.ndarray
    """Contact number of each row, (c,)."""


class State(NamedTuple):
    """What changes; all arrays are updated in place."""

    q: np.ndarray
    v: np.ndarray
    active: np.ndarray
    """Active rows, (c,), warm start of the next solve."""
    factor: np.ndarray
    """Cholesky factor of the active block, (c, c)."""
    multipliers: np.ndarray
    """λ [N] of the last kick, (c,)."""
    gaps: np.ndarray
    """g + C λ [m] of the last kick, (c,)."""
    impulses: np.ndarray
    """Σ λ dt of each row [N s], (c,)."""
    work: np.ndarray
    """Work done by contacts on each rigid coordinate, then on all coordinates together [J], (r + 1,)."""
    energy: np.ndarray
    """Kinetic, strain, contact, dissipated at the last kick [J], (4,)."""
    tally: np.ndarray
    """Size of active set, kicks in contact, pivots, last kick number with a singular C or −1, (4,)."""
    extreme: np.ndarray
    """E₀, largest |E − E₀ + D|, largest energy exchanged, largest penetration, first and last contact time, (6,)."""


@njit(cache=True, fastmath=FAST)
def march(law: Law, state: State, rigid, first, forces, energies, stride):  # type: ignore[no-untyped-def]
    """Advance `len(forces)` samples of `stride` steps each.

    Args:
        law, state: See there; on entry q and q̇ stand at the first kick.
        rigid: Numbers of the rigid coordinates, (r,).
        first: Number of the first kick since the start of the run.
        forces: Out: mean resultant on the body of each contact over each sample [N], (samples, k, 3).
        energies: Out: `state.energy` at the last kick of each sample, (samples, 4).
        stride: Kicks per sample.

    Returns:
        True unless the contact rows proved linearly dependent.
    """
    dt, m, c = law.dt, len(state.q), len(law.gap)
    q, v = state.q, state.v
    qq, qv, vq, vv = law.flight[0], law.flight[1], law.flight[2], law.flight[3]
    gap0, rows, columns, coupled = law.gap, law.rows, law.columns, law.coupled
    normals, contact, multipliers = law.normals, law.contact, state.multipliers
    kick = np.zeros(m)
    gap = np.empty(c)
    number = first
    clear = 0
    for sample in range(len(forces)):
        forces[sample] = 0.0
        for step in range(stride):
            lowest, scale = np.inf, 0.0
            clear -= 1
            if clear < 0:
                _free_gaps(gap0, rows, columns, q, gap)
                for i in range(c):
                    lowest = min(lowest, gap[i])
                    scale = max(scale, abs(gap[i]))
            if lowest < 0.0:
                if not coupled:
                    _springs(law, state, gap)
                elif not _press(law, state, gap, GAP_TOLERANCE * scale):
                    state.tally[3] = number
                    return False
                _kick(law, state, rigid, kick, (number + 0.5) * dt)
                for i in range(c):
                    share = multipliers[i] / stride
                    if share != 0.0:
                        for axis in range(3):
                            forces[sample, contact[i], axis] += share * normals[i, axis]
            elif clear < 0:
                multipliers[:] = 0.0
                state.tally[0] = 0
                state.energy[CONTACT] = 0.0
                clear = _clear_kicks(law, state, lowest)
            if step == stride - 1:
                _sample(law, state, energies[sample])
            for k in range(m):
                position, velocity = q[k], v[k]
                q[k] = qq[k] * position + qv[k] * velocity
                v[k] = vq[k] * position + vv[k] * velocity
            number += 1
    return True


@njit(cache=True, fastmath=FAST)
def _free_gaps(gap0, rows, columns, q, gap):  # type: ignore[no-untyped-def]
    """g = g₀ + rows q, along the longer of its two sides."""
    c, m = len(gap), len(q)
    if c < WIDE:
        for i in range(c):
            total = 0.0
            for k in range(m):
                total += rows[i, k] * q[k]
            gap[i] = gap0[i] + total
        return
    gap[:] = gap0
    for k in range(m):
        amount = q[k]
        for i in range(c):
            gap[i] += columns[k, i] * amount


@njit(cache=True, fastmath=FAST)
def _clear_kicks(law, state, lowest):  # type: ignore[no-untyped-def]
    """Kicks for which no gap can close: in flight a coordinate's speed stays below (q̇² + ω²q²)^½."""
    speed = 0.0
    for k in range(len(state.q)):
        speed += law.reach[k] * np.sqrt(state.v[k] * state.v[k] + law.stiffness[k] * state.q[k] * state.q[k])
    if speed * law.dt * 1e9 <= lowest:
        return 1_000_000_000
    return int(lowest / (speed * law.dt))


@njit(cache=True, fastmath=FAST)
def _press(law, state, gap, tolerance):  # type: ignore[no-untyped-def]
    """Multipliers and gaps of coupled points; False where their compliance is singular."""
    multipliers, tally = state.multipliers, state.tally
    count, pivots = solve_lcp(law.matrix, gap, state.active, tally[0], state.factor, multipliers, state.gaps, tolerance)
    tally[0] = count
    if pivots < 0:
        return False
    tally[2] += pivots
    stored = 0.0
    for i in range(len(gap)):
        # ½ λᵀCλ = ½ λᵀ(−g) on the active set
        stored -= 0.5 * multipliers[i] * gap[i]
    state.energy[CONTACT] = stored
    return True


@njit(cache=True, fastmath=FAST)
def _springs(law, state, gap):  # type: ignore[no-untyped-def]
    """Multipliers of points that do not couple: λ = ⟨−g/C − d ġ⟩, ġ in the middle of the kick."""
    dt, rows, compliance, dashpot = law.dt, law.rows, law.compliance, law.dashpot
    multipliers, gaps, v = state.multipliers, state.gaps, state.v
    stored, lost, closed = 0.0, 0.0, 0
    for i in range(len(gap)):
        multipliers[i], gaps[i] = 0.0, gap[i]
        if gap[i] < 0.0:
            closed += 1
            spring = -gap[i] / compliance[i, i]
            force = spring
            if dashpot[i] > 0.0:
                mobility, rate = 0.0, 0.0
                for k in range(len(v)):
                    mobility += rows[i, k] * rows[i, k]
                    rate += rows[i, k] * v[k]
                force = max(0.0, (spring - dashpot[i] * rate) / (1.0 + 0.5 * dt * dashpot[i] * mobility))
                lost -= dt * (force - spring) * (rate + 0.5 * dt * mobility * force)
            multipliers[i] = force
            stored += 0.5 * spring * -gap[i]
    state.tally[0] = closed
    state.energy[CONTACT] = stored
    state.energy[DISSIPATED] += lost


@njit(cache=True, fastmath=FAST)
def _kick(law, state, rigid, kick, time):  # type: ignore[no-untyped-def]
    """Apply the multipliers to the velocities and keep the balances."""
    # Every use of a tuple's array counts a reference; taken out once, the loops run five times as fast.
    dt, m, rows, stiffness = law.dt, len(state.q), law.rows, law.stiffness
    q, v, work, energy, extreme = state.q, state.v, state.work, state.energy, state.extreme
    multipliers, impulses, gaps = state.multipliers, state.impulses, state.gaps
    kick[:] = 0.0
    deepest = extreme[3]
    for i in range(len(gaps)):
        impulse = dt * multipliers[i]
        if impulse != 0.0:
            impulses[i] += impulse
            for k in range(m):
                kick[k] += rows[i, k] * impulse
        deepest = max(deepest, -gaps[i])
    extreme[3] = deepest
    swing, all_rigid = 0.0, 0.0
    for number in range(len(rigid)):
        k = rigid[number]
        work[number] += kick[k] * (v[k] + 0.5 * kick[k])
        swing += abs(work[number])
        all_rigid += work[number]
    total, strain, kinetic = 0.0, 0.0, 0.0
    for k in range(m):
        middle = v[k] + 0.5 * kick[k]
        total += kick[k] * middle
        kinetic += middle * middle
        strain += stiffness[k] * q[k] * q[k]
        v[k] = middle + 0.5 * kick[k]
    work[len(rigid)] += total
    elastic = work[len(rigid)] - all_rigid
    energy[KINETIC] = 0.5 * kinetic
    energy[STRAIN] = 0.5 * strain
    extreme[2] = max(extreme[2], 0.5 * (swing + abs(elastic) + energy[CONTACT]))
    error = 0.5 * (kinetic + strain) + energy[CONTACT] + energy[DISSIPATED] - extreme[0]
    extreme[1] = max(extreme[1], abs(error))
    state.tally[1] += 1
    if extreme[4] < 0.0:
        extreme[4] = time
    extreme[5] = time


@njit(cache=True, fastmath=FAST)
def _sample(law, state, energies):  # type: ignore[no-untyped-def]
    """Energies at this kick; in flight they are evaluated here, in contact they stand already."""
    if state.tally[0] == 0:
        kinetic, strain = 0.0, 0.0
        for k in range(len(state.q)):
            kinetic += state.v[k] ** 2
            strain += law.stiffness[k] * state.q[k] ** 2
        state.energy[KINETIC] = 0.5 * kinetic
        state.energy[STRAIN] = 0.5 * strain
        error = state.energy[KINETIC] + state.energy[STRAIN] + state.energy[DISSIPATED] - state.extreme[0]
        state.extreme[1] = max(state.extreme[1], abs(error))
    energies[:] = state.energy
