"""The terms of a scene's equations of motion, present and omitted, from the scene and the contents of its records.

Each term names the record fields that it reads; a term that is omitted reads nothing and takes no time in the loop.
"""

from collections.abc import Iterable, Iterator, Mapping

from gudgeon.solver.methods import METHODS
from gudgeon.solver.scene.probe import ForceProbe
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.system.terms.elements import element_terms, interfaces_read
from gudgeon.solver.system.terms.term import COUPLINGS, Stock, Term, contact_terms

RIGID = "a rigid body does not deform"
"""Why a rigid body has no elastic term."""


def scene_terms(scene: Scene, stocks: Mapping[str, Stock] | None = None) -> list[Term]:
    """List the terms of every body, present and omitted, in the order in which they are compiled.

    Args:
        stocks: Contents of the records of each body; without them, every field that a scene can need is assumed.
    """
    terms = []
    for body in scene.body:
        stock = (stocks or {}).get(body, Stock())
        body_terms = [
            *_motion(scene, body, stock),
            *contact_terms(scene, body, stock),
            *element_terms(scene, body),
            *_medium(scene, body, stock),
        ]
        terms += [*body_terms, *_unused(body_terms, body, stock), *_floating(scene, body, stock), *_never(body)]
    return terms


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
    reason = reason if stock.elastic else RIGID
    yield Term("elastic flight", body, stock.elastic, reason, ("modes:angular_frequencies",))
    if stock.swapped:
        yield Term("bases", body, True, "the basis changes as the moving force passes", ("modes:swap",))


def _medium(scene: Scene, body: str, stock: Stock) -> Iterator[Term]:
    """Yield gauges, damping, gravity and residual flexibility of a body."""
    touching = _touching(scene, body)
    yield from _gauges(scene, body, stock, touching)
    damped = scene.body[body].damping is not None
    reason = RIGID if damped and not stock.elastic else f"body.{body}.damping {'is' if damped else 'is not'} given"
    yield Term("damping", body, damped and stock.elastic, reason)
    yield _estimates(scene, body, stock)
    participation = ("modes:participation",) if stock.elastic and stock.held else ()
    pulled = any(scene.run.gravity)
    if stock.weighs and stock.elastic and scene.body[body].geometric_stiffness:
        participation += ("modes:weight_stiffness",)
    yield Term("gravity", body, pulled, f"run.gravity is {'not ' if pulled else ''}zero", participation)
    for name, probe in scene.probe.items():
        if isinstance(probe, ForceProbe) and probe.of == f"body.{body}":
            yield Term(f"probe {name}", body, True, "reads the force that holds it", participation)
    yield _residual(scene, body, stock, touching)


def _gauges(scene: Scene, body: str, stock: Stock, touching: list[str]) -> Iterator[Term]:
    """Yield the gauges of a body, and what their quasi-static part and that under gravity read."""
    gauges, turns = scene.body[body].gauges, scene.capabilities.turns
    reason = f"body.{body}.gauges names {', '.join(gauges) or 'none'}"
    yield Term("gauges", body, bool(gauges), reason, _gauge_fields(gauges, "rows"))
    if gauges and turns:
        reason = "rotation and the forces of joints, loads, springs and obstacles act on it" if stock.elastic else RIGID
        fields = _gauge_fields(gauges, "residual", "centrifugal")
        yield Term("gauges' quasi-static part", body, stock.elastic, reason, fields)
    elif gauges:
        masters = scene.masters()
        in_contact = any(name not in masters or scene.contact[name].body == body for name in touching)
        acts = in_contact or _pulled(scene, body)
        reason = f"{'forces act' if acts else 'nothing acts'} on an interface of it"
        reason = "contacts load it" if in_contact else reason
        yield Term("gauges' quasi-static part", body, acts, reason, _gauge_fields(gauges, "residual"))
        deformed = any(scene.run.gravity) and stock.elastic and stock.held
        reason = f"gravity {'deforms' if deformed else 'does not deform'} the body"
        yield Term("gauges under gravity", body, deformed, reason, _gauge_fields(gauges, "weights"))


def _gauge_fields(gauges: Iterable[str], *fields: str) -> tuple[str, ...]:
    return tuple(f"modes:gauges/{name}/{field}" for name in gauges for field in fields)


def _estimates(scene: Scene, body: str, stock: Stock) -> Term:
    """Return the term of the errors of a body's frequencies."""
    checked = False
    if not stock.elastic:
        reason = RIGID
    elif scene.run.checks and not stock.estimated:
        reason = "its modes have no estimate of them"
    else:
        checked, reason = scene.run.checks, f"run.checks is {'true' if scene.run.checks else 'false'}"
    return Term("errors of frequencies", body, checked, reason, ("modes:discretisation_errors",))


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
        present, reason = True, "what modes do not represent at joints is estimated"
    if not present and any(True for _ in interfaces_read(scene, body)):
        present, reason = True, "a probe reads an interface of it"
    if not stock.elastic:
        present, reason = False, RIGID
    return Term("residual flexibility", body, present, reason, ("modes:residual_flexibility",))


def _touching(scene: Scene, body: str) -> list[str]:
    """Return the names of the contacts in which a body takes part."""
    others = scene.others()
    return [
        name
        for name, contact in scene.contact.items()
        if contact.body == body or (name in others and others[name].body == body)
    ]


def _unused(terms: list[Term], body: str, stock: Stock) -> Iterator[Term]:
    """Yield the interfaces, traction spaces, loads and gauges of a component that the scene does not use."""
    used = [f"{field.partition(':')[2]}/" for term in terms if term.present for field in term.fields]
    for path in stock.places:
        group, _, name = path.partition("/")
        if not any(field.startswith(f"{path}/") for field in used):
            kind = {"interfaces": "interface", "tractions": "traction space", "loads": "load surface"}.get(group)
            reason = "nothing acts on it" if kind else f"body.{body}.gauges does not name it"
            points = (f"morph:points/{name}",) if group == "interfaces" else ()
            yield Term(f"{kind or 'gauge'} {name}", body, False, reason, (f"modes:{path}", *points))


def _floating(scene: Scene, body: str, stock: Stock) -> Iterator[Term]:
    """Yield the inertia couplings of a body that deforms and turns, its stiffness by stress, and its attachment."""
    settings, turns = scene.body[body], scene.capabilities.turns
    reason = "motion is small: frame and elastic inertia do not couple"
    if turns:
        reason = f"{settings.attachment} frame" if stock.elastic else RIGID
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
