"""Damping of bodies that motions, springs and bushings hold: ratios are those of the modes of the body as it is held.

With W the rows of what holds a body, T = R + 1/k their compliance, zero of a motion without R, and Λ the squared
frequencies of its coordinates, the held body has modes φ of Λ + Wᵀ T⁻¹ W, φᵀφ = 1, within Wφ = 0 where T is zero. Its
stress is that of its coordinates, Λφ, and of its residual flexibility, whose displacement is r = −R T⁻¹ W φ. Damping
acts as the stress of each mode: a dashpot along

    d = c(ω)^½/ω² (φᵀ Λ q − φᵀ Wᵀ T⁻¹ r),

so that rigid motions are not damped, and a mode of a body that motions hold has exactly c(ω). Where springs hold it, a
mode is damped by about the share of its strain energy that is in the body (E. E. Ungar, E. M. Kerwin, Loss factors of
viscoelastic systems in terms of energy concepts, J. Acoust. Soc. Am. 34 (1962) 954-957).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import linalg

from gudgeon.modaldb.records.modes import LoadModes, ModalRecord
from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.forces.dashpots import Dashpots
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.system.drives import driven_rows
from gudgeon.solver.system.springs import End, spring_ends

RIGID = 1e-12
"""Compliance of a combination of ports, relative to what it or its coordinates yield, that is none."""
STRAINED = 0.01
"""Share of a mode's strain energy in the body below which the body does not damp it."""
UNCHANGED = 0.01
"""Error of the damping of each mode by the ratios of the free body up to which these are kept."""


@dataclass(frozen=True)
class Holding:
    """What holds a body, a rows."""

    rows: np.ndarray
    """W over its coordinates, (a, r + m)."""
    compliance: np.ndarray
    """T [m/N], (a, a)."""
    residual: np.ndarray
    """R [m/N], (a, a)."""
    mix: np.ndarray
    """Of the rows of the record's residual flexibility, (a, C)."""


def damped_as_held(scene: Scene, bodies: Mapping[str, FlexibleBody]) -> tuple[Scene, dict[str, FlexibleBody]]:
    """Return a scene and its bodies with dashpots in place of the damping of coordinates, where what holds a body
    changes its modes."""
    damped, forces = dict(bodies), dict[str, Any](scene.force)
    if scene.capabilities.turns:
        return scene, damped
    for name, body in bodies.items():
        damping = body.damping
        if damping is None or damping.proportional is not None or not len(body.modal.angular_frequencies):
            continue
        holding = _holding(scene, name, bodies)
        if holding is None or (dashpots := _dashpots(body, holding)) is None:
            continue
        label = f"damping of {name}"
        damped[name] = replace(body, modal=with_rows(body.modal, label, *dashpots), damped_as_held=True)
        forces[label] = Dashpots(name, label, len(dashpots[0]))
    return (scene.model_copy(update={"force": forces}) if len(forces) > len(scene.force) else scene), damped


def yielding_and_firm(rows: np.ndarray, compliance: np.ndarray, stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return L with L Lᵀ the inverse of the compliance on what yields, (a, s), and combinations that do not, (a, f).

    Args:
        rows: W of ports that hold, (a, m).
        compliance: T [m/N], (a, a).
        stiffness: ω² of the coordinates, (m,).
    """
    springs = 1 / np.maximum(compliance.diagonal(), np.finfo(float).tiny)
    highest = float(stiffness.max(initial=0.0))
    if highest == 0:
        sizes = (rows * rows).sum(axis=1) * np.where(compliance.diagonal() > 0, springs, 0.0)
        highest = float(sizes.max(initial=0.0)) or 1.0
    size = 1 / np.sqrt(np.maximum(((rows / (stiffness + highest)) * rows).sum(axis=1), compliance.diagonal()))
    values, Z = linalg.eigh(0.5 * (compliance + compliance.T) * np.outer(size, size))
    yields = values > RIGID
    return size[:, None] * Z[:, yields] / np.sqrt(values[yields]), size[:, None] * Z[:, ~yields]


def left_free(firm: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return motions that firm combinations of rows leave, as orthonormal columns, (m, n)."""
    if not firm.shape[1]:
        return np.eye(rows.shape[1])
    constraints = firm.T @ rows
    return linalg.null_space(constraints / np.linalg.norm(constraints, axis=1)[:, None])


def _holding(scene: Scene, name: str, bodies: Mapping[str, FlexibleBody]) -> Holding | None:
    """Return what holds a body at its interfaces; None without."""
    body, ends = bodies[name], _ends(scene, name, bodies)
    if not ends:
        return None
    loads, points = body.modal.loads, body.modal.interfaces
    elastic = [end.mix @ (loads if i in loads else points)[i].rows for end, _ in ends for i in [str(end.interface)]]
    rows = np.vstack([np.hstack([end.rigid, e]) for (end, _), e in zip(ends, elastic, strict=True)])
    mix = np.zeros((len(rows), body.modal.row_count))
    for (end, _), stop in zip(ends, np.cumsum([len(end.mix) for end, _ in ends]).tolist(), strict=True):
        mix[stop - len(end.mix) : stop, slice(*body.modal.interface_rows[str(end.interface)])] = end.mix
    stored = body.modal.residual_flexibility
    R = np.zeros((len(rows),) * 2) if stored is None else mix @ stored @ mix.T
    T = R + np.diag(np.concatenate([soft for _, soft in ends]))
    acts = np.any(rows, axis=1) | np.any(T, axis=1)
    return Holding(rows[acts], T[np.ix_(acts, acts)], R[np.ix_(acts, acts)], mix[acts]) if acts.any() else None


def _ends(scene: Scene, name: str, bodies: Mapping[str, FlexibleBody]) -> list[tuple[End, np.ndarray]]:
    """Return the motions, springs and bushings at interfaces of a body, with the compliance of each row [m/N]."""
    body, ends = bodies[name], list[tuple[End, np.ndarray]]()
    for motion in (n for n, m in scene.motion.items() if m.body == name and m.interface is not None):
        drive, _ = driven_rows(scene, motion, body)
        end = End(name, body.wrench_rows(drive.resultant), drive.interface, drive.mix)
        ends.append((end, np.zeros(len(drive.mix))))
    for spring in (n for n, f in scene.springs().items() if name in (f.body, f.against)):
        both, _, (stiffness, *_) = spring_ends(scene, spring, scene.springs()[spring], bodies)
        stiff = stiffness > 0
        ends += [
            (End(name, end.rigid[stiff], end.interface, end.mix[stiff]), 1 / stiffness[stiff])
            for end in both
            if end.body == name and end.interface is not None
        ]
    return ends


def _dashpots(body: FlexibleBody, holding: Holding) -> tuple[np.ndarray, np.ndarray] | None:
    """Return dashpots of 1 N s/m as rows over the elastic coordinates, (d, m), and over the rows of R, (d, C); None
    where ratios of the free body are those of the held one."""
    assert body.damping is not None
    W, Lambda = holding.rows, body.stiffness
    L, firm = yielding_and_firm(W, holding.compliance, Lambda)
    N = left_free(firm, W)
    _, omega, right = np.linalg.svd(np.vstack([np.diag(np.sqrt(Lambda)), L.T @ W]) @ N, full_matrices=False)
    phi = N @ right.T
    within = (omega <= np.sqrt(Lambda.max())) & (omega > 0)
    phi, omega = phi[:, within], omega[within]
    pulls = L @ (L.T @ (W @ phi))
    strained = Lambda @ phi**2 + np.einsum("ak,ab,bk->k", pulls, holding.residual, pulls) > STRAINED * omega**2
    phi, omega, pulls = phi[:, strained], omega[strained], pulls[:, strained]
    if not len(omega):
        return None
    rates = body.damping.rates(omega, body.name)
    if (np.abs(body.damping_rates @ phi**2 - rates) <= UNCHANGED * rates).all():
        return None
    scale = (np.sqrt(rates) / omega**2)[:, None]
    return scale * (Lambda[:, None] * phi).T[:, body.rigid_count :], -scale * (pulls.T @ holding.mix)


def with_rows(modal: ModalRecord, label: str, rows: np.ndarray, residual_rows: np.ndarray) -> ModalRecord:
    """Return modes with a load of d rows over the elastic coordinates, (d, m), and over the rows of R, (d, C)."""
    start, added = modal.row_count, len(rows)
    R, gauges = modal.residual_flexibility, dict(modal.gauges)
    extended = np.vstack([np.eye(start), residual_rows])
    for name, gauge in gauges.items():
        if gauge.residual.size:
            gauges[name] = replace(gauge, residual=gauge.residual @ extended.T)
    return replace(
        modal,
        loads={**modal.loads, label: LoadModes(rows, np.zeros((added, 6)), np.zeros(3), "N s^0.5 m^-0.5")},
        interface_rows={**modal.interface_rows, label: [start, start + added]},
        residual_flexibility=None if R is None else extended @ R @ extended.T,
        gauges=gauges,
    )
