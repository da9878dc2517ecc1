"""Operations on friction: a scene whose contacts get a coefficient, while their surfaces move along each other."""

from dataclasses import replace
from typing import Any

import numpy as np

from gudgeon.pipeline.robustness.operations.scaling import in_units
from gudgeon.pipeline.robustness.subject import NO_CONTACT, Subject, require
from gudgeon.pipeline.robustness.trial import Trial, approach, found_step, turns_freely
from gudgeon.pipeline.robustness.turning import turned
from gudgeon.pipeline.robustness.units import Units
from gudgeon.solver.obstacles import Plane
from gudgeon.solver.scene.body import ALL_FREE

MOST_POINTS = 320
"""Contact points up to which cases of friction are run: each has three unknowns, and time grows with their square."""
VANISHING = 1e-6
"""Allowed relative difference of an impulse without friction and with a coefficient that vanishes, of 1e-9."""
LIMITS = {"angle": 1e3, "offset": 1e6}
"""Limits of the motion [rad, m]: rules hold of the linear model wherever its surfaces move."""
SPEED = 1.0
"""Of surfaces along each other where no body has a velocity [m/s]."""
FAR = 1e4
"""Length of a run over the duration of its first contact above which the case is the time around this contact alone:
steps resolve the contact, and surfaces that move along each other until then would be far aside."""
AROUND = 100.0
"""Time before the first contact and after it in such a case, over its duration."""


def friction(subject: Subject, operation: Any) -> Trial:
    """Give every contact a coefficient of friction, and compare as `with` says."""
    _check(subject, operation.compared)
    rubbing = _rubbing(subject, operation.coefficient, operation.press)
    if operation.compared == "alone":
        return Trial(rubbing)
    # A step that is found for each run may be another one.
    step = rubbing.scene.run.step or found_step(rubbing)
    rubbing = replace(rubbing, scene=with_step(rubbing.scene, step))
    if operation.compared == "units":
        trial = in_units(replace(subject, job=rubbing), Units(1e3, 1e-3, 1.0))
        return replace(trial, like=Trial(rubbing), stretch=None)
    if operation.compared == "turned":
        return Trial(replace(rubbing, scene=turned(rubbing.scene)), units=Units(), like=Trial(rubbing))
    smooth = _rubbing(subject, 0.0, operation.press)
    smooth = replace(smooth, scene=with_step(smooth.scene, step))
    return Trial(rubbing, like=Trial(smooth), agreement=VANISHING)


def _check(subject: Subject, compared: str) -> None:
    """Raise DoesNotApply for a scene whose contacts can have no friction, or none that such a case judges."""
    require(subject.contacts, NO_CONTACT)
    scene, points = subject.scene, subject.known["points"]
    require(not scene.masters(), "friction does not act on points that slide over another body's surface")
    require(not scene.joint, "a joint prescribes how surfaces move along each other")
    require(not subject.turns, "bodies that turn by any angle have smoothed friction only, of a speed of its own")
    components = {body: scene.component[scene.component_of(body)] for body in _touching(subject)}
    for body, component in components.items():
        straight = component.geometry.kind == "bar"
        require(not straight, f"body '{body}' moves along one line only, so that no surfaces move along each other")
    require(points <= MOST_POINTS, f"{points} contact points, friction is tried on {MOST_POINTS} at most")
    for body, component in components.items():
        loaded = compared == "frictionless" and component.modes.reduction == "ritz"
        name = scene.component_of(body)
        require(not loaded, f"the Ritz vectors of component '{name}' are those of its loads, to which friction adds")


def with_step(scene: Any, step: float) -> Any:
    """Return a scene with a given step [s], whose errors are not estimated: runs with the same one are compared."""
    return scene.model_copy(update={"run": scene.run.model_copy(update={"step": step, "checks": False})})


def _touching(subject: Subject) -> list[str]:
    """Return the bodies that contacts name."""
    contacts = subject.contacts.values()
    partners = [getattr(contact.against, "body", None) for contact in contacts]
    return [*(contact.body for contact in contacts), *filter(None, partners)]


def _rubbing(subject: Subject, coefficient: float, press: float | None) -> Any:
    """Return the job with friction, run by integrator `small`, its first contact's surfaces in relative motion."""
    scene, around = subject.scene, near_contact(subject)
    name, contact = next(iter(subject.contacts.items()))
    towards, body = -approach(subject.job)[0], scene.body[contact.body]
    across = np.cross(towards, np.eye(3)[int(np.abs(towards).argmin())])
    speed = max(float(np.linalg.norm(body.velocity)) for body in scene.body.values()) or SPEED
    aside = speed * (0.8 * across + 0.6 * np.cross(towards, across)) / np.linalg.norm(across)
    bodies, run = around.get("body", {}), {"integrator": "small", "limits": LIMITS} | around.get("run", {})
    contacts: dict[str, Any] = {
        n: {"friction": {"static": coefficient, "kinetic": coefficient, "direction": "unset"}} for n in subject.contacts
    }
    if isinstance(contact.against, Plane):
        if coefficient > 0:  # Without friction it has no effect.
            contacts[name]["against"] = {"velocity": (np.array(contact.against.velocity) + aside).tolist()}
    elif tuple(body.freedom) == ALL_FREE and turns_freely(subject.job, contact.body):
        motion = bodies.setdefault(contact.body, {"velocity": list(body.velocity)})
        motion["velocity"] = (np.array(motion["velocity"]) + aside).tolist()
    if scene.run.step is None:
        run["checks"] = True
    if scene.integrator != "small":
        run["step"] = "unset"
    if press:
        run |= {"gravity": (np.array(scene.run.gravity) + press * towards).tolist(), "start": "undeformed"}
    return subject.changed({"contact": contacts, "run": run, "body": bodies})


def near_contact(subject: Subject, ratio: float = 1.0) -> dict[str, Any]:
    """Return the changes by which a scene begins shortly before its first contact and ends shortly after it.

    Bodies are then where they have flown, with their velocities there. Empty where the run is not much longer than the
    contact, and where what moves before is more than free flight.

    Args:
        ratio: Duration of the contact over that in the unchanged scene.
    """
    scene, contact = subject.scene, subject.base.contact
    if contact is None or not 0.0 < FAR * ratio * contact.duration < scene.run.duration:
        return {}
    duration = ratio * contact.duration
    lead, gravity = AROUND * duration, np.array(scene.run.gravity)
    time = contact.start - lead
    if not (time > 0.0 and _flies(scene)):
        return {}
    changes = {}
    for name, body in scene.body.items():
        speed = np.array(body.velocity)
        flown = np.array(body.position) + time * speed + 0.5 * time**2 * gravity
        changes[name] = {"position": flown.tolist(), "velocity": (speed + time * gravity).tolist()}
    return {"body": changes, "run": {"duration": lead + duration + min(scene.run.duration - contact.start, lead)}}


def _flies(scene: Any) -> bool:
    """Return whether all that moves before the first contact is in free flight without rotation."""
    if scene.springs() or scene.over_time() or scene.motion or scene.fields():
        return False
    if any(any(getattr(contact.against, "velocity", ())) for contact in scene.contact.values()):
        return False
    return all(
        tuple(body.freedom) == ALL_FREE and not any(body.angular_velocity)
        for body in scene.body.values()
        if any(body.velocity) or any(body.angular_velocity) or any(scene.run.gravity)
    )
