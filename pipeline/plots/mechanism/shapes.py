"""Bodies of a mechanism as lines and triangles that move and deform, at the frames of a run's record."""

from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.base.surface import skin_of
from gudgeon.pipeline.plots.mechanism.motion import moving_bodies, rotations, touching

TRIANGLES = 3000
"""Of a solid at most, unless its mesh has more on its surface."""


class Shape(Enum):
    """What a body is drawn as."""

    RIGID = "lines between its points"
    ELASTIC = "its mesh"


@dataclass(frozen=True)
class Shown:
    """A body, at f frames."""

    name: str
    shape: Shape
    places: np.ndarray
    """Of its points [m], (f, p, 3)."""
    bent: np.ndarray
    """Their elastic displacement [m], (f, p)."""
    cells: np.ndarray
    """Two points of each line, or three of each triangle."""
    joints: dict[str, np.ndarray]
    """Where the joints on it are [m], (f, 3) each."""
    paths: dict[str, tuple[np.ndarray, np.ndarray]]
    """Their paths: times [s], (p,), and places [m], (p, 3), which lie closer than the frames."""
    contacts: dict[str, np.ndarray]
    """Where the middles of the points of its contacts are, without their elastic displacement [m], (f, 3) each."""


def shown_bodies(drawing: Drawing, frames: np.ndarray) -> list[Shown]:
    """Return all bodies at frames."""
    hinges = {name: joint for name, joint in drawing.scene["joint"].items() if "body" in joint}
    bodies = []
    for moving in moving_bodies(drawing):
        body = drawing.body(moving.name)
        twists = np.array([body.twist(int(frame)) for frame in frames])
        turns, centres = rotations(twists[:, 3:]), moving.centre + twists[:, :3]
        on_body = [name for name, joint in hinges.items() if joint["body"] == moving.name]
        moved = {
            name: np.einsum("fij,fj->fi", turns, _at_joint(drawing, body, hinges[name], frames)) for name in on_body
        }
        joints = {name: centres + turns @ moving.points[k] + moved[name] for k, name in enumerate(on_body)}
        path_times, positions = moving.course(drawing.trajectory.times)
        seen = drawing.trajectory.frame_times[frames]
        paths = {
            name: (
                path_times,
                positions[:, k] + np.array([np.interp(path_times, seen, joint) for joint in moved[name].T]).T,
            )
            for k, name in enumerate(on_body)
        }
        contacts = {
            name: centres + turns @ (points.mean(axis=0) - moving.centre)
            for name, points in touching(drawing, moving.name).items()
        }
        arms, elastic, cells, shape = _drawn(drawing, body, moving.points, frames)
        positions = centres[:, None] + np.einsum("fij,fpj->fpi", turns, arms + elastic)
        bent = np.linalg.norm(elastic, axis=2)
        bodies.append(Shown(moving.name, shape, positions, bent, cells, joints=joints, paths=paths, contacts=contacts))
    return bodies


def _drawn(
    drawing: Drawing, body: BodyMotion, points: np.ndarray, frames: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, Shape]:
    """Return points from the centre [m], their elastic displacements, and lines or triangles between them."""
    shaped = body.modal.shapes is not None and body.modal.shapes.size
    if shaped and cell_of(body.mesh).dimension == 1:
        elastic = _elastic(drawing, body, body.nodes, frames)
        return body.nodes - body.morph.centre, elastic, body.mesh.cells[:, :2], Shape.ELASTIC
    if shaped and cell_of(body.mesh).dimension == 3:
        body, skin = skin_of(body, TRIANGLES)
        cells = skin.surface.faces.reshape(-1, 4)[:, 1:]
        return body.nodes - body.morph.centre, _elastic(drawing, body, body.nodes, frames), cells, Shape.ELASTIC
    count = len(points) - 1
    lines = [(0, 1)] if count == 2 else [(i, count) for i in range(count)]
    none = np.zeros((len(frames), len(points), 3))
    return points, none, np.array(lines, int).reshape(-1, 2), Shape.RIGID


def _elastic(drawing: Drawing, body: BodyMotion, nodes: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Return the displacements of points within the body's frame [m], (f, p, 3)."""
    moved = np.array([body.elastic(int(frame)) for frame in frames])
    shift, turn = _frame_motion(drawing, body, frames)
    return moved - shift[:, None] - np.cross(turn[:, None], nodes - body.morph.centre)


def _at_joint(drawing: Drawing, body: BodyMotion, joint: dict[str, Any], frames: np.ndarray) -> np.ndarray:
    """Return the displacement of a joint's interface within the body's frame [m], (f, 3)."""
    if joint.get("interface") is None:
        return np.zeros((len(frames), 3))
    load = drawing.modes(body.name, ["loads"]).loads[joint["interface"]]
    shift, turn = _frame_motion(drawing, body, frames)
    return _modal(body, frames) @ load.rows[:3].T - shift - np.cross(turn, load.point - body.morph.centre)


def _modal(body: BodyMotion, frames: np.ndarray) -> np.ndarray:
    return body.coordinates[frames, len(body.morph.rigid_twists) :]


def _frame_motion(drawing: Drawing, body: BodyMotion, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the motion of the frame that the shapes have and the body's coordinates are less of: that of the centre
    of mass [m], and of an interface that the frame turns with [rad], (f, 3) each."""
    q, nothing = _modal(body, frames), np.zeros((len(frames), 3))
    modes, settings = drawing.modes(body.name, ["inertia_couplings", "loads"]), drawing.scene["body"][body.name]
    if not q.shape[1] or modes.inertia_couplings is None:
        return nothing, nothing
    turn = nothing
    if settings.get("attachment") == "fixed":
        turn = q @ modes.loads[settings["attached_to"]].rows[3:].T
    return q @ modes.inertia_couplings.translation.T / body.morph.mass, turn
