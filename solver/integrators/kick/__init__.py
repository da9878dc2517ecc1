"""Explicit contact: a kick in the middle of each step, exact flight between."""

from gudgeon.solver.integrators.capabilities import Feature, Integrator


class Kick(Integrator):
    """At dt·ω_c = 0.2 the skirt's energy drift is 1e-4, at 2 energy grows without bound."""

    run = "gudgeon.solver.integrators.kick.integrator:KickRun"
    carries = frozenset({Feature.COMPLIANT_CONTACT, Feature.DASHPOT, Feature.GAUGES})
    order = 2
    promised_drift = 2e-3
    largest = 0.2
    staggered = True
    records_motion = False
