"""Kinds of scene, bodies in contact, a wheel or conductors, and the functions that a notebook calls.

A kind has a pydantic model of its file, a job that knows its products, stages that make these, and the functions of
its commands; `open_job` finds the kind of a file by its tables. A new kind is one entry in `KINDS`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import reduce
from operator import or_
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter

from gudgeon import modaldb
from gudgeon.modaldb.stores.base import Store
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds.applications import CONDUCTORS, WHEEL
from gudgeon.pipeline.kinds.given import Given, tables_of
from gudgeon.pipeline.kinds.progress import shown as shown_progress
from gudgeon.pipeline.scenes.reading import named, override_texts, read_tables
from gudgeon.pipeline.stages.base import Kind, Late, Place, SceneJob, Stage
from gudgeon.pipeline.stages.run_report import Progress, RunReport

if TYPE_CHECKING:
    from gudgeon.pipeline.report.page.notebook import ShownReport
    from gudgeon.pipeline.scenes.reference.key_reference import Table
    from gudgeon.pipeline.stages.job import Job
    from gudgeon.solver.simulation import Steps


BODY = Kind(
    name="body",
    model=Late("gudgeon.pipeline.scenes.bodies:SceneFile"),
    open=Late("gudgeon.pipeline.kinds.linked:body_job"),
    stages=(
        Stage(
            "mesh", Late("gudgeon.pipeline.stages.job:mesh_products"), Late("gudgeon.pipeline.stages.bodies:make_mesh")
        ),
        Stage(
            "modes",
            Late("gudgeon.pipeline.stages.job:modes_products"),
            Late("gudgeon.pipeline.stages.bodies:make_modes"),
        ),
        Stage(
            "morph",
            Late("gudgeon.pipeline.stages.job:morph_products"),
            Late("gudgeon.pipeline.stages.bodies:make_morph"),
        ),
        Stage(
            "solve",
            Late("gudgeon.pipeline.stages.job:run_products"),
            Late("gudgeon.pipeline.stages.bodies:make_run"),
            Late("gudgeon.pipeline.stages.bodies:check_run"),
        ),
    ),
    results=Late("gudgeon.pipeline.stages.bodies:results"),
    draw=Late("gudgeon.pipeline.stages.bodies:draw"),
    commands={
        "plan": Late("gudgeon.pipeline.stages.plan:plan"),
        "report": Late("gudgeon.pipeline.report.bodies:report_scene"),
        "robustness": Late("gudgeon.pipeline.robustness.run:body_subject"),
        "linear": Late("gudgeon.pipeline.linear.analysis:analyse"),
        "sensitivity": Late("gudgeon.pipeline.sensitivity.analysis:sense"),
        "export": Late("gudgeon.pipeline.exporters.export:export"),
        "calibrate": Late("gudgeon.pipeline.applications.sensing.job:calibrate"),
        "signals": Late("gudgeon.pipeline.applications.sensing.job:signals"),
        "identify": Late("gudgeon.pipeline.applications.sensing.arm_job:identify_arm"),
        "wrench": Late("gudgeon.pipeline.applications.sensing.arm_job:wrench_of"),
        "wear": Late("gudgeon.pipeline.applications.wear.report:run_wear"),
        "feel": Late("gudgeon.pipeline.applications.feel.session:feel"),
    },
    solved=Late("gudgeon.pipeline.stages.bodies:solved"),
    during=Late("gudgeon.pipeline.stages.bodies:during"),
)
KINDS = {kind.name: kind for kind in (BODY, WHEEL, CONDUCTORS)}
"""Kinds by the table that identifies them; the first if a file has none of these tables."""


def open_job(
    scene: Given,
    *,
    set: Sequence[str] | Mapping[str, Any] = (),
    db: str | Path | None = None,
    out: str | Path | None = None,
) -> "Job":
    """Read and check a scene, and return its job: of bodies a `Job`, of a wheel or conductors their own `SceneJob`.

    >>> import gudgeon
    >>> job = gudgeon.open_job(gudgeon.example("rod-wall"), set={"run.duration": 1e-4})
    >>> job.scene.run.duration, job.stages
    (0.0001, ('mesh', 'modes', 'morph', 'solve', 'plot'))

    Args:
        scene: The scene's folder or TOML file, a mapping of its tables, or a `gudgeon.Scene`. In a mapping, meshes of
            meshio or scikit-fem and matrices may stand for a component's geometry; see docs/python.md.
        set: Overrides, `path.to.key=value` texts or a mapping of such paths to values.
        db: Folder or URL of the database; default: that of `GUDGEON_DB`, or `.gudgeon`.
        out: Folder of the results; `out/<folder>/<scene>`, the names of the scene's folder and file, by default.

    Raises:
        InputError: the scene is wrong, every mistake is listed; or no folder can be at `out`.
    """
    texts = override_texts(set)
    name, path, tables, folder = tables_of(scene, texts, out)
    return job_at(name, path, tables, modaldb.open(db), folder, tuple(texts))


def job_at(
    name: str, path: Path, tables: dict[str, Any], store: Store, out: Path, overrides: tuple[str, ...] = ()
) -> Any:
    """Return the job of a scene as written, of the kind that its tables identify; raises InputError as `open_job`.

    The arguments are the fields of `stages.base.Place`.
    """
    kind = next((kind for table, kind in KINDS.items() if kind is not BODY and table in tables), BODY)
    return kind.open(Place(kind, name, path, tables, store, out, overrides=overrides))


def run(
    scene: Given,
    *,
    set: Sequence[str] | Mapping[str, Any] = (),
    db: str | Path | None = None,
    out: str | Path | None = None,
    until: str = "plot",
    progress: Progress | None = None,
) -> RunReport:
    """Compute the stale stages of a scene up to the stage `until`, and return stages, quantities and frames.

    >>> import gudgeon
    >>> coarse = {"component.rod.mesh.size": 0.1, "component.rod.modes.normal_count": 3}
    >>> result = gudgeon.run(gudgeon.example("rod-wall"), set=coarse, until="solve")
    >>> result.result, round(result.quantities["wall.impulse"]["value"], 1)       # N s
    ('FINISHED', 4.8)
    >>> result.frames["rod"].displacement.shape            # frames, nodes, directions [m]
    (201, 21, 3)

    See `open_job` for the other arguments. A run that failed physically has its reason in `reason`. In a notebook a bar
    below the cell shows the progress, unless `progress` is given.

    Raises:
        InputError, StageError, ModalDBError, SolverError: see each; no incomplete file remains.
    """
    from gudgeon.pipeline.stages.run import run_job

    job = open_job(scene, set=set, db=db, out=out)
    return replace(run_job(job, until, shown_progress(progress)), job=job)


def simulation(
    scene: "Given | SceneJob",
    *,
    set: Sequence[str] | Mapping[str, Any] = (),
    db: str | Path | None = None,
    out: str | Path | None = None,
    step: float | None = None,
    restore: bytes | None = None,
) -> "Steps":
    """Return a scene of bodies that the caller steps; missing records of its components are computed.

    >>> import gudgeon
    >>> sim = gudgeon.simulation(gudgeon.example("held-ball"), step=1e-3)
    >>> sim.force("hand")[:] = 1.0                         # N
    >>> sim.step(2)
    >>> round(sim.time, 6)
    0.002

    Args:
        scene: File, mapping or model as `open_job` takes it, or a job, which has all other arguments already.
        step: [s]; default: run.step, or the integrator's own.
        restore: A checkpoint of the same scene with the same step, from which it continues.

    Raises:
        InputError, StageError, ModalDBError, SolverError: see each.
    """
    from gudgeon.pipeline.stages.bodies import system_of
    from gudgeon.pipeline.stages.run import run_job
    from gudgeon.solver.errors import SolverError
    from gudgeon.solver.simulation import Steps

    job: Any = scene if isinstance(scene, SceneJob) else open_job(scene, set=set, db=db, out=out)
    if job.kind is not BODY:
        raise InputError(
            f"{job.path}: a scene of kind '{job.kind.name}' has no steps over time; give a scene of bodies"
        )
    run_job(job, "morph")
    with named(job.path, InputError, SolverError):
        steps = Steps(system_of(job), step)
    if restore is not None:
        steps.load(restore)
    return steps


def plan(scene: Given, *, set: Sequence[str] | Mapping[str, Any] = (), db: str | Path | None = None) -> dict[str, Any]:
    """Return the terms that the solver reads of a scene's records or omits, with the reason, and the bytes read.

    >>> import gudgeon
    >>> plan = gudgeon.plan(gudgeon.example("rod-wall"))
    >>> plan["integrator"], plan["terms"][0]["body"]
    ('small', 'rod')
    """
    job = open_job(scene, set=set, db=db)
    return job.kind.function(job.path, "plan")(job)


def status(
    scene: Given,
    *,
    set: Sequence[str] | Mapping[str, Any] = (),
    db: str | Path | None = None,
    out: str | Path | None = None,
) -> list[tuple[str, str, str, list[str]]]:
    """Return for each stage of a scene its name, `fresh` or `stale`, its key, and the reasons why it is stale.

    >>> import gudgeon
    >>> stage, state, key, reasons = gudgeon.status(gudgeon.example("rod-wall"))[0]
    >>> stage, state, reasons
    ('mesh', 'stale', ['rod: not made yet'])
    """
    from gudgeon.pipeline.stages.status import status as status_of

    return status_of(open_job(scene, set=set, db=db, out=out))


def report(
    scene: Given,
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

    >>> import gudgeon
    >>> coarse = {"component.rod.mesh.size": 0.1, "component.rod.modes.normal_count": 3}
    >>> few = {"report.models": "unset", "report.full_fe": "unset"}
    >>> document = gudgeon.report(gudgeon.example("rod-wall"), set=coarse | few, repeat=1)
    >>> [run.name for run in document.runs][:3]
    ['1 modes', '2 modes', '3 modes']

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
    document = job.kind.function(job.path, "report")(job, how, shown_progress(progress))
    from gudgeon.pipeline.report.page.notebook import shown  # Late: matplotlib would count into timed runs.

    return shown(document)


def schema_of(job: SceneJob) -> dict[str, Any]:
    """Return the JSON schema of the model of a scene's kind."""
    return job.kind.model.object().model_json_schema()


def schema() -> dict[str, Any]:
    """Return the JSON schema of complete scenes of any kind, as their models describe them."""
    from gudgeon.pipeline.scenes.reference.file_schema import described

    models: Any = reduce(or_, (kind.model.object() for kind in KINDS.values()))
    return described(TypeAdapter(models).json_schema())


def scene_tables() -> "list[Table]":
    """Return the tables of scene files with their keys; examples are from the scenes of the package."""
    from importlib.resources import files

    from gudgeon.pipeline.scenes.reference.examples import found_examples
    from gudgeon.pipeline.scenes.reference.key_reference import tables

    scene_schema = schema()
    folder = files("gudgeon.examples")
    paths = [Path(str(f)) for scene in folder.iterdir() if scene.is_dir() for f in scene.iterdir()]
    scenes = (read_tables(path) for path in sorted(paths) if path.suffix == ".toml")
    return tables(scene_schema, found_examples(scene_schema, scenes))
