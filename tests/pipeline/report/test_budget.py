"""The error budget: extrapolation of known errors, terms of a small scene, and what it does to a tolerance."""

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import meshio
import pytest

from gudgeon.pipeline.cli import main
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.report.bodies import report_job
from gudgeon.pipeline.report.choice import choose, doubtful, in_its_basis, judged, on_its_mesh
from gudgeon.pipeline.report.convergence import Neighbour, extrapolated
from gudgeon.pipeline.report.document import MISSING, Budget, Chain, Choice, Document, Term, csv_text
from gudgeon.pipeline.report.effort import Effort
from gudgeon.pipeline.report.page.page import page
from gudgeon.pipeline.report.page.words import budget_table, budget_text
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job
from tests.pipeline import documents
from tests.pipeline.small import write_scene

ONCE = Effort(repeat=1)
SOURCES = ["basis", "step", "mesh", "spline spacing", "contact layer"]


def silent(stage: str, share: float) -> None:
    """Tell nobody."""


# Extrapolation


def values(order: float, error: float, finer: float, coarser: float) -> tuple[Neighbour, Neighbour]:
    """Return the neighbours of a run of size 1 whose value is 1, with an exact value of 1 − error."""
    exact = 1 - error
    return tuple(Neighbour(h, exact + error * h**order - 1) for h in (finer, coarser))  # type: ignore[return-value]


@pytest.mark.parametrize("order", [0.7, 1.0, 2.0, 4.0])
@pytest.mark.parametrize("error", [0.03, -1e-4])
@pytest.mark.parametrize("sizes", [(1 / 1.5, 1.5), (0.7, 1.9)])
def test_order_and_error_are_found(order: float, error: float, sizes: tuple[float, float]) -> None:
    found = extrapolated(*values(order, error, *sizes))
    assert found.error == pytest.approx(abs(error), rel=1e-6)
    assert found.order == pytest.approx(order, rel=1e-6)


def test_norms_have_no_sign() -> None:
    finer, coarser = values(2.0, 0.03, 1 / 1.5, 1.5)
    norms = [Neighbour(one.size, abs(one.difference)) for one in (finer, coarser)]
    assert extrapolated(*norms, signed=False) == extrapolated(finer, coarser)
    assert extrapolated(*norms).order is None


def test_large_norms_are_not_extrapolated() -> None:
    """Resonances that leave each other differ by 1.4 in norm however far they are apart: there is no order in that."""
    assert extrapolated(Neighbour(0.8, 1.39), Neighbour(1.28, 1.41), signed=False) == (1.41, None)


def test_values_that_are_not_monotone_have_no_order() -> None:
    found = extrapolated(Neighbour(1 / 1.5, 0.01), Neighbour(1.5, 0.04))
    assert found == (0.04, None)


def test_an_order_below_one_half_is_taken_as_one_half() -> None:
    finer, coarser = values(0.2, 0.1, 1 / 1.5, 1.5)
    found = extrapolated(finer, coarser)
    assert found.order is None
    assert found.error == pytest.approx(abs(finer.difference) / (1 - 1.5**-0.5), rel=1e-9)


def test_one_neighbour_takes_order_one() -> None:
    finer, coarser = values(1.0, 0.02, 1 / 1.5, 1.5)
    assert extrapolated(finer, None).error == pytest.approx(0.02, rel=1e-9)
    assert extrapolated(None, coarser).error == pytest.approx(0.02, rel=1e-9)
    with pytest.raises(ValueError, match="no run of another size"):
        extrapolated(None, None)


def test_a_missing_value_is_an_infinite_error() -> None:
    assert extrapolated(Neighbour(0.7, math.inf), Neighbour(1.5, 0.1)) == (math.inf, None)
    assert extrapolated(Neighbour(0.7, 0.0), Neighbour(1.5, 0.0)) == (0.0, None)


# A report


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Job, Document]:
    """Report of the small skirt on three bases: elements of 14 mm, layer of 1e14 N/m³."""
    folder = tmp_path_factory.mktemp("budget")
    scene = write_scene(folder / "scene") / "scene.toml"
    scene.write_text(scene.read_text() + '[report.sweep]\n"component.skirt.modes.normal_count" = [4, 8, 12]\n')
    job = open_job(scene, db=folder / "db", out=folder / "out")
    return folder, job, report_job(job, ONCE, silent)


def term(document: Document, source: str) -> Term:
    assert document.budget is not None
    found = document.budget.term(source)
    assert found is not None
    return found


def test_terms(made: tuple[Path, Job, Document]) -> None:
    """The coarse mesh dominates; a bore without a traction space has no splines."""
    document = made[2]
    assert document.budget is not None
    assert [one.source for one in document.budget.terms] == SOURCES
    assert term(document, "spline spacing").how == "none: no traction space"
    assert term(document, "mesh").how.startswith("edges / 1.5 (mean edge × 0.")
    sizes = {one.source: one.size for one in document.budget.terms if one.size is not None}
    assert max(sizes, key=lambda source: sizes[source]) == "mesh"
    assert sizes["mesh"] > 0.05
    assert 0 < sizes["step"] < 0.02
    assert sizes["contact layer"] > 1e-3
    assert "bore.impulse" in term(document, "contact layer").errors


def test_the_basis_is_halved_and_doubled(made: tuple[Path, Job, Document], tmp_path: Path) -> None:
    """A basis that is little larger lacks nearly the same: 8 against 12 modes showed a fraction of the error."""
    folder, _, document = made
    assert document.budget is not None
    found = term(document, "basis")
    settings = next(run.settings for run in document.runs if run.name == document.budget.run)
    own = settings["component"]["skirt"]["modes"]["normal_count"]
    assert "half as many" in found.how
    window = settings["run"]["window"]
    values = {}
    for count in (own, 2 * own, 48):
        changes = [f"{path}={json.dumps(value)}" for path, value in flat(settings)]
        changes += [f"component.skirt.modes.normal_count={count}", f"run.window={window}"]
        job = open_job(folder / "scene" / "scene.toml", set=changes, db=folder / "db", out=tmp_path / str(count))
        run_job(job, "solve")
        values[count] = job.store.get(job.trajectory().key, "trajectory").quantities["bore.impulse"]["value"]
    true = abs(values[own] / values[48] - 1)
    assert found.errors["bore.impulse"] > 0.5 * true
    assert found.errors["bore.impulse"] >= abs(values[2 * own] / values[own] - 1)


def test_layer_is_the_larger_of_half_and_double(made: tuple[Path, Job, Document]) -> None:
    folder, _, document = made
    assert document.budget is not None
    settings = next(run.settings for run in document.runs if run.name == document.budget.run)
    values = {}
    changes = [f"{path}={json.dumps(value)}" for path, value in flat(settings)]
    scene = folder / "scene" / "scene.toml"
    window = system_of(open_job(scene, set=changes, db=folder / "db")).separation
    for factor in (0.5, 1.0, 2.0):
        varied = [] if factor == 1.0 else [f"contact.bore.surface_stiffness={factor * 1e14}", f"run.window={window}"]
        job = open_job(scene, set=[*changes, *varied], db=folder / "db")
        assert job.store.has(job.trajectory().key)
        values[factor] = job.store.get(job.trajectory().key, "trajectory").quantities["bore.impulse"]["value"]
    expected = max(abs(values[factor] / values[1.0] - 1) for factor in (0.5, 2.0))
    assert term(document, "contact layer").errors["bore.impulse"] == pytest.approx(expected, rel=1e-9)


def flat(tables: dict[str, Any], before: str = "") -> list[tuple[str, Any]]:
    """Return the dotted path of each value in nested tables."""
    found: list[tuple[str, Any]] = []
    for key, value in tables.items():
        found += flat(value, f"{before}{key}.") if isinstance(value, dict) else [(f"{before}{key}", value)]
    return found


def test_the_budget_is_in_every_file(made: tuple[Path, Job, Document]) -> None:
    folder, _, document = made
    text = budget_text(document)
    assert text.startswith("Error budget of ")
    assert f"mesh {term(document, 'mesh').size:.2%} ({term(document, 'mesh').of}) > " in text
    assert json.loads((folder / "out" / "report.json").read_text())["budget"] == document.as_json()["budget"]
    html = (folder / "out" / "report.html").read_text()
    assert html.index('<p class="budget">Error budget of') < html.index('<dl class="facts">')
    table = budget_table(document)
    assert table is not None
    assert table.columns == ["quantity", "basis", "step", "mesh", "contact layer", "counts"]
    assert table.title in html
    assert "budget mesh: bore.impulse" in csv_text(document).splitlines()[0]


def test_settings_have_the_step_of_the_first_run(made: tuple[Path, Job, Document]) -> None:
    """It is found once, by the accuracy of the run, and no run of the sweep makes estimates of its own."""
    _, _, document = made
    runs = [run.settings["run"] for run in document.runs]
    assert all(run == runs[0] for run in runs)
    assert runs[0].keys() == {"checks", "step", "window"}
    assert not runs[0]["checks"]
    assert document.runs[0].step == pytest.approx(runs[0]["step"])


# Tolerance


def mesh_of(size: float | None, how: str = "edges / 1.5 and edges × 1.5") -> Budget:
    return Budget(
        "30 modes", [Term("mesh", how, {"impulse": size} if size else {}, {}, size, "impulse" if size else None)]
    )


def selected() -> Choice:
    return choose(documents.small().runs, 0.01)


def test_a_mesh_error_above_the_tolerance_refuses() -> None:
    runs, choice = documents.small().runs, selected()
    assert choice.run == "30 modes"
    assert on_its_mesh(choice, runs, mesh_of(0.009), same_mesh=False) == choice
    assert on_its_mesh(choice, runs, mesh_of(0.031), same_mesh=True) == choice
    refused = on_its_mesh(choice, runs, mesh_of(0.031), same_mesh=False)
    assert refused.run is None
    assert refused.why == (
        "30 modes meets 1% on its mesh, but its mesh error is 3.10% (impulse): refine component.*.mesh.size, or"
        " give --same-mesh"
    )


def test_a_basis_error_above_the_tolerance_refuses_what_is_compared_with_the_finest() -> None:
    """The finest setting lacks what all lack; an exact answer does not."""
    runs, choice = documents.small().runs, selected()

    def basis_of(size: float, run: str = "30 modes") -> Budget:
        return Budget(run, [Term("basis", "against twice as many modes", {"impulse": size}, {}, size, "impulse")])

    assert in_its_basis(choice, runs, basis_of(0.009), "finest") == choice
    assert in_its_basis(choice, runs, basis_of(0.9), "analytic") == choice
    refused = in_its_basis(choice, runs, basis_of(0.9), "finest")
    assert refused.run is None
    assert refused.why == (
        "30 modes meets 1% against the finest setting, but the basis error of 30 modes is 90.00% (impulse): increase"
        " component.*.modes.normal_count, or fixed_count, or name the quantities that count in report.interest"
    )
    assert in_its_basis(choice, runs, basis_of(0.9, "60 modes"), "finest").run is None
    larger = replace(choice, run="60 modes")
    assert in_its_basis(larger, runs, basis_of(0.9), "finest") == larger


def test_an_infinite_mesh_error_refuses_also_when_it_is_read_back() -> None:
    """Where another mesh lacks an impact; JSON has no infinity."""
    runs, choice = documents.small().runs, selected()
    infinite = Budget("30 modes", [Term("mesh", "edges / 1.5", {"a": math.inf}, {}, math.inf, "a")])
    document = replace(documents.small(), budget=infinite)
    for budget in (infinite, Document.from_json(document.as_json()).budget):
        refused = on_its_mesh(choice, runs, budget, same_mesh=False)
        assert refused.run is None
        assert "its mesh error is infinite (a)" in refused.why
    assert budget_text(document) == "Error budget of 30 modes: mesh infinite (a)"


def test_a_chain_without_a_value_is_doubtful_also_when_it_is_read_back() -> None:
    chain = Chain("basis", ["30 modes", "60 modes"], [30, 60], [math.inf, 0.0], [math.inf, 0.0], False, None)
    document = replace(documents.small(), quantities=[documents.quantity("a", chains=[chain])])
    for one in (document, Document.from_json(document.as_json())):
        assert doubtful(one.quantities, 0.01) == {"30 modes", "60 modes"}


def test_a_mesh_error_that_is_not_known_is_said() -> None:
    found = on_its_mesh(selected(), documents.small().runs, mesh_of(None, f"{MISSING}: a mesh file"), same_mesh=False)
    assert found.run == "30 modes"
    assert found.why.endswith("; mesh error: not estimated: a mesh file")
    rigid = on_its_mesh(selected(), documents.small().runs, mesh_of(None, "none: no body has a mesh"), same_mesh=False)
    assert rigid == selected()


def test_a_budget_of_another_mesh_does_not_speak_for_a_setting() -> None:
    runs = documents.small().runs
    other = {"component": {"rod": {"mesh": {"size": 0.01}}}}
    changed = [replace(runs[0], settings=other), *runs[1:]]
    refused = on_its_mesh(choose(changed, 0.01), changed, Budget("60 modes", mesh_of(0.001).terms), same_mesh=False)
    assert refused.run is None
    assert "is that of 60 modes, on another mesh" in refused.why


def test_the_budget_is_that_of_the_nearest_run_where_none_is_chosen() -> None:
    runs = documents.small().runs
    best = judged(runs, choose(runs, 1e-9))
    assert best is not None
    assert best.name == "60 modes"


def test_command_refuses_a_coarse_mesh(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The impulse of a rod of elements of 40 mm happens to be right to 0.3 %; other elements move it by more."""
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    changes = [
        "--set", 'report.models="unset"', "--set", 'report.interest=["wall.impulse"]',
        "--set", 'report.full_fe="unset"', "--set", "component.rod.mesh.size=0.04",
        "--set", "component.rod.modes.normal_count=10",
        "--set", 'report.sweep={"component.rod.modes.normal_count" = [20]}',
    ]  # fmt: skip
    tolerance = ["--tolerance", "1%"]
    assert main(["report", "data/rod-wall", *places, *changes, "--repeat", "1", *tolerance]) == 0
    document = json.loads((tmp_path / "out" / "report.json").read_text())
    assert "--same-mesh" in document["choice"]["why"]
    assert document["choice"]["run"] is None
    assert main(["solve", "data/rod-wall", *places, *changes, *tolerance]) == 2
    assert "refine component.*.mesh.size, or give --same-mesh" in capsys.readouterr().err
    assert main(["solve", "data/rod-wall", *places, *changes, *tolerance, "--same-mesh"]) == 0


def test_page_without_a_budget() -> None:
    assert budget_text(documents.small()) == ""
    assert 'class="budget"' not in page(documents.small())


BLOCK = """
[component.block]
geometry.kind = "file"
geometry.unit = 1.0
geometry.path = "block.msh"
geometry.surfaces.foot = { kind = "plane", normal = [0.0, 0.0, -1.0], origin = [0.0, 0.0, 0.0] }
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
interface.foot = { surface = "foot" }
modes = { normal_count = 6 }

[body.block]
velocity = [0.0, 0.0, -0.5]
position = [0.0, 0.0, 2e-5]

[contact.floor]
body = "block"
interface = "foot"
against = { shape = "plane", point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }
surface_stiffness = 1e12

[run]
duration = 1e-4
samples = 200
frames = 10

[report.models]
"as in the scene" = {}
"""


def test_a_mesh_file_has_no_other_mesh(tmp_path: Path) -> None:
    """Its term says so, and a setting is chosen with that statement."""
    mesh = Box(kind="box", lx=0.04, ly=0.02, lz=0.02).build(0.02)
    meshio.Mesh(mesh.nodes, [("tetra10", mesh.cells)]).write(tmp_path / "block.msh", file_format="gmsh22", binary=False)
    (tmp_path / "scene.toml").write_text(BLOCK)
    job = open_job(tmp_path, db=tmp_path / "db", out=tmp_path / "out")
    document = report_job(job, replace(ONCE, tolerance=0.5), silent)
    assert term(document, "mesh").how == "not estimated: component.block is a mesh file, which has no other size"
    assert "; mesh not estimated: component.block is a mesh file" in budget_text(document)
    assert document.choice is not None
    assert document.choice.why.endswith(f"; mesh error: {term(document, 'mesh').how}")


def test_a_run_without_a_quantity_is_no_choice() -> None:
    """The energy drift alone says nothing of a setting."""
    runs = [replace(run, errors={"energy drift": 1e-15}, conservative_error=1e-15) for run in documents.small().runs]
    found = choose(runs, 0.01)
    assert found.run is None
    assert found.why == "nothing is compared but the energy drift: name quantities in report.interest"
