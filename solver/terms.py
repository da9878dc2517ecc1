"""What a scene needs and what it leaves out. Decided once, from the scene alone, before any array is read.

Each term names the record fields that it reads; a term that is not in the list reads nothing and costs nothing in
the time loop.
"""

from dataclasses import dataclass

from solver.methods import METHODS
from solver.scene import Contact, Scene


@dataclass(frozen=True)
class Term:
    """One term of the equations of motion."""

    name: str
    body: str
    present: bool
    reason: str
    fields: tuple[str, ...]
    """`record:path` of what it reads, or would read."""


def scene_terms(scene: Scene) -> list[Term]:
    """List the terms of every body, present and left out, in the order in which they are compiled."""
    terms = []
    for body in scene.body:
        terms.append(
            Term(
                "rigid motion", body, True, "every body moves", ("morph:centre", "morph:inertia", "morph:rigid_twists")
            )
        )
        terms.append(Term("elastic flight", body, True, "modes move exactly", ("modes:angular_frequencies",)))
        for name, contact in scene.contact.items():
            if contact.body == body:
                terms += _contact_terms(scene, name)
        for name, over in scene.masters().items():
            if over.body == body:
                path = f"modes:tractions/{over.interface}"
                reason = f"contact {name} slides over it"
                terms.append(Term(f"traction space {over.interface}", body, True, reason, (path,)))
        for name, other in scene.others().items():
            if other.body == body and name not in scene.masters():
                path = f"modes:interfaces/{other.interface}"
                fields = (f"{path}/rows", f"{path}/normals", f"morph:points/{other.interface}")
                terms.append(Term(f"contact {name}", body, True, "faces another body", fields))
        gauges = scene.body[body].gauges
        reason = f"body.{body}.gauges names {', '.join(gauges) or 'none'}"
        terms.append(Term("gauges", body, bool(gauges), reason, tuple(f"modes:gauges/{name}" for name in gauges)))
        for name, joint in scene.joint.items():
            if joint.body == body:
                path = f"modes:loads/{joint.interface}"
                terms.append(Term(f"joint {name}", body, True, f"a {joint.kind} holds {joint.interface}", (path,)))
        for name, spring in scene.springs().items():
            if body in (spring.body, spring.against):
                terms.append(Term(f"spring {name}", body, True, "acts on rigid motion", ()))
        for name, force in scene.given().items():
            if force.body == body:
                terms.append(
                    Term(
                        f"load {name}",
                        body,
                        True,
                        f"{force.kind} on {force.interface}",
                        (f"modes:{'tractions' if force.kind == 'moving' else 'loads'}/{force.interface}",),
                    )
                )
        damped = scene.body[body].damping is not None
        terms.append(Term("damping", body, damped, f"body.{body}.damping {'is' if damped else 'is not'} given", ()))
        pulled = any(scene.run.gravity)
        reason = f"run.gravity is {'not ' if pulled else ''}zero"
        terms.append(Term("gravity", body, pulled, reason, ("modes:participation",)))
        residual = any(METHODS[scene.contact[name].method].flexible for name in _touching(scene, body))
        held = any(item.body == body for item in [*scene.joint.values(), *scene.given().values()])
        reason = "a contact uses method 'residual'" if residual else "no contact uses method 'residual'"
        if held and not residual:
            residual, reason = True, "a joint or load acts on it"
        terms.append(Term("residual flexibility", body, residual, reason, ("modes:residual_flexibility",)))
        terms += _left_out(body)
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


def _touching(scene: Scene, body: str) -> list[str]:
    """Name the contacts that a body has a part in."""
    others = scene.others()
    return [
        name
        for name, contact in scene.contact.items()
        if contact.body == body or (name in others and others[name].body == body)
    ]


def _contact_terms(scene: Scene, name: str) -> list[Term]:
    contact = scene.contact[name]
    path, body = f"modes:interfaces/{contact.interface}", contact.body
    layer = contact.surface_stiffness is not None
    areas = f"surface_stiffness {'is' if layer else 'is not'} given"
    return [
        Term(
            f"contact {name}", body, True, f"against a {contact.against.shape}",
            (f"{path}/rows", f"{path}/normals", f"{path}/edge", f"morph:points/{contact.interface}"),
        ),
        Term(f"law of {name}", body, contact.law is not None, _law_reason(contact), ()),
        Term(f"friction of {name}", body, contact.friction is not None,
             f"friction {'is' if contact.friction is not None else 'is not'} given", ()),
        Term(f"surface layer of {name}", body, layer, areas, (f"{path}/areas",)),
        Term(f"dashpot of {name}", body, contact.dashpot != "none", f"dashpot is '{contact.dashpot}'", ()),
    ]  # fmt: skip


def _law_reason(contact: Contact) -> str:
    return f"law '{contact.law.kind}'" if contact.law is not None else "no law is given"


def _left_out(body: str) -> list[Term]:
    return [
        Term("inertia couplings", body, False, "motion is small: frame and elastic inertia do not couple",
             ("modes:inertia_couplings",)),
        Term("mode shapes", body, False, "needed for pictures only", ("modes:shapes",)),
        Term("surface and volume mesh", body, False, "contact rows stand in the modes",
             ("mesh:nodes", "mesh:cells", "mesh:surfaces", "morph:nodes")),
    ]  # fmt: skip
