"""The ports that a scene asks for, known before any record is read."""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from gudgeon.solver.forces.bushing import Bushing
from gudgeon.solver.forces.external import ExternalForce
from gudgeon.solver.forces.given import GivenWrench
from gudgeon.solver.forces.moving import MovingForce
from gudgeon.solver.joints.coupled import Driven, Gear
from gudgeon.solver.joints.markers import Marked
from gudgeon.solver.methods import METHODS
from gudgeon.solver.ports.table import BLOCK, Kind
from gudgeon.solver.scene.contact import Contact
from gudgeon.solver.scene.scene import Scene

Counts = Callable[[str, str], int | None]
"""Number of the contact points or functions of a body's interface; None before they are known."""
WORDS = {
    Kind.UNILATERAL: "unilateral", Kind.CONE: "friction cone", Kind.LAW: "law", Kind.RUBBING_LAW: "law with friction",
    Kind.SPRING: "spring", Kind.BILATERAL: "bilateral", Kind.GIVEN: "given",
}  # fmt: skip


class PortRow(NamedTuple):
    """The ports of one member of a scene."""

    member: str
    """`contact.NAME`, `joint.NAME`, `force.NAME`, `probe.NAME` or `body.NAME.gauges`."""
    kind: str
    """How they respond, or `read`."""
    number: int | None
    """None before the record of the design exists."""
    bodies: tuple[str, ...]
    rows: str
    """`constant`, or `moving` with the state."""


def port_rows(scene: Scene, counts: Counts) -> list[PortRow]:
    """List the ports of a scene, member by member, in the order of the table that the solver builds."""
    return [*_contacts(scene, counts), *_joints(scene), *_forces(scene, counts), *_readers(scene)]


def _contacts(scene: Scene, counts: Counts) -> Iterator[PortRow]:
    for name, contact in scene.contact.items():
        kind, points = contact_kind(contact), counts(contact.body, contact.interface)
        partner, slides = scene.others().get(name), name in scene.masters()
        bodies = (contact.body, *((partner.body,) if partner is not None else ()))
        count = None if points is None else points * BLOCK.get(kind, 1)
        word = WORDS[kind] + (", rigid" if METHODS[contact.method].rigid else "")
        yield PortRow(
            f"contact.{name}", word, count, bodies, "moving" if slides or scene.capabilities.turns else "constant"
        )


def contact_kind(contact: Contact) -> Kind:
    """Return how the points of a contact respond."""
    rubs = contact.friction is not None
    if contact.law is not None:
        return Kind.RUBBING_LAW if rubs else Kind.LAW
    return Kind.CONE if rubs else Kind.UNILATERAL


def _joints(scene: Scene) -> Iterator[PortRow]:
    for name, crank in scene.cranks().items():
        turns = scene.capabilities.turns
        count, rows = (1, "moving") if turns else (BLOCK[Kind.BILATERAL], "constant")
        yield PortRow(f"joint.{name}", WORDS[Kind.BILATERAL], count, (crank.body,), rows)
    holding = scene.held()
    for name, joint in scene.joint.items():
        if isinstance(joint, Gear | Driven):
            hinges = [scene.hinges()[j] for j in joint.joints]
            bodies = tuple(dict.fromkeys(b for h in hinges for b in (h.body, h.against) if b is not None))
            yield PortRow(f"joint.{name}", WORDS[Kind.BILATERAL], 1, bodies, "moving")
        elif isinstance(joint, Marked):
            bodies = (joint.body, *((joint.against,) if joint.against is not None else ()))
            rows = "constant" if name in holding else "moving"
            yield PortRow(f"joint.{name}", WORDS[Kind.BILATERAL], joint.row_count, bodies, rows)


def _forces(scene: Scene, counts: Counts) -> Iterator[PortRow]:
    for name, load in scene.given().items():
        count: int | None = 3 if isinstance(load, ExternalForce) and load.direction is None else 1
        if isinstance(load, GivenWrench):
            count = 6
        if isinstance(load, MovingForce):
            count = counts(load.body, load.interface)
        yield PortRow(f"force.{name}", WORDS[Kind.GIVEN], count, (load.body,), "constant")
    for name, field in scene.fields().items():
        bodies = (field.body, *((field.against,) if field.against is not None else ()))
        yield PortRow(f"force.{name}", WORDS[Kind.GIVEN], 6 * len(bodies), bodies, "moving")
    for name, electrode in scene.electrodes().items():
        points = counts(electrode.body, electrode.interface)
        yield PortRow(f"force.{name}", WORDS[Kind.GIVEN], points, (electrode.body,), "constant")
    for name, spring in scene.springs().items():
        count = len(spring.parts()[1]) if isinstance(spring, Bushing) else 1
        bodies = (spring.body, *((spring.against,) if spring.against is not None else ()))
        rows = "moving" if name in scene.point_springs() or name in scene.turning_bushings() else "constant"
        yield PortRow(f"force.{name}", WORDS[Kind.SPRING], count, bodies, rows)


def _readers(scene: Scene) -> Iterator[PortRow]:
    for name, probe in scene.probe.items():
        settings: dict[str, Any] = dict(probe)
        bodies = tuple(settings[key] for key in ("body", "against") if settings.get(key))
        yield PortRow(f"probe.{name}", "read", None, bodies, "constant")
    for name, body in scene.body.items():
        if body.gauges:
            yield PortRow(f"body.{name}.gauges", "read", None, (name,), "constant")
