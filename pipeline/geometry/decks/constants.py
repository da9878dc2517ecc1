"""Engineering constants of an orthotropic stiffness."""

from collections.abc import Sequence

import numpy as np


def engineering_constants(normal: np.ndarray, shear: Sequence[float]) -> dict[str, tuple[float, ...]] | None:
    """Return Young's moduli, Poisson's ratios 12, 13, 23 and shear moduli 12, 13, 23; None of a singular stiffness.

    Args:
        normal: From strains to stresses along 1, 2, 3, (3, 3).
        shear: Moduli 12, 13, 23.
    """
    try:
        S = np.linalg.inv(normal)
    except np.linalg.LinAlgError:
        return None
    if not (np.diag(S) > 0).all():
        return None
    E = tuple((1 / np.diag(S)).tolist())
    nu = tuple(float(-S[j, i] / S[i, i]) for i, j in ((0, 1), (0, 2), (1, 2)))
    return {"E": E, "nu": nu, "G": tuple(float(g) for g in shear)}
