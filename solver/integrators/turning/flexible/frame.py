"""The floating frame of a body that deforms: constants of its equations, from its modal record.

Places u = x + φ q in axes that turn with the body, from its centre of mass, so that ∫ ρ u = 0 holds in any shape: each
φ_k is less its mean translation. Attachment `fixed` takes from it also the rotation of an interface, `mean-axis` leaves
that of the record, which for free bodies has no angular momentum at rest. With J = ∫ ρ u uᵀ, B_k = ∫ ρ u φ_kᵀ,

  B_k = S_k + Σ_l q_l (G_lk − ½ K_lk),  J = J₀ + Σ_k q_k (S_kᵀ + B_k),

where K has the stiffness by the stress of centrifugal unit loads: −½ q_k q_l K_kl is the part of ∫ ρ (x uᵀ + u xᵀ) by
the displacements of second order. A point moves by Ψ q − ½ qᵀ K q, with K by the stress of unit forces there: by
virtual work the stiffness that its reactions and loads cause (docs/mechanisms.md).
"""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.turning.arrays import MOMENTS
from gudgeon.solver.scene.body import Body

ORTHOGONAL = 1e-10
"""Deviation of a mass from 1 that is round-off of modes."""
LEVI = np.zeros((3, 3, 3))
for _a, _b, _c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    LEVI[_a, _b, _c], LEVI[_a, _c, _b] = 1.0, -1.0


class Frame(NamedTuple):
    """Constants of one body, m elastic coordinates."""

    second: np.ndarray
    """J₀ [kg m²], (3, 3)."""
    lever: np.ndarray
    """S_k [kg^½ m], (m, 3, 3)."""
    pair: np.ndarray
    """G_kl − ½ K_kl [1], (m, m, 3, 3)."""
    root: np.ndarray
    """L, lower, of the mass L Lᵀ, ∫ ρ φ_k · φ_l [1], (m, m)."""
    stiffness: np.ndarray
    """ω² [rad²/s²], (m,)."""
    damping: np.ndarray
    """[1/s], (m,)"""
    turn: np.ndarray
    """Rotation of the attachment per elastic coordinate, which the shapes are less of [kg^-½ m^-1], (3, m)."""
    shift: np.ndarray
    """Translation that they are less of [kg^-½], (3, m)."""
    stressed: bool
    """Whether the stress of loads stiffens it."""


def second_moment(inertia: np.ndarray) -> np.ndarray:
    """Return ∫ ρ x xᵀ of an inertia tensor [kg m²], (3, 3)."""
    return 0.5 * np.trace(inertia) * np.eye(3) - inertia


def frame_of(body: FlexibleBody, settings: Body) -> Frame:
    """Return the constants of a body, along the axes of the scene as it places the body.

    Raises:
        SceneError: its record has no tensors of a floating frame, or no such interface.
    """
    modal, design = body.modal, body.morph
    m, J = len(modal.angular_frequencies), second_moment(design.inertia)
    if not m:
        none, turn = np.empty(0), np.empty((3, 0))
        return Frame(
            J, np.empty((0, 3, 3)), np.empty((0, 0, 3, 3)), np.empty((0, 0)), stiffness=none, damping=none, turn=turn,
            shift=turn, stressed=False,
        )  # fmt: skip
    couplings = modal.inertia_couplings
    if couplings is None or couplings.position_moments is None or couplings.shape_moments is None:
        raise SceneError(
            f"body.{body.name}: the record of its modes, {design.modes_key[:12]}, has no tensors of a floating frame:"
            " solids and beams of motion 'space' without supports have them; give another geometry, or"
            " modes.reduction = 'rigid'"
        )
    S, G = couplings.position_moments, couplings.shape_moments
    theta = np.zeros((3, m))
    if settings.attachment == "fixed":
        theta = _rotation_rows(body, str(settings.attached_to))
    # (θ_k × x)_j = ε_jab θ_ak x_b.
    crossed = np.einsum("jab,ak->jbk", LEVI, theta)
    lever = S - np.einsum("jbk,ib->ijk", crossed, J)
    mixed = np.einsum("jbl,bik->ijkl", crossed, S)
    G = G - mixed - np.einsum("ibk,bjl->ijkl", crossed, S) + np.einsum("iak,jbl,ab->ijkl", crossed, crossed, J)
    shift = couplings.translation / design.mass
    G = G - np.einsum("ik,jl->ijkl", shift, couplings.translation)
    coupled = couplings.rotation.T @ theta
    mass = np.eye(m) - coupled - coupled.T + theta.T @ design.inertia @ theta - shift.T @ couplings.translation
    K = couplings.centrifugal_stiffness
    stressed = settings.geometric_stiffness and K is not None
    if stressed and K is not None:
        G = G - 0.5 * _relative(K, theta)
    return Frame(
        J, lever.transpose(2, 0, 1), G.transpose(2, 3, 0, 1), _root(0.5 * (mass + mass.T), body.name),
        stiffness=modal.angular_frequencies**2, damping=body.damping_rates[body.rigid_count :], turn=theta,
        shift=shift, stressed=stressed,
    )  # fmt: skip


def moments(B: np.ndarray) -> np.ndarray:
    """Return the nine parts of matrices (…, 3, 3) that `arrays.MOMENTS` names, (…, 9)."""
    i, j = np.array(MOMENTS).T
    sums = B[..., i, j] + B[..., j, i]
    differences = (B[..., i, j] - B[..., j, i])[..., 3:]
    return np.concatenate([0.5 * sums[..., :3], sums[..., 3:], differences], axis=-1)


def _root(mass: np.ndarray, body: str) -> np.ndarray:
    """Return the lower root of a mass over elastic coordinates, (m, m); exactly 1 where the mass is to round-off."""
    if np.allclose(mass, np.eye(len(mass)), rtol=0.0, atol=ORTHOGONAL):
        return np.eye(len(mass))
    try:
        return np.linalg.cholesky(mass)
    except np.linalg.LinAlgError:
        raise SceneError(
            f"body.{body}.attachment: 'fixed' leaves an elastic coordinate without inertia; take 'mean-axis'"
        ) from None


def _relative(K: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Return stiffnesses (…, m + 3, m + 3) over shapes and rotations as those of shapes less rotations, (…, m, m)."""
    change = np.vstack([np.eye(theta.shape[1]), -theta])
    return np.einsum("ak,...ab,bl->...kl", change, K, change, optimize=True)


def _rotation_rows(body: FlexibleBody, interface: str) -> np.ndarray:
    load = body.modal.loads.get(interface)
    if load is None or load.unit != "N, N m":
        raise SceneError(f"body.{body.name}.attached_to: '{interface}' given; an interface of kind 'tie' is needed")
    return load.rows[3:]


def point_of(body: FlexibleBody, frame: Frame, interface: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return place [m] from the centre, displacement and rotation per coordinate, and their second order, of a point.

    Returns:
        (3,), (6, m), (6, m, m); the rotations of a mean of a surface, which has none, are zero.
    """
    load, m = body.modal.loads[interface], len(frame.stiffness)
    arm = load.point - body.morph.centre
    rows, bend = np.zeros((6, m)), np.zeros((6, m, m))
    k = len(load.rows)
    rows[:k] = load.rows
    rows[:3] -= frame.shift + np.cross(frame.turn, arm, axisa=0, axisc=0)
    rows[3:k] -= frame.turn[: k - 3]
    if frame.stressed and load.stress_stiffness is not None:
        bend[:k] = _relative(load.stress_stiffness, frame.turn)
    return arm, rows, bend
