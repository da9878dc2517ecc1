"""The error budget of one choice of kept interface: basis and mesh; a harmonic response has no time step."""

import math
from typing import Any

from gudgeon.modaldb.records.cyclic import WheelRecord
from gudgeon.pipeline.applications.wheel.comparison import (
    MAGNIFICATION,
    RESPONSE,
    Comparison,
    InterfaceRow,
    differences,
)
from gudgeon.pipeline.applications.wheel.cyclic.synthesis import sector_parts
from gudgeon.pipeline.applications.wheel.job import WheelJob
from gudgeon.pipeline.applications.wheel.response import kept_dofs, reduced_modes, wheel_record
from gudgeon.pipeline.applications.wheel.scene import KeptInterface
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.report.budget.budget import DEARER, FACTOR, GROWTH, LEAST
from gudgeon.pipeline.report.budget.mesh_edges import mean_edge
from gudgeon.pipeline.report.convergence import Neighbour, extrapolated
from gudgeon.pipeline.report.document import MISSING, Budget, Errors, Term
from gudgeon.pipeline.report.reference import largest
from gudgeon.pipeline.stages.make import keep
from gudgeon.pipeline.stages.run import solve_records
from gudgeon.pipeline.stages.run_report import Progress

AGAINST = (
    "against the full wheel with all its dofs; of response and magnification with the error of the compared modes"
    " against a direct solution"
)


def budget_of(
    job: WheelJob, comparison: Comparison, row: InterfaceRow, choice: KeptInterface, progress: Progress
) -> Budget:
    """Return the error budget of a choice; runs on other meshes are kept in the database."""
    basis = {name: abs(error) for name, error in row.errors.items()}
    for name in (RESPONSE, MAGNIFICATION):
        basis[name] += comparison.truncation_error
    terms = [
        _term("basis", AGAINST, basis),
        Term("step", "none: a harmonic response has no time step"),
        _mesh(job, row.record, choice, progress),
        Term("spline spacing", "none: no traction space"),
        Term("contact layer", "none: no surface_stiffness"),
    ]
    return Budget(row.name, terms)


def _mesh(job: WheelJob, reference: WheelRecord, choice: KeptInterface, progress: Progress) -> Term:
    """Compare with a finer and a coarser mesh of the sector."""
    size, component = job.component.mesh.size, job.wheel.component
    if size is None or "file" in job.component.geometry.kind:
        return Term("mesh", f"{MISSING}: component.{component} is a mesh file, which has no other size")
    compared, missing = [], []
    neighbours: list[tuple[float, Errors] | None] = []
    for n, (factor, word) in enumerate(((1 / FACTOR, f"edges / {FACTOR:g}"), (FACTOR, f"edges × {FACTOR:g}"))):
        progress(f"error budget: mesh, {word}", 0.5 * n)
        changed = job.changed({"component": {component: {"mesh": {"size": size * factor}}}})
        try:
            ratio, record = _solved(changed, job, choice, factor)
        except (InputError, StageError) as error:
            neighbours.append(None)
            missing.append(f"{word}: {str(error).splitlines()[0]}")
            continue
        neighbours.append((ratio, differences(record, reference)))
        compared.append(f"{word} (mean edge × {ratio:.2f})")
    able = [neighbour for neighbour in neighbours if neighbour is not None]
    if not able:
        return Term("mesh", f"{MISSING}: {'; '.join(missing)}")
    errors, orders = {}, {}
    for name in able[0][1]:
        finer, coarser = (
            None if neighbour is None else Neighbour(neighbour[0], neighbour[1][name]) for neighbour in neighbours
        )
        estimate = extrapolated(finer, coarser, signed=name == MAGNIFICATION)
        errors[name] = estimate.error
        orders |= {} if estimate.order is None else {name: estimate.order}
    how = f"{' and '.join(compared)}, extrapolated" + (" with order 1" if missing else " with the observed order")
    return _term("mesh", "; ".join([how, *missing]), errors, orders)


def _solved(job: WheelJob, base: WheelJob, choice: KeptInterface, factor: float) -> tuple[float, WheelRecord]:
    """Return the mean edge over that of another job's mesh, and the response by a choice.

    Args:
        factor: Wanted ratio of the edges.

    Raises:
        InputError, StageError: the mesh is hardly another one or takes too long, or see `wheel_record`.
    """
    solve_records(job, "mesh")
    mesh, before = (j.store.get(j.mesh().key, "mesh") for j in (job, base))
    ratio = mean_edge(mesh) / mean_edge(before)
    if math.log(ratio) / math.log(factor) < LEAST:
        raise StageError("hardly another mesh")
    if (growth := len(mesh.nodes) / len(before.nodes)) ** GROWTH > DEARER:
        raise StageError(f"{growth:.1f} times as many nodes, which take more than {DEARER:g} times as long")
    product = job.response(choice)
    if not job.store.has(product.key):
        solve_records(job, "modes")
        name, wheel = job.scene.only
        case = job.case()
        dofs = kept_dofs(case.sector, choice, f"wheel.{name}.interface")
        reduced_sector = sector_parts(case.sector, wheel.fixed_count, f"wheel.{name}")
        pair = reduced_modes(case, reduced_sector, dofs, False), reduced_modes(case, reduced_sector, dofs, True)
        keep(job.store, product, wheel_record(case, job.modes().key, choice, pair, reduced_sector.cpu_seconds))
    return ratio, job.store.get(product.key, "wheel")


def _term(source: str, how: str, errors: Errors, orders: dict[str, Any] | None = None) -> Term:
    """Return a term; every quantity of a wheel counts."""
    of, size = largest(errors, set(errors))
    return Term(source, how, errors, orders or {}, size, of)
