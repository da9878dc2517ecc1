"""`gudgeon report` of a scene without contact: frequencies of its components on meshes of several sizes.

The error of a frequency is against the scene's reference, or else against the finest mesh. The table also has the
estimate of the error that each run makes without a reference.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.report.budget.mesh_edges import mean_edge
from gudgeon.pipeline.report.choice import choose, judged, keep_report, on_its_mesh
from gudgeon.pipeline.report.convergence import Neighbour, chain, extrapolated, settling
from gudgeon.pipeline.report.document import MISSING, Budget, Chain, Document, Errors, Quantity, Run, Table, Term
from gudgeon.pipeline.report.effort import Effort, new_document
from gudgeon.pipeline.report.front import with_front
from gudgeon.pipeline.report.page.output import report_folder, write_report
from gudgeon.pipeline.report.page.words import NOTHING, error_text, size_text
from gudgeon.pipeline.report.reference import Reference, check_names, external_reference, largest
from gudgeon.pipeline.report.sweep import Setting, able_settings, reason, settings_of
from gudgeon.pipeline.report.timing import Prepared, prepared
from gudgeon.pipeline.stages.folder import held
from gudgeon.pipeline.stages.job import Job, variant
from gudgeon.pipeline.stages.notes.facts import FIELDS
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.run_report import Progress

FACTORS = (2.0, 1.4, 1.0, 0.7)
"""Edge lengths of the default sweep, relative to that of the scene."""
FITTED = 3
"""Smallest number of meshes for which an order is fitted."""
TIMING = (
    "CPU time of mesh and modes with an empty database on one thread, least of {repeat} sequential runs. Warm: with all"
    " records present."
)


@dataclass(frozen=True)
class Meshed:
    """A setting with the modes of its components."""

    setting: Setting
    taken: Prepared
    dofs: int
    """Dofs of all nodes, supported ones included."""
    edges: dict[str, float]
    """Mean edge length of each component's mesh [m]."""
    frequencies: dict[str, float]
    """Name, `COMPONENT.frequency1` and so on → frequency [Hz]."""
    estimates: dict[str, float]
    """Name of a frequency → relative error as the run estimates it, where it can."""
    cells: str


def frequencies_report(job: Job, how: Effort, progress: Progress) -> Document:
    """Compare meshes, write `report.{json,csv,png,html}` into the job's folder, and store the report in the database.

    Raises:
        InputError: a setting of the scene is wrong, or its reference has an unknown frequency.
        StageError: no setting ran.
    """
    with report_folder(job.out, job.name):
        reference = external_reference(job, [])
        meshes, left_out = _meshes(job, how.repeat, progress)
        if reference is None or not reference.expected:
            name = meshes[-1].setting.name
            reference = Reference("finest", f"the finest mesh: {name}", meshes[-1].frequencies, None, None)
        check_names(job, reference, meshes[-1].frequencies, meshes[-1].frequencies)
        found = [_quantity(job, name, meshes, reference) for name in meshes[-1].frequencies]
        counting = {one.name for one in found if one.counts}
        runs = with_front([_run(one, reference, counting) for one in meshes], counting, reference.kind == "finest")
        choice = choose(runs, how.tolerance)
        budget = _budget(judged(runs, choice), found, reference.kind != "finest")
        document = replace(
            new_document(job, how),
            reference={"kind": reference.kind, "source": reference.source},
            quantities=found,
            runs=runs,
            left_out=left_out,
            choice=on_its_mesh(choice, runs, budget, how.same_mesh),
            budget=budget,
            tables=[_table(found, meshes, reference)],
            timing=TIMING.format(repeat=how.repeat),
        )
        keep_report(job, document)
        with held(job.out):
            write_report(document, job.out)
        progress("report", 1.0)
        return document


def _meshes(job: Job, repeat: int, progress: Progress) -> tuple[list[Meshed], list[dict[str, str]]]:
    """Return the settings that have modes, coarse to fine, and the others with the reason."""
    able, left_out = able_settings(job, sizes_of(job))
    meshes = []
    for number, setting in enumerate(able):
        progress(f"setting {number + 1} of {len(able)}", number / len(able))
        try:
            meshes.append(_meshed(job, setting, repeat))
        except (InputError, StageError) as error:
            if setting.named and isinstance(error, InputError):
                raise
            left_out.append({"name": setting.name, "why": reason(job, error)})
    if not meshes:
        raise StageError(f"{job.path}: report: no mesh gives modes: {'; '.join(one['why'] for one in left_out)}")
    return sorted(meshes, key=lambda one: one.dofs), left_out


def sizes_of(job: Job) -> list[Setting]:
    """Return the settings of `report.models` and `report.sweep`, or else the scene at several mesh sizes.

    Raises:
        InputError: a path of the sweep is unknown.
    """
    if job.scene.report.models or job.scene.report.sweep:
        return settings_of(job)
    sizes = {name: job.scene.component[name].mesh.size for name in job.components()}
    given = {name: size for name, size in sizes.items() if size is not None}
    if not given:
        return [Setting("as in the scene", {})]
    found = []
    for factor in FACTORS:
        tables = {"component": {name: {"mesh": {"size": factor * size}} for name, size in given.items()}}
        lengths = dict.fromkeys(f"{factor * size * 1e3:.3g}" for size in given.values())
        changes = {} if factor == 1.0 else tables
        found.append(Setting(f"edges of {' and '.join(lengths)} mm", changes, named=factor == 1.0))
    return found


def _meshed(job: Job, setting: Setting, repeat: int) -> Meshed:
    changed = variant(job, setting.changes)
    taken = prepared(changed, repeat)
    run_job(changed, "modes")
    frequencies: dict[str, float] = {}
    estimates: dict[str, float] = {}
    edges, kinds, dofs = {}, {}, 0
    for name, steps in changed.components().items():
        mesh: MeshRecord = changed.store.get(steps["mesh"].key, "mesh")
        if not (cell := cell_of(mesh)).dofs:
            continue
        modes: ModalRecord = changed.store.get(steps["modes"].key, "modes", only=FIELDS)
        edges[name], kinds[cell.name] = mean_edge(mesh), None
        dofs += len(mesh.nodes) * cell.dofs
        errors = modes.discretisation_errors
        for i, omega in enumerate(modes.angular_frequencies[: modes.normal_count]):
            frequencies[f"{name}.frequency{i + 1}"] = float(omega) / (2 * math.pi)
            if errors is not None and np.isfinite(errors[i]):
                estimates[f"{name}.frequency{i + 1}"] = float(errors[i])
    return Meshed(setting, taken, dofs, edges, frequencies, estimates=estimates, cells=", ".join(kinds))


def _errors(one: Meshed, expected: Mapping[str, float]) -> Errors:
    """Return the relative errors of the frequencies that have a reference value."""
    return {name: one.frequencies[name] / value - 1 for name, value in expected.items() if name in one.frequencies}


def _quantity(job: Job, name: str, meshes: Sequence[Meshed], reference: Reference) -> Quantity:
    """Return a frequency as a compared quantity; it counts if it has a reference value."""
    having = [one for one in meshes if name in one.frequencies]
    exact = reference.expected.get(name)
    chains = []
    if len(having) > 1:
        component, last = name.rpartition(".")[0], having[-1].frequencies[name]
        apart = [one.frequencies[name] / last - 1 for one in having]
        values = apart if exact is None else [one.frequencies[name] / exact - 1 for one in having]
        sizes = [one.edges[component] for one in having]
        found = chain("mesh", [one.setting.name for one in having], sizes, values, apart)
        known = exact is not None and reference.kind != "finest"
        chains.append(replace(found, order=observed_order(found)) if known else found)
    settles, why = settling(name, chains)
    interest = job.scene.report.interest
    counts = exact is not None and (not interest or name in interest)
    counts = counts and not (reference.kind == "finest" and settles is False)
    return Quantity(name, "Hz", "relative", exact, counts=counts, converges=settles, why=why, chains=chains)


def _run(one: Meshed, reference: Reference, counting: set[str]) -> Run:
    errors = _errors(one, reference.expected)
    worst, size = largest(errors, counting)
    cold = [stage.cold for name, stage in one.taken.stages.items() if name in ("mesh", "modes") and stage.cold]
    return Run(
        one.setting.name, "reduced", one.cells, one.setting.changes, one.dofs, "FINISHED",
        errors=errors, largest_error=size, largest_of=worst,
        truncation_against="every mesh has the same number of modes", time_against="modes have no time step",
        factorisations=one.taken.factorisations, cpu_seconds=sum(taken.cpu for taken in cold),
        wall_seconds=sum(taken.wall for taken in cold),
        stages={name: stage for name, stage in one.taken.stages.items() if name in ("mesh", "modes")},
        peak_mib=one.taken.peak_mib,
    )  # fmt: skip


def _budget(run: Run | None, quantities: Sequence[Quantity], independent: bool) -> Budget | None:
    """Return the error of the mesh of a run from the next finer and the next coarser mesh of the report.

    Args:
        independent: Whether the reference is none of the meshes, so that errors against it are those of the mesh.
    """
    if run is None:
        return None
    errors, orders = {}, {}
    for one in quantities:
        chains = [chain for chain in one.chains if run.name in chain.runs]
        if not chains or len(chains[0].runs) < 2:
            continue
        found, at = chains[0], chains[0].runs.index(run.name)
        own = 1 + found.differences[at]
        sides = {
            side: Neighbour(found.sizes[at + side] / found.sizes[at], (1 + found.differences[at + side]) / own - 1)
            for side in (1, -1)
            if 0 <= at + side < len(found.runs) and side * (found.sizes[at] - found.sizes[at + side]) > 0
        }
        if not sides:
            continue
        estimate = extrapolated(sides.get(1), sides.get(-1))
        known = run.errors.get(one.name) if independent else None
        errors[one.name] = estimate.error if known is None else abs(known)
        orders |= {} if estimate.order is None else {one.name: estimate.order}
    of, size = largest(errors, {one.name for one in quantities if one.counts})
    if not errors:
        return Budget(run.name, [Term("mesh", f"{MISSING}: the report has one mesh only")])
    how = "error against the reference where there is one; else " if independent else ""
    how += "the next finer and the next coarser mesh of the report, extrapolated with the observed order"
    return Budget(run.name, [Term("mesh", how, errors, orders, size, of)])


def observed_order(found: Chain) -> float | None:
    """Return the order of a chain's errors in the edge length, None where none can be fitted."""
    errors = np.abs(found.values)
    if found.converges is not True or len(errors) < FITTED or not (errors > 0).all():
        return None
    return float(np.polyfit(np.log(found.sizes), np.log(errors), 1)[0])


def _table(found: Sequence[Quantity], meshes: Sequence[Meshed], reference: Reference) -> Table:
    rows = []
    for one in found:
        order = one.chains[0].order if one.chains else None
        cells = []
        for mesh in meshes:
            errors = _errors(mesh, reference.expected)
            cells.append(f"{error_text(errors.get(one.name))} / {size_text(mesh.estimates.get(one.name))}")
        value = meshes[-1].frequencies[one.name] if one.reference is None else one.reference
        rows.append(
            [one.name, f"{value:.6g}{'' if one.reference is not None else ' (finest)'}",
             NOTHING if order is None else f"{order:.1f}", *cells]
        )  # fmt: skip
    columns = ["frequency", "reference [Hz]", "order", *(mesh.setting.name for mesh in meshes)]
    note = (
        "Error / error as estimated by the run itself; the order is that of the error in the mean edge length. Modes"
        " are compared by number; on a coarse mesh their sequence may differ."
    )
    return Table("Frequencies: error and estimate", columns, rows, note)
