"""Forces and moments that act on a body that deforms at its interfaces, as its modes and gauges know them."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gudgeon.solver.integrators.turning.arrays import TURN, Model
from gudgeon.solver.integrators.turning.build import Linkage
from gudgeon.solver.integrators.turning.energy import bodies_of
from gudgeon.solver.integrators.turning.parts import Point
from gudgeon.solver.integrators.turning.probes import States, point_motions, spring_pulls
from gudgeon.solver.integrators.turning.rotation import matrices


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
    pushed = []
    for name, pair in linkage.pairs.items():
        joint, ends = linkage.system.scene.joint[name], linkage.markers[pair]
        pushed += _pushes(linkage, model, states, (_sides(joint), ends), holds[:, pair], body)
    return [(p.interface, _own(linkage, model, states, body, p)) for p in pushed]


def forces_of_elements(
    linkage: Linkage, model: Model, states: States, amounts: np.ndarray, body: str
) -> list[tuple[str, np.ndarray]]:
    """Return the same of loads, springs and bushings.

    Args:
        amounts: Of the loads, (s, l).
    """
    scene, pushed = linkage.system.scene, list[Pushed]()
    for i, load in enumerate(scene.turning_loads().values()):
        interface = getattr(load, "interface", None)
        if load.body == body and interface is not None:
            pushed.append(Pushed(interface, amounts[:, i, None] * model.load[i]))
    for i, (name, spring) in enumerate(scene.point_springs().items()):
        offset = np.array([m.springs[i, 1, 0] - m.springs[i, 0, 0] for m in states.motions])
        size = np.linalg.norm(offset, axis=1, keepdims=True)
        line = np.divide(offset, size, out=np.zeros_like(offset), where=size > 0)
        wrenches = np.hstack([-spring_pulls(model, states, i)[:, None] * line, np.zeros_like(line)])
        ends = linkage.ends(spring, f"force.{name}")
        pushed += _pushes(linkage, model, states, (_sides(spring), ends), wrenches, body)
    for i, (name, bushing) in enumerate(scene.six_motions().items()):
        wrenches = np.array([m.bushings[i, 6:] for m in states.motions])
        ends = linkage.ends(bushing, f"force.{name}")
        pushed += _pushes(linkage, model, states, (_sides(bushing), ends), wrenches, body)
    return [(p.interface, _own(linkage, model, states, body, p)) for p in pushed]


def _sides(element: object) -> Sides:
    """Return the sides of a joint, spring or bushing."""
    read = [getattr(element, key, None) for key in ("body", "interface", "against", "against_interface")]
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
    sides, (far_end, near_end) = element
    loads = linkage.system.bodies[body].modal.loads
    owner, interface = sides.own
    if owner == body and interface is not None and interface in loads:
        yield Pushed(interface, wrenches)
    owner, interface = sides.other
    if owner == body and interface is not None and interface in loads:
        force, moment = -wrenches[:, :3], -wrenches[:, 3:]
        between = _places(model, states, near_end) - _places(model, states, far_end)
        yield Pushed(interface, np.hstack([force, moment + np.cross(between, force)]))


def _own(linkage: Linkage, model: Model, states: States, body: str, pushed: Pushed) -> np.ndarray:
    """Return force and moment in the axes of a body, as many as the interface has rows, (s, 3 or 6)."""
    b = linkage.names.index(body)
    turn = matrices(bodies_of(model, states.samples)[:, b, TURN : TURN + 4])
    both = [np.einsum("sij,si->sj", turn, w) for w in (pushed.wrenches[:, :3], pushed.wrenches[:, 3:])]
    return np.hstack(both)[:, : len(linkage.system.bodies[body].modal.loads[pushed.interface].rows)]


def _places(model: Model, states: States, point: Point) -> np.ndarray:
    """Return where a point is [m], (s, 3)."""
    if point.owner < 0:
        return np.tile(point.arm, (len(states.samples), 1))
    return point_motions(model, states, point)[0]
