"""How much a compliance under several pressures changes."""

import numpy as np
from scipy import linalg

from gudgeon.pipeline.design_change.projection import independent

SMALL = 1e-6
"""Combinations of pressures below this share of the largest compliance are left out."""


def largest_change(change: np.ndarray, compliance: np.ndarray) -> float:
    """Return the eigenvalue of largest size of δC p = μ C p, 0 without pressures."""
    basis = independent(compliance, SMALL)
    values = linalg.eigvalsh(basis.T @ change @ basis)
    return float(values[np.abs(values).argmax()]) if len(values) else 0.0
