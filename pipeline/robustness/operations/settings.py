"""Operations on settings that a result must not depend on, or whose effect is estimated: see docs/robustness.md."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.interfaces.traction_space import MOST_FUNCTIONS, traction_space
from gudgeon.pipeline.robustness.operations.friction import with_step
from gudgeon.pipeline.robustness.operations.scaling import in_units
from gudgeon.pipeline.robustness.subject import ALL_RIGID, AUTOMATIC, NO_CONTACT, DoesNotApply, Subject, require
from gudgeon.pipeline.robustness.trial import Trial, approach, found_step
from gudgeon.pipeline.robustness.units import Units
from gudgeon.pipeline.scenes.change import moved_surface
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.capabilities import INTEGRATORS
from gudgeon.solver.forces.fields.electrostatic import Electrostatic
from gudgeon.solver.obstacles import Bore, Plane

AGREES = 0.01
"""Allowed relative difference of impulses and forces where steps differ."""
EXACT = 1e-3
"""The same where the integrator chooses its steps by itself, or has none; forces are then means over samples."""
ENDED = 1 - 1e-6
"""Share of a duration within which an impact has ended before it."""
COMPARABLE = 0.1
"""Share of added speed from which an impact is another one."""
LEAST_MODES = 8
"""Least number of modes that is halved."""
SAME_SPACE = 1e-6
"""Allowed relative difference of an impulse with duplicate static shapes, of a motion with a repeated joint, and of a
damped impact in other units."""
ALL = 100_000
"""Number of static shapes that includes one for each point of any interface."""
LIGHT = 1e-6
"""Acceleration under which no body reaches its obstacle, for the deflection per acceleration [m/s^2]."""
STATIC = ("macneal", "normal+static")
"""Reductions with static correction modes in addition to normal modes."""


LINES = ("bar", "beam", "frame")
HALVED = ("macneal", "normal+static", "rubin", "fixed-reference")
"""Reductions to normal modes, whose number determines the error of the basis."""


def samples(subject: Subject, operation: Any) -> Trial:
    """Change the number of points of the histories: no quantity depends on it."""
    if subject.turns and subject.base.contact is None:
        return Trial(subject.changed({"run": {"samples": operation.count}}), agreement=EXACT)
    subject.contact()
    return _controlled(subject, {"samples": operation.count})


def duration(subject: Subject, operation: Any) -> Trial:
    """Change the duration: the first impact stays the same."""
    contact, time = subject.contact(), subject.scene.run.duration
    shorter = min(1.0, operation.factor)
    ended = contact.start + contact.duration < ENDED * shorter * time
    require(ended, f"the first impact does not end within {shorter:g} of the duration")
    require(not subject.joints, "a joint has tables over the duration")
    return _controlled(subject, {"duration": operation.factor * time})


def _controlled(subject: Subject, run: dict[str, Any]) -> Trial:
    """Return a trial with other settings of the run, and where its steps are controlled, so that they are in both."""
    if INTEGRATORS[subject.scene.integrator].own_steps:
        return Trial(subject.changed({"run": run}), same=EXACT)
    like = _unchanged(subject)
    return Trial(subject.changed({"run": {"checks": subject.scene.run.step is None} | run}), like=like, same=AGREES)


def _unchanged(subject: Subject, run: Mapping[str, Any] = MappingProxyType({})) -> Trial:
    """Return the trial of the scene as it is, or with other settings of the run; its step is controlled, if it is."""
    return Trial(subject.changed({"run": {**run, "checks": subject.scene.run.step is None}}))


def gravity(subject: Subject, operation: Any) -> Trial:
    """Add gravity that presses the first contact's body on the other surface; double it where there is gravity.

    In mechanisms without contact it acts along -z.

    The first impact is then compared too, unless gravity deforms a held body: it may differ by the speed that gravity
    adds until its end, over that of the fastest body.
    """
    require(subject.contacts or subject.turns, NO_CONTACT)
    scene, before = subject.scene, np.array(subject.scene.run.gravity)
    down = approach(subject.job)[0] if subject.contacts else np.array([0.0, 0.0, 1.0])
    acceleration = 2 * before if before.any() else -operation.size * down
    run = {"gravity": acceleration.tolist(), "checks": scene.run.step is None}
    for changes in (run, run | AUTOMATIC | {"checks": True}):
        try:
            return Trial(subject.changed({"run": changes}), same=_speed_bound(subject, operation.size))
        except InputError as error:
            reason = str(error)
    raise DoesNotApply(reason)


def _speed_bound(subject: Subject, size: float) -> float | None:
    """Return by how much gravity [m/s^2] may change the first impact; None where it is another one."""
    scene, contact = subject.scene, subject.base.contact
    speed = max(float(np.linalg.norm(body.velocity)) for body in scene.body.values())
    supported = any(scene.component[scene.component_of(name)].supports for name in scene.body)
    if contact is None or supported or scene.joint or any(scene.run.gravity) or not speed > 0:
        return None
    bound = AGREES + 4 * size * (contact.start + contact.duration) / speed
    return bound if bound < COMPARABLE else None


def damping(subject: Subject, operation: Any) -> Trial:
    """Damp every elastic body in proportion to its stiffness, and compare with the same in km and g.

    Forces and impulses are the same numbers in these.
    """
    elastic, contact = subject.elastic(), subject.contact()
    bodies = {n: body for n, body in subject.scene.body.items() if subject.scene.component_of(n) in elastic}
    require(bodies, ALL_RIGID)
    require(contact.duration > 0, "its impacts have no duration")
    new = {"ratio": operation.ratio, "frequency": 0.5 / contact.duration}
    old = {n: body.damping.model_fields_set if body.damping else () for n, body in bodies.items()}
    damped = {"body": {n: {"damping": dict.fromkeys(keys, "unset") | new} for n, keys in old.items()}}
    try:
        job = subject.changed(damped)
    except InputError:  # Other integrators than its own have damping.
        job = subject.changed(damped | {"run": AUTOMATIC})
    if not INTEGRATORS[job.scene.integrator].own_steps:  # A step that is found for each run may be another one.
        job = replace(job, scene=with_step(job.scene, job.scene.run.step or found_step(job)))
    trial = in_units(replace(subject, job=job), Units(1e3, 1e-3, 1.0))
    return replace(trial, like=trial.like or Trial(job), stretch=None, same=SAME_SPACE)


def static_deflection(subject: Subject, operation: Any) -> Trial:
    """Let gravity press a held body on its obstacle: it starts in equilibrium on it, and stays there."""
    scene, job = subject.scene, subject.job
    require(subject.contacts, NO_CONTACT)
    free = not (subject.turns or scene.force or scene.joint or scene.motion)
    require(free, "forces, joints or driven motions act on its bodies besides")
    obstacles = [contact.against for contact in scene.contact.values()]
    still = all(isinstance(o, Plane | Bore) and not any(getattr(o, "velocity", ())) for o in obstacles)
    system = system_of(job)
    supported = not any(body.rigid_count for body in system.bodies.values())
    require(still and supported, "bodies or obstacles move freely")
    contact, (direction, gap, _) = system.contacts[0], approach(job)
    row = contact.rows.start + int(system.gap[contact.rows].argmin())
    require(gap > 0, "it touches its obstacle undeformed")
    run = AUTOMATIC | {"start": "rest", "checks": False}
    loaded = system_of(subject.changed({"run": run | {"gravity": (-LIGHT * direction).tolist()}}))
    deflection = -float(loaded.rows[row] @ loaded.position)
    require(deflection > 0, "gravity does not bend a body towards its obstacle")
    acceleration = -operation.factor * gap / deflection * LIGHT * direction
    return Trial(subject.changed({"run": run | {"gravity": acceleration.tolist()}}))


def modes(subject: Subject, operation: Any) -> Trial:
    """Keep a share of the normal modes: the estimated error of that basis covers the change of the first impulse."""
    subject.contact()
    bases = {name: subject.scene.component[name].modes for name in subject.elastic()}
    counts = {
        name: {"modes": {"normal_count": int(operation.factor * basis.normal_count)}}
        for name, basis in bases.items()
        if basis.reduction in HALVED and basis.normal_count >= LEAST_MODES
    }
    require(counts, f"no body has {LEAST_MODES} normal modes")
    # Impacts closer than the window are one, and a smaller basis has a longer one: both are read with that.
    fewer = subject.changed({"component": counts})
    run_job(fewer, "morph")
    window = {"window": system_of(fewer).separation}
    changes = {"run": window | {"checks": True}, "component": counts}
    return Trial(subject.changed(changes), like=_unchanged(subject, window))


def mesh(subject: Subject, operation: Any) -> Trial:
    """Scale the elements of bars and beams, with as many modes: the estimated error of that mesh covers the change.

    They have no local compliance, whose own error a mesh of solids has besides.
    """
    subject.contact()
    components = {name: subject.scene.component[name] for name in subject.elastic()}
    sizes = {
        name: {"mesh": {"size": operation.factor * c.mesh.size}, "modes": {"normal_count": c.modes.normal_count}}
        for name, c in components.items()
        if c.geometry.kind in LINES and c.mesh.size is not None and c.modes.reduction in HALVED
    }
    require(sizes, "no body is a bar or a beam with normal modes")
    return Trial(subject.changed({"run": {"checks": True}, "component": sizes}), like=_unchanged(subject))


def collinear(subject: Subject, operation: Any) -> Trial:
    """Use all static shapes of every interface, and those of an identical second interface."""
    by_body = {name: duplicates for name in subject.elastic() if (duplicates := _duplicates(subject, name))}
    require(by_body, "no body has a reduction with static shapes of an interface")
    residual = {name: contact for name, contact in subject.contacts.items() if contact.method == "residual"}
    # With all shapes R = 0, so a contact without a layer needs a constraint.
    for name, contact in residual.items():
        edged = getattr(contact.against, "edges", ())
        require(not edged, f"contact.{name}: a face with edges is met over residual flexibility or a law alone")
    bare = {
        name: {"method": "constraint", "dashpot": "unset"}
        for name, contact in residual.items()
        if contact.law is None and contact.surface_stiffness is None
    }
    changes: dict[str, Any] = {"contact": bare}
    if bare:
        changes["run"] = {"integrator": "auto", "step": "unset", "checks": True}
    once = {name: {"modes": {"static_count": ALL}} for name in by_body}
    twice = {name: once[name] | {"interface": interfaces} for name, interfaces in by_body.items()}
    like = Trial(subject.changed({"component": once} | changes))
    return Trial(subject.changed({"component": twice} | changes), like=like, agreement=SAME_SPACE)


def _duplicates(subject: Subject, name: str) -> dict[str, Any]:
    """Return a second one of each interface of a component whose reduction has static shapes of it."""
    component = subject.scene.component[name]
    if component.modes.reduction not in STATIC:
        return {}
    touched = {key: i for key, i in component.interface.items() if i.kind in ("points", "patch", "traction")}
    tractions = {key: interface for key, interface in touched.items() if interface.kind == "traction"}
    total = sum(traction_space(subject.meshes[name], i, key).size for key, i in tractions.items())
    require(2 * total <= MOST_FUNCTIONS, f"twice its {total} traction functions are more than {MOST_FUNCTIONS}")
    return {f"{key}-duplicate": interface.model_dump(exclude_unset=True) for key, interface in touched.items()}


def change(subject: Subject, operation: Any) -> Trial:
    """Move a cylindrical surface inwards by a share of its radius, with the modes of the design before."""
    solids = [name for name in subject.elastic() if cell_of(subject.meshes[name]).solid]
    for name in solids:
        component = subject.scene.component[name]
        for key, interface in component.interface.items():
            shape = subject.meshes[name].surfaces[interface.surface].shape
            if shape.get("kind") != "cylinder" or interface.kind == "traction":
                continue
            profile = {"surface": interface.surface, "offset": -operation.share * shape["radius"], "table": "unset"}
            table = {name: {"change": {"update": "reuse", "tolerance": "unset", "profile": profile}}}
            # Another shape needs another step than the one given: it is controlled.
            job = subject.changed({"component": table, "run": {"step": "unset", "checks": True}})
            if moved_surface(job.scene.component[name], job.folder, name) is not None:
                return Trial(job)
            raise DoesNotApply(f"interface {key} of {name} cannot be moved")
    raise DoesNotApply("no contact is on a cylindrical surface of an elastic solid")


def voltage(subject: Subject, operation: Any) -> Trial:
    """Scale all voltages and charges; where they vanish, the run is that without fields."""
    changes: dict[str, Any] = {}
    fields = getattr(subject.scene, "fields", dict)() | getattr(subject.scene, "electrodes", dict)()
    for name, field in fields.items():
        if isinstance(field, Electrostatic):
            grid = subject.job.store.get(field.record, "posegrid")
            names = subject.job.store.get(grid.field_key, "field", only=["conductors"]).conductors["names"]
            uncharged = not np.asarray(grid.charges).any()
            require(uncharged, f"force.{name}: the charges of its scene of conductors stay as they are")
            volts = dict(zip(names, np.asarray(grid.potentials, float).tolist(), strict=True)) | dict(field.potentials)
            changes[name] = {"potentials": {k: operation.factor * v for k, v in volts.items() if np.isfinite(v)}}
            continue
        for key in ("potential", "charge"):
            if (value := getattr(field, key, None)) is not None:
                changes[name] = {key: operation.factor * value}
    require(changes, "no voltage or charge acts in the scene")
    read = [
        name for name, probe in subject.scene.probe.items() if getattr(probe, "of", "").partition(".")[2] in changes
    ]
    like = subject.changed({"force": dict.fromkeys(changes, "unset"), "probe": dict.fromkeys(read, "unset")})
    return Trial(subject.changed({"force": changes}), like=Trial(like), agreement=AGREES)
