"""Kinds of scene, bodies in contact or a wheel, and the functions that a notebook calls.

A kind has a pydantic model of its file, a job that knows its products, and a function for each command; `open_job`
finds the kind of a file by its tables. A new kind is one entry in `KINDS`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from importlib import import_module
from operator import or_
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter

from gudgeon import modaldb
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import results_folder, scene_path
from gudgeon.pipeline.scenes.reading import named, override_texts, read_tables
from gudgeon.pipeline.stages.base import Place, SceneJob
from gudgeon.pipeline.stages.run_report import Progress, RunReport

if TYPE_CHECKING:
    from gudgeon.pipeline.linear.analysis import Answer, Asked
    from gudgeon.pipeline.report.document import Document
    from gudgeon.pipeline.report.effort import Effort
    from gudgeon.pipeline.report.page.notebook import ShownReport
    from gudgeon.pipeline.scenes.reference.key_reference import Table
    from gudgeon.solver.simulation import Steps

ONE_FILE = "its record holds capacitances, one file a design"
"""Why scenes of conductors have no studies."""


@dataclass(frozen=True)
class Kind:
    """The functions of the commands for scenes of one kind."""

    model: str
    """`module:class` of the pydantic model of its file."""
    open: Callable[[Place], SceneJob]
    """Returns the job of a scene; raises InputError with every mistake listed."""
    run: Callable[[Any, str, Progress | None], RunReport]
    """Computes the records of a job that are missing, up to and including one stage."""
    solve: Callable[[Any, str, Progress | None], RunReport]
    """Computes the records of a job that are missing, up to and including one stage before the pictures, and writes
    nothing else. Up to the stage `solve`, the report has the result, quantities and errors as `run` prints them."""
    plan: Callable[[Any], dict[str, Any]]
    """Returns `terms`, those that are read or omitted with the reason, and `bytes`, the number that is read."""
    report: Callable[[Any, "Effort", Progress], "Document"]
    """Runs every setting of the scene's sweep, writes the report's files and keeps it in the database."""
    robustness: Callable[[Any, Path | None, tuple[str, ...], Progress], tuple[dict[str, Any], str]]
    """Runs the robustness cases, those of a file included, or only those of the named cases and groups. Returns the
    document of docs/robustness.md, and its table as text."""
    export: Callable[..., list[Path]]
    """Writes .vtu files and returns their paths."""
    export_part: Callable[[Any, str, str], list[Path]]
    """Writes a reduced body, by its name, in a format and returns the files."""
    linear: Callable[[Any, "Asked", Progress], "Answer"]
    """Writes assembled modes and a frequency response."""
    calibrate: Callable[..., Any]
    """Writes the calibration of a sensor."""
    signals: Callable[..., Any]
    """Writes the signals of a sensor over time."""
    identify: Callable[..., Any]
    """Writes the parameters of a robot arm."""
    wrench: Callable[..., Any]
    """Writes the wrench on the tool of a robot arm."""
    wear: Callable[..., Any]
    """Carries the wear of a scene on over many cycles, and writes it."""
    no_study: str = ""
    """Why such scenes have no studies; empty where they have."""


def _found(home: str) -> Any:
    """Return the object that `module:name` stands for."""
    module, _, name = home.partition(":")
    return getattr(import_module(module), name)


def _late(home: str) -> Callable[..., Any]:
    """Return a function that imports `module:function` when it is called, so that light commands load nothing heavy."""
    return lambda *arguments: _found(home)(*arguments)


def _after_fields(home: str) -> Callable[..., Any]:
    """As `_late`, after the fields that a scene of bodies names are computed."""

    def called(job: Any, *arguments: Any) -> Any:
        _found("gudgeon.pipeline.kinds.linked:ensure")(job)
        return _found(home)(job, *arguments)

    return called


def _no_export(job: SceneJob, what: str, *arguments: Any) -> list[Path]:
    raise InputError(f"{job.path}: export: {what} of a wheel cannot be exported; its records hold shapes and response")


def _no_part(job: SceneJob, body: str, form: str) -> list[Path]:
    raise InputError(f"{job.path}: export: a wheel has no reduced body; its records hold shapes and response")


def _refused(command: str, instead: str) -> Callable[..., Any]:
    """Return the function of a command that a kind of scene does not have."""

    def refuse(job: SceneJob, *arguments: Any) -> Any:
        raise InputError(f"{job.path}: {command}: a scene of conductors has none; {instead}")

    return refuse


def _no_linear(job: SceneJob, asked: Any, progress: Progress) -> Any:
    raise InputError(f"{job.path}: linear: a wheel has its own response over frequency; run `gudgeon run`")


def _no_sensor(job: SceneJob, *arguments: Any) -> Any:
    raise InputError(f"{job.path}: sensors: only scenes of bodies have them, and arms")


KINDS: dict[str, Kind] = {
    "body": Kind(
        model="gudgeon.pipeline.scenes.bodies:SceneFile",
        open=_late("gudgeon.pipeline.kinds.linked:body_job"),
        run=_late("gudgeon.pipeline.kinds.linked:run_bodies"),
        solve=_late("gudgeon.pipeline.kinds.linked:solve_bodies"),
        plan=_late("gudgeon.pipeline.stages.plan:plan"),
        report=_after_fields("gudgeon.pipeline.report.bodies:report_scene"),
        robustness=_after_fields("gudgeon.pipeline.robustness.run:robustness_job"),
        export=_after_fields("gudgeon.pipeline.exporters.export:export"),
        export_part=_late("gudgeon.pipeline.exporters.part:export_part"),
        linear=_late("gudgeon.pipeline.linear.analysis:analyse"),
        calibrate=_late("gudgeon.pipeline.applications.sensing.job:calibrate"),
        signals=_late("gudgeon.pipeline.applications.sensing.job:signals"),
        identify=_late("gudgeon.pipeline.applications.sensing.arm_job:identify_arm"),
        wrench=_late("gudgeon.pipeline.applications.sensing.arm_job:wrench_of"),
        wear=_after_fields("gudgeon.pipeline.applications.wear.report:run_wear"),
    ),
    "wheel": Kind(
        model="gudgeon.pipeline.applications.wheel.scene:WheelFile",
        open=_late("gudgeon.pipeline.applications.wheel.job:wheel_job"),
        run=_late("gudgeon.pipeline.applications.wheel.stages:run_wheel"),
        solve=_late("gudgeon.pipeline.applications.wheel.stages:solve_wheel"),
        plan=_late("gudgeon.pipeline.applications.wheel.plan:plan_wheel"),
        report=_late("gudgeon.pipeline.applications.wheel.report:report_wheel"),
        robustness=_late("gudgeon.pipeline.applications.wheel.robustness:robustness_wheel"),
        export=_no_export,
        export_part=_no_part,
        linear=_no_linear,
        calibrate=_no_sensor,
        signals=_no_sensor,
        identify=_no_sensor,
        wrench=_no_sensor,
        wear=_late("gudgeon.pipeline.applications.wear.report:run_wear"),
    ),
    "conductor": Kind(
        model="gudgeon.pipeline.applications.electrostatics.scene:FieldFile",
        open=_late("gudgeon.pipeline.applications.electrostatics.job:field_job"),
        run=_late("gudgeon.pipeline.applications.electrostatics.stages:run_field"),
        solve=_refused("study", ONE_FILE),
        plan=_late("gudgeon.pipeline.applications.electrostatics.stages:plan_field"),
        report=_late("gudgeon.pipeline.applications.electrostatics.assessment.report:report_field"),
        robustness=_late("gudgeon.pipeline.applications.electrostatics.assessment.robustness:robustness_field"),
        export=_refused("export", "its record holds panels and charges"),
        export_part=_refused("export", "it has no reduced body"),
        linear=_refused("linear", "it has no modes"),
        calibrate=_no_sensor,
        signals=_no_sensor,
        identify=_no_sensor,
        wrench=_no_sensor,
        wear=_late("gudgeon.pipeline.applications.wear.report:run_wear"),
        no_study=ONE_FILE,
    ),
}
"""Kinds by the table that identifies them; the first if a file has none of these tables."""


def kind_of(job: SceneJob) -> Kind:
    """Return the kind of a job's scene."""
    return KINDS[job.kind]


def open_job(
    scene: str | Path,
    *,
    set: Sequence[str] | Mapping[str, Any] = (),
    db: str | Path | None = None,
    out: str | Path | None = None,
) -> Any:
    """Read and check a scene, and return its job: a `SceneJob`, for bodies a `stages.job.Job`.

    Args:
        scene: The scene's folder or TOML file.
        set: Overrides, `path.to.key=value` texts or a mapping of such paths to values.
        db: Folder or URL of the database; default: that of `GUDGEON_DB`, or `.gudgeon`.
        out: Folder of the results; `out/<folder>/<scene>`, the names of the scene's folder and file, by default.

    Raises:
        InputError: the scene is wrong, every mistake is listed; or no folder can be at `out`.
    """
    path = scene_path(scene)
    texts = override_texts(set)
    tables = read_tables(path, texts)
    folder = path.parent.resolve().name
    name = folder if path.name == "scene.toml" else path.stem
    return job_at(Place(name, path, tables, modaldb.open(db), results_folder(path, out), tuple(texts)))


def job_at(place: Place) -> Any:
    """Return the job of a scene as written, of the kind that its tables identify; raises InputError as `open_job`."""
    first, *others = KINDS
    kind = KINDS[next((table for table in others if table in place.tables), first)]
    return kind.open(place)


def run(
    scene: str | Path,
    *,
    set: Sequence[str] | Mapping[str, Any] = (),
    db: str | Path | None = None,
    out: str | Path | None = None,
    until: str = "plot",
    progress: Progress | None = None,
) -> RunReport:
    """Compute the stale stages of a scene up to the stage `until`, and return stages, quantities and folder.

    See `open_job` for the other arguments. A run that failed physically has its reason in `reason`.

    Raises:
        InputError, StageError, ModalDBError, SolverError: see each; no incomplete file remains.
    """
    job = open_job(scene, set=set, db=db, out=out)
    return kind_of(job).run(job, until, progress)


def simulation(
    scene: "str | Path | SceneJob",
    *,
    set: Sequence[str] | Mapping[str, Any] = (),
    db: str | Path | None = None,
    out: str | Path | None = None,
    step: float | None = None,
    restore: bytes | None = None,
) -> "Steps":
    """Return a scene of bodies that the caller steps; missing records of its components are computed.

    Args:
        scene: Folder or TOML file, or a job, whose other arguments are then its own.
        step: [s]; default: run.step, or the integrator's own.
        restore: A checkpoint of the same scene with the same step, from which it continues.

    Raises:
        InputError, StageError, ModalDBError, SolverError: see each.
    """
    from gudgeon.pipeline.stages.run import system_of
    from gudgeon.solver.errors import SolverError
    from gudgeon.solver.simulation import Steps

    job: Any = open_job(scene, set=set, db=db, out=out) if isinstance(scene, str | Path) else scene
    if job.kind != "body":
        raise InputError(f"{job.path}: a scene of kind '{job.kind}' has no steps over time; give a scene of bodies")
    kind_of(job).run(job, "morph", None)
    with named(job.path, InputError, SolverError):
        found = Steps(system_of(job), step)
    if restore is not None:
        found.load(restore)
    return found


def plan(
    scene: str | Path, *, set: Sequence[str] | Mapping[str, Any] = (), db: str | Path | None = None
) -> dict[str, Any]:
    """Return the terms that the solver reads of a scene's records or omits, with the reason, and the bytes read."""
    job = open_job(scene, set=set, db=db)
    return kind_of(job).plan(job)


def status(
    scene: str | Path,
    *,
    set: Sequence[str] | Mapping[str, Any] = (),
    db: str | Path | None = None,
    out: str | Path | None = None,
) -> list[tuple[str, str, str, list[str]]]:
    """Return for each stage of a scene its name, `fresh` or `stale`, its key, and the reasons why it is stale."""
    from gudgeon.pipeline.stages.status import status as status_of

    return status_of(open_job(scene, set=set, db=db, out=out))


def report(
    scene: str | Path,
    *,
    set: Sequence[str] | Mapping[str, Any] = (),
    db: str | Path | None = None,
    out: str | Path | None = None,
    repeat: int = 3,
    tolerance: float = 0.01,
    same_mesh: bool = False,
    progress: Progress | None = None,
) -> "ShownReport":
    """Run the sweep of a scene and write report.json, .csv, .png and .html, error against run time, to its folder.

    Args:
        repeat: Timed runs of each setting, of which the shortest time counts.
        tolerance: Relative error that the cheapest setting must meet.
        same_mesh: Whether a setting is selected whatever the error of its mesh.

    Returns:
        The runs with errors and CPU times [s], and the choice, as docs/report.md describes them.

    Raises:
        InputError, StageError: the scene or a setting of its sweep is wrong, or no setting ran.
    """
    from gudgeon.pipeline.report.effort import Effort

    job = open_job(scene, set=set, db=db, out=out)
    how = Effort(repeat, 1, tolerance, same_mesh)
    document = kind_of(job).report(job, how, progress or (lambda stage, share: None))
    from gudgeon.pipeline.report.page.notebook import shown  # Late: matplotlib would count into timed runs.

    return shown(document)


def schema_of(job: SceneJob) -> dict[str, Any]:
    """Return the JSON schema of the model of a scene's kind."""
    found: dict[str, Any] = _found(kind_of(job).model).model_json_schema()
    return found


def schema() -> dict[str, Any]:
    """Return the JSON schema of complete scenes of any kind, as their models describe them."""
    from gudgeon.pipeline.scenes.reference.file_schema import described

    models: Any = reduce(or_, (_found(kind.model) for kind in KINDS.values()))
    return described(TypeAdapter(models).json_schema())


def scene_tables() -> "list[Table]":
    """Return the tables of scene files with their keys; examples are from the scenes of the package."""
    from importlib.resources import files

    from gudgeon.pipeline.scenes.reference.examples import found_examples
    from gudgeon.pipeline.scenes.reference.key_reference import tables

    found = schema()
    folder = files("gudgeon.examples")
    paths = [Path(str(one)) for scene in folder.iterdir() if scene.is_dir() for one in scene.iterdir()]
    scenes = (read_tables(path) for path in sorted(paths) if path.suffix == ".toml")
    return tables(found, found_examples(found, scenes))
