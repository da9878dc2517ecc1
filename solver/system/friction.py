"""Lines of friction: friction acts along one line in the plane of contact; motion of a point across it is refused."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gudgeon.solver.errors import SceneError
from gudgeon.solver.system.system import System
from gudgeon.solver.vectors import unit

ACROSS = 0.01
"""Speed across the line of friction, relative to the largest speed of the point so far, above which a run ends."""
DRIVEN = 1e-6
"""Share of the initial velocity, or of gravity, across the line above which a scene is refused: round-off."""
ROUND_OFF = 1e-12
"""Share of the velocities of point and surface below which their difference is round-off."""
IN_PLANE = 1e-6
"""Largest component of the direction of friction along the contact normal."""


@dataclass(frozen=True)
class Line:
    """The line of friction of a contact of one point."""

    name: str
    number: int
    """Of its contact."""
    across: np.ndarray
    """Unit vector across the line, in the plane of contact, (3,)."""
    rows: np.ndarray
    """Velocity of the point relative to the other body per rate of each coordinate, (3, m)."""
    surface: np.ndarray
    """Velocity of the obstacle's surface [m/s], (3,)."""
    rigid: np.ndarray
    """Numbers of the rigid coordinates."""

    def relative(self, rates: np.ndarray, *, rigid: bool = False) -> np.ndarray:
        """Return the velocity of the point relative to the surface [m/s], (…, 3), of rates of coordinates (…, m).

        Args:
            rigid: Whether the rates are those of the rigid coordinates, (…, r).
        """
        return rates @ (self.rows[:, self.rigid] if rigid else self.rows).T - self.surface

    def size(self, rates: np.ndarray, *, rigid: bool = False) -> np.ndarray:
        """Return the speeds of point and surface together, of which `relative` is a difference [m/s], (…,)."""
        moved = rates @ (self.rows[:, self.rigid] if rigid else self.rows).T
        return np.asarray(np.linalg.norm(moved, axis=-1) + np.linalg.norm(self.surface))

    def sentence(self, speed: float, time: float) -> str:
        """Return the reason for the end of a run in which the point moved across its line at a speed [m/s]."""
        return (
            f"the point of contact '{self.name}' moved across its line of friction at {speed:.3g} m/s at"
            f" {time:.6g} s: friction acts along contact.{self.name}.friction.direction only; remove it, so that"
            " friction acts in the plane of contact, or turn it to the motion"
        )


def lines(system: System) -> Iterator[Line]:
    """Yield the lines of friction of a system."""
    for i, contact in enumerate(system.contacts):
        friction = system.scene.contact[contact.name].friction
        if friction is None or friction.direction is None:
            continue
        for point in range(len(contact.points)):
            rows = np.zeros((3, len(system.velocity)))
            for name, _, _, points, sign in contact.sides:
                body = system.bodies[name]
                rows[:, body.rigid] += sign * body.rigid_rows(np.tile(points[point], (3, 1)), np.eye(3))
            across = unit(np.cross(contact.directions[point], unit(friction.direction)))
            surface = np.asarray(getattr(system.scene.contact[contact.name].against, "velocity", np.zeros(3)), float)
            yield Line(contact.name, i, across, rows, surface, system.rigid)


def refuse_motion_across(system: System) -> None:
    """Refuse a line of friction out of the plane of contact, and initial velocity or gravity across a line.

    Raises:
        SceneError: there is such a line, velocity or gravity.
    """
    for contact in system.contacts:
        friction = system.scene.contact[contact.name].friction
        if friction is not None and friction.direction is not None:
            _refuse_direction_out_of_plane(contact.name, friction.direction, contact.directions)
    for line in lines(system):
        speed, weight = line.relative(system.velocity), line.rows @ system.driving.gravity
        # The difference of two equal velocities is their round-off.
        fastest = line.size(system.velocity)
        for vector, size, quantity, measure in (
            (speed, fastest, "its velocity", "m/s"), (weight, np.linalg.norm(weight), "run.gravity", "m/s²"),
        ):  # fmt: skip
            across = abs(float(line.across @ vector))
            if across > max(DRIVEN * np.linalg.norm(vector), ROUND_OFF * size):
                raise SceneError(
                    f"contact.{line.name}.friction.direction: {quantity} has {across:.3g} {measure} across it, and"
                    " friction acts along one line only; remove it, so that friction acts in the plane of contact, or"
                    " turn it to the motion"
                )


def _refuse_direction_out_of_plane(name: str, direction: tuple[float, ...], normals: np.ndarray) -> None:
    """Raise a SceneError for a direction of friction out of the plane of contact at points with normals (c, 3)."""
    along = normals @ unit(direction)
    worst = int(np.abs(along).argmax())
    if abs(along[worst]) <= IN_PLANE:
        return
    angle, normal = np.degrees(np.arcsin(min(abs(along[worst]), 1.0))), ", ".join(f"{x:.4g}" for x in normals[worst])
    raise SceneError(
        f"contact.{name}.friction.direction: {list(direction)} is {angle:.3g} degrees out of the plane of contact,"
        f" whose normal is ({normal}); allowed: a direction in this plane, its component along the normal at most"
        f" {IN_PLANE:g} of its length"
    )
