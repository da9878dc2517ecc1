"""Grids of poses that are refined where interpolation has an error: knots are inserted into axes of a tensor grid."""

from concurrent.futures import Executor
from dataclasses import replace

import numpy as np

from gudgeon.modaldb.records.field import PoseRecord
from gudgeon.pipeline.applications.electrostatics.blocks import compute_parts
from gudgeon.pipeline.applications.electrostatics.grid import Grid
from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.stages.run_report import Progress
from gudgeon.solver.forces.fields.pose_field import cell_errors

MOST_ROUNDS = 12
"""Each halves cells: the finest one is 1/4096 of one of the scene."""
CAUTION = 0.25
"""Estimate that is allowed, over the tolerance: cells at the border had errors of 1.6 times their estimate."""


class Refinement:
    """The poses of a grid that are known, and the axes that they ask for.

    Poses are computed once: a round computes those that its axes add, in blocks that are records of their own, so that
    a run that was stopped finds all of its rounds again.
    """

    def __init__(self, root: str, scene: str, grid: Grid, tolerance: float) -> None:
        """Begin with the grid of the scene; `tolerance`: of the estimated errors of all cells, relative to |C|."""
        self._root, self._scene, self._tolerance = root, scene, tolerance
        self.grid = grid
        self._known: dict[tuple[float, ...], tuple[np.ndarray, np.ndarray]] = {}
        self._records: list[PoseRecord] = []

    def compute(self, tell: Progress, executor: Executor | None = None) -> bool:
        """Compute the poses that are missing, and insert knots; return whether the grid has changed by that.

        Raises:
            InputError, StageError: see `blocks.compute_grid`.
        """
        missing = [p for p in self.grid.poses() if tuple(p) not in self._known]
        blocks = self.grid.parts(self._scene, np.array(missing))
        for record in compute_parts(self._root, self.grid, blocks, tell, executor):
            self._records.append(record)
            for pose, C, error in zip(record.poses, record.capacitance, record.panel_error, strict=True):
                self._known[tuple(pose)] = C, error
        refined = self._refined()
        changed = refined.axes != self.grid.axes
        self.grid = refined
        return changed

    def record(self) -> PoseRecord:
        """Return the poses of the grid in its order."""
        poses = self.grid.poses()
        values = [self._known[tuple(pose)] for pose in poses]
        record = self._records[0]
        counts = {
            name: sum(r.counts[name] for r in self._records) for name in ("iterations", "cpu_seconds")
        }  # fmt: skip
        return PoseRecord(
            field_key=record.field_key, moved=record.moved, poses=poses, capacitance=np.array([v[0] for v in values]),
            panel_error=np.array([v[1] for v in values]), counts=counts,
        )  # fmt: skip

    def _refined(self) -> Grid:
        """Return the grid with a knot in the middle of each cell of an axis whose error is above its share."""
        ordered = self.grid.ordered
        axes, allowed = {}, CAUTION * self._tolerance / len(ordered)
        C = np.array([self._known[tuple(pose)][0] for pose in self.grid.poses()])
        values = C.reshape(*map(len, ordered.values()), *C.shape[1:])
        for n, (name, nodes) in enumerate(ordered.items()):
            along = np.moveaxis(values, n, 0).reshape(len(nodes), -1, 1)
            errors = cell_errors([np.array(nodes)], along)
            halved = [0.5 * (nodes[i] + nodes[i + 1]) for i in np.flatnonzero(errors > allowed)]
            axes[name] = tuple(sorted({*nodes, *halved}))
        return replace(self.grid, axes=axes)


def not_reached(tolerance: float, grid: Grid) -> StageError:
    """Return the error of a grid whose estimate stays above the tolerance."""
    sizes = ", ".join(f"{name}: {len(values)}" for name, values in grid.ordered.items())
    return StageError(
        f"poses.tolerance: the estimated error of interpolation is above {tolerance:g} after {MOST_ROUNDS} rounds"
        f" ({sizes}); it is below the errors of the panels: give a larger tolerance, or finer panels"
    )
