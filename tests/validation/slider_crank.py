"""Side force of a rigid piston without clearance, (F_gas − m a)·tan β, and the lateral motion and forces of a run."""

from dataclasses import dataclass

import numpy as np

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.stages.job import Job

GRID = 8000
"""Intervals of the time grid of the side force."""


@dataclass(frozen=True)
class CycleHistory:
    """Forces on a piston and its motion over a run of s samples."""

    times: np.ndarray
    """Ends of the sample intervals [s], (s,)."""
    sides: dict[str, np.ndarray]
    """Force of each contact on the piston along the lateral direction, mean over each interval [N], (s,)."""
    lateral: np.ndarray
    """Lateral velocity of the centre [m/s], (s,)."""


@dataclass(frozen=True)
class Mechanism:
    """The rigid piston, its directions and its side force."""

    mass: float
    """[kg]"""
    inertia: float
    """About the axis of tilt [kg m^2]."""
    lateral: np.ndarray
    along: np.ndarray
    """Unit vectors, (3,)."""
    side_force: np.ndarray
    """Side force of a rigid piston at the grid's middles, along `lateral` on the piston [N], (g,)."""
    grid: np.ndarray
    """Edges of the time grid [s], (g + 1,)."""

    @property
    def middles(self) -> np.ndarray:
        return 0.5 * (self.grid[1:] + self.grid[:-1])


def mechanism_of(job: Job, until: float) -> Mechanism:
    """Return the rigid piston of a scene with one slider-crank, and its side force up to a time."""
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
    return Mechanism(
        mass=morph.mass,
        inertia=float(axis @ morph.inertia @ axis),
        lateral=lateral,
        along=along,
        # The walls balance the lateral part of the rod's force.
        side_force=-axial * joint.tangent(middle, pin),
        grid=grid,
    )


def history_of(run: Trajectory, piston: str, mechanism: Mechanism) -> CycleHistory:
    """Return the forces and the motion of a run along the lateral direction."""
    sides = {name: item.force @ mechanism.lateral for name, item in run.contacts.items()}
    return CycleHistory(run.times, sides, run.motion[piston][:, 6:9] @ mechanism.lateral)
