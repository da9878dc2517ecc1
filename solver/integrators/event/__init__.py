"""Exact motion between located events."""

import math

from gudgeon.solver.integrators.capabilities import Feature, Integrator


class Event(Integrator):
    """For linear and rigid contact of a few points."""

    run = "gudgeon.solver.integrators.event.integrator:EventRun"
    carries = frozenset(
        {
            Feature.COMPLIANT_CONTACT, Feature.LINEAR_LAW, Feature.RIGID_CONTACT, Feature.DASHPOT, Feature.GAUGES,
            Feature.SPRING, Feature.SPRING_DAMPING, Feature.GRAVITY,
        }
    )  # fmt: skip
    order = math.inf
    promised_drift = 1e-9
    own_steps = True
