"""The weighed system: the same bodies, where a part of what the residual flexibility R answers has a mass.

R answers at once; the modes that were left out, whose compliance it holds, answer at their frequencies, which begin at
that of the highest mode. A coordinate in the octave above it shows by how much that matters. With F the contact forces
on the rows of a body's R,

  y = R F,   κ = Fᵀ R F,   φ = ω √(θ/κ) y,   R' = R − θ y yᵀ / κ,

the coordinate φ of frequency ω has the share θ of the compliance κ, and the static response of the body is unchanged. ω
is `ABOVE` times that of its highest mode, and θ κ what the modes of the octave below that one have, whose next are
taken to have no more.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gudgeon.modaldb.records.modes import SHAPE_ERRORS, InterfaceModes, ModalRecord, TractionModes
from gudgeon.solver.system.bases.nested import Rows, responses
from gudgeon.solver.system.compile import assembled
from gudgeon.solver.system.system import System

ABOVE = 2**0.5
"""Frequency of the coordinate over that of the highest mode: the middle of the octave above it."""
MOST = 0.9
"""Largest share of R's compliance that gets a mass: R' answers to every force."""
LEAST = 1e-3
"""Share of the contact's compliance below which a body is left as it is."""


def weighed(system: System, forces: Mapping[str, np.ndarray]) -> System | None:
    """Return a system where each body's R to contact forces has a mass in part; None where it has none to speak of.

    Args:
        forces: Of each contact's points [N], (c,).

    Raises:
        SceneError: the damping of a body is not given at the frequency of its further coordinate.
    """
    bodies, size, changed = {}, 0, False
    for name, body in system.bodies.items():
        modal = _with_mass(body.modal, _on_rows(system, name, forces))
        changed = changed or modal is not body.modal
        bodies[name] = replace(body, modal=modal, first=size, basis=None)
        size = bodies[name].elastic.stop
    return assembled(system.scene, bodies, system.terms, fields=system.fields) if changed else None


def _on_rows(system: System, body: str, forces: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the contact forces on the rows of a body's R [N], (C,); without those on traction spaces."""
    modal = system.bodies[body].modal
    row_forces = np.zeros(modal.row_count)
    for contact in system.contacts:
        for owner, interface, weights, _, _ in contact.sides:
            if owner == body and interface in modal.interface_rows:
                row_forces[slice(*modal.interface_rows[interface])] += weights.T @ forces[contact.name]
    return row_forces


def _with_mass(modal: ModalRecord, forces: np.ndarray) -> ModalRecord:
    """Return a record with one more coordinate, with the mass of a part of R; the same where R answers too little."""
    R, omega, modes = modal.residual_flexibility, modal.angular_frequencies, modal.are_modes
    if R is None or not modes.any() or not forces.any():
        return modal
    y = R @ forces
    compliance, top = float(forces @ y), float(omega[modes].max())
    interfaces = {**modal.interfaces, **modal.tractions, **modal.loads}
    each = (forces @ responses(interfaces, modal, np.arange(len(omega)))) ** 2
    octave = float(each[modes & (omega > 0.5 * top)].sum())
    inertial_compliance = min(MOST * compliance, octave)
    if inertial_compliance <= LEAST * (compliance + float(each.sum())):
        return modal
    shape = y * np.sqrt(inertial_compliance) / compliance
    column = ABOVE * top * shape
    return replace(
        modal,
        quality={name: value for name, value in modal.quality.items() if name != SHAPE_ERRORS},
        angular_frequencies=np.append(omega, ABOVE * top),
        interfaces=_more(modal, modal.interfaces, column),
        tractions=_more(modal, modal.tractions, column),
        loads=_more(modal, modal.loads, column),
        gauges={name: replace(g, rows=np.pad(g.rows, ((0, 0), (0, 1)))) for name, g in modal.gauges.items()},
        residual_flexibility=R - np.outer(shape, shape),
        participation=None if modal.participation is None else np.pad(modal.participation, ((0, 0), (0, 1))),
        shapes=None, inertia_couplings=None, residuals=None, algebraic_errors=None, discretisation_errors=None,
    )  # fmt: skip


def _more(modal: ModalRecord, interfaces: Mapping[str, Rows], column: np.ndarray) -> dict[str, Rows]:
    """Return places of a record with the column of one more coordinate, given over all rows of R, (C,)."""
    extended = {}
    for name, interface in interfaces.items():
        rows = np.column_stack([interface.rows, column[slice(*modal.interface_rows[name])]])
        extended[name] = replace(interface, rows=rows)
        if isinstance(interface, InterfaceModes | TractionModes) and interface.tangential_rows is not None:
            across = column[slice(*modal.tangential_spans[name])].reshape(-1, 2, 1)
            extended[name] = replace(
                extended[name], tangential_rows=np.concatenate([interface.tangential_rows, across], axis=2)
            )
    return extended
