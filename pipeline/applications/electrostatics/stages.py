"""The stages of a scene of conductors, `mesh → solve → poses`: what each of them computes, and what a run reports."""

import time
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.modaldb.records.field import POSE_AXES, FieldRecord, PoseGridRecord, PoseRecord
from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.applications.electrostatics.grid import Grid
from gudgeon.pipeline.applications.electrostatics.job import FieldJob
from gudgeon.pipeline.applications.electrostatics.scene import FieldFile
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import csv_text, write_text
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.keys.products import Product
from gudgeon.pipeline.stages.make import keep
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.run_report import Progress, RunReport
from gudgeon.pipeline.stages.summary import SUMMARY, read_summary, seal_summary
from gudgeon.solver.vectors import rotation_of

CAPACITANCE = "capacitance.csv"
MOST_MEMORY = 4e9
"""What a process that computes poses may need [bytes]."""
MOST_POSES = 1_000_000
"""Of a grid, whose list has 1.3 GB."""
POSE_SHARE = 0.5
"""Estimated time of a pose over that of the field: the integrals between fixed and moving panels are half of all."""


def make_mesh(job: FieldJob, product: Product, tell: Progress) -> MeshRecord:
    """Return the mesh of a conductor. Heavy libraries are imported here, where they are needed."""
    from gudgeon.pipeline.stages.mesh import build_mesh

    return build_mesh(job.scene.conductor[product.name], job.path.parent, product.name, "conductor")


def make_field(job: FieldJob, product: Product, tell: Progress) -> FieldRecord:
    """Return the field of conductors in their places; see `compute_field`."""
    return compute_field(job, tell)


def make_poses(job: FieldJob, product: Product, tell: Progress) -> PoseGridRecord:
    """Return the grid of poses, its blocks computed one after the other."""
    return _make_grid(job, tell)


def compute_field(job: FieldJob, tell: Progress) -> FieldRecord:
    """Return the field of conductors in their places; their meshes are in the database.

    Raises:
        InputError: they overlap, or have too many panels.
        StageError: a numerical routine failed.
    """
    from gudgeon.pipeline.applications.electrostatics import capacitance, conductors
    from gudgeon.pipeline.applications.electrostatics.panels import Grading, joined

    start, scene = time.process_time(), job.scene
    keys = {name: c.key for name, c in job.meshes().items()}
    meshes = {name: job.store.get(key, "mesh") for name, key in keys.items()}
    by_conductor = conductors.conductor_panels(scene.conductor, meshes, Grading(**scene.panels.model_dump()))
    half_space = half_space_of(scene)
    filled = conductors.solids(scene.conductor, meshes)
    conductors.refuse_overlap(dict(zip(scene.conductor, by_conductor, strict=True)), half_space, filled)
    panels, permittivity = joined(by_conductor), capacitance.VACUUM * scene.permittivity
    charged = capacitance.charge(panels, len(by_conductor), permittivity, half_space, tell)
    potentials = [np.nan if c.potential is None else c.potential for c in scene.conductor.values()]
    charges = [c.charge or 0.0 for c in scene.conductor.values()]
    state = capacitance.state(charged.capacitance, np.array(potentials), np.array(charges))
    coarse = capacitance.state(charged.coarse, np.array(potentials), np.array(charges))
    medium: dict[str, Any] = {"permittivity": permittivity}
    if half_space is not None:
        medium |= {"point": half_space.point.tolist(), "normal": half_space.normal.tolist()}
        medium["image_factor"] = half_space.factor
    quantities = _quantities(list(scene.conductor), charged.capacitance, state)
    energy = state.co_energy
    quantities["co_energy.error"] = {
        "value": (
            capacitance.COARSE_SHARE * abs(energy - coarse.co_energy)
            + capacitance.RULES * abs(energy)
            + 0.5 * float(np.abs(state.potentials) @ charged.shape_error @ np.abs(state.potentials))
        ),
        "unit": "J",
    }
    counts = {"panels": len(panels), "coarse_panels": int(panels.coarse[-1]) + 1}
    return FieldRecord(
        conductors={"names": list(scene.conductor), "mesh_keys": keys}, medium=medium, facets=panels.facets,
        panel=panels.panel, conductor=panels.conductor, coarse=panels.coarse, density=charged.density,
        capacitance=charged.capacitance, panel_error=charged.panel_error, shape_error=charged.shape_error,
        potentials=state.potentials, charges=state.charges, quantities=quantities,
        counts=counts | {"cpu_seconds": time.process_time() - start},
    )  # fmt: skip


def _make_grid(job: FieldJob, tell: Progress, executor: Executor | None = None) -> PoseGridRecord:
    from gudgeon.pipeline.applications.electrostatics.blocks import compute_grid, grid_record

    grid, conductors = job.grid(), job.scene.conductor.values()
    assert grid is not None
    assert job.scene.poses is not None
    _refuse_large(job, grid)
    _refuse_long(job, grid, job.scene.poses.hours)
    _refuse_enclosed(job, grid)
    if job.scene.poses.tolerance is None:
        blocks = compute_grid(job.store.location, job.name, grid, tell, executor)
    else:
        grid, blocks = _refined(job, grid, tell, executor)
    potentials = np.array([np.nan if c.potential is None else c.potential for c in conductors])
    return grid_record(grid, blocks, potentials, np.array([c.charge or 0.0 for c in conductors]))


def _refined(job: FieldJob, grid: Grid, tell: Progress, executor: Executor | None) -> tuple[Grid, list[PoseRecord]]:
    """Refine a grid until the estimated error of all its cells is within poses.tolerance."""
    from gudgeon.pipeline.applications.electrostatics.refinement import MOST_ROUNDS, Refinement, not_reached

    assert job.scene.poses is not None
    assert job.scene.poses.tolerance is not None
    refinement = Refinement(job.store.location, job.name, grid, job.scene.poses.tolerance)
    for k in range(MOST_ROUNDS):
        changed = refinement.compute(lambda stage, fraction, n=k: tell(f"{stage}, round {n + 1}", fraction), executor)
        if not changed:
            return refinement.grid, [refinement.record()]
        _refuse_long(job, refinement.grid, job.scene.poses.hours)
    raise not_reached(job.scene.poses.tolerance, refinement.grid)


def _refuse_large(job: FieldJob, grid: Grid) -> None:
    """Raise InputError where a process that computes a grid would need more memory than allowed."""
    from gudgeon.pipeline.applications.electrostatics.poses import memory

    record: FieldRecord = job.store.get(grid.field_key, "field", only=["conductor", "conductors"])
    names = record.conductors["names"]
    counts = dict(zip(names, np.bincount(record.conductor, minlength=len(names)).tolist(), strict=True))
    moving = sum(count for name, count in counts.items() if name in grid.moved.names)
    fixed = sum(counts.values()) - moving
    needed = memory(fixed, moving, images=job.scene.half_space is not None)
    if needed > MOST_MEMORY:
        largest = max(counts, key=lambda name: counts[name])
        raise InputError(
            f"poses: {fixed} panels stay and {moving} move, for which a process would need about {needed / 1e9:.2g} GB;"
            f" allowed: {MOST_MEMORY / 1e9:g}. Give fewer panels: conductor.{largest} has {counts[largest]}, fewer by a"
            " larger mesh.size, or panels.strips or panels.corner_divisions below"
            f" {job.scene.panels.strips} or {job.scene.panels.corner_divisions}"
        )


def _refuse_long(job: FieldJob, grid: Grid, hours: float) -> None:
    """Raise InputError where a grid would take longer than allowed, by the time of the field itself."""
    record: FieldRecord = job.store.get(grid.field_key, "field", only=["counts"])
    total = grid.count * record.counts["cpu_seconds"] * POSE_SHARE / 3600
    sizes = ", ".join(f"{name}: {len(values)}" for name, values in grid.ordered.items())
    if grid.count > MOST_POSES:
        raise InputError(
            f"{job.path}: poses: {grid.count} poses ({sizes}); allowed: {MOST_POSES}. Give fewer points or axes"
        )
    if total > hours:
        raise InputError(
            f"poses.hours: {hours:g} h allowed; {grid.count} poses ({sizes}) of {record.counts['panels']} panels"
            f" would take about {total:.3g} h of CPU time. Give fewer points, fewer panels (panels.strips, mesh.size),"
            " a larger tolerance, or more hours"
        )


def _refuse_enclosed(job: FieldJob, grid: Grid) -> None:
    """Raise InputError where a conductor is within a solid one at a pose, as blocks find those that cross."""
    from gudgeon.pipeline.applications.electrostatics.conductors import solids
    from gudgeon.pipeline.applications.electrostatics.enclosure import enclosed
    from gudgeon.pipeline.applications.electrostatics.poses import chosen_panels, panels_of_record

    record: FieldRecord = job.store.get(grid.field_key, "field")
    names = record.conductors["names"]
    filled = solids(job.scene.conductor, {name: job.store.get(p.key, "mesh") for name, p in job.meshes().items()})
    by_conductor = {name: chosen_panels(panels_of_record(record), np.array(names) == name) for name in names}
    pairs = [(a, b) for a in names for b in names if (a in grid.moved.names) != (b in grid.moved.names)]
    pivot = grid.moved.pivot
    for pose in grid.poses():
        Q = rotation_of(pose[3:])
        there = {
            name: replace(by_conductor[name], facets=(by_conductor[name].facets - pivot) @ Q.T + pivot + pose[:3])
            for name in grid.moved.names
        }
        if enclosed(by_conductor | there, filled, pairs):
            position = ", ".join(f"{name} = {value:.6g}" for name, value in zip(POSE_AXES, pose, strict=True) if value)
            raise InputError(f"poses.moved: conductors touch or overlap at the pose {position}; narrow the grid")


def compute_poses(job: FieldJob, executor: Executor | None = None, progress: Progress | None = None) -> PoseGridRecord:
    """Compute the grid of poses of a scene, its blocks by an executor, and keep it; see `blocks.compute_grid`.

    Raises:
        InputError: the scene has no poses, conductors overlap at one, or the grid would take too long.
        StageError: a numerical routine failed.
    """
    if not (products := job.pose_grid()):
        raise InputError(f"{job.path}: poses: is missing; the scene has no grid of poses")
    tell = progress or (lambda stage, fraction: None)
    run_job(job, "solve", progress)
    (grid,) = products.values()
    if not job.store.has(grid.key):
        with named(job.path, InputError):
            keep(job.store, grid, _make_grid(job, tell, executor))
    return job.store.get(grid.key, "posegrid")


def half_space_of(scene: FieldFile) -> Any:
    """Return the `HalfSpace` of a scene, or None."""
    from gudgeon.pipeline.applications.electrostatics.capacitance import HalfSpace

    if (half_space := scene.half_space) is None:
        return None
    return HalfSpace(np.array(half_space.point), half_space.unit_normal, half_space.image_factor(scene.permittivity))


def _quantities(names: list[str], C: np.ndarray, state: Any) -> dict[str, Any]:
    """Return capacitances, potentials, charges and co-energy of conductors.

    The mutual capacitance of two conductors is that between Q on one and −Q on the other, and no charge on the rest.
    """
    quantities: dict[str, Any] = {}
    for i, name in enumerate(names):
        quantities[f"{name}.capacitance"] = {"value": float(C[i, i]), "unit": "F"}
        quantities[f"{name}.potential"] = {"value": float(state.potentials[i]), "unit": "V"}
        quantities[f"{name}.charge"] = {"value": float(state.charges[i]), "unit": "C"}
    P = np.linalg.inv(C)
    for i, name in enumerate(names):
        for j in range(i):
            mutual = 1 / (P[i, i] + P[j, j] - 2 * P[i, j])
            quantities[f"{names[j]}.{name}.mutual_capacitance"] = {"value": float(mutual), "unit": "F"}
    return quantities | {"co_energy": {"value": state.co_energy, "unit": "J"}}


def results(job: FieldJob, until: str) -> RunReport:
    """Write summary and capacitances unless they are up to date, and return the report."""
    if until == "mesh":
        return RunReport(job.name, None, out=str(job.out))
    key = job.field().key
    record: FieldRecord = job.store.get(key, "field", only=RESULTS)
    _refuse_unknown(job, record.quantities)
    summary = read_summary(job.out, key, CAPACITANCE, job.expected)
    if summary is None:
        write_text(job.out / CAPACITANCE, _table(record))
        quantities = {name: _compared(q, job.expected.get(name)) for name, q in record.quantities.items()}
        summary = {"key": key, "expected": job.expected, "quantities": quantities, "counts": record.counts}
        summary = seal_summary(job.out, summary, CAPACITANCE)
    estimates = {} if until == "solve" or not job.pose_grid() else _interpolation(job)
    estimates |= {
        "panels": _largest(record.panel_error, record.capacitance),
        "shape": _largest(record.shape_error, record.capacitance),
    }
    return RunReport(
        job.name, "FINISHED", {}, summary["quantities"], estimates=estimates, out=str(job.out),
        files=(SUMMARY, CAPACITANCE),
    )  # fmt: skip


RESULTS = ("conductors", "medium", "capacitance", "panel_error", "shape_error", "quantities", "counts")


def _interpolation(job: FieldJob) -> dict[str, float]:
    """Return the largest and the median estimated error of interpolation over the cells of the grid."""
    (product,) = job.pose_grid().values()
    record: PoseGridRecord = job.store.get(product.key, "posegrid", only=["cell_errors"])
    return {
        "interpolation.largest": float(record.cell_errors.max()),
        "interpolation.median": float(np.median(record.cell_errors)),
    }


def _refuse_unknown(job: FieldJob, quantities: Mapping[str, Any]) -> None:
    for name in job.scene.report.quantities:
        if name not in quantities:
            raise InputError(
                f"{job.path}: report.quantities: '{name}' given; the run has {', '.join(sorted(quantities))}"
            )


def _compared(entry: Mapping[str, Any], reference: float | None) -> dict[str, Any]:
    error = None if reference is None else entry["value"] / reference - 1 if reference else entry["value"]
    return dict(entry) | {"reference": reference, "error": error}


def _largest(error: np.ndarray, C: np.ndarray) -> float:
    """Return the largest error of a capacitance, relative to those of its two conductors."""
    root = np.sqrt(np.diag(C))
    return float((error / np.outer(root, root)).max())


def _table(record: FieldRecord) -> str:
    """Return Maxwell's matrix with both errors of each entry, as CSV."""
    names = record.conductors["names"]
    rows = [["conductor", "conductor", "C [F]", "error by panels [F]", "error by shape [F]"]]
    for i, a in enumerate(names):
        for j, b in enumerate(names[: i + 1]):
            values = (record.capacitance[i, j], record.panel_error[i, j], record.shape_error[i, j])
            rows.append([a, b, *(f"{value:.9g}" for value in values)])
    return csv_text(rows)


def plan_field(job: FieldJob) -> dict[str, Any]:
    """Return the terms of a field, with the reason for each; nothing is read by a solver."""
    from gudgeon.pipeline.stages.plan import term_row

    scene, floating = job.scene, [name for name, c in job.scene.conductor.items() if c.potential is None]
    half = scene.half_space
    terms = [
        ("conductors", True, f"{len(scene.conductor)}: {', '.join(scene.conductor)}", ()),
        ("floating conductors", bool(floating), f"charge is given for {', '.join(floating) or 'none'}", ()),
        ("images", half is not None, "half_space is given" if half is not None else "no half_space", ()),
    ]
    rows = [term_row(job.store, {"field": job.field().key}, job.name, term)[0] for term in terms]
    return {"scene": job.name, "terms": rows, "bytes": 0}


def draw(job: FieldJob, tell: Progress) -> tuple[list[Path], list[str]]:
    from gudgeon.pipeline.applications.electrostatics.pictures import FIELD
    from gudgeon.pipeline.plots import render

    tell("plot", 0.0)
    return render(job.store.location, job.field().key, job.out, job.name, pictures=FIELD, tell=tell)
