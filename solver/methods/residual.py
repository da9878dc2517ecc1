"""g = g₀ + B Φ q + R λ: what the kept modes lack yields without mass, and nothing is to be tuned (Monjaraz-Tec, Gross &
Krack 2022)."""

from gudgeon.solver.methods.method import Method, Settings, no_impacts


def _refuses(settings: Settings) -> str | None:
    if settings.surface_stiffness is not None and settings.law is not None:
        return "surface_stiffness and law both stand for the surface; give one of them"
    if settings.law is not None and settings.dashpot != "none":
        return "dashpot 'wave-guide' stands beside R alone; a law takes its place, so give one of them"
    return no_impacts(settings)


RESIDUAL = Method(False, True, _refuses)
