"""The stages `mesh → modes → morph → solve → plot`: what is fresh is not made again. Starts the solver."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.files import copy_file
from gudgeon.pipeline.scenes.checks import law_notes
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.pictures import plot_stage
from gudgeon.pipeline.stages.products import STAGES, Product, combined
from gudgeon.pipeline.stages.run_report import Progress, RunReport, StageReport
from gudgeon.pipeline.stages.status import remember
from gudgeon.solver.errors import SceneError
from gudgeon.solver.result import Result

EDGE_SHARE = 1e-3
"""Share of a contact's impulse at the edge of its interface from which a run says so."""
if TYPE_CHECKING:
    pass


def run_job(job: Job, until: str = "plot", progress: Progress | None = None) -> RunReport:
    """Bring a job's products up to date; see `run`."""
    tell = progress or (lambda stage, share: None)
    wanted = STAGES[: STAGES.index(until) + 1]
    if until == "plot":
        job.compared()  # What is misspelt there shall not come out after the solver.
    stages: dict[str, StageReport] = {}
    for stage in wanted[:3]:
        stages[stage] = _component_stage(job, stage, tell)
    if "solve" not in wanted:
        remember(job, wanted)
        frequencies, notes = _frequencies(job)
        return RunReport(
            job.name, None, stages, out=str(job.out), notes=notes, frequencies=frequencies if until == "modes" else {}
        )
    with named(job.path, InputError, SceneError):
        stages["solve"], summary = _solve_stage(job, tell)
    pictures, notes, outcome = [], [], Result[summary["result"]]
    if "plot" in wanted and outcome is not Result.DIVERGED:
        stages["plot"], pictures, notes = plot_stage(job, lambda: _draw(job, tell), tell)
    remember(job, wanted)
    notes += law_notes(job.scene) + _step_notes(job, summary["counts"]) + _edge_notes(job, summary["quantities"])
    notes += _frequencies(job)[1]
    return RunReport(
        job.name, summary["result"], stages, summary["quantities"], summary["energy_drift"],
        summary["momentum_residual"], str(job.out), pictures=pictures, notes=notes,
        reason=None if outcome.ok else outcome.value,
    )  # fmt: skip


def _component_stage(job: Job, stage: str, tell: Progress) -> StageReport:
    start, ran, keys = time.perf_counter(), False, []
    for name, steps in job.components().items():
        for step, product in steps.items():
            if product.stage != stage or (step == "mesh" and product.key == steps["base-mesh"].key):
                continue
            keys.append(product.key)
            if job.store.has(product.key):
                continue
            tell(stage, 0.0)
            with named(job.path, InputError, StageError):
                record = _make(job, name, step, steps)
            job.store.put(product.key, product.kind, record, product.inputs)
            ran = True
    tell(stage, 1.0)
    return StageReport("ran" if ran else "fresh", time.perf_counter() - start, combined(keys))


def _make(job: Job, name: str, step: str, steps: dict[str, Product]) -> Any:
    """Make one record of a component. Heavy imports live here, where they are needed."""
    component = job.scene.component[name]
    if step == "base-mesh":
        from gudgeon.pipeline.stages.mesh import build_mesh

        return build_mesh(component, job.folder, name)
    from gudgeon.pipeline.design import morph
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
    if movement is None or component.change.rung == "recompute":
        return morph.own_modes(*keys, modal, "none" if movement is None else "recompute")
    assert component.material is not None
    surfaces = {key: item.surface for key, item in component.interface.items()}
    return morph.reuse(base, keys, modal, surfaces, movement, component.material.rho)


def _solve_stage(job: Job, tell: Progress) -> tuple[StageReport, dict[str, Any]]:
    from gudgeon.pipeline.stages.summary import read_summary, reference_values, write_summary

    start, product = time.perf_counter(), job.trajectory()
    expected = reference_values(job.scene.report, job.folder)
    ran = _trajectory(job, tell)
    summary = read_summary(job.out, product.key, expected)
    if summary is None:
        copy_file(job.store.path(product.key), job.out / "trajectory.h5")
        record = job.store.get(product.key, "trajectory", only=["times"])
        summary = write_summary(job.out, product.key, expected, record)
    tell("solve", 1.0)
    return StageReport("ran" if ran else "fresh", time.perf_counter() - start, product.key), summary


def _trajectory(job: Job, tell: Progress) -> bool:
    """Run the solver unless its trajectory stands in the database; returns whether it ran."""
    product = job.trajectory()
    if job.store.has(product.key):
        return False
    from gudgeon.solver.simulate import simulate
    from gudgeon.solver.system.compile import compile_system

    tell("solve", 0.0)
    morphs = {name: steps["morph"].key for name, steps in job.components().items()}
    trajectory = simulate(compile_system(job.store, job.scene, morphs), lambda share: tell("solve", share))
    job.store.put(product.key, product.kind, trajectory, product.inputs)
    return True


def _draw(job: Job, tell: Progress) -> tuple[list[Path], list[str]]:
    """Draw the pictures, after running what they compare the job with."""
    from gudgeon.pipeline.plots import render

    compare = {job.scene.plot.label: job.trajectory().key}
    for name, other in job.compared().items():
        for stage in STAGES[:3]:
            _component_stage(other, stage, tell)
        _trajectory(other, tell)
        compare[name] = other.trajectory().key
    tell("plot", 0.0)
    return render(job.store.root, job.trajectory().key, job.out, job.name, compare if len(compare) > 1 else {})


def _frequencies(job: Job) -> tuple[dict[str, list[dict[str, Any]]], list[str]]:
    """Return the modes of every component with their errors, and where a mesh is too coarse for them."""
    from gudgeon.pipeline.reduction.frequency_table import coarse_notes, frequency_rows, kept_modes

    records = kept_modes(job.store, {name: steps["modes"].key for name, steps in job.components().items()})
    return {name: frequency_rows(record) for name, record in records.items()}, coarse_notes(records)


def _step_notes(job: Job, counts: dict[str, Any]) -> list[str]:
    """Say where a given step was too large for explicit contact and was divided."""
    parts = int(counts.get("substeps", 1))
    if parts < 2:
        return []
    return [f"run.step: {job.scene.run.step:g} s is above 0.2/ω_c, each step was taken in {parts} parts"]


def _edge_notes(job: Job, quantities: dict[str, Any]) -> list[str]:
    """Say where contact reached the edge of an interface that is a part of its surface."""
    notes = []
    for name, contact in job.scene.contact.items():
        share = quantities.get(f"{name}.edge_share", {"value": 0.0})["value"]
        if share > EDGE_SHARE:
            where = f"component.{job.scene.component_of(contact.body)}.interface.{contact.interface}"
            notes.append(f"{share:.1%} of the impulse of {name} is at the edge of {where}; contact may go on beyond it")
    return notes
