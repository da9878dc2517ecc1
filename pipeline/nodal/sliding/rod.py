"""The massless rod within a step: one force x along its direction in the middle of the step.

The force follows from |P⁺ − C⁺| − L + ½ h n·(Ṗ⁺ − Ċ⁺) = 0 at the end of the step, linear about a prediction of P⁺.
Under the midpoint rule Ṗ⁺ = 2 (P⁺ − P)/h − Ṗ, so the condition has the derivative 2 n by P⁺ and removes a violation
within two steps, half of it in each; a condition on the length alone would oscillate undamped, one on its rate would
drift.
"""

import numpy as np

from gudgeon.pipeline.nodal.problem import NodalRod


def prepare_rod(
    rod: NodalRod, displacement: np.ndarray, rate: np.ndarray, predicted: np.ndarray, pins: np.ndarray, step: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Linearise the rod's condition about a prediction.

    Args:
        displacement: Displacement of the point at the start of the step [m], (2,).
        rate: Its velocity then [m/s], (2,).
        predicted: Its displacement at the end of the step [m], (2,).
        pins: The crank pin at the start and the end of the step: lateral, along, rates, (2, 4).
        step: h [s].

    Returns:
        Direction of the force (2,); n at the end of the step (2,); error of the condition where P⁺ is as predicted [m],
        so that the condition is error + 2 n·(P⁺ − predicted) = 0.
    """
    before = rod.point + displacement - pins[0, :2]
    after = rod.point + predicted - pins[1, :2]
    length = float(np.hypot(*after))
    end, middle = after / length, before + after
    error = length - rod.length + end @ (predicted - displacement) - step / 2 * (end @ (rate + pins[1, 2:]))
    return middle / np.hypot(*middle), end, float(error)
