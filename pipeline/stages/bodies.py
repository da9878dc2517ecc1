"""The stages `mesh → modes → morph → solve` of a scene of bodies: what each computes, and what a run reports."""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gudgeon.modaldb.format.hdf5 import record_bytes
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.records.trajectory import NOT_ESTIMATED, Trajectory
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import csv_text, whole_file, write_text
from gudgeon.pipeline.process.stopping import numbered, stoppable
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.base import PLOT
from gudgeon.pipeline.stages.change import change_estimates, refuse_reuse
from gudgeon.pipeline.stages.folder import Kept, held, remove_pictures
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.keys.products import DESIGNS, STAGES, Product, sensitivity_product
from gudgeon.pipeline.stages.make import check_finite, keep, scene_name
from gudgeon.pipeline.stages.notes.facts import facts_of
from gudgeon.pipeline.stages.notes.frequencies import frequency_rows
from gudgeon.pipeline.stages.notes.registry import notes, run_notes
from gudgeon.pipeline.stages.parts import part_sizes, refuse_probes_off
from gudgeon.pipeline.stages.run import SOLVE, Stopped, make_stages, run_job
from gudgeon.pipeline.stages.run_report import TRAJECTORY, Progress, RunReport
from gudgeon.pipeline.stages.summary import SUMMARY, read_summary, reference_values, write_summary
from gudgeon.solver.registry import unestimated
from gudgeon.solver.result import Result

if TYPE_CHECKING:
    from gudgeon.modaldb.records.mesh import MeshRecord
    from gudgeon.modaldb.records.modes import ModalRecord, MorphRecord, SensitivityRecord
    from gudgeon.solver.system.system import System

COMPONENT_STAGES = STAGES[:3]
"""Stages of single components, independent of the scene's dynamics."""
PROBES = "probes.csv"
"""Table of what probes read."""


@contextlib.contextmanager
def during(job: Job, until: str, tell: Progress) -> Iterator[Job]:
    """Give a job whose linked scenes have their records."""
    if until == PLOT:
        job.compared()  # A mistake there must be reported before the solver runs.
    if until not in ("mesh", "modes"):
        for scene in job.linked:
            stage = scene.kind.stages[-1].name
            if not all(scene.store.has(product.key) for product in scene.products([stage]).values()):
                run_job(scene, stage, tell)
    yield job


def make_mesh(job: Job, product: Product, tell: Progress) -> "MeshRecord":
    """Return the mesh of a component, as it is built or moved for a design change."""
    from gudgeon.pipeline.stages.mesh import build_mesh, movement_of

    component, steps = job.scene.component[product.name], job.components()[product.name]
    if product.key == steps["base-mesh"].key:
        return build_mesh(component, job.folder, product.name, tell=tell)
    from gudgeon.pipeline.design_change.morph import moved_mesh

    moved = [(component, "profile")] if product.key == steps["mesh"].key else []
    moved += [(d, f"{DESIGNS}.{n}") for n, d in enumerate(component.stored_designs)
              if product.key == steps[f"{DESIGNS}.{n} mesh"].key]  # fmt: skip
    movement = movement_of(moved[0][0], job.folder, product.name, moved[0][1])
    assert movement is not None
    return moved_mesh(job.store.get(steps["base-mesh"].key, "mesh"), movement)


def make_modes(job: Job, product: Product, tell: Progress) -> "ModalRecord":
    """Return the modes of a component. Heavy libraries are imported here, where they are needed."""
    from gudgeon.pipeline.reduction.designs import method_of
    from gudgeon.pipeline.reduction.reduce import reduce_component

    name, component = product.name, job.scene.component[product.name]
    steps, requested, method = job.components()[name], job.scene.reduced_with(name), None
    for n, design in enumerate(component.stored_designs):
        if product.key == steps[f"{DESIGNS}.{n} modes"].key:
            component = design
    if DESIGNS in product.inputs:
        stored = [
            (steps[f"{DESIGNS}.{n} mesh"].key, steps[f"{DESIGNS}.{n} modes"].key)
            for n in range(len(component.stored_designs))
        ]
        method = method_of(job.store, stored, component, name, **requested)
    mesh = job.store.get(key := product.inputs["mesh"], "mesh")
    return reduce_component(mesh, key, component, name, **requested, method=method)


def make_morph(job: Job, product: Product, tell: Progress) -> "MorphRecord":
    """Return the design of a component: its modes, carried over a design change or as they are."""
    from gudgeon.pipeline.design_change import morph
    from gudgeon.pipeline.design_change.design import reused_design
    from gudgeon.pipeline.stages.mesh import movement_of

    name = product.name
    component, steps = job.scene.component[name], job.components()[name]
    movement = movement_of(component, job.folder, name)
    keys = (steps["mesh"].key, steps["modes"].key)
    if movement is None or component.change.update != "reuse":
        needed = ["mass", "centre", "inertia", "rigid_twists", *(f"interfaces/{i}/points" for i in component.interface)]
        modal = job.store.get(keys[1], "modes", only=needed)
        return morph.own_modes(*keys, modal, "none" if movement is None else component.change.update)

    def kept(find: Callable[[], "SensitivityRecord"]) -> "SensitivityRecord":
        derivatives = sensitivity_product(name, steps["modes"])
        if job.store.has(derivatives.key):
            record = job.store.get(derivatives.key, "sensitivity")
        else:
            keep(job.store, derivatives, record := find())
        job.store.note(derivatives.key, scene_name(job), name)
        return record

    base = job.store.get(steps["base-mesh"].key, "mesh")
    return reused_design(job.store, base, keys, component, movement, kept)


def check_run(job: Job) -> None:
    """Raise InputError where references or probes are wrong, or modes are reused beyond their tolerance."""
    _references(job)
    refuse_probes_off(job.store, job.scene, {name: steps["mesh"].key for name, steps in job.components().items()})
    refuse_reuse(job)


def make_run(job: Job, product: Product, tell: Progress) -> Trajectory:
    """Run the solver."""
    from gudgeon.solver.simulate import simulate

    keeper = Kept(job.out, product.key, product.inputs) if job.out.is_dir() else None
    with stoppable(numbered(tell)) as progress:
        trajectory = simulate(system_of(job), progress, keeper)
    if trajectory.result == Result.STOPPED.name:
        raise Stopped(partial(_keep_stopped, job, trajectory))
    if keeper is not None:
        keeper.remove()
    return trajectory


def _keep_stopped(job: Job, trajectory: Trajectory) -> RunReport:
    """Write what a stopped run has done into the folder of results: nothing in the database, so that it goes on."""
    reached = float(trajectory.times[-1]) if len(trajectory.times) else 0.0
    inputs = job.trajectory().inputs | {"stopped": reached}
    product = replace(job.trajectory(), key=(key := content_key(inputs)), inputs=inputs)
    with held(job.out):
        check_finite(product, trajectory)
        with whole_file(job.out / TRAJECTORY) as scratch:
            scratch.write_bytes(b"".join(record_bytes(product.kind, trajectory, inputs)))
        summary = write_summary(job.out, key, _references(job), trajectory, TRAJECTORY)
        _write_probes(job, trajectory)
        removed = remove_pictures(job.out, "")
    duration = job.scene.run.duration
    reason = trajectory.counts.get("reason") or f"{Result.STOPPED.value}, at {reached:.6g} s of {duration:.6g} s"
    lines = [f"pictures of an earlier result were removed: {', '.join(removed)}"] if removed else []
    return RunReport(
        job.name, trajectory.result, quantities=summary["quantities"], energy_drift=trajectory.energy_drift,
        momentum_residual=trajectory.momentum_residual, out=str(job.out), notes=lines, reason=reason, files=_files(job),
    )  # fmt: skip


def system_of(job: Job) -> "System":
    """Return the compiled system of a job whose morphs are in the database; see `compile_system` for errors."""
    from gudgeon.solver.system.compile import compile_system

    return compile_system(job.store, job.scene, job.morphs())


def _references(job: Job) -> dict[str, float]:
    with named(job.path, InputError):
        return reference_values(job.scene.report, job.folder)


def results(job: Job, until: str) -> RunReport:
    """Write summary and trajectory unless they are up to date, and return the report."""
    if until not in ("mesh", "modes"):
        refuse_reuse(job)
    if until in COMPONENT_STAGES:
        report = RunReport(job.name, None, out=str(job.out), notes=notes(facts_of(job), until))
        if until == "mesh":
            return replace(report, parts=_parts(job))
        if until == "modes":
            records = facts_of(job).modes
            return replace(report, frequencies={name: frequency_rows(record) for name, record in records.items()})
        return replace(report, changes=change_estimates(job))
    key, expected = job.trajectory().key, _references(job)
    summary = read_summary(job.out, key, TRAJECTORY, expected)
    if summary is None:
        with whole_file(job.out / TRAJECTORY) as scratch:
            job.store.export(key, scratch)
        trajectory = job.store.get(key, "trajectory", only=["times"])
        summary = write_summary(job.out, key, expected, trajectory, TRAJECTORY)
        _write_probes(job, job.store.get(key, "trajectory", only=["times", "probes"]))
    report = _report(job, summary, notes(facts_of(job, summary), until))
    return replace(report, out=str(job.out), parts=_sizes(job), files=_files(job))


def solved(job: Job) -> RunReport:
    """Return the report of a run as its record has it, without reference values."""
    record = job.store.get(job.trajectory().key, "trajectory", only=["times"])
    names = ("result", "quantities", "energy_drift", "momentum_residual", "estimates", "counts")
    summary = {name: getattr(record, name) for name in names}
    return _report(job, summary, run_notes(facts_of(job, summary)))


def _report(job: Job, summary: dict[str, Any], lines: list[str]) -> RunReport:
    """Return the report of a run: its quantities, estimated errors and notes."""
    outcome = Result[summary["result"]]
    return RunReport(
        job.name, summary["result"], {}, summary["quantities"], summary["energy_drift"],
        momentum_residual=summary["momentum_residual"], estimates=summary["estimates"],
        not_estimated=summary["counts"].get(NOT_ESTIMATED, {}) | unestimated(summary["quantities"]), notes=lines,
        changes=change_estimates(job), reason=None if outcome.ok else summary["counts"].get("reason", outcome.value),
    )  # fmt: skip


def _write_probes(job: Job, trajectory: Trajectory) -> None:
    """Write the histories of probes as a table; without probes, remove that of an earlier run."""
    if not trajectory.probes:
        (job.out / PROBES).unlink(missing_ok=True)
        return
    heads, columns = ["time [s]"], [trajectory.times[:, None]]
    for name, probe in trajectory.probes.items():
        components = probe.columns.split(", ")
        units = probe.unit.split(", ") if ", " in probe.unit else [probe.unit, probe.unit]
        heads += [f"{name} {component} [{units[component.startswith('moment')]}]" for component in components]
        columns.append(probe.values)
    rows = np.hstack(columns)
    write_text(job.out / PROBES, csv_text([heads, *([repr(float(x)) for x in row] for row in rows)]))


def _files(job: Job) -> tuple[str, ...]:
    """Return the names of the result files beside the pictures."""
    return SUMMARY, TRAJECTORY, *((PROBES,) if job.scene.probe else ())


def draw(job: Job, tell: Progress) -> tuple[list[Path], list[str]]:
    """Draw the pictures, after running the jobs that they compare this one with."""
    from gudgeon.pipeline.plots import render

    compare = {job.scene.plot.label: job.trajectory().key}
    for name, job_compared in job.compared().items():
        make_stages(job_compared, SOLVE, tell)
        compare[name] = job_compared.trajectory().key
    tell("plot", 0.0)
    others, curve = compare if len(compare) > 1 else {}, job.reference()
    return render(
        job.store.location, job.trajectory().key, job.out, job.name, others, reference=curve, tell=tell
    )  # fmt: skip


def _parts(job: Job) -> dict[str, dict[str, Any]]:
    """Return size and inertia of every component in use, on the mesh of its modes."""
    from gudgeon.pipeline.stages.parts import part_row

    used = job.used()
    return {
        name: part_row(job.store.get(steps["mesh"].key, "mesh"), used[name], name)
        for name, steps in job.components().items()
    }


def _sizes(job: Job) -> dict[str, dict[str, Any]]:
    keys = {name: (steps["mesh"].key, steps["morph"].key) for name, steps in job.components().items()}
    return part_sizes(job.store, job.used(), keys)
