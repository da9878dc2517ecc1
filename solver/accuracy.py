"""The step of a run from its own results: runs with finer steps are compared until what a user reads has converged.

The error of the finer of two runs is estimated as their difference where the step was halved once, and as half of that
for each further halving. Convergence of impacts is irregular, so that no higher order is assumed.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.integrators.steps import Plan
from gudgeon.solver.result import Result
from gudgeon.solver.system.system import System

ACCURACY = 1e-3
"""Default of run.accuracy where steps are controlled."""
MOST_HALVINGS = 12
"""Largest number of halvings of the first step."""
PATIENCE = 5
"""Halvings after which the differences must have decreased to half of the first."""
LARGEST_JUMP = 3
"""Largest number of halvings at once."""
EXPECTED_ORDER = 1.5
"""Order with which the next step is predicted."""


class Difference(NamedTuple):
    """Relative differences of two runs of one system."""

    impulse: float
    """Largest difference of a contact's impulse up to any time, over its largest impulse between two separations."""
    force: float
    """Difference of a contact's largest windowed force, over that force."""
    motion: float
    """Largest difference of the coordinates at a frame over their largest values; 0 where there are contacts."""


def controlled(system: System, plan: Plan, run: Callable[[Plan], Trajectory]) -> tuple[Trajectory, Plan]:
    """Return the first run whose estimated errors are below an accuracy, and its plan: a given one with halved steps.

    A run whose errors stay above it at every step tried, or do not decrease, ends as `Result.INACCURATE`.

    Args:
        plan: Of the largest steps.
        run: Integrates a plan.
    """
    settings = system.scene.run
    accuracy = settings.accuracy or ACCURACY
    found, halvings, jump, first = run(plan), 0, 1, 0.0
    while True:
        before, halvings = found, halvings + jump
        finer = plan.finer(halvings, settings.samples)
        found = run(finer)
        if found.result not in (Result.FINISHED.name, Result.ENERGY.name):
            return found, finer
        if before.result not in (Result.FINISHED.name, Result.ENERGY.name):
            # A run that ends early with a larger step has no results to compare.
            jump = 1
            if halvings >= MOST_HALVINGS:
                return replace(found, result=Result.INACCURATE.name), finer
            continue
        differences = difference(before, found, system.resolution)
        errors = {f"step.{name}": value / 2 ** (jump - 1) for name, value in differences._asdict().items() if value}
        found = replace(found, estimates=found.estimates | errors)
        error = max(errors.values(), default=0.0)
        worst = max(error, 0.0 if plan.integrator.conserves_energy else found.energy_drift)
        first = first or error
        if worst <= accuracy:
            return found, finer
        if halvings >= MOST_HALVINGS or (halvings >= PATIENCE and error > 0.5 * first):
            return replace(found, result=Result.INACCURATE.name), finer
        needed = math.ceil(math.log2(worst / accuracy) / EXPECTED_ORDER)
        jump = min(max(1, needed), LARGEST_JUMP, MOST_HALVINGS - halvings)


def difference(one: Trajectory, other: Trajectory, window: float) -> Difference:
    """Return the relative differences of two runs, relative to the second, whose samples divide those of the first."""
    interval, impulse, force, motion = float(one.times[0]), 0.0, 0.0, 0.0
    width, ratio = max(1, round(window / interval)), len(other.times) // len(one.times)
    for name, contact in other.contacts.items():
        theirs = contact.force.reshape(-1, ratio, 3).mean(axis=1)
        touching = np.any(theirs, axis=1)
        ours, theirs = (np.cumsum(np.vstack([np.zeros(3), x]), axis=0) for x in (one.contacts[name].force, theirs))
        impulse = max(impulse, _share(np.linalg.norm(ours - theirs, axis=1).max(), _exchanged(theirs, touching)))
        peaks = [np.linalg.norm(sums[width:] - sums[:-width], axis=1).max(initial=0.0) for sums in (ours, theirs)]
        force = max(force, _share(abs(peaks[0] - peaks[1]), peaks[1]))
    if not other.contacts:
        motion = _share(np.abs(one.frames - other.frames).max(), np.abs(other.frames).max())
    return Difference(impulse, force, motion)


def _exchanged(sums: np.ndarray, touching: np.ndarray) -> float:
    """Return the largest change of a sum of forces, (s + 1, 3), between two samples without contact."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], touching, [False]])))
    changes = np.linalg.norm(sums[ends[1::2]] - sums[ends[::2]], axis=1)
    return float(changes.max(initial=0.0))


def _share(apart: float, size: float) -> float:
    """Return a difference relative to a size; 1 where the size alone is zero."""
    return float(apart / size) if size > 0 else float(apart > 0)
