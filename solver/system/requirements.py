"""The terms of a scene's equations of motion, present and omitted, from the scene and the contents of its records.

Each term names the record fields that it reads; a term that is omitted reads nothing and takes no time in the loop.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from gudgeon.solver.joints.markers import Marked
from gudgeon.solver.methods import METHODS
from gudgeon.solver.obstacles import Plane
from gudgeon.solver.scene.contact import Contact, MasterSurface, OtherBody
from gudgeon.solver.scene.oblique import oblique
from gudgeon.solver.scene.probe import DistanceProbe, ForceProbe
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
    places: tuple[str, ...] = ()
    """`group/name` of its interfaces, traction spaces, loads and gauges."""

    @classmethod
    def of(cls, sizes: Mapping[str, int]) -> "Stock":
        """Return the contents of a modal record from the sizes of its datasets [bytes]."""
        places = dict.fromkeys(
            path.rpartition("/")[0] for path in sizes if path.startswith(tuple(f"{group}/" for group in PLACES))
        )
        elastic = sizes.get("angular_frequencies", 0) > 0 or "residual_flexibility" in sizes
        return cls(
            elastic, "participation" in sizes, "swap/number" in sizes, "discretisation_errors" in sizes, tuple(places)
        )


def scene_terms(scene: Scene, stocks: Mapping[str, Stock] | None = None) -> list[Term]:
    """List the terms of every body, present and omitted, in the order in which they are compiled.

    Args:
        stocks: Contents of the records of each body; without them, every field that a scene can need is assumed.
    """
    terms = []
    for body in scene.body:
        stock = (stocks or {}).get(body, Stock())
        own = [
            *_motion(scene, body, stock),
            *_contacts(scene, body, stock),
            *_elements(scene, body),
            *_medium(scene, body, stock),
        ]
        terms += [*own, *_unused(own, body, stock), *_floating(scene, body, stock), *_never(body)]
    return terms


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


def _motion(scene: Scene, body: str, stock: Stock) -> Iterator[Term]:
    turns = scene.capabilities.turns
    reason = "turns by any angle, with gyroscopic terms" if turns else "motions that supports and freedom leave free"
    if any(joint.body == body for joint in scene.held().values()):
        reason = "joints hold it: it is a part of its modes"
    yield Term(
        "rigid motion", body, True, reason,
        ("morph:centre", "morph:inertia", "morph:rigid_twists"),
    )  # fmt: skip
    reason = "coordinates of the floating frame, integrated by steps" if turns else "modes are integrated exactly"
    reason = reason if stock.elastic else "a rigid body does not deform"
    yield Term("elastic flight", body, stock.elastic, reason, ("modes:angular_frequencies",))
    if stock.swapped:
        yield Term("bases", body, True, "the basis changes as the moving force passes", ("modes:swap",))


def _contacts(scene: Scene, body: str, stock: Stock) -> Iterator[Term]:
    """Yield the terms of contacts on a body, on either of their sides."""
    masters, others = scene.masters(), scene.others()
    for name, contact in scene.contact.items():
        if contact.body == body:
            yield from _own_side(name, contact, elastic=stock.elastic)
            slanting = contact.interface in oblique(scene)[body]
            if (scene.capabilities.turns or slanting) and stock.elastic:
                path = f"modes:interfaces/{contact.interface}"
                fields = (f"{path}/tangents", f"{path}/tangential_rows")
                reason = "is pressed at a slant" if slanting else "the body turns before its obstacle"
                yield Term(f"motion across {name}", body, True, reason, fields)
    for name, over in masters.items():
        if over.body == body:
            reason = f"contact {name} slides over it"
            yield Term(f"traction space {over.interface}", body, True, reason, (f"modes:tractions/{over.interface}",))
    for name, other in others.items():
        if other.body == body and name not in masters:
            path = f"modes:interfaces/{other.interface}"
            fields = (f"{path}/rows", f"{path}/normals", f"{path}/facets", f"morph:points/{other.interface}")
            contact = scene.contact[name]
            friction = _friction(name, contact, (body, other.interface), elastic=stock.elastic)
            if contact.body == body:
                across = friction.fields if contact.friction is not None else ()
                yield Term(f"other side of {name}", body, True, "the body meets itself", fields + across)
            else:
                slants = other.interface in oblique(scene)[body] and stock.elastic
                across = friction.fields if slants else ()
                yield Term(f"contact {name}", body, True, "faces another body", fields + across)
                if contact.friction is not None:
                    yield friction


def _friction(name: str, contact: Contact, side: tuple[str, str], *, elastic: bool) -> Term:
    """Return the term of friction on the side (body, interface) of a contact; a rigid body needs no tangential rows."""
    body, interface = side
    path, rubs = f"modes:interfaces/{interface}", contact.friction is not None
    reason = f"friction {'is given' if rubs else 'is not given, or zero'}"
    fields = (f"{path}/tangents", f"{path}/tangential_rows") if elastic else ()
    return Term(f"friction of {name}", body, rubs, reason, fields)


def _own_side(name: str, contact: Contact, *, elastic: bool) -> Iterator[Term]:
    path, body = f"modes:interfaces/{contact.interface}", contact.body
    facets = (f"{path}/facets", f"{path}/areas") if isinstance(contact.against, OtherBody) else ()
    yield Term(
        f"contact {name}", body, True, _faced(contact),
        (f"{path}/rows", f"{path}/normals", f"{path}/edge", *facets, f"morph:points/{contact.interface}"),
    )  # fmt: skip
    slides = isinstance(contact.against, MasterSurface)
    yield Term(f"sliding of {name}", body, slides, f"against.shape is '{contact.against.shape}'")
    law, layer, bounce = contact.law, contact.surface_stiffness is not None, contact.restitution is not None
    yield Term(f"law of {name}", body, law is not None, f"law '{law.kind}'" if law is not None else "no law is given")
    yield Term(
        f"surface layer of {name}", body, layer, f"surface_stiffness {'is' if layer else 'is not'} given",
        (f"{path}/areas",),
    )  # fmt: skip
    yield Term(f"restitution of {name}", body, bounce, f"method is '{contact.method}'")
    worn = contact.wear is not None
    yield Term(f"wear of {name}", body, worn, f"wear {'is' if worn else 'is not'} given", (f"{path}/areas",))
    rubs, moves = contact.friction is not None, isinstance(contact.against, Plane) and any(contact.against.velocity)
    yield _friction(name, contact, (body, contact.interface), elastic=elastic)
    reason = f"the obstacle {'moves' if moves else 'does not move'}" if rubs else "the contact has no friction"
    yield Term(f"belt of {name}", body, rubs and moves, reason)
    yield Term(f"dashpot of {name}", body, contact.dashpot != "none", f"dashpot is '{contact.dashpot}'")


def _faced(contact: Contact) -> str:
    against = contact.against
    if isinstance(against, MasterSurface | OtherBody):
        return f"against {against.interface} of {against.body}"
    return f"against a {against.shape}"


def _elements(scene: Scene, body: str) -> Iterator[Term]:
    """Yield the joints, springs and loads of a body, or one omitted term for each kind that it lacks."""
    joints = [
        Term(
            f"joint {n}",
            body,
            True,
            f"a {j.kind} holds {j.interface or 'a point'}",
            (f"modes:loads/{j.interface}",) if j.interface else (),
        )
        for n, j in scene.cranks().items()
        if j.body == body
    ]
    still = " takes its rows from the coordinates" if scene.held() else ""
    joints += [
        Term(f"joint {n}", body, True, f"a {scene.joint[n].kind} joint{still}", _hinge_fields(j, body))
        for n, j in scene.hinges().items()
        if body in (j.body, j.against)
    ]
    springs = [
        Term(f"{s.kind} {n}", body, True, f"acts on {interface or 'rigid motion'}", _spring_fields(interface))
        for n, s in scene.springs().items()
        for owner, interface in ((s.body, s.interface), (s.against, s.against_interface))
        if owner == body
    ]
    pulls = [
        Term(f"field {n}", body, True, f"{f.kind} on {interface or 'rigid motion'}", _spring_fields(interface))
        for n, f in scene.fields().items()
        for owner, interface in ((f.body, f.interface), (f.against, f.against_interface))
        if owner == body
    ]
    pulls += [
        Term(f"field {n}", body, True, f"{f.kind} on the points of {f.interface}", _point_fields(f.interface))
        for n, f in scene.electrodes().items()
        if f.body == body
    ]
    loads = [
        Term(
            f"load {n}", body, True, f"{f.kind} on {interface or 'rigid motion'}",
            (f"modes:{'tractions' if f.kind == 'moving' else 'loads'}/{interface}",) if interface else (),
        )
        for n, f in scene.given().items()
        if f.body == body
        for interface in (getattr(f, "interface", None),)
    ]  # fmt: skip
    for name, motion in scene.motion.items():
        if motion.body == body:
            fields = (f"modes:loads/{motion.interface}",) if motion.interface else ()
            reason = f"{motion.kind} of {motion.interface or 'the rigid body'} is given"
            yield Term(f"motion {name}", body, True, reason, fields)
    for name, interface in interfaces_read(scene, body):
        yield Term(f"probe {name}", body, True, f"reads {interface}", _spring_fields(interface))
    yield from joints or [Term("joints", body, False, "no joint names it")]
    yield from pulls or [Term("fields", body, False, "no electrostatic force names it")]
    yield from springs or [Term("springs", body, False, "no force of kind 'spring' or 'bushing' names it")]
    yield from loads or [Term("loads", body, False, "no force but a spring, bushing or field names it")]


def _hinge_fields(joint: Marked, body: str) -> tuple[str, ...]:
    """Return the fields that a joint of two markers reads of a body."""
    sides = (joint.body, joint.interface), (joint.against, joint.against_interface)
    return tuple(f"modes:loads/{name}" for owner, name in sides if name is not None and owner == body)


def _point_fields(interface: str) -> tuple[str, ...]:
    """Return the fields that an electrode reads of an interface."""
    at = f"modes:interfaces/{interface}"
    return (f"{at}/rows", f"{at}/normals", f"{at}/areas", f"morph:points/{interface}")


def _spring_fields(interface: str | None) -> tuple[str, ...]:
    """Return the fields that a spring or probe on an interface reads, which is a load or a contact point."""
    if interface is None:
        return ()
    at = f"modes:interfaces/{interface}"
    return (f"modes:loads/{interface}", f"{at}/rows", f"{at}/normals", f"morph:points/{interface}")


def _medium(scene: Scene, body: str, stock: Stock) -> Iterator[Term]:
    """Yield gauges, damping, gravity and residual flexibility of a body."""
    settings, touching = scene.body[body], _touching(scene, body)
    pressed = [name for name in touching if name not in scene.masters() or scene.contact[name].body == body]
    read, reason = bool(settings.gauges), f"body.{body}.gauges names {', '.join(settings.gauges) or 'none'}"
    yield Term("gauges", body, read, reason, tuple(f"modes:gauges/{name}/rows" for name in settings.gauges))
    if read and scene.capabilities.turns:
        answers = [f"modes:gauges/{name}/{part}" for name in settings.gauges for part in ("residual", "centrifugal")]
        reason = "rotation and the forces of joints, loads, springs and obstacles act on it"
        if not stock.elastic:
            reason = "a rigid body does not deform"
        yield Term("gauges' quasi-static part", body, stock.elastic, reason, tuple(answers))
    if read and not scene.capabilities.turns:
        acts = bool(pressed) or _pulled(scene, body)
        other = f"{'forces act' if acts else 'nothing acts'} on an interface of it"
        reason = "contacts press on it" if pressed else other
        fields = tuple(f"modes:gauges/{name}/residual" for name in settings.gauges)
        yield Term("gauges' quasi-static part", body, acts, reason, fields)
        deformed = any(scene.run.gravity) and stock.elastic and stock.held
        reason = f"gravity {'deforms' if deformed else 'does not deform'} the body"
        fields = tuple(f"modes:gauges/{name}/weights" for name in settings.gauges)
        yield Term("gauges under gravity", body, deformed, reason, fields)
    given = settings.damping is not None
    reason = f"body.{body}.damping {'is' if given else 'is not'} given"
    if given and not stock.elastic:
        reason = "a rigid body does not deform"
    yield Term("damping", body, given and stock.elastic, reason)
    checked = scene.run.checks and bool(touching) and stock.elastic
    reason = f"run.checks is {'true' if scene.run.checks else 'false'}" if touching else "nothing touches it"
    if touching and not stock.elastic:
        reason = "a rigid body does not deform"
    if checked and not stock.estimated:
        reason = "its modes have no estimate of them"
    if touching and scene.capabilities.turns:
        checked, reason = False, "the body turns by any angle: errors of mesh and basis are not estimated"
    yield Term("errors of frequencies", body, checked and stock.estimated, reason, ("modes:discretisation_errors",))
    pulled = any(scene.run.gravity)
    yield Term(
        "gravity", body, pulled, f"run.gravity is {'not ' if pulled else ''}zero",
        ("modes:participation",) if stock.elastic and stock.held else (),
    )  # fmt: skip
    for name, probe in scene.probe.items():
        if isinstance(probe, ForceProbe) and probe.of == f"body.{body}":
            fields = ("modes:participation",) if stock.elastic and stock.held else ()
            yield Term(f"probe {name}", body, True, "reads the force that holds it", fields)
    yield _residual(scene, body, stock, touching)


def _pulled(scene: Scene, body: str) -> bool:
    """Whether a joint, load, motion or spring acts on an interface of a body."""
    cranks = {} if scene.capabilities.turns else scene.cranks()
    loads = [*cranks.values(), *scene.given().values(), *scene.motion.values(), *scene.electrodes().values()]
    return any(item.body == body for item in loads) or any(
        (item.body == body and item.interface) or (item.against == body and item.against_interface)
        for item in (scene.springs() | scene.fields()).values()
    )


def _residual(scene: Scene, body: str, stock: Stock, touching: list[str]) -> Term:
    present = any(METHODS[scene.contact[name].method].flexible for name in touching)
    reason = "a contact uses method 'residual'" if present else "no contact uses method 'residual'"
    if not present and _pulled(scene, body):
        present, reason = True, "a joint, load, motion or spring acts on it"
    if not present and any(body in (joint.body, joint.against) for joint in scene.hinges().values()):
        present, reason = True, "it says what modes lack at joints"
    if not present and any(True for _ in interfaces_read(scene, body)):
        present, reason = True, "a probe reads an interface of it"
    if not stock.elastic:
        present, reason = False, "a rigid body does not deform"
    return Term("residual flexibility", body, present, reason, ("modes:residual_flexibility",))


def _touching(scene: Scene, body: str) -> list[str]:
    """Return the names of the contacts in which a body takes part."""
    others = scene.others()
    return [
        name
        for name, contact in scene.contact.items()
        if contact.body == body or (name in others and others[name].body == body)
    ]


def _unused(own: list[Term], body: str, stock: Stock) -> Iterator[Term]:
    """Yield the interfaces, traction spaces, loads and gauges of a component that the scene does not use."""
    used = [f"{field.partition(':')[2]}/" for term in own if term.present for field in term.fields]
    for place in stock.places:
        group, _, name = place.partition("/")
        if not any(field.startswith(f"{place}/") for field in used):
            kind = {"interfaces": "interface", "tractions": "traction space", "loads": "load surface"}.get(group)
            reason = "nothing acts on it" if kind else f"body.{body}.gauges does not name it"
            points = (f"morph:points/{name}",) if group == "interfaces" else ()
            yield Term(f"{kind or 'gauge'} {name}", body, False, reason, (f"modes:{place}", *points))


def _floating(scene: Scene, body: str, stock: Stock) -> Iterator[Term]:
    """Yield the inertia couplings of a body that deforms and turns, its stiffness by stress, and its attachment."""
    settings, turns = scene.body[body], scene.capabilities.turns
    reason = "motion is small: frame and elastic inertia do not couple"
    if turns:
        reason = f"{settings.attachment} frame" if stock.elastic else "a rigid body does not deform"
    moments = [f"modes:inertia_couplings/{name}" for name in COUPLINGS]
    if settings.attached_to is not None:
        moments.append(f"modes:loads/{settings.attached_to}")
    yield Term("inertia couplings", body, turns and stock.elastic, reason, tuple(moments))
    stiffened = turns and stock.elastic and settings.geometric_stiffness
    if turns and stock.elastic:
        reason = f"geometric_stiffness is {str(settings.geometric_stiffness).lower()}"
    fields = ("modes:inertia_couplings/centrifugal_stiffness",)
    yield Term("geometric stiffness", body, stiffened, reason, fields)


def _never(body: str) -> list[Term]:
    return [
        Term("mode shapes", body, False, "needed for pictures only", ("modes:shapes",)),
        Term("surface and volume mesh", body, False, "the modes contain the contact rows",
             ("mesh:nodes", "mesh:cells", "mesh:surfaces", "morph:nodes")),
    ]  # fmt: skip


def interfaces_read(scene: Scene, body: str) -> Iterator[tuple[str, str]]:
    """Yield probe and interface of each interface of a body that a probe reads."""
    for name, probe in scene.probe.items():
        if isinstance(probe, ForceProbe):
            continue
        if probe.body == body and probe.interface is not None:
            yield name, probe.interface
        if isinstance(probe, DistanceProbe) and probe.against == body and probe.against_interface is not None:
            yield name, probe.against_interface
