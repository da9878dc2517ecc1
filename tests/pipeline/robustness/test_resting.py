"""Cases of held bodies that lie on an obstacle and of damped ones, each with a program that errs."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gudgeon.pipeline.robustness import trial
from tests.pipeline.robustness.test_settings import ROD, verdicts

CASE = "static deflection into the obstacle"

STRIP = """
[component.strip]
geometry = {kind="beam", theory="euler-bernoulli", length=0.3, section={kind="rectangle", width=0.02, height=0.003}}
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
mesh = { size = 0.01 }
supports = [{ surface = "left" }]
interface.tip = { surface = "right-bottom" }
modes = { normal_count = 12 }

[body.strip]

[contact.stop]
body = "strip"
interface = "tip"
against = { shape = "plane", point = [0.3, 0.0, -0.0018], normal = [0.0, 0.0, 1.0] }

[run]
duration = 0.01
gravity = [0.0, 0.0, -9.81]
"""


@pytest.fixture
def strip(tmp_path: Path) -> Path:
    path = tmp_path / "strip.toml"
    path.write_text(STRIP)
    return path


def test_a_strip_that_sags_on_a_stop_stays_there(strip: Path, tmp_path: Path) -> None:
    row = verdicts(strip, CASE, tmp_path)[CASE]
    assert (row["verdict"], row["rule"]) == ("right", "rest")
    assert {one["rule"] for one in row["findings"]} >= {"rest", "penetration"}


@pytest.mark.parametrize("start", ["free deflection", "undeformed"])
def test_a_start_that_is_no_equilibrium_is_found(
    strip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, start: str
) -> None:
    """The free sag inside of the obstacle, as runs once began, and the shape without deformation."""
    whole = trial.simulate

    def elsewhere(system: Any, progress: Any = None) -> Any:
        sag = system.position - (system.start_forces @ system.rows) / system.stiffness
        position = sag if start == "free deflection" else 0.0 * sag
        return whole(replace(system, position=position, start_forces=0.0 * system.start_forces), progress)

    monkeypatch.setattr(trial, "simulate", elsewhere)
    row = verdicts(strip, CASE, tmp_path)[CASE]
    assert row["verdict"] == "wrong"


def test_a_body_that_moves_freely_does_not_lie(tmp_path: Path) -> None:
    path = tmp_path / "rod.toml"
    path.write_text(ROD)
    assert verdicts(path, CASE, tmp_path)[CASE]["verdict"] == "does not apply"


@pytest.mark.parametrize("given", ["", "[body.rod.damping]\nratio = 0.02", "[body.rod.damping]\nalpha = 20.0"])
def test_a_damped_rod_is_the_same_in_other_units(tmp_path: Path, given: str) -> None:
    path = tmp_path / "rod.toml"
    path.write_text(ROD + given)
    rows = verdicts(path, "damping", tmp_path)
    assert {name: (row["verdict"], row["rule"]) for name, row in rows.items()} == {
        "damping 1%": ("right", "impact"), "damping 5%": ("right", "impact"),
    }  # fmt: skip


def test_damping_that_is_not_in_the_balance_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = trial.simulate

    def forgotten(system: Any, progress: Any = None) -> Any:
        damped = any(body.damping for body in system.scene.body.values())
        found = whole(system, progress)
        return replace(found, energy_drift=0.05) if damped else found

    monkeypatch.setattr(trial, "simulate", forgotten)
    path = tmp_path / "rod.toml"
    path.write_text(ROD)
    assert verdicts(path, "damping 5%", tmp_path)["damping 5%"]["verdict"] == "wrong"
