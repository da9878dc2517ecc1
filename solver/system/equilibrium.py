"""Static equilibrium at the start: elastic coordinates under loads, gravity and contact, rigid motions as given.

With q the elastic coordinates, Λ their squared frequencies and f the loads,

    Λ q = f + Wᵀ λ,   0 ≤ λ ⊥ g₀ + W q + R λ + d(λ) ≥ 0,

d(λ) = layer λ for a surface layer or a linear law and (λ/K)^(1/n) for a law K dⁿ. It is the minimum over λ ≥ 0 of the
convex ½ λᵀ C λ + gᵀ λ + Σ ∫ d dλ with C = W Λ⁻¹ Wᵀ + R + layer and g the gaps without contact; each step of Newton's
method is a linear complementarity problem, solved as nonnegative least squares (Lawson & Hanson 1974). Springs on
elastic bodies add their forces to f; C and g are then those of the bodies with the springs, whose tables are linear
between two solutions. Drives hold their bodies, see `held`: they take a part of every compliance.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import linalg

from gudgeon.solver.bodies.small_motion import MOVES
from gudgeon.solver.contact.rows import touching_depth
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.result import Result
from gudgeon.solver.system.held import Held
from gudgeon.solver.system.spring_start import spring_forces, stiffening
from gudgeon.solver.system.system import System

ROUND_OFF = 1e-5
"""Depth of a deformed point down to which it touches without force, relative to that of an undeformed one."""
SMALLEST = 1e-12
"""Least force of a law in its linearisation, relative to the largest: at zero its compliance is infinite."""
CONVERGED = 1e-12
"""Change of the forces, relative to the largest, at which Newton's method ends: quadratic from far above."""
MOST_STEPS, MOST_HALVINGS = 60, 60
PIVOTS = 30
"""Largest number of pivots per row: few are needed."""


def settled(system: System, statics: Held) -> System:
    """Return a system in static equilibrium with its contacts: elastic coordinates and contact forces at the start.

    Rigid motions that supports, `freedom` and drives leave stay as the scene gives them. Points of bodies that move
    freely, which the loads press into what they meet, are `overlaps`: `ports.rest` looks for their equilibrium.

    Args:
        system: Deformed by loads and gravity without contact, unless run.start is 'undeformed'.
        statics: Statics of its drives.

    Raises:
        SceneError: a contact begins inside its obstacle, undeformed.
        SolverError: contact forces are not unique.
    """
    return replace(_settled(system.opened(), statics), gap=system.gap)


def _settled(loaded: System, statics: Held) -> System:
    """Return what `settled` does, of a system whose points all meet their faces."""
    system = _with_springs(loaded, statics, np.zeros(len(loaded.gap)))
    if not len(system.gap):
        return system
    gaps, allowed = _gaps(system), touching_depths(system)
    if system.scene.run.start == "undeformed":
        _refuse_overlap(system, system.gap, np.full(len(gaps), True), allowed)
        return system
    moves = _moves(system, statics, gaps < -allowed)
    overlapping = system.gap - system.sag < -allowed
    _refuse_overlap(system, gaps, overlapping, allowed)
    if (gaps < -ROUND_OFF * allowed)[~moves].any():
        system = _pressed(loaded, statics, moves)
    return replace(system, overlaps=moves & (_start_gaps(system) < -allowed))


def refuse_overlaps(system: System, reasons: list[str]) -> None:
    """Raise a SceneError where points overlap that no equilibrium holds.

    Args:
        reasons: Why there is none.
    """
    if system.overlaps.any():
        _refuse_overlap(system, _start_gaps(system), system.overlaps, touching_depths(system), reasons)


def _pressed(loaded: System, statics: Held, moves: np.ndarray) -> System:
    """Return a system with the contact forces of its equilibrium.

    Args:
        loaded: Without springs and contact forces.
        moves: Which gaps free rigid motions change, (c,).
    """
    without, layer, forces = _static_compliance(loaded, statics), np.diag(loaded.layer), np.zeros(len(loaded.gap))
    system = _with_springs(loaded, statics, forces)
    for _ in range(MOST_STEPS):
        compliance = without + _through_springs(loaded, statics, system)
        gaps = _gaps(system) + loaded.residual @ forces - (compliance - layer) @ forces
        firm, before = np.flatnonzero(~moves & (compliance.diagonal() > 0)), forces
        forces = np.zeros(len(gaps))
        forces[firm] = _forces(loaded, compliance[np.ix_(firm, firm)], gaps[firm], firm)
        system = _with_springs(loaded, statics, forces)
        if not loaded.springs.knots or np.abs(forces - before).max() <= CONVERGED * np.abs(forces).max():
            return system
    raise SceneError(
        "run.start: the static equilibrium of the springs with the contacts was not found; set it to 'undeformed'"
    )


def _with_springs(loaded: System, statics: Held, forces: np.ndarray) -> System:
    """Return a system in equilibrium with contact forces (c,) [N], its springs and its drives."""
    free, compliance = _free_springs(loaded, statics, forces)
    pulled = spring_forces(loaded.springs, free, compliance)
    position, elastic, loads = loaded.position.copy(), loaded.stiffness > 0, loaded.loads
    acting = forces @ loaded.rows + loaded.springs.rows.T @ pulled
    if loaded.scene.run.start == "rest":
        position[elastic] += acting[elastic] / loaded.stiffness[elastic]
    if statics.any and acting.any():
        drives = statics.places
        through = loaded.driving.to_gap[:, drives].T @ forces + loaded.springs.to_loads[:, drives].T @ pulled
        moved, d = statics.answer(statics.rows @ (statics.flexibility * acting) + through, acting[statics.rigid])
        position, loads = position + moved, loads.copy()
        loads[drives] += d
    return replace(loaded, position=position, start_forces=forces, start_pulls=pulled, loads=loads)


def _couplings(loaded: System, statics: Held) -> tuple[np.ndarray, np.ndarray]:
    """Return what unit forces of contacts, (·, c), and springs, (·, b), do to drives and what they hold."""
    springs = statics.coupling(loaded.springs.rows, loaded.springs.to_loads[:, statics.places].T)
    return statics.coupling(loaded.rows, loaded.driving.to_gap[:, statics.places].T), springs


def _free_springs(loaded: System, statics: Held, forces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the elongations under contact forces without those of the springs [m], (b,), and A [m/N], (b, b)."""
    springs, elastic = loaded.springs, loaded.stiffness > 0
    compliance = springs.residual.copy()
    if loaded.scene.run.start == "rest":
        rows = springs.rows[:, elastic]
        compliance += (rows / loaded.stiffness[elastic]) @ rows.T
    if statics.any:
        spring_coupling = _couplings(loaded, statics)[1]
        compliance += statics.change(spring_coupling, spring_coupling)
    free = springs.stretch + springs.rows @ loaded.position + springs.to_loads @ loaded.loads
    return free + _to_contacts(loaded, statics).T @ forces, compliance


def _to_contacts(loaded: System, statics: Held) -> np.ndarray:
    """Return the gaps' change per force on a spring's row by coordinates and R [m/N], (c, b)."""
    compliance = loaded.springs.to_gap + loaded.rows @ (loaded.flexibility * loaded.springs.rows).T
    return compliance + statics.change(*_couplings(loaded, statics)) if statics.any else compliance


def _through_springs(loaded: System, statics: Held, system: System) -> np.ndarray:
    """Return what the springs, as they are in a state, change of the contacts' compliance [m/N], (c, c)."""
    across, (free, compliance) = _to_contacts(loaded, statics), _free_springs(loaded, statics, system.start_forces)
    return across @ stiffening(loaded.springs, system.start_pulls, free, compliance) @ across.T


def _gaps(system: System) -> np.ndarray:
    """Return the gaps at the start without contact forces [m], (c,)."""
    load_gaps = system.driving.to_gap @ system.loads + system.springs.to_gap @ system.start_pulls
    return system.gap + system.moved_gaps(system.position) + load_gaps


def _start_gaps(system: System) -> np.ndarray:
    """Return the gaps at the start [m], (c,); those of surface layers and laws are their indentation."""
    return _gaps(system) + system.residual @ system.start_forces


def touching_depths(system: System) -> np.ndarray:
    """Return the depth up to which each row's point touches and does not penetrate [m], (c,)."""
    allowed = []
    for item in system.contacts:
        position = np.asarray(system.scene.body[item.body].position)
        allowed.append(touching_depth(item.points + position, position))
    return np.array(allowed)[system.contact_of]


def _moves(system: System, statics: Held, overlapping: np.ndarray) -> np.ndarray:
    """Return which gaps free rigid motions change, so that no equilibrium exists, and those of sliding pairs, (c,).

    A body that is squeezed between its obstacles does not move out of them.

    Args:
        overlapping: Points inside their obstacles, (c,).
    """
    sizes, free = system.rows.largest(), system.rows.among(np.arange(len(system.gap)), system.rigid)
    free = free - free @ statics.projector if statics.any else free
    moves = np.abs(free).max(axis=1, initial=0.0) > MOVES * sizes
    pushed_rows = np.flatnonzero(moves & overlapping)
    # Forces that sum up to one, of these points alone, without resultant on any free motion.
    each = free[pushed_rows]
    each = np.column_stack([each / (np.abs(each).max(axis=0, initial=0.0) + np.finfo(float).tiny), np.ones(len(each))])
    if len(pushed_rows) and nonnegative_fit(each.T, np.eye(each.shape[1])[-1])[1] < MOVES:
        moves[:] = False
    for contact in system.contacts:
        moves[contact.rows] |= contact.master is not None
    return moves


def _refuse_overlap(
    system: System, gaps: np.ndarray, refused: np.ndarray, allowed: np.ndarray, reasons: Sequence[str] = ()
) -> None:
    """Raise a SceneError where refused points are inside their obstacle by more than allowed [m], (c,) each."""
    for contact in system.contacts:
        contact_gaps, name = gaps[contact.rows], contact.name
        overlapping = refused[contact.rows] & (contact_gaps < -allowed[contact.rows])
        if not overlapping.any():
            continue
        drawn = not ((system.gap - system.sag)[contact.rows][overlapping] < -allowed[contact.rows][overlapping]).any()
        cause, remedy = (", deformed by the loads", ", or set run.start to 'undeformed'") if drawn else ("", "")
        against = system.scene.contact[name].against
        room = against.clearance.format(name=name, body=getattr(against, "body", ""))
        x, y, z = contact.points[np.flatnonzero(overlapping)[contact_gaps[overlapping].argmin()]] + np.asarray(
            system.scene.body[contact.body].position
        )
        remedy = remedy or f", or set contact.{name}.adjust to true"
        why = "".join(f" {r};" for r in reasons)
        raise SceneError(
            f"contact.{name}: {int(overlapping.sum())} of {len(contact_gaps)} points start inside the obstacle, the"
            f" worst by {-contact_gaps[overlapping].min():.3g} m at ({x:.4g}, {y:.4g}, {z:.4g}) m{cause};{why} move"
            f" body.{contact.body}.position, or {room}{remedy}"
        )


def _static_compliance(system: System, statics: Held) -> np.ndarray:
    """Return C = W Λ⁻¹ Wᵀ + R + layer over the elastic coordinates, less what drives take [m/N], (c, c)."""
    rows = system.rows.dense()
    compliance = (rows * system.flexibility) @ rows.T + system.compliance.dense()
    if statics.any:
        coupling = _couplings(system, statics)[0]
        compliance += statics.change(coupling, coupling)
    return compliance


def _forces(system: System, C: np.ndarray, gaps: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return the contact forces of some rows [N], (k,), with the laws of these rows.

    Raises:
        SolverError: C is singular.
        SceneError: Newton's method does not converge.
    """
    law = system.law[rows]
    smooth = (law[:, 0] > 0) & (system.layer[rows] == 0)
    if not smooth.any():
        return _complementary(system, C, gaps)
    K, n = law[smooth, 0], law[smooth, 1]
    forces = np.zeros(len(gaps))
    forces[smooth] = K * np.maximum(-gaps[smooth], 0.0) ** n

    def energy(f: np.ndarray) -> float:
        return float((0.5 * C @ f + gaps) @ f + (n / (n + 1) * f[smooth] * (f[smooth] / K) ** (1 / n)).sum())

    for _ in range(MOST_STEPS):
        force = np.maximum(forces[smooth], SMALLEST * max(float(forces.max()), np.finfo(float).tiny))
        depth = (force / K) ** (1 / n)
        slope = depth / (n * force)
        matrix, free = C.copy(), gaps.copy()
        matrix[smooth, smooth] += slope
        free[smooth] += depth - slope * force
        change = _complementary(system, matrix, free) - forces
        if np.abs(change).max() <= CONVERGED * np.abs(forces + change).max():
            return forces + change
        step_size, before = 1.0, energy(forces)
        for _halving in range(MOST_HALVINGS):
            if energy(forces + step_size * change) <= before:
                break
            step_size *= 0.5
        forces = forces + step_size * change
    names = ", ".join(dict.fromkeys(system.contacts[i].name for i in system.contact_of[rows]))
    raise SceneError(
        f"contact.{names}: the static equilibrium at the start was not found; set run.start to 'undeformed', or change"
        " the stiffness or the exponent of the law"
    )


def nonnegative_fit(matrix: np.ndarray, rhs: np.ndarray, step_limit: int | None = None) -> tuple[np.ndarray, float]:
    """Return x ≥ 0 of least |A x − b| and this residual, after so many steps at most."""
    from scipy.optimize import nnls  # Late: most runs start without a contact, and it takes a tenth of a second.

    return nnls(matrix, rhs, maxiter=step_limit)


def _complementary(system: System, C: np.ndarray, gaps: np.ndarray) -> np.ndarray:
    """Solve 0 ≤ λ ⊥ g + C λ ≥ 0 [N], (k,), with C positive definite.

    Raises:
        SolverError: C is singular.
    """
    scale = 1 / np.sqrt(C.diagonal())
    try:
        lower = linalg.cholesky(C * scale[:, None] * scale, lower=True)
        rhs = linalg.solve_triangular(lower, -scale * gaps, lower=True)
        scaled_forces = nonnegative_fit(lower.T, rhs, PIVOTS * len(gaps))[0]
        closed = np.flatnonzero(scaled_forces > 0)
        # The forces of the closed rows once more, without the round-off of the factor.
        forces = np.zeros(len(gaps))
        factor = linalg.cho_factor(C[np.ix_(closed, closed)]) if len(closed) else None
        if factor is not None:
            forces[closed] = np.maximum(linalg.cho_solve(factor, -gaps[closed]), 0.0)
    except linalg.LinAlgError:
        raise SolverError(f"contact {', '.join(system.scene.contact)}: {Result.DEPENDENT_ROWS.value}") from None
    return forces
