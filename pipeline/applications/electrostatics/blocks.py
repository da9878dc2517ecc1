"""Blocks of poses, computed by any executor and found again, and the grid that they make."""

from collections.abc import Sequence
from concurrent.futures import Executor, Future, as_completed

import numpy as np

from gudgeon import modaldb
from gudgeon.modaldb.records.field import FieldRecord, PoseGridRecord, PoseRecord
from gudgeon.pipeline.applications.electrostatics.grid import Grid
from gudgeon.pipeline.applications.electrostatics.poses import pose_block
from gudgeon.pipeline.stages.keys.products import Product
from gudgeon.pipeline.stages.make import keep
from gudgeon.pipeline.stages.run_report import Progress
from gudgeon.solver.forces.fields.pose_field import cell_errors


def compute_grid(
    root: str, scene: str, grid: Grid, tell: Progress, executor: Executor | None = None
) -> list[PoseRecord]:
    """Return the records of all blocks of a grid; those that are in the database at `root` are not computed again.

    A run that was stopped goes on where it was: each block is written as soon as it is done.

    Args:
        executor: Computes the blocks, in processes or threads or on other machines that have the same database; None:
            one after the other here.

    Raises:
        InputError: conductors touch or overlap at a pose.
        StageError: an iteration did not converge.
    """
    return compute_parts(root, grid, grid.blocks(scene), tell, executor)


def compute_parts(
    root: str,
    grid: Grid,
    blocks: Sequence[tuple[Product, np.ndarray]],
    tell: Progress,
    executor: Executor | None = None,
) -> list[PoseRecord]:
    """Return the records of blocks, each a product and its poses; see `compute_grid`."""
    store = modaldb.open(root)
    missing = [(block, poses) for block, poses in blocks if not store.has(block.key)]
    done, total = len(blocks) - len(missing), len(blocks)
    if executor is None:
        for block, poses in missing:
            compute_block(root, block, grid, poses)
            done += 1
            tell("poses", done / total)
    else:
        futures: list[Future[None]] = [
            executor.submit(compute_block, root, block, grid, poses) for block, poses in missing
        ]
        try:
            for future in as_completed(futures):
                future.result()
                done += 1
                tell("poses", done / total)
        except BaseException:
            for future in futures:
                future.cancel()
            raise
    return [store.get(block.key, "poses") for block, _ in blocks]


def compute_block(root: str, block: Product, grid: Grid, poses: np.ndarray) -> None:
    """Compute one block and write its record into the database at `root`."""
    store = modaldb.open(root)
    record: FieldRecord = store.get(grid.field_key, "field")
    keep(store, block, pose_block(record, grid.field_key, grid.moved, list(poses)))


def grid_record(
    grid: Grid, blocks: Sequence[PoseRecord], potentials: np.ndarray, charges: np.ndarray
) -> PoseGridRecord:
    """Return the record of a grid from those of its blocks, with the errors of its cells."""
    axes = {name: np.array(values) for name, values in grid.ordered.items()}
    C = np.concatenate([b.capacitance for b in blocks])
    values = C.reshape(*map(len, axes.values()), *C.shape[1:])
    counts = {
        "poses": len(C),
        "iterations": sum(b.counts["iterations"] for b in blocks),
        "cpu_seconds": sum(b.counts["cpu_seconds"] for b in blocks),
    }
    return PoseGridRecord(
        field_key=grid.field_key, moved=blocks[0].moved, axes=axes, capacitance=C,
        panel_error=np.concatenate([b.panel_error for b in blocks]),
        cell_errors=cell_errors(list(axes.values()), values).ravel(), potentials=potentials, charges=charges,
        counts=counts,
    )  # fmt: skip
