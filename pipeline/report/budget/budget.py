"""The error budget of one setting of a report: basis, step, mesh, spline spacing and contact layer, each by itself.

The step is compared with the finest that the report has. The basis is halved, and doubled or compared with the largest
of the report; mesh and spline spacing are varied by a factor of 1.5 to both sides. Of all three the error follows by
Richardson's extrapolation with the observed order.
The stiffness of a contact layer is halved and doubled; the larger change counts.
"""

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.geometry.cad.part import LEAST_TURN, MOST_TURN, CadPart
from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.report.budget.fields import FALL, LEAST_POINTS, by_panels, by_points, changed_grids
from gudgeon.pipeline.report.budget.mesh_edges import mean_edge
from gudgeon.pipeline.report.convergence import Neighbour, extrapolated
from gudgeon.pipeline.report.document import MISSING, Budget, Errors, Quantity, Term, counted_names
from gudgeon.pipeline.report.errors import Point, apart_from, finest_step, larger
from gudgeon.pipeline.report.reference import DRIFT, Reference, largest
from gudgeon.pipeline.report.sweep import elastic_modes, reason
from gudgeon.pipeline.report.timing import made
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.job import Job, grids_of, variant
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.errors import SceneError, SolverError

FACTOR = 1.5
"""Factor on edge lengths and spline spacings, to both sides."""
LEAST = 0.25
"""Logarithm of the ratio of mean edges over that of `FACTOR` below which a mesh is hardly another one."""
LARGER = 1.8
"""Coordinates of a larger basis over those of the setting from which on its difference is extrapolated."""
LAYER = 2.0
"""Factor on the stiffness of contact layers, to both sides."""
PATIENCE = 20.0
"""Limit on the CPU time of a run of the budget [s]; `DEARER` times that of the setting itself if that is more."""
DEARER = 10.0
"""Run time over that of the setting itself from which a run is left out."""
GROWTH = 1.5
"""Exponent of the number of nodes in the time that a finer mesh takes."""
Tell = Callable[[str, float], None]


Side = tuple[float, Errors]
"""Size of a run over that of the run of the budget, and differences from it."""


@dataclass(frozen=True)
class Judge:
    """The run of a budget and what it is compared in."""

    point: Point
    reference: Reference
    quantities: Sequence[Quantity]

    def signed(self, name: str) -> bool:
        """Whether differences in a quantity have a sign."""
        return all(q.measure != "L2" for q in self.quantities if q.name == name)

    def differences(self, run: Trajectory, name: str) -> Errors:
        """Return the difference of another run from the run of the budget, without the energy drift."""
        errors = apart_from(self.point.job, run, self.point.trajectory, name, self.reference)
        compared = {q.name for q in self.quantities if q.measure != "absolute"}
        return {name: value for name, value in errors.items() if name in compared and name != DRIFT}

    def renumbered(self, run: Trajectory) -> str:
        """Return how many impacts another run has where numbered ones are compared; empty where they are as many."""
        trajectory = self.point.trajectory
        for name, impacts in trajectory.impacts.items():
            numbered = any(
                q.name.startswith(f"{name}.impact") and q.name in self.reference.expected for q in self.quantities
            )
            if numbered and len(run.impacts[name]) != len(impacts):
                return f"{len(run.impacts[name])} impacts of {name} instead of {len(impacts)}"
        return ""

    def side(
        self, changes: dict[str, Any], size: float, words: str, meshed: Collection[str] = ()
    ) -> tuple[Side | None, str]:
        """Return a run with further changes as a side, with what it is; None, and why, if it cannot be compared.

        Args:
            size: Of the run over that of the run of the budget.
            meshed: Components with another mesh, whose mean edges measure the size.
        """
        job, (run, why) = self.point.job, _run(self.point, changes, meshed)
        if run is not None and meshed:
            edges = _edge_ratio(job, variant(job, changes), meshed)
            words = f"{words} (mean edge × {edges:.2f})"
            if math.log(edges) / math.log(size) < LEAST:
                return None, f"{words}: hardly another mesh"
            size = edges
        if run is None or (why := self.renumbered(run)):
            return None, f"{words}: {why}"
        return (size, self.differences(run, "")), words

    def term(self, source: str, how: str, errors: Errors, orders: dict[str, float] | None = None) -> Term:
        """Return a term from the estimated errors of the quantities."""
        sizes = {name: abs(error) for name, error in errors.items()}
        of, size = largest(sizes, counted_names(self.quantities))
        return Term(source, how, sizes, orders or {}, size, of)


def budget_of(
    point: Point, points: Sequence[Point], reference: Reference, quantities: Sequence[Quantity], progress: Tell
) -> Budget:
    """Return the error budget of a setting; runs that it needs are kept in the database.

    Args:
        points: All settings of the report, with their runs of finer steps.
    """
    judge = Judge(point, reference, quantities)
    progress("error budget: basis", 0.0)
    terms = [_basis(judge, points), _step(judge, points)]
    for i, (source, term) in enumerate((("mesh", _mesh), ("spline spacing", _splines), ("contact layer", _layer))):
        progress(f"error budget: {source}", 0.25 * (i + 1))
        terms.append(term(judge))
    if grids_of(point.job.scene):
        progress("error budget: fields", 0.9)
        terms += [_panels(judge), _grid(judge)]
    return Budget(point.setting.name, terms)


def _basis(judge: Judge, points: Sequence[Point]) -> Term:
    """Compare with a basis of at least twice and one of half as many coordinates, and extrapolate.

    The larger basis is the largest of the report where it is large enough: one that is little larger lacks nearly the
    same, so that its difference would be a fraction of the error.
    """
    point, sides = judge.point, list[tuple[Side | None, str]]()
    larger_point = larger(point, points)
    if larger_point is not None and larger_point.coordinates >= LARGER * point.coordinates:
        size = point.coordinates / larger_point.coordinates
        sides.append(((size, judge.differences(larger_point.trajectory, "")), larger_point.setting.name))
    for factor, words in ((2.0, "twice as many modes"), (0.5, "half as many")):
        if factor > 1 and sides:
            continue
        changes = _scaled_basis(point.job, factor)
        if not changes:
            return Term("basis", "no body has modes that could be more")
        sides.append(judge.side({"component": changes}, 1 / factor, words))
    return _extrapolated(judge, "basis", sides, "against ")


def _scaled_basis(job: Job, factor: float) -> dict[str, Any]:
    """Return changes of the components that scale the numbers of their modes; empty where none has any."""
    scaled, used = {}, {name: job.scene.component[name] for name in job.components()}
    for name, modes in elastic_modes(used).items():
        key = (
            "fixed_count"
            if modes.reduction in ("craig-bampton", "row-craig-bampton", "interface", "partial-interface")
            else "normal_count"
        )
        if (count := int(factor * getattr(modes, key))) > 0:
            scaled[name] = {"modes": {key: count}}
    return scaled


def _step(judge: Judge, points: Sequence[Point]) -> Term:
    """Compare with the finest step of the report."""
    point, source = judge.point, "step"
    if (finest := finest_step(point, points)) is not None:
        return judge.term(source, f"against {finest[0]}", judge.differences(finest[1], ""))
    if math.isinf(point.job.scene.capabilities.order):
        return Term(source, "none: exact motion between located events")
    return Term(source, f"{MISSING}: the report has no run with a finer step")


def _mesh(judge: Judge) -> Term:
    """Compare with a finer and a coarser mesh of all components that are meshed here."""
    job, source = judge.point.job, "mesh"
    used = {name: job.scene.component[name] for name in job.components()}
    meshed = {name: component for name, component in used.items() if component.geometry.kind != "rigid"}
    fixed = [name for name, component in meshed.items() if component.from_file]
    sized = {name: component for name, component in meshed.items() if name not in fixed}
    fixed_text = "; ".join(f"component.{name} is a mesh file, which has no other size" for name in fixed)
    if not sized:
        return Term(source, f"{MISSING}: {fixed_text}" if fixed_text else "none: no body has a mesh")

    def scaled(factor: float) -> dict[str, Any]:
        return {"component": {name: _resized(component, factor) for name, component in sized.items()}}

    term = _varied(judge, source, scaled, "edges", list(sized))
    return replace(term, how=f"{term.how}; {fixed_text}") if fixed_text else term


def _resized(component: Component, factor: float) -> dict[str, Any]:
    """Return the keys by which the elements of a component have other sizes by a factor."""
    size, geometry = component.mesh.size, component.geometry
    mesh = {"nodes": round(component.mesh.nodes / factor**3)} if size is None else {"size": size * factor}
    if not isinstance(geometry, CadPart):
        return {"mesh": mesh}
    around = min(max(round(geometry.around / factor), LEAST_TURN), MOST_TURN)
    sizes = {name: length * factor for name, length in geometry.sizes.items()}
    return {"mesh": mesh, "geometry": {"around": around} | ({"sizes": sizes} if sizes else {})}


def _splines(judge: Judge) -> Term:
    """Compare with smaller and larger knot spacings of all traction spaces."""
    job, source = judge.point.job, "spline spacing"
    interfaces = {name: job.scene.component[name].interface for name in job.components()}
    spaces = {
        name: {key: interface.spacing for key, interface in named.items() if interface.spacing is not None}
        for name, named in interfaces.items()
    }
    spaces = {name: spacings for name, spacings in spaces.items() if spacings}
    if not spaces:
        return Term(source, "none: no traction space")

    def scaled(factor: float) -> dict[str, Any]:
        tables = {
            name: {key: {"spacing": [factor * h for h in spacing]} for key, spacing in spacings.items()}
            for name, spacings in spaces.items()
        }
        return {"component": {name: {"interface": table} for name, table in tables.items()}}

    return _varied(judge, source, scaled, "spacing")


def _layer(judge: Judge) -> Term:
    """Compare with half and twice the stiffness of all contact layers."""
    contacts, source = judge.point.job.scene.contact, "contact layer"
    layers = {name: c.surface_stiffness for name, c in contacts.items() if c.surface_stiffness is not None}
    if not layers:
        return Term(source, "none: no surface_stiffness")
    errors, missing = list[Errors](), []
    for factor, word in ((LAYER, "twice"), (1 / LAYER, "half")):
        changes = {name: {"surface_stiffness": factor * size} for name, size in layers.items()}
        run, why = _run(judge.point, {"contact": changes})
        if run is None:
            missing.append(f"{word} the stiffness: {why}")
        else:
            errors.append(judge.differences(run, ""))
    if not errors:
        return Term(source, f"{MISSING}: {'; '.join(missing)}")
    how = "; ".join(["surface_stiffness halved and doubled, the larger change", *missing])
    names = dict.fromkeys(name for differences in errors for name in differences)
    return judge.term(source, how, {name: max(abs(e.get(name, 0.0)) for e in errors) for name in names})


def _varied(
    judge: Judge, source: str, scaled: Callable[[float], dict[str, Any]], noun: str, meshed: Collection[str] = ()
) -> Term:
    """Return a term from runs of sizes that are smaller and larger by `FACTOR`; see `Judge.side`."""
    finer = judge.side(scaled(1 / FACTOR), 1 / FACTOR, f"{noun} / {FACTOR:g}", meshed)
    coarser = judge.side(scaled(FACTOR), FACTOR, f"{noun} × {FACTOR:g}", meshed)
    return _extrapolated(judge, source, [finer, coarser])


def _extrapolated(judge: Judge, source: str, sides: Sequence[tuple[Side | None, str]], prefix: str = "") -> Term:
    """Return a term from a finer and a coarser run, of which one may be missing; see `Judge.side`."""
    runs, missing = [words for side, words in sides if side], [words for side, words in sides if not side]
    able = [side for side, _ in sides if side is not None]
    if not able:
        return Term(source, f"{MISSING}: {'; '.join(missing)}")
    errors, orders = {}, {}
    for name in able[0][1]:
        if all(name in differences for _, differences in able):
            finer, coarser = (side and Neighbour(side[0], side[1][name]) for side, _ in sides)
            estimate = extrapolated(finer, coarser, judge.signed(name))
            errors[name] = estimate.error
            orders |= {} if estimate.order is None else {name: estimate.order}
    how = f"{prefix}{' and '.join(runs)}, extrapolated" + (" with order 1" if missing else " with the observed order")
    return judge.term(source, "; ".join([how, *missing]), errors, orders)


def _panels(judge: Judge) -> Term:
    """Compare with fields whose capacitances are greater by their estimated error by panels."""
    source = "panels"
    run, why = _run(judge.point, changed_grids(judge.point.job, by_panels))
    if run is None:
        return Term(source, f"{MISSING}: {why}")
    how = "capacitances increased by the error that their own coarse panels estimate"
    return judge.term(source, how, judge.differences(run, ""))


def _grid(judge: Judge) -> Term:
    """Compare with fields of every second point of their grids of poses."""
    source = "grid"
    changes = changed_grids(judge.point.job, by_points)
    if not changes:
        return Term(source, f"{MISSING}: no axis of a grid has {LEAST_POINTS} points, of which every second could do")
    run, why = _run(judge.point, changes)
    if run is None:
        return Term(source, f"{MISSING}: {why}")
    how = f"every second point of axes of {LEAST_POINTS} and more, its difference over {FALL:g}: forces are of order 3"
    return judge.term(source, how, {name: size / FALL for name, size in judge.differences(run, "").items()})


def _run(point: Point, changes: dict[str, Any], meshed: Collection[str] = ()) -> tuple[Trajectory | None, str]:
    """Return the run of a setting with further changes; None, and why, if it fails or takes too long.

    It has the window of the setting's own run, so that both tell the same impacts apart.
    """
    assert point.timed is not None
    try:
        if point.job.scene.contact and (window := system_of(point.job).separation):
            changes = changes | {"run": changes.get("run", {}) | {"window": window}}
        job = variant(point.job, changes)
        if meshed and (growth := _nodes(job, meshed) / _nodes(point.job, meshed)) ** GROWTH > DEARER:
            return None, f"{growth:.1f} times as many nodes, which take more than {DEARER:g} times as long"
        run = made(job, max(PATIENCE, DEARER * point.timed.cpu))
    except (InputError, SceneError, StageError, SolverError) as error:
        return None, reason(point.job, error)
    return (run, "") if run.result == "FINISHED" else (None, f"the run ends as {run.result}")


def _nodes(job: Job, components: Collection[str]) -> int:
    run_job(job, "mesh")
    return sum(len(mesh.nodes) for mesh in _meshes(job, components))


def _edge_ratio(job: Job, changed: Job, components: Collection[str]) -> float:
    """Return the mean edge of a job's meshes over that of another's, as geometric mean of the components."""
    pairs = zip(_meshes(changed, components), _meshes(job, components), strict=True)
    return math.exp(float(np.mean([math.log(mean_edge(new) / mean_edge(old)) for new, old in pairs])))


def _meshes(job: Job, components: Collection[str]) -> list[MeshRecord]:
    steps = job.components()
    meshes = [job.store.get(steps[name]["mesh"].key, "mesh") for name in components]
    return [mesh for mesh in meshes if cell_of(mesh).dofs]
