"""A spring or a law at each point, without R; the stiffness is a parameter to choose."""

from gudgeon.solver.methods.method import Method, Settings, compliant_dashpot, no_impacts


def _refuses(settings: Settings) -> str | None:
    if (settings.surface_stiffness is None) == (settings.law is None):
        return "method 'penalty' needs either surface_stiffness [N/m^3] or a law"
    return compliant_dashpot(settings) or no_impacts(settings)


PENALTY = Method(False, False, _refuses)
