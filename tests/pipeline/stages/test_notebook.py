"""What a notebook gets: tables, arrays with names and units, figures, small pages, and exceptions of one line."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gudgeon
from gudgeon.modaldb.errors import RecordMissing
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.report.page.notebook import shown
from gudgeon.pipeline.stages.run_report import RunReport
from tests.pipeline import documents

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("notebook")
    shutil.copytree(ROOT / "data" / "hertz", folder / "hertz")
    return folder


@pytest.fixture(scope="module")
def found(place: Path) -> RunReport:
    return gudgeon.run(place / "hertz", db=place / "db", out=place / "out", until="solve")


def test_quantities_are_a_table(found: RunReport) -> None:
    table = found.to_frame()
    assert list(table.columns) == ["value", "unit", "reference", "error"]
    assert table.loc["pair.impulse", "value"] == found.quantities["pair.impulse"]["value"]
    assert table.loc["pair.impulse", "unit"] == "N s"


def test_a_trajectory_is_a_dataset_with_units(found: RunReport) -> None:
    trajectory = found.trajectory()
    data = trajectory.to_xarray()
    force = data["contacts.pair.force"]
    assert force.dims == ("time", "axis")
    assert force.attrs["units"] == "N"
    np.testing.assert_array_equal(data["time"], trajectory.times)
    interval = float(data["time"][1] - data["time"][0])
    impulse = float(np.linalg.norm(force.sum("time") * interval))
    assert impulse == pytest.approx(found.quantities["pair.impulse"]["value"], rel=1e-9)
    assert list(data["axis"].values) == ["x", "y", "z"]
    assert data["impacts.pair"].dims[0] == "impacts.pair.impact"


def test_modes_are_arrays_in_two_lines(place: Path) -> None:
    gudgeon.run(ROOT / "data" / "rod-wall", db=place / "db", out=place / "rod", until="morph")
    modes = gudgeon.open_job(ROOT / "data" / "rod-wall", db=place / "db").record("rod")
    assert modes.frequencies.shape == (modes.normal_count,)
    data = modes.to_xarray()
    assert data["shapes"].dims == ("node", "shapes.column", "mode")
    assert "normal modes" in modes._repr_html_()


def test_records_are_asked_for_by_name(place: Path, tmp_path: Path) -> None:
    job = gudgeon.open_job(ROOT / "data" / "rod-wall", db=tmp_path / "db")
    with pytest.raises(InputError, match="record: no component 'rad'; the scene has rod"):
        job.record("rad")
    with pytest.raises(InputError, match="record: no kind 'mode'; allowed: mesh, modes, morph"):
        job.record("rod", "mode")
    with pytest.raises(RecordMissing):
        job.record("rod", "modes")


def test_figures_and_pages(found: RunReport, tmp_path: Path) -> None:
    figure: Any = found.plot()
    assert figure._repr_png_().startswith(b"\x89PNG")
    (axes,) = figure.axes
    assert axes.get_ylabel() == "force of pair [kN]"
    assert axes.lines[0].get_ydata().max() > 0
    page = found._repr_html_()
    assert "pair.impulse" in page
    curve = found.trajectory()._repr_html_()
    assert "<polyline" in curve
    assert "contacts.pair.force" in curve


def test_a_run_without_a_trajectory_says_so(place: Path) -> None:
    found = gudgeon.run(place / "hertz", db=place / "db", out=place / "none", until="morph")
    with pytest.raises(InputError, match="no trajectory; run a scene of bodies up to the stage 'solve'"):
        found.trajectory()


def test_an_exception_has_the_line_of_the_terminal(place: Path) -> None:
    with pytest.raises(InputError) as caught:
        gudgeon.run(place / "hertz", set={"run.duraton": 1.0}, db=place / "db")
    (line,) = str(caught.value).splitlines()
    assert "run.duraton: unknown key; did you mean 'duration'?" in line


def test_a_report_is_a_table_and_a_figure() -> None:
    document = shown(documents.small())
    table = document.to_frame()
    assert list(table["name"]) == [run.name for run in document.runs]
    assert list(table["cpu_seconds"]) == pytest.approx([run.cpu_seconds for run in document.runs])
    assert document.plot().axes
    assert document.plot()._repr_png_().startswith(b"\x89PNG")
    assert "<svg" in document._repr_html_()
