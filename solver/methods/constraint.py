"""Constraint addition and deletion (Wu & Haug 1990): a gap that closes is held at zero, with the velocity jump of the
reduced mass, until its force would become tensile."""

from gudgeon.solver.methods.method import RESTITUTION, Method, Settings, rigid_refuses


def _refuses(settings: Settings) -> str | None:
    if settings.restitution is not None:
        return RESTITUTION
    return rigid_refuses("constraint", settings)


CONSTRAINT = Method(True, False, _refuses)
