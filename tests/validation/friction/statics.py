"""Statics of N1 on the compliance that a run has, W K⁻¹ Wᵀ + R: normal forces, then friction within μ times these.

Caps are halves, whose forces and compliance are turned into those of whole ones.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg, optimize

from gudgeon.solver.simulation import Steps
from tests.validation.friction.records import SLIPS, Pair, reference

REFERENCE = reference("N1_mindlin_sphere")
GIVEN, A = REFERENCE["parameters"], REFERENCE["expected"]["contact_radius"]["value"]
NU, MODULUS, LOAD, MU = GIVEN["nu"], GIVEN["E"], GIVEN["normal_load"], GIVEN["friction"]
LARGEST = GIVEN["oscillation_amplitude_over_muP"] * MU * LOAD
"""Of the shear in a cycle [N]."""
STEPS = 12
"""Of a quarter of a cycle."""
CLOSE, STEPS_OF_NEWTON = 1e-9, 200
"""Residual over the largest limit at which Newton's method ends, and how many steps it has at most."""


def compliance(steps: Steps) -> np.ndarray:
    """Return the displacement of points under forces on whole caps along normal, x and y [m/N], (c, 3, c, 3)."""
    table, system = steps._run.ports, steps.system
    here = np.r_[table.of("contact.touch")]
    rows = table.rows[here]
    found = (rows * system.flexibility) @ rows.T + table.residual.among(here, here)
    directions = table.blocks[0].directions
    assert directions is not None
    turn = directions.reshape(-1, 3, 3).copy()
    turn[:, 0] = 0.0
    turn = turn[:, :, :2]
    c = len(turn)
    found = 0.5 * (0.5 * (found + found.T)).reshape(c, 3, c, 3)  # Half of a force acts on each half.
    across = np.einsum("iax,iajb,jby->ixjy", turn, found, turn)
    found[:, 1:, :, 1:] = across
    return found


def normal_forces(normal: np.ndarray, gap: np.ndarray) -> np.ndarray:
    """Return the forces of points under the load [N], (c,)."""
    factor = linalg.cholesky(normal, lower=True)

    def forces(approach: float) -> np.ndarray:
        wanted = linalg.solve_triangular(factor, approach - gap, lower=True)
        return np.asarray(optimize.nnls(factor.T, wanted, maxiter=10**5)[0])

    size = A**2 / GIVEN["R"]
    return forces(float(optimize.brentq(lambda one: forces(one).sum() - LOAD, 0.5 * size, 2 * size, rtol=1e-9)))


def hold(flexibility: np.ndarray, measure: np.ndarray, force: np.ndarray, limit: np.ndarray, reach: np.ndarray) -> bool:
    """Find friction (c, 2) [N] that holds points within limits (c,) [N]; `measure` is their slip [m]; both change.

    F = P(F − s / reach), P the projection on a point's disc, by semismooth steps of Newton's method (Alart & Curnier
    1991); a step that does not reduce the residual is halved.
    """
    c, matrix = len(limit), flexibility.reshape(2 * len(limit), -1)

    def residual(forces: np.ndarray, slip: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        trial = forces - slip / reach[:, None]
        size = np.maximum(np.linalg.norm(trial, axis=1), 1e-300)
        scale = np.minimum(1.0, limit / size)
        return forces - scale[:, None] * trial, trial / size[:, None], scale

    error, direction, scale = residual(force, measure)
    for _ in range(STEPS_OF_NEWTON):
        worst = float(np.linalg.norm(error))
        if np.abs(error).max() < CLOSE * limit.max():
            return True
        # ∂P is the unit matrix within a disc, and scale (1 − d dᵀ) beyond it.
        projection = np.eye(2) - np.where(scale < 1.0, 1.0, 0.0)[:, None, None] * np.einsum(
            "ia,ib->iab", direction, direction
        )
        projection *= scale[:, None, None]
        tangent = np.zeros((c, 2, c, 2))
        tangent[np.arange(c), :, np.arange(c), :] = np.eye(2) - projection
        tangent += np.einsum("iab,ibjd->iajd", projection / reach[:, None, None], matrix.reshape(c, 2, c, 2))
        step = -np.linalg.solve(tangent.reshape(2 * c, 2 * c), error.reshape(-1))
        moved, share = matrix @ step, 1.0
        for _halving in range(12):
            forces, slip = force + share * step.reshape(c, 2), measure + share * moved.reshape(c, 2)
            error, direction, scale = residual(forces, slip)
            if np.linalg.norm(error) < worst:
                break
            share *= 0.5
        force[:], measure[:] = forces, slip
    return False


@dataclass(frozen=True)
class Statics:
    """What the c closed points of two pressed caps have."""

    across: np.ndarray
    """Displacement along x and y under forces along them [m/N], (c, 2, c, 2)."""
    along: np.ndarray
    """The same along the normals [m/N], (c, c)."""
    limit: np.ndarray
    """Largest friction [N], (c,)."""
    areas: np.ndarray
    """[m²], (c,)."""


def statics_of(pair: Pair) -> Statics:
    """Return the statics of halves of two caps under the load."""
    found, gap = compliance(pair.steps), pair.steps._run.ports.offset.reshape(-1, 3)[: len(pair.areas), 0]
    normal = normal_forces(found[:, 0, :, 0], gap)
    closed = np.flatnonzero(normal > 0)
    found = found[closed][:, :, closed]
    across, along = np.ascontiguousarray(found[:, 1:, :, 1:]), found[:, 0, :, 0]
    return Statics(across, along, MU * normal[closed], 2 * pair.areas[closed])


def proportional(found: Statics) -> Statics:
    """Return it with a compliance across in proportion to the normal one, as of half spaces."""
    across = np.zeros_like(found.across)
    for a in range(2):
        across[:, a, :, a] = (2 - NU) / (2 - 2 * NU) * found.along
    return replace(found, across=across)


def lost_in_a_cycle(found: Statics) -> tuple[float, float]:
    """Return the energy lost in a cycle [J], and the radius of stick at its largest force [m]."""
    across, limit = found.across, found.limit
    reach = np.linalg.eigvalsh(np.einsum("iaib->iab", across))[:, -1]
    force, moved = np.zeros((len(limit), 2)), np.zeros((len(limit), 2))

    def go(displacement: float) -> float:
        """Move; return what is lost [J]."""
        nonlocal moved
        base = np.zeros_like(force)
        base[:, 0] = displacement
        slip = base + np.einsum("iajb,jb->ia", across, force) - moved
        if not hold(across, slip, force, limit, reach):
            raise RuntimeError("friction: the sweeps have not converged")
        moved = moved + slip
        return -float((force * slip).sum())

    def virgin(displacement: float) -> float:
        nonlocal moved
        force[:], moved = 0.0, np.zeros_like(force)
        go(displacement)
        return -float(force[:, 0].sum()) - LARGEST

    ease = 3 * (2 - NU) * (1 + NU) / MODULUS / 2 / A * LARGEST
    largest = float(optimize.brentq(virgin, 0.05 * ease, 1.5 * ease, rtol=1e-4))
    virgin(0.0)
    for k in range(STEPS):
        go(largest * np.sin(0.5 * np.pi * (k + 1) / STEPS))
    stuck = np.linalg.norm(force, axis=1) < (1 - SLIPS) * limit
    lost = sum(go(largest * np.cos(0.5 * np.pi * k / STEPS)) for k in range(1, 2 * STEPS + 1))
    return 2 * lost, float(np.sqrt(found.areas[stuck].sum() / np.pi))
