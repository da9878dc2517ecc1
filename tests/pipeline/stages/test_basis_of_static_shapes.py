"""A basis of static shapes and few modes: its estimated error is that of the modes that it lacks."""

from pathlib import Path
from typing import Any

import pytest

from docs.tools.basis_reductions import COLUMN
from gudgeon.pipeline.kinds import run

STATIC = {"reduction": "attachment", "normal_count": 0}
FEW = [
    {"reduction": "macneal", "normal_count": 5},
    {"reduction": "macneal", "normal_count": 10},
    {"reduction": "rubin", "normal_count": 5},
    {"reduction": "rubin", "normal_count": 10},
    {"reduction": "craig-bampton"},
    {"reduction": "row-craig-bampton"},
    {"reduction": "interface"},
]


def solved(folder: Path, **modes: Any) -> Any:
    folder.mkdir(exist_ok=True)
    (folder / "scene.toml").write_text(COLUMN)
    changes = {f"component.part.modes.{key}": value for key, value in modes.items()} | {"run.duration": 1e-4}
    return run(folder / "scene.toml", set=changes, db=folder / "db", out=folder / "out", until="solve")


def peak(found: Any) -> float:
    return float(found.quantities["floor.force_peak"]["value"])


@pytest.fixture(scope="module")
def exact(tmp_path_factory: pytest.TempPathFactory) -> float:
    return peak(solved(tmp_path_factory.mktemp("exact"), normal_count=60))


@pytest.mark.parametrize("modes", FEW, ids=lambda modes: f"{modes['reduction']}-{modes.get('normal_count', '')}")
def test_the_estimate_is_at_least_half_of_the_true_error(tmp_path: Path, exact: float, modes: dict[str, Any]) -> None:
    found = solved(tmp_path, **modes)
    error = abs(peak(found) - exact) / peak(found)
    assert error > 0.2
    assert found.estimates["basis.force"] > 0.5 * error
    (note,) = [note for note in found.notes if "modal basis" in note]
    assert "in windowed force" in note
    assert "_count = " in note


def test_more_modes_reduce_the_estimate_and_the_error(tmp_path: Path, exact: float) -> None:
    found = solved(tmp_path, reduction="craig-bampton", normal_count=0, fixed_count=60)
    assert abs(peak(found) / exact - 1) < 0.05
    assert 0.5 * abs(peak(found) / exact - 1) < found.estimates["basis.force"] < 0.05


def test_a_basis_without_a_mode_says_so(tmp_path: Path) -> None:
    found = solved(tmp_path, **STATIC)
    assert found.estimates["basis.force"] == found.estimates["basis.impulse"] == 1.0
    (note,) = [note for note in found.notes if "modal basis" in note]
    assert note == (
        "the error of the modal basis is unknown: no elastic coordinate is a mode of the body; set"
        " component.part.modes.reduction = 'macneal' with normal_count = 30"
    )
