"""The weighed system: the same bodies, where a part of what the residual flexibility R answers has a mass.

R answers at once; the modes that were left out, whose compliance it holds, answer at their frequencies, which begin at
that of the highest mode. A coordinate in the octave above it shows by how much that matters. With F the contact forces
on the rows of a body's R,

  y = R F,   κ = Fᵀ R F,   φ = ω √(θ/κ) y,   R' = R − θ y yᵀ / κ,

the coordinate φ of frequency ω has the share θ of the compliance κ, and the static response of the body is unchanged. ω
is `ABOVE` times that of its highest mode, and θ κ what the modes of the octave below that one have, whose next are
taken to have no more. A load, joint, drive or spring has such a coordinate for each of its forces. Where modes have
hardly a share in one, as bending modes in an axial force, they tell nothing of the next: then θ is the share that R has
in its compliance. A force that is slow against ω finds the same as before, one that jumps does not.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from gudgeon.modaldb.records.gauges import GaugeModes
from gudgeon.modaldb.records.modes import MODE, SHAPE_ERRORS, InterfaceModes, ModalRecord, TractionModes
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
    """Return a system where each body's R to the forces on it has a mass in part; None where it has none to speak of.

    Args:
        forces: Of each contact's points [N], (c,); of contacts that press.

    Raises:
        SceneError: the damping of a body is not given at the frequency of a further coordinate.
    """
    bodies, size, changed = {}, 0, False
    for name, body in system.bodies.items():
        modal, top = _nearer(system, body.modal), body.modal.angular_frequencies[body.modal.are_modes].max(initial=0.0)
        if top > 0:
            modal = _with_mass(modal, (_on_rows(system, name, forces), np.zeros(3)), top, _octave)
            for port in _ports(system, name):
                modal = _with_mass(modal, port, top, _unseen)
        changed = changed or modal is not body.modal
        bodies[name] = replace(body, modal=modal, first=size, basis=None)
        size = bodies[name].elastic.stop
    if not changed:
        return None
    return assembled(system.scene, bodies, system.terms, fields=system.fields, bores=system.bores)


def _nearer(system: System, modal: ModalRecord) -> ModalRecord:
    """Return a record whose static shapes that nested systems keep have the frequencies that one inverse iteration
    gives them, and their static response: how far they are from modes."""
    errors = modal.quality.get(SHAPE_ERRORS)
    keeps_shapes = not system.contacts or (modal.residual_flexibility is None and bool(modal.loads))
    if not keeps_shapes or not errors or max(errors) <= MODE:
        return modal
    factors = np.ones(len(modal.angular_frequencies))
    factors[len(factors) - len(errors) :] -= errors
    return replace(
        modal, angular_frequencies=modal.angular_frequencies * factors,
        interfaces=_scaled(modal.interfaces, factors), tractions=_scaled(modal.tractions, factors),
        loads={name: replace(load, stress_stiffness=None) for name, load in _scaled(modal.loads, factors).items()},
        gauges={name: replace(gauge, rows=gauge.rows * factors) for name, gauge in modal.gauges.items()},
        participation=None if modal.participation is None else modal.participation * factors,
    )  # fmt: skip


def _scaled(interfaces: Mapping[str, Rows], factors: np.ndarray) -> dict[str, Rows]:
    """Return places of a record with factors on the columns of their rows, (m,)."""
    scaled = {name: replace(interface, rows=interface.rows * factors) for name, interface in interfaces.items()}
    for name, interface in scaled.items():
        if isinstance(interface, InterfaceModes | TractionModes) and interface.tangential_rows is not None:
            scaled[name] = replace(interface, tangential_rows=interface.tangential_rows * factors)
    return scaled


def _on_rows(system: System, body: str, forces: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the contact forces on the rows of a body's R [N], (C,); without those on traction spaces."""
    modal = system.bodies[body].modal
    row_forces = np.zeros(modal.row_count)
    for contact in system.contacts if forces else ():
        for owner, interface, weights, _, _ in contact.sides:
            if owner == body and interface in modal.interface_rows:
                row_forces[slice(*modal.interface_rows[interface])] += weights.T @ forces[contact.name]
    return row_forces


def _ports(system: System, body: str) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield the unit forces of loads, joints, drives and springs on the rows of a body's R, (C,), and their sums [N],
    (3,)."""
    modal, driving = system.bodies[body].modal, system.driving
    ports = [(owner, interface, mix) for owner, interface, mix, _ in driving.places()]
    ports += [(end.body, end.interface, end.mix) for ends in system.springs.ends for end in ends]
    for owner, interface, mix in ports:
        if owner != body or interface is None or interface in modal.tractions:
            continue
        load = modal.loads.get(interface)
        for weights in mix:
            row_forces = np.zeros(modal.row_count)
            row_forces[slice(*modal.interface_rows[interface])] = weights
            yield row_forces, np.zeros(3) if load is None else weights @ load.resultant[:, :3]


def _octave(residual: float, octave: float, modal: float) -> float:
    """Return the compliance that gets a mass of a contact's: as the modes of the octave below have it."""
    return octave


def _unseen(residual: float, octave: float, modal: float) -> float:
    """Return the compliance that gets a mass of a load's: the same, or the share of R that modes have seen none of.

    A contact's force is that of its own gaps, with R local; modes that have no share in a load tell nothing of those
    that have one and are left out, which may follow at once.
    """
    return max(octave, residual * residual / (residual + modal))


def _with_mass(
    modal: ModalRecord,
    port: tuple[np.ndarray, np.ndarray],
    top: float,
    inertial: Callable[[float, float, float], float],
) -> ModalRecord:
    """Return a record with one more coordinate, with the mass of a part of R; the same where R answers too little.

    All modes of a held body take part in a unit translation by what adds up to its displacement, Σ φ_k p_k = 1: the
    coordinate has what the others lack of that under its forces.

    Args:
        port: Forces on the rows of R, (C,), and their sum, zero where it is not known, (3,).
        top: Frequency of the highest mode [rad/s].
        inertial: Compliance with a mass, of the residual one, that of the octave below `top`, and that of all modes.
    """
    forces, force_sum = port
    R, omega, modes = modal.residual_flexibility, modal.angular_frequencies, modal.are_modes
    if R is None or not forces.any():
        return modal
    y = R @ forces
    compliance = float(forces @ y)
    if not compliance > 0:
        return modal
    each = (forces @ (_all_rows(modal) / omega)) ** 2
    octave = float(each[modes & (omega > 0.5 * top) & (omega <= top)].sum())
    inertial_compliance = min(MOST * compliance, inertial(compliance, octave, float(each.sum())))
    if inertial_compliance <= LEAST * (compliance + float(each.sum())):
        return modal
    amount = np.sqrt(inertial_compliance) / compliance
    shape = y * amount
    column = ABOVE * top * shape
    participation = modal.participation
    if participation is not None:
        lacking = force_sum - participation @ (forces @ _all_rows(modal)) if force_sum.any() else force_sum
        participation = np.column_stack([participation, lacking / float(column @ forces)])
    return replace(
        modal,
        quality={name: value for name, value in modal.quality.items() if name != SHAPE_ERRORS},
        angular_frequencies=np.append(omega, ABOVE * top),
        interfaces=_more(modal, modal.interfaces, column),
        tractions=_more(modal, modal.tractions, column),
        loads=_more(modal, modal.loads, column),
        gauges={name: _read(g, _reading(g, forces) * amount, shape, ABOVE * top) for name, g in modal.gauges.items()},
        residual_flexibility=R - np.outer(shape, shape),
        participation=participation,
        shapes=None, inertia_couplings=None, residuals=None, algebraic_errors=None, discretisation_errors=None,
    )  # fmt: skip


def _read(gauge: GaugeModes, reading: np.ndarray, shape: np.ndarray, omega: float) -> GaugeModes:
    """Return a gauge with the column of a further coordinate, and its static reading unchanged.

    Args:
        reading: Of the coordinate's shape, S F √θκ/κ, (g,).
        shape: y √θκ/κ over all rows of R, (C,).
        omega: Its frequency [rad/s].
    """
    rows = np.column_stack([gauge.rows, omega * reading])
    return replace(gauge, rows=rows, residual=gauge.residual - np.outer(reading, shape) if gauge.residual.size else
                   gauge.residual)  # fmt: skip


def _all_rows(modal: ModalRecord) -> np.ndarray:
    """Return B φ of all coordinates over all rows of R, (C, m)."""
    interfaces, omega = {**modal.interfaces, **modal.tractions, **modal.loads}, modal.angular_frequencies
    return responses(interfaces, modal, np.arange(len(omega))) * omega


def _reading(gauge: GaugeModes, forces: np.ndarray) -> np.ndarray:
    """Return what a gauge shows of forces on the rows of R at rest beside its coordinates, (g,); 0 where not read."""
    return gauge.residual @ forces if gauge.residual.size else np.zeros(len(gauge.rows))


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
