"""Step and window of the runs of a report, the same for all of them.

A run whose step is left out repeats itself with finer steps. A sweep does that in the first run of each integrator and
gives the step that was found to all others, so that they differ in nothing else and their times are those of one run.
Peak forces are comparable over one window only: where it is left out, it is that of the run of the scene as it stands,
of several contacts the shortest.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.report.sweep import Setting, reason
from gudgeon.pipeline.report.timing import made
from gudgeon.pipeline.scenes.reading import merged
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.job import Job, variant
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.result import Result

PATIENCE = 120.0
"""CPU time of the run that finds a step, after which the first step of its integrator is kept [s]."""


def with_steps(
    job: Job, settings: Sequence[Setting], progress: Callable[[str, float], None]
) -> tuple[list[Setting], list[str]]:
    """Return settings without estimates of their own, those without a step with that of their integrator's first run.

    Where that run fails, its integrator keeps its first step; a note says so, as where the step is not accurate.
    """
    steps: dict[str, float | None] = {}
    settled, notes = [], []
    for setting in settings:
        changed = variant(job, setting.changes)
        run, name = changed.scene.run, changed.scene.integrator
        changes = merged(setting.changes, {"run": {"checks": False}})
        if run.checks and run.step is None and not changed.scene.capabilities.own_steps:
            key = f"{name} {run.accuracy} {run.duration}"
            if key not in steps:
                progress(f"step of {name}", 0.0)
                steps[key], note = _step(changed)
                notes += [f"Step of {name}, from '{setting.name}': {note}"] if note else []
            if (step := steps[key]) is not None:
                changes = merged(changes, {"run": {"step": step}})
        settled.append(replace(setting, changes=changes))
    return settled, notes


def with_window(job: Job, settings: Sequence[Setting]) -> tuple[list[Setting], float]:
    """Return settings with the window of the scene's own run where they leave it out, and this window [s].

    Returns:
        A window of 0 where forces are not averaged, the scene's own run is impossible, or a setting has another one.
    """
    try:
        window = _found_window(job) if job.scene.contact else 0.0
    except (InputError, StageError, SceneError, SolverError):
        return list(settings), 0.0
    if not window:
        return list(settings), 0.0
    settled = []
    for setting in settings:
        run = variant(job, setting.changes).scene.run
        # A window is at most as long as the run.
        window_change = {} if run.window is not None else {"run": {"window": min(window, run.duration)}}
        settled.append(replace(setting, changes=merged(setting.changes, window_change)))
    windows = {variant(job, setting.changes).scene.run.window for setting in settled}
    return settled, window if windows == {window} else 0.0


def _found_window(job: Job) -> float:
    """Return the window of forces of a job's scene [s]: `run.window`, or the shortest that follows from its run."""
    if (window := job.scene.run.window) is not None:
        return window
    separation = system_of(job).separation
    if not separation:
        return 0.0
    run = made(variant(job, {"run": {"checks": False}}), PATIENCE)
    windows = [q["value"] for name, q in run.quantities.items() if name.endswith(".force_window")]
    return min(windows, default=separation)


def _step(job: Job) -> tuple[float | None, str]:
    """Return the step that the run of a job ends with [s], None if there is no run, and why it is not accurate."""
    try:
        run = made(job, PATIENCE)
    except (InputError, StageError, SceneError, SolverError) as error:
        return None, f"the first one of the integrator is used, its error is not estimated: {reason(job, error)}"
    outcome = Result[run.result]
    return float(run.counts["step"]), "" if outcome.ok else outcome.value
