"""Bodies that joints hold on the ground in small motion: the coordinates that their joints leave.

With q the n rigid and elastic coordinates of a body, Λ their squared frequencies, zero of rigid ones, and C the rows of
its held ties, six of each joint,

    q̈ + Λ q = f + Cᵀ λ,   C q = 0.

Z spans the motions with C Z = 0, and ω' and V are the singular values and right vectors of Λ^½ Z, which keep the digits
of low frequencies beside those of static shapes. With q = T q', T = Z V, TᵀT = 1,

    q̈' + c' q̇' + ω'² q' = Tᵀ f

are modes of the held body, and its record gets their rows. The record's modes have the static shapes of the ties, whose
R is zero: that of other rows stays, and what loads or gravity do at rest is exact. Damping acts in each mode as its
stress does, so that joints bear it too:

    λ = (Cᵀ)⁺ (Λ T (q' + c' q̇'/ω'²) − f).

These six values of each joint are a gauge of the body. Where rows imply others they are those of least norm, of rows
that are scaled to one.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gudgeon.modaldb.records.gauges import GaugeModes
from gudgeon.modaldb.records.modes import SHAPE_ERRORS, InterfaceModes, LoadModes, TractionModes
from gudgeon.modaldb.tangents import tangents
from gudgeon.solver.bodies.small_motion import FlexibleBody, Holding, named
from gudgeon.solver.errors import SceneError

HELD = "joint."
"""Beginning of the names of gauges that are forces and moments of joints; those of scenes have no dot."""
IMPLIED = 1e-7
"""Singular value of the scaled rows, over the largest, below which others imply them."""
RIGID = 1e-9
"""Frequency over the largest below which a motion is rigid."""
KNOWN = 0.5
"""Share of a mode's energy whose errors of frequencies must be known for an estimate of its own."""


def held_body(body: FlexibleBody, joints: Mapping[str, str]) -> FlexibleBody:
    """Return a body whose coordinates are those that joints at interfaces leave.

    Args:
        joints: Interface of kind 'tie' of each joint that holds it on the ground.

    Raises:
        SceneError: it has no such interface, does not deform, its bases change, or the joints leave no motion.
    """
    modal, ties = body.modal, list(joints.values())
    loads = [_tie(body, interface, f"joint.{name}") for name, interface in joints.items()]
    if modal.swap is not None:
        raise SceneError(f"body.{body.name}: its bases change, and joint.{min(joints)} holds it; hold it by supports")
    C = np.vstack([np.column_stack([body.wrench_rows(load.resultant), load.rows]) for load in loads])
    scale = _scales(C)
    left, sizes, right = np.linalg.svd(scale[:, None] * C)
    rank = int((sizes > IMPLIED * sizes.max(initial=0.0)).sum())
    omega, T = _modes(np.sqrt(body.stiffness), right[rank:].T)
    if not len(omega):
        names = " and ".join(f"joint.{name}" for name in joints)
        raise SceneError(f"{names}: all motions of body '{body.name}' are held; keep more modes of its component")
    if omega[0] <= RIGID * omega[-1]:
        raise SceneError(f"joint.{min(joints)}: body '{body.name}' still moves as a whole; set integrator 'mechanism'")
    # (Cᵀ)⁺ of the scaled rows.
    inverse = scale[:, None] * ((left[:, :rank] / sizes[:rank]) @ right[:rank])
    gauges = {name: replace(gauge, rows=_over(body, gauge.rows) @ T) for name, gauge in modal.gauges.items()}
    rows, weight = inverse @ (body.stiffness[:, None] * T), _weight(body)
    static = -inverse @ _all_rows(body).T
    for number, name in enumerate(joints):
        own = slice(6 * number, 6 * number + 6)
        gauges[HELD + name] = GaugeModes(rows[own], static[own], "N, N m", weights=-(inverse @ weight.T)[own])
    elastic = np.vstack([load.rows for load in loads])
    top = modal.angular_frequencies[modal.are_modes].max(initial=0.0)
    changed = replace(
        modal,
        angular_frequencies=omega, normal_count=int((omega <= top).sum()),
        quality={name: value for name, value in modal.quality.items() if name != SHAPE_ERRORS},
        interfaces={name: _held_points(body, name, one, T) for name, one in modal.interfaces.items()},
        tractions={name: _held_space(body, one, T) for name, one in modal.tractions.items()},
        loads={
            name: replace(load, rows=np.column_stack([body.wrench_rows(load.resultant), load.rows]) @ T,
                          stress_stiffness=None)
            for name, load in modal.loads.items()
        },
        gauges=gauges, participation=weight @ T, discretisation_errors=_errors(body, T, omega),
        shapes=None, inertia_couplings=None, residuals=None, algebraic_errors=None, static_responses=None,
    )  # fmt: skip
    lack = np.block([[body.residual(one, other) for other in ties] for one in ties])
    holding = Holding(T, tuple(joints), lack, (elastic / modal.angular_frequencies**2) @ elastic.T)
    return replace(body, modal=changed, twists=np.empty((0, 6)), holding=holding)


def _tie(body: FlexibleBody, interface: str, where: str) -> LoadModes:
    """Return the rows of a tie."""
    if not len(body.modal.angular_frequencies):
        raise SceneError(f"{where}: body '{body.name}' does not deform; set run.integrator to 'mechanism'")
    load = named(body.modal.loads, interface, f"{where}.interface: body '{body.name}' has no tie")
    if len(load.rows) != 6:
        raise SceneError(f"{where}.interface: '{interface}' has {len(load.rows)} rows; kind 'tie' is needed")
    return load


def _scales(rows: np.ndarray) -> np.ndarray:
    """Return factors by which rows of each three forces or moments, (6 k, n), are of size one, (6 k,)."""
    sizes = np.sqrt((rows**2).sum(axis=1).reshape(-1, 3).max(axis=1))
    return np.repeat(1 / np.where(sizes > 0, sizes, 1.0), 3)


def _modes(omega: np.ndarray, Z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies [rad/s], ascending, (n,), and modes T, (r + m, n), of motions Z, (r + m, n)."""
    if not Z.shape[1]:
        return np.empty(0), Z
    _, found, right = np.linalg.svd(omega[:, None] * Z, full_matrices=False)
    return found[::-1].copy(), Z @ right[::-1].T


def _over(body: FlexibleBody, rows: np.ndarray) -> np.ndarray:
    """Return rows of the elastic coordinates, (k, m), over the rigid ones too, which they do not read, (k, r + m)."""
    return np.column_stack([np.zeros((len(rows), body.rigid_count)), rows])


def _weight(body: FlexibleBody) -> np.ndarray:
    """Return the load of unit gravity along x, y, z on all coordinates [kg^½], (3, r + m)."""
    elastic = np.zeros((3, len(body.modal.angular_frequencies)))
    given = elastic if body.modal.participation is None else body.modal.participation
    return np.column_stack([body.morph.mass * body.twists[:, :3].T, given])


def _frame(body: FlexibleBody, name: str, one: InterfaceModes) -> tuple[np.ndarray, np.ndarray]:
    """Return the rigid rows of contact points along their normals, (c, r), and along both tangents, (c, 2, r)."""
    points = body.morph.points[name]
    across = tangents(one.normals) if one.tangents is None else one.tangents
    both = body.rigid_rows(np.repeat(points, 2, axis=0), across.reshape(-1, 3))
    return body.rigid_rows(points, one.normals), both.reshape(len(points), 2, body.rigid_count)


def _held_points(body: FlexibleBody, name: str, one: InterfaceModes, T: np.ndarray) -> InterfaceModes:
    if not len(one.rows):
        return replace(one, rows=np.zeros((len(one.rows), T.shape[1])))
    normal, across = _frame(body, name, one)
    rows = np.column_stack([normal, one.rows]) @ T
    if one.tangential_rows is None:
        return replace(one, rows=rows)
    return replace(one, rows=rows, tangential_rows=np.concatenate([across, one.tangential_rows], axis=2) @ T)


def _held_space(body: FlexibleBody, one: TractionModes, T: np.ndarray) -> TractionModes:
    rows = np.column_stack([body.wrench_rows(one.resultant), one.rows]) @ T
    if one.tangential_rows is None or one.tangential_resultant is None:
        return replace(one, rows=rows)
    across = body.wrench_rows(one.tangential_resultant.reshape(-1, 6)).reshape(len(rows), 2, body.rigid_count)
    return replace(one, rows=rows, tangential_rows=np.concatenate([across, one.tangential_rows], axis=2) @ T)


def _all_rows(body: FlexibleBody) -> np.ndarray:
    """Return all rows of R over all coordinates, (C, r + m); zero at places that the scene does not read."""
    modal, r = body.modal, body.rigid_count
    found = np.zeros((modal.row_count, r + len(modal.angular_frequencies)))
    for name, place in {**modal.interfaces, **modal.tractions, **modal.loads}.items():
        if not len(place.rows):
            continue
        here, across = slice(*modal.interface_rows[name]), np.empty((0, r))
        if isinstance(place, InterfaceModes):
            found[here, :r], tangential = _frame(body, name, place)
            across = tangential.reshape(-1, r)
        else:
            found[here, :r] = body.wrench_rows(place.resultant)
            if isinstance(place, TractionModes) and place.tangential_resultant is not None:
                across = body.wrench_rows(place.tangential_resultant.reshape(-1, 6))
        found[here, r:] = place.rows
        if isinstance(place, InterfaceModes | TractionModes) and place.tangential_rows is not None:
            there = slice(*modal.tangential_spans[name])
            found[there] = np.column_stack([across, place.tangential_rows.reshape(len(across), -1)])
    return found


def _errors(body: FlexibleBody, T: np.ndarray, omega: np.ndarray) -> np.ndarray | None:
    """Return the errors of frequencies by the mesh, (n,): means over the record's coordinates by their energy.

    NaN where too much of it is in coordinates whose error is not known, as static shapes.
    """
    given = body.modal.discretisation_errors
    if given is None:
        return None
    share = (body.stiffness[:, None] * T**2 / omega**2)[body.rigid_count :]
    known = share[~np.isnan(given)].sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        found = np.nan_to_num(given) @ share / known
    return np.where(known > KNOWN, found, np.nan)
