"""Implicit contact: the trapezoidal rule on contact forces, exact flight of damped modes."""

from gudgeon.solver.integrators.capabilities import Feature, Integrator


class Trapezoid(Integrator):
    """For driven and damped scenes; stiff surfaces do not shorten its step."""

    run = "gudgeon.solver.integrators.trapezoid.integrator:TrapezoidRun"
    carries = frozenset(
        {
            Feature.COMPLIANT_CONTACT, Feature.SLIDING_PAIR, Feature.DAMPING, Feature.JOINT, Feature.LOAD,
            Feature.GRAVITY,
        }
    )  # fmt: skip
    order = 2
    promised_drift = 2e-3
    step_factor = 4.0
    largest = 40.0
    stiffest = 30.0
    counts_blows = False
