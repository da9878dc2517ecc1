"""Operations on contacts: their stiffness and restitution, and how bodies approach them."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.robustness.operations.scaling import in_units
from gudgeon.pipeline.robustness.subject import AUTOMATIC, NO_CONTACT, DoesNotApply, Subject, require
from gudgeon.pipeline.robustness.trial import Trial, approach, closing_turn, into_gap, turns_freely
from gudgeon.pipeline.robustness.units import Units
from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.bushing import Bushing
from gudgeon.solver.forces.spring import Spring
from gudgeon.solver.scene.run import LEAST_WINDOW


def contact_stiffness(subject: Subject, operation: Any) -> Trial:
    """Scale layers, laws and springs; without these, all stiffness: the same motion at another time scale."""
    factor, scene = operation.factor, subject.scene
    yielding = {n: c for n, c in subject.contacts.items() if c.law is not None or c.surface_stiffness is not None}
    springs = scene.springs() if subject.contacts else {}
    loaded = springs or (subject.contacts and any(scene.run.gravity))
    if not yielding or (loaded and not subject.elastic()):
        require(subject.elastic() or springs or yielding, "all bodies and contacts are rigid")
        return in_units(subject, Units(time=factor**-0.5))
    changes: dict[str, Any] = {
        "contact": {name: _stiffer_contact(contact, factor) for name, contact in yielding.items()},
        "force": {name: _stiffer(spring, factor) for name, spring in springs.items()},
    }
    start = subject.contact().start
    if not subject.elastic():
        changes["run"] = {"duration": start + (scene.run.duration - start) * _longer(yielding.values(), factor)}
    return Trial(subject.changed(changes), factor=factor)


def _longer(contacts: Iterable[Any], factor: float) -> float:
    """Return the factor on the duration of the contact of rigid bodies whose contacts are stiffer by a factor."""
    exponents = [getattr(contact.law, "exponent", 1.0) for contact in contacts if contact.law is not None]
    return factor ** (-1 / ((exponents or [1.0])[-1] + 1))


def _stiffer_contact(contact: Any, factor: float) -> dict[str, Any]:
    """Return the changes of a contact whose law or layer is stiffer, at the same damping ratio."""
    law = contact.law
    if law is None:
        return {"surface_stiffness": contact.surface_stiffness * factor}
    key = "modulus" if getattr(law, "modulus", None) is not None else "stiffness"
    damping = getattr(law, "damping", 0.0)
    return {"law": {key: getattr(law, key) * factor} | ({"damping": damping * factor**0.5} if damping else {})}


def _stiffer(spring: Spring | Bushing, factor: float) -> dict[str, Any]:
    """Return the changes of a spring or bushing whose forces are multiplied."""
    if isinstance(spring, Spring):
        changes: dict[str, Any] = {"preload": spring.preload * factor}
        if spring.stiffness is not None:
            changes["stiffness"] = spring.stiffness * factor
        if spring.tabled:
            changes["values"] = tuple((length, tension * factor) for length, tension in spring.values)
        return changes
    keys = ("stiffness", "rotational_stiffness", "coupling")
    matrices = {key: getattr(spring, key) for key in keys}
    return {key: (np.array(value) * factor).tolist() for key, value in matrices.items() if value is not None}


def restitution(subject: Subject, operation: Any) -> Trial:
    """Set Newton's restitution at every contact, or the restitution of its law."""
    subject.contact()
    value, points, coordinates = operation.value, subject.known["points"], subject.known["coordinates"]
    require(
        not subject.scene.masters(),
        "method 'impact' does not support points that slide over another body's surface",
    )
    rigid = [n for n, c in subject.contacts.items() if not hasattr(c.law, "restitution") or value == 0]
    require(not (subject.turns and rigid), "method 'impact' does not support bodies that turn by any angle")
    require(
        not (rigid and points > coordinates),
        f"rigid impacts of {points} points on {coordinates} coordinates are not unique",
    )
    changes: dict[str, Any] = {name: {"law": {"restitution": value}} for name in subject.contacts}
    unset = dict.fromkeys(("law", "surface_stiffness", "dashpot"), "unset")
    changes |= {name: {"method": "impact", "restitution": value} | unset for name in rigid}
    # The energy loss is a sum over all impacts, of which a record keeps one where they are merged.
    window = {"window": LEAST_WINDOW * subject.scene.run.duration} if rigid else {}
    return Trial(subject.changed({"contact": changes, "run": AUTOMATIC | window}))


def grazing(subject: Subject, operation: Any) -> Trial:
    """Scale the speed of approach, and the distance so that the first contact occurs; see docs/robustness.md."""
    start, scene = subject.contact().start, subject.scene
    require(not scene.joint, "a joint prescribes the speed of its bodies")
    require(not (scene.over_time() or scene.motion), "forces and motions over time do not scale with the speed")
    require(
        not scene.fields(),
        "the force of a field does not scale with the speed, and its gap is that of the start",
    )
    falls, rigid, law = any(scene.run.gravity), not subject.elastic(), next(iter(scene.contact.values())).law
    single = len(scene.contact) == 1 and not scene.springs()
    bodies = _on_the_way(subject, operation.factor)
    factor, units = _scale(subject, operation.factor, bodies)
    if not factor > 0:
        raise InputError(f"grazing: bodies moved to their first contact overlap ({factor:g} of the gap remains)")
    for name, body in scene.body.items():
        bodies[name] |= {key: _times(factor, getattr(body, key)) for key in ("velocity", "angular_velocity")}
    speeds = {name: getattr(contact.against, "velocity", ()) for name, contact in scene.contact.items()}
    obstacles = {name: {"against": {"velocity": _times(factor, v)}} for name, v in speeds.items() if any(v)}
    run, after = {}, scene.run.duration - start
    if falls:
        run = {"duration": factor * start + after * (factor if rigid else 1.0)}
    elif rigid and single and law is not None and units is None:  # A slower contact takes longer.
        run = {"duration": start + after * factor ** ((1 - law.exponent) / (law.exponent + 1))}
    changes = {"body": bodies, "contact": obstacles, "run": run}
    return Trial(subject.changed(changes), units=units, measured=units is not None)


def _times(factor: float, vector: tuple[float, ...]) -> list[float]:
    return [factor * component for component in vector]


def _on_the_way(subject: Subject, factor: float) -> dict[str, dict[str, Any]]:
    """Return the position of each body from which the first contact occurs at a multiple of its speed."""
    scene, start, gravity = subject.scene, subject.contact().start, np.array(subject.scene.run.gravity)
    falls, bodies = gravity.any(), {}
    for name, body in scene.body.items():
        path = np.array(body.velocity) * start + 0.5 * gravity * start**2
        scaled = (factor**2 if falls else factor) * path  # With gravity the time of fall scales with the speed.
        bodies[name] = {"position": ((np.array(body.position) + path) - scaled).tolist()}
    if not falls:
        target = factor * approach(subject.job)[1]
        moved = bodies[subject.first_body]
        moved["position"] = into_gap(subject.job, moved["position"], target)
    return bodies


def _scale(subject: Subject, factor: float, bodies: dict[str, Any]) -> tuple[float, Units | None]:
    """Return the factor on speeds, and the units in which the motion is the same where that is so."""
    scene, falls = subject.scene, any(subject.scene.run.gravity)
    law = next(iter(scene.contact.values())).law
    linear = subject.known["points"] == 1 and (law is None or law.kind == "linear")
    similar = law is None and not subject.elastic() if falls else linear
    if similar and len(scene.contact) == 1 and not scene.springs():
        # Positions are rounded, so the factor is taken from the gap that the solver has.
        gap, power = approach(subject.job)[1], 2 if falls else 1
        ratio = approach(subject.changed({"body": bodies}))[1] / gap if gap > 0 else factor**power
        factor = ratio ** (1 / power) if ratio > 0 else ratio
        return factor, Units(length=ratio, time=factor if falls else 1.0)
    if falls and scene.run.step is not None and _overlaps(subject.changed({"body": bodies})):
        raise DoesNotApply("the time of the first contact, by a given step, is not as exact as this gap is small")
    return factor, None


def _overlaps(job: Any) -> bool:
    """Whether points of a scene start inside what they meet."""
    try:
        return approach(job)[1] <= 0
    except SceneError:
        return True


def penetration(subject: Subject, operation: Any) -> Trial:
    """Move the body of the first contact into the other surface."""
    require(subject.contacts, NO_CONTACT)
    require(not (subject.turns and subject.scene.joint), "joints determine the positions of the bodies")
    name, (direction, gap, size) = subject.first_body, approach(subject.job)
    position = np.array(subject.scene.body[name].position) - direction * (gap + operation.share * size)
    return Trial(subject.changed({"body": {name: {"position": position.tolist()}}}))


def spin(subject: Subject, operation: Any) -> Trial:
    """Turn the body of the first contact by an angle over the run, so that its nearest point moves to contact."""
    require(subject.contacts, NO_CONTACT)
    require(not subject.turns, "its bodies turn by any angle")
    name = subject.first_body
    require(turns_freely(subject.job, name), f"body '{name}' cannot turn about every axis")
    rate = operation.angle / subject.scene.run.duration * closing_turn(subject.job)
    return Trial(subject.changed({"body": {name: {"angular_velocity": rate.tolist()}}}))
