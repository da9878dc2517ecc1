"""g = g₀ + B Φ q + R λ: the truncated modes act as a massless flexibility R, with no parameter to choose
(Monjaraz-Tec, Gross & Krack 2022)."""

from gudgeon.solver.methods.method import Method, Settings, no_impacts


def _refuses(settings: Settings) -> str | None:
    if settings.surface_stiffness is not None and settings.law is not None:
        return "surface_stiffness and law both describe the surface; give only one of them"
    if settings.law is not None and settings.dashpot != "none":
        return "dashpot 'wave-guide' cannot be combined with a law; give only one of them"
    return no_impacts(settings)


RESIDUAL = Method(False, True, _refuses)
