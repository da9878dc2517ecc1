"""The discrete gradient of contact potentials: energy to round-off at any step."""

from gudgeon.solver.integrators.capabilities import Feature, Integrator


class DiscreteGradient(Integrator):
    """At dt·ω_c = 0.05 it resolves a blow in about sixty steps."""

    run = "gudgeon.solver.integrators.discrete_gradient.integrator:DiscreteGradientRun"
    carries = frozenset(
        {
            Feature.COMPLIANT_CONTACT, Feature.LINEAR_LAW, Feature.SMOOTH_LAW, Feature.GAUGES, Feature.SPRING,
            Feature.GRAVITY,
        }
    )  # fmt: skip
    order = 2
    promised_drift = 1e-9
    step_factor = 0.05
    largest = 0.5
    conserves_energy = True
