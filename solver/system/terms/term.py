"""A term of the equations of motion, what it depends on in the records of a component, and the terms of contacts."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from gudgeon.solver.obstacles import Plane
from gudgeon.solver.scene.contact import Contact, MasterSurface, OtherBody
from gudgeon.solver.scene.oblique import oblique
from gudgeon.solver.scene.scene import Scene

COUPLINGS = (
    "translation", "rotation", "rotation_gradient", "position_moments", "shape_moments", "centrifugal_compliance",
)  # fmt: skip
"""Tensors of the floating frame, and what says how much of the answer to rotation modes lack."""
PLACES = ("interfaces", "tractions", "loads", "gauges")
"""Groups of a modal record whose members are named by the user."""


@dataclass(frozen=True)
class Term:
    """One term of the equations of motion."""

    name: str
    body: str
    present: bool
    reason: str
    fields: tuple[str, ...] = ()
    """`record:path` of the fields that it reads, or would read if present."""


@dataclass(frozen=True)
class Stock:
    """Contents of the records of a body's component on which terms depend."""

    elastic: bool = True
    """Whether it has elastic coordinates or R."""
    held: bool = True
    """Whether it has supports, so that modes take part in translations."""
    swapped: bool = False
    """Whether it has bases that change as a force passes."""
    estimated: bool = True
    """Whether the errors of its frequencies by the mesh are known."""
    weighs: bool = True
    """Whether it has stiffness by the stress of its weight."""
    places: tuple[str, ...] = ()
    """`group/name` of its interfaces, traction spaces, loads and gauges."""
    patches: tuple[str, ...] = ()
    """Interfaces of which one point stands for a face, whose outline the record has."""

    @classmethod
    def of(cls, sizes: Mapping[str, int]) -> "Stock":
        """Return the contents of a modal record from the sizes of its datasets [bytes]."""
        paths = dict.fromkeys(
            path.rpartition("/")[0] for path in sizes if path.startswith(tuple(f"{group}/" for group in PLACES))
        )
        elastic = sizes.get("angular_frequencies", 0) > 0 or "residual_flexibility" in sizes
        return cls(
            elastic,
            "participation" in sizes,
            "swap/number" in sizes,
            "discretisation_errors" in sizes,
            "weight_stiffness" in sizes,
            tuple(paths),
            tuple(path.split("/")[1] for path in sizes if path.startswith("interfaces/") and path.endswith("/outline")),
        )


def fields_read(terms: list[Term], body: str, record: str) -> list[str]:
    """Return the field paths of one record of a body that its present terms read."""
    prefix = f"{record}:"
    return [
        field.removeprefix(prefix)
        for term in terms
        if term.present and term.body == body
        for field in term.fields
        if field.startswith(prefix)
    ]


def contact_terms(scene: Scene, body: str, stock: Stock) -> Iterator[Term]:
    """Yield the terms of contacts on a body, on either of their sides."""
    masters, others = scene.masters(), scene.others()
    for name, contact in scene.contact.items():
        if contact.body == body:
            yield from _near_side(name, contact, stock)
            slanting = contact.interface in oblique(scene)[body]
            if (scene.capabilities.turns or slanting) and stock.elastic:
                reason = "is pressed at a slant" if slanting else "the body turns before its obstacle"
                yield Term(f"motion across {name}", body, True, reason, _across_fields(contact.interface))
    for name, surface in masters.items():
        if surface.body == body:
            reason = f"contact {name} slides over it"
            yield Term(
                f"traction space {surface.interface}", body, True, reason, (f"modes:tractions/{surface.interface}",)
            )
    for name, partner in others.items():
        if partner.body == body and name not in masters:
            yield from _far_side(scene, name, partner, stock)


def _far_side(scene: Scene, name: str, partner: MasterSurface | OtherBody, stock: Stock) -> Iterator[Term]:
    """Yield the terms of a contact on the body that the contact's own one meets."""
    path, contact = f"modes:interfaces/{partner.interface}", scene.contact[name]
    fields = (
        f"{path}/rows", f"{path}/normals", *_face(partner.interface, stock), f"{path}/facets",
        f"morph:points/{partner.interface}",
    )  # fmt: skip
    friction = _friction(name, contact, (partner.body, partner.interface), elastic=stock.elastic)
    if contact.body == partner.body:
        across = friction.fields if contact.friction is not None else ()
        yield Term(f"other side of {name}", partner.body, True, "the body meets itself", fields + across)
        return
    slants = partner.interface in oblique(scene)[partner.body]
    yield Term(
        f"contact {name}", partner.body, True, "faces another body", fields + (friction.fields if slants else ())
    )
    if contact.friction is not None:
        yield friction


def _face(interface: str, stock: Stock) -> tuple[str, ...]:
    """Return the fields of the face that a patch stands for, as it was meshed."""
    path = f"modes:interfaces/{interface}"
    return (f"{path}/points", f"{path}/outline") if interface in stock.patches else ()


def _across_fields(interface: str) -> tuple[str, str]:
    """Return the fields of the motion of an interface's points across their normals."""
    return f"modes:interfaces/{interface}/tangents", f"modes:interfaces/{interface}/tangential_rows"


def _friction(name: str, contact: Contact, side: tuple[str, str], *, elastic: bool) -> Term:
    """Return the term of friction on the side (body, interface) of a contact; a rigid body needs no tangential rows."""
    body, interface = side
    rubs = contact.friction is not None
    reason = f"friction {'is given' if rubs else 'is not given, or zero'}"
    fields = _across_fields(interface) if elastic else ()
    return Term(f"friction of {name}", body, rubs, reason, fields)


def _near_side(name: str, contact: Contact, stock: Stock) -> Iterator[Term]:
    path, body = f"modes:interfaces/{contact.interface}", contact.body
    facets = (f"{path}/facets", f"{path}/areas") if isinstance(contact.against, OtherBody) else ()
    yield Term(
        f"contact {name}", body, True, _faced(contact),
        (f"{path}/rows", f"{path}/normals", f"{path}/edge", *_face(contact.interface, stock), *facets,
         f"morph:points/{contact.interface}"),
    )  # fmt: skip
    slides = isinstance(contact.against, MasterSurface)
    yield Term(f"sliding of {name}", body, slides, f"against.shape is '{contact.against.shape}'")
    law, layer, bounce = contact.law, contact.surface_stiffness is not None, contact.restitution is not None
    reason = f"law '{law.kind}', which points of a face share by their areas" if law is not None else "no law is given"
    yield Term(f"law of {name}", body, law is not None, reason, (f"{path}/areas",))
    yield Term(
        f"surface layer of {name}", body, layer, f"surface_stiffness {'is' if layer else 'is not'} given",
        (f"{path}/areas",),
    )  # fmt: skip
    yield Term(f"restitution of {name}", body, bounce, f"method is '{contact.method}'")
    worn = contact.wear is not None
    yield Term(f"wear of {name}", body, worn, f"wear {'is' if worn else 'is not'} given", (f"{path}/areas",))
    rubs, moves = contact.friction is not None, isinstance(contact.against, Plane) and any(contact.against.velocity)
    yield _friction(name, contact, (body, contact.interface), elastic=stock.elastic)
    reason = f"the obstacle {'moves' if moves else 'does not move'}" if rubs else "the contact has no friction"
    yield Term(f"belt of {name}", body, rubs and moves, reason)
    yield Term(f"dashpot of {name}", body, contact.dashpot != "none", f"dashpot is '{contact.dashpot}'")


def _faced(contact: Contact) -> str:
    against = contact.against
    if isinstance(against, MasterSurface | OtherBody):
        return f"against {against.interface} of {against.body}"
    return f"against a {against.shape}"
