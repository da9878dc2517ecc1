"""Comparison of a run with another one: impacts of all sides, rms of forces, surface velocity, energy before slaps."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from gudgeon.pipeline.report.document import Errors, Table
from gudgeon.pipeline.report.force import Ran, contact_forces, end_of
from gudgeon.pipeline.report.measures.impacts import PER_IMPACT, ForceCourse, contact_values, course, parts, window_of
from gudgeon.pipeline.report.measures.motion import energies_before, lateral_energy, surface_bands
from gudgeon.pipeline.stages.job import Job

VELOCITY, SLAP = "surface_velocity", "slap_energy"
UNITS = {"force_rms": "N", VELOCITY: "m/s", SLAP: "J", **PER_IMPACT}
"""Units by the last part of a name."""


def differences(job: Job, run: Ran, reference: Ran, located: Ran) -> Errors:
    """Return the errors of a run against a reference run, up to the time of the report.

    Values of impacts and rms forces are relative and signed; velocities in third octaves and energies before slaps are
    compared by their Euclidean norms over bands and slaps. An impact that the run lacks has an infinite error in time.

    Args:
        located: The run whose impacts are compared.
    """
    until = end_of(job)
    impacts, (ours, theirs) = _impact_values(job, (run, reference), located)
    if len(impacts) == 1:  # Its impulse is that of all contacts together.
        del theirs[f"{next(iter(impacts))}.impulse"]
    errors = {name: relative(ours[name], value) for name, value in theirs.items()}
    bands, reference_bands = surface_bands(run, until), surface_bands(reference, until)
    for name, (centres, levels) in reference_bands.items():
        if name in bands and len(bands[name][0]) == len(centres):
            errors[f"{name}.{VELOCITY}"] = distance(bands[name][1], levels)
    return errors | _slap_errors(job, ((run, ours), (reference, theirs)), impacts)


def _slap_errors(
    job: Job, runs: Sequence[tuple[Ran, Mapping[str, float]]], impacts: Mapping[str, np.ndarray]
) -> Errors:
    """Return the difference of the lateral energies of driven bodies before their impacts, of a run and a reference."""
    errors = {}
    for body in dict.fromkeys(joint.body for joint in job.scene.cranks().values()):
        of_body = {name: rows for name, rows in impacts.items() if job.scene.contact[name].body == body}
        if any(map(len, of_body.values())) and all(body in run.motion for run, _ in runs):
            energies = []
            for run, values in runs:
                middles = {
                    name: np.array([values[f"{name}.impact{n + 1}.time"] for n in range(len(rows))])
                    for name, rows in of_body.items()
                }
                energies.append(energies_before(run.times, lateral_energy(job, run, body), of_body, middles))
            errors[f"{body}.{SLAP}"] = distance(*energies)
    return errors


def _impact_values(
    job: Job, runs: Sequence[Ran], located: Ran, *intervals: float
) -> tuple[dict[str, np.ndarray], list[dict[str, float]]]:
    """Return the impacts of a run that are compared, by contact, and the values of other runs in them.

    Args:
        intervals: Further sample intervals that the window of forces covers [s].
    """
    window = window_of(job.scene.report.window, *(float(run.times[0]) for run in (*runs, located)), *intervals)
    impacts = {name: parts(history, window) for name, history in _courses(job, located).items()}
    return impacts, [contact_values(_courses(job, run), impacts, window) for run in runs]


def values_of_impacts(job: Job, run: Ran, interval: float) -> dict[str, float]:
    """Return the values of a run that is a reference itself, of its contacts and impacts.

    Args:
        interval: Sample interval of the runs that are compared with it [s].
    """
    return _impact_values(job, (run,), run, interval)[1][0]


def impulses_of_impacts(job: Job, run: Ran, located: Ran) -> np.ndarray:
    """Return the impulse that a run gives in each impact of another one, contact by contact [N s], (b,)."""
    impacts, (values,) = _impact_values(job, (run,), located)
    counts = {name: len(rows) for name, rows in impacts.items()}
    return np.array([values[f"{name}.impact{n + 1}.impulse"] for name, count in counts.items() for n in range(count)])


def _courses(job: Job, run: Ran) -> dict[str, ForceCourse]:
    forces, until = contact_forces(run), end_of(job)
    return {name: course(run.times, forces[name], until) for name in job.scene.contact}


def relative(value: float, reference: float) -> float:
    """Return the relative error of a value, absolute where the reference is zero; infinite where there is no value."""
    if math.isnan(value):
        return 0.0 if math.isnan(reference) else math.inf
    return value / reference - 1 if reference else value


def distance(values: np.ndarray, reference: np.ndarray) -> float:
    """Return the Euclidean norm of a difference over that of the reference, absolute where the reference is zero."""
    difference, size = float(np.linalg.norm(values - reference)), float(np.linalg.norm(reference))
    return difference / size if size > 0 else difference


def velocity_table(job: Job, run: Ran, name: str, reference: Ran) -> Table | None:
    """Return the third octaves of the velocity of sliding surfaces, reference and a run; None without such surfaces."""
    ours, theirs = (surface_bands(r, end_of(job)) for r in (run, reference))
    rows = [
        [contact, f"{centre:,.0f}", f"{expected * 1e3:.3g}", f"{20 * math.log10(level / expected):+.2f}"]
        for contact, (centres, levels) in theirs.items()
        if contact in ours
        for centre, expected, level in zip(centres, levels, ours[contact][1], strict=True)
        if expected > 0 and level > 0
    ]
    if not rows:
        return None
    note = (
        f"Normal velocity of the surface under each contact, rms over its functions and over the time compared; run:"
        f" {name}."
    )
    columns = ["contact", "third octave [Hz]", "reference [mm/s]", "run: difference [dB]"]
    return Table("Velocity of the sliding surface in third octaves", columns, rows, note)
