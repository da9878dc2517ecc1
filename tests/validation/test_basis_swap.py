"""A force that travels over a clamped beam, whose basis changes as it passes, beside fixed bases of equal size.

The truth has 250 normal modes and residual flexibility. Without it a fixed basis lacks what a force bends between its
nodes at any place; one that changes has this where the force is.
"""

from pathlib import Path
from typing import Any

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


SPRUNG = {
    "component.beam.supports": ["left"],
    "component.beam.interface.end": {"surface": "right", "kind": "mean"},
    "force.spring": {
        "kind": "spring", "body": "beam", "interface": "end", "direction": [0.0, 0.0, 1.0], "stiffness": 1e4,
        "damping": 20.0,
    },
}  # fmt: skip
NEIGHBOURS: dict[str, dict[str, Any]] = {
    "at rest under gravity": {"run.gravity": [0.0, 0.0, -9.81]},
    "undeformed under gravity": {"run.gravity": [0.0, 0.0, -9.81], "run.start": "undeformed"},
    "damped": {"body.beam.damping": {"ratio": 0.02}},
    "turned": {"body.beam.orientation": {"axis": [0.0, 1.0, 0.0], "angle": 30.0}},
    "free": {"component.beam.supports": [], "run.limits.angle": 10.0},
    "the other way": {"force.load.speed": -SPEED, "force.load.at": [0.0, 0.45]},
    "on a spring": SPRUNG,
    "on a spring, under gravity, damped": SPRUNG
    | {"run.gravity": [0.0, 0.0, -9.81], "body.beam.damping": {"ratio": 0.02}},
}


@pytest.mark.validation
@pytest.mark.parametrize("neighbour", NEIGHBOURS)
def test_neighbours(neighbour: str, tmp_path: Path) -> None:
    """The same of other scenes, forces that run the other way, and bodies that are free or on springs."""
    more = NEIGHBOURS[neighbour]
    found, _, jump = Case.of(tmp_path, SPEED, BASES[CHANGING], more).solved()
    assert errors(found, reference(tmp_path, SPEED, more))[0] < 2e-5
    assert 0 < jump < 1e-4


def test_dynamics_is_what_is_compared(exact: np.ndarray) -> None:
    """What vibrates is far above the errors: the displacement is not that of a force at rest at each place, which is
    symmetric about the middle."""
    assert np.abs(exact[:-1] - exact[-2::-1]).max() > 0.01 * np.abs(exact).max()
