"""A force that travels over a clamped beam, whose basis changes as it passes, beside fixed bases of equal size.

The truth has 250 normal modes and residual flexibility. Without it a fixed basis lacks what a force bends between its
nodes at any place; one that changes has this where the force is.
"""

from pathlib import Path

import numpy as np
import pytest

from docs.tools.basis_swap import BASES, Case, errors, reference

SPEED = 20.0
CHANGING = "14 normal modes, 4 vectors, 8 bases"


@pytest.fixture(scope="module")
def exact(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    return reference(tmp_path_factory.mktemp("exact"), SPEED)


def test_changing_basis_follows_the_truth(exact: np.ndarray, tmp_path: Path) -> None:
    found, _, jump = Case.of(tmp_path, SPEED, BASES[CHANGING]).solved()
    rms, most = errors(found, exact)
    assert rms < 2e-5
    assert most < 6e-5
    assert 0 < jump < 1e-4


@pytest.mark.parametrize(
    ("label", "times"),
    [
        ("18 normal modes", 50),
        ("14 normal modes, 4 vectors, one basis", 50),
        ("4 normal modes, 14 vectors, one basis", 10),
    ],
    ids=lambda value: str(value).replace(" ", "-"),
)
def test_fixed_bases_of_equal_size_are_worse(label: str, times: int, exact: np.ndarray, tmp_path: Path) -> None:
    changing, _, _ = Case.of(tmp_path, SPEED, BASES[CHANGING]).solved()
    fixed, _, _ = Case.of(tmp_path, SPEED, BASES[label]).solved()
    assert errors(fixed, exact)[0] > times * errors(changing, exact)[0]


def test_dynamics_is_what_is_compared(exact: np.ndarray) -> None:
    """What vibrates is far above the errors: the displacement is not that of a force at rest at each place, which is
    symmetric about the middle."""
    assert np.abs(exact[:-1] - exact[-2::-1]).max() > 0.01 * np.abs(exact).max()
