"""What probes read of a mechanism: points of bodies, and forces of joints and springs."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.trajectory import ProbeHistory
from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.mechanism.arrays import NONE, SPEED, TURN, Model
from gudgeon.solver.integrators.mechanism.build import Linkage, Point
from gudgeon.solver.integrators.mechanism.energy import angular_velocities, point_places
from gudgeon.solver.integrators.mechanism.rotation import matrices
from gudgeon.solver.scene.probe import DistanceProbe, ForceProbe, PointProbe
from gudgeon.solver.system.probes import AXES, UNITS
from gudgeon.solver.vectors import unit

WRENCH = ("x", "y", "z", "moment x", "moment y", "moment z")


class States(NamedTuple):
    """States of a run: the start, then s samples."""

    bodies: np.ndarray
    """(1 + s, n, 13)"""
    vectors: np.ndarray
    """Rotation vectors [rad], (1 + s, n, 3)."""
    wrenches: np.ndarray
    """Of the joints of two markers, (1 + s, J, 6)."""
    multipliers: np.ndarray
    """Of all rows, (1 + s, m)."""
    interval: float
    """Between samples [s]."""


@dataclass(frozen=True)
class Reader:
    """One probe of a mechanism."""

    name: str
    probe: PointProbe | DistanceProbe | ForceProbe
    linkage: Linkage
    points: tuple[Point, ...]

    def history(self, model: Model, states: States) -> ProbeHistory:
        """Return what it reads at the samples."""
        probe = self.probe
        if isinstance(probe, ForceProbe):
            values, columns, name = self._force(model, states, probe.of)
        elif isinstance(probe, DistanceProbe):
            one, other = (point_places(model, states.bodies, *point) for point in self.points)
            values, columns, name = np.linalg.norm(one - other, axis=1)[:, None], ("distance",), "m"
        else:
            values, columns, name = self._motion(model, states), AXES, UNITS[probe.kind]
            if probe.direction is not None:
                values, columns = values @ unit(probe.direction)[:, None], ("along",)
        if probe.kind == "acceleration":
            values = np.diff(values, axis=0, prepend=values[:1]) / states.interval
        return ProbeHistory(probe.kind, values[1:].copy(), name, ", ".join(columns), 0.0)

    def _motion(self, model: Model, states: States) -> np.ndarray:
        """Return displacement, velocity or rotation, (1 + s, 3)."""
        ((body, arm),) = self.points
        bodies = states.bodies
        if self.probe.kind == "rotation":
            return states.vectors[:, body]
        if self.probe.kind == "displacement":
            return point_places(model, bodies, body, arm) - self.linkage.place(self.points[0])
        omega = angular_velocities(model, bodies)[:, body]
        reach = matrices(bodies[:, body, TURN : TURN + 4]) @ arm
        return bodies[:, body, SPEED : SPEED + 3] + np.cross(omega, reach)

    def _force(self, model: Model, states: States, of: str) -> tuple[np.ndarray, tuple[str, ...], str]:
        kind, _, owner = of.partition(".")
        if kind == "force":
            number = list(self.linkage.system.scene.point_springs()).index(owner)
            return self._tension(model, states, number), ("tension",), "N"
        if owner in self.linkage.pairs:
            return states.wrenches[:, self.linkage.pairs[owner]], WRENCH, "N, N m"
        rows = [i for i, row in enumerate(self.linkage.rows) if row.joint == owner]
        name = "N" if self.linkage.rows[rows[0]].length else "N m"
        return states.multipliers[:, rows], ("along",), name

    def _tension(self, model: Model, states: States, number: int) -> np.ndarray:
        stiffness, damping, length = model.spring[number]
        ends = [(int(model.spring_owner[number, side]), model.spring_arm[number, side]) for side in range(2)]
        omega = angular_velocities(model, states.bodies)
        places, speeds = [], []
        for body, arm in ends:
            places.append(point_places(model, states.bodies, body, arm))
            if body == NONE:
                speeds.append(np.zeros_like(places[-1]))
                continue
            reach = matrices(states.bodies[:, body, TURN : TURN + 4]) @ arm
            speeds.append(states.bodies[:, body, SPEED : SPEED + 3] + np.cross(omega[:, body], reach))
        apart = places[1] - places[0]
        size = np.linalg.norm(apart, axis=1)
        rate = ((speeds[1] - speeds[0]) * apart).sum(axis=1) / size
        return (stiffness * (size - length) + damping * rate)[:, None]


def readers(linkage: Linkage) -> list[Reader]:
    """Return the probes of a scene.

    Raises:
        SceneError: a probe reads what a mechanism does not have.
    """
    scene, found = linkage.system.scene, []
    for name, probe in scene.probe.items():
        points: tuple[Point, ...] = ()
        if isinstance(probe, ForceProbe):
            kind = probe.of.partition(".")[0]
            if kind not in ("joint", "force"):
                raise SceneError(
                    f"probe.{name}.of: '{probe.of}' given; a scene of integrator 'mechanism' reads forces of joints and"
                    " springs"
                )
        else:
            keys = ("interface", "against_interface")
            if (key := next((one for one in keys if getattr(probe, one, None) is not None), None)) is not None:
                raise SceneError(
                    f"probe.{name}.{key}: integrator 'mechanism' reads points of rigid bodies; give"
                    f" {'at' if key == 'interface' else 'against_at'} instead"
                )
            points = (linkage.point(probe.body, probe.at or (0.0, 0.0, 0.0)),)
            if isinstance(probe, DistanceProbe):
                points += (linkage.point(probe.against, probe.against_at or (0.0, 0.0, 0.0)),)
        found.append(Reader(name, probe, linkage, points))
    return found
