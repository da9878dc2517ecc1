"""Operations on settings that a result must not depend on, or whose effect is estimated: see docs/robustness.md."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.interfaces.traction_space import MOST_FUNCTIONS, traction_space
from gudgeon.pipeline.robustness.evidence import FirstContact
from gudgeon.pipeline.robustness.operations.friction import with_step
from gudgeon.pipeline.robustness.subject import ALL_RIGID, NO_CONTACT, DoesNotApply, Subject
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
    first, whole = subject.contact(), subject.scene.run.duration
    if not first.start + first.duration < ENDED * min(1.0, operation.factor) * whole:
        raise DoesNotApply(f"the first impact does not end within {min(1.0, operation.factor):g} of the duration")
    if getattr(subject.scene, "joint", {}):
        raise DoesNotApply("a joint has tables over the duration")
    return _controlled(subject, {"duration": operation.factor * whole})


def _controlled(subject: Subject, run: dict[str, Any]) -> Trial:
    """Return a trial with other settings of the run, and where its steps are controlled, so that they are in both."""
    own = subject.scene
    if INTEGRATORS[own.integrator].own_steps:
        return Trial(subject.changed({"run": run}), same=EXACT)
    checks = {"checks": own.run.step is None}
    like = Trial(subject.changed({"run": checks}))
    return Trial(subject.changed({"run": checks | run}), like=like, same=AGREES)


def gravity(subject: Subject, operation: Any) -> Trial:
    """Add gravity that presses the first contact's body on the other surface; double it where there is gravity.

    In mechanisms without contact it acts along -z.

    The first impact is then compared too, unless gravity deforms a held body: it may differ by the speed that gravity
    adds until its end, over that of the fastest body.
    """
    if not subject.contacts and not subject.turns:
        raise DoesNotApply(NO_CONTACT)
    scene, own = subject.scene, np.array(subject.scene.run.gravity)
    down = approach(subject.job)[0] if subject.contacts else np.array([0.0, 0.0, 1.0])
    pull = 2 * own if own.any() else -operation.size * down
    speed = max(float(np.linalg.norm(body.velocity)) for body in scene.body.values())
    held = any(scene.component[scene.component_of(name)].supports for name in scene.body)
    first, same = subject.base.contact, None
    if first is not None and speed > 0 and not held and not own.any() and not scene.joint:
        same = AGREES + 4 * operation.size * _end(first) / speed
        same = same if same < COMPARABLE else None
    changes: dict[str, Any] = {"run": {"gravity": pull.tolist(), "checks": scene.run.step is None}}
    automatic = {"run": changes["run"] | {"integrator": "auto", "step": "unset", "accuracy": "unset", "checks": True}}
    for tried in (changes, automatic):
        try:
            return Trial(subject.changed(tried), same=same)
        except InputError as error:
            reason = str(error)
    raise DoesNotApply(reason)


def damping(subject: Subject, operation: Any, in_units: Callable[[Subject, Units], Trial]) -> Trial:
    """Damp every elastic body in proportion to its stiffness, and compare with the same in km and g.

    Forces and impulses are the same numbers in these.
    """
    elastic, first = subject.elastic(), subject.contact()
    bodies = {n: one for n, one in subject.scene.body.items() if subject.scene.component_of(n) in elastic}
    if not bodies:
        raise DoesNotApply(ALL_RIGID)
    if not first.duration > 0:
        raise DoesNotApply("its impacts have no duration")
    given = {"ratio": operation.ratio, "frequency": 0.5 / first.duration}
    own = {name: dict.fromkeys(body.damping.model_fields_set, "unset") if body.damping else {} for name, body in
           bodies.items()}  # fmt: skip
    damped = {"body": {name: {"damping": unset | given} for name, unset in own.items()}}
    automatic = {"run": {"integrator": "auto", "step": "unset", "accuracy": "unset"}}
    try:
        job = subject.changed(damped)
    except InputError:  # Other integrators than its own have damping.
        job = subject.changed(damped | automatic)
    if not INTEGRATORS[job.scene.integrator].own_steps:  # A step that is found for each run may be another one.
        job = replace(job, scene=with_step(job.scene, job.scene.run.step or found_step(job)))
    found = in_units(replace(subject, job=job), Units(1e3, 1e-3, 1.0))
    return replace(found, like=found.like or Trial(job), stretch=None, same=SAME_SPACE)


def sag(subject: Subject, operation: Any) -> Trial:
    """Let gravity press a held body on its obstacle: it starts in equilibrium on it, and stays there."""
    scene, job = subject.scene, subject.job
    if not subject.contacts:
        raise DoesNotApply(NO_CONTACT)
    if subject.turns or scene.force or scene.joint or scene.motion:
        raise DoesNotApply("forces, joints or driven motions act on its bodies besides")
    against = [one.against for one in scene.contact.values()]
    still = [isinstance(one, Plane | Bore) and not any(getattr(one, "velocity", ())) for one in against]
    system = system_of(job)
    if not all(still) or any(body.rigid_count for body in system.bodies.values()):
        raise DoesNotApply("bodies or obstacles move freely")
    contact, (direction, least, _) = system.contacts[0], approach(job)
    row = contact.rows.start + int(system.gap[contact.rows].argmin())
    if not least > 0:
        raise DoesNotApply("it touches its obstacle undeformed")
    rest = {"integrator": "auto", "step": "unset", "accuracy": "unset", "start": "rest", "checks": False}
    loaded = system_of(subject.changed({"run": rest | {"gravity": (-LIGHT * direction).tolist()}}))
    falls = -float(loaded.rows[row] @ loaded.position)
    if not falls > 0:
        raise DoesNotApply("gravity does not bend a body towards its obstacle")
    pull = -operation.factor * least / falls * LIGHT * direction
    return Trial(subject.changed({"run": rest | {"gravity": pull.tolist()}}))


def _end(first: FirstContact) -> float:
    return first.start + first.duration


def modes(subject: Subject, operation: Any) -> Trial:
    """Keep a share of the normal modes: the estimated error of that basis covers the change of the first impulse."""
    subject.contact()
    counts = {}
    for name in subject.elastic():
        own = subject.scene.component[name].modes
        if own.reduction in HALVED and own.normal_count >= LEAST_MODES:
            counts[name] = {"modes": {"normal_count": int(operation.factor * own.normal_count)}}
    if not counts:
        raise DoesNotApply(f"no body has {LEAST_MODES} normal modes")
    # Impacts closer than the window are one, and a smaller basis has a longer one: both are read with that.
    fewer = subject.changed({"component": counts})
    run_job(fewer, "morph")
    window = {"window": system_of(fewer).window}
    like = Trial(subject.changed({"run": window | {"checks": subject.scene.run.step is None}}))
    return Trial(subject.changed({"run": window | {"checks": True}, "component": counts}), like=like)


def mesh(subject: Subject, operation: Any) -> Trial:
    """Scale the elements of bars and beams, with as many modes: the estimated error of that mesh covers the change.

    They have no local compliance, whose own error a mesh of solids has besides.
    """
    subject.contact()
    sizes = {}
    for name in subject.elastic():
        component = subject.scene.component[name]
        if component.geometry.kind in LINES and component.mesh.size is not None and component.modes.reduction in HALVED:
            modes = {"normal_count": component.modes.normal_count}
            sizes[name] = {"mesh": {"size": operation.factor * component.mesh.size}, "modes": modes}
    if not sizes:
        raise DoesNotApply("no body is a bar or a beam with normal modes")
    checks = {"run": {"checks": True}}
    like = Trial(subject.changed({"run": {"checks": subject.scene.run.step is None}}))
    return Trial(subject.changed(checks | {"component": sizes}), like=like)


def collinear(subject: Subject, operation: Any) -> Trial:
    """Use all static shapes of every interface, and those of an identical second interface."""
    scene, once, twice = subject.scene, {}, {}
    for name in subject.elastic():
        component = scene.component[name]
        touched = {k: i for k, i in component.interface.items() if i.kind in ("points", "patch", "traction")}
        if component.modes.reduction not in STATIC or not touched:
            continue
        total = sum(
            traction_space(subject.meshes[name], interface, key).size
            for key, interface in touched.items()
            if interface.kind == "traction"
        )
        if 2 * total > MOST_FUNCTIONS:
            raise DoesNotApply(f"twice its {total} traction functions are more than {MOST_FUNCTIONS}")
        modes = {"modes": {"static_count": ALL}}
        twins = {f"{k}-twin": i.model_dump(exclude_unset=True) for k, i in touched.items()}
        once[name], twice[name] = modes, modes | {"interface": twins}
    if not once:
        raise DoesNotApply("no body has a reduction with static shapes of an interface")
    # With all shapes R = 0, so a contact without a layer needs a constraint.
    if edged := [n for n, c in subject.contacts.items() if getattr(c.against, "edges", ()) and c.method == "residual"]:
        raise DoesNotApply(f"contact.{edged[0]}: a face with edges is met over residual flexibility or a law alone")
    bare = {
        name: {"method": "constraint", "dashpot": "unset"}
        for name, contact in subject.contacts.items()
        if contact.method == "residual" and contact.law is None and contact.surface_stiffness is None
    }
    rest = {"contact": bare} | ({"run": {"integrator": "auto", "step": "unset", "checks": True}} if bare else {})
    like = Trial(subject.changed({"component": once} | rest))
    return Trial(subject.changed({"component": twice} | rest), like=like, agreement=SAME_SPACE)


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
    for name, one in fields.items():
        if isinstance(one, Electrostatic):
            grid = subject.job.store.get(one.record, "posegrid")
            names = subject.job.store.get(grid.field_key, "field", only=["conductors"]).conductors["names"]
            given = dict(zip(names, np.asarray(grid.potentials, float).tolist(), strict=True)) | dict(one.potentials)
            if np.asarray(grid.charges).any():
                raise DoesNotApply(f"force.{name}: the charges of its scene of conductors stay as they are")
            changes[name] = {"potentials": {k: operation.factor * v for k, v in given.items() if np.isfinite(v)}}
        elif getattr(one, "charge", None) is not None:
            changes[name] = {"charge": operation.factor * one.charge}
        elif getattr(one, "potential", None) is not None:
            changes[name] = {"potential": operation.factor * one.potential}
    if not changes:
        raise DoesNotApply("no voltage or charge acts in the scene")
    read = [name for name, one in subject.scene.probe.items() if getattr(one, "of", "").partition(".")[2] in changes]
    like = subject.changed({"force": dict.fromkeys(changes, "unset"), "probe": dict.fromkeys(read, "unset")})
    return Trial(subject.changed({"force": changes}), like=Trial(like), agreement=AGREES)
