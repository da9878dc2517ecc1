"""Static equilibrium at the start of bodies that stand still on contacts: with friction, or with free rigid motions.

All loads act in one increment: a point sticks to where its body, undeformed, is placed, and slips where the force that
holds it there exceeds μ λ_n. With y the gaps and the displacements of tangents from those places,

    y = g + C x + W_r δ,   0 ≤ λ_n ⊥ y_n ≥ 0,   λ_t = Π(λ_t − ρ y_t) onto the disc μ λ_n,   W_rᵀ x + f_r = 0,

C = W_e Λ⁻¹ W_eᵀ + R + layers over the elastic coordinates, δ the small motion of the rigid ones onto their contacts.
Springs and drives are further ports. A point that slides as the run starts, of a body that moves along its contacts or
on a belt, has λ_t = −μ_k λ_n along its velocity, and motions that sliding alone opposes accelerate: those that move no
normal and no point that sticks are not balanced. Where no forces in the cones balance the loads on rigid motions, such
as on too steep a slope, there is none (`balance`). Solved by the semismooth Newton's method of P. Alart and A. Curnier,
Comput. Methods Appl. Mech. Engrg. 92 (1991) 353-375, with a proximal term, so that motions and forces which nothing
determines stay as they are. Bodies for which it finds none start as placed, where no loads press them into each other.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from gudgeon.solver.ports.balance import cannot_balance, carried, determined, typical_compliance
from gudgeon.solver.ports.field_start import in_fields
from gudgeon.solver.ports.members import contact_ports, start_unknowns
from gudgeon.solver.ports.still import any_still, sliding_velocities, still_groups
from gudgeon.solver.ports.surfaces import at_one_place, ports_over
from gudgeon.solver.ports.table import Kind, Ports
from gudgeon.solver.system.equilibrium import refuse_overlaps
from gudgeon.solver.system.springs import Springs
from gudgeon.solver.system.system import System

CONVERGED = 1e-11
"""Residual relative to the largest force at which Newton's method ends."""
PROXIMAL = (1e-10, 1e-7)
"""Shares of the proximal term that are tried, the least first: the method converges by this factor a step."""
MOST_STEPS, MOST_HALVINGS = 100, 16
MOST_PLACES = 8
"""Largest number of solutions with new places of points over the surfaces on which they settle."""
BORDER = 1e-9
"""Share of its limit by which a force on the border of its disc is round-off from it."""
CONTACTS = (Kind.UNILATERAL, Kind.CONE, Kind.LAW, Kind.RUBBING_LAW)
Equilibrium = tuple[np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True)
class _Statics:
    """Bodies that rest on each other. Shapes: n ports, r rigid coordinates, k cones."""

    ports: np.ndarray
    """Their numbers among all, (n,)."""
    free: np.ndarray
    """g: measures without these forces [m], (n,)."""
    compliance: np.ndarray
    """C [m/N], (n, n)."""
    rows: np.ndarray
    """W_r of the rigid motions that ports resist, (n, r)."""
    pull: np.ndarray
    """f_r, (r,)."""
    motions: np.ndarray
    """Over the rigid coordinates of the bodies, (r, c)."""
    rho: np.ndarray
    """[N/m], (n,)."""
    normals: np.ndarray
    """Places among the ports: of unilateral contact without a law."""
    laws: np.ndarray
    """Of contact with a law."""
    law: np.ndarray
    """Its K and n, (l, 2)."""
    cones: np.ndarray
    """Of the normals with friction, (k,)."""
    friction: np.ndarray
    """Static and kinetic coefficient, (k, 2)."""
    sliding: np.ndarray
    """Unit velocities of the cones that slide, zero of others, (k, 2)."""
    springs: np.ndarray
    """Of springs."""
    stretched: np.ndarray
    """Their numbers among all springs' rows."""
    tension: Springs
    drives: np.ndarray
    """Of drives."""


def at_rest(system: System, notes: list[str] | None = None) -> System:
    """Return a system that starts in equilibrium with its fields and, of bodies at rest on them, its contacts.

    Bodies take part that have no crank and no velocity but along their contacts, and touch over a compliance.

    Args:
        notes: Receives a sentence for bodies that have no equilibrium and start as placed.

    Raises:
        SceneError: bodies without one would start as the loads press them into each other.
    """
    if system.scene.run.start != "rest" or system.scene.capabilities.turns:
        return system
    return in_fields(system, _resting, notes) if system.fields.names else _resting(system, notes)


def _resting(system: System, notes: list[str] | None) -> System:
    """Return a system whose bodies at rest on contacts start in equilibrium with them."""
    if not any_still(system):
        refuse_overlaps(system, [])
        return system
    placed, opened = system, system.opened()
    system, said = opened, list[str]()
    for _ in range(MOST_PLACES):
        before, said = system, list[str]()
        system = _balanced_groups(opened, ports_over(opened, before.position), said)
        if at_one_place(system, before.position):
            break
    refuse_overlaps(system, said)
    if notes is not None:
        notes += [f"{reason}; the run starts as placed" for reason in said]
    return placed if system is opened else replace(system, gap=placed.gap)


def _balanced_groups(opened: System, ports: Ports, reasons: list[str]) -> System:
    """Return a system with each group of bodies in its equilibrium, of ports with the surfaces below their points.

    Args:
        reasons: Receives a sentence for each group without one.
    """
    system = opened
    for bodies in still_groups(system, ports):
        statics = _statics(system, ports, bodies)
        if statics is None:
            continue
        slides = _slides(statics, statics.friction[:, 0])
        equilibrium = None if slides else _balanced(statics, _guess(system, ports, statics))
        if equilibrium is not None:
            system = _placed(system, ports, bodies, statics, equilibrium)
            continue
        names, rubs = " and ".join(name for i, name in enumerate(system.bodies) if i in bodies), len(statics.cones)
        lack = f"no static equilibrium{' with friction' if rubs else ''} was found"
        if slides:
            within = " within the friction" if rubs else ""
            lack = f"there is no static equilibrium, since no forces{within} of the contacts balance the loads"
        reasons.append(f"{names}: {lack}")
    return system


def _slides(statics: _Statics, friction: np.ndarray) -> bool:
    """Return whether contacts with these coefficients, (k,), cannot hold the loads at all."""
    stiff = [statics.tension.stiffness[row] > 0 or row in statics.tension.knots for row in statics.stretched]
    both = np.concatenate([statics.springs[np.array(stiff, np.bool_)], statics.drives])
    pressing = np.concatenate([statics.normals, statics.laws])
    rows, slides = statics.rows.copy(), np.any(statics.sliding, axis=1)
    for cone, unit, mu in zip(statics.cones[slides], statics.sliding[slides], statics.friction[slides, 1], strict=True):
        rows[cone] -= mu * unit @ rows[cone + 1 : cone + 3]
    return cannot_balance(rows, statics.pull, pressing, (statics.cones[~slides], friction[~slides]), both)


def _statics(system: System, ports: Ports, bodies: list[int]) -> _Statics | None:
    """Return the statics of some bodies; None where a contact among them has no compliance, nothing holds them, or no
    load presses them on contacts without friction."""
    among = (np.isin(ports.sides, bodies) | (ports.sides < 0)).all(axis=1) & (ports.sides >= 0).any(axis=1)
    members = np.flatnonzero(among & np.isin(ports.kind, [*CONTACTS, Kind.SPRING, Kind.DRIVEN]))
    local = np.full(len(ports.offset), -1)
    local[members] = np.arange(len(members))
    group = [list(system.bodies.values())[b] for b in bodies]
    elastic = np.concatenate([np.arange(body.elastic.start, body.elastic.stop) for body in group])
    rigid = np.concatenate([np.arange(body.rigid.start, body.rigid.stop) for body in group])
    fixed = start_unknowns(system, ports)
    fixed[members] = 0.0
    force = system.driving.gravity + fixed @ ports.rows
    W, R, K = ports.rows.among(members, elastic), ports.residual, system.stiffness[elastic]
    n, law, laws = len(members), [np.zeros((0, 2))], list[int]()
    layer, stuck = np.zeros(n), np.zeros(n, np.bool_)
    normals, cones, friction, overlap = list[int](), list[int](), [np.zeros((0, 2))], False
    for contact in system.contacts:
        span = ports.of(f"contact.{contact.name}")
        if local[span.start] < 0:
            continue
        rows_in, kind = local[contact_ports(ports, contact)], ports.kind[span.start]
        overlap = overlap or bool(system.overlaps[contact.rows].any())
        if kind in (Kind.LAW, Kind.RUBBING_LAW):
            laws += rows_in.tolist()
            law.append(system.law[contact.rows, :2])
        else:
            normals += rows_in.tolist()
            layer[rows_in] = system.layer[contact.rows]
        if kind in (Kind.CONE, Kind.RUBBING_LAW):
            cones += rows_in.tolist()
            friction.append(system.friction[contact.rows])
            stuck[rows_in + 1], stuck[rows_in + 2] = True, True
    C = (W / K) @ W.T + R.among(members, members) + np.diag(layer)
    turned = ports.offset[members] + ports.rows.among(members, rigid) @ system.position[rigid]
    free = turned + (W / K) @ force[elastic] + (R @ fixed)[members] - np.where(stuck, turned, 0.0)
    drives = local[ports.numbers([f"motion.{d.name}" for d in system.driving.drives])]
    free[drives[drives >= 0]] -= system.driving.driven(np.zeros(1))[0, drives >= 0, 0]
    springs = local[ports.numbers([f"force.{name}" for name in system.scene.springs()])]
    rows, diag = ports.rows.among(members, rigid), C.diagonal()
    sliding = sliding_velocities(system, ports, members[np.array(cones, int)])
    slid, held_rows = np.array(cones, int)[np.any(sliding, axis=1)], rows.copy()
    held_rows[[*(slid + 1), *(slid + 2), *(springs[springs >= 0] if len(slid) else ())]] = 0.0
    load = carried(held_rows, force[rigid], rubs=bool(cones) and not len(slid), overlap=overlap)
    if load is None or not (diag[normals] > 0).all():
        return None
    typical = typical_compliance(diag, np.vstack(law), rows, load)
    if not typical > 0:
        return None
    rho = 1 / np.where(diag > 1e-9 * typical, diag, typical)
    t1, t2 = np.array(cones, int) + 1, np.array(cones, int) + 2
    both = diag[t1] + diag[t2]  # Above the larger eigenvalue of the 2 × 2 block of the tangents.
    rho[t1] = rho[t2] = 1 / np.where(both > 1e-9 * typical, both, typical)
    motions = determined(held_rows)
    return _Statics(
        ports=members, free=free, compliance=C, rows=rows @ motions.T, pull=motions @ load,
        motions=motions, rho=rho, normals=np.array(normals, int), laws=np.array(laws, int), law=np.vstack(law),
        cones=np.array(cones, int), friction=np.vstack(friction), sliding=sliding, springs=springs[springs >= 0],
        stretched=np.flatnonzero(springs >= 0), tension=system.springs, drives=drives[drives >= 0],
    )  # fmt: skip


def _guess(system: System, ports: Ports, statics: _Statics) -> np.ndarray:
    """Return forces near those of the equilibrium [N], (n,): on contacts alone the least ones that carry the loads."""
    guess = start_unknowns(system, ports)[statics.ports]
    pressing = np.concatenate([statics.normals, statics.laws])
    if len(statics.pull) and np.any(statics.pull):
        touching = pressing[statics.free[pressing] <= statics.free[pressing].min() + 1e-3 / statics.rho[pressing].min()]
        carrying = np.unique(np.concatenate([touching, *(statics.cones + b for b in (1, 2))]))
        lacking = -statics.pull - statics.rows.T @ guess
        guess[carrying] += np.linalg.lstsq(statics.rows[carrying].T, lacking, rcond=1e-12)[0]
        mean = np.abs(guess[touching]).mean() if len(touching) else 0.0
        guess[touching] = np.maximum(guess[touching], 0.01 * mean)
    return guess


def _balanced(statics: _Statics, guess: np.ndarray) -> Equilibrium | None:
    """Return the forces (n,), the rigid motion (r,) and which cones slip (k,) of the equilibrium; None without one."""
    slipped = np.any(statics.sliding, axis=1)
    x = np.concatenate([guess, np.zeros(len(statics.pull))])
    tension = statics.tension
    if (tension.stiffness[statics.stretched] < 0).any():  # Loads that soften have equilibria far away, too.
        stiff = replace(statics, tension=replace(tension, stiffness=np.maximum(tension.stiffness, 0.0)))
        x = (_newton(stiff, slipped, x, PROXIMAL[0]) or (x,))[0]
    for _ in range(len(slipped) + 1):
        tried = (_newton(statics, slipped, x, weight) for weight in PROXIMAL)
        solved = next((s for s in tried if s is not None), None)
        if solved is None:
            return None
        x, slips = solved
        if not (slips & ~slipped).any() or (statics.friction[:, 0] == statics.friction[:, 1]).all():
            n = len(statics.ports)
            forces, pressing = x[:n], np.concatenate([statics.normals, statics.laws])
            open_ = forces[pressing] <= CONVERGED * np.abs(forces).max(initial=0.0)
            forces[pressing[open_]] = 0.0
            for cone in statics.cones[forces[statics.cones] == 0.0]:
                forces[cone : cone + 3] = 0.0
            return forces, x[n:], slips
        slipped |= slips
        if _slides(statics, np.where(slipped, statics.friction[:, 1], statics.friction[:, 0])):
            return None
    return None


def _newton(
    statics: _Statics, slipped: np.ndarray, x: np.ndarray, weight: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return forces with rigid motions, (n + r,), and which cones slip, (k,); None where the method does not converge.

    Args:
        slipped: Cones that have the kinetic coefficient, (k,).
        weight: Of the proximal term.
    """
    n = len(statics.ports)
    size = np.linalg.norm(statics.rows, axis=0)
    moved = 1 / np.linalg.norm(statics.rho[:, None] * statics.rows, axis=0)  # Per unit of a rigid motion's unknown.
    x = np.concatenate([x[:n], x[n:] / moved])
    for _ in range(MOST_STEPS):
        wrong, matrix, slips = _derived(statics, slipped, x, (moved, size))
        largest = float(np.abs(x[:n]).max(initial=0.0))
        if np.abs(wrong).max(initial=0.0) <= CONVERGED * largest:
            return np.concatenate([x[:n], x[n:] * moved]), slips
        matrix[np.arange(n), np.arange(n)] += weight
        matrix[np.arange(n, len(x)), np.arange(n, len(x))] -= weight
        try:
            step = linalg.solve(matrix, wrong, check_finite=True)
        except (linalg.LinAlgError, ValueError):
            return None
        x = x - step * _fraction(lambda z: _derived(statics, slipped, z, (moved, size))[0], x, step, wrong)
    return None


def _fraction(
    residual: Callable[[np.ndarray], np.ndarray], x: np.ndarray, step: np.ndarray, wrong: np.ndarray
) -> float:
    """Return which fraction of a step reduces the residual, among halves; the best of them where none does."""
    fractions, best, smallest = 0.5 ** np.arange(MOST_HALVINGS), 1.0, np.inf
    for fraction in fractions:
        size = float(np.linalg.norm(residual(x - fraction * step)))
        if size < smallest:
            best, smallest = float(fraction), size
        if size <= (1 - 1e-4 * fraction) * np.linalg.norm(wrong):
            break
    return best


def _derived(
    statics: _Statics, slipped: np.ndarray, x: np.ndarray, scales: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the residual [N], (n + r,), its derivative, and which cones slip, (k,)."""
    moved, size = scales
    n, rho = len(statics.ports), statics.rho
    forces, slope = x[:n], np.hstack([statics.compliance, statics.rows * moved])
    y = statics.free + slope @ x
    wrong, matrix = np.zeros(len(x)), np.zeros((len(x), len(x)))
    identity = np.eye(n, len(x))
    closed = forces[statics.normals] - rho[statics.normals] * y[statics.normals] > 0
    on, off = statics.normals[closed], statics.normals[~closed]
    wrong[on], matrix[on] = rho[on] * y[on], rho[on, None] * slope[on]
    wrong[off], matrix[off] = forces[off], identity[off]
    depth, (K, exponent) = np.maximum(-y[statics.laws], 0.0), statics.law.T
    wrong[statics.laws] = forces[statics.laws] - K * depth**exponent
    matrix[statics.laws] = (
        identity[statics.laws] + (K * exponent * depth ** (exponent - 1))[:, None] * slope[statics.laws]
    )
    slips = np.zeros(len(slipped), np.bool_)
    for k, normal in enumerate(statics.cones):
        pair = np.array([normal + 1, normal + 2])
        if (unit := statics.sliding[k]).any():
            mu, slips[k] = statics.friction[k, 1], True
            wrong[pair] = forces[pair] + mu * forces[normal] * unit
            matrix[pair] = identity[pair] + mu * np.outer(unit, identity[normal])
            continue
        trial = forces[pair] - rho[pair] * y[pair]
        mu = statics.friction[k, 1 if slipped[k] else 0]
        limit, length = mu * max(float(forces[normal]), 0.0), float(np.linalg.norm(trial))
        slips[k] = length > limit * (1 + BORDER) and limit > 0
        if length <= limit:
            wrong[pair], matrix[pair] = rho[pair] * y[pair], rho[pair, None] * slope[pair]
        else:
            unit = trial / length
            across = (np.eye(2) - np.outer(unit, unit)) * (limit / length)
            wrong[pair] = forces[pair] - limit * unit
            matrix[pair] = identity[pair] - across @ (identity[pair] - rho[pair, None] * slope[pair])
            matrix[pair] -= mu * (forces[normal] > 0) * np.outer(unit, identity[normal])
    pulled, stiffness = statics.tension.tension(_all_springs(statics, y[statics.springs]))
    wrong[statics.springs] = forces[statics.springs] + pulled[statics.stretched]
    matrix[statics.springs] = identity[statics.springs] + stiffness[statics.stretched, None] * slope[statics.springs]
    wrong[statics.drives] = rho[statics.drives] * y[statics.drives]
    matrix[statics.drives] = rho[statics.drives, None] * slope[statics.drives]
    wrong[n:] = (statics.rows.T @ forces + statics.pull) / size
    matrix[n:, :n] = statics.rows.T / size[:, None]
    return wrong, matrix, slips


def _all_springs(statics: _Statics, elongation: np.ndarray) -> np.ndarray:
    """Return elongations of all springs' rows with those of these bodies [m], (b,)."""
    elongations = np.zeros(len(statics.tension.stiffness))
    elongations[statics.stretched] = elongation
    return elongations


def _placed(system: System, ports: Ports, bodies: list[int], statics: _Statics, equilibrium: Equilibrium) -> System:
    """Return the system with some bodies in their equilibrium."""
    forces, motion, slips = equilibrium
    unknown = start_unknowns(system, ports)
    unknown[statics.ports] = forces
    position, local = system.position.copy(), np.full(len(ports.offset), -1)
    local[statics.ports] = np.arange(len(forces))
    acting = system.driving.gravity + unknown @ ports.rows
    group = [list(system.bodies.values())[b] for b in bodies]
    rigid = np.concatenate([np.arange(body.rigid.start, body.rigid.stop) for body in group])
    for body in group:
        position[body.elastic] = acting[body.elastic] / system.stiffness[body.elastic]
    position[rigid] += motion @ statics.motions
    displacement = statics.free + statics.compliance @ forces + statics.rows @ motion
    contact_forces, pulls, loads = system.start_forces.copy(), system.start_pulls.copy(), system.loads.copy()
    rubbed, stretch = system.start_friction.copy(), system.start_stretch.copy()
    overlaps = system.overlaps.copy()
    sliding = dict(zip(statics.cones.tolist(), slips.tolist(), strict=True))
    for contact in system.contacts:
        for normal, row in zip(
            contact_ports(ports, contact), range(*contact.rows.indices(len(contact_forces))), strict=True
        ):
            local_row = int(local[normal])
            if local_row < 0:
                continue
            contact_forces[row], overlaps[row] = max(0.0, forces[local_row]), False
            if local_row in sliding:
                rubbed[row] = forces[local_row + 1 : local_row + 3]
                slips_here = sliding[local_row] or contact_forces[row] == 0.0
                stretch[row] = 0.0 if slips_here else displacement[local_row + 1 : local_row + 3]
    for name in system.scene.springs():
        pulls[system.springs.of(name)] = unknown[ports.of(f"force.{name}")]
    for drive, local_row in system.driving.driven_rows():
        loads[local_row] = unknown[ports.of(f"motion.{drive.name}")]
    return replace(
        system, position=position, start_forces=contact_forces, start_pulls=pulls, loads=loads, start_friction=rubbed,
        start_stretch=stretch, overlaps=overlaps,
    )  # fmt: skip
