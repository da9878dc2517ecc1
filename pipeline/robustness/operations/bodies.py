"""Operations on bodies, their meshes, joints and steps."""

from dataclasses import replace
from typing import Any

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.robustness.operations.friction import near_contact
from gudgeon.pipeline.robustness.operations.scaling import extent, in_equal_steps, in_units, job_with, updated
from gudgeon.pipeline.robustness.operations.settings import AGREES, SAME_SPACE
from gudgeon.pipeline.robustness.slivers import with_slivers
from gudgeon.pipeline.robustness.subject import ALL_RIGID, DoesNotApply, Subject, require
from gudgeon.pipeline.robustness.trial import Trial, stepped, suggested_step
from gudgeon.pipeline.robustness.turning import turned
from gudgeon.pipeline.robustness.units import Units
from gudgeon.solver.joints.clearance import Clearance
from gudgeon.solver.joints.markers import Marked


def mass(subject: Subject, operation: Any) -> Trial:
    """Scale the mass of the first body; of an only body with the time scale, at the same energy.

    A joint of the piston's kind prescribes the time scale, so that a change of one mass gives another machine: masses,
    moduli and loads are then all scaled. Where the scene gives its step, a lighter body is run near its first contact,
    which lasts as the root of its mass: so short steps are too many for the whole.
    """
    factor, scene = operation.factor, subject.scene
    if subject.joints and not subject.turns:
        return in_units(subject, Units(mass=factor))
    if len(subject.bodies) == 1:
        return in_units(subject, Units(mass=factor, time=factor**0.5))
    body = subject.first_body if subject.contacts else next(iter(subject.bodies))
    name = scene.component_of(body)
    component, shared = scene.component[name], scene.bodies_of(name)
    if component.material is None:
        inertia = tuple(factor * moment for moment in component.geometry.inertia)
        changed = {"geometry": {"mass": factor * component.geometry.mass, "inertia": inertia}}
    else:
        changed = {"material": {"rho": factor * component.material.rho}}
    heavier = name if len(shared) == 1 else f"{name} of {body}"
    changes = {"component": {heavier: updated(component, changed)}, "body": {body: {"component": heavier}}}
    if scene.run.step is not None:  # Another mass needs another step than the one given: it is controlled.
        changes["run"] = {"step": None, "checks": True}
        if around := near_contact(subject, factor**0.5):
            subject = replace(subject, job=subject.changed(around))
    stretch = dict.fromkeys(subject.meshes, 1.0) | ({name: factor**-0.5} if heavier == name else {})
    return Trial(job_with(subject, changes), stretch=stretch)


def step(subject: Subject, operation: Any) -> Trial:
    """Give a multiple of the step that the integrator chooses, and compare with the unchanged scene."""
    scene = subject.scene
    require(
        subject.contacts or getattr(scene, "force", {}) or subject.turns,
        "without contacts and forces the result does not depend on a step",
    )
    if "step" not in subject.known:
        subject.known["step"] = _stepped(subject)
    name, suggested = subject.known["step"]
    size = max(suggested * operation.factor, _mean_step(subject))
    changes = {"integrator": name, "step": size, "accuracy": "unset"}
    # Of what keeps its energy at any step the estimate alone says that one is too long.
    if not subject.contacts or scene.run.step is not None or name == "small":
        changes["checks"] = True
    return Trial(subject.changed({"run": changes}), agreement=AGREES, given_step=True, length=extent(subject))


def _stepped(subject: Subject) -> tuple[str, float]:
    """Return an integrator with a step that supports the scene, and its step [s]."""
    integrator, names, reasons = subject.scene.integrator, stepped(subject.job), []
    if integrator not in names and subject.scene.run.integrator != "auto":
        raise DoesNotApply(f"run.integrator is '{integrator}', which has no step")
    for name in [integrator] if integrator in names else names:
        try:
            step_change = {} if name == integrator else {"step": "unset"}
            job = subject.changed({"run": {"integrator": name, "accuracy": "unset"} | step_change})
            return name, job.scene.run.step or suggested_step(job)
        except InputError as error:
            reasons.append(str(error))
    raise DoesNotApply(f"integrator '{integrator}' has no step" + "".join(f"; {reason}" for reason in reasons))


def _mean_step(subject: Subject) -> float:
    """Return the mean step of the unchanged run [s], if bodies turn: what its errors allow, where contact is rare, is
    longer than what the frequencies in contact need; 0 of others."""
    return subject.scene.run.duration / max(subject.base.steps, 1) if subject.turns else 0.0


def poisson(subject: Subject, operation: Any) -> Trial:
    """Set Poisson's ratio of every elastic component."""
    components = {name: subject.scene.component[name] for name in subject.elastic()}
    names = [name for name, c in components.items() if _has_shear(c.geometry) and c.material.simple]
    require(names, "Poisson's ratio affects none of its bodies")
    return Trial(job_with(subject, {"component": {name: {"material": {"nu": operation.nu}} for name in names}}))


def _has_shear(geometry: Any) -> bool:
    """Return whether Poisson's ratio matters: not for bars and Euler-Bernoulli beams."""
    return geometry.kind != "bar" and not (geometry.kind == "beam" and geometry.theory == "euler-bernoulli")


def slivers(subject: Subject, operation: Any) -> Trial:
    """Split elements of every elastic component into slivers."""
    require(subject.elastic(), ALL_RIGID)
    shapes = {name: cell_of(subject.meshes[name]).shape for name in subject.elastic()}
    names = [name for name, shape in shapes.items() if shape.corners == shape.dimension + 1]
    require(names, "it has no elements of triangles or tetrahedra to split")
    split = {name: with_slivers(subject.meshes[name], operation.aspect, operation.count) for name in names}
    return Trial(subject.job, {**subject.meshes, **split})


def whole_turn(subject: Subject, operation: Any) -> Trial:
    """Turn the whole scene: the result is the same."""
    if not subject.turns:
        subject.contact()
    elif names := [*subject.scene.bearings()]:
        raise DoesNotApply(f"the bush of joint '{names[0]}' is aligned with the axes of the scene")
    subject, like = in_equal_steps(subject)
    job, length = replace(subject.job, scene=turned(subject.scene)), extent(subject)
    return Trial(job, units=Units(), turned=True, length=length, like=like, equal_steps=like is not None)


def repeated_joint(subject: Subject, operation: Any) -> Trial:
    """Repeat a joint of two markers: its rows are held already, so that the motion is the same."""
    pairs = {n: j for n, j in subject.joints.items() if isinstance(j, Marked) and not isinstance(j, Clearance)}
    require(pairs, "the scene has no joint of two markers")
    name, joint = next(iter(pairs.items()))
    duplicate = {f"{name}-duplicate": joint.model_dump(exclude_unset=True)}
    return Trial(subject.changed({"joint": duplicate}), agreement=SAME_SPACE, length=extent(subject))
