"""Forces and moments that act on a body that deforms at its interfaces, as its modes and gauges know them."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gudgeon.solver.integrators.mechanism.arrays import TURN, Model
from gudgeon.solver.integrators.mechanism.build import Linkage
from gudgeon.solver.integrators.mechanism.energy import bodies_of
from gudgeon.solver.integrators.mechanism.parts import Point
from gudgeon.solver.integrators.mechanism.probes import States, point_motions, spring_pulls
from gudgeon.solver.integrators.mechanism.rotation import matrices


@dataclass(frozen=True)
class Pushed:
    """Force and moment on an interface of a body, about its point, along the scene's axes."""

    interface: str
    wrenches: np.ndarray
    """(s, 6)"""


@dataclass(frozen=True)
class Sides:
    """An element between two bodies: who has its own side and the other one, and at which interface."""

    own: tuple[str | None, str | None]
    other: tuple[str | None, str | None]


def forces_of_joints(
    linkage: Linkage, model: Model, states: States, holds: np.ndarray, body: str
) -> list[tuple[str, np.ndarray]]:
    """Return the interfaces of a body that joints hold, with force and moment in its axes, as many as the interface has
    rows, (s, 3 or 6).

    Args:
        holds: As `Reading.holds`, (s, J, 6).
    """
    found = []
    for name, pair in linkage.pairs.items():
        joint, ends = linkage.system.scene.joint[name], linkage.markers[pair]
        found += _pushes(linkage, model, states, (_sides(joint), ends), holds[:, pair], body)
    return [(one.interface, _own(linkage, model, states, body, one)) for one in found]


def forces_of_elements(
    linkage: Linkage, model: Model, states: States, amounts: np.ndarray, body: str
) -> list[tuple[str, np.ndarray]]:
    """Return the same of loads, springs and bushings.

    Args:
        amounts: Of the loads, (s, l).
    """
    scene, found = linkage.system.scene, list[Pushed]()
    for number, load in enumerate(scene.turning_loads().values()):
        interface = getattr(load, "interface", None)
        if load.body == body and interface is not None:
            found.append(Pushed(interface, amounts[:, number, None] * model.load[number]))
    for number, (name, spring) in enumerate(scene.point_springs().items()):
        apart = np.array([one.springs[number, 1, 0] - one.springs[number, 0, 0] for one in states.motions])
        size = np.linalg.norm(apart, axis=1, keepdims=True)
        line = np.divide(apart, size, out=np.zeros_like(apart), where=size > 0)
        wrenches = np.hstack([-spring_pulls(model, states, number)[:, None] * line, np.zeros_like(line)])
        ends = linkage.ends(spring, f"force.{name}")
        found += _pushes(linkage, model, states, (_sides(spring), ends), wrenches, body)
    for number, (name, bushing) in enumerate(scene.six_motions().items()):
        wrenches = np.array([one.bushings[number, 6:] for one in states.motions])
        ends = linkage.ends(bushing, f"force.{name}")
        found += _pushes(linkage, model, states, (_sides(bushing), ends), wrenches, body)
    return [(one.interface, _own(linkage, model, states, body, one)) for one in found]


def _sides(one: object) -> Sides:
    """Return the sides of a joint, spring or bushing."""
    read = [getattr(one, key, None) for key in ("body", "interface", "against", "against_interface")]
    return Sides((read[0], read[1]), (read[2], read[3]))


def _pushes(
    linkage: Linkage,
    model: Model,
    states: States,
    element: tuple[Sides, tuple[Point, Point]],
    wrenches: np.ndarray,
    body: str,
) -> Iterator[Pushed]:
    """Yield what an element does to the interfaces of a body.

    Args:
        element: Its sides, and its points on the other side and on the own one.
        wrenches: On the own side about its point, (s, 6).
    """
    sides, (other, own) = element
    known = linkage.system.bodies[body].modal.loads
    owner, interface = sides.own
    if owner == body and interface is not None and interface in known:
        yield Pushed(interface, wrenches)
    owner, interface = sides.other
    if owner == body and interface is not None and interface in known:
        force, moment = -wrenches[:, :3], -wrenches[:, 3:]
        between = _places(model, states, own) - _places(model, states, other)
        yield Pushed(interface, np.hstack([force, moment + np.cross(between, force)]))


def _own(linkage: Linkage, model: Model, states: States, body: str, one: Pushed) -> np.ndarray:
    """Return force and moment in the axes of a body, as many as the interface has rows, (s, 3 or 6)."""
    b = linkage.names.index(body)
    turn = matrices(bodies_of(model, states.samples)[:, b, TURN : TURN + 4])
    both = [np.einsum("sij,si->sj", turn, part) for part in (one.wrenches[:, :3], one.wrenches[:, 3:])]
    return np.hstack(both)[:, : len(linkage.system.bodies[body].modal.loads[one.interface].rows)]


def _places(model: Model, states: States, point: Point) -> np.ndarray:
    """Return where a point is [m], (s, 3)."""
    if point.owner < 0:
        return np.tile(point.arm, (len(states.samples), 1))
    return point_motions(model, states, point)[0]
