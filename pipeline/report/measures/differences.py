"""Comparison of a run with another one: impacts of all sides, rms of forces, surface velocity, energy before slaps."""

import math

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
    until, runs = end_of(job), (run, reference)
    window = window_of(job.scene.report.window, *(float(one.times[0]) for one in (*runs, located)))
    impacts = {name: parts(found, window) for name, found in _courses(job, located).items()}
    ours, theirs = (contact_values(_courses(job, one), impacts, window) for one in runs)
    if len(impacts) == 1:  # Its impulse is that of all contacts together.
        del theirs[f"{next(iter(impacts))}.impulse"]
    errors = {name: relative(ours[name], value) for name, value in theirs.items()}
    bands = [surface_bands(one, until) for one in runs]
    for name, (centres, expected) in bands[1].items():
        if name in bands[0] and len(bands[0][name][0]) == len(centres):
            errors[f"{name}.{VELOCITY}"] = distance(bands[0][name][1], expected)
    for body in dict.fromkeys(joint.body for joint in job.scene.cranks().values()):
        own = {name: rows for name, rows in impacts.items() if job.scene.contact[name].body == body}
        if any(map(len, own.values())) and all(body in one.motion for one in runs):
            energies = []
            for one, values in zip(runs, (ours, theirs), strict=True):
                middles = {
                    name: np.array([values[f"{name}.impact{n + 1}.time"] for n in range(len(rows))])
                    for name, rows in own.items()
                }
                energies.append(energies_before(one.times, lateral_energy(job, one, body), own, middles))
            errors[f"{body}.{SLAP}"] = distance(*energies)
    return errors


def values_of_impacts(job: Job, run: Ran, interval: float) -> dict[str, float]:
    """Return the values of a run that is a reference itself, of its contacts and impacts.

    Args:
        interval: Sample interval of the runs that are compared with it [s].
    """
    window, courses = window_of(job.scene.report.window, interval, float(run.times[0])), _courses(job, run)
    return contact_values(courses, {name: parts(found, window) for name, found in courses.items()}, window)


def impulses_of_impacts(job: Job, run: Ran, located: Ran) -> np.ndarray:
    """Return the impulse that a run gives in each impact of another one, contact by contact [N s], (b,)."""
    window = window_of(job.scene.report.window, float(run.times[0]), float(located.times[0]))
    shares = {name: parts(found, window) for name, found in _courses(job, located).items()}
    values = contact_values(_courses(job, run), shares, window)
    numbers = [(name, n + 1) for name, rows in shares.items() for n in range(len(rows))]
    return np.array([values[f"{name}.impact{n}.impulse"] for name, n in numbers])


def _courses(job: Job, run: Ran) -> dict[str, ForceCourse]:
    forces, until = contact_forces(run), end_of(job)
    return {name: course(run.times, forces[name], until) for name in job.scene.contact}


def relative(found: float, reference: float) -> float:
    """Return the relative error of a value, absolute where the reference is zero; infinite where there is no value."""
    if math.isnan(found):
        return 0.0 if math.isnan(reference) else math.inf
    return found / reference - 1 if reference else found


def distance(found: np.ndarray, reference: np.ndarray) -> float:
    """Return the Euclidean norm of a difference over that of the reference, absolute where the reference is zero."""
    apart, size = float(np.linalg.norm(found - reference)), float(np.linalg.norm(reference))
    return apart / size if size > 0 else apart


def velocity_table(job: Job, run: Ran, name: str, reference: Ran) -> Table | None:
    """Return the third octaves of the velocity of sliding surfaces, reference and a run; None without such surfaces."""
    ours, theirs = (surface_bands(one, end_of(job)) for one in (run, reference))
    rows = [
        [contact, f"{centre:,.0f}", f"{expected * 1e3:.3g}", f"{20 * math.log10(found / expected):+.2f}"]
        for contact, (centres, levels) in theirs.items()
        if contact in ours
        for centre, expected, found in zip(centres, levels, ours[contact][1], strict=True)
        if expected > 0 and found > 0
    ]
    if not rows:
        return None
    note = (
        f"Normal velocity of the surface under each contact, rms over its functions and over the time compared; run:"
        f" {name}."
    )
    columns = ["contact", "third octave [Hz]", "reference [mm/s]", "run: difference [dB]"]
    return Table("Velocity of the sliding surface in third octaves", columns, rows, note)
