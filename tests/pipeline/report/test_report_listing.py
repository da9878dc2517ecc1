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


def test_the_readme_has_the_figures_of_the_pistons_report(scenes: Scenes) -> None:
    """Error and CPU time at 1 % of the setting, the fastest rival and full FE, to the digits that are written."""
    scene, rows = scenes["piston/stroke"], readme_rows()
    costs = [one for one in scene["costs"] if one["tolerance"] == 0.01 and one["integration"] is not None]
    best = {
        name: min((one for one in costs if one["method"] == method), key=lambda one: one["integration"])
        for name, method in {"gudgeon": "reduced", "best rival reduction": "rival", "full FE": "nodal"}.items()
    }
    for name, cost in best.items():
        _, error, seconds, *_ = rows[name]
        assert error == f"{100 * cost['error']:.2g} %", name
        assert seconds == f"{cost['integration']:.3g} s", name
    assert rows["best rival reduction"][0] == "best rival reduction: 30 normal modes and all static vectors, penalty"
    assert best["best rival reduction"]["run"].startswith("30 normal + all static, penalty")
    text = (ROOT / "README.md").read_text(encoding="utf-8").replace("\n", " ")
    gain = best["full FE"]["first"] / best["gudgeon"]["first"]
    assert f"The first run with mesh and modes is {gain:.2g} times faster than full FE" in text
    assert f"{100 * scene['budget']['terms']['mesh']:.1f} % to one force peak" in text


def test_the_readme_has_the_figures_of_the_benchmarks() -> None:
    """Rows of the table of rods: our method, it with Exudyn's spring, the best rival, full FE, Exudyn's best spring."""
    rows, text = readme_rows(), (ROOT / "docs/benchmarks.md").read_text(encoding="utf-8")
    lines = {"gudgeon": "gudgeon, 46 Ritz vectors, R and dashpot",
             "gudgeon with Exudyn's spring": "gudgeon, the same shapes, Exudyn's best spring",
             "best rival reduction": "Exudyn, its 46 lowest modes, best spring",
             "full FE": "full FE, longest step tried",
             "Exudyn 1.13.6, best spring": "Exudyn, our shapes, best spring"}  # fmt: skip
    for name, label in lines.items():
        (line,) = re.findall(rf"^\| {label} \|(.*)\|$", text, re.MULTILINE)
        _, _, seconds, error, _ = (cell.strip() for cell in line.split("|"))
        assert float(rows[name][4].removesuffix(" s")) == float(seconds.removesuffix(" s")), name
        assert rows[name][3].replace(" %", "%") == error, name
    (default,) = re.findall(
        r"^\| the same, with estimated errors, as by default \|(?:[^|]*\|){2} (\S+) s", text, re.MULTILINE
    )
    assert f"For the rods it takes {float(default):.2g} s per ms" in (ROOT / "README.md").read_text("utf-8").replace(
        "\n", " "
    )


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
