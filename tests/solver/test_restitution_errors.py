"""The stated error of a restitution: that of the velocity after the impact, relative to this velocity."""

from pathlib import Path
from typing import Any

import pytest

from gudgeon.solver.simulate import simulate
from tests.solver.systems import build, rod_records, rod_scene


def struck(folder: Path, mode_count: int, **contact: Any) -> tuple[float, dict[str, float]]:
    """Return the restitution of a rod of some modes, and the estimates of its run."""
    run = simulate(build(folder, rod_records(mode_count), rod_scene(checks=True, **contact)))
    return run.quantities["wall.restitution"]["value"], run.estimates


@pytest.mark.parametrize("contact", [{"surface_stiffness": 3e14}, {"method": "impact", "restitution": 0.3}])
def test_the_error_of_a_restitution_is_of_the_ratio(contact: dict[str, Any], tmp_path: Path) -> None:
    restitution, estimates = struck(tmp_path / "few", 8, **contact)
    assert 0.1 < restitution < 1.01
    assert estimates["basis.restitution"] == pytest.approx(estimates["basis.rebound"] / restitution, rel=1e-6)
