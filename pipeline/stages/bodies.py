"""The stages `mesh → modes → morph → solve` of a scene of bodies: what each computes, and what a run reports."""

import contextlib
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gudgeon.modaldb.format.hdf5 import record_bytes
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.records.trajectory import (
    BASIS_REASON,
    COARSE_MESHES,
    NOTES,
    PATCH_POINTS,
    Trajectory,
)
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import csv_text, whole_file, write_text
from gudgeon.pipeline.process.stopping import numbered, stoppable
from gudgeon.pipeline.reduction.estimate_notes import estimate_notes, patch_notes
from gudgeon.pipeline.reduction.impact_notes import impact_notes
from gudgeon.pipeline.scenes.checks import gravity_notes, law_notes, unit_notes
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.base import PLOT
from gudgeon.pipeline.stages.change import change_estimates, change_notes
from gudgeon.pipeline.stages.folder import held, remove_pictures
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.keys.products import STAGES, Product, sensitivity_product
from gudgeon.pipeline.stages.make import check_finite, keep, scene_name
from gudgeon.pipeline.stages.parts import extent_notes, part_sizes, refuse_probes_off
from gudgeon.pipeline.stages.run import SOLVE, Stopped, make_stages, run_job
from gudgeon.pipeline.stages.run_report import TRAJECTORY, Progress, RunReport
from gudgeon.pipeline.stages.summary import SUMMARY, read_summary, reference_values, write_summary
from gudgeon.solver.capabilities import INTEGRATORS, UNTOUCHED
from gudgeon.solver.kernel_cache import compile_beside, is_compiled, uncached_note
from gudgeon.solver.result import Result

if TYPE_CHECKING:
    from gudgeon.modaldb.records.mesh import MeshRecord
    from gudgeon.modaldb.records.modes import ModalRecord, MorphRecord, SensitivityRecord
    from gudgeon.solver.system.system import System

COMPONENT_STAGES = STAGES[:3]
"""Stages of single components, independent of the scene's dynamics."""
PROBES = "probes.csv"
"""Table of what probes read."""
DRIFT = 1e-3
"""Energy drift above which a run gives a note."""
EDGE_SHARE = 1e-3
"""Share of a contact's impulse at the edge of its interface above which a run gives a note."""
COMPILING = "compile '{}', some minutes, once per version"


@contextlib.contextmanager
def during(job: Job, until: str, tell: Progress) -> Iterator[Job]:
    """Give a job whose linked scenes have their records, while a child process compiles its time loop if need be."""
    if until == PLOT:
        job.compared()  # A mistake there must be reported before the solver runs.
    if until not in ("mesh", "modes"):
        for scene in job.linked:
            stage = scene.kind.stages[-1].name
            if not all(scene.store.has(product.key) for product in scene.products([stage]).values()):
                run_job(scene, stage, tell)
    name = job.scene.loop
    if until in COMPONENT_STAGES or job.store.has(job.trajectory().key) or is_compiled(name):
        yield job
        return
    tell(COMPILING.format(name), 0.0)
    child = compile_beside(name)
    try:
        yield replace(job, compilation=child)
    finally:
        if child is not None:
            child.terminate()
            child.wait()


def make_mesh(job: Job, product: Product, tell: Progress) -> "MeshRecord":
    """Return the mesh of a component, as it is built or moved for a design change."""
    from gudgeon.pipeline.stages.mesh import build_mesh, movement_of

    component, steps = job.scene.component[product.name], job.components()[product.name]
    if product.key == steps["base-mesh"].key:
        return build_mesh(component, job.folder, product.name)
    from gudgeon.pipeline.design_change.morph import moved_mesh

    movement = movement_of(component, job.folder, product.name)
    assert movement is not None
    return moved_mesh(job.store.get(steps["base-mesh"].key, "mesh"), movement)


def make_modes(job: Job, product: Product, tell: Progress) -> "ModalRecord":
    """Return the modes of a component. Heavy libraries are imported here, where they are needed."""
    from gudgeon.pipeline.reduction.reduce import reduce_component

    name, key = product.name, job.components()[product.name]["mesh"].key
    mesh = job.store.get(key, "mesh")
    return reduce_component(mesh, key, job.scene.component[name], name, **job.scene.reduced_with(name))


def make_morph(job: Job, product: Product, tell: Progress) -> "MorphRecord":
    """Return the design of a component: its modes, carried over a design change or as they are."""
    from gudgeon.pipeline.design_change import morph
    from gudgeon.pipeline.design_change.design import reused_design
    from gudgeon.pipeline.stages.mesh import movement_of

    name = product.name
    component, steps = job.scene.component[name], job.components()[name]
    movement = movement_of(component, job.folder, name)
    keys = (steps["mesh"].key, steps["modes"].key)
    if movement is None or component.change.update == "recompute":
        needed = ["mass", "centre", "inertia", "rigid_twists", *(f"interfaces/{i}/points" for i in component.interface)]
        modal = job.store.get(keys[1], "modes", only=needed)
        return morph.own_modes(*keys, modal, "none" if movement is None else "recompute")

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
    change_notes(job)


def make_run(job: Job, product: Product, tell: Progress) -> Trajectory:
    """Run the solver once its time loop is compiled; what is still to be waited for is said again, after the modes."""
    if job.compilation is not None and job.compilation.poll() is None:
        tell(COMPILING.format(job.scene.loop), 0.0)
        job.compilation.wait()
    from gudgeon.solver.simulate import simulate

    with stoppable(numbered(tell)) as progress:
        trajectory = simulate(system_of(job), progress)
    if trajectory.result == Result.STOPPED.name:
        raise Stopped(partial(_keep_stopped, job, trajectory))
    return trajectory


def _keep_stopped(job: Job, found: Trajectory) -> RunReport:
    """Write what a stopped run has done into the folder of results: nothing in the database, so that it runs anew."""
    reached = float(found.times[-1]) if len(found.times) else 0.0
    inputs = job.trajectory().inputs | {"stopped": reached}
    product = replace(job.trajectory(), key=(key := content_key(inputs)), inputs=inputs)
    with held(job.out):
        check_finite(product, found)
        with whole_file(job.out / TRAJECTORY) as scratch:
            scratch.write_bytes(b"".join(record_bytes(product.kind, found, inputs)))
        summary = write_summary(job.out, key, _references(job), found, TRAJECTORY)
        _write_probes(job, found)
        removed = remove_pictures(job.out, "")
    duration = job.scene.run.duration
    reason = found.counts.get("reason") or f"{Result.STOPPED.value}, at {reached:.6g} s of {duration:.6g} s"
    notes = [f"pictures of an earlier result were removed: {', '.join(removed)}"] if removed else []
    return RunReport(
        job.name, found.result, quantities=summary["quantities"], energy_drift=found.energy_drift,
        momentum_residual=found.momentum_residual, out=str(job.out), notes=notes, reason=reason, files=_files(job),
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
    frequencies, notes = _frequencies(job)
    keys = {name: steps["mesh"].key for name, steps in job.components().items()}
    extents = extent_notes(job.store, job.used(), keys)
    units = [*job.found, *unit_notes(job.used()), *extents, *gravity_notes(job.scene)]
    if until == "mesh":
        return RunReport(job.name, None, out=str(job.out), notes=units + notes, parts=_parts(job))
    if until == "modes":
        return RunReport(job.name, None, out=str(job.out), notes=units + notes, frequencies=frequencies)
    notes = change_notes(job) + notes
    if until == "morph":
        return RunReport(job.name, None, out=str(job.out), notes=units + notes, changes=change_estimates(job))
    key, expected = job.trajectory().key, _references(job)
    summary = read_summary(job.out, key, TRAJECTORY, expected)
    if summary is None:
        with whole_file(job.out / TRAJECTORY) as scratch:
            job.store.export(key, scratch)
        found = job.store.get(key, "trajectory", only=["times"])
        summary = write_summary(job.out, key, expected, found, TRAJECTORY)
        _write_probes(job, job.store.get(key, "trajectory", only=["times", "probes"]))
    found = _report(job, summary)
    return replace(found, out=str(job.out), notes=units + found.notes + notes, parts=_sizes(job), files=_files(job))


def solved(job: Job) -> RunReport:
    """Return the report of a run as its record has it, without reference values."""
    record = job.store.get(job.trajectory().key, "trajectory", only=["times"])
    names = ("result", "quantities", "energy_drift", "momentum_residual", "estimates", "counts")
    return _report(job, {name: getattr(record, name) for name in names})


def _report(job: Job, summary: dict[str, Any]) -> RunReport:
    """Return the report of a run: its quantities, estimated errors and what is to be said of it."""
    own = law_notes(job.scene) + _step_notes(job, summary["counts"]) + _edge_notes(job, summary["quantities"])
    own += _energy_notes(job, summary)
    if summary["result"] == Result.FINISHED.name:
        own += _gap_notes(job, summary["quantities"])
    own += _probe_notes(job)
    for notes_of in NOTES:
        own += str(summary["counts"].get(notes_of, "")).splitlines()
    if summary["result"] == Result.FINISHED.name:
        own += impact_notes(job.scene, summary, partial(_last_force, job))
    windows = (entry["value"] for name, entry in summary["quantities"].items() if name.endswith(".force_window"))
    reason, estimates = summary["counts"].get(BASIS_REASON, ""), summary["estimates"]
    patches = summary["counts"].get(PATCH_POINTS, {})
    own += patch_notes(job.scene, estimates, patches)
    window, coarse = max(windows, default=0.0), summary["counts"].get(COARSE_MESHES, ())
    own += estimate_notes(job.scene, estimates, reason, window, patches=patches, coarse=coarse)
    own += [note for note in [uncached_note()] if note is not None]
    outcome = Result[summary["result"]]
    return RunReport(
        job.name, summary["result"], {}, summary["quantities"], summary["energy_drift"],
        momentum_residual=summary["momentum_residual"], estimates=estimates, notes=own,
        changes=change_estimates(job), reason=None if outcome.ok else summary["counts"].get("reason", outcome.value),
    )  # fmt: skip


def _write_probes(job: Job, found: Trajectory) -> None:
    """Write the histories of probes as a table; without probes, remove that of an earlier run."""
    if not found.probes:
        (job.out / PROBES).unlink(missing_ok=True)
        return
    heads, columns = ["time [s]"], [found.times[:, None]]
    for name, probe in found.probes.items():
        parts = probe.columns.split(", ")
        units = probe.unit.split(", ") if ", " in probe.unit else [probe.unit, probe.unit]
        heads += [f"{name} {part} [{units[part.startswith('moment')]}]" for part in parts]
        columns.append(probe.values)
    rows = np.hstack(columns)
    write_text(job.out / PROBES, csv_text([heads, *([repr(float(one)) for one in row] for row in rows)]))


def _files(job: Job) -> tuple[str, ...]:
    """Return the names of the result files beside the pictures."""
    return SUMMARY, TRAJECTORY, *((PROBES,) if job.scene.probe else ())


def _probe_notes(job: Job) -> list[str]:
    """Return a note for each probe that reads a point beside the one asked for."""
    if not job.scene.probe:
        return []
    found = job.store.get(job.trajectory().key, "trajectory", only=["times", "probes"]).probes
    return [
        f"probe.{name}.at: the nearest point of its interface is read, {probe.snapped:.3g} m away"
        for name, probe in found.items()
        if probe.snapped > 0
    ]


def draw(job: Job, tell: Progress) -> tuple[list[Path], list[str]]:
    """Draw the pictures, after running the jobs that they compare this one with."""
    from gudgeon.pipeline.plots import render

    compare = {job.scene.plot.label: job.trajectory().key}
    for name, other in job.compared().items():
        make_stages(other, SOLVE, tell)
        compare[name] = other.trajectory().key
    tell("plot", 0.0)
    others, curve = compare if len(compare) > 1 else {}, job.reference()
    return render(
        job.store.location, job.trajectory().key, job.out, job.name, others, reference=curve, tell=tell
    )  # fmt: skip


def _frequencies(job: Job) -> tuple[dict[str, list[dict[str, Any]]], list[str]]:
    """Return the modes of every component with their errors, and notes on coarse meshes and parted groups of modes."""
    from gudgeon.pipeline.reduction.beam_notes import beam_notes
    from gudgeon.pipeline.stages.notes.frequencies import coarse_notes, frequency_rows, kept_modes, parted_notes

    records = kept_modes(job.store, {name: steps["modes"].key for name, steps in job.components().items()})
    files = [name for name in records if job.scene.component[name].from_file]
    counts = {name: job.scene.component[name].modes.model_dump() for name in records}
    notes = coarse_notes(records, files) + parted_notes(records, counts) + beam_notes(job.scene.component, records)
    return {name: frequency_rows(record) for name, record in records.items()}, notes


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


def _step_notes(job: Job, counts: dict[str, Any]) -> list[str]:
    """Return a note if a given step exceeded the limit of the integrator and was divided."""
    parts = int(counts.get("substeps", 1))
    if parts < 2:
        return []
    name, critical = counts["integrator"], counts["critical_frequency"]
    factor = INTEGRATORS[name].largest if job.scene.contact else min(INTEGRATORS[name].largest, UNTOUCHED)
    if math.ceil(job.scene.run.step * critical / factor * (1 - 1e-12)) < parts:
        factor = INTEGRATORS[name].sticking
    limit = f"{factor:g}/ω_c" + (f" = {factor / critical:.3g} s" if critical > 0 else "")
    effect = f"each step was divided into {parts} substeps"
    if INTEGRATORS[name].own_steps:
        effect = "the integrator chose its steps by run.accuracy instead"
        if math.isinf(factor):
            return [f"run.step: {job.scene.run.step:g} s given; integrator '{name}' steps by run.accuracy instead"]
    return [f"run.step: {job.scene.run.step:g} s exceeds the limit of integrator '{name}', {limit}; {effect}"]


def _energy_notes(job: Job, summary: dict[str, Any]) -> list[str]:
    """Return a note where the energy balance of a finished run has a noticeable error."""
    drift, name, run = summary["energy_drift"], summary["counts"]["integrator"], job.scene.run
    if drift <= DRIFT or summary["result"] != Result.FINISHED.name:
        return []
    way = "reduce run.step" if run.step is not None else "reduce run.accuracy"
    if run.step is None and not run.checks and not INTEGRATORS[name].own_steps:
        way = "set run.checks = true, so that the step is controlled, or a smaller run.step"
    return [f"the energy balance has an error of {drift:.2%} of the energy exchanged (integrator '{name}'); {way}"]


def _gap_notes(job: Job, quantities: dict[str, Any]) -> list[str]:
    """Return a note where no contact touched, with the smallest gap."""
    gaps = {name: quantities.get(f"{name}.least_gap") for name in job.scene.contact}
    open_ones = {name: gap["value"] for name, gap in gaps.items() if gap is not None}
    if not open_ones or len(open_ones) < len(gaps):
        return []
    name = min(open_ones, key=lambda one: open_ones[one])
    time = quantities[f"{name}.least_gap_time"]["value"]
    return [
        f"no contact touched; the smallest gap was {open_ones[name]:.3g} m, of contact {name} at {time:.3g} s; if a"
        " contact is expected, increase run.duration, or change the positions or velocities of the bodies"
    ]


def _last_force(job: Job, contact: str) -> float:
    """Return the size of a contact's force in the last sample of the run over that of its largest one."""
    record = job.store.get(job.trajectory().key, "trajectory", only=[f"contacts/{contact}/force"])
    sizes = np.linalg.norm(record.contacts[contact].force, axis=1)
    return float(sizes[-1] / sizes.max()) if sizes.any() else 0.0


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
