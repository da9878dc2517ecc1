"""What elements of a scene need of an integrator, and which integrators have it."""

from collections.abc import Iterator
from dataclasses import dataclass

from gudgeon.solver.capabilities import IMPULSIVE, INTEGRATORS, Feature
from gudgeon.solver.methods import METHODS
from gudgeon.solver.obstacles.plane import Plane
from gudgeon.solver.scene.contact import Contact, Friction, MasterSurface, OtherBody
from gudgeon.solver.scene.refusals import listed


@dataclass(frozen=True)
class Demand:
    """What an element of a scene needs of an integrator."""

    what: str
    """Name of the element in a message."""
    feature: Feature
    where: str
    """Its path, such as `contact.floor`."""


def _friction(path: str, contact: Contact, friction: Friction) -> Demand:
    """Return what the friction of a contact needs."""
    if friction.speed is not None:
        return Demand(f"the friction of {path} with friction.speed", Feature.SMOOTHED_FRICTION, path)
    if friction.stiffness is not None:
        return Demand(f"the friction of {path} with friction.stiffness", Feature.FRICTION_SPRING, path)
    if METHODS[contact.method].rigid and friction.direction is not None:
        return Demand(f"the friction of {path}", Feature.LINE_FRICTION, path)
    return Demand(f"the friction of {path}", Feature.FRICTION, path)


def prefers(demands: list[Demand], name: str) -> bool:
    """Whether an integrator's fastest loop carries a scene."""
    integrator, features = INTEGRATORS[name], {d.feature for d in demands}
    if integrator.resolving is not None and features <= IMPULSIVE:
        return True
    return features <= (integrator.carries if integrator.preferred is None else integrator.preferred)


def impulsive(demands: list[Demand]) -> bool:
    """Whether nothing but contact over a compliance acts in a scene, on undamped bodies."""
    return {d.feature for d in demands} <= IMPULSIVE


def lacking(demands: list[Demand], name: str) -> list[Demand]:
    """Return the elements of a scene that need a feature which an integrator does not support."""
    return [d for d in demands if d.feature not in INTEGRATORS[name].carries]


def conflict(demands: list[Demand]) -> str:
    """Return a line for a scene that no integrator supports: an element, and those that rule out all that have it."""
    rarest = min((lacking(demands, name) for name in INTEGRATORS), key=len)[0]
    others = [
        lacking(demands, name)[0].what
        for name, integrator in INTEGRATORS.items()
        if rarest.feature in integrator.carries
    ]
    together = f" together with {listed(list(dict.fromkeys(others)))}; remove one of them" if others else ""
    return f"run.integrator: no integrator supports {rarest.what}{together}"


def contact_demands(path: str, contact: Contact) -> Iterator[Demand]:
    """Yield the features that a contact needs."""
    if METHODS[contact.method].rigid:
        yield Demand(f"the rigid contact {path} (method '{contact.method}')", Feature.RIGID_CONTACT, path)
    elif contact.smooth_law:
        yield Demand(f"the law of {path}", Feature.SMOOTH_LAW, path)
    elif contact.law is not None:
        yield Demand(f"the linear law of {path}", Feature.LINEAR_LAW, path)
    elif not isinstance(contact.against, MasterSurface):  # What carries sliding pairs carries their flexibility.
        yield Demand(f"method '{contact.method}' of {path} without a law", Feature.COMPLIANT_CONTACT, path)
    if contact.friction is not None:
        yield _friction(path, contact, contact.friction)
    if contact.wear is not None:
        yield Demand(f"the wear of {path}", Feature.WEAR, path)
    if isinstance(contact.against, OtherBody):
        yield Demand(f"the other body of {path}", Feature.TWO_BODIES, path)
    if isinstance(contact.against, Plane) and contact.against.edges:
        yield Demand(f"the edges of {path}", Feature.EDGES, path)
    if contact.dashpot != "none":
        yield Demand(f"the dashpot of {path}", Feature.DASHPOT, path)
