"""The nested system: the same bodies with fewer elastic coordinates, as the pipeline reduces them.

What a coordinate that is left out answers to a slow force, φ φᵀ/ω², becomes part of the residual flexibility, so that
the static response of each body is unchanged:

  R' = R + B φ φᵀ Bᵀ / ω²,   S' = S + G φ φᵀ Bᵀ / ω²

over the rows B of interfaces, traction spaces and loads, and G of gauges. The gaps get what it answers to gravity,

  g' = g + B φ φᵀ f / ω²,

where bodies start deformed; over a traction space, at the place where each point starts.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

import numpy as np

from gudgeon.modaldb.records.modes import (
    SHAPE_ERRORS,
    GaugeModes,
    InertiaCouplings,
    InterfaceModes,
    LoadModes,
    ModalRecord,
    TractionModes,
)
from gudgeon.solver.system.compile import assembled
from gudgeon.solver.system.system import System

Rows = TypeVar("Rows", InterfaceModes, TractionModes, LoadModes, GaugeModes)

RIGID = 6
"""Rigid motions of a body that turns."""


def nested(system: System, fraction: float) -> System | None:
    """Return a system with the lower part of each body's modes, by frequency; one at least.

    Static shapes and Ritz vectors that are no modes are left out too, unless a body has nothing else: a basis that
    kept them would lack the same modes. Bodies that turn keep them where joints or forces act on an interface, which
    move without R, and of their modes at least as many as the rows of these interfaces need to move apart.

    So do bodies without R, whose shapes of loads answer at rest what modes lack, and all where nothing touches, whose
    shapes are those of loads, motions and gravity: `weighed` changes their frequencies.

    Returns:
        None where no body has a coordinate to leave out.
    """
    bodies, size, turns = {}, 0, system.scene.capabilities.turns
    for name, body in system.bodies.items():
        without_R = body.modal.residual_flexibility is None
        shapes = not system.contacts or ((turns or without_R) and bool(body.modal.loads))
        modal = truncated(body.modal, fraction, with_shapes=shapes)
        bodies[name] = replace(body, modal=modal, first=size, basis=None)
        size = bodies[name].elastic.stop
    if size == len(system.velocity):
        return None
    sag = None if turns else _sag(system, fraction)
    return assembled(system.scene, bodies, system.terms, sag=sag, fields=system.fields, bores=system.bores)


def _sag(system: System, fraction: float) -> np.ndarray:
    """Return the change of the gaps at the start by gravity on the coordinates that are left out [m], (c,)."""
    without, position = system.position.copy(), system.position
    if system.scene.run.start == "rest":
        for body in system.bodies.values():
            dropped = body.elastic.start + _parted(body.modal, fraction)[1]
            without[dropped] -= system.driving.gravity[dropped] / system.stiffness[dropped]
    gaps = [system.moved_gaps(p) for p in (position, without)]
    return np.subtract(*gaps, out=np.zeros_like(gaps[0]), where=np.isfinite(gaps[0]))


def _parted(modal: ModalRecord, fraction: float, *, with_shapes: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers of the modes of lower frequency, in order, and those of the other coordinates.

    Args:
        with_shapes: Whether coordinates that are no modes are kept, and enough for the rows of loads.
    """
    modes = modal.are_modes
    if not modes.any() and not with_shapes:
        modes = ~modes
    order, count = np.lexsort((modal.angular_frequencies, ~modes)), int(modes.sum())
    dropped_start, dropped_stop = int(np.ceil(fraction * count)), count if with_shapes else len(modes)
    if with_shapes:
        needed = sum(len(load.rows) for load in modal.loads.values()) - RIGID
        spare = min(count, max(0, len(modes) - needed))
        dropped_start = count - int((1 - fraction) * spare)
    return np.sort(np.concatenate([order[:dropped_start], order[dropped_stop:]])), order[dropped_start:dropped_stop]


def truncated(modal: ModalRecord, fraction: float, *, with_shapes: bool = False) -> ModalRecord:
    """Return a modal record with the lower part of its modes; R answers for the other coordinates.

    Args:
        modal: With the fields that a scene reads.
        fraction: Of the number of modes; the number is rounded up.
        with_shapes: Whether coordinates that are no modes are kept.
    """
    omega = modal.angular_frequencies
    if not len(omega):
        return modal
    retained, dropped = _parted(modal, fraction, with_shapes=with_shapes)
    interfaces = {**modal.interfaces, **modal.tractions, **modal.loads}
    flexible = responses(interfaces, modal, dropped)
    residual, gauges = modal.residual_flexibility, _fewer(modal.gauges, retained)
    if residual is not None:
        residual = residual + flexible @ flexible.T
    for name, gauge in modal.gauges.items():
        if gauge.residual.size:  # Where the scene reads it.
            static = gauge.residual + (gauge.rows[:, dropped] / omega[dropped]) @ flexible.T
            gauges[name] = replace(gauges[name], residual=static)
        if gauge.weights is not None and modal.participation is not None:
            sag = gauge.rows[:, dropped] / omega[dropped] ** 2 @ modal.participation[:, dropped].T
            gauges[name] = replace(gauges[name], weights=gauge.weights + sag)
    return replace(restricted(modal, retained), gauges=gauges, residual_flexibility=residual)


def restricted(modal: ModalRecord, retained: np.ndarray) -> ModalRecord:
    """Return a modal record with some of its coordinates alone, by their numbers; its R stays as it is."""
    couplings = modal.inertia_couplings
    return replace(
        modal,
        normal_count=len(retained),
        quality={name: value for name, value in modal.quality.items() if name != SHAPE_ERRORS},
        angular_frequencies=modal.angular_frequencies[retained],
        interfaces=_fewer(modal.interfaces, retained),
        tractions=_fewer(modal.tractions, retained),
        loads={name: _fewer_shapes(load, retained) for name, load in _fewer(modal.loads, retained).items()},
        gauges=_fewer(modal.gauges, retained),
        participation=None if modal.participation is None else modal.participation[:, retained],
        inertia_couplings=None if couplings is None else _fewer_couplings(couplings, retained),
        shapes=None, residuals=None, algebraic_errors=None, discretisation_errors=None,
        swap=None,
    )  # fmt: skip


def _fewer(interfaces: Mapping[str, Rows], retained: np.ndarray) -> dict[str, Rows]:
    """Return places of a record with some of the columns of their rows."""
    restricted_rows = {}
    for name, interface in interfaces.items():
        fewer = replace(interface, rows=interface.rows[:, retained])
        if isinstance(fewer, InterfaceModes | TractionModes) and fewer.tangential_rows is not None:
            fewer = replace(fewer, tangential_rows=fewer.tangential_rows[:, :, retained])
        restricted_rows[name] = fewer
    return restricted_rows


def _fewer_shapes(load: LoadModes, retained: np.ndarray) -> LoadModes:
    """Return a load whose stress stiffens some of the shapes, and the rotations after them."""
    if (stress_stiffness := load.stress_stiffness) is None:
        return load
    return replace(load, stress_stiffness=_with_rotations(stress_stiffness, retained))


def _with_rotations(stiffness: np.ndarray, retained: np.ndarray) -> np.ndarray:
    """Return the last two axes of a stiffness (..., m + 3, m + 3) of some of the shapes and of all rotations."""
    m = stiffness.shape[-1] - 3
    those = np.concatenate([retained, np.arange(m, m + 3)])
    return stiffness[..., those[:, None], those]


def _fewer_couplings(couplings: InertiaCouplings, retained: np.ndarray) -> InertiaCouplings:
    """Return the tensors of a floating frame of some of the shapes."""
    position_moments, both = couplings.position_moments, couplings.shape_moments
    stiffness = couplings.centrifugal_stiffness
    return replace(
        couplings,
        translation=couplings.translation[:, retained], rotation=couplings.rotation[:, retained],
        rotation_gradient=couplings.rotation_gradient[:, retained[:, None], retained],
        position_moments=None if position_moments is None else position_moments[:, :, retained],
        shape_moments=None if both is None else both[:, :, retained[:, None], retained],
        centrifugal_stiffness=None if stiffness is None else _with_rotations(stiffness, retained),
    )  # fmt: skip


def responses(interfaces: Mapping[str, Rows], modal: ModalRecord, columns: np.ndarray) -> np.ndarray:
    """Return B φ/ω of some coordinates over all rows of R, (C, k); zero at places that the scene does not read."""
    rows = np.zeros((modal.row_count, len(columns)))
    for name, interface in interfaces.items():
        rows[slice(*modal.interface_rows[name])] = interface.rows[:, columns]
        if isinstance(interface, InterfaceModes | TractionModes) and interface.tangential_rows is not None:
            across = interface.tangential_rows[:, :, columns]
            rows[slice(*modal.tangential_spans[name])] = across.reshape(-1, len(columns))
    return rows / modal.angular_frequencies[columns]
