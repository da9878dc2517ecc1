"""How near to the origin a mechanism has to stand for its joints to close in round-off."""

import numpy as np

from gudgeon.solver.errors import SceneError

ROUGH = 3e-9
"""Distance of neighbouring numbers at a place over the size of the mechanism beyond which joints do not close."""


def check_nearness(names: list[str], centres: np.ndarray, size: float) -> None:
    """Raise a SceneError where bodies are so far from the origin that joints cannot be closed in round-off.

    Args:
        names: Of the bodies.
        centres: Of their masses [m], (n, 3).
        size: Of the mechanism [m].
    """
    far = np.abs(centres).max(axis=1)
    if (step := float(np.spacing(far.max()))) > ROUGH * size:
        raise SceneError(
            f"body.{names[int(far.argmax())]}.position: {far.max():.3g} m from the origin, where positions are"
            f" multiples of {step:.2g} m, too coarse for joints of a mechanism of {size:.3g} m; move it nearer to it"
        )
