"""Lines for what no integrator carries: which key of which element is missing or wrong, and what is allowed."""

import difflib
from collections.abc import Iterable, Sequence

from gudgeon.solver.capabilities import Feature
from gudgeon.solver.forces import Force
from gudgeon.solver.forces.spring import Spring
from gudgeon.solver.laws import LAWS
from gudgeon.solver.scene.contact import Contact, MasterSurface, OtherBody
from gudgeon.solver.scene.motion import Motion
from gudgeon.solver.scene.probe import ForceProbe, Probe

NAMED = 4
"""Elements of a scene that a line names."""
KINDS = "force, torque, wrench, spring, bushing"
"""Of forces on bodies that turn by any angle, beside fields."""


def listed(names: list[str]) -> str:
    """Return all names, up to four, so that what is refused for several reasons is refused once."""
    if len(names) > NAMED:
        names = [*names[: NAMED - 1], f"{len(names) - NAMED + 1} more elements"]
    text = " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))
    return text.replace(",,", ",").removesuffix(",")


def refuse_step(name: str) -> None:
    """Raise a ValueError for a step of an integrator that has none."""
    raise ValueError(f"run.step: integrator {name} has no step, since its motion is exact; remove run.step")


def turning_refusal(lacks: Sequence[tuple[str, Feature, Contact | Force | Motion]]) -> str:
    """Return a line for what bodies that turn by any angle do not carry.

    Args:
        lacks: Path of each element, what it needs, and its settings.
    """
    lines = list(dict.fromkeys(_turning_line(*lack) for lack in lacks))
    remainder = [f"{len(lines) - NAMED} more are not carried"] if len(lines) > NAMED else []
    return "; ".join(lines[:NAMED] + remainder)


def _turning_line(path: str, feature: Feature, settings: Contact | Force | Motion) -> str:
    """Return what is wrong with an element where bodies turn by any angle, and what is allowed."""
    if isinstance(settings, Contact):
        return _contact_line(path, feature, settings)
    if path.startswith("motion."):
        return f"{path}: given; a joint of kind 'driven' moves bodies there"
    if isinstance(settings, Spring):
        key = "direction" if not settings.tabled else "table" if settings.table is not None else "values"
        return f"{path}.{key}: given; springs there have a stiffness, along the line between their points"
    resultant = "; a force over time has the resultant" if settings.kind in ("gas", "pressure") else ""
    return f"{path}.kind: '{settings.kind}' given; forces there are of kind {KINDS}{resultant}"


def _contact_line(path: str, feature: Feature, contact: Contact) -> str:
    """Return what is wrong with a contact where bodies turn by any angle, and what is allowed."""
    friction = contact.friction
    return {
        Feature.RIGID_CONTACT:
            f"{path}.method: '{contact.method}' given; contact there has method 'residual', or 'penalty' with a law of"
            f" kind {', '.join(LAWS)}",
        Feature.LINE_FRICTION:
            f"{path}.friction.direction: {friction.direction if friction else None} given; friction there acts in the"
            " plane of contact",
        Feature.TWO_BODIES:
            f"{path}.against.shape: '{contact.against.shape}' given; bodies meet there by points on an interface of"
            " kind 'traction', shape 'surface'",
        Feature.EDGES: f"{path}.against.edges: given; planes there have none",
        Feature.WEAR: f"{path}.wear: given; joints of kind 'clearance' wear there, contacts do not",
        Feature.DASHPOT: f"{path}.dashpot: '{contact.dashpot}' given; 'none' is allowed there",
    }.get(feature, f"{path}: {feature.value} is not carried there")  # fmt: skip


def refuse_turning_probe(name: str, probe: Probe) -> None:
    """Raise a ValueError for a probe of what bodies that turn by any angle do not have."""
    if isinstance(probe, ForceProbe):
        if probe.of.partition(".")[0] not in ("joint", "force"):
            raise ValueError(
                f"probe.{name}.of: '{probe.of}' given; a scene of integrator 'turning' reads forces of joints,"
                " springs, bushings and electrostatic fields"
            )
    elif probe.interface is not None and probe.kind == "rotation":
        raise ValueError(
            f"probe.{name}.interface: given; in a scene of integrator 'turning' rotations are those of the bodies'"
            " frames; leave it out"
        )


def refuse_both_sides(name: str, contact: Contact, partner: MasterSurface | OtherBody) -> None:
    """Raise a ValueError where a contact has one interface of a body on both sides."""
    if (partner.body, partner.interface) == (contact.body, contact.interface):
        raise ValueError(
            f"contact.{name}.against.interface: '{contact.interface}' of '{contact.body}' on both sides; a body meets"
            " itself by two interfaces"
        )


def suggestion(name: str, allowed: Iterable[str]) -> str:
    """Return `did you mean 'x'? ` with the allowed name that is most like one that is not; empty where none is."""
    matches = difflib.get_close_matches(name, list(allowed), 1)
    return f"did you mean '{matches[0]}'? " if matches else ""
