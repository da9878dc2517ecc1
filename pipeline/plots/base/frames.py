"""The motion of a body at the stored frames of a run, as arrays."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from gudgeon.modaldb.stores.base import Store
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing


@dataclass(frozen=True)
class BodyFrames:
    """Displacement of the nodes of one body over the frames of a run: n nodes, f frames."""

    motion: BodyMotion
    times: np.ndarray
    """Times of the frames: those that the run stored and those of the largest forces, ascending [s], (f,)."""

    @property
    def nodes(self) -> np.ndarray:
        """Nodal positions in the body's design, along the axes of the scene [m], (n, 3)."""
        return self.motion.nodes

    @property
    def cells(self) -> np.ndarray:
        """Node numbers of each cell from 0, as of `MeshRecord.cells`, (e, a)."""
        return self.motion.mesh.cells

    @cached_property
    def displacement(self) -> np.ndarray:
        """Displacement of each node from its initial position, of the kept modes [m], (f, n, 3)."""
        return np.stack([self.motion.total(k) for k in range(len(self.times))])

    @cached_property
    def deformation(self) -> np.ndarray:
        """Displacement without that of the rigid body [m], (f, n, 3)."""
        return np.stack([self.motion.elastic(k) for k in range(len(self.times))])


def body_frames(store: Store, key: str, scene: str) -> dict[str, BodyFrames]:
    """Return the motion of each body of a run by name; its arrays are computed when they are first read.

    Args:
        key: Of the record of the run.
        scene: For messages.

    Raises:
        InputError: the bodies turn by any angle, so that displacements are not sums of modes.
    """
    drawing = Drawing(store, key, scene, Path(), Path(), lambda name: None)
    if drawing.turning:
        raise InputError(f"{scene}: frames: its bodies turn by any angle; trajectory() has their motion over time")
    times = drawing.trajectory.frame_times
    return {name: BodyFrames(drawing.body(name), times) for name in drawing.trajectory.bodies}
