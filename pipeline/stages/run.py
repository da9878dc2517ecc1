"""The stages `mesh → modes → morph → solve → plot` of a scene of bodies: what each of them computes and reports."""

import contextlib
import subprocess
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import copy_file
from gudgeon.pipeline.scenes.checks import law_notes
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.make import Task, make_stage, run_stages
from gudgeon.pipeline.stages.products import STAGES, Product
from gudgeon.pipeline.stages.run_report import Progress, RunReport
from gudgeon.pipeline.stages.summary import read_summary, reference_values, write_summary
from gudgeon.solver.capabilities import INTEGRATORS, UNTOUCHED
from gudgeon.solver.kernel_cache import compile_beside, is_compiled
from gudgeon.solver.result import Result

if TYPE_CHECKING:
    from gudgeon.solver.system.system import System

Compilation = subprocess.Popen[bytes] | None
COMPONENT_STAGES = STAGES[:3]
"""Stages of single components, independent of the scene's dynamics."""
DRIFT = 1e-3
"""Energy drift above which a run gives a note."""
EDGE_SHARE = 1e-3
"""Share of a contact's impulse at the edge of its interface above which a run gives a note."""


def run_job(job: Job, until: str = "plot", progress: Progress | None = None) -> RunReport:
    """Compute the records of a job that are missing, up to and including the stage `until`; see `kinds.run`."""
    tell = progress or (lambda stage, share: None)
    if until == "plot":
        job.compared()  # A mistake there must be reported before the solver runs.
    with _compilation(job, until, tell) as compilation:
        tasks = partial(_tasks, job, tell=tell, compilation=compilation)
        return run_stages(job, until, tell, tasks, partial(_finish, job), partial(_draw, job, tell))


@contextlib.contextmanager
def _compilation(job: Job, until: str, tell: Progress) -> Iterator[Compilation]:
    """Compile the time loop in a child process beside mesh and modes, unless that is done for these sources."""
    name = job.scene.integrator
    if until in COMPONENT_STAGES or is_compiled(name) or job.store.has(job.trajectory().key):
        yield None
        return
    tell(f"compile '{name}' (once)", 0.0)
    child = compile_beside(name)
    try:
        yield child
    finally:
        if child is not None:
            child.terminate()
            child.wait()


def _tasks(job: Job, stage: str, tell: Progress, compilation: Compilation = None) -> list[Task]:
    """Return the records of a stage, in the order in which they depend on each other."""
    if stage == "solve":
        _references(job)  # A mistake there must be reported before the solver runs.
        return [Task(job.trajectory(), lambda: _solve(job, tell, compilation))]
    return [
        Task(product, partial(_make, job, name, step, steps))
        for name, steps in job.components().items()
        for step, product in steps.items()
        if product.stage == stage and (step != "mesh" or product.key != steps["base-mesh"].key)
    ]


def _make(job: Job, name: str, step: str, steps: dict[str, Product]) -> Any:
    """Compute one record of a component. Heavy libraries are imported here, where they are needed."""
    component = job.scene.component[name]
    if step == "base-mesh":
        from gudgeon.pipeline.stages.mesh import build_mesh

        return build_mesh(component, job.folder, name)
    from gudgeon.pipeline.design_change import morph
    from gudgeon.pipeline.stages.mesh import movement_of

    base = job.store.get(steps["base-mesh"].key, "mesh")
    movement = movement_of(component, job.folder, name)
    if step == "mesh":
        assert movement is not None
        return morph.moved_mesh(base, movement)
    if step == "modes":
        from gudgeon.pipeline.reduction.reduce import reduce_component

        mesh = base if steps["mesh"] is steps["base-mesh"] else job.store.get(steps["mesh"].key, "mesh")
        return reduce_component(mesh, steps["mesh"].key, component, name)
    keys = (steps["mesh"].key, steps["modes"].key)
    needed = ["mass", "centre", "inertia", "rigid_twists", *(f"interfaces/{i}/points" for i in component.interface)]
    modal = job.store.get(keys[1], "modes", only=needed)
    if movement is None or component.change.update == "recompute":
        return morph.own_modes(*keys, modal, "none" if movement is None else "recompute")
    assert component.material is not None
    surfaces = {key: item.surface for key, item in component.interface.items()}
    return morph.reuse(base, keys, modal, surfaces, movement, component.material.rho)


def _solve(job: Job, tell: Progress, compilation: Compilation) -> Trajectory:
    """Run the solver once its time loop is compiled."""
    if compilation is not None:
        compilation.wait()
    from gudgeon.solver.simulate import simulate

    return simulate(system_of(job), lambda share: tell("solve", share))


def system_of(job: Job) -> "System":
    """Return the compiled system of a job whose morphs are in the database; see `compile_system` for errors."""
    from gudgeon.solver.system.compile import compile_system

    return compile_system(job.store, job.scene, job.morphs())


def _references(job: Job) -> dict[str, float]:
    with named(job.path, InputError):
        return reference_values(job.scene.report, job.folder)


def _finish(job: Job, until: str) -> RunReport:
    """Write summary and trajectory unless they are up to date, and return the report."""
    frequencies, coarse = _frequencies(job)
    if until in COMPONENT_STAGES:
        rows = frequencies if until == "modes" else {}
        return RunReport(job.name, None, out=str(job.out), notes=coarse, frequencies=rows)
    key, expected = job.trajectory().key, _references(job)
    summary = read_summary(job.out, key, "trajectory.h5", expected)
    if summary is None:
        copy_file(job.store.path(key), job.out / "trajectory.h5")
        summary = write_summary(job.out, key, expected, job.store.get(key, "trajectory", only=["times"]))
    notes = law_notes(job.scene) + _step_notes(job, summary["counts"]) + _edge_notes(job, summary["quantities"])
    notes += _energy_notes(job, summary)
    outcome = Result[summary["result"]]
    return RunReport(
        job.name, summary["result"], quantities=summary["quantities"], energy_drift=summary["energy_drift"],
        momentum_residual=summary["momentum_residual"], estimates=summary["estimates"], out=str(job.out),
        notes=notes + coarse, reason=None if outcome.ok else outcome.value,
    )  # fmt: skip


def _draw(job: Job, tell: Progress) -> tuple[list[Path], list[str]]:
    """Draw the pictures, after running the jobs that they compare this one with."""
    from gudgeon.pipeline.plots import render

    compare = {job.scene.plot.label: job.trajectory().key}
    for name, other in job.compared().items():
        for stage in STAGES[:-1]:
            make_stage(other, stage, partial(_tasks, other, tell=tell), tell)
        compare[name] = other.trajectory().key
    tell("plot", 0.0)
    return render(job.store.root, job.trajectory().key, job.out, job.name, compare if len(compare) > 1 else {})


def _frequencies(job: Job) -> tuple[dict[str, list[dict[str, Any]]], list[str]]:
    """Return the modes of every component with their errors, and a note for each mesh that is too coarse for them."""
    from gudgeon.pipeline.reduction.frequency_table import coarse_notes, frequency_rows, kept_modes

    records = kept_modes(job.store, {name: steps["modes"].key for name, steps in job.components().items()})
    return {name: frequency_rows(record) for name, record in records.items()}, coarse_notes(records)


def _step_notes(job: Job, counts: dict[str, Any]) -> list[str]:
    """Return a note if a given step exceeded the limit of the integrator and was divided."""
    parts = int(counts.get("substeps", 1))
    if parts < 2:
        return []
    name, critical = counts["integrator"], counts["critical_frequency"]
    factor = INTEGRATORS[name].largest if job.scene.contact else min(INTEGRATORS[name].largest, UNTOUCHED)
    limit = f"{factor:g}/ω_c" + (f" = {factor / critical:.3g} s" if critical > 0 else "")
    effect = f"each step was divided into {parts} substeps"
    if INTEGRATORS[name].own_steps:
        effect = "the integrator chose its steps by run.accuracy instead"
    return [f"run.step: {job.scene.run.step:g} s exceeds the limit of integrator '{name}', {limit}; {effect}"]


def _energy_notes(job: Job, summary: dict[str, Any]) -> list[str]:
    """Return a note where the energy balance of a finished run has a noticeable error."""
    drift, name, run = summary["energy_drift"], summary["counts"]["integrator"], job.scene.run
    if drift <= DRIFT or summary["result"] != Result.FINISHED.name:
        return []
    key = "run.step" if run.step is not None else "run.accuracy"
    return [
        f"the energy balance has an error of {drift:.2%} of the energy exchanged in contact (integrator '{name}');"
        f" reduce {key}"
    ]


def _edge_notes(job: Job, quantities: dict[str, Any]) -> list[str]:
    """Return a note for each contact that reached the edge of an interface that covers a part of its surface."""
    notes = []
    for name, contact in job.scene.contact.items():
        share = quantities.get(f"{name}.edge_share", {"value": 0.0})["value"]
        if share > EDGE_SHARE:
            where = f"component.{job.scene.component_of(contact.body)}.interface.{contact.interface}"
            notes.append(
                f"{share:.1%} of the impulse of contact {name} acts at the edge of {where}; the contact area may extend"
                " beyond the interface: enlarge it"
            )
    return notes
