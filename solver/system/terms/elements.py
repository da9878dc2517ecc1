"""Terms of joints, springs, fields, loads, motions and probes."""

from collections.abc import Iterator, Mapping
from typing import Any

from gudgeon.solver.joints.markers import Marked
from gudgeon.solver.scene.probe import DistanceProbe, ForceProbe
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.system.terms.term import Term


def element_terms(scene: Scene, body: str) -> Iterator[Term]:
    """Yield the joints, springs and loads of a body, or one omitted term for each kind that it lacks."""
    springs = [
        Term(f"{force.kind} {name}", body, True, f"acts on {interface or 'rigid motion'}", _spring_fields(interface))
        for name, force, interface in _ends(scene.springs(), body)
    ]
    fields = [
        Term(f"field {name}", body, True, f"{force.kind} on {interface or 'rigid motion'}", _spring_fields(interface))
        for name, force, interface in _ends(scene.fields(), body)
    ]
    fields += [
        Term(f"field {n}", body, True, f"{f.kind} on the points of {f.interface}", _point_fields(f.interface))
        for n, f in scene.electrodes().items()
        if f.body == body
    ]
    for name, motion in scene.motion.items():
        if motion.body == body:
            reason = f"{motion.kind} of {motion.interface or 'the rigid body'} is given"
            yield Term(f"motion {name}", body, True, reason, _load_fields(motion.interface))
    for name, interface in interfaces_read(scene, body):
        yield Term(f"probe {name}", body, True, f"reads {interface}", _spring_fields(interface))
    yield from _joints(scene, body) or [Term("joints", body, False, "no joint names it")]
    yield from fields or [Term("fields", body, False, "no electrostatic force names it")]
    yield from springs or [Term("springs", body, False, "no force of kind 'spring' or 'bushing' names it")]
    yield from _loads(scene, body) or [Term("loads", body, False, "no force but a spring, bushing or field names it")]


def _joints(scene: Scene, body: str) -> list[Term]:
    """Return the cranks and joints of two markers that hold a body."""
    terms = [
        Term(f"joint {n}", body, True, f"a {j.kind} holds {j.interface or 'a point'}", _load_fields(j.interface))
        for n, j in scene.cranks().items()
        if j.body == body
    ]
    still = " takes its rows from the coordinates" if scene.held() else ""
    return terms + [
        Term(f"joint {n}", body, True, f"a {scene.joint[n].kind} joint{still}", _hinge_fields(j, body))
        for n, j in scene.hinges().items()
        if body in (j.body, j.against)
    ]


def _loads(scene: Scene, body: str) -> list[Term]:
    """Return the loads over time that act on a body."""
    loads = [(n, f, getattr(f, "interface", None)) for n, f in scene.given().items() if f.body == body]
    return [
        Term(
            f"load {name}", body, True, f"{force.kind} on {interface or 'rigid motion'}",
            (f"modes:tractions/{interface}",) if force.kind == "moving" else _load_fields(interface),
        )
        for name, force, interface in loads
    ]  # fmt: skip


def _ends(forces: Mapping[str, Any], body: str) -> Iterator[tuple[str, Any, str | None]]:
    """Yield name, force and interface of each end on a body of forces between two."""
    for name, force in forces.items():
        for owner, interface in ((force.body, force.interface), (force.against, force.against_interface)):
            if owner == body:
                yield name, force, interface


def _load_fields(interface: str | None) -> tuple[str, ...]:
    """Return the fields of an interface that takes loads; none of a rigid body without one."""
    return (f"modes:loads/{interface}",) if interface else ()


def _hinge_fields(joint: Marked, body: str) -> tuple[str, ...]:
    """Return the fields that a joint of two markers reads of a body."""
    sides = (joint.body, joint.interface), (joint.against, joint.against_interface)
    return tuple(f"modes:loads/{name}" for owner, name in sides if name is not None and owner == body)


def _point_fields(interface: str) -> tuple[str, ...]:
    """Return the fields that an electrode reads of an interface."""
    path = f"modes:interfaces/{interface}"
    return (f"{path}/rows", f"{path}/normals", f"{path}/areas", f"morph:points/{interface}")


def _spring_fields(interface: str | None) -> tuple[str, ...]:
    """Return the fields that a spring or probe on an interface reads, which is a load or a contact point."""
    if interface is None:
        return ()
    path = f"modes:interfaces/{interface}"
    return (f"modes:loads/{interface}", f"{path}/rows", f"{path}/normals", f"morph:points/{interface}")


def interfaces_read(scene: Scene, body: str) -> Iterator[tuple[str, str]]:
    """Yield probe and interface of each interface of a body that a probe reads."""
    for name, probe in scene.probe.items():
        if isinstance(probe, ForceProbe):
            continue
        if probe.body == body and probe.interface is not None:
            yield name, probe.interface
        if isinstance(probe, DistanceProbe) and probe.against == body and probe.against_interface is not None:
            yield name, probe.against_interface
