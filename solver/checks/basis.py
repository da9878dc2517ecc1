"""What the modal basis of a run lacks, estimated from runs with a half and a quarter of each body's modes.

Modes carry the dynamics: static shapes and Ritz vectors that are close to no mode are left out of these runs, see
`nested`. All runs take the same steps and start from the same state. The error of n modes is taken to be `MARGIN`
times the difference of n from n/2, or half of that of n/2 from n/4 if it is larger. An error that decreases as 1/n
gives the same by both; the first alone is too small where the upper half of the modes takes no part in an impact, as
bending modes in an axial one.

- Forces are compared over two windows: as many periods of the highest frequency of the run with fewer coordinates as
  run.window has of the run's own, so that the share of the ringing is equal, and half as long again.
- Contact by a penalty has no residual flexibility: the missing compliance makes it too stiff, and its error is
  irregular in n. `STIFFENED` is the least estimate, over the share of the missing compliance. What n coordinates lack
  is taken to be what the upper half of them adds, as in a series of 1/n^2.
- An impact that is shorter than the shortest kept period sees R, which has no mass, or shapes with a mass of their own,
  in place of waves, or with rigid methods nothing: all runs lack the same. `UNRESOLVED` is the least estimate, over
  their share of the compliance, and `RIGID` that of rigid methods; both for a longer impact over the share of that
  period in its duration. Only modes that the contact's force excites count, see `_cutoff`. Within a window that is
  shorter than that period nothing is known of the force but this share: it is the least estimate by itself. All of
  this is of what changes: these shares are times the largest change of a force that presses at the start.
- Where all runs lack the same waves, as of a plate that strikes with its whole face, no difference of theirs shows it.
  One more run has a part of R as a coordinate with a mass, in the octave of frequency above the highest mode, see
  `weighed`: the error is taken to be `MARGIN` times its difference, too. Where nothing touches, R has what modes lack
  but their mass, which this run shows: differences from fewer modes, which converge fast, count by what they are at
  least reduced by, `SMOOTH`. Where that run ends early, or a table of damping does not reach its frequency, the other
  estimates stand alone.

docs/basis.md has the estimates beside true errors.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from gudgeon.modaldb.records.trajectory import (
    BASIS_REASON,
    BEGINS,
    CHANGING,
    ENDS,
    IMPULSE,
    NO_MODE,
    ONE_COORDINATE,
    Trajectory,
)
from gudgeon.solver.checks.readings import changes, readings
from gudgeon.solver.checks.weighed import weighed
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.integrators.curves import windowed
from gudgeon.solver.methods import METHODS
from gudgeon.solver.ports.rest import at_rest
from gudgeon.solver.result import Result
from gudgeon.solver.system.bases.nested import nested
from gudgeon.solver.system.bases.swaps import swaps_of
from gudgeon.solver.system.system import System

REBOUND = ("rebound_velocity", "rebound_velocity_other")
WINDOWS = (1.0, 1.5)
"""Windows over which forces are compared, over that of the run in periods of the run with fewer coordinates."""
SHARES = (0.5, 0.25)
"""Shares of the elastic coordinates of the further runs."""
MARGIN = 1.3
"""Factor on differences: of bars, beams and solids with 8 to 150 modes, errors are at most twice the estimate."""
SMOOTH = 8.0
"""Least convergence of a reading where nothing touches, by half of the modes: as 1/n³, where R has a mass in a run."""
ROUND_OFF = 1e-9
SAMPLES = 4
"""Least number of samples in the window over which forces are compared."""
MOST_SAMPLES = 5000
"""Samples of bodies that turn in further runs, each of which takes longer than a step of small motion: where the window
of forces is shorter than four of them, they are compared over four."""
STIFFENED = {"basis.force": 0.11, "basis.impulse": 0.11, "basis.rebound": 0.11}
"""Least relative errors over the share of the compliance that a contact by a penalty lacks."""
UNRESOLVED = {"basis.force": 0.2, "basis.impulse": 0.2, "basis.rebound": 0.3}
"""Least relative errors over the share of the compliance that is without mass in an impact shorter than is resolved."""
EXCITED = 1e-3
"""Share of the compliance of a contact that is left to the modes beyond the last one that counts."""
RIGID = 0.06
"""Least relative error of an impact by a rigid method that is shorter than is resolved."""
Run = Callable[[System, float], Trajectory]
"""Integrates a system with the steps of the run, and samples at most so far apart [s]."""


def with_basis_estimates(system: System, trajectory: Trajectory, run: Run) -> Trajectory:
    """Return a finished run with its estimated relative errors due to the modal basis.

    Args:
        system: The one that was run.
        trajectory: Its trajectory.
        run: Integrates it, or another system, again.

    Returns:
        Its `estimates` with `basis.impulse`: the largest error of a contact's impulse, over its largest impulse up to
        any time; `basis.force`: of its largest windowed force, over that force; `basis.rebound`: of a rebound velocity,
        over the largest speed of a body at the start, where the contact has a restitution; and `basis.NAME.KIND` of
        each reading, see `readings`. Where a run with fewer modes cannot start, or fails, or where a body that touches
        has a single coordinate or none that is a mode, they are 1 (without those of a rebound) and `counts` has the
        reason. Unchanged where nothing touches and nothing is read, or no body has elastic coordinates.
    """
    noticed = touches(system, trajectory) or readings(system, trajectory)
    if not noticed or not (system.stiffness > 0).any():
        return trajectory
    try:
        errors = _errors(system, trajectory, run)
    except (SceneError, SolverError) as error:
        return _unknown(system, trajectory, str(error))
    return replace(trajectory, estimates=trajectory.estimates | errors)


def _errors(system: System, trajectory: Trajectory, run: Run) -> dict[str, float]:
    """Return the estimates of a run; none where no coordinate can be left out of bodies that touch.

    Raises:
        SceneError, SolverError: nothing is known, with the reason.
    """
    if reason := _too_few(system, trajectory):
        raise SolverError(reason)
    in_contact = touches(system, trajectory)
    systems = [fewer for fraction in SHARES if (fewer := nested(system, fraction)) is not None]
    if not systems and in_contact:
        return {}
    by_mass = {} if in_contact else _by_mass(system, trajectory, run)
    # Half of the modes are enough where R has had a mass.
    windows, runs = _nested_runs(system, systems[:1] if by_mass else systems, trajectory, run)
    if failed := next((r for r in runs[1:] if not Result[r.result].ok), None):
        raise SolverError(failed.counts.get("reason", Result[failed.result].value))
    smooth = dict.fromkeys(by_mass, SMOOTH)
    by_mass = _by_mass(system, runs[0], run) if in_contact else by_mass
    error_sets = [{name: MARGIN * value for name, value in by_mass.items()}]
    for i, relative_changes in enumerate(
        _changes([system, *systems][: len(runs)], runs, windows, in_contact=in_contact)
    ):
        error_sets.append({name: MARGIN * value / smooth.get(name, 2.0**i) for name, value in relative_changes.items()})
    comparable = error_sets[-1]
    if not comparable:
        raise SolverError(ONE_COORDINATE)
    lower_bounds = _least(system, systems, trajectory)
    return {f"basis.{name}": max(lower_bounds.get(f"basis.{name}", 0.0), *(e.get(name, 0.0) for e in error_sets))
            for name in comparable}  # fmt: skip


def _changes(
    systems: list[System], runs: list[Trajectory], windows: list[np.ndarray], *, in_contact: bool
) -> Iterator[dict[str, float]]:
    """Yield the differences between the runs of each basis and the next smaller one."""
    speed, histories = fastest_body(systems[0]), [readings(s, r) for s, r in zip(systems, runs, strict=True)]
    for i, nested_windows in enumerate(windows):
        relative_changes = changes(histories[i], histories[i + 1])
        if in_contact:
            relative_changes |= differences(runs[0], (runs[i], runs[i + 1]), nested_windows, speed)
        yield relative_changes


def _nested_runs(
    system: System, systems: list[System], trajectory: Trajectory, run: Run
) -> tuple[list[np.ndarray], list[Trajectory]]:
    """Return the windows of each pair of bases [s], (k,), and the runs of all bases, that of the system first."""
    if not touches(system, trajectory):
        interval = float(trajectory.times[0])
        return [np.zeros(len(system.contacts))] * len(systems), [
            trajectory,
            *(run(fewer, interval) for fewer in systems),
        ]
    windows = _windows(system, systems)
    shortest = float(windows[0].min())
    sample_step = shortest / SAMPLES if shortest > 0 else float(trajectory.times[0])
    if system.scene.capabilities.turns:
        sample_step = max(sample_step, min(system.scene.run.duration / MOST_SAMPLES, float(trajectory.times[0])))
        windows = [np.maximum(w, SAMPLES * sample_step) for w in windows]
    reference = trajectory if trajectory.times[0] <= sample_step * (1 + ROUND_OFF) else run(system, sample_step)
    return windows, [reference, *(run(fewer, sample_step) for fewer in systems)]


def touches(system: System, trajectory: Trajectory) -> bool:
    """Return whether one of the contacts of a system had a force; joints with clearance are none."""
    return any(np.any(trajectory.contacts[contact.name].force) for contact in system.contacts)


def _by_mass(system: System, reference: Trajectory, run: Run) -> dict[str, float]:
    """Return the differences of a run from one in which a part of R has a mass; none where there is no such run."""
    in_contact = touches(system, reference)
    try:
        forces = {contact.name: pushes(reference, contact.name) for contact in system.contacts} if in_contact else {}
        weighed_system = weighed(system, forces)
        if weighed_system is None:
            return {}
        # A part of R has no tensors of a floating frame.
        weighed_run = run(weighed_system, float(reference.times[0]))
    except SceneError:
        return {}
    if not Result[weighed_run.result].ok or len(weighed_run.times) != len(reference.times):
        return {}
    run_readings = readings(system, reference)
    by_readings = changes(run_readings, readings(weighed_system, weighed_run))
    if not in_contact:
        return by_readings
    windows = np.minimum(system.windows, system.scene.run.duration / max(WINDOWS))
    return differences(reference, (reference, weighed_run), windows, fastest_body(system)) | by_readings


def pushes(trajectory: Trajectory, contact: str) -> np.ndarray:
    """Return the sum of the forces on a contact's points at frames and peaks [N], (c,)."""
    history = trajectory.contacts[contact]
    assert history.peak_multipliers is not None
    return np.asarray(history.multipliers.sum(axis=0) + history.peak_multipliers.sum(axis=0))


def fastest_body(system: System) -> float:
    """Return the largest speed of a body's centre at the start [m/s]."""
    speeds = [body.centre_motion(system.velocity[body.rigid])[:3] for body in system.bodies.values()]
    return float(np.linalg.norm(speeds, axis=1).max())


def _windows(system: System, systems: list[System]) -> list[np.ndarray]:
    """Return the windows of contacts over which runs with fewer coordinates are compared [s], (k,); 0: no average."""
    resolution = system.resolution
    periods = np.maximum(1.0, system.windows / resolution) if resolution > 0 else np.zeros(len(system.contacts))
    return [np.minimum(periods * f.resolution, system.scene.run.duration / max(WINDOWS)) for f in systems]


def _least(system: System, systems: list[System], trajectory: Trajectory) -> dict[str, float]:
    """Return the least estimates of a run, see the module; zeros where bodies turn or nothing touches."""
    if system.scene.capabilities.turns or not touches(system, trajectory):
        return dict.fromkeys(STIFFENED, 0.0)
    stiff, (massless, hidden, rigid) = _lacking(system, systems[0]), _unresolved(system, trajectory)
    estimates = {name: max(STIFFENED[name] * stiff, UNRESOLVED[name] * massless, RIGID * rigid) for name in STIFFENED}
    return estimates | {"basis.force": max(estimates["basis.force"], hidden)}


def _too_few(system: System, trajectory: Trajectory) -> str:
    """Return why no coordinate of a body that touched can be left out, or nothing: it has one, or none is a mode.

    Where none touched, of the bodies that deform, unless R of one can have a mass.
    """
    if swaps_of(system) is not None:
        return CHANGING
    sides = _touching_sides(system, trajectory)
    modes = [system.bodies[side].modal.are_modes for side in sides]
    if not sides:
        every = [body.modal.are_modes for body in system.bodies.values()]
        return "" if np.concatenate(every).any() else NO_MODE
    if any(len(m) == 1 for m in modes):
        return ONE_COORDINATE
    return NO_MODE if any(len(m) and not m.any() for m in modes) else ""


def _touching_sides(system: System, trajectory: Trajectory) -> list[str]:
    """Return the bodies of contacts that had a force, side by side."""
    touching = [contact for contact in system.contacts if np.any(trajectory.contacts[contact.name].force)]
    return [side.body for c in touching for side in (c, c.other, c.master) if side is not None]


def _unknown(system: System, trajectory: Trajectory, reason: str) -> Trajectory:
    """Return a run with estimates of 1, and the reason."""
    names = [*(("impulse", "force") if touches(system, trajectory) else ()), *readings(system, trajectory)]
    errors = {f"basis.{name}": 1.0 for name in names}
    return replace(
        trajectory, estimates=trajectory.estimates | errors, counts=trajectory.counts | {BASIS_REASON: reason}
    )


def _lacking(system: System, fewer: System) -> float:
    """Return the largest share of the compliance that a contact without R lacks, estimated; 0 where all have it."""
    static = [_flexibility(s) for s in (system, fewer)]
    missing, compliances, largest = static[0] - static[1], system.layer + system.yielding(), 0.0
    for contact in system.contacts:
        method = METHODS[system.scene.contact[contact.name].method]
        if not (method.flexible or method.rigid):
            added = float(missing[contact.rows].sum())
            largest = max(largest, added / (added + float(compliances[contact.rows].sum())))
    return largest


def _unresolved(system: System, trajectory: Trajectory) -> tuple[float, float, float]:
    """Return the largest unresolved share of a contact's main impact: of compliance, of force, and by itself.

    The unresolved share is the period of the cut-off over the impact's duration, at most 1. The first value is times
    the share of the compliance, to the contact's own distribution of force, that is not in modes; the second is times
    the part of that period beyond the window of forces, too; the third is that of rigid methods.
    """
    modes = np.zeros(len(system.stiffness), bool)
    for body in system.bodies.values():
        modes[body.elastic] = body.modal.are_modes
    elastic, massless_largest, hidden, rigid = system.stiffness > 0, 0.0, 0.0, 0.0
    system = at_rest(system)
    for contact, window in zip(system.contacts, system.windows.tolist(), strict=True):
        impacts, forces = trajectory.impacts[contact.name], pushes(trajectory, contact.name)
        if not len(impacts):
            continue
        main = impacts[impacts[:, IMPULSE].argmax()]
        if (duration := float(main[ENDS] - main[BEGINS])) <= 0:
            continue
        changing = _changing(system, trajectory, contact)
        modal = np.zeros(len(modes))
        modal[elastic] = (forces @ system.rows[contact.rows])[elastic] ** 2 / system.stiffness[elastic]
        rows = np.arange(contact.rows.start, contact.rows.stop)
        massless = float(forces @ system.residual.among(rows, rows) @ forces) + float(modal[~modes].sum())
        compliance = massless + float(modal[modes].sum())
        compliance += float(forces**2 @ (system.layer + system.yielding())[contact.rows])
        if compliance <= 0:
            continue
        period = _cutoff(system.stiffness[modes], modal[modes] / compliance)
        unresolved = min(1.0, period / duration) * changing
        if METHODS[system.scene.contact[contact.name].method].rigid:
            rigid = max(rigid, unresolved)
        massless_largest = max(massless_largest, massless / compliance * unresolved)
        hidden = max(hidden, massless / compliance * unresolved * max(0.0, 1 - window / period))
    return massless_largest, hidden, rigid


def _changing(system: System, trajectory: Trajectory, contact: ContactRows) -> float:
    """Return the largest change of a contact's force since the start, over the largest force: waves are of what
    changes. 1 of what does not press at the start."""
    history = trajectory.contacts[contact.name].force
    begun = system.start_forces[contact.rows] @ contact.directions
    size = np.linalg.norm(history, axis=1).max()
    return min(1.0, float(np.linalg.norm(history - begun, axis=1).max() / size)) if begun.any() else 1.0


def _cutoff(stiffness: np.ndarray, shares: np.ndarray) -> float:
    """Return the period of the last mode that counts [s]: those beyond it have `EXCITED` of the compliance; ∞ if none.

    Args:
        stiffness: ω² of each mode [rad²/s²], (k,).
        shares: Of each mode in the compliance of the contact, (k,).
    """
    order = np.argsort(stiffness)[::-1]
    beyond = np.cumsum(shares[order])
    mode = int(np.searchsorted(beyond, EXCITED))
    return 2 * np.pi / float(np.sqrt(stiffness[order[mode]])) if mode < len(order) else np.inf


def _flexibility(system: System) -> np.ndarray:
    """Return the static displacement of each contact row per unit force on it, by elastic coordinates [m/N], (c,)."""
    return system.rows.applied(np.square) @ system.flexibility


def differences(
    trajectory: Trajectory, pair: tuple[Trajectory, Trajectory], windows: np.ndarray, speed: float
) -> dict[str, float]:
    """Return the differences of two runs in `impulse`, `force` and `rebound`, see `with_basis_estimates`.

    Args:
        trajectory: The run whose impulses and forces they are relative to.
        pair: Runs with the same steps and samples.
        windows: Time over which forces of each contact are compared [s], (k,); 0 for that of a sample.
        speed: Of the fastest body at the start [m/s].
    """
    relative_changes = {"impulse": 0.0, "force": 0.0}
    edges = np.concatenate([[0.0], trajectory.times])
    for (name, contact), window in zip(trajectory.contacts.items(), windows.tolist(), strict=True):
        if not np.any(contact.force):
            continue
        impulse, *both = (float(edges[1]) * _summed(r.contacts[name].force) for r in (trajectory, *pair))
        change = np.linalg.norm(both[0][-1] - both[1][-1]) / np.linalg.norm(impulse, axis=1).max()
        relative_changes["impulse"] = max(relative_changes["impulse"], float(change))
        for width in (factor * (window or float(edges[1])) for factor in WINDOWS):
            peak, *peaks = (windowed(edges, h, width)[0] for h in (impulse, *both))
            relative_changes["force"] = max(relative_changes["force"], abs(peaks[0] - peaks[1]) / peak)
        keys = [key for key in (f"{name}.{q}" for q in REBOUND) if key in trajectory.quantities]
        if f"{name}.restitution" in trajectory.quantities and keys and speed > 0:
            change = max(abs(_value(pair[0], key) - _value(pair[1], key)) for key in keys)
            relative_changes["rebound"] = max(relative_changes.get("rebound", 0.0), change / speed)
    return relative_changes


def _summed(force: np.ndarray) -> np.ndarray:
    """Return the sums of forces up to each sample, (s + 1, 3)."""
    return np.concatenate([np.zeros((1, 3)), np.cumsum(force, axis=0)])


def _value(run: Trajectory, key: str) -> float:
    """Return a rebound velocity [m/s]; 0 where nothing touched."""
    return run.quantities[key]["value"] if key in run.quantities else 0.0
