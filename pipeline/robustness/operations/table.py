"""The operations of robustness cases: a new one is a model in `scenes.robustness`, a function and a line here."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.robustness import settings
from gudgeon.pipeline.robustness.operations.friction import friction, near_contact
from gudgeon.pipeline.robustness.slivers import with_slivers
from gudgeon.pipeline.robustness.subject import ALL_RIGID, NO_CONTACT, DoesNotApply, Subject
from gudgeon.pipeline.robustness.trial import (
    Trial,
    approach,
    closing_turn,
    into_gap,
    stepped,
    suggested_step,
    turns_freely,
)
from gudgeon.pipeline.robustness.turning import turned
from gudgeon.pipeline.robustness.units import Units, rescaled, rescaled_grid, rescaled_mesh, rescaled_profile
from gudgeon.pipeline.scenes.change import moved_surface
from gudgeon.pipeline.stages.job import grids_of
from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.bushing import Bushing
from gudgeon.solver.forces.spring import Spring
from gudgeon.solver.joints.clearance import Clearance
from gudgeon.solver.joints.markers import Marked
from gudgeon.solver.scene.run import LEAST_WINDOW


def _in_equal_steps(subject: Subject) -> tuple[Subject, Trial | None]:
    """Return a scene whose bodies turn with equal steps, and what it is compared with; others as they are, and None.

    Round-off would choose others of their thousands of steps, and results differ by `run.accuracy` then.
    """
    scene = subject.scene
    loose = any(isinstance(one, Clearance) for one in getattr(scene, "joint", {}).values())
    if not subject.turns or loose or subject.base.passing or scene.run.step is not None:
        return subject, None
    step = scene.run.duration / max(subject.base.steps, 1)
    subject = replace(subject, job=subject.changed({"run": {"step": step, "checks": False}}))
    return subject, Trial(subject.job)


def _in_units(subject: Subject, units: Units) -> Trial:
    """Return the trial of the scene in other units, on the same meshes."""
    subject, like = _in_equal_steps(subject)
    tables = {}
    for name in subject.meshes:
        moved = moved_surface(subject.scene.component[name], subject.job.path.parent, name)
        if moved is not None and moved[1] is not None:
            target = subject.folder / f"{name}-{units.length:g}.csv"
            rescaled_profile(moved[1], target, units)
            tables[name] = {"change": {"profile": {"table": str(target.resolve())}}}
    grids = {
        name: rescaled_grid(subject.job.store.get(key, "posegrid"), units)
        for name, key in grids_of(subject.scene).items()
    }
    job = replace(subject.job, scene=_updated(rescaled(subject.scene, units), {"component": tables}))
    meshes = {name: rescaled_mesh(mesh, units) for name, mesh in subject.meshes.items()}
    stretch = dict.fromkeys(subject.meshes, 1 / units.time)
    length, equal = _length(subject), like is not None
    return Trial(job, meshes, grids, units=units, stretch=stretch, length=length, like=like, equal_steps=equal)


def _length(subject: Subject) -> float:
    """Return the largest distance of a body from the origin [m], zero where no body turns."""
    positions = [body.position for body in subject.scene.body.values()] if subject.turns else []
    return max((float(np.linalg.norm(position)) for position in positions), default=0.0)


def _updated(old: Any, changes: Mapping[str, Any]) -> Any:
    """Return a model, or models by name, with nested changes, unchecked: values may exceed the limits of input."""
    table = old if isinstance(old, Mapping) else vars(old)
    new = {
        key: _updated(table[key], change) if isinstance(change, Mapping) else change for key, change in changes.items()
    }
    return {**old, **new} if isinstance(old, Mapping) else old.model_copy(update=new)


def _job_with(subject: Subject, changes: Mapping[str, Any]) -> Any:
    """Return the job with nested changes of its scene, see `_updated`."""
    return replace(subject.job, scene=_updated(subject.scene, changes))


def contact_stiffness(subject: Subject, operation: Any) -> Trial:
    """Scale layers, laws and springs; without these, all stiffness: the same motion at another time scale."""
    factor, scene = operation.factor, subject.scene
    yielding = [n for n, c in subject.contacts.items() if c.law is not None or c.surface_stiffness is not None]
    springs = scene.springs() if subject.contacts else {}
    elastic, pulled = bool(subject.elastic()), bool(springs) or (subject.contacts and any(scene.run.gravity))
    if not yielding or (pulled and not elastic):
        if not (elastic or springs or yielding):
            raise DoesNotApply("all bodies and contacts are rigid")
        return _in_units(subject, Units(time=factor**-0.5))
    changes: dict[str, Any] = {"contact": {}}
    changes["force"] = {name: _stiffer(spring, factor) for name, spring in springs.items()}
    exponent = 1.0
    for name in yielding:
        law = scene.contact[name].law
        if law is None:
            changes["contact"][name] = {"surface_stiffness": scene.contact[name].surface_stiffness * factor}
            continue
        exponent = getattr(law, "exponent", 1.0)
        key = "modulus" if getattr(law, "modulus", None) is not None else "stiffness"
        changes["contact"][name] = {"law": {key: getattr(law, key) * factor}}
        if getattr(law, "damping", 0.0):
            changes["contact"][name]["law"]["damping"] = law.damping * factor**0.5
    start = subject.contact().start
    if not elastic:  # The contact of rigid bodies takes longer or shorter by this factor.
        changes["run"] = {"duration": start + (scene.run.duration - start) * factor ** (-1 / (exponent + 1))}
    return Trial(subject.changed(changes), factor=factor)


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


def mass(subject: Subject, operation: Any) -> Trial:
    """Scale the mass of the first body; of an only body with the time scale, at the same energy.

    A joint of the piston's kind prescribes the time scale, so that a change of one mass gives another machine: masses,
    moduli and loads are then all scaled. Where the scene gives its step, a lighter body is run near its first contact,
    which lasts as the root of its mass: so short steps are too many for the whole.
    """
    factor, scene = operation.factor, subject.scene
    if getattr(scene, "joint", {}) and not subject.turns:
        return _in_units(subject, Units(mass=factor))
    if len(subject.bodies) == 1:
        return _in_units(subject, Units(mass=factor, time=factor**0.5))
    body = next((contact.body for contact in subject.contacts.values()), next(iter(subject.bodies)))
    name = scene.component_of(body)
    component, shared = scene.component[name], scene.bodies_of(name)
    if component.material is None:
        inertia = tuple(factor * one for one in component.geometry.inertia)
        changed = {"geometry": {"mass": factor * component.geometry.mass, "inertia": inertia}}
    else:
        changed = {"material": {"rho": factor * component.material.rho}}
    own = name if len(shared) == 1 else f"{name} of {body}"
    changes = {"component": {own: _updated(component, changed)}, "body": {body: {"component": own}}}
    if scene.run.step is not None:  # Another mass needs another step than the one given: it is controlled.
        changes["run"] = {"step": None, "checks": True}
        if near := near_contact(subject, factor**0.5):
            subject = replace(subject, job=subject.changed(near))
    stretch = dict.fromkeys(subject.meshes, 1.0)
    if own == name:
        stretch[name] = factor**-0.5
    return Trial(_job_with(subject, changes), stretch=stretch)


def step(subject: Subject, operation: Any) -> Trial:
    """Give a multiple of the step that the integrator chooses, and compare with the unchanged scene."""
    scene = subject.scene
    if not subject.contacts and not getattr(scene, "force", {}) and not subject.turns:
        raise DoesNotApply("without contacts and forces the result does not depend on a step")
    if "step" not in subject.known:
        subject.known["step"] = _stepped(subject)
    name, suggested = subject.known["step"]
    given = max(suggested * operation.factor, _mean_step(subject))
    changes = {"integrator": name, "step": given, "accuracy": "unset"}
    # Of what keeps its energy at any step the estimate alone says that one is too long.
    if not subject.contacts or scene.run.step is not None or name == "implicit":
        changes["checks"] = True
    job, length = subject.changed({"run": changes}), _length(subject)
    return Trial(job, agreement=settings.AGREES, given_step=True, length=length)


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


def restitution(subject: Subject, operation: Any) -> Trial:
    """Set Newton's restitution at every contact, or the restitution of its law."""
    subject.contact()
    if subject.scene.masters():
        raise DoesNotApply("method 'impact' does not support points that slide over another body's surface")
    bare = [n for n, c in subject.contacts.items() if not hasattr(c.law, "restitution") or operation.value == 0]
    if subject.turns and bare:
        raise DoesNotApply("method 'impact' does not support bodies that turn by any angle")
    changes: dict[str, Any] = {}
    for name, contact in subject.contacts.items():
        if contact.law is not None and hasattr(contact.law, "restitution") and operation.value > 0:
            changes[name] = {"law": {"restitution": operation.value}}
        else:
            unset = dict.fromkeys(("law", "surface_stiffness", "dashpot"), "unset")
            changes[name] = {"method": "impact", "restitution": operation.value} | unset
    points, coordinates = subject.known["points"], subject.known["coordinates"]
    if points > coordinates and any("method" in one for one in changes.values()):
        raise DoesNotApply(f"rigid impacts of {points} points on {coordinates} coordinates are not unique")
    run: dict[str, Any] = {"integrator": "auto", "step": "unset", "accuracy": "unset"}
    if any("method" in one for one in changes.values()):
        # The energy loss is a sum over all impacts, of which a record keeps one where they are merged.
        run["window"] = LEAST_WINDOW * subject.scene.run.duration
    return Trial(subject.changed({"contact": changes, "run": run}))


def _overlaps(job: Any) -> bool:
    """Whether points of a scene start inside what they meet."""
    try:
        return approach(job)[1] <= 0
    except SceneError:
        return True


def grazing(subject: Subject, operation: Any) -> Trial:
    """Scale the speed of approach, and the distance so that the first contact occurs; see docs/robustness.md."""
    first, scene, factor = subject.contact(), subject.scene, operation.factor
    if scene.joint:
        raise DoesNotApply("a joint prescribes the speed of its bodies")
    if scene.over_time() or scene.motion:
        raise DoesNotApply("forces and motions over time do not scale with the speed")
    if scene.fields():
        raise DoesNotApply("the force of a field does not scale with the speed, and its gap is that of the start")
    gravity = np.array(scene.run.gravity)
    falls, rigid = bool(gravity.any()), not subject.elastic()
    changes: dict[str, Any] = {"body": {}, "contact": {}, "run": {}}
    for name, body in scene.body.items():
        path = np.array(body.velocity) * first.start + 0.5 * gravity * first.start**2
        left = (factor**2 if falls else factor) * path  # With gravity the time of fall scales with the speed.
        changes["body"][name] = {"position": ((np.array(body.position) + path) - left).tolist()}
    if not falls:
        name = next(iter(subject.contacts.values())).body
        wanted = factor * approach(subject.job)[1]
        changes["body"][name]["position"] = into_gap(subject.job, changes["body"][name]["position"], wanted)
    units, single = None, len(scene.contact) == 1 and not scene.springs()
    law = next(iter(scene.contact.values())).law
    linear = single and subject.known["points"] == 1 and (law is None or law.kind == "linear")
    if (linear and not falls) or (rigid and single and law is None and falls):
        # Positions are rounded, so the factor is taken from the gap that the solver has.
        gap = approach(subject.job)[1]
        left = approach(subject.changed(changes))[1] / gap if gap > 0 else factor ** (2 if falls else 1)
        factor = left**0.5 if falls and left > 0 else left
        units = Units(length=left, time=factor if falls else 1.0)
    elif falls and scene.run.step is not None and _overlaps(subject.changed(changes)):
        raise DoesNotApply("the time of the first contact, by a given step, is not as exact as this gap is small")
    if not factor > 0:
        raise InputError(f"grazing: bodies moved to their first contact overlap ({factor:g} of the gap remains)")
    for name, body in scene.body.items():
        changes["body"][name] |= {
            key: [factor * one for one in getattr(body, key)] for key in ("velocity", "angular_velocity")
        }
    for name, contact in scene.contact.items():
        if any(speed := getattr(contact.against, "velocity", ())):
            changes["contact"][name] = {"against": {"velocity": [factor * one for one in speed]}}
    if falls:
        left = (scene.run.duration - first.start) * (factor if rigid else 1.0)
        changes["run"] = {"duration": factor * first.start + left}
    elif rigid and single and law is not None and units is None:  # A slower contact takes longer.
        n = law.exponent
        left = (scene.run.duration - first.start) * factor ** ((1 - n) / (n + 1))
        changes["run"] = {"duration": first.start + left}
    return Trial(subject.changed(changes), units=units, measured=units is not None)


def penetration(subject: Subject, operation: Any) -> Trial:
    """Move the body of the first contact into the other surface."""
    if not subject.contacts:
        raise DoesNotApply(NO_CONTACT)
    if subject.turns and subject.scene.joint:
        raise DoesNotApply("joints place the bodies")
    name = next(iter(subject.contacts.values())).body
    direction, gap, size = approach(subject.job)
    position = np.array(subject.scene.body[name].position) - direction * (gap + operation.share * size)
    return Trial(subject.changed({"body": {name: {"position": position.tolist()}}}))


def spin(subject: Subject, operation: Any) -> Trial:
    """Turn the body of the first contact by an angle over the run, so that its nearest point moves to contact."""
    if not subject.contacts:
        raise DoesNotApply(NO_CONTACT)
    if subject.turns:
        raise DoesNotApply("its bodies turn by any angle")
    name = next(iter(subject.contacts.values())).body
    if not turns_freely(subject.job, name):
        raise DoesNotApply(f"body '{name}' cannot turn about every axis")
    rate = operation.angle / subject.scene.run.duration * closing_turn(subject.job)
    return Trial(subject.changed({"body": {name: {"angular_velocity": rate.tolist()}}}))


def poisson(subject: Subject, operation: Any) -> Trial:
    """Set Poisson's ratio of every elastic component."""
    own = subject.scene.component
    names = [name for name in subject.elastic() if _has_shear(own[name].geometry) and own[name].material.simple]
    if not names:
        raise DoesNotApply("Poisson's ratio affects none of its bodies")
    changes = {name: {"material": {"nu": operation.nu}} for name in names}
    return Trial(_job_with(subject, {"component": changes}))


def _has_shear(geometry: Any) -> bool:
    """Return whether Poisson's ratio matters: not for bars and Euler-Bernoulli beams."""
    return geometry.kind != "bar" and not (geometry.kind == "beam" and geometry.theory == "euler-bernoulli")


def material(subject: Subject, operation: Any) -> Trial:
    """Scale modulus and density of every elastic component; of the scene by its units where it has contacts or joints,
    parts of several materials, or masses that are not meshed."""
    names, component = subject.elastic(), subject.scene.component
    faster: float = (operation.modulus / operation.density) ** 0.5
    if not names:
        raise DoesNotApply(ALL_RIGID)
    plain = all(component[name].material.simple and not component[name].point_mass for name in names)
    if subject.contacts or subject.turns or not plain:
        return _in_units(subject, Units(mass=operation.density, time=1 / faster))
    materials = {name: component[name].material for name in names}
    changed = {
        n: {"material": {"E": m.E * operation.modulus, "rho": m.rho * operation.density}} for n, m in materials.items()
    }
    return Trial(_job_with(subject, {"component": changed}), stretch=dict.fromkeys(names, faster))


def slivers(subject: Subject, operation: Any) -> Trial:
    """Split elements of every elastic component into slivers."""
    if not (names := subject.elastic()):
        raise DoesNotApply(ALL_RIGID)
    slivered = {n: with_slivers(subject.meshes[n], operation.aspect, operation.count) for n in names}
    return Trial(subject.job, {**subject.meshes, **slivered})


def whole_turn(subject: Subject, operation: Any) -> Trial:
    """Turn the whole scene: the result is the same."""
    if not subject.turns:
        subject.contact()
    elif names := [*subject.scene.bearings()]:
        raise DoesNotApply(f"the bush of joint '{names[0]}' stands along the axes of the scene")
    subject, like = _in_equal_steps(subject)
    job, length = replace(subject.job, scene=turned(subject.scene)), _length(subject)
    return Trial(job, units=Units(), turned=True, length=length, like=like, equal_steps=like is not None)


def gap(subject: Subject, operation: Any) -> Trial:
    """Scale lengths so that the least gap of plates is of a given size, at the same material."""
    gaps = [f.gap for f in getattr(subject.scene, "fields", dict)().values() if hasattr(f, "gap")]
    if not gaps:
        raise DoesNotApply("the scene has no field between plates")
    factor = operation.size / min(gaps)
    return _in_units(subject, Units(factor**3, factor, factor))


def repeated_joint(subject: Subject, operation: Any) -> Trial:
    """Repeat a joint of two markers: its rows are held already, so that the motion is the same."""
    joints = getattr(subject.scene, "joint", {})
    joints_of_markers = {n: j for n, j in joints.items() if isinstance(j, Marked) and not isinstance(j, Clearance)}
    if not joints_of_markers:
        raise DoesNotApply("the scene has no joint of two markers")
    name, joint = next(iter(joints_of_markers.items()))
    twin = joint.model_dump(exclude_unset=True)
    return Trial(
        subject.changed({"joint": {f"{name}-twin": twin}}), agreement=settings.SAME_SPACE, length=_length(subject)
    )


OPERATIONS: dict[str, Callable[[Subject, Any], Trial]] = {
    "contact-stiffness": contact_stiffness, "mass": mass, "step": step, "restitution": restitution,
    "grazing": grazing, "penetration": penetration, "spin": spin, "poisson": poisson, "slivers": slivers,
    "collinear": settings.collinear, "samples": settings.samples, "duration": settings.duration,
    "gravity": settings.gravity, "modes": settings.modes, "mesh": settings.mesh, "change": settings.change,
    "units": lambda subject, to: _in_units(subject, Units(to.mass, to.length, to.time)),
    "size": lambda subject, to: _in_units(subject, Units(to.factor**3, to.factor, to.factor)),
    "material": material, "turned": whole_turn, "sag": settings.sag,
    "damping": lambda subject, operation: settings.damping(subject, operation, _in_units),
    "repeated-joint": repeated_joint,
    "voltage": settings.voltage,
    "gap": gap,
    "friction": lambda subject, operation: friction(subject, operation, _in_units),
    "set": lambda subject, to: Trial(subject.changed(to.values)),
}  # fmt: skip
