"""The tool of a scene: the body that a handle moves, with the fields and bushings that act on it."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.job import Job
from gudgeon.solver import core
from gudgeon.solver.forces.fields.co_energy import GRID, CoEnergies
from gudgeon.solver.forces.fields.electrostatic import Electrostatic
from gudgeon.solver.vectors import unit


@dataclass(frozen=True)
class Tool:
    """A body of a scene whose pose a handle gives."""

    body: str
    acting: core.Tool
    """What acts on it, in the core."""
    extent: float
    """Largest way that it can go from its start within its fields [m]; infinite where nothing limits it."""

    def wrench(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the energy [J], infinite outside of a field, and what acts on the body at a motion from its start.

        Args:
            x: Translation of the point of its first field [m], and rotation vector [rad], (6,).
        """
        force = np.zeros(6)
        return self.acting.energy(np.asarray(x, float), force), force

    def settled(self, x: np.ndarray, y: np.ndarray, coupling: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the least energy of the tool and its coupling, and the wrench on the handle, (6,).

        Args:
            x: Motion of the handle in the tool's units, (6,).
            y: Where the tool stood before, and where it stands then, (6,).
            coupling: Stiffness and largest force of translations, and of rotations, (4,).
        """
        wrench = np.zeros(6)
        return self.acting.settle(x, y, coupling, wrench), wrench


def tool_of(job: Job, body: str | None = None) -> Tool:
    """Return the tool of a scene of bodies whose records and fields are in the database.

    Args:
        body: Its name; default: that of the first field.

    Raises:
        InputError: no field acts on it, or something acts that a handle cannot feel.
    """
    scene, (chosen, acting) = job.scene, _acting(job, body)
    stiffness = np.zeros((6, 6))
    for name, force in scene.force.items():
        if name in acting or getattr(force, "body", chosen) != chosen:
            continue
        stiffness += _held(job, name, force)
    system = system_of(job)
    rows = [i for i, name in enumerate(system.fields.names) if name in acting]
    energies: Any = system.fields.energies
    energies = CoEnergies(energies.head[rows].copy(), energies.size[rows].copy(), energies.data)
    points = [np.array(f.at, float) for f in acting.values()]
    if scene.body[chosen].orientation is not None and len({f.at for f in acting.values()}) > 1:
        raise InputError(f"{job.path}: feel: body.{chosen}.orientation: fields at different points are felt without it")
    links = [_link(f, point - points[0]) for f, point in zip(acting.values(), points, strict=True)]
    active = np.array([_active(head) for head in energies.head])
    return Tool(chosen, core.Tool(energies, np.array(links), stiffness, active), _extent(energies))


def _acting(job: Job, body: str | None) -> tuple[str, dict[str, Any]]:
    """Return a body, by default that of the first field, and the fields that act on it, by name."""
    scene, fields = job.scene, job.scene.fields()
    acting = {name: f for name, f in fields.items() if body is None or f.body == body}
    if not acting:
        have = ", ".join(dict.fromkeys(f.body for f in fields.values())) or "none"
        raise InputError(
            f"{job.path}: feel: no field acts on body '{body or next(iter(scene.body))}'; a force of kind"
            f" 'electrostatic', 'parallel-plates' or 'adhesion' is needed, bodies that have one: {have}"
        )
    chosen = body or next(iter(acting.values())).body
    acting = {name: f for name, f in acting.items() if f.body == chosen}
    for name, field in acting.items():
        if field.against is not None or field.interface is not None:
            key = "against" if field.against is not None else "interface"
            raise InputError(f"{job.path}: feel: force.{name}.{key} given; a handle feels a rigid tool over the ground")
    return chosen, acting


def _held(job: Job, name: str, force: Any) -> np.ndarray:
    """Return the stiffness over the motions of a tool of a spring or bushing to the ground, (6, 6)."""
    stiffness = np.zeros((6, 6))
    if force.kind == "bushing" and force.against is None:
        return force.matrices()[0]
    plain = force.kind == "spring" and force.against is None and force.against_at is None
    if plain and force.direction is not None and force.linear and not (force.stretch or force.preload):
        line = unit(force.direction)
        stiffness[:3, :3] = force.stiffness * np.outer(line, line)
        return stiffness
    raise InputError(
        f"{job.path}: feel: force.{name} of kind '{force.kind}' is not felt; a tool has fields, and linear springs"
        " along a direction and bushings to the ground, relaxed at the start; remove it"
    )


def unfelt(job: Job, body: str) -> list[str]:
    """Return a line for what acts on a body in the scene, but not on a hand."""
    scene = job.scene
    lines = [f"contact.{name} is not felt" for name, c in scene.contact.items() if c.body == body]
    lines += [f"joint.{name} is not felt" for name, j in scene.hinges().items() if j.body == body]
    if any(scene.run.gravity):
        lines.append("run.gravity: the weight of the body is not felt")
    return lines


def _link(field: Any, arm: np.ndarray) -> np.ndarray:
    start = field.start if isinstance(field, Electrostatic) else (0.0, 0.0, 0.0)
    return np.concatenate([arm, start, field.axes().ravel()])


def _active(head: np.ndarray) -> np.ndarray:
    """Return which motions a field's force depends on: of a grid its axes, of others translations, (6,)."""
    if head[0] != GRID:
        return np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    active = np.zeros(6)
    active[head[3 : 3 + 3 * head[1] : 3]] = 1.0
    return active


def _extent(fields: CoEnergies) -> float:
    """Return the largest translation that a grid has, or gap of plates [m]."""
    lengths = [0.0]
    for head, size in zip(fields.head, fields.size, strict=True):
        for a in range(head[1]):
            axis, start, count = head[3 + 3 * a : 6 + 3 * a]
            if axis < 3:
                lengths.append(float(fields.data[start + count] - fields.data[start]))
        if head[0] != GRID:
            lengths.append(abs(float(size[2])))
    return max(lengths) or 1.0
