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
from gudgeon.pipeline.report.convergence import Estimate, Neighbour, chain, extrapolated, settling
from gudgeon.pipeline.report.document import (
    MISSING,
    Budget,
    Chain,
    Document,
    Errors,
    Quantity,
    Run,
    Table,
    Term,
    counted_names,
)  # fmt: skip
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
        compared = [_quantity(job, name, meshes, reference) for name in meshes[-1].frequencies]
        names = counted_names(compared)
        runs = with_front([_run(m, reference, names) for m in meshes], names, reference.kind == "finest")
        choice = choose(runs, how.tolerance)
        budget = _budget(judged(runs, choice), compared, reference.kind != "finest")
        document = replace(
            new_document(job, how),
            reference={"kind": reference.kind, "source": reference.source},
            quantities=compared,
            runs=runs,
            left_out=left_out,
            choice=on_its_mesh(choice, runs, budget, how.same_mesh),
            budget=budget,
            tables=[_table(compared, meshes, reference)],
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
    for i, setting in enumerate(able):
        progress(f"setting {i + 1} of {len(able)}", i / len(able))
        try:
            meshes.append(_meshed(job, setting, repeat))
        except (InputError, StageError) as error:
            if setting.named and isinstance(error, InputError):
                raise
            left_out.append({"name": setting.name, "why": reason(job, error)})
    if not meshes:
        raise StageError(f"{job.path}: report: no mesh gives modes: {'; '.join(entry['why'] for entry in left_out)}")
    return sorted(meshes, key=lambda m: m.dofs), left_out


def sizes_of(job: Job) -> list[Setting]:
    """Return the settings of `report.models` and `report.sweep`, or else the scene at several mesh sizes.

    Raises:
        InputError: a path of the sweep is unknown.
    """
    if job.scene.report.models or job.scene.report.sweep:
        return settings_of(job)
    sizes = {name: job.scene.component[name].mesh.size for name in job.components()}
    edge_lengths = {name: size for name, size in sizes.items() if size is not None}
    if not edge_lengths:
        return [Setting("as in the scene", {})]
    settings = []
    for factor in FACTORS:
        tables = {"component": {name: {"mesh": {"size": factor * size}} for name, size in edge_lengths.items()}}
        lengths = dict.fromkeys(f"{factor * size * 1e3:.3g}" for size in edge_lengths.values())
        changes = {} if factor == 1.0 else tables
        settings.append(Setting(f"edges of {' and '.join(lengths)} mm", changes, named=factor == 1.0))
    return settings


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


def _errors(meshed: Meshed, expected: Mapping[str, float]) -> Errors:
    """Return the relative errors of the frequencies that have a reference value."""
    return {
        name: meshed.frequencies[name] / value - 1 for name, value in expected.items() if name in meshed.frequencies
    }


def _quantity(job: Job, name: str, meshes: Sequence[Meshed], reference: Reference) -> Quantity:
    """Return a frequency as a compared quantity; it counts if it has a reference value."""
    having = [m for m in meshes if name in m.frequencies]
    exact = reference.expected.get(name)
    chains = []
    if len(having) > 1:
        component, finest = name.rpartition(".")[0], having[-1].frequencies[name]
        deviations = [m.frequencies[name] / finest - 1 for m in having]
        values = deviations if exact is None else [m.frequencies[name] / exact - 1 for m in having]
        sizes = [m.edges[component] for m in having]
        mesh_chain = chain("mesh", [m.setting.name for m in having], sizes, values, deviations)
        independent = exact is not None and reference.kind != "finest"
        chains.append(replace(mesh_chain, order=observed_order(mesh_chain)) if independent else mesh_chain)
    settles, why = settling(name, chains)
    interest = job.scene.report.interest
    counts = exact is not None and (not interest or name in interest)
    counts = counts and not (reference.kind == "finest" and settles is False)
    return Quantity(name, "Hz", "relative", exact, counts=counts, converges=settles, why=why, chains=chains)


def _run(meshed: Meshed, reference: Reference, counting: set[str]) -> Run:
    errors = _errors(meshed, reference.expected)
    worst, size = largest(errors, counting)
    cold = [stage.cold for name, stage in meshed.taken.stages.items() if name in ("mesh", "modes") and stage.cold]
    return Run(
        meshed.setting.name, "reduced", meshed.cells, meshed.setting.changes, meshed.dofs, "FINISHED",
        errors=errors, largest_error=size, largest_of=worst,
        truncation_against="every mesh has the same number of modes", time_against="modes have no time step",
        factorisations=meshed.taken.factorisations, cpu_seconds=sum(taken.cpu for taken in cold),
        wall_seconds=sum(taken.wall for taken in cold),
        stages={name: stage for name, stage in meshed.taken.stages.items() if name in ("mesh", "modes")},
        peak_mib=meshed.taken.peak_mib,
    )  # fmt: skip


def _budget(run: Run | None, quantities: Sequence[Quantity], independent: bool) -> Budget | None:
    """Return the error of the mesh of a run from the next finer and the next coarser mesh of the report.

    Args:
        independent: Whether the reference is none of the meshes, so that errors against it are those of the mesh.
    """
    if run is None:
        return None
    errors, orders = {}, {}
    for quantity in quantities:
        estimate = _mesh_estimate(quantity, run.name)
        if estimate is not None:
            against = run.errors.get(quantity.name) if independent else None
            errors[quantity.name] = estimate.error if against is None else abs(against)
            orders |= {} if estimate.order is None else {quantity.name: estimate.order}
    if not errors:
        return Budget(run.name, [Term("mesh", f"{MISSING}: the report has one mesh only")])
    of, size = largest(errors, counted_names(quantities))
    how = "error against the reference where there is one; else " if independent else ""
    how += "the next finer and the next coarser mesh of the report, extrapolated with the observed order"
    return Budget(run.name, [Term("mesh", how, errors, orders, size, of)])


def _mesh_estimate(quantity: Quantity, run: str) -> Estimate | None:
    """Return the error of a quantity on a mesh, from those next to it; None where the report has no other mesh."""
    chain = next((chain for chain in quantity.chains if run in chain.runs), None)
    if chain is None:
        return None
    row, sizes, values = chain.runs.index(run), chain.sizes, [1 + difference for difference in chain.differences]
    sides = {
        side: Neighbour(sizes[row + side] / sizes[row], values[row + side] / values[row] - 1)
        for side in (1, -1)
        if 0 <= row + side < len(sizes) and side * (sizes[row] - sizes[row + side]) > 0
    }
    return extrapolated(sides.get(1), sides.get(-1)) if sides else None


def observed_order(mesh_chain: Chain) -> float | None:
    """Return the order of a chain's errors in the edge length, None where none can be fitted."""
    errors = np.abs(mesh_chain.values)
    if mesh_chain.converges is not True or len(errors) < FITTED or not (errors > 0).all():
        return None
    return float(np.polyfit(np.log(mesh_chain.sizes), np.log(errors), 1)[0])


def _table(compared: Sequence[Quantity], meshes: Sequence[Meshed], reference: Reference) -> Table:
    rows = []
    for q in compared:
        order = q.chains[0].order if q.chains else None
        cells = []
        for mesh in meshes:
            errors = _errors(mesh, reference.expected)
            cells.append(f"{error_text(errors.get(q.name))} / {size_text(mesh.estimates.get(q.name))}")
        value = meshes[-1].frequencies[q.name] if q.reference is None else q.reference
        rows.append(
            [q.name, f"{value:.6g}{'' if q.reference is not None else ' (finest)'}",
             NOTHING if order is None else f"{order:.1f}", *cells]
        )  # fmt: skip
    columns = ["frequency", "reference [Hz]", "order", *(mesh.setting.name for mesh in meshes)]
    note = (
        "Error / error as estimated by the run itself; the order is that of the error in the mean edge length. Modes"
        " are compared by number; on a coarse mesh their sequence may differ."
    )
    return Table("Frequencies: error and estimate", columns, rows, note)
