"""A body without elastic coordinates: nothing is factorised, and the counts of modes have no effect."""

import numpy as np

from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction
from gudgeon.pipeline.scenes.modes import ModesSettings


def rigid(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Keep mass and inertia only; contact between two such bodies needs a surface layer."""
    return Reduction(np.empty(0), np.empty((model.K.shape[0], 0)), 0, None, {})
