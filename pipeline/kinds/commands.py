"""Functions of the commands on a scene: linear analysis, sensitivities, robustness, exports, wear, matrices of a part.

All take a scene and the arguments `set`, `db` and `out` of `kinds.open_job`, and raise its errors; see there.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import BODY, open_job
from gudgeon.pipeline.kinds.given import Given
from gudgeon.pipeline.kinds.progress import shown
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.run_report import Progress

if TYPE_CHECKING:
    from gudgeon.pipeline.applications.wear.report import WearReport
    from gudgeon.pipeline.linear.analysis import Answer
    from gudgeon.pipeline.reduction.matrices import ComponentMatrices
    from gudgeon.pipeline.sensitivity.report import SensitivityReport

Changes = Sequence[str] | Mapping[str, Any]
"""Overrides of a scene, as `kinds.open_job` takes them."""
Place = str | Path | None
"""A folder, a file or a database; None: the default."""
MOST_CYCLES = 1e15


def linear(
    scene: Given,
    *,
    force: str | None = None,
    at: Sequence[str] = (),
    quantity: str = "displacement",
    frequencies: tuple[float, float] | None = None,
    points: int | None = None,
    loss: float = 0.0,
    static: bool = False,
    closed: Sequence[str] = (),
    set: Changes = (),
    db: Place = None,
    out: Place = None,
    progress: Progress | None = None,
) -> "Answer":
    """Compute the assembled modes of a scene at its start, and a frequency response or static answers between ports.

    >>> import gudgeon
    >>> answer = gudgeon.linear(gudgeon.example("held-beam"), force="contact.stop", frequencies=(10.0, 1e3), points=50)
    >>> round(answer.modes[0]["frequency"], 1), [file.name for file in answer.files]
    (27.9, ['linear-modes.csv', 'linear-response.csv', 'linear-response.png'])

    Args:
        force: Port of a unit force, or a motion that moves by a unit; None: modes alone.
        at: Ports, probes and gauges where the response is read; default: where the force acts.
        quantity: `displacement`, `velocity` or `acceleration`.
        frequencies: Lowest and highest of the response [Hz]; default: around the modes.
        points: Number of frequencies; default: 2001, and 31 more in each resonance.
        loss: Structural loss factor of all elastic bodies.
        static: Whether the static answers to unit forces are computed.
        closed: Contacts, `contact.NAME`, all points of which are closed; default: those that press at the start.

    Raises:
        SceneError, SolverError: a name, a range or the scene is wrong.
    """
    from gudgeon.pipeline.linear.analysis import Asked

    job = open_job(scene, set=set, db=db, out=out)
    request = Asked(tuple(closed), force, tuple(at), quantity, frequencies, points, loss=loss, static=static)
    return job.kind.function(job.path, "linear")(job, request, shown(progress))


def sensitivity(
    scene: Given,
    *,
    of: Sequence[str] = (),
    by: Sequence[str] = (),
    accuracy: float = 1e-5,
    set: Changes = (),
    db: Place = None,
    out: Place = None,
    progress: Progress | None = None,
) -> "SensitivityReport":
    """Compute derivatives of quantities of a run and of frequencies with respect to keys of its scene.

    >>> import gudgeon
    >>> answer = gudgeon.sensitivity(gudgeon.example("hertz") / "half-space.toml", of=["pair.force_norm"],
    ...                              by=["body.one.velocity.0"], set={"run.step": 2e-7})
    >>> [(d.parameter.key, round(d.relative, 3)) for d in answer.derivatives]          # 6/5 of Hertz
    [('body.one.velocity.0', 1.2)]

    Args:
        of: Quantities; default: impulse and force_norm of each contact. See docs/sensitivities.md.
        by: Keys of numbers, as `set` takes them; default: materials, speeds, laws, layers, damping and springs.
        accuracy: Largest change of a derivative by the last halving of the step, over the largest of its quantity.

    Raises:
        InputError: a quantity or a key has no derivative, or the scene has what none is found through.
    """
    from gudgeon.pipeline.sensitivity.analysis import Asked

    job = open_job(scene, set=set, db=db, out=out)
    request = Asked(tuple(of), tuple(by), accuracy)
    return job.kind.function(job.path, "sensitivity")(job, request, shown(progress))


def robustness(
    scene: Given,
    *,
    only: Sequence[str] = (),
    cases: Place = None,
    set: Changes = (),
    db: Place = None,
    out: Place = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Run a scene under extreme parameters and judge each result by a rule; see docs/robustness.md.

    >>> import gudgeon
    >>> coarse = {"component.rod.mesh.size": 0.1, "component.rod.modes.normal_count": 3}
    >>> document = gudgeon.robustness(gudgeon.example("rod-wall"), only=["samples 50"], set=coarse)
    >>> document["passed"], document["rows"][0]["verdict"]
    (True, 'right')

    Args:
        only: Names of the cases and groups that run; default: all.
        cases: TOML file with further cases.

    Returns:
        The document of `robustness.json`.

    Raises:
        StageError: the unchanged scene cannot be run.
    """
    from gudgeon.pipeline.robustness.run import robustness as run_cases

    job = open_job(scene, set=set, db=db, out=out)
    return run_cases(job, None if cases is None else Path(cases), tuple(only), shown(progress))[0]


def export(
    scene: Given,
    content: str = "results",
    *,
    format: str | None = None,
    every: int = 1,
    set: Changes = (),
    db: Place = None,
    out: Place = None,
) -> list[Path]:
    """Write mode shapes or results as files of ParaView, or a reduced body for another program; return the files.

    >>> import gudgeon
    >>> coarse = {"component.rod.mesh.size": 0.1, "component.rod.modes.normal_count": 3}
    >>> [file.name for file in gudgeon.export(gudgeon.example("rod-wall"), "rod", format="npz", set=coarse)]
    ['rod.npz', 'rod-rows.csv']

    Args:
        content: `modes`, `results`, or with a format the name of a body.
        format: `uff`, `op4`, `abaqus`, `exudyn` or `npz`; None writes .vtu files.
        every: Number of stored frames of which one is written.
    """
    from gudgeon.pipeline.exporters.part import EXUDYN, FORMATS, export_part

    job = open_job(scene, set=set, db=db, out=out)
    to_vtu = job.kind.function(job.path, "export")
    if format is None:
        if content not in ("modes", "results") or every < 1:
            raise InputError(f"export: '{content}', every {every} given; allowed: modes or results, every 1 or more, or"
                             " the name of a body with a format")  # fmt: skip
        return to_vtu(job, content, every)
    if format not in (*FORMATS, EXUDYN):
        raise InputError(f"export: format '{format}' given; allowed: {', '.join((*FORMATS, EXUDYN))}")
    return export_part(job, content, format)


def wear(
    scene: Given,
    cycles: float = 1000.0,
    *,
    at: Sequence[float] = (),
    period: float | None = None,
    tolerance: float | None = None,
    set: Changes = (),
    db: Place = None,
    out: Place = None,
    progress: Progress | None = None,
) -> "WearReport":
    """Wear the joints with clearance, or the contacts, of a scene over many cycles; see docs/wear.md.

    >>> import gudgeon
    >>> scene, short = gudgeon.example("clearance-joint") / "wear.toml", {"run.duration": 0.0125}
    >>> gudgeon.wear(scene, 100, tolerance=0.5, set=short).files
    ['wear.json', 'wear.csv', 'wear-pin.png']

    Args:
        cycles: Number of cycles.
        at: Numbers of cycles after which shapes are written; default: powers of ten from 10 on, and the last one.
        period: Duration of a cycle [s]; default: the time of the run after `wear.after`.
        tolerance: Largest difference of an update and its two halves, over the clearance; default: 0.01.
    """
    from gudgeon.pipeline.applications.wear.cycles import Asked
    from gudgeon.pipeline.applications.wear.report import TOLERANCE, marks_of

    if not 0 < cycles < MOST_CYCLES:
        raise InputError(f"wear: cycles: {cycles} given; allowed: above 0, below {MOST_CYCLES:g}")
    job = open_job(scene, set=set, db=db, out=out)
    request = Asked(marks_of(cycles, list(at)), TOLERANCE if tolerance is None else tolerance)
    return job.kind.function(job.path, "wear")(job, request, period, shown(progress))


def component(
    scene: Given,
    name: str,
    *,
    set: Changes = (),
    db: Place = None,
    progress: Progress | None = None,
) -> "ComponentMatrices":
    """Return stiffness and mass of a component as sparse matrices, with its modes and residual flexibility.

    >>> import gudgeon
    >>> coarse = {"component.rod.mesh.size": 0.1, "component.rod.modes.normal_count": 3}
    >>> rod = gudgeon.component(gudgeon.example("rod-wall"), "rod", set=coarse)
    >>> rod.stiffness.shape, rod.modes.shape, rod.residual_flexibility.shape, rod.rows
    ((21, 21), (21, 3, 3), (1, 1), {'tip': (0, 1)})
    >>> round(float(rod.mass.sum()), 3)                    # kg: of a bar, one degree of freedom a node
    2.466

    Args:
        name: Name of the component; mesh and modes are computed if the database does not have them.

    Raises:
        StageError: a numerical routine failed.
    """
    from gudgeon.pipeline.interfaces.point_mass import component_model
    from gudgeon.pipeline.reduction.matrices import ComponentMatrices

    job = open_job(scene, set=set, db=db)
    if job.kind is not BODY:
        raise InputError(f"{job.path}: component: a scene of kind '{job.kind.name}' given; allowed: a scene of bodies")
    made = job.components()
    if name not in made:
        raise InputError(f"{job.path}: component: no component '{name}'; the scene has {', '.join(made)}")
    run_job(job, "modes", shown(progress))
    mesh, modes = (job.store.get(made[name][kind].key, kind) for kind in ("mesh", "modes"))
    return ComponentMatrices(component_model(mesh, job.scene.component[name], f"component.{name}"), modes)
