"""Contact laws by collocation, with steps from the accuracy asked for."""

from gudgeon.solver.integrators.capabilities import Feature, Integrator


class Collocation(Integrator):
    """Four Lobatto points a step: order 6 at the ends of steps; a hundred times its accuracy of 1e-8 is its drift."""

    run = "gudgeon.solver.integrators.collocation.integrator:CollocationRun"
    carries = frozenset(
        {Feature.LINEAR_LAW, Feature.SMOOTH_LAW, Feature.GAUGES, Feature.SPRING, Feature.GRAVITY}
    )  # fmt: skip
    order = 6
    promised_drift = 1e-6
    own_steps = True
    largest = 1.0
