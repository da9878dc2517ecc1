"""Bodies that joints hold on the ground in small motion: the coordinates that their joints leave.

With q the n rigid and elastic coordinates of a body, Λ their squared frequencies, zero of rigid ones, and C the rows of
its held ties, six of each joint,

    q̈ + Λ q = f + Cᵀ λ,   C q = 0.

Z spans the motions with C Z = 0, and ω' and V are the singular values and right vectors of Λ^½ Z, which keep the digits
of low frequencies beside those of static shapes. With q = T q', T = Z V, TᵀT = 1,

    q̈' + c' q̇' + ω'² q' = Tᵀ f

are modes of the held body, and its record gets their rows. Damping acts in each of them as its stress does, so that
joints bear it too:

    λ = (Cᵀ)⁺ (Λ T (q' + c' q̇'/ω'²) − f).

These six values of each joint are a gauge of the body. Where rows imply others they are those of least norm, of rows
that are scaled to one.

At rest joints bear λ = L₀ f in these coordinates, and L f = (L₀ + D) f of the whole body, which R knows. With the rows
B of R over elastic coordinates, those of ties B_t, E = B Λ⁻¹ Bᵀ, W₀ = (1, L₀) and W = (1, L), forces with reactions,

    (E + R)_tt D + C_r s = −R_t W₀,   C_rᵀ D = 0,   R' = Wᵀ R W + Dᵀ E_tt D,   S' = S W + G Λ⁻¹ B_tᵀ D,

for gauges with rows G and residual S: what loads and contacts do at rest is exact with any modes. D is zero where modes
have the static shapes of the ties.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gudgeon.modaldb.records.gauges import GaugeModes
from gudgeon.modaldb.records.modes import SHAPE_ERRORS, InterfaceModes, LoadModes, TractionModes
from gudgeon.modaldb.records.tangents import tangents
from gudgeon.solver.bodies.small_motion import FlexibleBody, named
from gudgeon.solver.errors import SceneError

HELD = "joint."
"""Beginning of the names of gauges that are forces and moments of joints; those of scenes have no dot."""
IMPLIED = 1e-7
"""Singular value of the scaled rows, over the largest, below which others imply them."""
RIGID = 1e-9
"""Frequency over the largest below which a motion is rigid."""
ALIKE = 1e-12
"""Compliance of a combination of the scaled rows, over the largest, that is none: another joint holds it."""
KNOWN = 0.5
"""Share of a mode's energy whose errors of frequencies must be known for an estimate of its own."""


def held_body(body: FlexibleBody, joints: Mapping[str, str]) -> FlexibleBody:
    """Return a body whose coordinates are those that joints at interfaces leave.

    Args:
        joints: Interface of kind 'tie' of each joint that holds it on the ground.

    Raises:
        SceneError: it has no such interface, does not deform, its bases change, or the joints leave no motion.
    """
    modal = body.modal
    loads = [_tie(body, interface, f"joint.{name}") for name, interface in joints.items()]
    if modal.swap is not None:
        raise SceneError(f"body.{body.name}: its bases change, and joint.{min(joints)} holds it; hold it by supports")
    C = np.vstack([np.column_stack([body.wrench_rows(load.resultant), load.rows]) for load in loads])
    scale = _scales(C)
    U, sizes, right = np.linalg.svd(scale[:, None] * C)
    rank = int((sizes > IMPLIED * sizes.max(initial=0.0)).sum())
    omega, T = _modes(np.sqrt(body.stiffness), right[rank:].T)
    if not len(omega):
        names = " and ".join(f"joint.{name}" for name in joints)
        raise SceneError(f"{names}: all motions of body '{body.name}' are held; keep more modes of its component")
    if omega[0] <= RIGID * omega[-1]:
        raise SceneError(f"joint.{min(joints)}: body '{body.name}' still moves as a whole; set integrator 'turning'")
    # (Cᵀ)⁺ of the scaled rows.
    inverse = scale[:, None] * ((U[:, :rank] / sizes[:rank]) @ right[:rank])
    weight, every = _weight(body), _all_rows(body)
    gauges, R = _answers(body, joints, (inverse, scale), (omega, T), np.vstack([every, weight]))
    top = modal.angular_frequencies[modal.are_modes].max(initial=0.0)
    changed = replace(
        modal,
        angular_frequencies=omega, normal_count=int((omega <= top).sum()),
        quality={name: value for name, value in modal.quality.items() if name != SHAPE_ERRORS},
        interfaces={name: _held_points(body, name, i, T) for name, i in modal.interfaces.items()},
        tractions={name: _held_space(body, t, T) for name, t in modal.tractions.items()},
        loads={name: _held_load(body, load, T) for name, load in modal.loads.items()},
        residual_flexibility=R, gauges=gauges, participation=weight @ T, discretisation_errors=_errors(body, T, omega),
        shapes=None, inertia_couplings=None, residuals=None, algebraic_errors=None, static_responses=None,
    )  # fmt: skip
    return replace(body, modal=changed, twists=np.empty((0, 6)), basis=T)


def _answers(
    body: FlexibleBody,
    joints: Mapping[str, str],
    rows_held: tuple[np.ndarray, np.ndarray],
    modes: tuple[np.ndarray, np.ndarray],
    forces: np.ndarray,
) -> tuple[dict[str, GaugeModes], np.ndarray | None]:
    """Return the gauges of a held body, with those of its joints, and R'.

    Args:
        rows_held: (Cᵀ)⁺, (6 k, r + m), and the factors of the rows, (6 k,).
        modes: Frequencies [rad/s], (n,), and T, (r + m, n).
        forces: Rows of unit forces on all rows of R, then of gravity along x, y, z, (C + 3, r + m).
    """
    modal, (inverse, scale), (omega, T), count = body.modal, rows_held, modes, len(forces) - 3
    ties = np.concatenate([np.arange(*modal.interface_rows[j]) for j in joints.values()])
    rows, direct = inverse @ (body.stiffness[:, None] * T), inverse @ forces.T
    borne = (rows / omega**2) @ (forces @ T).T - direct
    flexible = _Statics(body, ties, forces[ties])
    extra = flexible.further(borne, scale)
    gauges = {
        name: replace(
            gauge, rows=_over(body, gauge.rows) @ T, residual=flexible.read(gauge, borne[:, :count], extra[:, :count]),
            weights=flexible.weighed(gauge, borne[:, count:], extra[:, count:]),
        )
        for name, gauge in modal.gauges.items()
    }  # fmt: skip
    for i, name in enumerate(joints):
        span = slice(6 * i, 6 * i + 6)
        static = (extra - direct)[span]
        gauges[HELD + name] = GaugeModes(rows[span], static[:, :count], "N, N m", weights=static[:, count:])
    return gauges, flexible.residual(borne[:, :count], extra[:, :count])


class _Statics:
    """What a body that joints hold answers at rest, over all C rows of R, k of which are its ties; theirs are rows."""

    def __init__(self, body: FlexibleBody, ties: np.ndarray, rows: np.ndarray) -> None:
        self._ties, self._R, r = ties, body.modal.residual_flexibility, body.rigid_count
        self._rigid, self._answers = rows[:, :r], rows[:, r:] / body.modal.angular_frequencies**2
        self._carried = self._answers @ rows[:, r:].T

    def further(self, borne: np.ndarray, scale: np.ndarray) -> np.ndarray:
        """Return D for n forces of which joints bear `borne` in the coordinates, (k, n): those on all rows of R first.

        Args:
            scale: Factors of the rows of ties, (k,).
        """
        if self._R is None:
            return np.zeros_like(borne)
        lack = self._R[np.ix_(self._ties, self._ties)]
        rhs = lack @ borne
        rhs[:, : len(self._R)] += self._R[self._ties]
        k, C = len(scale), scale[:, None] * self._rigid
        flexibility = np.outer(scale, scale) * (self._carried + lack)
        typical = float(flexibility.diagonal().max())
        size = np.maximum(np.linalg.norm(C, axis=0), np.finfo(float).tiny)
        statics = np.zeros((k + C.shape[1],) * 2)
        statics[:k, :k], statics[:k, k:], statics[k:, :k] = flexibility / typical, C / size, (C / size).T
        inverse = np.linalg.pinv(statics, rcond=ALIKE, hermitian=True)[:k, :k]
        return -scale[:, None] * (inverse @ (scale[:, None] * rhs)) / typical

    def residual(self, borne: np.ndarray, extra: np.ndarray) -> np.ndarray | None:
        """Return R', (C, C)."""
        if self._R is None:
            return None
        acting, through = borne + extra, self._R[:, self._ties]
        # R may be large: its half with one product of thin matrices, then the other half.
        half = 0.5 * (acting.T @ through[self._ties] @ acting + extra.T @ self._carried @ extra)
        half += through @ acting
        half += half.T.copy()
        half += self._R
        return half

    def read(self, gauge: GaugeModes, borne: np.ndarray, extra: np.ndarray) -> np.ndarray:
        """Return S' of a gauge, (g, C)."""
        if not gauge.residual.size:
            return gauge.residual
        return gauge.residual + gauge.residual[:, self._ties] @ (borne + extra) + gauge.rows @ self._answers.T @ extra

    def weighed(self, gauge: GaugeModes, borne: np.ndarray, extra: np.ndarray) -> np.ndarray | None:
        """Return what a gauge shows of unit gravity beside its coordinates, (g, 3)."""
        if not gauge.residual.size:
            return gauge.weights
        readings = gauge.residual[:, self._ties] @ (borne + extra) + gauge.rows @ self._answers.T @ extra
        return readings if gauge.weights is None else readings + gauge.weights


def _tie(body: FlexibleBody, interface: str, key: str) -> LoadModes:
    """Return the rows of a tie."""
    if not len(body.modal.angular_frequencies):
        raise SceneError(f"{key}: body '{body.name}' does not deform; set run.integrator to 'turning'")
    load = named(body.modal.loads, interface, f"{key}.interface: body '{body.name}' has no tie")
    if len(load.rows) != 6:
        raise SceneError(f"{key}.interface: '{interface}' has {len(load.rows)} rows; kind 'tie' is needed")
    return load


def _scales(rows: np.ndarray) -> np.ndarray:
    """Return factors by which rows of each three forces or moments, (6 k, n), are of size one, (6 k,)."""
    sizes = np.sqrt((rows**2).sum(axis=1).reshape(-1, 3).max(axis=1))
    return np.repeat(1 / np.where(sizes > 0, sizes, 1.0), 3)


def _modes(omega: np.ndarray, Z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies [rad/s], ascending, (n,), and modes T, (r + m, n), of motions Z, (r + m, n)."""
    if not Z.shape[1]:
        return np.empty(0), Z
    _, frequencies, right = np.linalg.svd(omega[:, None] * Z, full_matrices=False)
    return frequencies[::-1].copy(), Z @ right[::-1].T


def _over(body: FlexibleBody, rows: np.ndarray) -> np.ndarray:
    """Return rows of the elastic coordinates, (k, m), over the rigid ones too, which they do not read, (k, r + m)."""
    return np.column_stack([np.zeros((len(rows), body.rigid_count)), rows])


def _weight(body: FlexibleBody) -> np.ndarray:
    """Return the load of unit gravity along x, y, z on all coordinates [kg^½], (3, r + m)."""
    elastic = np.zeros((3, len(body.modal.angular_frequencies)))
    participation = elastic if body.modal.participation is None else body.modal.participation
    return np.column_stack([body.morph.mass * body.twists[:, :3].T, participation])


def _frame(body: FlexibleBody, name: str, modes: InterfaceModes) -> tuple[np.ndarray, np.ndarray]:
    """Return the rigid rows of contact points along their normals, (c, r), and along both tangents, (c, 2, r)."""
    points = body.morph.points[name]
    across = tangents(modes.normals) if modes.tangents is None else modes.tangents
    both = body.rigid_rows(np.repeat(points, 2, axis=0), across.reshape(-1, 3))
    return body.rigid_rows(points, modes.normals), both.reshape(len(points), 2, body.rigid_count)


def _held_points(body: FlexibleBody, name: str, modes: InterfaceModes, T: np.ndarray) -> InterfaceModes:
    if not len(modes.rows):
        return replace(modes, rows=np.zeros((len(modes.rows), T.shape[1])))
    normal, across = _frame(body, name, modes)
    rows = np.column_stack([normal, modes.rows]) @ T
    if modes.tangential_rows is None:
        return replace(modes, rows=rows)
    return replace(modes, rows=rows, tangential_rows=np.concatenate([across, modes.tangential_rows], axis=2) @ T)


def _held_space(body: FlexibleBody, modes: TractionModes, T: np.ndarray) -> TractionModes:
    rows = np.column_stack([body.wrench_rows(modes.resultant), modes.rows]) @ T
    if modes.tangential_rows is None or modes.tangential_resultant is None:
        return replace(modes, rows=rows)
    across = body.wrench_rows(modes.tangential_resultant.reshape(-1, 6)).reshape(len(rows), 2, body.rigid_count)
    return replace(modes, rows=rows, tangential_rows=np.concatenate([across, modes.tangential_rows], axis=2) @ T)


def _held_load(body: FlexibleBody, modes: LoadModes, T: np.ndarray) -> LoadModes:
    if not len(modes.rows):
        return replace(modes, rows=np.zeros((0, T.shape[1])), stress_stiffness=None)
    rows = np.column_stack([body.wrench_rows(modes.resultant), modes.rows]) @ T
    return replace(modes, rows=rows, stress_stiffness=_held_stress(body, modes.stress_stiffness, T))


def _held_stress(body: FlexibleBody, stiffness: np.ndarray | None, T: np.ndarray) -> np.ndarray | None:
    """Return stiffnesses by stress over the coordinates that joints leave, which have no rotations of their own, (k,
    n + 3, n + 3), of those over shapes and rotations, (k, m + 3, m + 3)."""
    if stiffness is None:
        return None
    r, n = body.rigid_count, T.shape[1]
    motions = np.vstack([T[r:], body.twists[:, 3:].T @ T[:r]])
    K = np.zeros((len(stiffness), n + 3, n + 3))
    K[:, :n, :n] = motions.T @ stiffness @ motions
    return K


def _all_rows(body: FlexibleBody) -> np.ndarray:
    """Return all rows of R over all coordinates, (C, r + m); zero at places that the scene does not read."""
    modal, r = body.modal, body.rigid_count
    matrix = np.zeros((modal.row_count, r + len(modal.angular_frequencies)))
    for name, interface in {**modal.interfaces, **modal.tractions, **modal.loads}.items():
        if not len(interface.rows):
            continue
        span, across = slice(*modal.interface_rows[name]), np.empty((0, r))
        if isinstance(interface, InterfaceModes):
            matrix[span, :r], tangential = _frame(body, name, interface)
            across = tangential.reshape(-1, r)
        else:
            matrix[span, :r] = body.wrench_rows(interface.resultant)
            if isinstance(interface, TractionModes) and interface.tangential_resultant is not None:
                across = body.wrench_rows(interface.tangential_resultant.reshape(-1, 6))
        matrix[span, r:] = interface.rows
        if isinstance(interface, InterfaceModes | TractionModes) and interface.tangential_rows is not None:
            there = slice(*modal.tangential_spans[name])
            matrix[there] = np.column_stack([across, interface.tangential_rows.reshape(len(across), -1)])
    return matrix


def _errors(body: FlexibleBody, T: np.ndarray, omega: np.ndarray) -> np.ndarray | None:
    """Return the errors of frequencies by the mesh, (n,): means over the record's coordinates by their energy.

    NaN where too much of it is in coordinates whose error is not known, as static shapes.
    """
    mesh_errors = body.modal.discretisation_errors
    if mesh_errors is None:
        return None
    energies = (body.stiffness[:, None] * T**2 / omega**2)[body.rigid_count :]
    known_energy = energies[~np.isnan(mesh_errors)].sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        weighted_errors = np.nan_to_num(mesh_errors) @ energies / known_energy
    return np.where(known_energy > KNOWN, weighted_errors, np.nan)
