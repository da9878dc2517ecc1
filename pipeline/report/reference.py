"""What runs are compared with, and how far they are from it: quantities, force within the bandwidth, slaps."""

import json
import math
from dataclasses import dataclass

import numpy as np

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.report.document import Errors
from gudgeon.pipeline.report.force import ForceReference, history_reference, pulse_reference
from gudgeon.pipeline.report.slap.cycle import cycle_errors
from gudgeon.pipeline.scenes.reading import find_file
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.summary import reference_values

Ran = Trajectory | NodalRecord
DRIFT = "energy drift"
BEYOND = "force, whole run"
"""Compared beyond the time up to which the scene says that runs can be; left out where that is all there is."""
HISTORIES = ("force", "liner displacement", BEYOND)
"""Quantities whose error is a relative L2 norm."""
USUAL = (
    "impulse", "start", "duration", "first_duration", "first_impulse", "restitution", "largest_force", "force_peak",
    "pressure_peak", "deflection_peak", "deflection_end",
)  # fmt: skip
"""Quantities of a run that are compared where the scene names none."""


@dataclass(frozen=True)
class Reference:
    """Values that stand for the truth, or another run."""

    kind: str
    """`analytic`, `published`, `nodal` or `finest`."""
    source: str
    expected: dict[str, float]
    force: ForceReference | None
    slaps: Ran | None
    """The run whose slaps are the reference, of scenes with a slider-crank."""


def values_of(run: Ran) -> dict[str, float]:
    """Return the quantities of a run by name."""
    return {name: float(entry["value"]) for name, entry in run.quantities.items()}


def external_reference(job: Job, nodal: list[NodalRecord]) -> Reference | None:
    """Return the reference that a scene names: a file, the finest full-FE run, or both for different quantities.

    Raises:
        InputError: the file is missing or lacks a name.
    """
    report, finest = job.scene.report, nodal[-1] if nodal else None
    expected = reference_values(report, job.folder)
    pulse = pulse_reference(job)
    if report.reference is not None:
        path = find_file(report.reference, job.folder, f"{job.path}: report.reference")
        about = json.loads(path.read_text(encoding="utf-8"))
        kind = "analytic" if "derivation" in about else "published"
        return Reference(kind, f"{about.get('title', path.stem)} ({path.name})", expected, pulse, None)
    if finest is None:
        return None
    source = f"full FE at {finest.step * 1e6:g} µs"
    if job.scene.joint:
        return Reference("nodal", source, {}, None, finest)
    return Reference("nodal", source, {}, history_reference(job, source, *histories(job, finest)), None)


def reference_run(job: Job, run: Ran, like: Reference | None, name: str) -> Reference:
    """Return a run as the reference of others, for the same quantities as another reference.

    Args:
        like: Whose quantities; None takes the usual ones.
        name: Of the run.
    """
    found = values_of(run)
    if like is None:
        wanted = job.scene.report.interest or [n for n in found if n.rsplit(".", 1)[-1] in USUAL]
        wants_force, wants_slaps = "force" in wanted, bool(job.scene.joint)
    else:
        wanted, wants_force, wants_slaps = like.expected, like.force is not None, like.slaps is not None
    expected = {n: found[n] for n in wanted if n in found}
    force = history_reference(job, name, *histories(job, run)) if wants_force else None
    return Reference("finest", name, expected, force, run if wants_slaps else None)


def errors_against(job: Job, run: Ran, reference: Reference) -> Errors:
    """Return how far a run is from a reference; a quantity that it lacks is taken for zero.

    Signed and relative, absolute where the reference is zero; histories as relative L2 norms.
    """
    found, errors = values_of(run), {}
    for name, value in reference.expected.items():
        ours = found.get(name, 0.0)
        errors[name] = ours / value - 1 if value else ours
    if reference.force is not None:
        errors["impulse"], errors["force"] = reference.force.errors(*histories(job, run))
    if reference.slaps is not None and run.motion:
        errors |= cycle_errors(job, run, reference.slaps)
        if (job.scene.report.until or math.inf) >= job.scene.run.duration:
            del errors[BEYOND]
    return errors | {DRIFT: run.energy_drift}


def histories(job: Job, run: Ran) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends of a run's intervals [s], (s,), and the mean resultant of each contact in them [N], (s, 3 k)."""
    if isinstance(run, NodalRecord):
        return run.times, np.column_stack([run.forces[name] for name in job.scene.contact])
    return run.times, np.column_stack([run.contacts[name].force for name in job.scene.contact])


def largest(errors: Errors, counting: set[str]) -> tuple[str | None, float | None]:
    """Return the quantity that is farthest from its reference among those that count, and how far."""
    sizes = {name: abs(error) for name, error in errors.items() if name in counting}
    if not sizes:
        return None, None
    worst = max(sizes, key=lambda name: math.inf if math.isnan(sizes[name]) else sizes[name])
    return worst, sizes[worst]
