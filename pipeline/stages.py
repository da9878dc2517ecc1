"""The stages `mesh → modes → morph → solve → plot`: what is fresh is not made again. Starts the solver."""

import copy
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter

from modaldb.schema import MorphRecord
from modaldb.store import FolderStore
from pipeline.checks import checked, law_notes
from pipeline.component import Component
from pipeline.errors import InputError, StageError
from pipeline.extremes.settings import Stress
from pipeline.kinds import Place, open_job, run
from pipeline.pictures import plot_stage
from pipeline.products import STAGES, Product, combined, component_products, plot_inputs, solve_product
from pipeline.reporting import Plot, Report
from pipeline.runreport import Progress, RunReport, StageReport
from pipeline.scenefile import merge, named
from pipeline.status import remember, status
from pipeline.study.document import Document
from pipeline.study.effort import Effort
from pipeline.textfile import copy_file
from solver.errors import SceneError, SolverError
from solver.obstacles import Obstacle
from solver.result import Result
from solver.scene import Body, Scene, carriers

__all__ = ["Job", "RunReport", "SceneError", "SolverError", "open_job", "plan", "run", "run_job", "status"]

PLACES = {
    "points": "interfaces", "patch": "interfaces", "traction": "tractions",
    "mean": "loads", "pressure": "loads", "tie": "loads",
}  # fmt: skip
"""Group of a modal record in which an interface of each kind stands."""
EDGE_SHARE = 1e-3
"""Share of a contact's impulse at the edge of its interface from which a run says so."""
if TYPE_CHECKING:
    import numpy as np


class SceneFile(Scene):
    """A whole scene file."""

    component: dict[str, Component]
    report: Report = Report()
    plot: Plot = Plot()
    stress: Stress = Stress()


@dataclass(frozen=True)
class Job:
    """A scene with the places where its products go."""

    name: str
    path: Path
    tables: dict[str, Any]
    """The scene as written, overrides included."""
    scene: SceneFile
    store: FolderStore
    out: Path
    overrides: tuple[str, ...] = ()
    """Changes of the scene's file, as `--set` takes them."""

    @property
    def folder(self) -> Path:
        """Folder of the scene file."""
        return self.path.parent

    @property
    def stages(self) -> tuple[str, ...]:
        """Names of its stages, in order."""
        return STAGES

    def components(self) -> dict[str, dict[str, Product]]:
        """Return the products of every component that a body uses."""
        used = {self.scene.component_of(body) for body in self.scene.body}
        with named(self.path, InputError):
            return {
                name: component_products(name, component, self.folder)
                for name, component in self.scene.component.items()
                if name in used
            }

    def compared(self) -> dict[str, "Job"]:
        """Return the runs that the pictures compare this one with."""
        return {name: variant(self, changes) for name, changes in self.scene.plot.compare.items()}

    def pictures(self) -> dict[str, Any]:
        """Return everything that the pictures depend on."""
        others = {name: job.trajectory().key for name, job in self.compared().items()}
        return plot_inputs(self.trajectory().key, others | {"": self.scene.plot.label} if others else {})

    def dynamics(self) -> dict[str, Any]:
        """Return the solver's part of the scene, as JSON."""
        return self.scene.model_dump(mode="json", include={*Scene.model_fields})

    def trajectory(self) -> Product:
        """Return the product of the solve stage."""
        return solve_product(
            self.name, self.dynamics(), {n: steps["morph"].key for n, steps in self.components().items()}
        )

    def products(self, stages: Sequence[str]) -> dict[str, Product]:
        """Return what some of the stages make, by place: component and step, or the scene's own."""
        found = {
            f"{name}.{step}": product
            for name, steps in self.components().items()
            for step, product in steps.items()
            if product.stage in stages
        }
        return found | ({"solve": self.trajectory()} if "solve" in stages else {})

    def run(self, until: str = "plot", progress: Progress | None = None) -> RunReport:
        """Bring the products up to date, up to and including one stage."""
        return run_job(self, until, progress)

    def plan(self) -> dict[str, Any]:
        """Return what the solver will read of each record, what it leaves out and why, and the bytes of both."""
        return plan(self)

    def report(self, how: Effort, progress: Progress) -> Document:
        """Run every setting of the scene's sweep, write the report's files and keep it in the database."""
        if self.scene.report.vectors is not None:
            from pipeline.vectors.report import vectors_report

            return vectors_report(self, how, progress)
        if not (self.scene.contact or self.scene.force or self.scene.joint or self._is_rigid()):
            from pipeline.study.frequencies import frequencies_report

            return frequencies_report(self, how, progress)
        from pipeline.study.report import report_job

        return report_job(self, how, progress)

    def _is_rigid(self) -> bool:
        return all(self.scene.component[name].geometry.kind == "rigid" for name in self.components())

    def stress(self, cases: Path | None, only: tuple[str, ...], progress: Progress) -> tuple[dict[str, Any], str]:
        """Put the scene to its extremes and return the document and its table as text."""
        from pipeline.extremes.stress import stress_job

        return stress_job(self, cases, only, progress)

    def export(self, what: str, every: int) -> list[Path]:
        """Write mode shapes (`modes`) or results (`results`) of every body as .vtu files."""
        from pipeline.export import export

        return export(self, what, every)


def contact_job(place: Place) -> Job:
    """Return the job of a scene of bodies in contact.

    Raises:
        InputError: the scene is wrong; every mistake is listed.
    """
    return Job(place.name, place.path, place.tables, checked(place.path, place.tables, SceneFile), place.store,
               place.out, place.overrides)  # fmt: skip


def variant(job: Job, changes: Mapping[str, Any]) -> Job:
    """Return the job with nested tables of changes put into its scene."""
    tables = copy.deepcopy(job.tables)
    merge(tables, changes)
    return replace(job, tables=tables, scene=checked(job.path, tables, SceneFile))


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


def plan(job: Job) -> dict[str, Any]:
    """Return what the solver will read of each record, what it leaves out and why, and the bytes of both."""
    from solver.terms import Stock, scene_terms

    rows, read, seen, components = [], 0, {}, job.components()
    stocks = {}
    for body in job.scene.body:
        component = job.scene.component[job.scene.component_of(body)]
        places = [f"{PLACES[item.kind]}/{name}" for name, item in component.interface.items()]
        places += [f"gauges/{name}" for name in component.gauge]
        stocks[body] = Stock(component.geometry.kind != "rigid", bool(component.supports), tuple(places))
    for term in scene_terms(job.scene, stocks):
        steps = components[job.scene.component_of(term.body)]
        keys = {"mesh": steps["mesh"].key, "modes": steps["modes"].key, "morph": steps["morph"].key}
        sizes = [_field_bytes(job.store, keys, path) for path in term.fields]
        size = None if None in sizes else sum(size for size in sizes if size is not None)
        rows.append(
            {"body": term.body, "term": term.name, "present": term.present, "reason": term.reason,
             "fields": list(term.fields), "bytes": size}
        )  # fmt: skip
        if term.present:
            seen |= {(term.body, path): size for path, size in zip(term.fields, sizes, strict=True)}
    read = None if None in seen.values() else sum(size for size in seen.values() if size is not None)
    return {"scene": job.name, "terms": rows, "bytes": read}


def obstacle_of(against: Mapping[str, Any]) -> Obstacle:
    """Return the obstacle that a contact's `against` table describes: its gap and gap direction at any points."""
    return TypeAdapter(Obstacle).validate_python(against)


def basic_surface(chart: Mapping[str, Any], position: "np.ndarray") -> Obstacle:
    """Return the undeformed surface of a traction space's chart on a body that stands at `position` [m], (3,)."""
    from solver.contacts import basic_surface as surface_of

    return surface_of(chart, position)


def carriers_of(scene: Scene) -> list[str]:
    """Return the integrators that can carry a scene."""
    return list(carriers(scene))


def free_twists(job: Job, body: str) -> "np.ndarray":
    """Return the mass-normalised rigid motions that a scene leaves a body, (r, 6)."""
    key = job.components()[job.scene.component_of(body)]["morph"].key
    morph = job.store.get(key, "morph", only=["mass", "inertia", "rigid_twists"])
    return twists_from(morph, job.scene.body[body].model_dump(), body)


def twists_from(morph: MorphRecord, settings: Mapping[str, Any], name: str) -> "np.ndarray":
    """Return the same from a design and a body's table in a scene."""
    from solver.body import free_twists as twists_of

    return twists_of(morph, Body.model_validate(settings), name)


def _field_bytes(store: FolderStore, keys: dict[str, str], path: str) -> int | None:
    record, _, field_path = path.partition(":")
    if not store.has(keys[record]):
        return None
    sizes = store.sizes(keys[record])
    return sum(size for name, size in sizes.items() if name == field_path or name.startswith(f"{field_path}/"))


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
        from pipeline.mesh import build_mesh

        return build_mesh(component, job.folder, name)
    from pipeline import morph
    from pipeline.mesh import movement_of

    base = job.store.get(steps["base-mesh"].key, "mesh")
    movement = movement_of(component, job.folder, name)
    if step == "mesh":
        assert movement is not None
        return morph.moved_mesh(base, movement)
    if step == "modes":
        from pipeline.reduce import reduce_component

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
    from pipeline.summary import read_summary, reference_values, write_summary

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
    from solver.simulation import simulate
    from solver.system import compile_system

    tell("solve", 0.0)
    morphs = {name: steps["morph"].key for name, steps in job.components().items()}
    trajectory = simulate(compile_system(job.store, job.scene, morphs), lambda share: tell("solve", share))
    job.store.put(product.key, product.kind, trajectory, product.inputs)
    return True


def _draw(job: Job, tell: Progress) -> tuple[list[Path], list[str]]:
    """Draw the pictures, after running what they compare the job with."""
    from pipeline.plots import render

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
    from pipeline.frequency_table import coarse_notes, frequency_rows, kept_modes

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
