"""The list of reports, and the table of the README: nothing stands in them but what reports hold."""

import json
import re
import tomllib
from pathlib import Path

import pytest

from docs.tools.report_listing import (
    REPORTS,
    STANDS_FOR,
    Scenes,
    costs_lines,
    listing_text,
    main_figures,
    scene_names,
    scenes_text,
)
from docs.tools.seeds import read_seeds, seeds_table
from gudgeon.pipeline.report.document import Budget, Choice, Document, Term
from tests.pipeline.documents import document, quantity, run

ROOT = Path(__file__).resolve().parents[3]
SEEDS = tomllib.loads("""
tolerance = 0.01
[[system]]
name = "One"
report = "one"
[[system]]
name = "Two"
report = "two"
[[system]]
name = "Three"
report = "three"
[[system]]
name = "Four"
""")


def nodal(step: int, error: float | None, seconds: float) -> Document:
    """Return a report of three reduced runs and two nodal ones."""
    return document(
        [
            run("cheap and wrong", 0.3, 0.001),
            run("cheap", -0.008, 0.01),
            run("dear", 1e-5, 0.2),
            run("nodal, coarse", 0.04, 1.0, kind="nodal"),
            run(f"nodal, {step} µs", error, seconds, kind="nodal"),
        ],
        [quantity("impulse")],
        choice=Choice(0.01, "cheap", {}, 0.008, "impulse", 0.01, "the cheapest"),
        budget=Budget("cheap", [Term("basis", "", {}, {}, 2e-3), Term("mesh", "", {}, {}, 7e-3), Term("step", "none")]),
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    missed = document([run("best", 0.05, 0.5), run("worse", 0.4, 0.1)], [quantity("impulse")])
    for name, one in (("one", nodal(1, 0.002, 4.0)), ("two", missed)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "report.json").write_text(one.as_text(), encoding="utf-8")
    (tmp_path / "one" / "robustness.json").write_text(
        '{"counts": {"right": 2, "refused": 1, "wrong": 0, "does not apply": 4}}'
    )
    (tmp_path / "seconds.csv").write_text("one,report,30\none,robustness,12\ntwo,report,18\n")
    return tmp_path


def test_table_of_systems(folder: Path) -> None:
    lines = seeds_table(main_figures(folder), SEEDS, "there/").splitlines()
    start = "| One | [`one`](there/data/one/scene.toml) | d'Alembert's solution |"
    # The cheapest runs that meet the tolerance, not the best ones: 4 s over 10 ms.
    budget = "mesh 0.70% > basis 0.20%"
    assert lines[2] == f"{start} cheap | 0.80% | impulse | {budget} | 0.01 s | nodal, 1 µs | 0.20% | 4 s | 400 |"
    assert "| best | 5.00% (missed) | impulse | – | 0.5 s | – | – | – | – |" in lines[3]
    assert lines[4].startswith("| Three | `three` | no report yet |")
    assert lines[5].startswith("| Four | no scene yet |")
    assert len({line.count("|") for line in lines}) == 1


def test_nodal_reference_has_no_error_of_its_own(folder: Path) -> None:
    (folder / "one" / "report.json").write_text(nodal(1, None, 4.0).as_text(), encoding="utf-8")
    assert "| nodal, 1 µs | reference | 4 s | 400 |" in seeds_table(main_figures(folder), SEEDS)


def test_list_of_reports(folder: Path) -> None:
    text = listing_text(main_figures(folder), SEEDS)
    assert "written by `make reports` in 1 min on a processor, 2 cores." in text
    one, two = (f"| [`{name}`](../../data/{name}/scene.toml) | d'Alembert's solution |" for name in ("one", "two"))
    assert f"{one} cheap | 8.0e-03 | mesh 0.70% > basis 0.20% | 0.01 s | 1 – 4 s | 2 | 1 | 0 | 42 s |" in text
    assert two in text
    assert "| Two |" in text
    assert "\nRobustness cases of all scenes: 3, 2 right, 1 refused, 0 wrong.\n" in text


def test_main_figures_are_those_of_the_reports(folder: Path) -> None:
    """They come back from their file; what is kept of a run is what its report says."""
    scenes = main_figures(folder)
    assert json.loads(scenes_text(scenes)) == scenes
    report = json.loads((folder / "one" / "report.json").read_text(encoding="utf-8"))
    for kept, told in zip(scenes["one"]["runs"], report["runs"], strict=True):
        assert kept == {key: told[key] for key in kept}
        assert {"name", "largest_error", "cpu_seconds", "front"} < kept.keys()
    assert scenes["one"]["robustness"]["right"] == 2
    assert scenes["one"]["seconds"] == {"report": 30.0, "robustness": 12.0}


@pytest.fixture(scope="module")
def scenes() -> Scenes:
    return json.loads((REPORTS / "report.json").read_text(encoding="utf-8"))


def readme_rows() -> dict[str, list[str]]:
    """Return the cells of the README's table of methods, by the words before a colon of their first cell."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    lines = re.search(r"^\| method \|.*\n\|[-|]+\|\n((?:\|.*\n)+)", text, re.MULTILINE)
    assert lines is not None
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[1].splitlines()]
    return {row[0].partition(":")[0]: row for row in rows}


def benchmark_rows() -> dict[str, list[str]]:
    """Return the cells of all tables of the benchmarks by their first one, which no other row has."""
    text = (ROOT / "docs/benchmarks.md").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("|")]
    return {row[0]: row[1:] for row in rows}


PISTON = {
    "gudgeon, time integration alone": "150 normal modes, R: time integration",
    "gudgeon, the same run with its quantities": "the same run with its quantities",
    "gudgeon, default": "default run, `gudgeon solve`",
    "reduction with a penalty spring": "30 normal modes, all static shapes, penalty: time integration",
    "full FE": "full FE, 4 µs",
}
"""Rows of docs/benchmarks.md by those of README."""
RODS = {
    "gudgeon, time integration alone": "46 Ritz vectors, R and dashpot: time integration",
    "gudgeon, the same run with its quantities": "the same run of the rods with its quantities",
    "gudgeon, default": "default run of the rods",
    "Exudyn 1.13.6, small motion, best spring": "Exudyn, small motion, best spring, 5 µs",
    "Exudyn 1.13.6, floating frame, best spring": "Exudyn, floating frame, our shapes, best spring, 5 µs",
    "full FE": "full FE of the rods, 5 µs",
}


def test_the_readme_has_the_figures_of_the_benchmarks() -> None:
    """Error and CPU time of each method in the table of README are those of a row of docs/benchmarks.md."""
    rows, measured = readme_rows(), benchmark_rows()
    assert rows.keys() == PISTON.keys() | RODS.keys()
    for name, label in PISTON.items():
        _, seconds, error = measured[label][:3]
        assert rows[name][1:3] == [error, seconds], name
    for name, label in RODS.items():
        _, seconds, error = measured[label][:3]
        assert rows[name][3:5] == [error, seconds], name


def test_every_scene_is_listed(scenes: Scenes) -> None:
    """Also one without a report; those that `make reports` leaves out name the scene that stands for them."""
    assert list(scenes) == scene_names()
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    (left_out,) = re.findall(r"^SCENES := \$\(filter-out (.*?),", makefile, re.MULTILINE)
    names = (re.sub(r"^data/|(/scene)?\.toml$", "", path) for path in left_out.split())
    assert {*names} == {*STANDS_FOR}
    text = listing_text(scenes, read_seeds())
    for name in scenes:
        assert f"\n| [`{name}`](" in text, name
    row = "| – | – | – | – | – | – | – | – | – |"
    assert f"| [`piston`](../../data/piston/scene.toml) | see `piston/stroke` {row}\n" in text
    lines = listing_text({"new": {}}, SEEDS).splitlines()
    assert f"| [`new`](../../data/new/scene.toml) | no report yet {row}" in lines


def test_list_is_that_of_the_main_figures(scenes: Scenes) -> None:
    assert listing_text(scenes, read_seeds()) == (REPORTS / "README.md").read_text(encoding="utf-8")


def test_costs_are_listed_beside_full_fe_and_the_fastest_rival() -> None:
    times = {"integration": 0.2, "database": 0.25, "first": 25.0, "ten": 27.0, "hundred": 50.0}
    own = {"tolerance": 0.01, "method": "reduced", "run": "70 normal, R", "error": 8e-3, **times}
    full = own | {"method": "nodal", "run": "full FE, 5.2 µs (interpolated)", **{key: 100.0 for key in times}}
    slow, fast = (own | {"method": "rival", "integration": value} for value in (3.0, 2.0))
    lacking = own | {"method": "rival", "integration": None}
    lines = costs_lines({"piston/stroke": {"costs": [own, full, slow, fast, lacking]}, "rigid": {}})
    assert len(lines) == 3
    cells = [cell.strip() for cell in lines[2].split("|")[1:-1]]
    assert cells[1:4] == ["≤ 1.0%", "70 normal, R", "full FE, 5.2 µs (interpolated)"]
    assert cells[4:7] == ["0.2 s (× 500; rival × 10)", "0.25 s (× 400; rival × 1)", "25 s (× 4; rival × 1)"]
    unmet = own | dict.fromkeys(times) | {"run": "none meets 1%"}
    assert costs_lines({"skirt": {"costs": [unmet, full]}})[2].endswith("| – | – | – | – | – |")
