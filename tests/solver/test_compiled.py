"""What compiled loops share."""

import numpy as np

from gudgeon.solver.compiled import entry, larger


@entry
def _largest(values):  # type: ignore[no-untyped-def]
    worst = 0.0
    for i in range(len(values)):
        worst = larger(worst, values[i])
    return worst


def test_the_largest_of_many_is_nan_wherever_one_stands() -> None:
    assert _largest(np.array([1.0, 3.0, 2.0])) == 3.0
    for place in range(3):
        values = np.array([1.0, 3.0, 2.0])
        values[place] = np.nan
        assert np.isnan(_largest(values)), place
