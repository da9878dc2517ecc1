"""Piston slap in a report: the mechanism of a scene, and how a run differs from the nodal synthesis over the cycle."""

import numpy as np

from modaldb.schema import NodalRecord, Trajectory
from pipeline.slaps import Mechanism, differences, history_of
from pipeline.stages import Job

GRID = 8000
"""Intervals of the common time grid over a run."""


def mechanism_of(job: Job) -> Mechanism:
    """Return the rigid piston of a scene with one slider-crank, and its side force (F_gas − m a)·tan β."""
    ((_, joint),) = job.scene.joint.items()
    body = job.scene.body[joint.body]
    steps = job.components()[job.scene.component_of(joint.body)]
    morph = job.store.get(steps["morph"].key, "morph", only=["mass", "inertia"])
    modal = job.store.get(steps["modes"].key, "modes", only=["loads"])
    along, lateral = joint.axes
    grid = np.linspace(0.0, job.scene.run.duration, GRID + 1)
    middle = 0.5 * (grid[1:] + grid[:-1])
    pin = float((modal.loads[joint.interface].point + np.asarray(body.position)) @ lateral)
    axial = morph.mass * (joint.piston_pin(middle, pin)[:, 2] - float(np.asarray(job.scene.run.gravity) @ along))
    for force in job.scene.force.values():
        if force.body == joint.body:
            per_pascal = float(modal.loads[force.interface].resultant[0, :3] @ along)
            axial = axial - per_pascal * force.pressure(joint.angle(middle))
    axis = np.cross(along, lateral)
    # The walls hold against the rod's lateral part.
    side = -axial * joint.tangent(middle, pin)
    return Mechanism(morph.mass, float(axis @ morph.inertia @ axis), lateral, along, side, grid)


def cycle_errors(job: Job, run: Trajectory | NodalRecord, reference: NodalRecord) -> dict[str, float]:
    """Return how a run differs from the nodal synthesis over the cycle; see `differences`."""
    mechanism, contacts = mechanism_of(job), list(job.scene.contact)
    ((_, joint),) = job.scene.joint.items()
    ours, theirs = (history_of(item, contacts, joint.body, mechanism) for item in (run, reference))
    return differences(ours, theirs, mechanism, job.scene.report.window)
