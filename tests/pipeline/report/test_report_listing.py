"""The list of reports, and the table of the README: nothing stands in them but what reports hold."""

import json
import tomllib
from pathlib import Path

import pytest

from docs.tools.report_listing import (
    REPORTS,
    Scenes,
    costs_lines,
    listing_text,
    main_figures,
    scenes_text,
    with_table,
)
from docs.tools.seeds import read_seeds, seeds_table, short_table
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


def test_short_table_has_the_systems_with_a_report(folder: Path) -> None:
    lines = short_table(main_figures(folder), SEEDS).splitlines()
    assert lines[0] == "| system | scene | error | of the mesh | CPU time | full FE | ratio | ratio of first runs |"
    assert lines[2] == "| One | [`one`](data/one/scene.toml) | 0.80% | 0.70% | 0.01 s | 4 s | 400 | – |"
    assert [line.split(" | ")[0] for line in lines[2:]] == ["| One", "| Two"]


def test_short_table_takes_the_costs_at_the_tolerance(folder: Path) -> None:
    scenes = main_figures(folder)
    own = {"tolerance": 0.01, "method": "reduced", "run": "a", "error": 5e-3, "integration": 0.2, "first": 10.0}
    scenes["one"]["costs"] = [own, own | {"method": "nodal", "run": "b", "integration": 50.0, "first": 51.0}]
    scenes["one"]["budget"] = {"run": "a", "terms": {"mesh": 0.002}}
    line = short_table(scenes, SEEDS).splitlines()[2]
    assert line == "| One | [`one`](data/one/scene.toml) | 0.50% | 0.20% | 0.2 s | 50 s | 250 | 5.1 |"


def test_nodal_reference_has_no_error_of_its_own(folder: Path) -> None:
    (folder / "one" / "report.json").write_text(nodal(1, None, 4.0).as_text(), encoding="utf-8")
    assert "| nodal, 1 µs | reference | 4 s | 400 |" in seeds_table(main_figures(folder), SEEDS)


def test_list_of_reports(folder: Path) -> None:
    text = listing_text(main_figures(folder), SEEDS)
    assert "written by `make reports`, which took 1 min on a processor, 2 cores." in text
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


def test_table_in_a_text_is_replaced() -> None:
    text = "before\n\n| system | a |\n|---|---|\n| x | y |\n\nafter | b |\n"
    assert with_table(text, "| system | new |\n|---|---|") == ("before\n\n| system | new |\n|---|---|\n\nafter | b |\n")


@pytest.fixture(scope="module")
def scenes() -> Scenes:
    return json.loads((REPORTS / "report.json").read_text(encoding="utf-8"))


def test_the_list_begins_with_the_short_table(scenes: Scenes) -> None:
    assert short_table(scenes, read_seeds())


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
