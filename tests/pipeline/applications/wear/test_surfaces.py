"""Wear of a skirt over cycles: Archard's identity of every update, moved nodes, walls, interrupts, and bad input."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.applications.wear.cycles import Asked, History, run_cycles
from gudgeon.pipeline.applications.wear.report import WearReport, marks_of, run_wear
from gudgeon.pipeline.applications.wear.surfaces import Surfaces, surfaces
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.geometry.profile import read_profile
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.run import solve_records
from tests.pipeline.small import BARREL, SCENE, TABLE

K, HARD = 1e-4, 1e9
WEAR = f"""
[contact.bore.wear]
coefficient = {K!r}
hardness = {HARD!r}
"""
SLIDES = SCENE.replace("velocity = [0.2, 0.0, 0.0]", "velocity = [0.2, 0.0, 5.0]") + "checks = false\n"


def quiet(stage: str, share: float) -> None:
    """Tell nothing."""


def written(folder: Path, text: str = SLIDES + WEAR) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "barrel.csv").write_text(BARREL)
    (folder / "scene.toml").write_text(text)
    return folder


def opened(folder: Path, changes: dict[str, Any] | None = None, text: str = SLIDES + WEAR) -> Any:
    return open_job(written(folder, text), set=changes or {}, db=folder / "db", out=folder / "out")


def worn(folder: Path, cycles: float, changes: dict[str, Any] | None = None) -> WearReport:
    return run_wear(opened(folder, changes), Asked(marks_of(cycles, []), 0.01), None, quiet)


def course(folder: Path, cycles: float, changes: dict[str, Any] | None = None) -> tuple[Surfaces, History]:
    job = opened(folder, changes)
    scene = surfaces(job, job.scene.run.duration, quiet)
    return scene, run_cycles(scene, Asked([cycles], 0.01), quiet, lambda history: None)


@pytest.mark.parametrize("changes", [{}, {TABLE: "barrel.csv"}])
def test_every_update_has_the_volume_of_force_times_sliding(changes: dict[str, Any], tmp_path: Path) -> None:
    """H2: ΔV = k/H Σ ∫ F |v| dt of the cycles that an update stands for, to round-off."""
    scene, found = course(tmp_path, 1e4, changes)
    areas, before = scene.rubbed["bore"].areas, 0.0
    assert len(found.updates) >= 2
    for one in found.updates:
        slide = (
            0.5 * one.step * (one.cycle.quantities["bore.load_distance"] + one.mean.quantities["bore.load_distance"])
        )
        volume = float(one.shapes["bore"][0, 0] @ areas)
        assert volume - before == pytest.approx(K / HARD * slide, rel=1e-11)
        before = volume


@pytest.mark.parametrize("changes", [{}, {TABLE: "barrel.csv"}])
def test_worn_depths_move_contact_points(changes: dict[str, Any], tmp_path: Path) -> None:
    """Modes stay; every contact point moves inwards by its depth, in addition to the scene's own profile."""
    scene, found = course(tmp_path, 1e4, changes)
    depths = found.updates[-1].shapes["bore"][0, 0]
    new, base = scene.worn_job(found.updates[-1].shapes, quiet), scene.job
    assert new.components()["skirt"]["modes"].key == base.components()["skirt"]["modes"].key
    solve_records(base, "morph")
    before, after = (job.record("skirt", "morph").points["thrust"] for job in (base, new))
    inwards = np.linalg.norm(before[:, :2], axis=1) - np.linalg.norm(after[:, :2], axis=1)
    np.testing.assert_allclose(inwards, depths, atol=0.01 * depths.max())
    assert 0 < scene.profiles["skirt"].mismatch < 0.01
    assert 0 < scene.estimates["skirt"] < 0.02
    assert scene.recomputed == 0


def test_files_tell_depths(tmp_path: Path) -> None:
    report = worn(tmp_path, 1e3)
    assert report.reason is None
    assert report.files == ["wear.json", "wear.csv", "worn/skirt.csv", "wear-bore.png"]
    table = np.genfromtxt(tmp_path / "out" / "wear.csv", delimiter=",", skip_header=1)
    depths = np.array(report.document["depths"]["1000"]["bore"])[0, 0]
    np.testing.assert_allclose(table[:, -1], depths, rtol=1e-7, atol=1e-20)
    size = report.document["updates"][-1]["contacts"]["bore"]["own"]
    assert size["volume"] == pytest.approx(depths @ table[:, 3], rel=1e-8)
    assert size["depth"] == depths.max()
    profile = read_profile(tmp_path / "out" / "worn" / "skirt.csv")
    assert profile.deviations.min() == pytest.approx(-depths.max(), rel=0.1)
    assert (tmp_path / "out" / "wear-bore.png").stat().st_size > 20000


def test_modes_beyond_the_tolerance_are_computed_again(tmp_path: Path) -> None:
    scene, found = course(tmp_path, 10.0, {"component.skirt.change.tolerance": 1e-12})
    assert found.reason is None
    assert scene.recomputed >= 2
    new = scene.worn_job(found.updates[-1].shapes, quiet)
    assert new.components()["skirt"]["modes"].key != scene.job.components()["skirt"]["modes"].key


def test_a_stopped_command_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = worn(tmp_path / "whole", 1e3)
    calls, inner = [], Surfaces.cycle

    def counted(*arguments: Any) -> Any:
        calls.append(1)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return inner(*arguments)

    monkeypatch.setattr(Surfaces, "cycle", counted)
    with pytest.raises(KeyboardInterrupt):
        worn(tmp_path / "cut", 1e3)
    before = json.loads((tmp_path / "cut" / "out" / "wear.json").read_text())["updates"]
    assert before
    monkeypatch.undo()
    found = worn(tmp_path / "cut", 1e3).document
    assert json.loads(json.dumps(found["updates"]))[: len(before)] == before
    assert found["depths"].keys() == whole.document["depths"].keys()
    for cycles, depths in whole.document["depths"].items():  # Equal cycles differ by the round-off of their sums.
        np.testing.assert_allclose(found["depths"][cycles]["bore"], depths["bore"], rtol=1e-12)


def test_a_wall_ends_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    changes = ["--set", "contact.bore.wear.thickness=1e-6"]
    assert main(["wear", str(written(tmp_path)), "--cycles", "1e5", *changes, *places]) == 1
    assert "the wall of contact 'bore' is worn through, thickness = 1e-06 m" in capsys.readouterr().err
    document = json.loads((tmp_path / "out" / "wear.json").read_text())
    assert 0 < document["cycles"] < 1e5
    assert document["updates"][-1]["contacts"]["bore"]["own"]["depth"] < 1e-6


BAD: list[tuple[list[str], str]] = [
    (["--set", "contact.bore.wear.coefficient=-1"], "contact.bore.wear.coefficient"),
    (["--set", "contact.bore.wear.coefficient=0"], "all coefficients of wear are zero"),
    (["--set", "contact.bore.wear.against_coefficient=1e-4"], "against.shape 'bore' has none"),
    (["--set", "contact.bore.wear.after=3e-4"], "contact.NAME.wear.after"),
    (["--set", "contact.bore.wear.thickness=0"], "contact.bore.wear.thickness"),
    (["--set", "component.skirt.modes.reduction=rigid", "--set", "component.skirt.change.profile.surface=crown",
      "--set", "component.skirt.change.profile.offset=1e-6"], "wear of one surface is supported"),
    (["--period", "1"], "--period 1 s"),
]  # fmt: skip


@pytest.mark.parametrize(("options", "text"), BAD)
def test_bad_input_is_one_line(
    options: list[str], text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    assert main(["wear", str(written(tmp_path)), *options, *places]) == 2
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("gudgeon: ")]
    assert len(lines) == 1
    assert text in lines[0]


def test_a_surface_that_is_no_cylinder_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from tests.pipeline.small import block_on_floor

    text = block_on_floor() + WEAR.replace("bore", "floor")
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    assert main(["wear", str(written(tmp_path, text)), *places]) == 2
    assert "surface 'bottom' is no cylinder" in capsys.readouterr().err
