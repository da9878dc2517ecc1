"""Newton's restitution at each impact; an accumulation of impacts ends in a constraint, as with restitution 0."""

from gudgeon.solver.methods.method import RESTITUTION, Method, Settings, rigid_refuses


def _refuses(settings: Settings) -> str | None:
    if settings.restitution is None:
        return RESTITUTION
    return rigid_refuses("impact", settings)


IMPACT = Method(True, False, _refuses)
