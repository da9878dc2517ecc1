"""Piston slap in a report: the mechanism of a scene, and how a run differs from the full-FE run over the cycle."""

import numpy as np

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.report.slap.slaps import Mechanism, differences, history_of, windowed
from gudgeon.pipeline.stages.job import Job

GRID = 8000
"""Intervals of the common time grid over a run."""
AGREE = 0.05
"""Relative difference of forces from which two full-FE runs are no longer the same."""


def mechanism_of(job: Job, until: float) -> Mechanism:
    """Return the rigid piston of a scene with one slider-crank, and its side force (F_gas − m a)·tan β up to a time."""
    ((_, joint),) = job.scene.joint.items()
    body = job.scene.body[joint.body]
    steps = job.components()[job.scene.component_of(joint.body)]
    morph = job.store.get(steps["morph"].key, "morph", only=["mass", "inertia"])
    modal = job.store.get(steps["modes"].key, "modes", only=["loads"])
    along, lateral = joint.axes
    grid = np.linspace(0.0, until, GRID + 1)
    middle = 0.5 * (grid[1:] + grid[:-1])
    pin = float((modal.loads[joint.interface].point + np.asarray(body.position)) @ lateral)
    axial = morph.mass * (joint.piston_pin(middle, pin)[:, 2] - float(np.asarray(job.scene.run.gravity) @ along))
    for force in job.scene.gas().values():
        if force.body == joint.body:
            per_pascal = float(modal.loads[force.interface].resultant[0, :3] @ along)
            axial = axial - per_pascal * force.pressure(joint.angle(middle))
    axis = np.cross(along, lateral)
    # The walls hold against the rod's lateral part.
    side = -axial * joint.tangent(middle, pin)
    return Mechanism(morph.mass, float(axis @ morph.inertia @ axis), lateral, along, side, grid, 4 * np.pi / joint.rate)


def cycle_errors(job: Job, run: Trajectory | NodalRecord, reference: Trajectory | NodalRecord) -> dict[str, float]:
    """Return how a run differs from another, the full-FE run; see `differences`. Force over all of it, too."""
    ((_, joint),) = job.scene.joint.items()
    contacts, whole = list(job.scene.contact), job.scene.run.duration
    errors = {}
    for until in (whole, job.scene.report.until or whole):
        mechanism = mechanism_of(job, until)
        ours, theirs = (history_of(item, contacts, joint.body, mechanism) for item in (run, reference))
        found = differences(ours, theirs, mechanism, job.scene.report.window)
        errors = found | {"force, whole run": errors.get("force", found["force"])}
    return errors


def reproducible(job: Job, runs: list[NodalRecord]) -> float:
    """Return up to when the two finest full-FE runs agree to 5 % in force, counted from the start [s]."""
    ((_, joint),) = job.scene.joint.items()
    mechanism = mechanism_of(job, job.scene.run.duration)
    forces = []
    for run in runs[-2:]:
        history = history_of(run, list(job.scene.contact), joint.body, mechanism)
        forces.append(windowed(history, mechanism, job.scene.report.window))
    apart = np.cumsum(((forces[0] - forces[1]) ** 2).sum(axis=0))
    size = np.cumsum((forces[1] ** 2).sum(axis=0))
    # Before the first contact there is nothing to compare.
    over = (apart > AGREE**2 * size) & (size > 1e-2 * size[-1])
    return float(mechanism.grid[1:][int(np.argmax(over))] if over.any() else mechanism.grid[-1])
