"""Operations on friction: a scene whose contacts get a coefficient, while their surfaces move along each other."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from gudgeon.pipeline.robustness.subject import NO_CONTACT, DoesNotApply, Subject
from gudgeon.pipeline.robustness.trial import Trial, approach, found_step, turns_freely
from gudgeon.pipeline.robustness.turning import turned
from gudgeon.pipeline.robustness.units import Units
from gudgeon.solver.obstacles import Plane
from gudgeon.solver.scene.body import ALL_FREE

MOST_POINTS = 320
"""Contact points up to which cases of friction are run: each has three unknowns, and time grows with their square."""
VANISHING = 1e-6
"""Allowed relative difference of an impulse without friction and with a coefficient that vanishes, of 1e-9."""
MOST_TURN, MOST_OFFSET = 1e3, 1e6
"""Limits of the motion [rad, m]: rules hold of the linear model wherever its surfaces move."""
SPEED = 1.0
"""Of surfaces along each other where no body has a velocity [m/s]."""
FAR = 1e4
"""Length of a run over the duration of its first contact above which the case is the time around this contact alone:
steps resolve the contact, and surfaces that move along each other until then would be far aside."""
AROUND = 100.0
"""Time before the first contact and after it in such a case, over its duration."""

InUnits = Callable[[Subject, Units], Trial]


def friction(subject: Subject, operation: Any, in_units: InUnits) -> Trial:
    """Give every contact a coefficient of friction, and compare as `with` says."""
    if not subject.contacts:
        raise DoesNotApply(NO_CONTACT)
    if subject.scene.masters():
        raise DoesNotApply("friction does not act on points that slide over another body's surface")
    if subject.scene.joint:
        raise DoesNotApply("a joint prescribes how surfaces move along each other")
    if subject.turns:
        raise DoesNotApply("bodies that turn by any angle have smoothed friction only, of a speed of its own")
    if straight := [body for body in _touching(subject) if _moves_on_a_line(subject, body)]:
        raise DoesNotApply(f"body '{straight[0]}' moves along one line only, so that no surfaces move along each other")
    if subject.known["points"] > MOST_POINTS:
        raise DoesNotApply(f"{subject.known['points']} contact points, friction is tried on {MOST_POINTS} at most")
    if operation.compared == "frictionless" and (own := _ritz(subject)):
        raise DoesNotApply(f"the Ritz vectors of component '{own[0]}' are those of its loads, to which friction adds")
    rubbing = _rubbing(subject, operation.coefficient, operation.press)
    if operation.compared != "alone":  # A step that is found for each run may be another one.
        step = rubbing.scene.run.step or found_step(rubbing)
        rubbing = replace(rubbing, scene=with_step(rubbing.scene, step))
    plain = Trial(rubbing)
    if operation.compared == "units":
        found = in_units(replace(subject, job=rubbing), Units(1e3, 1e-3, 1.0))
        return replace(found, like=plain, stretch=None)
    if operation.compared == "turned":
        return Trial(replace(rubbing, scene=turned(rubbing.scene)), units=Units(), like=plain)
    if operation.compared == "frictionless":
        without = _rubbing(subject, 0.0, operation.press)
        like = replace(without, scene=with_step(without.scene, rubbing.scene.run.step))
        return replace(plain, like=Trial(like), agreement=VANISHING)
    return plain


def with_step(scene: Any, step: float) -> Any:
    """Return a scene with a given step [s], whose errors are not estimated: runs with the same one are compared."""
    return scene.model_copy(update={"run": scene.run.model_copy(update={"step": step, "checks": False})})


def _touching(subject: Subject) -> list[str]:
    """Return the bodies that contacts name."""
    named = [contact.body for contact in subject.contacts.values()]
    return named + [one for contact in subject.contacts.values() if (one := getattr(contact.against, "body", None))]


def _ritz(subject: Subject) -> list[str]:
    """Return the components of touching bodies whose basis depends on the directions of the contact forces."""
    names = dict.fromkeys(subject.scene.component_of(body) for body in _touching(subject))
    return [name for name in names if subject.scene.component[name].modes.reduction == "ritz"]


def _moves_on_a_line(subject: Subject, body: str) -> bool:
    return subject.scene.component[subject.scene.component_of(body)].geometry.kind == "bar"


def _rubbing(subject: Subject, coefficient: float, press: float | None) -> Any:
    """Return the job with friction, run by the implicit integrator, its first contact's surfaces in relative motion."""
    scene = subject.scene
    first, near = next(iter(subject.contacts.values())), near_contact(subject)
    towards, body = -approach(subject.job)[0], scene.body[first.body]
    across = np.cross(towards, np.eye(3)[int(np.abs(towards).argmin())])
    speed = max(float(np.linalg.norm(one.velocity)) for one in scene.body.values()) or SPEED
    aside = speed * (0.8 * across + 0.6 * np.cross(towards, across)) / np.linalg.norm(across)
    changes: dict[str, Any] = {
        "contact": {name: {"friction": {"static": coefficient, "kinetic": coefficient, "direction": "unset"}}
                    for name in subject.contacts},
        "run": {"integrator": "implicit", "limits": {"angle": MOST_TURN, "offset": MOST_OFFSET}}
        | ({"checks": True} if scene.run.step is None else {})
        | ({} if scene.integrator == "implicit" else {"step": "unset"}),
    }  # fmt: skip
    if isinstance(first.against, Plane):
        if coefficient > 0:  # Without friction it has no effect.
            name = next(iter(subject.contacts))
            changes["contact"][name]["against"] = {"velocity": (np.array(first.against.velocity) + aside).tolist()}
    elif tuple(body.freedom) == ALL_FREE and turns_freely(subject.job, first.body):
        own = near.setdefault("body", {}).setdefault(first.body, {"velocity": list(body.velocity)})
        own["velocity"] = (np.array(own["velocity"]) + aside).tolist()
    changes["body"] = near.get("body", {})
    changes["run"] |= near.get("run", {})
    if press:
        changes["run"] |= {"gravity": (np.array(scene.run.gravity) + press * towards).tolist(), "start": "undeformed"}
    return subject.changed(changes)


def near_contact(subject: Subject, share: float = 1.0) -> dict[str, Any]:
    """Return the changes by which a scene begins shortly before its first contact and ends shortly after it.

    Bodies are then where they have flown, with their velocities there. Empty where the run is not much longer than the
    contact, and where what moves before is more than free flight.

    Args:
        share: What the contact lasts over how long it lasts in the unchanged scene.
    """
    scene, contact = subject.scene, subject.base.contact
    if contact is None or not 0.0 < FAR * share * contact.duration < scene.run.duration:
        return {}
    lasting = share * contact.duration
    lead = AROUND * lasting
    time, gravity = contact.start - lead, np.array(scene.run.gravity)
    others = scene.springs() or scene.over_time() or scene.motion or scene.fields()
    moving = any(any(getattr(one.against, "velocity", ())) for one in scene.contact.values())
    flying = [body for body in scene.body.values() if any(body.velocity) or any(body.angular_velocity) or gravity.any()]
    free = all(tuple(body.freedom) == ALL_FREE and not any(body.angular_velocity) for body in flying)
    if others or moving or not free or not time > 0.0:
        return {}
    changes = {}
    for name, body in scene.body.items():
        speed = np.array(body.velocity)
        flown = np.array(body.position) + time * speed + 0.5 * time**2 * gravity
        changes[name] = {"position": flown.tolist(), "velocity": (speed + time * gravity).tolist()}
    duration = lead + lasting + min(scene.run.duration - contact.start, lead)
    return {"body": changes, "run": {"duration": duration}}
