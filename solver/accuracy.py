"""The step of a run from its own results: runs with finer steps are compared until what a user reads has converged.

The error of the finer of two runs is estimated as their difference where the step was halved once, and as half of that
for each further halving. Convergence of impacts is irregular, so that no higher order is assumed.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.trajectory import BEGINS, ENDS, IMPULSE, WINDOWED, Trajectory
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
    """Largest difference of the impulses of an impact, over the largest impulse of an impact of its contact."""
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
        differences = difference(before, found, system.window)
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
    """Return the relative differences of two runs, relative to the second.

    Impacts of the two runs are paired where they overlap, or nearly, by half a window [s]; one that is alone differs
    by all its impulse.
    """
    impulse, force, motion = 0.0, 0.0, 0.0
    for name, theirs in other.impacts.items():
        ours = one.impacts[name]
        totals = [np.zeros(2)]
        for pair in _overlapping(ours, theirs, 0.25 * window):
            impulses = [float(part[:, IMPULSE].sum()) for part in pair]
            totals.append(np.array([abs(impulses[0] - impulses[1]), impulses[1]]))
        apart, largest = np.max(totals, axis=0)
        impulse = max(impulse, _share(float(apart), float(largest)))
        peaks = [float(part[:, WINDOWED].max(initial=0.0)) for part in (ours, theirs)]
        force = max(force, _share(abs(peaks[0] - peaks[1]), peaks[1]))
    if not other.contacts:
        motion = _share(np.abs(one.frames - other.frames).max(), np.abs(other.frames).max())
    return Difference(impulse, force, motion)


def _overlapping(ours: np.ndarray, theirs: np.ndarray, margin: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return groups of impacts of two runs, (b, 9) each, whose times with a margin [s] overlap."""
    whose = np.repeat([0, 1], [len(ours), len(theirs)])
    every = np.concatenate([ours, theirs])
    order = np.argsort(every[:, BEGINS], kind="stable")
    whose, every = whose[order], every[order]
    if not len(every):
        return []
    reached = np.maximum.accumulate(every[:, ENDS]) + margin
    starts = np.flatnonzero(every[1:, BEGINS] - margin > reached[:-1]) + 1
    groups = zip(np.split(every, starts), np.split(whose, starts), strict=True)
    return [(group[own == 0], group[own == 1]) for group, own in groups]


def _share(apart: float, size: float) -> float:
    """Return a difference relative to a size; 1 where the size alone is zero."""
    return float(apart / size) if size > 0 else float(apart > 0)
