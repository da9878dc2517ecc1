"""Runs one robustness case of a scene of bodies."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon import modaldb
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.records.field import PoseGridRecord
from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.errors import InputError, PipelineError, StageError
from gudgeon.pipeline.robustness.evidence import Evidence, Refusal
from gudgeon.pipeline.robustness.reading import run_evidence
from gudgeon.pipeline.robustness.rules import Compared
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.change import refuse_reuse
from gudgeon.pipeline.stages.job import Job, grids_of
from gudgeon.pipeline.stages.keys.products import Product, component_products
from gudgeon.pipeline.stages.make import keep, keep_for
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.capabilities import INTEGRATORS
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.obstacles import Bore
from gudgeon.solver.result import Result
from gudgeon.solver.simulate import simulate, suggested
from gudgeon.solver.system.system import System

REFUSALS = (PipelineError, SceneError, SolverError, modaldb.ModalDBError)
FINER = 4.0
"""Where a step begins over the one of runs that are compared, where no run finds one."""


@dataclass(frozen=True)
class Trial(Compared):
    """A changed scene to run; `base` is known once the run that it is compared with has ended."""

    job: Any
    meshes: Mapping[str, MeshRecord] = field(default_factory=dict)
    """Meshes of components in place of their own; the records are then not kept."""
    grids: Mapping[str, PoseGridRecord] = field(default_factory=dict)
    """Grids of poses of fields, by the name of the force, in place of their own; the records are then not kept."""
    like: "Trial | None" = None
    """The run that it is compared with; None: the unchanged scene."""


def attempt(
    trial: Trial, scratch: Path, evidence_of: Callable[[Any], Evidence], mesh_of: Callable[[Any, str], Product]
) -> Evidence | Refusal:
    """Run the job of a trial in `scratch`, with its meshes as products by `mesh_of`; an error gives a Refusal."""
    job, start = replace(trial.job, out=scratch), time.perf_counter()
    try:
        if trial.meshes or trial.grids:
            job = _with_grids(replace(job, store=modaldb.open(scratch / "db")), trial)
            for name, mesh in trial.meshes.items():
                keep(job.store, mesh_of(job, name), mesh)
        evidence = evidence_of(job)
    except REFUSALS as error:
        return Refusal(str(error).replace("\n", "; "), time.perf_counter() - start)
    return replace(evidence, seconds=time.perf_counter() - start)


def _with_grids(job: Any, trial: Trial) -> Any:
    """Return a job of another database than the trial's own, with the grids of poses of its fields."""
    forces = dict(getattr(job.scene, "force", {}))
    for name, key in grids_of(job.scene).items():
        grid = trial.grids[name] if name in trial.grids else trial.job.store.get(key, "posegrid")
        field = _copied("field", name, {"of": grid.field_key})
        copied = _copied("posegrid", name, {"of": key, "force": name})
        keep(job.store, field, trial.job.store.get(grid.field_key, "field"))
        keep(job.store, copied, replace(grid, field_key=field.key))
        forces[name] = forces[name].model_copy(update={"record": copied.key})
    return replace(job, scene=job.scene.model_copy(update={"force": forces})) if forces else job


def _copied(kind: str, name: str, inputs: dict[str, Any]) -> Product:
    """Return the product of a changed copy of a record."""
    return Product(kind, name, kind, content_key(inputs), inputs)


def mesh_of_component(job: Any, name: str) -> Product:
    """Return the product of the mesh of a component before any change of design."""
    return component_products(name, job.scene.component[name], job.path.parent)["base-mesh"]


def run_trial(trial: Trial, scratch: Path, tell: Callable[[str, float], None]) -> Evidence | Refusal:
    """Run a trial of a scene of bodies with temporary files in `scratch`; a run that fails gives a Refusal."""
    return attempt(trial, scratch, partial(_solved, tell=tell), mesh_of_component)


def _solved(job: Job, tell: Callable[[str, float], None]) -> Evidence:
    """Return the evidence of a job; a StageError if its run fails physically."""
    system, trajectory = simulated(job, tell)
    if not (outcome := Result[trajectory.result]).ok:
        raise StageError(str(trajectory.counts.get("reason", outcome.value)))
    modes = {name: job.store.get(steps["modes"].key, "modes") for name, steps in job.components().items()}
    return run_evidence(job, system, trajectory, modes)


def simulated(job: Job, tell: Callable[[str, float], None]) -> tuple[System, Trajectory]:
    """Return the compiled scene of a job and its run, from the database or made now."""
    run_job(job, "morph", tell)
    refuse_reuse(job)
    system, product = system_of(job), job.trajectory()
    if not job.store.has(product.key):
        trajectory = simulate(system, lambda fraction: tell("solve", fraction))
        keep_for(job, product, trajectory)
    return system, job.store.get(product.key, "trajectory")


def found_step(job: Job) -> float:
    """Return the step that a run finds for its accuracy, or a share of where it begins if it fails [s]."""
    system, trajectory = simulated(job, lambda stage, fraction: None)
    if Result[trajectory.result].ok and (step := float(trajectory.counts["step"])) > 0:
        return step / int(trajectory.counts["substeps"])
    return suggested(system) / FINER


def stepped(job: Job) -> list[str]:
    """Return the integrators that support a scene and have a step."""
    return [name for name in job.scene.alternatives() if math.isfinite(INTEGRATORS[name].order)]


def suggested_step(job: Job) -> float:
    """Return the step that a scene's integrator chooses by itself [s].

    Raises:
        InputError: the scene cannot be run with it.
    """
    try:
        return suggested(system_of(job))
    except SolverError as error:
        raise InputError(str(error)) from error


def sizes(job: Job) -> dict[str, int]:
    """Return the numbers of contact points and of coordinates of a scene."""
    return dict(zip(("points", "coordinates"), system_of(job).rows.shape, strict=True))


def approach(job: Job) -> tuple[np.ndarray, float, float]:
    """Return the direction of the first contact's force on its body (3,), its least gap and the body's size [m]."""
    system = system_of(job)
    contact = system.contacts[0]
    row = int(system.gap[contact.rows].argmin())
    arms = contact.points - system.bodies[contact.body].morph.centre
    size = float(np.linalg.norm(arms, axis=1).max()) or 1.0
    return contact.directions[row], float(system.gap[contact.rows][row]), size


def into_gap(job: Job, position: list[float], gap: float) -> list[float]:
    """Return a position of the first contact's body at which its least gap from a bore is the one given [m].

    The rows of a contact are those of its start: over a path to a curved surface they are off by the path's square.

    Args:
        position: Near it [m], (3,).
    """
    system = system_of(job)
    contact, translation = system.contacts[0], np.array(position)
    against = job.scene.contact[contact.name].against
    if not isinstance(against, Bore):
        return position
    for _ in range(3):  # Another point may then be the nearest one.
        placed = contact.points + translation
        gaps = against.gap(placed)
        row = int(gaps.argmin())
        translation = translation + (gap - gaps[row]) * against.direction(placed)[row]
    translation[np.abs(translation) < np.finfo(float).eps * np.abs(translation).max()] = (
        0.0  # Too small a number for a scene.
    )
    return translation.tolist()


def closing_turn(job: Job) -> np.ndarray:
    """Return the axis (3,), across the first contact's force, of a turn that closes its smallest gap."""
    system = system_of(job)
    contact = system.contacts[0]
    row = int(system.gap[contact.rows].argmin())
    direction, arm = contact.directions[row], contact.points[row] - system.bodies[contact.body].morph.centre
    across = np.cross(direction, np.eye(3)[int(np.abs(direction).argmin())])
    across /= np.linalg.norm(across)
    return -across if direction @ np.cross(across, arm) > 0 else across


def turns_freely(job: Job, name: str) -> bool:
    """Return whether a body has all six rigid motions."""
    return system_of(job).bodies[name].rigid_count == 6
