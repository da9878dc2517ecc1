"""Driven bodies: rows of motions given over time, their contradictions, and their velocities at the start."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gudgeon.solver.bodies.placing import turned_vectors
from gudgeon.solver.bodies.small_motion import MOVES, FlexibleBody, named
from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.history import LOOKED_AT
from gudgeon.solver.scene.body import ALL_FREE
from gudgeon.solver.scene.motion import Motion, Rotation
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.vectors import unit

DEPENDENT = 1e-10
"""Pivot of the driven rows' compliance, relative to its diagonal, below which a motion is given twice."""


@dataclass(frozen=True)
class DrivenRows:
    """A motion given over time: the driven row, then those that are held at zero, k in all."""

    name: str
    motion: Motion
    mix: np.ndarray
    """Of the rows of its interface, (k, j)."""
    resultant: np.ndarray
    """Force and moment about the component's origin per unit of each row's force, (k, 6)."""

    @property
    def body(self) -> str:
        return self.motion.body

    @property
    def interface(self) -> str | None:
        return self.motion.interface

    def places(self, times: np.ndarray) -> np.ndarray:
        """Return displacement and rate of its rows at times [s], (t, k, 2)."""
        found = np.zeros((len(times), len(self.mix), 2))
        found[:, 0] = self.motion.places(times, f"motion.{self.name}")
        return found


def driven_rows(scene: Scene, name: str, body: FlexibleBody) -> tuple[DrivenRows, np.ndarray]:
    """Return the rows of a motion, and their elastic part, (k, m).

    Raises:
        SceneError: its table ends early, its expression is not finite or jumps, or the body does not have its place.
    """
    motion, key = scene.motion[name], f"motion.{name}"
    _refuse_motion(motion, key, scene.run.duration)
    turns, line = isinstance(motion, Rotation), unit(motion.direction)
    if motion.interface is None:
        return _rigid_row(scene, name, body), np.zeros((1, 0))
    load = named(body.modal.loads, motion.interface, f"{key}.interface: body '{body.name}' has no load surface")
    if len(load.rows) not in (3, 6) or (turns and len(load.rows) != 6):
        needed = "'tie'" if turns else "'mean' or 'tie'"
        raise SceneError(f"{key}.interface: '{motion.interface}' cannot be driven so; kind {needed} is needed")
    mix = _all_motions(line, turns=turns)[:, : len(load.rows)]
    if motion.held:
        mix = _left(mix, _others(scene, name))
    R = body.residual(motion.interface, motion.interface)

    def moves(row: np.ndarray) -> bool:
        return bool(np.any(_rigid(body, row @ load.resultant)) or np.any(row @ load.rows) or row @ R @ row)

    # The driven row is refused later where it is impossible.
    constrained = [k for k, row in enumerate(mix) if k and motion.held and row.any() and moves(row)]
    mix = mix[[0, *constrained] if mix[0].any() else constrained]
    return DrivenRows(name, motion, mix, mix @ load.resultant), mix @ load.rows


def _refuse_motion(motion: Motion, key: str, duration: float) -> None:
    """Raise a SceneError where a motion ends within a run [s], is not finite or jumps."""
    if (reason := motion.refusal(duration)) is not None:
        raise SceneError(f"{key}.{reason}")
    if (time := motion.jump(np.linspace(0.0, duration, LOOKED_AT), key)) is not None:
        raise SceneError(f"{key}.expression: it jumps at t = {time:.6g} s; a body moves continuously")


def _rigid_row(scene: Scene, name: str, body: FlexibleBody) -> DrivenRows:
    """Return the row of a motion that drives a point or the rotation of a rigid body."""
    motion = scene.motion[name]
    if len(body.modal.angular_frequencies):
        raise SceneError(
            f"motion.{name}.interface: body '{body.name}' is elastic; name an interface of kind 'mean' or 'tie'"
        )
    line = unit(motion.direction)
    if isinstance(motion, Rotation):
        wrench = np.concatenate([np.zeros(3), line])
    else:
        arm = turned_vectors(scene.body[body.name], motion.at or (0.0, 0.0, 0.0))
        wrench = np.concatenate([line, np.cross(arm, line)])
    return DrivenRows(name, motion, np.ones((1, 1)), wrench[None])


def _others(scene: Scene, name: str) -> np.ndarray:
    """Return the motions of a motion's interface that others give, as unit vectors, (n, 6)."""
    driven_motion, vectors = scene.motion[name], [np.empty((0, 6))]
    for motion_name, motion in scene.motion.items():
        if motion_name != name and (motion.body, motion.interface) == (driven_motion.body, driven_motion.interface):
            vectors.append(_all_motions(unit(motion.direction), turns=isinstance(motion, Rotation))[:1])
    return np.concatenate(vectors)


def _left(mix: np.ndarray, prescribed: np.ndarray) -> np.ndarray:
    """Return the first of some motions, (k, j), and those of its others that are not given, (n, 6), at right angles."""
    taken, remaining = list(mix[:1]), list(mix[:1])
    for i, vector in enumerate([*prescribed[:, : mix.shape[1]], *mix[1:]]):
        residual = vector - sum((vector @ v) * v for v in taken)
        if np.linalg.norm(residual) > MOVES:
            taken.append(unit(residual))
            remaining += taken[-1:] if i >= len(prescribed) else []
    return np.array(remaining)


def _all_motions(line: np.ndarray, *, turns: bool) -> np.ndarray:
    """Return a motion along or about a unit vector, then the five others at right angles to it, (6, 6)."""
    across = np.eye(3)[np.abs(line).argmin()]
    across = unit(across - (across @ line) * line)
    axes, motions = np.array([line, across, np.cross(line, across)]), np.zeros((6, 6))
    motions[:3, 3 * turns : 3 * turns + 3] = axes
    motions[3:, 3 - 3 * turns : 6 - 3 * turns] = np.eye(3)
    return motions


def _rigid(body: FlexibleBody, wrench: np.ndarray) -> np.ndarray:
    """Return which rigid motions a force and moment about the component's origin, (6,), can cause, (r,)."""
    return np.abs(body.wrench_rows(wrench[None])[0]) > MOVES * (np.abs(_at_origin(body)) @ np.abs(wrench))


def refuse_contradictions(
    driven: Sequence[tuple[DrivenRows, slice]],
    joints: Mapping[str, int],
    body: FlexibleBody,
    arrays: tuple[np.ndarray, np.ndarray],
) -> None:
    """Raise a SceneError where a body cannot move as given, or a motion of it is given twice.

    Args:
        driven: Its motions, with their rows among all loads.
        joints: Those that hold it by name, with the row that they prescribe.
        arrays: Rows of all loads over its coordinates, (L, r + m), and R among them [m/N], (L, L).
    """
    rows, residual = arrays
    for item, span in driven:
        row = span.start
        moves = _rigid(body, item.resultant[0]).any() or rows[row, body.rigid_count :].any() or residual[row, row] > 0
        if not moves:
            raise SceneError(
                f"motion.{item.name}.direction: body '{body.name}' does not move so by its freedom or supports; its"
                f" free rigid motions: {', '.join(_free(body)) or 'none'}"
            )
    names = list(joints) + [f"motion.{item.name}" for item, span in driven for _ in range(span.start, span.stop)]
    numbers = [*joints.values(), *(row for _, span in driven for row in range(span.start, span.stop))]
    W, highest = rows[numbers], float(body.stiffness.max(initial=0.0)) or 1.0
    complement = (W / (body.stiffness + highest)) @ W.T + residual[np.ix_(numbers, numbers)]
    scale = 1 / np.sqrt(complement.diagonal())
    complement *= np.outer(scale, scale)
    for row, name in enumerate(names):
        if complement[row, row] < DEPENDENT:
            before = " and ".join(dict.fromkeys(names[:row]))
            raise SceneError(f"{name}: it gives a motion of body '{body.name}' that {before} gives too; remove one")
        complement = complement - np.outer(complement[:, row], complement[row]) / complement[row, row]


def _at_origin(body: FlexibleBody) -> np.ndarray:
    """Return the rigid motions of a body as translation at its component's origin and rotation, (r, 6)."""
    twists = body.twists.copy()
    twists[:, :3] -= np.cross(body.twists[:, 3:], body.morph.centre)
    return twists


def _free(body: FlexibleBody) -> list[str]:
    """Return the names of the rigid motions that a body has, along and about the axes."""
    sizes = np.abs(body.twists)
    largest = np.repeat([sizes[:, :3].max(initial=0.0), sizes[:, 3:].max(initial=0.0)], 3)
    moves = np.any(sizes > MOVES * np.maximum(largest, np.finfo(float).tiny), axis=0).tolist()
    return [name for name, free in zip(ALL_FREE, moves, strict=True) if free]


def begin_velocities(
    scene: Scene,
    bodies: Mapping[str, FlexibleBody],
    drives: Sequence[tuple[DrivenRows, slice]],
    rows: np.ndarray,
    velocity: np.ndarray,
) -> None:
    """Give driven bodies the velocities with which their motions begin: rigid ones, elastic ones where these lack.

    Args:
        rows: Of all loads, (L, m).
        velocity: Changed in place, (m,).

    Raises:
        SceneError: the velocity given for a body contradicts its motion.
    """
    for body in bodies.values():
        body_drives = [(item, span) for item, span in drives if item.body == body.name]
        if body_drives:
            W = np.vstack([rows[span, body.coordinates] for _, span in body_drives])
            start = np.concatenate([item.places(np.zeros(1))[0, :, 1] for item, _ in body_drives])
            body_velocity, r = velocity[body.coordinates], body.rigid_count
            _refuse_velocity(scene, body, body_drives, W @ body_velocity, start)
            body_velocity[:r] += np.linalg.pinv(W[:, :r]) @ (start - W @ body_velocity)
            body_velocity += np.linalg.pinv(W) @ (start - W @ body_velocity)


def _refuse_velocity(
    scene: Scene,
    body: FlexibleBody,
    body_drives: Sequence[tuple[DrivenRows, slice]],
    speeds: np.ndarray,
    start: np.ndarray,
) -> None:
    """Raise a SceneError where a velocity of the scene differs from that with which a motion begins."""
    settings = scene.body[body.name]
    if not any(settings.velocity) and not any(settings.angular_velocity):
        return
    start_row = 0
    for item, span in body_drives:
        speed, size = float(speeds[start_row]), float(start[start_row])
        if abs(speed - size) > MOVES * max(abs(size), abs(speed)) and speed != 0:
            turns = isinstance(item.motion, Rotation)
            key, symbol = ("angular_velocity", "rad/s") if turns else ("velocity", "m/s")
            raise SceneError(
                f"body.{body.name}.{key}: {speed:.6g} {symbol} along motion.{item.name}, which begins with"
                f" {size:.6g} {symbol}; leave it out, the body begins as its motion does"
            )
        start_row += span.stop - span.start
