"""The explicit time loop: exact modal motion between contact impulses, one at the middle of each step.

Between two impulses every coordinate moves by its own exact 2×2 propagator:

    q, q̇ ← motion over dt           g = g₀ + rows q
    λ from the contact              q̇ ← q̇ + dt rowsᵀ λ

Energy is computed at half an impulse, where position and velocity are synchronous: ½ q̇ᵀq̇ + ½ Σ ω² q² + ½ λᵀ C λ.
A contact of several coupled points is a linear complementarity problem; where C is diagonal each point has its own
spring, λ = ⟨−g/C − d ġ⟩, with an optional dashpot d that is implicit in its own row.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.compiled import copy, entry, inner
from gudgeon.solver.contact.compliance import Compliance
from gudgeon.solver.contact.lcp import ActiveSet, solve_lcp
from gudgeon.solver.integrators.balance import note_exchange
from gudgeon.solver.integrators.impact_log import (
    GOING,
    ROW,
    ImpactLog,
    changes,
    log_step,
    note_change,
    pressed,
)
from gudgeon.solver.integrators.outcome import ACTIVE, CONTACT_STEPS, DEEPEST, ENERGY_ERROR, PIVOTS, START_ENERGY
from gudgeon.solver.integrators.paths import keep_paths
from gudgeon.solver.integrators.peaks import keep_peaks

GAP_TOLERANCE = 1e-12
"""Violation of a gap that is accepted, over the largest overlap without forces: gaps of open points may be wide."""

WIDE = 16
"""Contact rows from which gaps are summed column by column."""
KINETIC, STRAIN, CONTACT, DISSIPATED = range(4)
"""Entries of `State.energy`."""
SINGULAR_AT = 3
"""Entry of `State.counts`."""


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


@entry
def march(constants, state, first, stride, out):  # type: ignore[no-untyped-def]
    """Advance `len(out.forces)` samples of `stride` steps each.

    Args:
        constants, state: The Constants and the State; on entry q and q̇ are those before the first impulse.
        first: Number of the first impulse since the start of the run.
        out: The Samples; forces, peaks, and energies but for the work are filled, those of a sample's last impulse.

    Returns:
        False where the contact rows are linearly dependent.
    """
    dt, c = constants.dt, len(constants.gap)
    q, v, forces, energies = state.q, state.v, out.forces, out.energies
    coupled, multipliers, log = constants.coupled, state.multipliers, state.log
    jump, gap = state.jump, state.free
    number = first
    clear = 0
    for sample in range(len(forces)):
        forces[sample] = 0.0
        for step in range(stride):
            lowest = np.inf
            clear -= 1
            if clear < 0:
                _free_gaps(constants, q, gap)
                for i in range(c):
                    lowest = min(lowest, gap[i])
            if lowest < 0.0:
                if not coupled:
                    _springs(constants, state, gap)
                elif not _coupled_forces(constants, state, gap, -GAP_TOLERANCE * lowest):
                    state.counts[SINGULAR_AT] = number
                    return False
                _resultants(constants, state, forces[sample], stride)
                _note_changes(constants, state, gap, (number + 0.5) * dt)
                _push(constants, state, jump)
                log_step(log, number)
            else:
                if clear < 0:
                    multipliers[:] = 0.0
                    state.counts[ACTIVE] = 0
                    state.active.size[:2] = 0
                    state.energy[CONTACT] = 0.0
                    clear = clear_steps(constants, state, lowest)
                if log.counts[GOING] > 0:
                    _note_changes(constants, state, gap, (number + 0.5) * dt)
                    log_step(log, number)
            if step == stride - 1:
                if state.counts[ACTIVE] == 0:
                    flight_energies(constants, state)
                copy(state.energy, energies[sample])
            fly(constants.flight, q, v)
            number += 1
        keep_ends(constants, state, out, sample, number // stride)
    return True


@inner
def keep_ends(constants, state, out, sample, done):  # type: ignore[no-untyped-def]
    """Keep what is recorded at the end of a sample, half a step before the next impulse, where the state is.

    Args:
        done: Number of samples to its end.
    """
    q, v, ends, half, pressed = state.q, state.v, state.ends, constants.half, state.multipliers
    for k in range(len(q)):
        ends[0, k] = half[3, k] * q[k] - half[1, k] * v[k]
        ends[1, k] = half[0, k] * v[k] - half[2, k] * q[k]
    keep_paths(out.paths, sample, ends[0], pressed)
    keep_peaks(out.peaks, out.forces[sample], done, (ends[0], ends[1], pressed), pressed[:0])


@inner
def _resultants(constants, state, forces, stride):  # type: ignore[no-untyped-def]
    """Set the resultant of each contact [N], and add it to the mean of its sample."""
    normals, contact, multipliers = constants.normals, constants.contact, state.multipliers
    resultant, steps = state.log.force, state.log.steps
    for i in range(len(multipliers)):
        if multipliers[i] != 0.0:
            k = contact[i]
            for axis in range(3):
                resultant[k, axis] += multipliers[i] * normals[i, axis]
            if multipliers[i] > multipliers[steps[k, ROW]]:
                steps[k, ROW] = i
    for k in range(len(resultant)):
        for axis in range(3):
            forces[k, axis] += resultant[k, axis] / stride


@inner
def _note_changes(constants, state, gap, time):  # type: ignore[no-untyped-def]
    """Tell the log which contacts touch and which part, by gaps without the force of the step [m] at a time [s]."""
    log, v = state.log, state.v
    for k in range(len(log.force)):
        acts = pressed(log, k)
        if changes(log, k, acts):
            i = log.steps[k, ROW]
            note_change(log, k, acts, time, gap[i], _along(constants, i, v))


@inner
def fly(flight, q, v):  # type: ignore[no-untyped-def]
    """Move all coordinates to the next impulse."""
    qq, qv, vq, vv = flight[0], flight[1], flight[2], flight[3]
    for k in range(len(q)):
        place, fast = q[k], v[k]
        q[k] = qq[k] * place + qv[k] * fast
        v[k] = vq[k] * place + vv[k] * fast


@inner
def _free_gaps(constants, q, gap):  # type: ignore[no-untyped-def]
    """Set the gaps g = g₀ + rows q [m], row by row where they are few or short, else column by column."""
    gap0, columns, c = constants.gap, constants.columns, len(gap)
    if c < WIDE or constants.narrow:
        for i in range(c):
            gap[i] = gap0[i] + _along(constants, i, q)
        return
    copy(gap0, gap)
    for k in range(len(q)):
        amount = q[k]
        for i in range(c):
            gap[i] += columns[k, i] * amount


@inner
def _along(constants, i, q):  # type: ignore[no-untyped-def]
    """Return the product of a row with coordinates or their rates."""
    first, last = constants.span[i, 0], constants.span[i, 1]
    row, part, total = constants.rows[i, first:last], q[first:last], 0.0
    for k in range(len(part)):
        total += row[k] * part[k]
    return total


@inner
def clear_steps(constants, state, lowest):  # type: ignore[no-untyped-def]
    """Return the number of steps in which no gap can close: speeds stay below (q̇² + ω²q²)^½, the least gap is given."""
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
    counts[ACTIVE] = state.active.size[0]
    if pivots < 0:
        return False
    counts[PIVOTS] += pivots
    stored = 0.0
    for i in range(len(gap)):
        # ½ λᵀCλ = ½ λᵀ(−g) on the active set
        stored -= 0.5 * multipliers[i] * gap[i]
    state.energy[CONTACT] = stored
    return True


@inner
def _springs(constants, state, gap):  # type: ignore[no-untyped-def]
    """Find the multipliers [N] of points that do not couple: λ = ⟨−g/C − d ġ⟩, ġ in the middle of the impulse."""
    dt, compliance, dashpot = constants.dt, constants.compliance, constants.dashpot
    multipliers, gaps, v = state.multipliers, state.gaps, state.v
    stored, lost, closed = 0.0, 0.0, 0
    for i in range(len(gap)):
        multipliers[i], gaps[i] = 0.0, gap[i]
        if gap[i] < 0.0:
            closed += 1
            force = elastic = -gap[i] / compliance[i, i]
            if dashpot[i] > 0.0:
                mobility, rate = _along(constants, i, constants.rows[i]), _along(constants, i, v)
                force, taken = damped_force(elastic, dashpot[i], rate, mobility, dt)
                lost += taken
            multipliers[i] = force
            stored += 0.5 * elastic * -gap[i]
    state.counts[ACTIVE] = closed
    state.energy[CONTACT] = stored
    state.energy[DISSIPATED] += lost


@inner
def damped_force(elastic, dashpot, rate, mobility, dt):  # type: ignore[no-untyped-def]
    """Return the force [N] of a spring and a dashpot [N s/m] side by side, and the energy [J] that the dashpot takes.

    Args:
        elastic: Force of the spring [N].
        rate: ġ before the impulse [m/s]; the dashpot acts on ġ in the middle of the impulse.
        mobility: Change of ġ per impulse [1/kg].
    """
    force = max(0.0, (elastic - dashpot * rate) / (1.0 + 0.5 * dt * dashpot * mobility))
    return force, -dt * (force - elastic) * (rate + 0.5 * dt * mobility * force)


@inner
def _push(constants, state, jump):  # type: ignore[no-untyped-def]
    """Apply the multipliers [N] to the velocities, with energies and work in the middle of the impulse [J]."""
    dt, m, rows, stiffness, rigid = constants.dt, len(state.q), constants.rows, constants.stiffness, constants.rigid
    q, v, work, energy, extreme = state.q, state.v, state.work, state.energy, state.extreme
    multipliers, impulses, gaps = state.multipliers, state.impulses, state.gaps
    jump[:] = 0.0
    deepest = extreme[DEEPEST]
    for i in range(len(gaps)):
        impulse = dt * multipliers[i]
        if impulse != 0.0:
            impulses[i] += impulse
            first, last = constants.span[i, 0], constants.span[i, 1]
            row, part = rows[i, first:last], jump[first:last]
            for k in range(len(part)):
                part[k] += row[k] * impulse
        deepest = max(deepest, -gaps[i])
    extreme[DEEPEST] = deepest
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
    keep_balance(state)


@inner
def keep_balance(state):  # type: ignore[no-untyped-def]
    """Update the largest error of the energy balance [J], the largest exchange [J], and count the impulse."""
    energy, extreme = state.energy, state.extreme
    note_exchange(state.work, energy[CONTACT], extreme)
    total = energy[KINETIC] + energy[STRAIN] + energy[CONTACT] + energy[DISSIPATED]
    extreme[ENERGY_ERROR] = max(extreme[ENERGY_ERROR], abs(total - extreme[START_ENERGY]))
    state.counts[CONTACT_STEPS] += 1


@inner
def flight_energies(constants, state):  # type: ignore[no-untyped-def]
    """Set kinetic and strain energy [J] without contact, and update the largest error of the energy balance [J]."""
    q, v, stiffness, energy, kinetic, strain = state.q, state.v, constants.stiffness, state.energy, 0.0, 0.0
    extreme = state.extreme
    for k in range(len(q)):
        kinetic += v[k] ** 2
        strain += stiffness[k] * q[k] ** 2
    energy[KINETIC], energy[STRAIN] = 0.5 * kinetic, 0.5 * strain
    total = energy[KINETIC] + energy[STRAIN] + energy[DISSIPATED]
    extreme[ENERGY_ERROR] = max(extreme[ENERGY_ERROR], abs(total - extreme[START_ENERGY]))
