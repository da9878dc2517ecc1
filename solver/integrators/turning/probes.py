"""What probes read of a mechanism: points of bodies, and forces of joints and springs."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.trajectory import ProbeHistory
from gudgeon.solver.integrators.turning.arrays import SPEED, TURN, Model
from gudgeon.solver.integrators.turning.build import Linkage, Point
from gudgeon.solver.integrators.turning.energy import Motion, bodies_of, modal_parts
from gudgeon.solver.integrators.turning.rotation import matrices
from gudgeon.solver.scene.probe import DistanceProbe, ForceProbe, PointProbe
from gudgeon.solver.system.probes import AXES, UNITS
from gudgeon.solver.vectors import unit

WRENCH = ("x", "y", "z", "moment x", "moment y", "moment z")


class States(NamedTuple):
    """States of a run: the start, then s samples."""

    samples: np.ndarray
    """Whole states, (1 + s, numbers)."""
    motions: list[Motion]
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
            near_end, far_end = (point_motions(model, states, point)[0] for point in self.points)
            values, columns, name = np.linalg.norm(near_end - far_end, axis=1)[:, None], ("distance",), "m"
        else:
            values, columns, name = self._motion(model, states), AXES, UNITS[probe.kind]
            if probe.direction is not None:
                values, columns = values @ unit(probe.direction)[:, None], ("along",)
        if probe.kind == "acceleration":
            values = np.diff(values, axis=0, prepend=values[:1]) / states.interval
        return ProbeHistory(probe.kind, values[1:].copy(), name, ", ".join(columns), 0.0)

    def _motion(self, model: Model, states: States) -> np.ndarray:
        """Return displacement, velocity or rotation, (1 + s, 3)."""
        (point,) = self.points
        if self.probe.kind == "rotation":
            return states.vectors[:, point.owner]
        positions, speeds = point_motions(model, states, point)
        return positions - self.linkage.place(point) if self.probe.kind == "displacement" else speeds

    def _force(self, model: Model, states: States, of: str) -> tuple[np.ndarray, tuple[str, ...], str]:
        kind, _, owner = of.partition(".")
        if kind == "force":
            if owner in (bushings := list(self.linkage.system.scene.six_motions())):
                element_index = bushings.index(owner)
                return np.array([m.bushings[element_index, 6:] for m in states.motions]), WRENCH, "N, N m"
            element_index = list(self.linkage.system.scene.point_springs()).index(owner)
            return spring_pulls(model, states, element_index)[:, None], ("tension",), "N"
        if owner in self.linkage.pairs:
            return states.wrenches[:, self.linkage.pairs[owner]], WRENCH, "N, N m"
        rows = [i for i, row in enumerate(self.linkage.rows) if row.joint == owner]
        name = "N" if self.linkage.rows[rows[0]].length else "N m"
        return states.multipliers[:, rows], ("along",), name


def spring_pulls(model: Model, states: States, spring: int) -> np.ndarray:
    """Return the tension of a spring [N], (1 + s,)."""
    stiffness, damping, length = model.spring[spring]
    ends = np.array([m.springs[spring] for m in states.motions])
    offset, speed = ends[:, 1, 0] - ends[:, 0, 0], ends[:, 1, 1] - ends[:, 0, 1]
    size = np.linalg.norm(offset, axis=1)
    along = (speed * offset).sum(axis=1)
    rate = np.divide(along, size, out=np.zeros_like(size), where=size > 0)  # Where its ends meet, it has no line.
    return stiffness * (size - length) + damping * rate


def point_motions(model: Model, states: States, point: Point) -> tuple[np.ndarray, np.ndarray]:
    """Return places [m] and velocities [m/s] of a point of a body, (1 + s, 3) each."""
    b = point.owner
    bodies = bodies_of(model, states.samples)[:, b]
    turn, m = matrices(bodies[:, TURN : TURN + 4]), point.rows.shape[1]
    q = modal_parts(model, states.samples, b)[0] if m else np.zeros((len(bodies), 0))
    rates = np.array([motion.modal[b, :m] for motion in states.motions])
    curved = np.einsum("ikl,sl->sik", point.bend[:3], q)
    local = point.arm + q @ point.rows[:3].T - 0.5 * np.einsum("sik,sk->si", curved, q)
    moved = rates @ point.rows[:3].T - np.einsum("sik,sk->si", curved, rates)
    arm = np.einsum("sij,sj->si", turn, local)
    omega = np.array([motion.omega[b] for motion in states.motions])
    speeds = bodies[:, SPEED : SPEED + 3] + np.cross(omega, arm) + np.einsum("sij,sj->si", turn, moved)
    return bodies[:, :3] + arm, speeds


def readers(linkage: Linkage) -> list[Reader]:
    """Return the probes of a scene.

    Raises:
        SceneError: a probe names no point of its body.
    """
    scene, probe_readers = linkage.system.scene, []
    for name, probe in scene.probe.items():
        points: tuple[Point, ...] = ()
        if not isinstance(probe, ForceProbe):
            if probe.kind == "rotation":
                points = (Point(linkage.names.index(probe.body), np.zeros(3)),)
            else:
                points = (linkage.point(probe.body, probe.at, probe.interface, f"probe.{name}.at"),)
            if isinstance(probe, DistanceProbe):
                against = probe.against, probe.against_at, probe.against_interface
                points += (linkage.point(*against, f"probe.{name}.against_at"),)
        probe_readers.append(Reader(name, probe, linkage, points))
    return probe_readers
