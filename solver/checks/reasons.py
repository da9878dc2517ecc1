"""Why errors of a run by its steps, its modal basis or its meshes are not estimated, in words."""

import math
from dataclasses import replace

from gudgeon.modaldb.records.trajectory import CHANGING, NOT_ESTIMATED, Trajectory
from gudgeon.solver.checks.basis import touches
from gudgeon.solver.checks.readings import readings
from gudgeon.solver.integrators.steps import Plan
from gudgeon.solver.result import Result
from gudgeon.solver.system.bases.swaps import swaps_of
from gudgeon.solver.system.system import System

SOURCES = ("step", "basis", "mesh")
UNCHECKED = "run.checks is false"


def with_reasons(system: System, trajectory: Trajectory, plan: Plan) -> Trajectory:
    """Return a run with the entry `NOT_ESTIMATED` of `counts`: by source, why there is no estimate of its error.

    Args:
        system: The one that was run.
        trajectory: Its trajectory.
        plan: Its plan.
    """
    estimated = {name.partition(".")[0] for name in trajectory.estimates}
    reasons = {source: _reason(source, system, trajectory, plan) for source in SOURCES if source not in estimated}
    return replace(trajectory, counts=trajectory.counts | {NOT_ESTIMATED: reasons}) if reasons else trajectory


def _reason(source: str, system: System, trajectory: Trajectory, plan: Plan) -> str:
    if source != "step" and not (system.stiffness > 0).any():
        return "no body deforms"
    if source == "step" and plan.integrator.own_steps and math.isnan(plan.integrator.accuracy):
        return "motion between events is exact, and their times are located to round-off"
    if not system.scene.run.checks:
        return UNCHECKED
    if not Result[trajectory.result].ok:
        return "the run did not finish"
    if not touches(system, trajectory) and not readings(system, trajectory):
        return "nothing touches, and nothing is read"
    if source == "step":
        if plan.integrator.own_steps or plan.fixed_step is not None:
            return "no run of another accuracy or step ends, or it is equal to this one"
        return "runs with other steps are equal to it"
    if swaps_of(system) is not None:
        return CHANGING
    if source == "basis":
        return "no body has a mode that could be left out"
    return "the elements of no body have an estimate"
