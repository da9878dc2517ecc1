"""Derivatives of quantities of a run with respect to any parameter of its system.

A run depends on a parameter p through the arrays of its model: motion over a step, rows, residual flexibility, layers,
laws, gaps, loads and the state at the start. The pass back over its steps gives the derivatives of a quantity J by all
of these at once;

    dJ/dp = ∂J/∂p + Σ ∂J/∂a · da/dp,

with da/dp by differences of fourth order of the arrays, which no step is taken for, and ∂J/∂p by those of J with the
states as they are.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.flight import flight
from gudgeon.solver.integrators.small.integrator import Small
from gudgeon.solver.integrators.small.tape import Gradient
from gudgeon.solver.integrators.steps import Plan, plan_run
from gudgeon.solver.linear.load_stiffness import with_load_stiffness
from gudgeon.solver.ports.rest import at_rest
from gudgeon.solver.sensitivity.readings import Read, Reading, Steps
from gudgeon.solver.sensitivity.refusals import refuse_arrays, refuse_grazing
from gudgeon.solver.system.system import System

WEIGHTS: Mapping[int, float] = {-2: 1 / 12, -1: -2 / 3, 1: 2 / 3, 2: -1 / 12}
"""Weights of values at these multiples of a step in the difference of fourth order, over the step."""
FLIGHT_STEP = 4e-3
"""Largest relative change of ω² and c in differences of the motion over a step."""
LARGEST_TAPE = 2**31
"""Bytes of the states of a run, at most."""


def difference(values: Mapping[int, Any], step: float) -> Any:
    """Return the derivative of fourth order from numbers or arrays at multiples of a step, those of `WEIGHTS`."""
    return sum((WEIGHTS[k] / step) * value for k, value in values.items())


def prepared(system: System) -> System:
    """Return a system as a run starts it."""
    return at_rest(with_load_stiffness(system))


def plan_of(system: System) -> Plan:
    """Return the steps of a system in the loop over ports: run.step, or the default."""
    run = system.scene.run.model_copy(update={"integrator": "small"})
    return plan_run(replace(system, scene=system.scene.model_copy(update={"run": run})))


@dataclass(frozen=True)
class Differentiated:
    """A run with the derivatives of quantities by the arrays of its model."""

    steps: Steps
    reads: list[Read]
    readings: list[Reading]
    gradients: list[Gradient]

    def slopes(self, varied: Mapping[int, System], step: float) -> np.ndarray:
        """Return the derivative of each quantity by a parameter, (q,).

        Args:
            varied: Systems, `prepared`, with the parameter moved by multiples of a step, those of `WEIGHTS`.
            step: Of the parameter, in its unit.
        """
        count = len(self.steps.tape.mean)
        models = {k: Small(system, self.steps.dt).model(count) for k, system in varied.items()}
        changes = {
            name: difference({k: getattr(m, name) for k, m in models.items()}, step) for name in Gradient._fields
        }
        changes |= self._flight_changes(varied, step)
        totals = np.empty(len(self.reads))
        for i, (read, gradient) in enumerate(zip(self.reads, self.gradients, strict=True)):
            explicit = {k: read(Steps(system, self.steps.tape, self.steps.dt)).value for k, system in varied.items()}
            by_arrays = sum(float(np.vdot(getattr(gradient, name), change)) for name, change in changes.items())
            totals[i] = by_arrays + difference(explicit, step)
        return totals

    def _flight_changes(self, varied: Mapping[int, System], step: float) -> dict[str, np.ndarray]:
        """Return the derivatives of `motion` and `push` by those of ω² and c.

        Errors of these add up over all steps: the arrays are taken apart by as much as their smoothness allows.
        """
        system, dt = self.steps.system, self.steps.dt
        stiffness, damping = system.stiffness, system.damping
        by_stiffness = difference({k: changed_system.stiffness for k, changed_system in varied.items()}, step)
        by_damping = difference({k: changed_system.damping for k, changed_system in varied.items()}, step)
        elastic = stiffness > 0
        sizes = np.maximum(damping, np.sqrt(stiffness))[elastic]
        rates = np.append(by_stiffness[elastic] / stiffness[elastic], by_damping[elastic] / sizes)
        largest = float(np.abs(rates).max(initial=0.0))
        if largest == 0.0:
            still = flight(stiffness, damping, dt)
            return {"motion": np.zeros_like(still.motion), "push": np.zeros_like(still.push)}
        apart_by = FLIGHT_STEP / largest
        flights = {
            k: flight(stiffness + k * apart_by * by_stiffness, damping + k * apart_by * by_damping, dt) for k in WEIGHTS
        }
        return {
            "motion": difference({k: moved.motion for k, moved in flights.items()}, apart_by),
            "push": difference({k: moved.push for k, moved in flights.items()}, apart_by),
        }


def differentiated(system: System, reads: list[Read], dt: float, count: int) -> Differentiated:
    """Return a run of a `prepared` system with the derivatives of quantities.

    Args:
        dt: Step [s].
        count: Number of steps.

    Raises:
        SceneError: the scene has what no derivative is found through.
    """
    loop = Small(system, dt)
    refuse_arrays(system, loop)
    size = 8 * count * (2 * len(system.velocity) + 4 * len(loop.ports.offset))
    if size > LARGEST_TAPE:
        raise SceneError(
            f"run: the states of {count} steps take {size / 2**30:.3g} GB, allowed: {LARGEST_TAPE / 2**30:g}; shorten"
            " run.duration or set a longer run.step"
        )
    tape = loop.kept(count)
    if tape is None:
        raise SceneError("run: the contact forces of a step were not found; `gudgeon run` says why")
    steps = Steps(system, tape, dt)
    refuse_grazing(system, loop, tape)
    readings, gradients = [], list[Gradient]()
    for read in reads:
        reading = read(steps)
        gradient = loop.derivatives(tape, reading.means, reading.ends)
        if gradient is None:
            raise SceneError("run: the forces of a step have no derivative by its start: a contact point grazes")
        readings.append(reading)
        gradients.append(gradient)
    return Differentiated(steps, reads, readings, gradients)
