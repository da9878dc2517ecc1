"""The table of a study: heads, what is missing, stated errors, and both of its files."""

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

from gudgeon.pipeline.studies import picture
from gudgeon.pipeline.studies.table import PARQUET, Table, stated_error, table_of, write_table
from gudgeon.pipeline.studies.task import FAILED, Row


def row(design: int, values: dict[str, float], **more: Any) -> Row:
    quantities = {name: {"value": value, "unit": "N"} for name, value in values.items()}
    return Row(design, more.pop("result", "FINISHED"), quantities=quantities, **more)


ERRORS = {"step.force": 0.01, "basis.force": 0.03, "basis.rebound": 0.5}
FOUND = {
    1: row(1, {"a.impact1.force_peak": 10.0, "a.end": 2.0}, errors=ERRORS, notes=("one", "two")),
    2: row(2, {"a.impact1.force_peak": 20.0, "a.impact2.force_peak": -5.0, "a.end": 3.0}, errors={"step.force": 0.1}),
    3: Row(3, FAILED, "no mesh"),
}
DESIGNS = [(0.1, "x"), (1, [1.5, 2]), (2, "x"), (3, True)]


def test_rows_of_different_runs() -> None:
    table = table_of(["p.q", "r"], DESIGNS, FOUND)
    assert table.heads == (
        "design", "p.q", "r", "result", "reason", "a.impact1.force_peak [N]", "a.impact1.force_peak error [N]",
        "a.impact2.force_peak [N]", "a.impact2.force_peak error [N]", "a.end [N]", "relative error by step.force",
        "relative error by basis.force", "relative error by basis.rebound", "energy drift", "momentum residual",
        "notes", "key",
    )  # fmt: skip
    one, two, three, four = table.rows
    assert one[5:10] == (10.0, pytest.approx(0.4, rel=1e-14), None, None, 2.0)
    assert two[5:10] == (20.0, pytest.approx(2.0, rel=1e-14), -5.0, pytest.approx(0.5, rel=1e-14), 3.0)
    assert (three[3:6], four[3:5]) == ((FAILED, "no mesh", None), ("MISSING", "the study ended before it"))
    assert one[-2] == "one; two"
    assert stated_error(FOUND[1], "a.end") is None


def test_both_files(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed: pip install gudgeon[studies]")
    table = table_of(["p.q", "r"], DESIGNS, FOUND)
    assert write_table(tmp_path, table) == ["study.csv", PARQUET]
    with (tmp_path / "study.csv").open(newline="") as file:
        rows = [*csv.reader(file)]
    assert rows[0] == [*table.heads]
    assert rows[2][1:3] == ["1", "[1.5, 2]"]
    assert rows[4][2] == "true"
    read = parquet.read_table(tmp_path / PARQUET).to_pydict()
    assert read["p.q"] == [0.1, 1.0, 2.0, 3.0]
    assert read["r"] == ["x", "[1.5, 2]", "x", "true"]
    assert read["a.end [N]"] == [2.0, 3.0, None, None]
    assert read["key"] == [None] * 4
    empty = table_of(["p"], [(1.0,)], {1: row(1, {"a.b": 1.0})})
    write_table(tmp_path, empty)
    schema = parquet.read_schema(tmp_path / PARQUET)
    assert [str(schema.field(name).type) for name in ("p", "reason", "notes", "key")] == ["double", *["string"] * 3]


def test_an_earlier_parquet_file_does_not_stay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / PARQUET).write_text("of another study")
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert write_table(tmp_path, Table(("design",), ((1,),))) == ["study.csv"]
    assert not (tmp_path / PARQUET).exists()


def drawn(tmp_path: Path, designs: list[tuple[Any, ...]], found: dict[int, Row]) -> bool:
    return picture.draw(tmp_path / "study.png", "scene", ["a.x", "b.some.kind"][: len(designs[0])], (designs, found))


def test_pictures_of_odd_studies(tmp_path: Path) -> None:
    peaks = {number: row(number, {"a.force_peak": 1.0 + number}, errors=ERRORS) for number in range(1, 7)}
    assert drawn(tmp_path, [(10.0**n, ("x", "y")[n % 2]) for n in range(6)], peaks)
    assert drawn(tmp_path, [(True,), (False,), ("unset",)], dict([*peaks.items()][:3]))
    assert drawn(
        tmp_path, [(0,), (-1,), (5,), (7,)], {1: peaks[1], 2: Row(2, FAILED, "x"), 3: peaks[3], 4: Row(4, "ENERGY")}
    )
    assert (tmp_path / "study.png").is_file()
    # Nothing varies, or nothing finished: no picture, nor one of before.
    assert not drawn(tmp_path, [(1,), (1,)], {1: peaks[1], 2: peaks[2]})
    assert not (tmp_path / "study.png").exists()
    assert not drawn(tmp_path, [(1,), (2,)], {1: Row(1, FAILED), 2: Row(2, FAILED)})
    assert not drawn(tmp_path, [(1,), (2,)], {1: row(1, {"a.b": 0.0}), 2: row(2, {"a.b": 0.0})})


@pytest.mark.parametrize(
    ("windows", "text"),
    [((5.6e-5, 5.6e-5), "mean over 56 µs, twice"), ((5e-5, 6e-5), "mean over 50 to 60 µs, twice"), ((0.0, 0.0), ""),
     ((), "")],
)  # fmt: skip
def test_a_force_that_is_a_mean_says_over_which_time(windows: tuple[float, ...], text: str) -> None:
    """As the pictures of a run; of designs without result nothing counts, since they are not drawn."""
    values = {"a.impact2.force_peak": 1.0, "a.force_peak_raw": 2.0, "a.peak_time": 1e-3}
    found = {number: row(number, values) for number in (1, 2)}
    for number, window in enumerate(windows, 1):
        found[number].quantities["a.force_window"] = {"value": window, "unit": "s"}
    found[3] = replace(row(3, values | {"a.force_window": 1.0}), result="ENERGY")
    assert picture._window("a.impact2.force_peak", found) == text
    assert picture._window("a.force_peak_raw", found) == picture._window("a.peak_time", found) == ""


@pytest.mark.parametrize(
    ("values", "scale"),
    [([1e-4, 1e-4 * 10**0.5, 1e-3], "log"), ([1.0, 2.0, 4.0, 8.0, 16.0], "log"), ([1.0, 2.0, 3.0], "linear"),
     ([1.0, 2.0], "linear"), ([-1.0, 1.0, 2.0], "linear"), ([1.0, 2.0, 3.9], "linear")],
)  # fmt: skip
def test_values_at_equal_ratios_have_a_logarithmic_axis(values: list[float], scale: str) -> None:
    axes = Figure().add_subplot()
    picture._abscissa(axes, values, 5)
    assert axes.get_xscale() == scale
    labels = [one.get_text() for one in axes.get_xticklabels()]
    assert scale == "linear" or labels == [f"{one:.3g}" for one in values]
