"""A scene of conductors on finer and coarser panels, and its fields on parts of the grid of poses, with their times."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.interpolate import NdBSpline, make_interp_spline

from gudgeon.modaldb.records.field import FieldRecord, PoseGridRecord, PoseRecord
from gudgeon.pipeline.applications.electrostatics.blocks import compute_block
from gudgeon.pipeline.applications.electrostatics.grid import Grid
from gudgeon.pipeline.applications.electrostatics.job import FieldJob, field_job
from gudgeon.pipeline.applications.electrostatics.poses import PoseProblem
from gudgeon.pipeline.applications.electrostatics.stages import compute_field, compute_poses
from gudgeon.pipeline.process.clock import Clock, Seconds, fastest
from gudgeon.pipeline.scenes.reading import merged
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.run_report import Progress
from gudgeon.solver.forces.fields.co_energy import co_energy_values

FACTORS = (2.0, 1.4, 1.0, 0.75)
"""Edge length of the mesh over that of the scene; strips are in inverse proportion."""
CHECKED = 8
"""Poses between the points of the grid at which its errors are found."""
STENCIL = 0.1
"""Step of the differences that give forces there, over the width of a cell: of fourth order, their error is far below
that of a spline."""
SEED = 21
TIMED = 3
"""Poses of a grid that are timed."""


@dataclass(frozen=True)
class Level:
    """A scene with another mesh."""

    factor: float
    changes: dict[str, Any]
    job: FieldJob
    record: FieldRecord
    seconds: Seconds
    """To solve it once."""

    @property
    def panels(self) -> int:
        """Their number."""
        return int(self.record.counts["panels"])


def changed(job: FieldJob, changes: dict[str, Any]) -> FieldJob:
    """Return a scene of conductors with changes; its results go to the same folder."""
    return field_job(job.place(tables=merged(job.tables, changes)))


def changes_of(job: FieldJob, factor: float) -> dict[str, Any]:
    """Return the changes of a scene for a mesh whose edges are longer by a factor."""
    if factor == 1.0:
        return {}
    sizes = {name: c.mesh.size for name, c in job.scene.conductor.items()}
    meshes = {name: {"mesh": {"size": factor * size}} for name, size in sizes.items() if size is not None}
    strips = min(20, max(1, round(job.scene.panels.strips / factor)))
    return {"conductor": meshes, "panels": {"strips": strips}}


def level(job: FieldJob, factor: float, repeat: int, progress: Progress) -> Level:
    """Solve a scene on a mesh and time it, once as its record was made, and then anew.

    Raises:
        InputError: there are too many panels, or conductors overlap.
        StageError: a numerical routine failed.
    """
    changes = changes_of(job, factor)
    level_job = changed(job, changes)
    run_job(level_job, "solve", progress)
    record: FieldRecord = level_job.store.get(level_job.field().key, "field")
    seconds = Seconds(record.counts["cpu_seconds"], record.counts["cpu_seconds"])
    if repeat > 1:
        again = fastest(lambda: compute_field(level_job, progress), repeat - 1)[1]
        seconds = min(seconds, again, key=lambda s: s.cpu)
    return Level(factor, changes, level_job, record, seconds)


@dataclass(frozen=True)
class Truth:
    """What the boundary elements find at poses between the points of a grid, without interpolation."""

    poses: np.ndarray
    """(n, 6)"""
    energies: np.ndarray
    """G [J], (n,)."""
    forces: np.ndarray
    """∂G by each axis of the grid [N, N m/rad], (n, axes)."""


def checked_poses(grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Return poses inside of cells of a grid, (n, 6), and the widths of their cells along each axis, (n, axes)."""
    rng, axes = np.random.default_rng(SEED), list(grid.ordered.values())
    numbers = grid.numbers
    poses, widths = np.zeros((CHECKED, 6)), np.zeros((CHECKED, len(axes)))
    for n in range(CHECKED):
        for a, values in enumerate(axes):
            cell = int(rng.integers(len(values) - 1))
            widths[n, a] = values[cell + 1] - values[cell]
            poses[n, numbers[a]] = values[cell] + rng.uniform(0.3, 0.7) * widths[n, a]
    return poses, widths


def truth(level_: Level, progress: Progress) -> Truth:
    """Return what a level finds at the poses that are checked; they are kept in the database."""
    grid = level_.job.grid()
    assert grid is not None
    poses, widths = checked_poses(grid)
    numbers = grid.numbers
    shifts = np.zeros((len(poses), len(numbers), 4, 6))
    for a, axis in enumerate(numbers):
        shifts[:, a, :, axis] = STENCIL * widths[:, a, None] * np.array([-2.0, -1.0, 1.0, 2.0])
    around = poses[:, None, None] + shifts
    C = _capacitances(level_.job, grid, np.concatenate([poses, around.reshape(-1, 6)]), progress)
    G = _energies(level_.job, C)
    stencil = G[len(poses) :].reshape(shifts.shape[:3]) @ (np.array([1.0, -8.0, 8.0, -1.0]) / 12)
    return Truth(poses, G[: len(poses)], stencil / (STENCIL * widths))


def _capacitances(job: FieldJob, grid: Grid, poses: np.ndarray, progress: Progress) -> np.ndarray:
    blocks, capacitances = grid.parts(job.name, poses), []
    for n, (product, some) in enumerate(blocks):
        progress("poses between points", n / len(blocks))
        if not job.store.has(product.key):
            compute_block(job.store.location, product, grid, some)
        record: PoseRecord = job.store.get(product.key, "poses")
        capacitances.append(record.capacitance)
    return np.concatenate(capacitances)


def conditions(job: FieldJob) -> tuple[np.ndarray, np.ndarray, bool]:
    """Return potentials [V], NaN of floating conductors, and charges [C], of a scene; where nothing is charged, 1 V of
    the conductors that move, and whether that is so."""
    conductors, moved = job.scene.conductor, () if job.scene.poses is None else job.scene.poses.moved
    potentials = np.array([np.nan if c.potential is None else c.potential for c in conductors.values()])
    charges = np.array([c.charge or 0.0 for c in conductors.values()])
    if np.nan_to_num(potentials).any() or charges.any():
        return potentials, charges, False
    return np.array([1.0 if name in moved else 0.0 for name in conductors]), charges, True


def _energies(job: FieldJob, C: np.ndarray) -> np.ndarray:
    potentials, charges, _ = conditions(job)
    return co_energy_values(C, potentials, charges)


@dataclass(frozen=True)
class GridPart:
    """The grid of a level, or every second or fourth point of each axis."""

    level: Level
    every: int
    record: PoseGridRecord
    pose_seconds: float
    """CPU time of a pose [s]."""

    @cached_property
    def axes(self) -> list[np.ndarray]:
        """Its values of each axis."""
        return [nodes[chosen(len(nodes), self.every)] for nodes in self._whole]

    @property
    def _whole(self) -> list[np.ndarray]:
        return [np.asarray(nodes) for nodes in self.record.axes.values()]

    @property
    def points(self) -> int:
        """Poses."""
        return int(np.prod([len(nodes) for nodes in self.axes]))

    @property
    def cpu(self) -> float:
        """CPU time of the field and of all poses [s]."""
        return self.level.seconds.cpu + self.points * self.pose_seconds

    @cached_property
    def energies(self) -> np.ndarray:
        """G at its points [J]."""
        full_axes = self._whole
        C = np.asarray(self.record.capacitance).reshape(*map(len, full_axes), *self.record.capacitance.shape[1:])
        for a, nodes in enumerate(full_axes):
            C = np.take(C, chosen(len(nodes), self.every), axis=a)
        return _energies(self.level.job, C)

    def interpolated(self, degree: int, poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return G [J] and its derivatives by splines of a degree at poses, (n,) and (n, axes)."""
        coefficients, knots, degrees = self.energies, [], []
        for a, nodes in enumerate(self.axes):
            degrees.append(min(degree, len(nodes) - 1))
            spline = make_interp_spline(nodes, coefficients, k=degrees[-1], axis=a)
            coefficients = np.moveaxis(np.asarray(spline.c), 0, a)
            knots.append(np.asarray(spline.t))
        spline_of_all = NdBSpline(tuple(knots), np.ascontiguousarray(coefficients), tuple(degrees))
        grid = self.level.job.grid()
        assert grid is not None
        numbers = grid.numbers
        points = poses[:, numbers]
        slopes = [
            spline_of_all(points, nu=tuple(int(a == b) for b in range(len(numbers)))) for a in range(len(numbers))
        ]
        return np.asarray(spline_of_all(points)), np.stack(slopes, axis=-1)


def chosen(count: int, every: int) -> np.ndarray:
    """Return the numbers of every second, fourth … point of an axis, with its last one."""
    return np.unique([*range(0, count, every), count - 1])


def grid_parts(level_: Level, progress: Progress) -> Iterator[GridPart]:
    """Compute the grid of a level, and yield it with its parts of two points an axis or more, the finest first.

    Raises:
        InputError: it would take longer than poses.hours.
    """
    record, grid = compute_poses(level_.job, progress=progress), level_.job.grid()
    assert grid is not None
    poses, problem = grid.poses(), PoseProblem(level_.record, grid.moved)
    problem.at(poses[0])
    clock = Clock()
    for pose in poses[np.linspace(0, len(poses) - 1, TIMED).astype(int)]:
        problem.at(pose)
    each = clock.read().cpu / TIMED
    smallest = min(map(len, record.axes.values()))
    for every in (1, 2, 4):
        if every == 1 or (smallest - 1) // every >= 2:
            yield GridPart(level_, every, record, each)


def spacings(grids: Sequence[GridPart]) -> list[float]:
    """Return the mean spacing of each part over that of the whole grid."""
    sizes = [np.mean([1 / (len(nodes) - 1) for nodes in p.axes]) for p in grids]
    return [float(size / sizes[0]) for size in sizes]
