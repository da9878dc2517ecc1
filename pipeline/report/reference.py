"""The reference of a report, and the errors of a run against it: quantities, windowed force, impacts and motion."""

import math
from collections.abc import Collection
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase

import numpy as np

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import read_json
from gudgeon.pipeline.report.document import Errors
from gudgeon.pipeline.report.force import (
    ForceReference,
    Ran,
    contact_forces,
    end_of,
    history_reference,
    pulse_reference,
)
from gudgeon.pipeline.report.measures.differences import SLAP, VELOCITY, differences, relative
from gudgeon.pipeline.report.measures.extrapolation import Extrapolation, extrapolation
from gudgeon.pipeline.scenes.reading import find_file
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.summary import reference_values
from gudgeon.solver.joints import Driven
from gudgeon.solver.scene.refusals import suggestion

DRIFT = "energy drift"
BEYOND = "force, whole run"
"""Force error over the whole run, also beyond `report.until`; omitted if that is the end of the run."""
HISTORIES = ("force", VELOCITY, SLAP, BEYOND)
"""Last parts of the names of quantities whose error is a relative L2 norm."""
IMPACT = ".impact"
"""Part of the names of quantities of single impacts, which are compared on the impacts of the reference run."""
USUAL = (
    "impulse", "start", "duration", "restitution", "force_peak", "pressure_peak", "deflection_peak", "deflection_end",
    "angle_end",
)  # fmt: skip
"""Quantities of a run that are compared if the scene names none, less angles of joints that are driven."""
NO_TURN = 1e-9
"""Angle at the end of a run below which a joint has come back to its start; its digits are round-off [rad]."""


@dataclass(frozen=True)
class Reference:
    """Reference values, or a reference run."""

    kind: str
    """`analytic`, `published`, `nodal` or `finest`."""
    source: str
    expected: dict[str, float]
    force: ForceReference | None
    run: Ran | None = None
    """The run whose impacts and motion are the reference, in scenes with contacts."""
    whole: ForceReference | None = None
    """The reference force beyond `report.until`; None if that is the end of the run."""
    located: Ran | None = None
    """The run whose impacts are compared: that of the report's reference."""
    zero_step: Extrapolation | None = None
    """The extrapolation of full-FE runs that is the reference."""

    @property
    def empty(self) -> bool:
        """Whether it has nothing to compare with."""
        return not self.expected and self.force is None and self.run is None

    def is_run(self, run: Ran) -> bool:
        """Whether a run is the reference itself."""
        return self.zero_step is None and (self.located if self.run is None else self.run) is run


def values_of(run: Ran) -> dict[str, float]:
    """Return the quantities of a run by name."""
    return {name: float(entry["value"]) for name, entry in run.quantities.items()}


def external_reference(job: Job, nodal: list[NodalRecord]) -> Reference | None:
    """Return the reference of a scene: its file, or else the finest full-FE run; None if it has neither.

    Raises:
        InputError: the file or one of its values is missing.
    """
    report, finest = job.scene.report, nodal[-1] if nodal else None
    expected = reference_values(report, job.folder)
    pulse = pulse_reference(job)
    if report.reference is not None:
        path = find_file(report.reference, job.folder, f"{job.path}: report.reference")
        about = read_json(path)
        kind = "analytic" if "derivation" in about else "published"
        return Reference(kind, f"{about.get('title', path.stem)} ({path.name})", expected, pulse)
    if finest is None:
        return None
    zero_step, run, source = None, finest, f"full FE at {finest.step * 1e6:g} µs"
    if report.full_fe is not None and report.full_fe.extrapolate:
        zero_step = extrapolation(job, nodal)
        run, source = zero_step.run, zero_step.words
    if not job.scene.contact:
        return replace(reference_run(job, run, None, source), kind="nodal", zero_step=zero_step)
    force, whole = _force(job, run), _whole(job, run)
    return Reference("nodal", source, {}, force, run, whole=whole, located=finest, zero_step=zero_step)


def own_errors(job: Job, reference: Reference) -> Errors:
    """Return the estimated error of an extrapolated reference in each quantity, without sign; empty for others."""
    if reference.zero_step is None:
        return {}
    errors = errors_against(job, reference.zero_step.rougher, reference)
    return {name: abs(error) * reference.zero_step.share for name, error in errors.items() if name != DRIFT}


def reference_run(job: Job, run: Ran, like: Reference | None, name: str) -> Reference:
    """Return a run as the reference of others, for the same quantities as another reference.

    Args:
        like: The other reference; None for the usual quantities.
        name: Of the run.
    """
    values, interest = values_of(run), job.scene.report.interest
    if like is None:
        names = _usual(job, values)
        has_force, has_run = bool(named_by(["force"], interest)), bool(job.scene.contact)
    else:
        names, has_force, has_run = {*like.expected}, like.force is not None, like.run is not None
    expected = {n: without_round_off(n, value) for n, value in values.items() if n in names}
    force, beyond = (_force(job, run), _whole(job, run)) if has_force else (None, None)
    located = run if like is None else like.located
    return Reference("finest", name, expected, force, run if has_run else None, whole=beyond, located=located)


def _usual(job: Job, names: Collection[str]) -> set[str]:
    """Return the quantities of a run that are compared: those that the scene names, or else the usual ones."""
    interest = job.scene.report.interest
    if interest:
        return {name for name in named_by(names, interest) if IMPACT not in name or name in interest}
    driven = {f"{joint.joint}.angle_end" for joint in job.scene.joint.values() if isinstance(joint, Driven)}
    return {name for name in names if name.rsplit(".", 1)[-1] in USUAL and IMPACT not in name} - driven


def without_round_off(name: str, value: float) -> float:
    """Return the value of a quantity, zero for the angle of a joint that has come back to its start."""
    return 0.0 if name.endswith(".angle_end") and abs(value) < NO_TURN else value


def _force(job: Job, run: Ran) -> ForceReference:
    return history_reference(job, *histories(job, run), end_of(job))


def _whole(job: Job, run: Ran) -> ForceReference | None:
    duration = job.scene.run.duration
    return history_reference(job, *histories(job, run), duration) if end_of(job) < duration else None


def errors_against(job: Job, run: Ran, reference: Reference) -> Errors:
    """Return the errors of a run: signed and relative, absolute where the reference is zero; L2 norms of histories.

    A quantity that the run does not have is taken for zero.
    """
    values = values_of(run)
    errors = {}
    if reference.run is not None and reference.located is not None:
        errors = differences(job, run, reference.run, reference.located)
    for name, value in reference.expected.items():
        errors[name] = relative(values.get(name, 0.0), value)
    if reference.force is not None:
        errors["impulse"], errors["force"] = reference.force.errors(*histories(job, run))
    if reference.whole is not None:
        errors[BEYOND] = reference.whole.errors(*histories(job, run))[1]
    return errors | {DRIFT: run.energy_drift}


def check_names(job: Job, reference: Reference, run_names: Collection[str], compared: Collection[str]) -> None:
    """Refuse names that no run has: their values would be taken for zero, or never count.

    Args:
        run_names: Quantities of the runs.
        compared: Quantities that have an error.

    Raises:
        InputError: a name of `report.quantities` or `report.interest` is unknown.
    """
    wrong = [("quantities", name, run_names) for name in reference.expected if name not in run_names]
    every = {*run_names, *compared}
    wrong += [("interest", name, every) for name in job.scene.report.interest if not named_by(compared, [name])]
    lines = []
    for key, name, able in wrong:
        have = ", ".join(sorted(able)) or "none"
        lines.append(f"{job.path}: report.{key}: no run has '{name}'; {suggestion(name, able)}known are {have}")
    if lines:
        raise InputError("\n".join(lines))


def named_by(names: Collection[str], patterns: Collection[str]) -> set[str]:
    """Return the names that are among some patterns, in which a star is any text."""
    return {name for name in names if any(fnmatchcase(name, pattern) for pattern in patterns)}


def histories(job: Job, run: Ran) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends of a run's intervals [s], (s,), and the mean resultant of each contact in them [N], (s, 3 k)."""
    forces = contact_forces(run)
    return run.times, np.column_stack([forces[name] for name in job.scene.contact])


def largest(errors: Errors, counting: set[str]) -> tuple[str | None, float | None]:
    """Return the quantity with the largest error among those that count, and the absolute value of that error."""
    sizes = {name: abs(error) for name, error in errors.items() if name in counting}
    if not sizes:
        return None, None
    worst = max(sizes, key=lambda name: math.inf if math.isnan(sizes[name]) else sizes[name])
    return worst, sizes[worst]
