"""What elements of a scene need of an integrator, and which integrators have it."""

from collections.abc import Iterator
from dataclasses import dataclass

from gudgeon.solver.capabilities import INTEGRATORS, Feature
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


def _friction(where: str, contact: Contact, friction: Friction) -> Demand:
    """Return what the friction of a contact needs."""
    if friction.speed is not None:
        return Demand(f"the friction of {where} with friction.speed", Feature.SMOOTHED_FRICTION, where)
    if friction.stiffness is not None:
        return Demand(f"the friction of {where} with friction.stiffness", Feature.FRICTION_SPRING, where)
    if METHODS[contact.method].rigid and friction.direction is not None:
        return Demand(f"the friction of {where}", Feature.LINE_FRICTION, where)
    return Demand(f"the friction of {where}", Feature.FRICTION, where)


def prefers(demands: list[Demand], name: str) -> bool:
    """Whether an integrator's fastest loop carries a scene."""
    own = INTEGRATORS[name]
    return {one.feature for one in demands} <= (own.carries if own.preferred is None else own.preferred)


def lacking(demands: list[Demand], name: str) -> list[Demand]:
    """Return the elements of a scene that need a feature which an integrator does not support."""
    return [one for one in demands if one.feature not in INTEGRATORS[name].carries]


def conflict(demands: list[Demand]) -> str:
    """Return a line for a scene that no integrator supports: an element, and those that rule out all that have it."""
    first = min((lacking(demands, name) for name in INTEGRATORS), key=len)[0]
    others = [lacking(demands, name)[0].what for name, own in INTEGRATORS.items() if first.feature in own.carries]
    together = f" together with {listed(list(dict.fromkeys(others)))}; remove one of them" if others else ""
    return f"run.integrator: no integrator supports {first.what}{together}"


def contact_demands(at: str, contact: Contact) -> Iterator[Demand]:
    """Yield the features that a contact needs."""
    if METHODS[contact.method].rigid:
        yield Demand(f"the rigid contact {at} (method '{contact.method}')", Feature.RIGID_CONTACT, at)
    elif contact.smooth_law:
        yield Demand(f"the law of {at}", Feature.SMOOTH_LAW, at)
    elif contact.law is not None:
        yield Demand(f"the linear law of {at}", Feature.LINEAR_LAW, at)
    elif not isinstance(contact.against, MasterSurface):  # What carries sliding pairs carries their flexibility.
        yield Demand(f"method '{contact.method}' of {at} without a law", Feature.COMPLIANT_CONTACT, at)
    if contact.friction is not None:
        yield _friction(at, contact, contact.friction)
    if contact.wear is not None:
        yield Demand(f"the wear of {at}", Feature.WEAR, at)
    if isinstance(contact.against, OtherBody):
        yield Demand(f"the other body of {at}", Feature.TWO_BODIES, at)
    if isinstance(contact.against, Plane) and contact.against.edges:
        yield Demand(f"the edges of {at}", Feature.EDGES, at)
    if contact.dashpot != "none":
        yield Demand(f"the dashpot of {at}", Feature.DASHPOT, at)
