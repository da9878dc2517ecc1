"""`gudgeon report` of a scene of conductors: error against run time over panels, points of the grid, and splines.

Without poses the runs are meshes, and their errors those of capacitances. With poses a run is a mesh, a grid and a
degree of the splines, and its errors are those of co-energy and force at poses between the points of the grid, against
the finest mesh without interpolation.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gudgeon.pipeline.applications.electrostatics.assessment.levels import (
    CHECKED,
    FACTORS,
    TIMED,
    GridPart,
    Level,
    Truth,
    conditions,
    grid_parts,
    level,
    spacings,
    truth,
)
from gudgeon.pipeline.applications.electrostatics.job import FieldJob
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.process.clock import Seconds
from gudgeon.pipeline.report.choice import choose, judged
from gudgeon.pipeline.report.convergence import chain, settling
from gudgeon.pipeline.report.document import Budget, Chain, Document, Quantity, Run, StageSeconds, Table, Term
from gudgeon.pipeline.report.effort import Effort, new_document
from gudgeon.pipeline.report.front import with_front
from gudgeon.pipeline.report.page.output import report_folder, write_report
from gudgeon.pipeline.stages.folder import held
from gudgeon.pipeline.stages.run_report import Progress

DEGREES = {1: "linear", 3: "cubic", 5: "quintic"}
SOLVER = 3
"""Degree of the splines of runs; others are compared only."""
ENERGY, FORCE, TORQUE = "co_energy", "force", "torque"
UNITS = {ENERGY: "J", FORCE: "N", TORQUE: "N m"}
TIMING = "CPU time of panels, integrals and solution of a mesh, the shortest of {repeat} runs"
POSES_TIMING = "; of a grid its poses times that of one, the mean of {timed}, are added"


def report_field(job: FieldJob, how: Effort, progress: Progress) -> Document:
    """Compare meshes, grids and splines, and write `report.{json,csv,png,html}` into the job's folder.

    Raises:
        InputError: the scene is wrong, or its own grid would take too long.
        StageError: a numerical routine failed.
    """
    with report_folder(job.out, job.name):
        levels, left_out = _levels(job, how.repeat, progress)
        document_of = _of_poses if job.scene.poses is not None else _of_places
        document = document_of(
            replace(new_document(job, how), kind=job.kind.name, left_out=left_out), job, levels, progress
        )
        runs = with_front(document.runs)
        timing = TIMING.format(repeat=how.repeat) + ("" if job.scene.poses is None else POSES_TIMING)
        document = replace(
            document, runs=runs, choice=choose(runs, how.tolerance), timing=f"{timing.format(timed=TIMED)}."
        )
        if job.scene.poses is not None:
            best = judged(runs, document.choice or choose(runs, how.tolerance))
            document = replace(document, budget=_budget(document, best))
        with held(job.out):
            write_report(document, job.out)
    progress("report", 1.0)
    return document


def _levels(job: FieldJob, repeat: int, progress: Progress) -> tuple[list[Level], list[dict[str, str]]]:
    """Solve every mesh, the coarsest first; another one than the scene's that cannot be solved is omitted."""
    levels, left_out = list[Level](), list[dict[str, str]]()
    for n, factor in enumerate(FACTORS):
        progress(f"mesh {n + 1} of {len(FACTORS)}", n / len(FACTORS))
        try:
            # What is loaded on first use does not count.
            solved = level(job, factor, repeat if levels else repeat + 1, progress)
        except InputError as error:
            if factor == 1.0:
                raise
            left_out.append({"name": f"edges × {factor:g}", "why": str(error).partition(": ")[2] or str(error)})
            continue
        if not levels or solved.panels > levels[-1].panels:
            levels.append(solved)
        elif factor == 1.0:
            levels[-1] = solved
    return levels, left_out


def _of_places(document: Document, job: FieldJob, levels: Sequence[Level], progress: Progress) -> Document:
    """Return the report of conductors in their places."""
    finest = levels[-1]
    expected = job.expected
    names = list(expected) or [name for name in finest.record.quantities if name.endswith(("capacitance", ENERGY))]
    reference = expected or {name: finest.record.quantities[name]["value"] for name in names}
    runs, sizes = list[Run](), [float(m.panels) for m in levels]
    for mesh in levels:
        errors = {name: _relative(mesh.record.quantities[name]["value"], reference[name]) for name in names}
        errors = {} if mesh is finest and not expected and len(levels) > 1 else errors
        runs.append(_run(f"{mesh.panels} panels", "meshes", mesh.changes, mesh, errors, mesh.seconds))
    quantities = []
    for name in names:
        unit = finest.record.quantities[name]["unit"]
        values = [_relative(m.record.quantities[name]["value"], reference[name]) for m in levels]
        chains = [chain("basis", [run.name for run in runs], sizes, values, [e - values[-1] for e in values])]
        settles, why = settling(name, chains)
        value = expected.get(name)
        quantities.append(Quantity(name, unit, "relative", value, True, settles, why=why, chains=chains))
    kind, source = ("published", f"{job.scene.report.reference}") if expected else ("finest", f"{finest.panels} panels")
    return replace(
        document, quantities=quantities, runs=runs, reference={"kind": kind, "source": source},
        tables=[_estimates(levels)],
    )  # fmt: skip


def _relative(value: float, reference: float) -> float:
    return value / reference - 1 if reference else value


def _of_poses(document: Document, job: FieldJob, levels: Sequence[Level], progress: Progress) -> Document:
    """Return the report of a grid of poses."""
    finest = truth(levels[-1], progress)
    runs, quantities, left_out = list[Run](), _quantities(job, finest), list(document.left_out)
    by_panels, by_grid = list[tuple[Level, dict[str, float]]](), list[tuple[GridPart, dict[str, float]]]()
    for mesh in levels:
        exact = finest if mesh is levels[-1] else truth(mesh, progress)
        by_panels.append((mesh, _apart(job, (exact.energies, exact.forces), finest)))
        if mesh.factor < 1.0:
            continue
        try:
            grids = list(grid_parts(mesh, progress))
        except InputError as error:
            if mesh.factor == 1.0:
                raise
            left_out.append({"name": f"grid of {mesh.panels} panels", "why": str(error)})
            continue
        for grid in grids:
            for degree in DEGREES:
                interpolated = grid.interpolated(degree, finest.poses)
                errors = _apart(job, interpolated, exact)
                runs.append(_spline_run(grid, degree, _apart(job, interpolated, finest), (by_panels[-1][1], errors)))
                if degree == SOLVER and mesh.factor == 1.0:
                    by_grid.append((grid, errors))
    quantities = [_with_chains(q, by_panels, by_grid) for q in quantities]
    notes = ["Nothing is charged in the scene: errors are those with 1 V on what moves."] if conditions(job)[2] else []
    source = f"{levels[-1].panels} panels, {CHECKED} poses between the points of the grid, without interpolation"
    tables = [_estimates(levels), _cells(by_grid)]
    return replace(
        document, quantities=quantities, runs=runs, reference={"kind": "finest", "source": source}, tables=tables,
        left_out=left_out, notes=notes,
    )  # fmt: skip


def _quantities(job: FieldJob, finest: Truth) -> list[Quantity]:
    values = _parts(job, (finest.energies, finest.forces))
    return [
        Quantity(name, UNITS[name], "L2", float(np.linalg.norm(value)), True, None, why="", chains=[])
        for name, value in values.items()
        if value.any()
    ]


def _parts(job: FieldJob, values: tuple[np.ndarray, np.ndarray]) -> dict[str, np.ndarray]:
    grid = job.grid()
    assert grid is not None
    moves = np.array(grid.numbers) < 3
    by_quantity = {ENERGY: values[0], FORCE: values[1][:, moves], TORQUE: values[1][:, ~moves]}
    return {name: value for name, value in by_quantity.items() if value.size}


def _apart(job: FieldJob, values: tuple[np.ndarray, np.ndarray], reference: Truth) -> dict[str, float]:
    """Return the norm of the difference from a truth over that of the truth, by quantity."""
    by_quantity, like = _parts(job, values), _parts(job, (reference.energies, reference.forces))
    return {
        name: float(np.linalg.norm(by_quantity[name] - value) / np.linalg.norm(value))
        for name, value in like.items()
        if value.any()
    }


def _spline_run(
    grid: GridPart, degree: int, errors: dict[str, float], terms: tuple[dict[str, float], dict[str, float]]
) -> Run:
    """Return the run of a mesh, a grid and a degree; `terms`: its errors by panels, and by interpolation."""
    mesh, seconds = grid.level, Seconds(grid.cpu, grid.cpu)
    poses = {}
    if grid.every > 1:
        names = list(grid.record.axes)
        axes = {name: _axis(name, axis) for name, axis in zip(names, grid.axes, strict=True)}
        poses = {"poses": {"tolerance": "unset", **axes}}
    sizes = "×".join(str(len(axis)) for axis in grid.axes)
    run = _run(
        f"{mesh.panels} panels, {sizes} poses, {DEGREES[degree]}", f"{DEGREES[degree]} splines", mesh.changes | poses,
        mesh, errors, seconds,
    )  # fmt: skip
    kind = "reduced" if degree == SOLVER else "spline"
    return replace(run, kind=kind, truncation=terms[0], truncation_against="the finest panels, without interpolation",
                   time=terms[1], time_against="the same panels, without interpolation")  # fmt: skip


def _axis(name: str, values: np.ndarray) -> dict[str, Any]:
    in_units = values if name in "xyz" else np.degrees(values)
    return {"values": in_units.tolist(), "ends": "unset", "points": "unset"}


def _run(
    name: str, scheme: str, changes: dict[str, Any], mesh: Level, errors: dict[str, float], seconds: Seconds
) -> Run:
    worst = max(errors, key=lambda key: abs(errors[key]), default=None)
    return Run(
        name=name, kind="reduced", scheme=scheme, settings=changes, coordinates=mesh.panels, result="FINISHED",
        errors=errors, largest_error=None if worst is None else abs(errors[worst]), largest_of=worst,
        truncation_against="finer panels", time_against="fields have no time step", cpu_seconds=seconds.cpu,
        wall_seconds=seconds.wall, stages={"solve": StageSeconds(seconds, seconds)},
    )  # fmt: skip


def _with_chains(
    quantity: Quantity,
    by_panels: Sequence[tuple[Level, Mapping[str, float]]],
    by_grid: Sequence[tuple[GridPart, Mapping[str, float]]],
) -> Quantity:
    chains: list[Chain] = []
    if len(by_panels) > 1:
        errors_of_panels = [errors[quantity.name] for _, errors in by_panels]
        sizes = [float(level.panels) for level, _ in by_panels]
        chains.append(
            chain(
                "basis", [f"{level.panels} panels" for level, _ in by_panels], sizes, errors_of_panels, errors_of_panels
            )
        )
    if len(by_grid) > 1:
        errors = [errors[quantity.name] for _, errors in by_grid]
        sizes = spacings([grid for grid, _ in by_grid])
        names = [f"{grid.points} poses" for grid, _ in by_grid]
        # The truth, at spacing 0, is no run; the differences are from it.
        chains.append(chain("grid", names[::-1], sizes[::-1], errors[::-1], errors[::-1]))
    settles, why = settling(quantity.name, chains)
    return replace(quantity, chains=chains, converges=settles, why=why)


def _budget(document: Document, best: Run | None) -> Budget | None:
    if best is None or best.truncation is None or best.time is None:
        return None
    terms = []
    for source, errors, how in (
        ("panels", best.truncation, "the finest panels against those of the run, both without interpolation"),
        ("grid", best.time, "splines against boundary elements of the same panels between the points"),
    ):
        of = max(errors, key=lambda name: errors[name])
        terms.append(Term(source, how, dict(errors), size=errors[of], of=of))
    return Budget(best.name, terms)


def _estimates(levels: Sequence[Level]) -> Table:
    """Return the panels of each mesh and the error that its own coarse panels estimate."""
    rows = []
    for mesh in levels:
        C = np.asarray(mesh.record.capacitance)
        root = np.sqrt(np.diag(C))
        worst = (float((np.asarray(error) / np.outer(root, root)).max())
                 for error in (mesh.record.panel_error, mesh.record.shape_error))  # fmt: skip
        rows.append([f"× {mesh.factor:g}", f"{mesh.panels:,}", *(f"{value:.1e}" for value in worst),
                     f"{mesh.seconds.cpu:.3g} s"])  # fmt: skip
    note = (
        "the largest of the capacitances in the positions of the scene, as every run estimates it from its own panels"
    )
    return Table("Meshes", ["edges", "panels", "error by panels", "error by shape", "CPU time"], rows, note)


def _cells(by_grid: Sequence[tuple[GridPart, Mapping[str, float]]]) -> Table:
    """Return the estimate of each cell beside the errors of interpolation, of the scene's own mesh."""
    from gudgeon.solver.forces.fields.pose_field import cell_errors

    rows = []
    for grid, errors in by_grid:
        estimate = cell_errors(grid.axes, grid.energies[..., None, None])
        rows.append([f"{grid.points:,}", f"{estimate.max():.1e}", f"{np.median(estimate):.1e}",
                     *(f"{value:.1e}" for value in errors.values()), f"{grid.cpu:.3g} s"])  # fmt: skip
    names = [name.replace("_", "-") for _, errors in by_grid[:1] for name in errors]
    note = "cubic splines; estimates are of the co-energy in the cells, relative to its largest value"
    return Table("Grids", ["poses", "largest estimate", "median estimate", *names, "CPU time"], rows, note)
