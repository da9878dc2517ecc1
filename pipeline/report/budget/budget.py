"""The error budget of one setting of a report: basis, step, mesh, spline spacing and contact layer, each by itself.

The step is compared with the finest that the report has. The basis is halved, and doubled or compared with the largest
of the report; mesh and spline spacing are varied by a factor of 1.5 to both sides. Of all three the error follows by
Richardson's extrapolation with the observed order.
The stiffness of a contact layer is halved and doubled; the larger change counts.
"""

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.report.budget.fields import FALL, LEAST_POINTS, by_panels, by_points, changed_grids
from gudgeon.pipeline.report.budget.mesh_edges import mean_edge
from gudgeon.pipeline.report.convergence import Neighbour, extrapolated
from gudgeon.pipeline.report.document import MISSING, Budget, Errors, Quantity, Term
from gudgeon.pipeline.report.errors import Point, apart_from, finest_step, larger
from gudgeon.pipeline.report.reference import DRIFT, Reference, largest
from gudgeon.pipeline.report.sweep import reason
from gudgeon.pipeline.report.timing import made
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


class Sides(NamedTuple):
    """Changes of a scene that make something finer and coarser, and what they change, in words."""

    finer: dict[str, Any]
    coarser: dict[str, Any]
    words: tuple[str, str]


@dataclass(frozen=True)
class Judge:
    """The run of a budget and what it is compared in."""

    one: Point
    reference: Reference
    quantities: Sequence[Quantity]

    def signed(self, name: str) -> bool:
        """Whether differences in a quantity have a sign."""
        return all(q.measure != "L2" for q in self.quantities if q.name == name)

    def differences(self, run: Trajectory, name: str) -> Errors:
        """Return the difference of another run from the run of the budget, without the energy drift."""
        errors = apart_from(self.one.job, run, self.one.trajectory, name, self.reference)
        compared = {q.name for q in self.quantities if q.measure != "absolute"}
        return {name: value for name, value in errors.items() if name in compared and name != DRIFT}

    def renumbered(self, run: Trajectory) -> str:
        """Return how many impacts another run has where numbered ones are compared; empty where they are as many."""
        trajectory = self.one.trajectory
        for name, impacts in trajectory.impacts.items():
            numbered = any(
                q.name.startswith(f"{name}.impact") and q.name in self.reference.expected for q in self.quantities
            )
            if numbered and len(run.impacts[name]) != len(impacts):
                return f"{len(run.impacts[name])} impacts of {name} instead of {len(impacts)}"
        return ""

    def term(self, source: str, how: str, errors: Errors, orders: dict[str, float] | None = None) -> Term:
        """Return a term from the estimated errors of the quantities."""
        sizes = {name: abs(error) for name, error in errors.items()}
        of, size = largest(sizes, {q.name for q in self.quantities if q.counts})
        return Term(source, how, sizes, orders or {}, size, of)


def budget_of(
    one: Point, points: Sequence[Point], reference: Reference, quantities: Sequence[Quantity], progress: Tell
) -> Budget:
    """Return the error budget of a setting; runs that it needs are kept in the database.

    Args:
        points: All settings of the report, with their runs of finer steps.
    """
    judge = Judge(one, reference, quantities)
    progress("error budget: basis", 0.0)
    terms = [_basis(judge, points), _step(judge, points)]
    for i, (source, term) in enumerate((("mesh", _mesh), ("spline spacing", _splines), ("contact layer", _layer))):
        progress(f"error budget: {source}", 0.25 * (i + 1))
        terms.append(term(judge))
    if grids_of(one.job.scene):
        progress("error budget: fields", 0.9)
        terms += [_panels(judge), _grid(judge)]
    return Budget(one.setting.name, terms)


def _basis(judge: Judge, points: Sequence[Point]) -> Term:
    """Compare with a basis of at least twice and one of half as many coordinates, and extrapolate.

    The larger basis is the largest of the report where it is large enough: one that is little larger lacks nearly the
    same, so that its difference would be a fraction of the error.
    """
    one, source = judge.one, "basis"
    sides: list[tuple[float, Errors] | None] = []
    known, missing = [], []
    if (other := larger(one, points)) is not None and other.coordinates >= LARGER * one.coordinates:
        sides.append((one.coordinates / other.coordinates, judge.differences(other.trajectory, "")))
        known.append(other.setting.name)
    for factor, words in ((2.0, "twice as many modes"), (0.5, "half as many")):
        if factor > 1 and sides:
            continue
        changes = _scaled_basis(one.job, factor)
        if not changes:
            return Term(source, "no body has modes that could be more")
        run, why = _run(one, {"component": changes})
        if run is not None and (why := judge.renumbered(run)):
            run = None
        sides.append(None if run is None else (1 / factor, judge.differences(run, "")))
        (missing if run is None else known).append(f"{words}: {why}" if run is None else words)
    if not known:
        return Term(source, f"{MISSING}: {'; '.join(missing)}")
    return _term_of_sides(judge, source, sides, (f"against {' and '.join(known)}", missing))


def _scaled_basis(job: Job, factor: float) -> dict[str, Any]:
    """Return changes of the components that scale the numbers of their modes; empty where none has any."""
    scaled = {}
    for name, modes in _elastic(job).items():
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
    one, source = judge.one, "step"
    if (finest := finest_step(one, points)) is not None:
        return judge.term(source, f"against {finest[0]}", judge.differences(finest[1], ""))
    if math.isinf(one.job.scene.capabilities.order):
        return Term(source, "none: exact motion between located events")
    return Term(source, f"{MISSING}: the report has no run with a finer step")


def _mesh(judge: Judge) -> Term:
    """Compare with a finer and a coarser mesh of all components that are meshed here."""
    job, source = judge.one.job, "mesh"
    used = {name: job.scene.component[name] for name in job.components()}
    meshed = {name: component.mesh.size for name, component in used.items() if component.geometry.kind != "rigid"}
    fixed = [name for name, size in meshed.items() if size is None or "file" in used[name].geometry.kind]
    sizes = {name: size for name, size in meshed.items() if size is not None and name not in fixed}
    fixed_text = "; ".join(f"component.{name} is a mesh file, which has no other size" for name in fixed)
    if not sizes:
        return Term(source, f"{MISSING}: {fixed_text}" if fixed_text else "none: no body has a mesh")

    def scaled(factor: float) -> dict[str, Any]:
        return {"component": {name: {"mesh": {"size": size * factor}} for name, size in sizes.items()}}

    words = f"edges / {FACTOR:g}", f"edges × {FACTOR:g}"
    term = _extrapolated(judge, source, Sides(scaled(1 / FACTOR), scaled(FACTOR), words), list(sizes))
    return replace(term, how=f"{term.how}; {fixed_text}") if fixed_text else term


def _splines(judge: Judge) -> Term:
    """Compare with smaller and larger knot spacings of all traction spaces."""
    job, source = judge.one.job, "spline spacing"
    spaces = {
        name: {
            key: interface.spacing
            for key, interface in job.scene.component[name].interface.items()
            if interface.spacing is not None
        }
        for name in job.components()
    }
    if not any(spaces.values()):
        return Term(source, "none: no traction space")

    def scaled(factor: float) -> dict[str, Any]:
        return {
            "component": {
                name: {
                    "interface": {key: {"spacing": [factor * h for h in spacing]} for key, spacing in spacings.items()}
                }
                for name, spacings in spaces.items()
                if spacings
            }
        }

    words = f"spacing / {FACTOR:g}", f"spacing × {FACTOR:g}"
    return _extrapolated(judge, source, Sides(scaled(1 / FACTOR), scaled(FACTOR), words), [])


def _layer(judge: Judge) -> Term:
    """Compare with half and twice the stiffness of all contact layers."""
    contacts, source = judge.one.job.scene.contact, "contact layer"
    layers = {name: one.surface_stiffness for name, one in contacts.items() if one.surface_stiffness is not None}
    if not layers:
        return Term(source, "none: no surface_stiffness")
    found: list[Errors] = []
    missing = []
    for factor, word in ((LAYER, "twice"), (1 / LAYER, "half")):
        changes = {name: {"surface_stiffness": factor * size} for name, size in layers.items()}
        run, why = _run(judge.one, {"contact": changes})
        if run is None:
            missing.append(f"{word} the stiffness: {why}")
        else:
            found.append(judge.differences(run, ""))
    if not found:
        return Term(source, f"{MISSING}: {'; '.join(missing)}")
    how = "; ".join(["surface_stiffness halved and doubled, the larger change", *missing])
    names = dict.fromkeys(name for one in found for name in one)
    return judge.term(source, how, {name: max(abs(one.get(name, 0.0)) for one in found) for name in names})


def _extrapolated(judge: Judge, source: str, sides: Sides, components: Sequence[str]) -> Term:
    """Return a term from runs to both sides.

    Args:
        components: Those with another mesh, whose mean edges measure the sizes; if empty, the sizes are `FACTOR`.
    """
    neighbours: list[tuple[float, Errors] | None] = []
    known, missing = [], []
    for changes, word, factor in zip(sides[:2], sides.words, (1 / FACTOR, FACTOR), strict=True):
        run, why = _run(judge.one, changes, components)
        size = factor
        if run is not None and components:
            size = _edge_ratio(judge.one.job, variant(judge.one.job, changes), components)
            word = f"{word} (mean edge × {size:.2f})"
            if math.log(size) / math.log(factor) < LEAST:
                run, why = None, "hardly another mesh"
        if run is not None and (why := judge.renumbered(run)):
            run = None
        (missing if run is None else known).append(f"{word}: {why}" if run is None else word)
        neighbours.append(None if run is None else (size, judge.differences(run, "")))
    if not known:
        return Term(source, f"{MISSING}: {'; '.join(missing)}")
    return _term_of_sides(judge, source, neighbours, (" and ".join(known), missing))


def _term_of_sides(
    judge: Judge, source: str, sides: Sequence[tuple[float, Errors] | None], words: tuple[str, list[str]]
) -> Term:
    """Return a term from the differences of a finer and a coarser run, of which one may be missing.

    Args:
        sides: Size over that of the run of the budget, and differences from it: of the finer, then of the coarser run.
        words: What the runs are, and why one of them is missing.
    """
    able = [one for one in sides if one is not None]
    errors, orders = {}, {}
    for name in able[0][1]:
        if all(name in one[1] for one in able):
            finer, coarser = (None if one is None else Neighbour(one[0], one[1][name]) for one in sides)
            estimate = extrapolated(finer, coarser, judge.signed(name))
            errors[name] = estimate.error
            orders |= {} if estimate.order is None else {name: estimate.order}
    known, missing = words
    how = f"{known}, extrapolated" + (" with order 1" if missing else " with the observed order")
    return judge.term(source, "; ".join([how, *missing]), errors, orders)


def _panels(judge: Judge) -> Term:
    """Compare with fields whose capacitances are greater by their estimated error by panels."""
    source = "panels"
    run, why = _run(judge.one, changed_grids(judge.one.job, by_panels))
    if run is None:
        return Term(source, f"{MISSING}: {why}")
    how = "capacitances greater by what their own coarse panels estimate that they lack"
    return judge.term(source, how, judge.differences(run, ""))


def _grid(judge: Judge) -> Term:
    """Compare with fields of every second point of their grids of poses."""
    source = "grid"
    changes = changed_grids(judge.one.job, by_points)
    if not changes:
        return Term(source, f"{MISSING}: no axis of a grid has {LEAST_POINTS} points, of which every second could do")
    run, why = _run(judge.one, changes)
    if run is None:
        return Term(source, f"{MISSING}: {why}")
    how = f"every second point of axes of {LEAST_POINTS} and more, its difference over {FALL:g}: forces are of order 3"
    return judge.term(source, how, {name: size / FALL for name, size in judge.differences(run, "").items()})


def _run(one: Point, changes: dict[str, Any], meshed: Collection[str] = ()) -> tuple[Trajectory | None, str]:
    """Return the run of a setting with further changes; None, and why, if it fails or takes too long.

    It has the window of the setting's own run, so that both tell the same impacts apart.
    """
    assert one.timed is not None
    try:
        if one.job.scene.contact and (window := system_of(one.job).window):
            changes = changes | {"run": changes.get("run", {}) | {"window": window}}
        job = variant(one.job, changes)
        if meshed and (growth := _nodes(job, meshed) / _nodes(one.job, meshed)) ** GROWTH > DEARER:
            return None, f"{growth:.1f} times as many nodes, which take more than {DEARER:g} times as long"
        run = made(job, max(PATIENCE, DEARER * one.timed.cpu))
    except (InputError, SceneError, StageError, SolverError) as error:
        return None, reason(one.job, error)
    return (run, "") if run.result == "FINISHED" else (None, f"the run ends as {run.result}")


def _elastic(job: Job) -> dict[str, Any]:
    components = {name: job.scene.component[name] for name in job.components()}
    return {
        name: one.modes
        for name, one in components.items()
        if one.geometry.kind != "rigid" and one.modes.reduction != "rigid"
    }


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
