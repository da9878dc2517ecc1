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
        rubbing = replace(rubbing, scene=_with_step(rubbing.scene, step))
    plain = Trial(rubbing)
    if operation.compared == "units":
        found = in_units(replace(subject, job=rubbing), Units(1e3, 1e-3, 1.0))
        return replace(found, like=plain, stretch=None)
    if operation.compared == "turned":
        return Trial(replace(rubbing, scene=turned(rubbing.scene)), units=Units(), like=plain)
    if operation.compared == "frictionless":
        without = _rubbing(subject, 0.0, operation.press)
        like = replace(without, scene=_with_step(without.scene, rubbing.scene.run.step))
        return replace(plain, like=Trial(like), agreement=VANISHING)
    return plain


def _with_step(scene: Any, step: float) -> Any:
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
    first = next(iter(subject.contacts.values()))
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
        changes["body"] = {first.body: {"velocity": (np.array(body.velocity) + aside).tolist()}}
    if press:
        changes["run"] |= {"gravity": (np.array(scene.run.gravity) + press * towards).tolist(), "start": "undeformed"}
    return subject.changed(changes)
