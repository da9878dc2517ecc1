"""Runs one robustness case of a scene of bodies, and collects the numbers that the rules read."""

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
from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.modaldb.records.trajectory import CLOSING, Trajectory
from gudgeon.pipeline.errors import InputError, PipelineError, StageError
from gudgeon.pipeline.robustness.evidence import (
    Evidence,
    FirstContact,
    Impacts,
    Refusal,
    contrast_of,
    exchanged_of,
    first_contact,
    passing_of,
    readings_of,
    restitution_of,
    rise_of,
    unrest_of,
)
from gudgeon.pipeline.robustness.rules import Compared
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.change import change_estimates, largest_changes, refuse_reuse
from gudgeon.pipeline.stages.job import Job, grids_of
from gudgeon.pipeline.stages.keys.products import Product, component_products
from gudgeon.pipeline.stages.make import keep
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.capabilities import INTEGRATORS
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.obstacles import Bore
from gudgeon.solver.result import Result
from gudgeon.solver.scene.run import LEAST_WINDOW
from gudgeon.solver.simulate import simulate, suggested
from gudgeon.solver.system.system import System

REFUSALS = (PipelineError, SceneError, SolverError, modaldb.ModalDBError)
ROUND_OFF = 1e-9
"""Overlap relative to the displacement of the contact's points that counts as none."""
WHOLE = ("macneal", "normal+static", "rubin")
"""Reductions whose first coordinates are normal modes of the whole mesh."""
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
    return _read(job, system, trajectory, modes)


def simulated(job: Job, tell: Callable[[str, float], None]) -> tuple[System, Trajectory]:
    """Return the compiled scene of a job and its run, from the database or made now."""
    run_job(job, "morph", tell)
    refuse_reuse(job)
    system, product = system_of(job), job.trajectory()
    if not job.store.has(product.key):
        found = simulate(system, lambda fraction: tell("solve", fraction))
        keep(job.store, product, found)
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


def _read(job: Job, system: System, trajectory: Trajectory, modes: Mapping[str, ModalRecord]) -> Evidence:
    """Return the evidence of a run."""
    trajectory = replace(
        trajectory, **{part: system.of_records(getattr(trajectory, part)) for part in ("frames", "velocities")}
    )
    eps = float(np.finfo(float).eps)
    elastic = {name: record for name, record in modes.items() if len(record.angular_frequencies)}
    exchanged = exchanged_of(trajectory)
    lagging = bool(system.dashpot.any())  # It recovers with a delay: its energy and depth are not in these figures.
    deepest, depth, allowed = (None, None, None) if lagging else _penetration(system, trajectory)
    moved = any(body.rigid_count for body in system.bodies.values())
    pushed = any(history.force.any() for history in trajectory.contacts.values()) or bool(trajectory.joints)
    estimates = [
        float(np.nanmax(r.discretisation_errors[: r.normal_count]))
        for r in elastic.values()
        if r.discretisation_errors is not None and np.isfinite(r.discretisation_errors[: r.normal_count]).any()
    ]
    contact = first_contact(trajectory)
    shares = [
        abs(value) / entry["tolerance"]
        for entry in change_estimates(job).values()
        for value in largest_changes(entry).values()
    ]
    checks = [float(r.quality["orthogonality"]) for r in elastic.values() if "orthogonality" in r.quality]
    return Evidence(
        frequencies={n: r.angular_frequencies[: r.normal_count] for n, r in elastic.items() if r.reduction in WHOLE},
        shear={n: part.lame[1] for n in elastic if (part := job.scene.component[n].material) is not None},
        contrast=contrast_of(job.scene.component[n].material for n in elastic),
        passing=passing_of(system.scene.run.accuracy, trajectory),
        estimated=max(estimates, default=None),
        orthogonality=max(checks, default=None),
        contact=contact,
        readings=readings_of(trajectory),
        impacts=_impacts(system, trajectory),
        integrator=str(trajectory.counts["integrator"]),
        energy_drift=trajectory.energy_drift,
        momentum_residual=trajectory.momentum_residual if moved and pushed else None,
        momentum_round_off=_last_digit(system, trajectory),
        pulled=any(system.scene.run.gravity),
        energy_round_off=eps * float(np.abs(trajectory.energies).max(initial=0.0)) / exchanged
        if exchanged > 0
        else 0.0,
        force_round_off=_ringing(system, trajectory, contact),
        gap_round_off=_blur(system),
        rise=None if lagging else rise_of(trajectory),
        loss=float(trajectory.energies[-1, 3]) if len(trajectory.energies) else 0.0,
        exchanged=exchanged,
        unrest=unrest_of(trajectory),
        deepest=deepest,
        penetration=depth,
        penetration_bound=allowed,
        basis=trajectory.estimates.get("basis.impulse"),
        mesh=trajectory.estimates.get("mesh.impulse"),
        stepped=trajectory.estimates.get("step.impulse" if trajectory.contacts else "step.motion"),
        changed=max(shares, default=None),
        turned=_turned(system, trajectory),
        condition=_condition(system),
        steps=int(trajectory.counts.get("steps_taken", trajectory.counts["steps"])),
        substeps=int(trajectory.counts["substeps"]),
        step=float(trajectory.counts["step"]),
    )


def _last_digit(system: System, trajectory: Trajectory) -> float:
    """Return the round-off of the largest momentum over the impulse of all contacts."""
    impulse = sum(
        float(np.linalg.norm(history.force, axis=1).sum()) * float(trajectory.times[0])
        for history in trajectory.contacts.values()
    )
    speed = max((float(np.abs(trajectory.velocities[:, k]).max(initial=0.0)) for k in system.rigid), default=0.0)
    masses = [body.morph.mass for body in system.bodies.values()]
    return float(np.finfo(float).eps) * max(masses) ** 0.5 * speed / impulse if impulse > 0 else 0.0


def _ringing(system: System, trajectory: Trajectory, contact: FirstContact | None) -> float:
    """Return the relative round-off of the contact force, from that of frequencies; docs/robustness.md derives it."""
    damped = bool(system.dashpot.any())  # Vibration decays before its phase has an error.
    exact = math.isinf(INTEGRATORS[trajectory.counts["integrator"]].order)
    if contact is None or not exact or system.shortest_period == 0 or damped:
        return 0.0
    phase = float(np.finfo(float).eps) * (2 * np.pi * contact.duration / system.shortest_period) ** 2 / (2 * np.pi)
    elastic, worst = system.stiffness > 0, 0.0
    yields, multipliers = system.residual.diagonal() + system.layer, _multipliers(system, trajectory)
    maxima = multipliers.max(axis=0, initial=0.0)
    for row in np.flatnonzero((yields > 0) & (maxima > 0)):
        paths = np.abs(trajectory.frames[multipliers[:, row] > 0][:, elastic]) @ np.abs(system.rows[row][elastic])
        worst = max(worst, float(paths.max()) / float(yields[row] * maxima[row]))
    return phase * worst


def _blur(system: System) -> float:
    """Return the round-off of the points' positions over the least gap; 0 if points touch at the start."""
    positions = [float(np.abs(c.points + system.scene.body[c.body].position).max()) for c in system.contacts]
    smallest_gap = float(system.gap.min(initial=np.inf))
    return float(np.finfo(float).eps) * max(positions) / smallest_gap if positions and smallest_gap > 0 else 0.0


def _penetration(system: System, trajectory: Trajectory) -> tuple[float | None, float | None, float | None]:
    """Return the deepest overlap at frames, that nearest to its bound, and this bound [m]; None if bodies move far."""
    plain = [contact for contact in system.contacts if contact.master is None]
    if not plain or not len(trajectory.frames) or INTEGRATORS[trajectory.counts["integrator"]].turns:
        return None, None, None
    paths = trajectory.frames @ system.rows.T
    multipliers = _multipliers(system, trajectory)
    depth = -(system.gap + paths + multipliers @ system.residual)
    for contact in filter(system.edged, plain):  # A point that is nearer to an edge is none of this face.
        depth[:, contact.rows][system.beyond(contact, trajectory.frames) > 0] = -np.inf
    start = 0.5 * float(system.velocity @ system.velocity + system.stiffness @ system.position**2)
    start += system.start_contact_energy
    energy = max(start, float((start + trajectory.energies[:, 4]).max(initial=0.0)))
    if system.fields.names and len(trajectory.energies):
        # All energy but that of fields, which may fall without limit, is positive: what contacts hold is at most this.
        total = trajectory.energies @ (1.0, 1.0, 1.0, 1.0, -1.0)
        energy = max(energy, float(total.max() + trajectory.energies[:, 4].max() - trajectory.energies[:, 1].min()))
    speed = float(np.abs(np.vstack([system.velocity, trajectory.velocities]) @ system.rows.T).max())
    slack = ROUND_OFF * float(np.abs(paths).max() + system.gap.max(initial=0.0) + speed * trajectory.times[-1])
    # What presses bodies on each other would move them by so much in a step, if contact did not prevent it.
    pulled = float(np.abs((multipliers @ system.rows) @ system.rows.T).max(initial=0.0))
    slack += ROUND_OFF * float(trajectory.counts["step"]) ** 2 * pulled
    # The explicit integrator ends a frame half a step after its contact forces.
    slack += 0.5 * trajectory.counts["step"] * speed if INTEGRATORS[trajectory.counts["integrator"]].staggered else 0.0
    slack += _late(system, trajectory, multipliers)
    rows = np.concatenate([np.arange(contact.rows.start, contact.rows.stop) for contact in plain])
    stiffness, exponent = system.law[rows, 0], system.law[rows, 1]
    yields = np.sqrt(2 * energy * system.layer[rows])
    # Rigid contact holds the velocity: places have the error that its integrator promises of what bodies yield.
    rigid = (system.compliance.diagonal()[rows] == 0) & (stiffness == 0)
    yields[rigid] = INTEGRATORS[trajectory.counts["integrator"]].promised_drift * _approach(system, trajectory)
    lawful = (stiffness > 0) & (system.layer[rows] == 0)
    yields[lawful] = ((exponent[lawful] + 1) * energy / stiffness[lawful]) ** (1 / (exponent[lawful] + 1))
    overlap = depth[:, rows].max(axis=0)
    worst = int(np.argmax(overlap - yields))
    return max(float(overlap.max()), 0.0), max(float(overlap[worst]), 0.0), float(yields[worst] + slack)


def _approach(system: System, trajectory: Trajectory) -> float:
    """Return how far bodies would overlap at frames if they did not deform [m]: their elastic approach."""
    paths = trajectory.frames[:, system.rigid] @ system.rows.dense()[:, system.rigid].T
    return max(0.0, -float((system.gap + paths).min()))


def _late(system: System, trajectory: Trajectory, multipliers: np.ndarray) -> float:
    """Return by how much R may yield more than R λ [m], β ẇ of points under their forces `multipliers` (f, c)."""
    beta = max((body.stiffness_factor for body in system.bodies.values()), default=0.0)
    speeds = np.abs(trajectory.velocities @ system.rows.T)[multipliers > 0]
    return min(beta * float(speeds.max(initial=0.0)), float(np.abs(multipliers @ system.residual).max(initial=0.0)))


def _multipliers(system: System, trajectory: Trajectory) -> np.ndarray:
    """Return the contact force of every row at each frame [N], (f, c)."""
    forces = np.zeros((len(trajectory.frames), len(system.gap)))
    for contact in system.contacts:
        forces[:, contact.rows] = trajectory.contacts[contact.name].multipliers
    return forces


def _turned(system: System, trajectory: Trajectory) -> float | None:
    """Return the largest rotation of a body at a frame over the limit of the scene; None where no body can turn."""
    bodies = [body for body in system.bodies.values() if body.twists[:, 3:].any()]
    angles = [np.linalg.norm(body.centre_motion(trajectory.frames[:, body.rigid])[:, 3:], axis=1) for body in bodies]
    largest = max((float(magnitudes.max(initial=0.0)) for magnitudes in angles), default=None)
    return None if largest is None else largest / system.scene.run.limits.angle


def _condition(system: System) -> float | None:
    """Return the condition number of the matrix from which contact forces are computed, at unit diagonal."""
    if not len(system.gap):
        elastic = system.stiffness[system.stiffness > 0]
        return float(elastic.max() / elastic.min()) if len(elastic) else None
    yields, rows = system.compliance, system.rows
    matrix = yields.dense() if yields.diagonal().min() > 0 else rows.dense() @ rows.dense().T
    size = np.sqrt(matrix.diagonal())
    values = np.linalg.eigvalsh(matrix / np.outer(size, size))
    return float(values[-1] / values[0]) if values[0] > 0 else float("inf")


def _impacts(system: System, trajectory: Trajectory) -> Impacts | None:
    """Return the impacts that closed forms describe; None if there are none."""
    if len(system.contacts) != 1 or len(system.gap) != 1:
        return None
    scene, contact = system.scene, system.contacts[0]
    settings, row, square = scene.contact[contact.name], system.rows[0], float(system.rows[0] @ system.rows[0])
    rigid = not (system.stiffness > 0).any()
    impact = settings.method == "impact"
    separate = system.window <= LEAST_WINDOW * scene.run.duration
    if settings.friction is not None or not (rigid or impact):
        return None
    e = settings.restitution if impact else restitution_of(settings)
    forced = any(scene.run.gravity) or bool(scene.force)
    impacts = trajectory.impacts.get(contact.name)
    closing = impacts[:, CLOSING] if impacts is not None else np.empty(0)
    return Impacts(e, 1 / square, closing, -float(row @ system.velocity), rigid and not forced, impact and separate)
