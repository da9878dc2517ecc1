"""`gudgeon report` of conductors: errors over panels, points of the grid and splines, and what they are against."""

import json
from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.applications.electrostatics.assessment import report as field_report
from gudgeon.pipeline.applications.electrostatics.assessment.levels import CHECKED, checked_poses
from gudgeon.pipeline.applications.electrostatics.grid import Grid, Moved
from gudgeon.pipeline.kinds import report

SPHERES = """
[conductor.left]
geometry = { kind = "sphere", radius = 1e-3 }
mesh.size = 1.5e-3
position = [-1.1e-3, 0.0, 0.0]
potential = -5.0

[conductor.right]
geometry = { kind = "sphere", radius = 1e-3 }
mesh.size = 1.5e-3
position = [1.1e-3, 0.0, 0.0]
potential = 5.0
"""
FLAT = """
[panels]
curved_divisions = 0
"""
"""Panels in a fifth of the time, where errors are those of grids and splines over the same panels."""
POSES = """
[poses]
moved = ["right"]
x = { ends = [0.0, 1.2e-3], points = 9 }
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("report")


def document_of(folder: Path, name: str, text: str) -> dict:  # type: ignore[type-arg]
    path = folder / f"{name}.toml"
    path.write_text(text)
    report(path, db=folder / "db", out=folder / name, repeat=1, tolerance=0.02)
    return json.loads((folder / name / "report.json").read_text())


def test_a_grid_has_runs_of_panels_points_and_splines(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(field_report, "FACTORS", (1.0, 0.75))  # Coarser spheres have the same panels.
    found = document_of(folder, "grid", SPHERES + FLAT + POSES)
    errors = {run["name"]: run["errors"] for run in found["runs"]}
    assert {run["scheme"] for run in found["runs"]} == {"linear splines", "cubic splines", "quintic splines"}
    panels = sorted({run["coordinates"] for run in found["runs"]})
    assert found["reference"]["kind"] == "finest"
    for count in panels:
        linear, cubic = (errors[f"{count} panels, 9 poses, {degree}"] for degree in ("linear", "cubic"))
        half = errors[f"{count} panels, 5 poses, cubic"]
        assert cubic["force"] < 0.5 * linear["force"]
        assert cubic["co_energy"] < half["co_energy"]
    # Without the error of the panels, four times the points have a sixteenth of the error or less.
    chains = {
        chain["axis"]: chain for one in found["quantities"] if one["name"] == "co_energy" for chain in one["chains"]
    }
    coarse, fine = chains["grid"]["differences"][-2:]
    assert fine < coarse / 4
    assert found["choice"]["run"] is None or "cubic" in found["choice"]["run"]
    assert (folder / "grid" / "report.png").stat().st_size > 10_000
    assert "gudgeon run" in (folder / "grid" / "report.html").read_text() or found["choice"]["run"] is None


TURNED = """
[poses]
moved = ["right"]
pivot = [0.0, 0.0, 0.0]
x = { ends = [0.0, 1.2e-3], points = 6 }
rz = { ends = [-3.0, 3.0], points = 4 }
"""


def test_a_grid_of_places_and_angles_is_read_in_the_order_in_which_its_poses_run(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file has the axes by name, rz before x: forces were those of other poses, wrong by factors of up to 1e14."""
    monkeypatch.setattr(field_report, "FACTORS", (1.0,))
    found = document_of(folder, "turned", SPHERES + FLAT + TURNED)
    cubic = [run["errors"] for run in found["runs"] if run["scheme"] == "cubic splines" and "6×4" in run["name"]]
    assert cubic
    for errors in cubic:
        assert errors["co_energy"] < 0.05
        assert errors["force"] < 0.1


@pytest.mark.validation
def test_conductors_in_their_places_are_compared_with_the_finest_mesh(folder: Path) -> None:
    found = document_of(folder, "places", SPHERES)
    runs = found["runs"]
    assert [run["coordinates"] for run in runs] == sorted(run["coordinates"] for run in runs)
    assert runs[-1]["errors"] == {}
    assert all("left.right.mutual_capacitance" in run["errors"] for run in runs[:-1])
    assert all(abs(run["largest_error"]) < 0.05 for run in runs[:-1])


def test_poses_that_are_checked_lie_inside_of_cells() -> None:
    axes = {"z": (0.0, 1.0, 3.0), "rx": (-0.1, 0.0, 0.2, 0.3)}
    poses, widths = checked_poses(Grid("key", Moved(("a",), np.zeros(3)), axes))
    assert poses.shape == (CHECKED, 6)
    assert not poses[:, [0, 1, 4, 5]].any()
    for column, values in ((2, axes["z"]), (3, axes["rx"])):
        nodes = np.array(values)
        cell = np.searchsorted(nodes, poses[:, column]) - 1
        # Room for the differences on both sides.
        assert np.allclose(widths[:, 0 if column == 2 else 1], np.diff(nodes)[cell])
        assert (poses[:, column] - nodes[cell] > 0.29 * np.diff(nodes)[cell]).all()
        assert (nodes[cell + 1] - poses[:, column] > 0.29 * np.diff(nodes)[cell]).all()
