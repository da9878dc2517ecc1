"""Whether contacts with friction can balance loads at all: statics of rigid motions, before an equilibrium is sought.

With W_r the rows of ports over the rigid motions, f the loads on these and K the product of the cones |λ_t| ≤ μ λ_n of
contacts, half-lines of contacts without friction and lines of springs and drives, it is needed that

    min ‖W_rᵀ λ + f‖ over λ in K

is zero. Nonnegative least squares over some edges of the cones (Lawson & Hanson 1974); each round adds the edge of each
cone along which the residual r decreases most, W_n r − μ |W_t r|. Where there is none, r is a motion that no force of K
opposes and the loads drive (the lemma of J. Farkas, J. reine angew. Math. 124 (1902) 1-27): nothing balances them.
"""

import numpy as np

from gudgeon.solver.system.equilibrium import nonnegative_fit

BALANCED = 1e-6
"""Share of the loads that is left where they count as balanced: just at the border Newton's method decides."""
OPPOSED = 1e-10
"""Work of an edge on a motion, relative to both, from which on it opposes the motion."""
MOST_ROUNDS = 100
ROUND_OFF = 1e-11
"""Share of the largest load that is round-off."""
UNDETERMINED = 1e-9
"""Displacement of ports by a rigid motion, relative to that by the strongest one, that is round-off."""


def determined(rows: np.ndarray) -> np.ndarray:
    """Return the rigid motions, orthonormal, (k, r), that move rows (n, r) by more than round-off.

    Statics do not determine the others: an unknown for one would grow until its round-off moves the rows.
    """
    resisted = np.any(rows, axis=0)
    _, strength, motions = np.linalg.svd(rows[:, resisted], full_matrices=False)
    strong = strength > UNDETERMINED * strength.max(initial=0.0)
    basis = np.eye(int(resisted.sum())) if strong.sum() == resisted.sum() else motions[strong]
    over_all = np.zeros((len(basis), rows.shape[1]))
    over_all[:, resisted] = basis
    return over_all


def typical_compliance(compliances: np.ndarray, law: np.ndarray, rows: np.ndarray, load: np.ndarray) -> float:
    """Return the largest compliance of ports, (n,), or that of rigid bodies on laws K and n, (l, 2): the inverse of its
    slope, under a share of the load, (r,), on rows (n, r) [m/N]; 0 of none."""
    largest = float(compliances.max(initial=0.0))
    if largest > 0 or not (np.any(load) and np.any(rows)):
        return largest
    (K, exponent), mean_load = law.T, float(np.linalg.norm(load) / np.linalg.norm(rows))
    return float(((mean_load / K) ** (1 / exponent)).max(initial=0.0)) / mean_load


def carried(rows: np.ndarray, rigid_load: np.ndarray, *, rubs: bool, overlap: bool) -> np.ndarray | None:
    """Return the loads on rigid motions that ports carry; None where friction leaves some, or without friction all and
    points do not overlap.

    What nothing holds moves bodies without friction as a whole, which are at rest across it.
    """
    tolerance = ROUND_OFF * np.abs(rigid_load).max(initial=0.0)
    if rubs:
        return rigid_load if (np.abs(rigid_load[~np.any(rows, axis=0)]) <= tolerance).all() else None
    borne = rows.T @ np.linalg.lstsq(rows.T, rigid_load, rcond=1e-12)[0]
    return borne if overlap or np.abs(borne).max(initial=0.0) > tolerance else None


def cannot_balance(
    rows: np.ndarray, load: np.ndarray, normals: np.ndarray, cones: tuple[np.ndarray, np.ndarray], both: np.ndarray
) -> bool:
    """Return whether no forces of ports balance loads on rigid motions.

    Args:
        rows: W_r, (n, r).
        load: f, (r,).
        normals: Numbers of ports whose forces only press; points in reach that may never touch do no harm, (p,).
        cones: Those of the normals with friction, (k,), whose tangents follow them, and their coefficients, (k,).
        both: Ports with forces of either sign, (b,).
    """
    numbers, friction = cones
    size = np.linalg.norm(rows, axis=0)
    if not len(load) or not np.any(load) or not (size > 0).all():
        return False
    W, f = rows / size, load / size
    N, T = W[numbers], np.stack([W[numbers + 1], W[numbers + 2]], axis=1)
    edges = np.vstack([W[normals], W[both], -W[both]])
    for _ in range(MOST_ROUNDS):
        edges = edges[np.any(edges, axis=1)]
        forces, r = _least(edges, f)
        residual = float(np.linalg.norm(r))
        if residual <= BALANCED * float(np.linalg.norm(f)):
            return False
        along = T @ r
        length = np.linalg.norm(along, axis=1)
        unit = along / np.maximum(length, np.finfo(float).tiny)[:, None]
        tried = N - friction[:, None] * np.einsum("kd,kdr->kr", unit, T)
        work = tried @ r
        helps = work < -OPPOSED * residual * np.linalg.norm(tried, axis=1)
        if not helps.any():
            return True
        edges = np.vstack([edges[forces > 0], W[normals], W[both], -W[both], tried[helps]])
    return False


def _least(edges: np.ndarray, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the forces along edges, (e,), and the residual of f, (r,)."""
    units = edges / np.linalg.norm(edges, axis=1)[:, None]
    forces = nonnegative_fit(units.T, -f)[0]
    return forces, f + units.T @ forces
