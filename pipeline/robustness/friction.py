"""Operations on friction: a scene whose contacts get a coefficient, while their surfaces move along each other."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from gudgeon.pipeline.robustness.subject import NO_CONTACT, DoesNotApply, Subject
from gudgeon.pipeline.robustness.trial import Trial, approach, suggested_step, turns_freely
from gudgeon.pipeline.robustness.turning import turned
from gudgeon.pipeline.robustness.units import Units
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.obstacles import Plane
from gudgeon.solver.scene.body import ALL_FREE

MOST_POINTS = 320
"""Contact points up to which cases of friction are run: each has three unknowns, and time grows with their square."""
VANISHING = 1e-6
"""Allowed relative difference of an impulse without friction and with a coefficient that vanishes, of 1e-9."""
MOST_TURN, MOST_OFFSET = 1e3, 1e6
"""Limits of the motion [rad, m]: rules hold of the linear model wherever its surfaces move."""
FINER = 4.0
"""Default step over the one of runs that are compared."""
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
    if straight := [body for body in _touching(subject) if _moves_on_a_line(subject, body)]:
        raise DoesNotApply(f"body '{straight[0]}' moves along one line only, so that no surfaces move along each other")
    if subject.known["points"] > MOST_POINTS:
        raise DoesNotApply(f"{subject.known['points']} contact points, friction is tried on {MOST_POINTS} at most")
    rubbing = _rubbing(subject, operation.coefficient, operation.press)
    if operation.compared is not None:  # A step that is found for each run may be another one.
        step = rubbing.scene.run.step or _default_step(rubbing) / FINER
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


def _default_step(job: Any) -> float:
    """Return the default step of a job with friction [s], whose parts get their tangential rows first."""
    run_job(job, "morph", lambda what, share: None)
    return suggested_step(job)


def _with_step(scene: Any, step: float) -> Any:
    return scene.model_copy(update={"run": scene.run.model_copy(update={"step": step})})


def _touching(subject: Subject) -> list[str]:
    """Return the bodies that contacts name."""
    named = [contact.body for contact in subject.contacts.values()]
    return named + [one for contact in subject.contacts.values() if (one := getattr(contact.against, "body", None))]


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
