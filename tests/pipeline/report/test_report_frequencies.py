"""`gudgeon report` where nothing touches: errors of frequencies over meshes, against a reference or the finest one."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.report.bodies import report_scene
from gudgeon.pipeline.report.choice import chosen
from gudgeon.pipeline.report.document import Chain, Document
from gudgeon.pipeline.report.effort import Effort
from gudgeon.pipeline.report.frequencies import mean_edge, observed_order, sizes_of
from gudgeon.pipeline.report.page.output import report_text
from gudgeon.pipeline.stages.job import Job
from tests.scenes import reference, scene_path

SCENE = scene_path("modes-validation") / "free.toml"
SIZES = [0.03, 0.02, 0.015, 0.011]
SWEEP: dict[str, Any] = {"report.sweep": {"component.bar.mesh.size": SIZES}}
NO_REFERENCE: dict[str, Any] = {"report.reference": "unset", "report.quantities": "unset"}


def silent(stage: str, share: float) -> None:
    """Tell nobody."""


def job(folder: Path, *changes: dict[str, Any]) -> Job:
    settings = {key: value for change in changes for key, value in change.items()}
    texts = [f"{key}={toml(value)}" for key, value in settings.items()]
    return open_job(SCENE, set=texts, db=folder / "db", out=folder / "out")


def toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f'"{key}" = {toml(one)}' for key, one in value.items()) + "}"
    return json.dumps(value)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("frequencies")


@pytest.fixture(scope="module")
def document(folder: Path) -> Document:
    return report_scene(job(folder, SWEEP), Effort(repeat=2, tolerance=0.02), silent)


def test_errors_are_against_the_reference(document: Document, folder: Path) -> None:
    exact = reference("modes-validation/F2_bar_free_free.json")["solid_3D_Hz"]
    assert document.reference["kind"] == "analytic"
    assert [one.reference for one in document.quantities] == exact[:7]
    for run, size in zip(document.runs, SIZES, strict=True):
        one = job(folder, {"component.bar.mesh.size": size})
        modes = one.store.get(one.components()["bar"]["modes"].key, "modes", only=["angular_frequencies"])
        errors = modes.angular_frequencies[:7] / (2 * np.pi) / exact[:7] - 1
        np.testing.assert_allclose([run.errors[f"bar.frequency{i + 1}"] for i in range(7)], errors, rtol=1e-12)
        assert run.largest_error == pytest.approx(errors.max(), rel=1e-12)
    assert [run.coordinates for run in document.runs] == sorted(run.coordinates for run in document.runs)


def test_convergence_and_estimate(document: Document) -> None:
    """Bending and stretching of a bar converge with about the fourth order; the estimate lies next to the error."""
    for quantity in document.quantities:
        (chain,) = quantity.chains
        assert chain.axis == "mesh"
        assert chain.sizes == sorted(chain.sizes, reverse=True)
        assert chain.converges is True
        assert quantity.converges is True
        assert chain.differences[-1] == 0.0
    order = document.quantities[0].chains[0].order
    assert order == pytest.approx(4.0, abs=0.8)
    (table,) = document.tables
    assert table.columns[3:] == [run.name for run in document.runs]
    assert [row[0] for row in table.rows] == [quantity.name for quantity in document.quantities]
    assert table.rows[0][2] == f"{order:.1f}"
    finest = [float(part.strip(" +%")) for part in table.rows[2][-1].split("/")]
    assert finest[1] / finest[0] == pytest.approx(1.0, abs=0.3)


def test_seconds_memory_and_files(document: Document, folder: Path) -> None:
    for run in document.runs:
        assert run.stages.keys() == {"mesh", "modes"}
        colds = [stage.cold for stage in run.stages.values() if stage.cold]
        assert run.cpu_seconds == pytest.approx(sum(taken.cpu for taken in colds))
        assert run.peak_mib is not None
        assert run.peak_mib > 10
        assert run.factorisations is not None
        assert run.factorisations >= 1
    for name in ("report.json", "report.csv", "report.png", "report.html"):
        assert (folder / "out" / name).stat().st_size > 1000
    assert json.loads((folder / "out" / "report.json").read_text()) == document.as_json()
    assert "| bar.frequency1 | 2569.73 |" in report_text(document)


def test_tolerance_chooses_a_mesh(document: Document, folder: Path) -> None:
    """The cheapest mesh that meets it is run from then on."""
    able = [run for run in document.runs if run.largest_error is not None and run.largest_error <= 0.02]
    assert 0 < len(able) < len(SIZES)
    best = min(able, key=lambda run: run.cpu_seconds)
    assert document.choice is not None
    assert document.choice.run == best.name
    ready, said = chosen(job(folder, SWEEP), 0.02)
    assert ready.scene.component["bar"].mesh.size == best.settings["component"]["bar"]["mesh"]["size"]
    assert best.name in said


def test_the_finest_mesh_stands_for_a_reference(folder: Path) -> None:
    document = report_scene(job(folder, SWEEP, NO_REFERENCE), Effort(repeat=1), silent)
    assert document.reference["kind"] == "finest"
    assert document.runs[-1].name in document.reference["source"]
    assert set(document.runs[-1].errors.values()) == {0.0}
    assert 0 < (document.runs[2].largest_error or 0) < (document.runs[0].largest_error or 0)


ROD = """
[component.rod]
geometry = { kind = "bar", length = 1.0, area = 1e-4 }
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
mesh = { size = 0.05 }
modes = { reduction = "macneal", normal_count = 25 }

[body.rod]

[run]
duration = 1e-5
"""


def test_sizes_without_a_sweep(tmp_path: Path) -> None:
    """About the scene's own, which stays as it is; a mesh that has fewer modes is left out and says why.

    Frequencies of the bar against n c / 2 L.
    """
    (tmp_path / "scene.toml").write_text(ROD)
    one = open_job(tmp_path, db=tmp_path / "db", out=tmp_path / "out")
    names = ["edges of 100 mm", "edges of 70 mm", "edges of 50 mm", "edges of 35 mm"]
    settings = sizes_of(one)
    assert [setting.name for setting in settings] == names
    assert [setting.named for setting in settings] == [False, False, True, False]
    assert settings[2].changes == {}
    document = report_scene(one, Effort(repeat=1), silent)
    assert [run.name for run in document.runs] == names[1:]
    assert [one["name"] for one in document.left_out] == names[:1]
    assert "25 given, its mesh has 17 at most" in document.left_out[0]["why"]
    first = document.quantities[0]
    assert first.reference == pytest.approx(np.sqrt(210e9 / 7850.0) / 2, rel=1e-6)
    assert document.runs[0].coordinates == 31
    assert document.runs[0].scheme == "line3"


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"report.quantities": {"bar.frequency9": "solid_3D_Hz/0"}}, "report.quantities: no run has 'bar.frequency9'"),
        ({"report.sweep": {"component.rod.mesh.size": [0.1]}}, "no setting is admissible; size 0.1: component.rod"),
        ({"report.sweep": {"component.bar.mesh.sise": [0.1]}}, "component.bar.mesh.sise: unknown key"),
    ],
)  # fmt: skip
def test_what_cannot_be_compared_is_refused(
    change: dict[str, Any], complaint: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = [text for key, value in (SWEEP | change).items() for text in ("--set", f"{key}={toml(value)}")]
    places = ["--db", str(folder / "db"), "--out", str(folder / "other"), "--repeat", "1"]
    assert main(["report", str(SCENE), *settings, *places]) == 2
    assert complaint in capsys.readouterr().err


def test_mean_edge() -> None:
    """Of a tetrahedron with three legs of 1, and a line of 2 and 4."""
    nodes = np.zeros((10, 3))
    nodes[1:4] = np.eye(3)
    tetra = MeshRecord(nodes, np.arange(10)[None], "tetra10", {})
    assert mean_edge(tetra) == pytest.approx((3 + 3 * np.sqrt(2)) / 6)
    line = MeshRecord(np.array([[0.0, 0, 0], [2, 0, 0], [6, 0, 0], [1, 0, 0], [4, 0, 0]]),
                      np.array([[0, 1, 3], [1, 2, 4]]), "line3", {})  # fmt: skip
    assert mean_edge(line) == pytest.approx(3.0)


def test_observed_order() -> None:
    sizes = [0.8, 0.4, 0.2, 0.1]
    errors = [3 * size**3 for size in sizes]
    names = ["a", "b", "c", "d"]
    assert observed_order(Chain("mesh", names, sizes, errors, errors, True, None)) == pytest.approx(3.0)
    assert observed_order(Chain("mesh", names, sizes, errors, errors, False, None)) is None
    assert observed_order(Chain("mesh", names, sizes, [0.0] * 4, errors, True, None)) is None
    assert observed_order(Chain("mesh", names[:2], sizes[:2], errors[:2], errors[:2], True, None)) is None
