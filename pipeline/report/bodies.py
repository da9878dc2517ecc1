"""`gudgeon report` of a scene of bodies: errors of a sweep against a reference, and the time of each run."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.nodal.scene.runs import REPEATS, SHORT, nodal_runs
from gudgeon.pipeline.report.budget.budget import budget_of
from gudgeon.pipeline.report.changes import change_rows
from gudgeon.pipeline.report.choice import choose, doubtful, in_its_basis, judged, keep_report, on_its_mesh
from gudgeon.pipeline.report.document import Document, Quantity, Table, counted_names
from gudgeon.pipeline.report.effort import Effort, new_document
from gudgeon.pipeline.report.errors import Point, fineness, finest_of, finest_step, point, quantities, rows
from gudgeon.pipeline.report.force import contact_forces, reproducible
from gudgeon.pipeline.report.frequencies import frequencies_report
from gudgeon.pipeline.report.front import with_front
from gudgeon.pipeline.report.full_fe.costs import cost_rows
from gudgeon.pipeline.report.measures.differences import velocity_table
from gudgeon.pipeline.report.page.output import FORCE_PICTURE, report_folder, write_report
from gudgeon.pipeline.report.reference import Reference, check_names, external_reference, reference_run, values_of
from gudgeon.pipeline.report.steps import with_steps, with_window
from gudgeon.pipeline.report.sweep import Setting, able_settings, finer, reason, settings_of
from gudgeon.pipeline.report.timing import LONG, WARM_UP, kept_trajectory, spread, timed
from gudgeon.pipeline.stages.folder import held
from gudgeon.pipeline.stages.job import Job, variant
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.errors import SceneError, SolverError

Tell = Callable[[str, float], None]
PATIENCE = 20.0
"""Limit on the CPU time of a setting of the default sweep [s]; ten times the slowest setting so far if that is more."""
FINER = 6.0
"""CPU time of the finer runs of a setting together, over that of its own run."""
TIMING = (
    "CPU time of the solution alone on one thread, least of {repeat} runs after a warm-up run, which loads modules"
    " and ends after {warm_up:.0f} s of CPU time; after {long:.0f} s there are at most two runs. Timed runs are"
    " sequential. With --jobs, only the finer reference runs are parallel; they follow the timed runs and are not"
    " timed. Cold: the stage with an empty database; warm: with all records present. Full-FE runs: CPU time of all"
    " threads, least of {nodal} runs if the first takes at most {short:.0f} s, otherwise that of the first."
)


def report_scene(job: Job, how: Effort, progress: Tell) -> Document:
    """Write the report of a scene of bodies: of frequencies if nothing moves, or of its sweep.

    Raises:
        InputError, StageError: see each.
    """
    rigid = all(job.scene.component[name].geometry.kind == "rigid" for name in job.components())
    if not (job.scene.contact or job.scene.force or job.scene.joint or rigid):
        return frequencies_report(job, how, progress)
    return report_job(job, how, progress)


def report_job(job: Job, how: Effort, progress: Tell) -> Document:
    """Run a scene's sweep, write `report.{json,csv,png,html}` into the job's folder, and keep it in the database.

    Finished runs are in the database: after an interruption they are not computed again.

    Raises:
        InputError: a setting or the reference of the scene is wrong, or the folder holds the report of another scene.
        StageError: no setting ran.
    """
    with report_folder(job.out, job.name, FORCE_PICTURE):
        settings, left_out = _settings(job)
        run_job(job, "morph", progress)
        nodal = nodal_runs(job, progress)
        external = external_reference(job, nodal)
        settings, window = with_window(job, settings)
        settings, notes = with_steps(job, settings, progress)
        points = _points(job, settings, left_out, how.repeat, progress)
        points = _with_finer(job, _comparable(points, external, left_out), how.jobs, progress)
        if not any(p.ran for p in points):
            why = [_failure(p) for p in points] or [f"{entry['name']}: {entry['why']}" for entry in left_out]
            raise StageError(f"{job.path}: report: no setting ran: {'; '.join(why)}")
        reference = _finest(job, points) if external is None or external.empty else external
        compared = quantities(points, reference, nodal, job)
        counted, names = counted_names(compared), [q.name for q in compared]
        check_names(job, reference, set().union(*(values_of(p.trajectory) for p in points if p.ran)), names)
        runs = with_front(rows(points, nodal, job, reference, counted), counted, reference.kind == "finest")
        choice = choose(runs, how.tolerance, compared)
        best = judged(runs, choice, doubtful(compared, how.tolerance))
        judged_point = next(p for p in points if best is not None and p.setting.name == best.name)
        budget = budget_of(judged_point, points, reference, compared, progress)
        document = replace(
            new_document(job, how),
            reference={"kind": reference.kind, "source": reference.source},
            quantities=compared,
            runs=runs,
            left_out=left_out,
            changes=change_rows(job, progress),
            choice=on_its_mesh(in_its_basis(choice, runs, budget, reference.kind), runs, budget, how.same_mesh),
            costs=cost_rows(job, points, runs, nodal, compared),
            budget=budget,
            tables=_tables(job, judged_point, reference),
            window=job.scene.report.window if "force" in names else 0.0,
            peak_window=window,
            until=job.scene.report.until,
            notes=notes + _notes(job, nodal, compared, reference.kind),
            timing=TIMING.format(repeat=how.repeat, warm_up=WARM_UP, long=LONG, nodal=REPEATS, short=SHORT),
        )
        keep_report(job, document)
        picture = _force_picture(job, judged_point, reference)
        with held(job.out):
            write_report(document, job.out, picture=picture)
        progress("report", 1.0)
        return document


def _settings(job: Job) -> tuple[list[Setting], list[dict[str, str]]]:
    """Return the admissible settings and the others, checked before the full-FE runs start, as are design changes."""
    for changes in job.scene.report.changes.values():
        variant(job, changes)
    able, left_out = able_settings(job, settings_of(job))
    until = job.scene.report.until
    for setting in able:
        if until is not None and until > (duration := variant(job, setting.changes).scene.run.duration):
            raise InputError(f"{job.path}: report.until: {until:g} s given, '{setting.name}' lasts {duration:g} s")
    return able, left_out


def _points(
    job: Job, settings: Sequence[Setting], left_out: list[dict[str, str]], repeat: int, progress: Tell
) -> list[Point]:
    """Time every setting; one of the default sweep that is not admissible, or too slow, is omitted."""
    points: list[Point] = []
    for i, setting in enumerate(settings):
        stage = f"setting {i + 1} of {len(settings)}"
        progress(stage, i / len(settings))
        changed = variant(job, setting.changes)
        dearest = max((p.timed.cpu for p in points if p.timed is not None), default=math.inf)
        limit = math.inf if setting.named or job.scene.report.sweep else max(PATIENCE, 10 * dearest)
        try:
            points.append(point(setting, changed, timed(changed, repeat, limit)))
        except (InputError, SceneError) as error:
            if setting.named:
                raise
            left_out.append({"name": setting.name, "why": reason(job, error)})
        except (StageError, SolverError) as error:
            if limit < math.inf:
                left_out.append({"name": setting.name, "why": str(error).splitlines()[0]})
                continue
            points.append(point(setting, changed, None, str(error).splitlines()[0]))
    return points


def _comparable(points: list[Point], reference: Reference | None, left_out: list[dict[str, str]]) -> list[Point]:
    """Omit runs of the default sweep that do not have all quantities of the reference."""
    comparable = []
    for candidate in points:
        expected = reference.expected.keys() if reference is not None and candidate.ran else set()
        missing = sorted(expected - values_of(candidate.trajectory).keys()) if candidate.ran else []
        if missing and not candidate.setting.named:
            left_out.append({"name": candidate.setting.name, "why": f"its run has no {', '.join(missing)}"})
        else:
            comparable.append(candidate)
    return comparable


def _with_finer(job: Job, points: Sequence[Point], jobs: int, progress: Tell) -> list[Point]:
    """Add to every point the runs of finer steps for its time error."""
    finer_settings = {
        i: finer(p.job, p.setting, p.fineness)
        for i, p in enumerate(points)
        if p.timed is not None
        and p.ran
        and finest_step(p, points) is None  # Otherwise a finer step of the sweep is the reference.
        and (p.setting.named or FINER * p.timed.cpu < PATIENCE)
    }
    progress("finer steps", 0.0)
    dearest = max((p.timed.cpu for p in points if p.timed is not None), default=0.0)
    spread(
        job, [setting.changes for settings in finer_settings.values() for setting in settings], jobs,
        max(PATIENCE, 10 * dearest), lambda fraction: progress("finer steps", min(fraction, 0.999)),
    )  # fmt: skip
    return [replace(p, finer=_finished(job, finer_settings.get(i, []))) for i, p in enumerate(points)]


def _finished(job: Job, settings: Sequence[Setting]) -> tuple[tuple[str, float, Trajectory], ...]:
    """Return name, fineness and run of the settings whose run is in the database and finished."""
    variants = [(setting.name, variant(job, setting.changes)) for setting in settings]
    runs = [(name, changed, kept_trajectory(changed)) for name, changed in variants]
    return tuple((n, fineness(changed, run), run) for n, changed, run in runs if run and run.result == "FINISHED")


def _finest(job: Job, points: Sequence[Point]) -> Reference:
    """Return the finest run of the scheme of the scene itself, or of the first scheme that ran."""
    own_scheme = point(Setting("", {}), job, None).scheme[0]
    for scheme in dict.fromkeys([own_scheme, *(p.scheme[0] for p in points)]):
        if (best := finest_of(points, scheme)) is not None:
            name, trajectory = best
            reference = reference_run(job, trajectory, None, name)
            return replace(reference, source=f"the finest setting of the sweep: {name}")
    raise AssertionError("a run has finished")


def _tables(job: Job, judged_point: Point, reference: Reference) -> list[Table]:
    """Return the third octaves of the velocity of sliding surfaces, of a setting and of the reference run."""
    if reference.run is None:
        return []
    table = velocity_table(job, judged_point.trajectory, judged_point.setting.name, reference.run)
    return [] if table is None else [table]


def _force_picture(job: Job, judged_point: Point, reference: Reference) -> bytes | None:
    """Return the picture of the force of a setting and of the reference run; None where that is no other run."""
    (job.out / FORCE_PICTURE).unlink(missing_ok=True)
    run = reference.run
    if run is None or run is judged_point.trajectory or not any(force.any() for force in contact_forces(run).values()):
        return None
    # Imported late: matplotlib would count into the memory of timed runs.
    from gudgeon.pipeline.report.page.force_picture import draw_forces

    names = reference.source, judged_point.setting.name
    draw_forces(judged_point.job, (run, judged_point.trajectory), names, job.out / FORCE_PICTURE)
    return (job.out / FORCE_PICTURE).read_bytes()


def turned_too_far(run: NodalRecord, bodies: Sequence[str], limit: float) -> list[str]:
    """Return a note for each body of a full-FE run that has turned by more than a limit [rad] at its end."""
    notes = []
    for name in bodies:
        turns = [run.quantities.get(f"{name}.rotation_{axis}", {"value": 0.0})["value"] for axis in "xyz"]
        if (angle := math.hypot(*turns)) > limit:
            notes.append(
                f"In full FE body '{name}' has turned by {angle:.3g} rad at the end, beyond run.limits.angle ="
                f" {limit:g} rad, which ends a reduced run: rotations are linear in full FE too, so that it is no"
                " reference there."
            )
    return notes


def _failure(failed: Point) -> str:
    return f"{failed.setting.name}: {failed.failure or failed.trajectory.result}"


def _notes(job: Job, nodal: Sequence[NodalRecord], compared: Sequence[Quantity], kind: str) -> list[str]:
    notes = []
    if job.scene.joint and len(nodal) > 1:
        until = reproducible(job, list(nodal))
        if until < job.scene.run.duration * (1 - 1e-3):
            notes.append(
                f"The two finest full FE runs agree to 5 % in force up to {until * 1e3:.3g} ms and differ by more"
                " afterwards."
            )
    if nodal:
        notes += turned_too_far(nodal[-1], list(job.scene.body), job.scene.run.limits.angle)
    uncounted = [q.name for q in compared if not q.counts and q.converges is False]
    if uncounted and kind == "finest":
        notes.append(
            "These quantities do not count, because the sweep is the only reference and they do not converge over it:"
            f" {', '.join(uncounted)}."
        )
    return notes
