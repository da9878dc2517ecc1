"""Where the points of turning bodies are over time, from a run's record."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.solver.scene.body import Body

DRAWN = 4
"""Contact points of a body that are drawn one by one."""
PIECE, FARTHEST = 0.1, 1.5
"""Rotation between places of a path, and that between samples beyond which places between them are not known [rad]."""


@dataclass(frozen=True)
class Moving:
    """A body with its points: those of its joints, springs and contacts and, last, its centre of mass."""

    name: str
    points: np.ndarray
    """From the centre of mass, as the scene places the body [m], (k, 3)."""
    centre: np.ndarray
    """As the scene places it [m], (3,)."""
    motion: np.ndarray
    """As `Trajectory.motion`, (s, 12)."""

    def places(self, samples: np.ndarray | slice) -> np.ndarray:
        """Return where its points are at samples [m], (s, k, 3)."""
        motion = self.motion[samples]
        return (self.centre + motion[:, None, :3]) + np.einsum("sij,kj->ski", rotations(motion[:, 3:6]), self.points)

    def course(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the paths of its points: times [s], (p,), and places [m], (p, k, 3).

        Between samples they are cubics by places and velocities at both.

        Args:
            times: Of the samples [s], (s,).
        """
        positions, interval = self.places(slice(None)), float(np.diff(times).max(initial=0.0))
        turned = float(np.linalg.norm(self.motion[:, 9:12], axis=1).max()) * interval
        pieces = int(np.ceil(turned / PIECE))
        if pieces < 2 or turned > FARTHEST or len(times) < 2:
            return times, positions
        arms = positions - (self.centre + self.motion[:, :3])[:, None]
        speeds = self.motion[:, None, 6:9] + np.cross(self.motion[:, None, 9:12], arms)
        fine = np.unique(np.concatenate([np.linspace(a, b, pieces + 1) for a, b in pairwise(times)]))
        return fine, CubicHermiteSpline(times, positions, speeds)(fine)


def rotations(vectors: np.ndarray) -> np.ndarray:
    """Return the matrices of rotation vectors [rad], (s, 3), by Rodrigues' formula, (s, 3, 3)."""
    angle = np.linalg.norm(vectors, axis=1)
    axis = vectors / np.where(angle > 0, angle, 1.0)[:, None]
    x, y, z = axis.T
    zero = np.zeros(len(angle))
    K = np.stack([np.stack(row, -1) for row in ((zero, -z, y), (z, zero, -x), (-y, x, zero))], -2)
    sine, cosine = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + sine * K + (1 - cosine) * (K @ K)


def moving_bodies(drawing: Drawing) -> list[Moving]:
    """Return the bodies of a mechanism."""
    scene, bodies = drawing.scene, []
    hinges = [joint for joint in scene["joint"].values() if "body" in joint]
    hinges += [joint for joint in scene.get("force", {}).values() if joint["kind"] in ("spring", "bushing")]
    for name in drawing.trajectory.bodies:
        settings = Body.model_validate(scene["body"][name])
        centre = np.asarray(settings.position) + drawing.design(name, ["centre"]).centre
        positions = [
            _placed(drawing, name, joint.get("at"), joint.get("interface")) for joint in hinges if joint["body"] == name
        ]
        for joint in hinges:
            if joint.get("against") == name:
                against = joint.get("against_at"), joint.get("against_interface")
                default = joint["body"], joint.get("at"), joint.get("interface")
                positions.append(_placed(drawing, *(default if against == (None, None) else (name, *against))))
        for points in touching(drawing, name).values():
            positions += list(points if len(points) <= DRAWN else points.mean(axis=0, keepdims=True))
        points = np.array([*positions, centre]) - centre
        bodies.append(Moving(name, points, centre, drawing.trajectory.motion[name]))
    return bodies


def touching(drawing: Drawing, body: str) -> dict[str, np.ndarray]:
    """Return where the scene places the contact points of a body, by contact [m], (k, 3) each."""
    position = np.asarray(drawing.scene["body"][body]["position"], float)
    return {
        name: position + contact.points for name, contact in drawing.trajectory.contacts.items() if contact.body == body
    }


def _placed(
    drawing: Drawing, body: str, position_in_body: tuple[float, float, float] | None, interface: str | None
) -> np.ndarray:
    """Return where the scene places a point of a body, its origin by default, or an interface [m], (3,)."""
    position = np.asarray(drawing.scene["body"][body]["position"], float)
    if interface is not None:
        return position + drawing.modes(body, ["loads"]).loads[interface].point
    Q, point = drawing.rotation(body), np.asarray(position_in_body or (0.0, 0.0, 0.0), float)
    return position + (point if Q is None else Q @ point)
