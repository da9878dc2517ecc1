"""What the grid of poses of a field lacks, estimated from a run with the field of every second pose.

Co-energies are cubic splines over the grid, forces their gradient, of third order in the spacing: of twice the spacing
they have eight times the error, so that a seventh of the difference is the error. Where every second value along an
axis leaves fewer than four, they are of a parabola, of lower order: there all of it is taken.
"""

from dataclasses import replace

import numpy as np

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.checks.basis import Run, differences, fastest_body, touches
from gudgeon.solver.checks.readings import changes, readings
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.forces.fields.co_energy import DEGREE, GRID, CoEnergies, respaced
from gudgeon.solver.result import Result
from gudgeon.solver.system.compile import assembled
from gudgeon.solver.system.system import System

FALL = 7.0
"""Difference of a run with every second pose over the error of all of them: forces of cubic splines are of order 3."""
FALL_OF_FEW = 1.0
"""The same where an axis has so few that its splines are of lower order."""


def with_grid_estimates(system: System, trajectory: Trajectory, run: Run) -> Trajectory:
    """Return a finished run with its estimated relative errors due to the grids of poses of its fields.

    Args:
        system: The one that was run.
        trajectory: Its trajectory.
        run: Integrates another system.

    Returns:
        Its `estimates` with `grid.NAME.KIND` of each reading, and `grid.impulse`, `grid.force` and `grid.rebound` where
        bodies touch, relative to what those of the basis are; 1 where the other run fails, as of a body that leaves the
        field. Unchanged without fields on grids.
    """
    energies = system.fields.energies
    counts = [int(head[5 + 3 * a]) for head in energies.head if head[0] == GRID for a in range(head[1])]
    if not counts:
        return trajectory
    run_readings, in_contact = readings(system, trajectory), touches(system, trajectory)
    names = [*run_readings, *(("impulse", "force") if in_contact else ())]
    unknown = replace(trajectory, estimates=trajectory.estimates | {f"grid.{name}": 1.0 for name in names})
    try:
        fields = system.fields._replace(energies=_coarser(energies))
        coarse = assembled(system.scene, system.bodies, system.terms, fields=fields, bores=system.bores)
        against = run(coarse, float(trajectory.times[0]))
    except (SceneError, SolverError):
        return unknown
    if not Result[against.result].ok or len(against.times) != len(trajectory.times):
        return unknown
    relative_changes = changes(run_readings, readings(coarse, against))
    if in_contact:
        relative_changes |= differences(trajectory, (trajectory, against), system.windows, fastest_body(system))
    fall = FALL if min(counts) > 2 * DEGREE else FALL_OF_FEW
    errors = {f"grid.{name}": value / fall for name, value in relative_changes.items()}
    return replace(trajectory, estimates=trajectory.estimates | errors)


def _coarser(energies: CoEnergies) -> CoEnergies:
    """Return fields on the same grids, with the co-energies of splines of every second pose at its poses."""
    data = energies.data.copy()
    for head in energies.head:
        if head[0] == GRID:
            respaced(head, data, every_second)
    return energies._replace(data=data)


def every_second(count: int) -> np.ndarray:
    """Return the numbers of every second of some poses, with the last one."""
    return np.unique([*range(0, count, 2), count - 1])
