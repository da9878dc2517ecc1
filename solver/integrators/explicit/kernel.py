"""The time loop: exact modal flight between impulses, contact quasi-static at each impulse. One compiled function.

An impulse stands in the middle of each step; between two impulses every coordinate moves by its own exact 2×2 propagator:

    q, q̇ ← flight over dt          g = g₀ + rows q
    λ from the contact              q̇ ← q̇ + dt rowsᵀ λ

Position and velocity are synchronous at half an impulse, where energy is measured: ½ q̇ᵀq̇ + ½ Σ ω² q² + ½ λᵀ C λ.
A contact of several coupled points is a linear complementarity problem; where C is diagonal each point has its own
spring, λ = ⟨−g/C − d ġ⟩, with an optional dashpot d taken implicitly in its own row.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.compiled import copy, entry, inner
from gudgeon.solver.contact.compliance import Compliance
from gudgeon.solver.contact.lcp import ActiveSet, solve_lcp

GAP_TOLERANCE = 1e-12
"""Violation of a gap that counts as none, relative to the largest gap: four digits above round-off of rows·q."""

WIDE = 16
"""Contact rows from which gaps are summed column by column."""
KINETIC, STRAIN, CONTACT, DISSIPATED = 0, 1, 2, 3


class Constants(NamedTuple):
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
    rigid: np.ndarray
    """Numbers of the rigid coordinates, (r,)."""


class State(NamedTuple):
    """What changes; all arrays are updated in place."""

    q: np.ndarray
    v: np.ndarray
    active: ActiveSet
    """Of the last solve, where the next one starts."""
    multipliers: np.ndarray
    """λ [N] of the last impulse, (c,)."""
    gaps: np.ndarray
    """g + C λ [m] of the last impulse, (c,)."""
    impulses: np.ndarray
    """Σ λ dt of each row [N s], (c,)."""
    work: np.ndarray
    """Work done by contacts on each rigid coordinate, then on all coordinates together [J], (r + 1,)."""
    energy: np.ndarray
    """Kinetic, strain, contact, dissipated at the last impulse [J], (4,)."""
    counts: np.ndarray
    """Size of active set, impulses in contact, pivots, last impulse number with a singular C or −1, (4,)."""
    extreme: np.ndarray
    """E₀, largest |E − E₀ + D|, largest energy exchanged, largest penetration, first and last contact time, (6,)."""


@entry
def march(constants, state, first, forces, energies, stride):  # type: ignore[no-untyped-def]
    """Advance `len(forces)` samples of `stride` steps each.

    Args:
        constants, state: The Constants and the State; on entry q and q̇ stand at the first impulse.
        first: Number of the first impulse since the start of the run.
        forces: Out: mean resultant on the body of each contact over each sample [N], (samples, k, 3).
        energies: Out: `state.energy` at the last impulse of each sample, (samples, 4).
        stride: Impulses per sample.

    Returns:
        True unless the contact rows proved linearly dependent.
    """
    dt, m, c = constants.dt, len(state.q), len(constants.gap)
    q, v = state.q, state.v
    qq, qv, vq, vv = constants.flight[0], constants.flight[1], constants.flight[2], constants.flight[3]
    gap0, rows, columns, coupled = constants.gap, constants.rows, constants.columns, constants.coupled
    normals, contact, multipliers = constants.normals, constants.contact, state.multipliers
    jump = np.zeros(m)
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
                    _springs(constants, state, gap)
                elif not _coupled_forces(constants, state, gap, GAP_TOLERANCE * scale):
                    state.counts[3] = number
                    return False
                _push(constants, state, jump, (number + 0.5) * dt)
                for i in range(c):
                    share = multipliers[i] / stride
                    if share != 0.0:
                        for axis in range(3):
                            forces[sample, contact[i], axis] += share * normals[i, axis]
            elif clear < 0:
                multipliers[:] = 0.0
                state.counts[0] = state.active.size[0] = 0
                state.energy[CONTACT] = 0.0
                clear = clear_steps(constants, state, lowest)
            if step == stride - 1:
                if state.counts[0] == 0:
                    flight_energies(constants, state)
                copy(state.energy, energies[sample])
            for k in range(m):
                position, velocity = q[k], v[k]
                q[k] = qq[k] * position + qv[k] * velocity
                v[k] = vq[k] * position + vv[k] * velocity
            number += 1
    return True


@inner
def _free_gaps(gap0, rows, columns, q, gap):  # type: ignore[no-untyped-def]
    """Set the gaps g = g₀ + rows q [m], summed along the longer of the two sides of `rows`."""
    c, m = len(gap), len(q)
    if c < WIDE:
        for i in range(c):
            total = 0.0
            for k in range(m):
                total += rows[i, k] * q[k]
            gap[i] = gap0[i] + total
        return
    copy(gap0, gap)
    for k in range(m):
        amount = q[k]
        for i in range(c):
            gap[i] += columns[k, i] * amount


@inner
def clear_steps(constants, state, lowest):  # type: ignore[no-untyped-def]
    """Return for how many steps no gap can close, the lowest being `lowest` [m].

    In flight a coordinate's speed stays below (q̇² + ω²q²)^½.
    """
    q, v, reach, stiffness, speed = state.q, state.v, constants.reach, constants.stiffness, 0.0
    for k in range(len(q)):
        speed += reach[k] * np.sqrt(v[k] * v[k] + stiffness[k] * q[k] * q[k])
    if speed * constants.dt * 1e9 <= lowest:
        return 1_000_000_000
    return int(lowest / (speed * constants.dt))


@inner
def _coupled_forces(constants, state, gap, tolerance):  # type: ignore[no-untyped-def]
    """Find multipliers [N] and gaps [m] of coupled points; False where their compliance is singular."""
    multipliers, counts = state.multipliers, state.counts
    pivots = solve_lcp(constants.matrix, gap, state.active, multipliers, state.gaps, tolerance)
    counts[0] = state.active.size[0]
    if pivots < 0:
        return False
    counts[2] += pivots
    stored = 0.0
    for i in range(len(gap)):
        # ½ λᵀCλ = ½ λᵀ(−g) on the active set
        stored -= 0.5 * multipliers[i] * gap[i]
    state.energy[CONTACT] = stored
    return True


@inner
def _springs(constants, state, gap):  # type: ignore[no-untyped-def]
    """Find the multipliers [N] of points that do not couple: λ = ⟨−g/C − d ġ⟩, ġ in the middle of the impulse."""
    dt, rows, compliance, dashpot = constants.dt, constants.rows, constants.compliance, constants.dashpot
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
    state.counts[0] = closed
    state.energy[CONTACT] = stored
    state.energy[DISSIPATED] += lost


@inner
def _push(constants, state, jump, time):  # type: ignore[no-untyped-def]
    """Apply the multipliers [N] to the velocities, with energies and work in the middle of the impulse [J]."""
    # Every use of a tuple's array counts a reference; taken out once, the loops run five times as fast.
    dt, m, rows, stiffness, rigid = constants.dt, len(state.q), constants.rows, constants.stiffness, constants.rigid
    q, v, work, energy, extreme = state.q, state.v, state.work, state.energy, state.extreme
    multipliers, impulses, gaps = state.multipliers, state.impulses, state.gaps
    jump[:] = 0.0
    deepest = extreme[3]
    for i in range(len(gaps)):
        impulse = dt * multipliers[i]
        if impulse != 0.0:
            impulses[i] += impulse
            for k in range(m):
                jump[k] += rows[i, k] * impulse
        deepest = max(deepest, -gaps[i])
    extreme[3] = deepest
    for number in range(len(rigid)):
        k = rigid[number]
        work[number] += jump[k] * (v[k] + 0.5 * jump[k])
    total, strain, kinetic = 0.0, 0.0, 0.0
    for k in range(m):
        middle = v[k] + 0.5 * jump[k]
        total += jump[k] * middle
        kinetic += middle * middle
        strain += stiffness[k] * q[k] * q[k]
        v[k] = middle + 0.5 * jump[k]
    work[len(rigid)] += total
    energy[KINETIC], energy[STRAIN] = 0.5 * kinetic, 0.5 * strain
    keep_balance(state, time)


@inner
def keep_balance(state, time):  # type: ignore[no-untyped-def]
    """Note the largest error of the energy balance [J], the largest exchange [J] and the times [s] of contact."""
    work, energy, extreme = state.work, state.energy, state.extreme
    count = len(work) - 1
    swing, all_rigid = 0.0, 0.0
    for number in range(count):
        swing += abs(work[number])
        all_rigid += work[number]
    extreme[2] = max(extreme[2], 0.5 * (swing + abs(work[count] - all_rigid) + energy[CONTACT]))
    total = energy[KINETIC] + energy[STRAIN] + energy[CONTACT] + energy[DISSIPATED]
    extreme[1] = max(extreme[1], abs(total - extreme[0]))
    state.counts[1] += 1
    if extreme[4] < 0.0:
        extreme[4] = time
    extreme[5] = time


@inner
def flight_energies(constants, state):  # type: ignore[no-untyped-def]
    """Set kinetic and strain energy [J] of q and q̇ in flight, and note the largest error of the balance."""
    q, v, stiffness, energy, kinetic, strain = state.q, state.v, constants.stiffness, state.energy, 0.0, 0.0
    for k in range(len(q)):
        kinetic += v[k] ** 2
        strain += stiffness[k] * q[k] ** 2
    energy[KINETIC], energy[STRAIN] = 0.5 * kinetic, 0.5 * strain
    total = energy[KINETIC] + energy[STRAIN] + energy[DISSIPATED]
    state.extreme[1] = max(state.extreme[1], abs(total - state.extreme[0]))
