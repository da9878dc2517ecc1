"""How much a compliance under several pressures changes."""

import numpy as np
from scipy import linalg

SMALL = 1e-6
"""Combinations of pressures below this share of the largest compliance are left out."""


def largest_change(change: np.ndarray, compliance: np.ndarray) -> float:
    """Return the eigenvalue of largest size of δC p = μ C p, 0 without pressures."""
    scale = 1 / np.sqrt(np.maximum(compliance.diagonal(), np.finfo(float).tiny))
    strength, directions = linalg.eigh(compliance * np.outer(scale, scale))
    independent = strength > SMALL * strength.max(initial=0.0)
    basis = scale[:, None] * directions[:, independent] / np.sqrt(strength[independent])
    values = linalg.eigvalsh(basis.T @ change @ basis)
    return float(values[np.abs(values).argmax()]) if len(values) else 0.0
