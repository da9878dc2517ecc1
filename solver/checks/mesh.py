"""What the mesh of a run's bodies lacks, estimated from a run with the frequencies of the continuum.

A mesh is too stiff: each of its frequencies is too high by an error that the modes' record estimates from recovered
stress. A run whose modes have the lower frequencies, with the same steps, differs by what these errors leave in the
result: phases that drift over an impact, waves that return too early. The static compliance to loads has an estimate of
its own in the record: what of it the frequencies do not explain is in R, whose rows are larger in that run. `MARGIN`
covers what is in neither, the shapes of the modes and R under contacts. Where nothing touches, modes that follow what
drives them far below their frequencies bring their static share alone, and compliances have the error of that: that of
their frequency counts by the square of how fast they move over how fast they would vibrate, see `_vibrating`. What
the points of a contact patch lack is an error of the force by itself, see `contact_points`.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gudgeon.modaldb.records.modes import INERTIA_ERROR, LOAD_ERRORS, VOLUME_ERROR, ModalRecord
from gudgeon.modaldb.records.trajectory import COARSE_MESHES, PATCH_POINTS, Trajectory
from gudgeon.solver.checks.basis import Run, differences, fastest_body, touches
from gudgeon.solver.checks.contact_points import patch_errors
from gudgeon.solver.checks.readings import TURNING, changes, readings
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.result import Result
from gudgeon.solver.system.bases.swaps import swaps_of
from gudgeon.solver.system.compile import assembled
from gudgeon.solver.system.system import System

MARGIN = 1.5
"""Factor on differences."""
COARSE = 0.05
"""Error of a force by the points of a patch from which they are counted: a radius of five spacings."""
SHARE = 0.5
"""Share of the largest error by one component's mesh from which on that of another one counts."""
SOFTER = 3.0
"""Largest increase of a row of R, over it: estimates above it are of rows that have hardly a share of their own."""
LARGEST = 0.5
"""Largest relative error of a frequency that is taken off: estimates above it are of modes that are none."""


def with_mesh_estimates(system: System, trajectory: Trajectory, run: Run) -> Trajectory:
    """Return a finished run with its estimated relative errors due to the bodies' meshes.

    Args:
        system: The one that was run.
        trajectory: Its trajectory.
        run: Integrates another system.

    Returns:
        Its `estimates` with `mesh.impulse`, `mesh.force` and `mesh.rebound`, and `mesh.NAME.KIND` of each reading,
        relative to what those of the basis are. Where they are above run.tolerance and several components have such
        errors, `counts` names those that matter. Impulse, force and readings have the error of the mass of a coarse
        round mesh, too. Where the points of a patch resolve it poorly, `mesh.force` is at least their error, and
        `counts` has their number. Unchanged where nothing touches and nothing is read, or else no record has estimates
        of its frequencies or of its loads' compliance, or the other run is impossible.
    """
    return _with_mass(system, _with_patches(system, _with_frequencies(system, trajectory, run)))


def _with_mass(system: System, trajectory: Trajectory) -> Trajectory:
    """Return a run with the errors by the volumes of its bodies' meshes: an impulse has that of a mass, as has a motion
    under given forces, the force of an impact that of its root; rotations and moments that of the inertia, as has the
    impulse of a body that turns."""
    qualities = [body.modal.quality for body in system.bodies.values()]
    mass = max(abs(float(quality.get(VOLUME_ERROR, 0.0))) for quality in qualities)
    inertia = max(mass, *(abs(float(quality.get(INERTIA_ERROR, 0.0))) for quality in qualities))
    if not inertia > 0:
        return trajectory
    turning = {name for name in readings(system, trajectory) if name.rpartition(".")[2] in (*TURNING, "moment_peak")}
    by_mass = {f"mesh.{name}": inertia if name in turning else mass for name in readings(system, trajectory)}
    if touches(system, trajectory):
        largest = inertia if turning else mass
        by_mass |= {"mesh.impulse": largest, "mesh.force": largest / 2}
    estimates = {name: trajectory.estimates.get(name, 0.0) + error for name, error in by_mass.items()}
    return replace(trajectory, estimates=trajectory.estimates | estimates)


def _with_patches(system: System, trajectory: Trajectory) -> Trajectory:
    """Return a run with the error of the force by the points of patches."""
    coarse = {name: e for name, e in patch_errors(system, trajectory).items() if e[1] > COARSE}
    if not coarse:
        return trajectory
    force = max(trajectory.estimates.get("mesh.force", 0.0), *(error for _, error in coarse.values()))
    counted = {PATCH_POINTS: {name: count for name, (count, _) in coarse.items()}}
    return replace(
        trajectory, estimates=trajectory.estimates | {"mesh.force": force}, counts=trajectory.counts | counted
    )


def _with_frequencies(system: System, trajectory: Trajectory, run: Run) -> Trajectory:
    """Return a run with its errors due to the frequencies of the bodies' meshes."""
    scene, corrected = system.scene, _all_corrected(system, _vibrating(system, trajectory))
    components = list(dict.fromkeys(scene.component_of(name) for name, m in corrected.items() if m is not None))
    if (
        swaps_of(system) is not None
        or not components
        or not (touches(system, trajectory) or readings(system, trajectory))
    ):
        return trajectory

    def errors(names: list[str]) -> dict[str, float]:
        modes = {body: modal for body, modal in corrected.items() if scene.component_of(body) in names}
        return _errors(system, trajectory, run, {body: modal for body, modal in modes.items() if modal is not None})

    total, counts = errors(components), trajectory.counts
    if len(components) > 1 and max(total.values(), default=0.0) > scene.run.tolerance:
        each = {name: max(errors([name]).values(), default=0.0) for name in components}
        coarse = [name for name, e in each.items() if e >= SHARE * max(each.values())]
        counts = counts | {COARSE_MESHES: coarse}
    return replace(trajectory, estimates=trajectory.estimates | total, counts=counts)


def _errors(system: System, trajectory: Trajectory, run: Run, modes: Mapping[str, ModalRecord]) -> dict[str, float]:
    """Return the errors by the meshes of the bodies with other modes; none where their run is impossible."""
    try:
        continuum = _continuum(system, modes)
        against = run(continuum, float(trajectory.times[0]))
    except (SceneError, SolverError):
        return {}
    if not Result[against.result].ok:
        return {}
    run_readings = readings(system, trajectory)
    relative_changes = changes(run_readings, readings(continuum, against))
    if touches(system, trajectory):
        relative_changes |= differences(trajectory, (trajectory, against), system.windows, fastest_body(system))
    return {f"mesh.{name}": MARGIN * value for name, value in relative_changes.items()}


def continuum(system: System) -> System | None:
    """Return a system with the estimated frequencies of the continuum of all bodies; None if there are no estimates."""
    corrected = _all_corrected(system)
    modes = {name: modal for name, modal in corrected.items() if modal is not None}
    return _continuum(system, modes) if modes else None


def _continuum(system: System, modes: Mapping[str, ModalRecord]) -> System:
    """Return a system with other modes of some bodies, those with the estimated frequencies of the continuum."""
    bodies = {name: replace(body, modal=modes.get(name, body.modal)) for name, body in system.bodies.items()}
    return assembled(system.scene, bodies, system.terms, fields=system.fields, bores=system.bores)


def _vibrating(system: System, trajectory: Trajectory) -> dict[str, np.ndarray]:
    """Return by which factors the errors of each body's frequencies count, (m,): (v̂/ω q̂)² of the largest rate and half
    of the travel of each coordinate, at most 1; none where bodies touch or turn, whose modes all may vibrate."""
    if touches(system, trajectory) or system.scene.capabilities.turns or not len(trajectory.frames):
        return {}
    travel = 0.5 * np.ptp(trajectory.frames, axis=0)
    rates, factors = np.abs(trajectory.velocities).max(axis=0), {}
    for name, body in system.bodies.items():
        omega, start = body.modal.angular_frequencies, trajectory.coordinate_offsets[name] + body.rigid_count
        span = slice(start, start + len(omega))
        vibration = omega * travel[span]
        relative_rate = np.divide(rates[span], vibration, out=np.ones(len(omega)), where=vibration > 0)
        factors[name] = np.minimum(relative_rate, 1.0) ** 2
    return factors


def _all_corrected(system: System, factors: Mapping[str, np.ndarray] | None = None) -> dict[str, ModalRecord | None]:
    """Return the modal record of each body as `_corrected` does, with factors of errors by body. Static shapes that
    hold a body at its drives or joints keep their frequencies: with them the modes of the free body do not vibrate."""
    holds = bool(system.driving.drives) or bool(system.scene.hinges())
    weights = factors or {}
    return {name: _corrected(b.modal, weights.get(name, 1.0), shapes=not holds) for name, b in system.bodies.items()}


def _corrected(modal: ModalRecord, weights: np.ndarray | float, *, shapes: bool) -> ModalRecord | None:
    """Return a modal record with the estimated frequencies of the continuum, and its compliance to loads; None if there
    is no estimate.

    Args:
        weights: Factors of the errors of frequencies, (m,).
        shapes: Whether static shapes have errors, too.
    """
    errors = np.zeros(len(modal.angular_frequencies))
    if modal.discretisation_errors is not None:
        errors = modal.discretisation_errors
        errors = _of_all_coordinates(modal.angular_frequencies, errors) if shapes else np.nan_to_num(errors, nan=0.0)
        errors = weights * np.clip(errors, 0.0, LARGEST)
    factors = _factors(modal, errors)
    if not errors.any() and (factors == 1).all():
        return None
    R = modal.residual_flexibility
    return replace(
        modal, angular_frequencies=modal.angular_frequencies * (1 - errors),
        residual_flexibility=None if R is None else R * np.outer(factors, factors),
    )  # fmt: skip


def _of_all_coordinates(omega: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Return the relative errors of all frequencies, (m,): of static shapes, which have none of their own (nan), those
    of modes of the same frequency, beyond the highest mode in proportion to ω²; zeros where none are known.

    Args:
        omega: [rad/s], (m,)
    """
    estimated = np.isfinite(errors) & (omega > 0)
    if not estimated.any():
        return np.zeros(len(errors))
    order = np.argsort(omega[estimated], kind="stable")
    of_modes, omega_modes = np.maximum(errors[estimated][order], 0.0), omega[estimated][order]
    filled = np.interp(omega, omega_modes, of_modes) * np.maximum(1.0, omega / omega_modes[-1]) ** 2
    return np.where(np.isfinite(errors), errors, filled)


def _factors(modal: ModalRecord, errors: np.ndarray) -> np.ndarray:
    """Return by which factors the rows of R are larger in the continuum, (C,): those of loads, by what of the error of
    their static compliance is not in the frequencies; smaller where these have more than that.

    Args:
        errors: Relative ones of the frequencies, (m,).
    """
    factors, R = np.ones(modal.row_count), modal.residual_flexibility
    for name, relative in modal.quality.get(LOAD_ERRORS, {}).items():
        load = modal.loads.get(name)
        if R is None or load is None or len(load.rows) != len(relative):
            continue
        span = slice(*modal.interface_rows[name])
        each, residual = (load.rows / modal.angular_frequencies) ** 2, R.diagonal()[span]
        missing = np.array(relative) * (residual + each.sum(axis=1)) - each @ ((1 - errors) ** -2 - 1)
        larger = np.divide(missing, residual, out=np.zeros_like(missing), where=residual > 0)
        factors[span] = np.sqrt(1 + np.clip(larger, -1.0, SOFTER))
    return factors
