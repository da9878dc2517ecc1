"""What each kind of case makes of a scene. A new kind is a model in `settings`, a function and a line below."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.robustness.evidence import Evidence, FirstContact, Refusal
from gudgeon.pipeline.robustness.slivers import with_slivers
from gudgeon.pipeline.robustness.trial import Trial, approach, stepped, suggested_step
from gudgeon.pipeline.robustness.units import Units, rescaled, rescaled_mesh, rescaled_profile
from gudgeon.pipeline.scenes.change import table_path

AGREES = 0.01
"""Relative difference of an impulse that a too large step may make, divided as it is."""
SAME_SPACE = 1e-6
"""Relative difference of an impulse where static shapes are dropped that others hold."""
ALL = 100_000
"""Static shapes: one for each point of any interface."""
STATIC = ("macneal", "normal+static")
"""Reductions with static shapes beside normal modes."""


class DoesNotApply(Exception):
    """A case has nothing to change in a scene; its text says why."""


@dataclass(frozen=True)
class Subject:
    """A scene that is put to its robustness cases."""

    job: Any
    """Its job, of any kind, ended early where the scene says so."""
    meshes: Mapping[str, MeshRecord]
    """Mesh of each component in use, before any change."""
    run: Callable[[Trial, Path], Evidence | Refusal]
    """Runs a trial with a folder for what is not kept."""
    changed: Callable[[Mapping[str, Any]], Any]
    """Returns the job with nested tables of changes put into its scene."""
    known: dict[str, Any] = field(default_factory=dict)
    """What is known of it before any case, and what one case found and others use."""
    base: Evidence = field(default_factory=Evidence)
    """What it finds as it is."""
    folder: Path = Path()
    """For files that cases need."""

    @property
    def scene(self) -> Any:
        return self.job.scene

    @property
    def contacts(self) -> dict[str, Any]:
        """Its contacts; a wheel has none."""
        return getattr(self.scene, "contact", {})

    @property
    def bodies(self) -> dict[str, Any]:
        """Its bodies; a wheel is one."""
        return getattr(self.scene, "body", {"wheel": None})

    def elastic(self) -> list[str]:
        """Return the components in use that deform."""
        own = self.scene.component
        return [n for n in self.meshes if own[n].material is not None and own[n].modes.reduction != "rigid"]

    def contact(self) -> FirstContact:
        """Return the first contact of the scene as it is.

        Raises:
            DoesNotApply: nothing touches.
        """
        if self.base.contact is None:
            raise DoesNotApply("nothing touches in it")
        return self.base.contact


def _in_units(subject: Subject, units: Units) -> Trial:
    """Return the scene in other units, on the same meshes."""
    scene = rescaled(subject.scene, units)
    components = dict(scene.component)
    for name in subject.meshes:
        profile = components[name].change.profile
        source = table_path(profile, subject.job.path.parent, name)
        if source is not None:
            target = subject.folder / f"{name}-{units.length:g}.csv"
            rescaled_profile(source, target, units)
            profile = profile.model_copy(update={"table": str(target.resolve())})
            change = components[name].change.model_copy(update={"profile": profile})
            components[name] = components[name].model_copy(update={"change": change})
    job = replace(subject.job, scene=scene.model_copy(update={"component": components}))
    meshes = {name: rescaled_mesh(mesh, units) for name, mesh in subject.meshes.items()}
    return Trial(job, meshes, units=units, stretch=dict.fromkeys(subject.meshes, 1 / units.time))


def _with_components(subject: Subject, components: Mapping[str, Any]) -> Any:
    """Return the job with other components, unchecked: limits of input do not bound what is tried."""
    scene = subject.scene.model_copy(update={"component": subject.scene.component | dict(components)})
    return replace(subject.job, scene=scene)


def contact_stiffness(subject: Subject, operation: Any) -> Trial:
    """Scale layers, laws and springs; where nothing else yields, all of the scene: then it is the same but faster."""
    factor, scene = operation.factor, subject.scene
    yielding = [n for n, c in subject.contacts.items() if c.law is not None or c.surface_stiffness is not None]
    springs = scene.springs() if subject.contacts else {}
    elastic, pulled = bool(subject.elastic()), bool(springs) or (subject.contacts and any(scene.run.gravity))
    if not yielding or (pulled and not elastic):
        if not (elastic or springs or yielding):
            raise DoesNotApply("nothing in it yields: rigid bodies in rigid contact")
        return _in_units(subject, Units(time=factor**-0.5))
    changes: dict[str, Any] = {"contact": {}, "force": {}}
    exponent = 1.0
    for name in yielding:
        contact = scene.contact[name]
        law = contact.law
        if law is None:
            changes["contact"][name] = {"surface_stiffness": contact.surface_stiffness * factor}
            continue
        exponent = getattr(law, "exponent", 1.0)
        key = "modulus" if getattr(law, "modulus", None) is not None else "stiffness"
        changes["contact"][name] = {"law": {key: getattr(law, key) * factor}}
        if getattr(law, "damping", 0.0):
            changes["contact"][name]["law"]["damping"] = law.damping * factor**0.5
    for name, spring in springs.items():
        changes["force"][name] = {"stiffness": spring.stiffness * factor}
    start = subject.contact().start
    if not elastic:  # What presses rigid bodies takes so much longer or shorter.
        changes["run"] = {"duration": start + (scene.run.duration - start) * factor ** (-1 / (exponent + 1))}
    return Trial(subject.changed(changes), factor=factor)


def mass(subject: Subject, operation: Any) -> Trial:
    """Scale the first body; where it is the only one, at the same energy: it is the same but slower.

    Where a joint drives a body, pace is given and a body alone in another weight is another machine: then all masses,
    moduli and loads, at the same pace.
    """
    factor, scene = operation.factor, subject.scene
    if getattr(scene, "joint", {}):
        return _in_units(subject, Units(mass=factor))
    if len(subject.bodies) == 1:
        return _in_units(subject, Units(mass=factor, time=factor**0.5))
    body = next((contact.body for contact in subject.contacts.values()), next(iter(subject.bodies)))
    name = scene.component_of(body)
    component, shared = scene.component[name], [b for b in scene.body if scene.component_of(b) == name]
    if component.material is None:
        geometry = component.geometry
        inertia = tuple(factor * one for one in geometry.inertia)
        changed = {"geometry": geometry.model_copy(update={"mass": factor * geometry.mass, "inertia": inertia})}
    else:
        changed = {"material": component.material.model_copy(update={"rho": factor * component.material.rho})}
    own = name if len(shared) == 1 else f"{name} of {body}"
    job = _with_components(subject, {own: component.model_copy(update=changed)})
    bodies = scene.body | {body: scene.body[body].model_copy(update={"component": own})}
    job = replace(job, scene=job.scene.model_copy(update={"body": bodies}))
    stretch = dict.fromkeys(subject.meshes, 1.0)
    if own == name:
        stretch[name] = factor**-0.5
    return Trial(job, stretch=stretch)


def step(subject: Subject, operation: Any) -> Trial:
    """Give a step far above the one that the integrator takes by itself, and compare with the scene as it is."""
    scene = subject.scene
    if not subject.contacts and not getattr(scene, "force", {}):
        raise DoesNotApply("nothing presses in it, so nothing depends on a step")
    if "step" not in subject.known:
        subject.known["step"] = _stepped(subject)
    name, suggested = subject.known["step"]
    changes = {"integrator": name, "step": suggested * operation.factor, "accuracy": "unset"}
    return Trial(subject.changed({"run": changes}), agreement=AGREES)


def _stepped(subject: Subject) -> tuple[str, float]:
    """Return an integrator with a step that carries the scene, and its step [s]."""
    own, names, reasons = subject.scene.integrator, stepped(subject.job), []
    if own not in names and subject.scene.run.integrator != "auto":
        raise DoesNotApply(f"it asks for integrator '{own}' by name, which has no step")
    for name in [own] if own in names else names:
        try:
            given = {} if name == own else {"step": "unset"}
            job = subject.changed({"run": {"integrator": name, "accuracy": "unset"} | given})
            return name, job.scene.run.step or suggested_step(job)
        except InputError as error:
            reasons.append(str(error))
    raise DoesNotApply(f"integrator '{own}' has no step" + "".join(f"; {reason}" for reason in reasons))


def restitution(subject: Subject, operation: Any) -> Trial:
    """Make every contact one of Newton's restitution, or tell its law what to give back."""
    if subject.base.contact is None:
        raise DoesNotApply("nothing touches in it")
    if subject.scene.masters():
        raise DoesNotApply("points slide over another body's surface, which impacts have no rows for")
    changes: dict[str, Any] = {}
    for name, contact in subject.contacts.items():
        if contact.law is not None and hasattr(contact.law, "restitution") and operation.value > 0:
            changes[name] = {"law": {"restitution": operation.value}}
        else:
            unset = dict.fromkeys(("law", "surface_stiffness", "dashpot"), "unset")
            changes[name] = {"method": "impact", "restitution": operation.value} | unset
    points, coordinates = subject.known["points"], subject.known["coordinates"]
    if points > coordinates and any("method" in one for one in changes.values()):
        raise DoesNotApply(f"{points} points on {coordinates} coordinates: rigid impacts on them are not determined")
    run = {"integrator": "auto", "step": "unset", "accuracy": "unset"}
    return Trial(subject.changed({"contact": changes, "run": run}))


def grazing(subject: Subject, operation: Any) -> Trial:
    """Start slower from as much nearer, so that the first contact comes; see docs/robustness.md."""
    first, scene, factor = subject.contact(), subject.scene, operation.factor
    if scene.joint:
        raise DoesNotApply("a joint prescribes how fast its bodies move")
    gravity = np.array(scene.run.gravity)
    falls, rigid = bool(gravity.any()), not subject.elastic()
    changes: dict[str, Any] = {"body": {}, "contact": {}, "run": {}}
    for name, body in scene.body.items():
        way = np.array(body.velocity) * first.start
        # With gravity times shrink as well as speeds.
        way = way + 0.5 * gravity * first.start**2 if falls else way
        left = (factor**2 if falls else factor) * way
        changes["body"][name] = {"position": ((np.array(body.position) + way) - left).tolist()}
    units, single = None, len(scene.contact) == 1 and not scene.springs()
    law = next(iter(scene.contact.values())).law
    linear = single and subject.known["points"] == 1 and (law is None or law.kind == "linear")
    if (linear and not falls) or (rigid and single and law is None and falls):
        # Places are rounded: the gap that they leave is read off, and the rest follows it to the last digit.
        gap = approach(subject.job)[1]
        left = approach(subject.changed(changes))[1] / gap if gap > 0 else factor ** (2 if falls else 1)
        factor = left**0.5 if falls and left > 0 else left
        units = Units(length=left, time=factor if falls else 1.0)
    if not factor > 0:
        raise InputError(f"grazing: bodies moved on to their first contact overlap there ({factor:g} of the gap left)")
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
    elif rigid and single and law is not None and units is None:  # The slower, the longer it presses.
        n = law.exponent
        left = (scene.run.duration - first.start) * factor ** ((1 - n) / (n + 1))
        changes["run"] = {"duration": first.start + left}
    return Trial(subject.changed(changes), units=units, measured=units is not None)


def penetration(subject: Subject, operation: Any) -> Trial:
    """Move the body of the first contact into what it touches."""
    if not subject.contacts:
        raise DoesNotApply("nothing touches in it")
    name = next(iter(subject.contacts.values())).body
    direction, gap, size = approach(subject.job)
    place = np.array(subject.scene.body[name].position) - direction * (gap + operation.share * size)
    return Trial(subject.changed({"body": {name: {"position": place.tolist()}}}))


def poisson(subject: Subject, operation: Any) -> Trial:
    """Give every elastic component another Poisson's ratio."""
    names = [name for name in subject.elastic() if _has_shear(subject.scene.component[name].geometry)]
    if not names:
        raise DoesNotApply("no body has shear that ν could change")
    return Trial(_with_components(subject, {n: _material(subject, n, nu=operation.nu) for n in names}))


def _has_shear(geometry: Any) -> bool:
    """Return whether Poisson's ratio enters: not in bars, nor in beams after Euler-Bernoulli."""
    return geometry.kind != "bar" and not (geometry.kind == "beam" and geometry.theory == "euler-bernoulli")


def material(subject: Subject, operation: Any) -> Trial:
    """Scale modulus and density of every elastic component, and where bodies touch of all else: the same, faster."""
    names = subject.elastic()
    faster: float = (operation.modulus / operation.density) ** 0.5
    if not names:
        raise DoesNotApply("its bodies are rigid")
    if subject.contacts:
        return _in_units(subject, Units(mass=operation.density, time=1 / faster))
    given = {n: subject.scene.component[n].material for n in names}
    changed = {
        n: _material(subject, n, E=one.E * operation.modulus, rho=one.rho * operation.density)
        for n, one in given.items()
    }
    return Trial(_with_components(subject, changed), stretch=dict.fromkeys(names, faster))


def _material(subject: Subject, name: str, **values: float) -> Any:
    component = subject.scene.component[name]
    return component.model_copy(update={"material": component.material.model_copy(update=values)})


def slivers(subject: Subject, operation: Any) -> Trial:
    """Split elements of every elastic component."""
    if not (names := subject.elastic()):
        raise DoesNotApply("its bodies are rigid")
    own = {n: with_slivers(subject.meshes[n], operation.aspect, operation.count) for n in names}
    return Trial(subject.job, {**subject.meshes, **own})


def collinear(subject: Subject, operation: Any) -> Trial:
    """Take all static shapes of every interface, and of a second interface that is the same."""
    scene, once, twice = subject.scene, {}, {}
    for name in subject.elastic():
        component = scene.component[name]
        touched = {k: i for k, i in component.interface.items() if i.kind in ("points", "patch", "traction")}
        if component.modes.reduction not in STATIC or not touched:
            continue
        modes = {"modes": {"static_count": ALL}}
        twins = {f"{k}-twin": i.model_dump(exclude_unset=True) for k, i in touched.items()}
        once[name], twice[name] = modes, modes | {"interface": twins}
    if not once:
        raise DoesNotApply("no body has static shapes of an interface beside its modes")
    # All shapes leave no residual flexibility: what has no layer is held by a constraint.
    bare = {
        name: {"method": "constraint", "dashpot": "unset"}
        for name, contact in subject.contacts.items()
        if contact.method == "residual" and contact.law is None and contact.surface_stiffness is None
    }
    rest = {"contact": bare} | ({"run": {"integrator": "auto", "step": "unset"}} if bare else {})
    like = Trial(subject.changed({"component": once} | rest))
    return Trial(subject.changed({"component": twice} | rest), like=like, agreement=SAME_SPACE)


def other_units(subject: Subject, operation: Any) -> Trial:
    """Give every number in other units."""
    return _in_units(subject, Units(operation.mass, operation.length, operation.time))


def size(subject: Subject, operation: Any) -> Trial:
    """Make everything larger or smaller, of the same material."""
    factor = operation.factor
    return _in_units(subject, Units(mass=factor**3, length=factor, time=factor))


def set_values(subject: Subject, operation: Any) -> Trial:
    """Change keys of the scene."""
    return Trial(subject.changed(operation.values))


OPERATIONS: dict[str, Callable[[Subject, Any], Trial]] = {
    "contact-stiffness": contact_stiffness, "mass": mass, "step": step, "restitution": restitution,
    "grazing": grazing, "penetration": penetration, "poisson": poisson, "slivers": slivers, "collinear": collinear,
    "units": other_units, "size": size, "material": material, "set": set_values,
}  # fmt: skip
