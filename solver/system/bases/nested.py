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


def nested(system: System, share: float) -> System | None:
    """Return a system with the lower part of each body's modes, by frequency; one at least.

    Static shapes and Ritz vectors that are no modes are left out too, unless a body has nothing else: a basis that
    kept them would lack the same modes. Bodies that turn keep them where joints or forces act on an interface, which
    move without R, and of their modes at least as many as the rows of these interfaces need to move apart.

    Returns:
        None where no body has a coordinate to leave out.
    """
    bodies, first, turns = {}, 0, system.scene.capabilities.turns
    for name, body in system.bodies.items():
        modal = truncated(body.modal, share, held=turns and bool(body.modal.loads))
        bodies[name] = replace(body, modal=modal, first=first, basis=None)
        first = bodies[name].elastic.stop
    if first == len(system.velocity):
        return None
    sag = None if turns else _sag(system, share)
    return assembled(system.scene, bodies, system.terms, sag=sag, fields=system.fields, bores=system.bores)


def _sag(system: System, share: float) -> np.ndarray:
    """Return the change of the gaps at the start by gravity on the coordinates that are left out [m], (c,)."""
    without, position = system.position.copy(), system.position
    if system.scene.run.start == "rest":
        for body in system.bodies.values():
            dropped = body.elastic.start + _parted(body.modal, share)[1]
            without[dropped] -= system.driving.gravity[dropped] / system.stiffness[dropped]
    gaps = [system.moved_gaps(one) for one in (position, without)]
    return np.subtract(*gaps, out=np.zeros_like(gaps[0]), where=np.isfinite(gaps[0]))


def _parted(modal: ModalRecord, share: float, *, held: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers of the modes of lower frequency, in order, and those of the other coordinates.

    Args:
        held: Whether coordinates that are no modes are kept, and enough for the rows of loads.
    """
    modes = modal.are_modes
    if not modes.any() and not held:
        modes = ~modes
    order, count = np.lexsort((modal.angular_frequencies, ~modes)), int(modes.sum())
    first, last = int(np.ceil(share * count)), count if held else len(modes)
    if held:
        needed = sum(len(load.rows) for load in modal.loads.values()) - RIGID
        spare = min(count, max(0, len(modes) - needed))
        first = count - int((1 - share) * spare)
    return np.sort(np.concatenate([order[:first], order[last:]])), order[first:last]


def truncated(modal: ModalRecord, share: float, *, held: bool = False) -> ModalRecord:
    """Return a modal record with the lower part of its modes; R answers for the other coordinates.

    Args:
        modal: With the fields that a scene reads.
        share: Of the number of modes; the number is rounded up.
        held: Whether coordinates that are no modes are kept.
    """
    omega = modal.angular_frequencies
    if not len(omega):
        return modal
    kept, dropped = _parted(modal, share, held=held)
    places = {**modal.interfaces, **modal.tractions, **modal.loads}
    flexible = responses(places, modal, dropped)
    residual, gauges = modal.residual_flexibility, _fewer(modal.gauges, kept)
    if residual is not None:
        residual = residual + flexible @ flexible.T
    for name, gauge in modal.gauges.items():
        if gauge.residual.size:  # Where the scene reads it.
            static = gauge.residual + (gauge.rows[:, dropped] / omega[dropped]) @ flexible.T
            gauges[name] = replace(gauges[name], residual=static)
        if gauge.weights is not None and modal.participation is not None:
            sag = gauge.rows[:, dropped] / omega[dropped] ** 2 @ modal.participation[:, dropped].T
            gauges[name] = replace(gauges[name], weights=gauge.weights + sag)
    return replace(restricted(modal, kept), gauges=gauges, residual_flexibility=residual)


def restricted(modal: ModalRecord, kept: np.ndarray) -> ModalRecord:
    """Return a modal record with some of its coordinates alone, by their numbers; its R stays as it is."""
    return replace(
        modal,
        normal_count=len(kept),
        quality={name: value for name, value in modal.quality.items() if name != SHAPE_ERRORS},
        angular_frequencies=modal.angular_frequencies[kept],
        interfaces=_fewer(modal.interfaces, kept),
        tractions=_fewer(modal.tractions, kept),
        loads={name: _fewer_shapes(load, kept) for name, load in _fewer(modal.loads, kept).items()},
        gauges=_fewer(modal.gauges, kept),
        participation=None if modal.participation is None else modal.participation[:, kept],
        inertia_couplings=None if modal.inertia_couplings is None else _fewer_couplings(modal.inertia_couplings, kept),
        shapes=None, residuals=None, algebraic_errors=None, discretisation_errors=None,
        swap=None,
    )  # fmt: skip


def _fewer(places: Mapping[str, Rows], kept: np.ndarray) -> dict[str, Rows]:
    """Return places of a record with some of the columns of their rows."""
    found = {}
    for name, place in places.items():
        fewer = replace(place, rows=place.rows[:, kept])
        if isinstance(fewer, InterfaceModes | TractionModes) and fewer.tangential_rows is not None:
            fewer = replace(fewer, tangential_rows=fewer.tangential_rows[:, :, kept])
        found[name] = fewer
    return found


def _fewer_shapes(load: LoadModes, kept: np.ndarray) -> LoadModes:
    """Return a load whose stress stiffens some of the shapes, and the rotations after them."""
    if (found := load.stress_stiffness) is None:
        return load
    return replace(load, stress_stiffness=_with_rotations(found, kept))


def _with_rotations(stiffness: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Return the last two axes of a stiffness (..., m + 3, m + 3) of some of the shapes and of all rotations."""
    m = stiffness.shape[-1] - 3
    those = np.concatenate([kept, np.arange(m, m + 3)])
    return stiffness[..., those[:, None], those]


def _fewer_couplings(couplings: InertiaCouplings, kept: np.ndarray) -> InertiaCouplings:
    """Return the tensors of a floating frame of some of the shapes."""
    one, both = couplings.position_moments, couplings.shape_moments
    stiffness = couplings.centrifugal_stiffness
    return replace(
        couplings,
        translation=couplings.translation[:, kept], rotation=couplings.rotation[:, kept],
        rotation_gradient=couplings.rotation_gradient[:, kept[:, None], kept],
        position_moments=None if one is None else one[:, :, kept],
        shape_moments=None if both is None else both[:, :, kept[:, None], kept],
        centrifugal_stiffness=None if stiffness is None else _with_rotations(stiffness, kept),
    )  # fmt: skip


def responses(places: Mapping[str, Rows], modal: ModalRecord, columns: np.ndarray) -> np.ndarray:
    """Return B φ/ω of some coordinates over all rows of R, (C, k); zero at places that the scene does not read."""
    rows = np.zeros((modal.row_count, len(columns)))
    for name, place in places.items():
        rows[slice(*modal.interface_rows[name])] = place.rows[:, columns]
        if isinstance(place, InterfaceModes | TractionModes) and place.tangential_rows is not None:
            across = place.tangential_rows[:, :, columns]
            rows[slice(*modal.tangential_spans[name])] = across.reshape(-1, len(columns))
    return rows / modal.angular_frequencies[columns]
