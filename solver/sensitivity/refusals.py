"""What no derivative is found through, each in one line."""

import numpy as np

from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.small.integrator import Small
from gudgeon.solver.integrators.small.tape import Tape
from gudgeon.solver.ports.members import contact_ports
from gudgeon.solver.ports.table import Kind
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.system.bases.swaps import swaps_of
from gudgeon.solver.system.system import System

GRAZES = 1e-3
"""Force of a contact over the largest of all below which it grazes: its derivative describes hardly any change."""


def refuse_scene(scene: Scene) -> None:
    """Raise a SceneError where bodies turn, contact is rigid or rubs, or joints or motions hold bodies."""
    if scene.capabilities.turns:
        raise SceneError(
            "sensitivity: the bodies of this scene turn by any angle (integrator 'turning'); small motion is needed"
        )
    for name, contact in scene.contact.items():
        if contact.method in ("constraint", "impact"):
            raise SceneError(
                f"contact.{name}.method: '{contact.method}' given; velocities jump, and at steps of a given size the"
                " derivative of a jump is lost; use 'residual', 'penalty' or a law"
            )
        if contact.friction is not None:
            raise SceneError(f"contact.{name}.friction: no derivative is found through slip and stick; remove it")
        if contact.dashpot == "wave-guide":
            raise SceneError(f"contact.{name}.dashpot: no derivative is found through a force that jumps; remove it")
    for kind in ("joint", "motion"):
        if members := getattr(scene, kind):
            raise SceneError(
                f"{kind}.{next(iter(members))}: no derivative is found through what a {kind} holds; remove it"
            )


def refuse_arrays(system: System, loop: Small) -> None:
    """Raise a SceneError where the loop has ports or steps that no derivative is found through."""
    constants, ports = loop.arrays.constants, loop.ports
    if swaps_of(system) is not None:
        raise SceneError("component: modes.swap changes the basis within the run; no derivative is found through that")
    if system.fields.names:
        raise SceneError(f"force.{system.fields.names[0]}: no derivative is found through an electrostatic field")
    for block in ports.blocks:
        if block.kind not in (Kind.UNILATERAL, Kind.LAW, Kind.SPRING, Kind.GIVEN):
            raise SceneError(f"{block.name}: no derivative is found through this kind of port, {block.kind.name}")
    _refuse_laws(system, loop)
    if constants.edged or constants.slides:
        raise SceneError("contact: no derivative is found through faces with edges and sliding pairs")
    if (constants.table[:, 1] > 0).any():
        raise SceneError("force: no derivative is found through a spring by a table; give its stiffness")


def _refuse_laws(system: System, loop: Small) -> None:
    """Raise a SceneError where a contact has a law that no derivative is found through, or no compliance."""
    constants = loop.arrays.constants
    for contact in system.contacts:
        name, normals = contact.name, contact_ports(loop.ports, contact)
        if (constants.law[normals, 2] > 0).any():
            raise SceneError(
                f"contact.{name}.law: it loses energy by the speed of approach of each contact, through which no"
                " derivative is found; use 'hertz' or 'linear'"
            )
        rigid = (constants.share[normals] == 1.0) & (constants.kind[normals] == Kind.UNILATERAL)
        if (constants.restitution[normals] >= 0).any() or rigid.any():
            raise SceneError(
                f"contact.{name}: it has no compliance, so that velocities jump: no derivative is found through a jump;"
                " give it surface_stiffness or a law"
            )


def refuse_grazing(system: System, loop: Small, tape: Tape) -> None:
    """Raise a SceneError where a contact touches so lightly that its derivative describes no change."""
    peaks = {
        contact.name: float(np.abs(tape.mean[:, contact_ports(loop.ports, contact)]).sum(axis=1).max(initial=0.0))
        for contact in system.contacts
    }
    largest = max(peaks.values(), default=0.0)
    for name, peak in peaks.items():
        if 0 < peak < GRAZES * largest:
            raise SceneError(
                f"contact.{name}: it grazes, its largest force is {peak:.3g} N of {largest:.3g} N: its derivative holds"
                " for no change that is noticed; move it away or nearer"
            )
