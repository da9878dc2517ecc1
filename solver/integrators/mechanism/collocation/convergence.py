"""When the stages of a step are found, in compiled functions: changes that decrease by a ratio leave an error that is
their geometric series (Hairer, Wanner, Solving ODE II, IV.8)."""

import numpy as np

from gudgeon.solver.compiled import inner, larger

KNOWN = 0.8
"""Power of the last step's ratio that is taken for the first change."""
FAILED_RATIO = 0.5
"""Ratio that is taken for the first change after a step that did not converge."""
OPEN, FOUND, FAILED = 0, 1, 2


@inner
def verdict(rate, change, before, course):  # type: ignore[no-untyped-def]
    """Return whether stages are `FOUND`, `FAILED` or still `OPEN` after a change.

    Args:
        rate: Ratio of changes in the last step that needed more than one, which is renewed, (1,).
        before: The change before it, infinite for the first one.
        course: Has the `limits` of ratios: that beyond which it does not converge, and the least that is believed; and
            the `tolerance`.
    """
    slow, least = course.limits
    if not change < np.inf:
        return FAILED
    share = rate[0] ** KNOWN
    if before < np.inf:
        ratio = change / before if before > 0.0 else 0.0
        if not ratio < slow:
            rate[0] = FAILED_RATIO
            return FOUND if change <= course.tolerance else FAILED
        rate[0] = larger(ratio, least)
        share = ratio / (1.0 - ratio)
    return FOUND if share * change <= course.tolerance else OPEN
