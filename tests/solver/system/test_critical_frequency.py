"""The highest frequency of a body on one closed contact, against dense eigenvalues."""

import numpy as np
import pytest

from gudgeon.solver.system.system import _single

STIFFNESS = np.array([0.0, 6.6e7, 5.9e8, 1.0e11])


@pytest.mark.parametrize("compliance", [1e-12, 1e-9, 1e-3, 1.0, 2e9, 1e30])
@pytest.mark.parametrize("last", [0.9, 1e-8, 0.0])
def test_a_stiff_or_soft_contact(compliance: float, last: float) -> None:
    """Within 1e-12, the round-off of the eigenvalues; also where the contact adds less than that."""
    row = np.array([0.6, 0.9, 0.9, last])
    expected = np.linalg.eigvalsh(np.diag(STIFFNESS) + np.outer(row, row) / compliance)[-1]
    with np.errstate(all="raise"):
        found = _single(STIFFNESS, row, compliance)
    assert found == pytest.approx(np.sqrt(expected), rel=1e-12)
