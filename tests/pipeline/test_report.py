"""`gudgeon report`: every model against its reference; nothing that is done is done again."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline import reference
from pipeline.cli import main
from pipeline.errors import InputError
from pipeline.plots.work_precision import pareto_front
from pipeline.reference import GRID, ForceReference, reference_of, smooth
from pipeline.report import report_job, table_text
from pipeline.stages import open_job
from tests.pipeline.small import write_scene

REPORT = """
[report]
nodal = { steps = [8e-6, 4e-6] }

[report.models]
"normal modes + penalty" = { component.skirt.modes.static_count = 0, contact.knock.method = "penalty" }
"residual" = {}

[report.changes]
"barrel" = { component.skirt.change.profile.table = "barrel.csv" }
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("report")
    scene = write_scene(folder / "scene") / "scene.toml"
    scene.write_text(scene.read_text() + REPORT)
    job = open_job(scene, db=folder / "db", out=folder / "out")
    return folder, report_job(job, 1, lambda stage, share: None)


def test_rows(made: tuple[Path, dict[str, Any]]) -> None:
    rows = {row["model"]: row for row in made[1]["rows"]}
    assert list(rows) == ["nodal synthesis, 8 µs", "nodal synthesis, 4 µs", "normal modes + penalty", "residual"]
    assert rows["nodal synthesis, 4 µs"]["force_error"] == pytest.approx(0.0, abs=1e-12)
    assert abs(rows["residual"]["impulse_error"]) < 0.05
    assert rows["residual"]["force_error"] < 0.5 * rows["normal modes + penalty"]["force_error"]
    for row in rows.values():
        assert row["energy_drift"] < 1e-2
        assert row["wall_seconds"] > 0


def test_change(made: tuple[Path, dict[str, Any]]) -> None:
    (row,) = made[1]["changes"]
    assert row["reuse_stages"] == {"mesh": "fresh", "modes": "fresh", "morph": "ran", "solve": "ran"}
    assert abs(row["impulse_error"]) < 3e-3
    assert row["force_error"] < 0.1 * row["force_change"]


def test_files(made: tuple[Path, dict[str, Any]]) -> None:
    folder, document = made
    assert json.loads((folder / "out" / "report.json").read_text()) == document
    with (folder / "out" / "report.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    assert [row["model"] for row in table] == [row["model"] for row in document["rows"]]
    assert (folder / "out" / "report.png").stat().st_size > 20_000
    text = table_text(document)
    assert "| residual | 18 |" in text
    assert "| barrel |" in text


def test_nodal_runs_are_read_back(made: tuple[Path, dict[str, Any]], monkeypatch: pytest.MonkeyPatch) -> None:
    folder, document = made

    def never(*arguments: object) -> None:
        raise AssertionError("the nodal synthesis ran again")

    monkeypatch.setattr(reference, "simulate_nodal", never)
    job = open_job(folder / "scene", db=folder / "db", out=folder / "again")
    again = report_job(job, 1, lambda stage, share: None)
    assert again["rows"][0] == document["rows"][0]
    errors = [[row["impulse_error"] for row in d["rows"]] for d in (again, document)]
    np.testing.assert_allclose(errors[0], errors[1], atol=1e-9)


def test_errors_are_relative_to_the_reference() -> None:
    grid = np.linspace(0, 1e-3, GRID + 1)
    times = np.linspace(0, 1e-3, 501)[1:]
    force = np.zeros((500, 3))
    force[100:200, 0] = 5.0
    exact = ForceReference("test", grid, smooth(times, force, grid, 4e-5), 5.0 * 2e-4, 4e-5)
    np.testing.assert_allclose(exact.errors(times, force), [0, 0], atol=1e-12)
    np.testing.assert_allclose(exact.errors(times, 1.1 * force), [0.1, 0.1], rtol=1e-9)
    assert exact.errors(times, np.roll(force, 50, axis=0))[0] == pytest.approx(0.0, abs=1e-12)
    assert exact.errors(times, np.roll(force, 50, axis=0))[1] > 0.5


def test_a_scene_without_reference_has_none(tmp_path: Path) -> None:
    job = open_job(write_scene(tmp_path / "scene"), db=tmp_path / "db", out=tmp_path / "out")
    assert reference_of(job, []) is None


def test_nodal_reference_needs_a_surface_layer(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "scene") / "scene.toml"
    text = scene.read_text().replace("surface_stiffness = 1e14\n", "") + "[report]\nnodal = { steps = [8e-6, 4e-6] }\n"
    scene.write_text(text)
    job = open_job(scene, db=tmp_path / "db", out=tmp_path / "out")
    with pytest.raises(InputError, match="needs surface_stiffness"):
        report_job(job, 1, lambda stage, share: None)


def test_command_prints_the_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out"), "--repeat", "1"]
    changes = ["--set", 'report.models={"9 modes" = {component.rod.modes.normal_count = 9}}']
    assert main(["report", "data/rod-wall", *options, *changes]) == 0
    assert "| 9 modes | 10 |" in capsys.readouterr().out


def test_pareto_front() -> None:
    points = [(1.0, 0.5), (2.0, 0.6), (3.0, 0.1), (0.5, 0.9), (4.0, 0.1)]
    assert pareto_front(points) == [3, 0, 2]
