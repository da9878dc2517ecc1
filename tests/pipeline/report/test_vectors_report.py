"""`gudgeon report` of a force that moves: full-FE dofs against vectors, which vectors win, and what others cost."""

import csv
import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy import linalg

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.linalg import counter
from gudgeon.pipeline.modes.normal import NormalModes, normal_modes
from gudgeon.pipeline.nodal.scene.problem import nodal_problem
from gudgeon.pipeline.reduction.methods.reduction import lowest
from gudgeon.pipeline.reduction.methods.ritz_vectors import RitzVectors
from gudgeon.pipeline.report.bodies import report_scene
from gudgeon.pipeline.report.effort import Effort
from gudgeon.pipeline.report.page.output import report_text
from gudgeon.pipeline.report.vectors import report as report_module
from gudgeon.pipeline.report.vectors.bases import OF_ALL, price_table
from gudgeon.pipeline.report.vectors.problem import Problem, problem_of
from gudgeon.pipeline.report.vectors.report import ROOT, UNDER, Comparison, compare
from gudgeon.pipeline.report.vectors.travelling import Root, Travel, difference, nodal_history, reduced_history
from gudgeon.pipeline.stages.run import run_job
from tests.pipeline.small import write_scene

SCENE = """
[component.beam]
geometry = { kind = "box", lx = 0.2, ly = 0.03, lz = 0.04 }
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
mesh = { size = 0.02 }
supports = ["left"]
interface.top = { surface = "top", kind = "traction", spacing = [0.03, 0.02], along = [1.0, 0.0, 0.0] }
modes = { reduction = "ritz", normal_count = 24 }

[body.beam]

[force.load]
kind = "moving"
body = "beam"
interface = "top"
force = 1e4
at = [0.0, -0.1]
speed = 50.0
rise = 3e-4

[run]
duration = 0.0036
frames = 400

[report.vectors]
force = "load"
counts = [2, 8]
places = 8
steps = 800
root = 0.03
"""
SKIRT = """
[component.skirt.interface.bore]
surface = "skirt"
kind = "traction"
sector_deg = [-20.0, 20.0]
height = [0.01, 0.03]
spacing = 0.01

[force.tool]
kind = "moving"
body = "skirt"
interface = "bore"
force = 10.0
at = [0.0, 0.02]
"""
COUNTS, STEPS = (2, 8), (400, 800, 1600, 3200, 6400)


def silent(stage: str, share: float) -> None:
    """Tell nobody."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("vectors")
    (path / "scene.toml").write_text(SCENE)
    return path


@pytest.fixture(scope="module")
def problem(folder: Path) -> Problem:
    job = open_job(folder, db=folder / "db", out=folder / "out")
    run_job(job, "mesh")
    return problem_of(job)


@pytest.fixture(scope="module")
def way(problem: Problem) -> tuple[Travel, Root]:
    mesh = problem.job.store.get(problem.job.components()["beam"]["mesh"].key, "mesh")
    return problem.travel(mesh), problem.root(mesh)


@pytest.fixture(scope="module")
def everything(way: tuple[Travel, Root]) -> NormalModes:
    """All modes that the mesh has."""
    model = way[0].model
    K, M = model.free_matrices()
    values, vectors = linalg.eigh(K.toarray(), M.toarray())
    Phi = np.zeros((model.K.shape[0], len(values)))
    Phi[model.free] = vectors
    return NormalModes(np.sqrt(values), Phi, {})


@pytest.fixture(scope="module")
def compared(folder: Path) -> Comparison:
    return compare(open_job(folder, db=folder / "db", out=folder / "out"), 3, silent)


def errors(compared: Comparison, basis: str, count: int) -> tuple[float, float]:
    """Return the errors under the force and at the root."""
    found = compared.errors(basis, count)
    assert found is not None
    return found[UNDER], found[ROOT]


def suddenly(travel: Travel) -> Travel:
    """Return the force as it stands at the end of its way, applied suddenly."""
    place, full = travel.path(np.array([travel.duration])), travel.size(np.array([travel.duration]))
    return replace(
        travel,
        path=lambda time: np.repeat(place, len(time), axis=0),
        size=lambda time: np.repeat(full, len(time)),
    )


@pytest.mark.parametrize("standing", [False, True])
def test_all_modes_are_all_nodal_dofs(way: tuple[Travel, Root], everything: NormalModes, standing: bool) -> None:
    """Two ways to the same answer, one by modes and one by a factorised step; changes of vectors change nothing."""
    travel, root = way
    travel = suddenly(travel) if standing else travel
    nodal = nodal_history(travel, root, 320, 160)
    turned = NormalModes(everything.angular_frequencies, -everything.Phi, {})
    ours = reduced_history(travel, root, [everything, turned, everything, everything], 320, 160)
    assert difference(ours.under, nodal.under) < 1e-9
    assert root.difference(ours.root, nodal.root) < 1e-9


def test_nodal_reference_is_second_order(way: tuple[Travel, Root]) -> None:
    """By the displacement under the force at common times; the root's stress holds modes that no step resolves."""
    travel, root = way
    runs = [nodal_history(travel, root, steps, 80).under[steps // 80 - 1 :: steps // 80] for steps in STEPS]
    apart = [difference(one, other) for one, other in pairwise(runs)]
    order = -np.polyfit(np.log(STEPS[:-1]), np.log(apart), 1)[0]
    assert order == pytest.approx(2.0, abs=0.2)


def test_the_solver_agrees_with_all_nodal_dofs(problem: Problem, way: tuple[Travel, Root]) -> None:
    """24 vectors of all places and R, exact modal motion, against the midpoint rule on the mesh."""
    report = run_job(problem.job, "solve")
    record = problem.job.store.get(report.stages["solve"].key, "trajectory")
    assert isinstance(record, Trajectory)
    travel, root = way
    nodal = nodal_history(travel, root, 3200, 80)
    found = report.quantities
    assert found["load.deflection_end"]["value"] == pytest.approx(nodal.under[-1], rel=2e-3)
    assert found["load.deflection_peak"]["value"] == pytest.approx(nodal.under.max(), rel=2e-3)
    assert report.energy_drift is not None
    assert report.energy_drift < 1e-10


def test_energy_norm_is_the_stress_of_the_root(way: tuple[Travel, Root], problem: Problem) -> None:
    """A rigid motion has no stress; over the whole body the part's stiffness is the body's."""
    travel, root = way
    model = travel.model
    field = np.random.default_rng(0).standard_normal(model.K.shape[0])
    shift = np.tile([1.0, -2.0, 3.0], len(model.nodes))
    assert root.difference((field + shift)[None, root.dofs], field[None, root.dofs]) < 1e-7
    assert root.difference(1.1 * field[None, root.dofs], field[None, root.dofs]) == pytest.approx(0.1, rel=1e-9)
    whole = replace(problem, settings=problem.settings.model_copy(update={"root": 1.0}))
    everywhere = whole.root(model.mesh)
    assert len(root.dofs) < len(everywhere.dofs) == model.K.shape[0]
    np.testing.assert_allclose(everywhere.K @ field, model.K @ field, atol=1e-9 * np.abs(model.K @ field).max())


@pytest.mark.parametrize("count", COUNTS)
def test_static_answer_is_exact_with_the_load_in_the_basis(way: tuple[Travel, Root], count: int) -> None:
    """The force stands at the end of its way; vectors of half the way, and normal modes, lack part of its shape."""
    travel, root = way
    source, end, half = RitzVectors(travel.model), travel.loads([1.0]), travel.loads([0.5])
    normal = normal_modes(travel.model, count)
    exact = source.flexibility.solve(end).T

    def apart(vectors: NormalModes) -> tuple[float, float]:
        ours = (vectors.Phi @ ((vectors.Phi.T @ end) / vectors.angular_frequencies[:, None] ** 2)).T
        return difference(ours @ end, exact @ end), root.difference(ours[:, root.dofs], exact[:, root.dofs])

    for kept in (count - 1, 0, count // 2):
        assert max(apart(source.generate(end, count, lowest(normal, kept)))) < 1e-9, kept
    assert min(apart(normal)) > 1e-4
    assert apart(source.generate(half, count))[0] > 1e-4


def test_ritz_vectors_beat_as_many_normal_modes(compared: Comparison, way: tuple[Travel, Root]) -> None:
    """Of the force that travels, made again at each place, and of the force that is applied suddenly at its end."""
    travel, root = suddenly(way[0]), way[1]
    source, nodal = RitzVectors(travel.model), nodal_history(travel, root, 800, 160)
    sudden = {}
    for count in COUNTS:
        bases = source.generate(travel.loads([1.0]), count), normal_modes(travel.model, count)
        histories = [reduced_history(travel, root, [vectors], 800, 160) for vectors in bases]
        sudden[count] = [difference(one.under, nodal.under) for one in histories]
    moving = {
        count: [errors(compared, basis, count)[0] for basis in ("Ritz, again at each place", "normal")]
        for count in COUNTS
    }
    for found in (sudden, moving):
        for ours, normal in found.values():
            assert ours < 0.9 * normal
        assert found[8][0] < 0.5 * found[2][0]


def test_vectors_made_again_beat_vectors_that_are_kept(compared: Comparison) -> None:
    for count in COUNTS:
        again = errors(compared, "Ritz, again at each place", count)
        kept = errors(compared, "Ritz of half the way, kept", count)
        assert again[0] < kept[0]
        assert again[1] < 0.7 * kept[1]


def test_bases_that_need_more_vectors_are_left_out(compared: Comparison) -> None:
    """Eight places: eight static shapes leave no normal mode beside them."""
    assert not [run for run in compared.runs if run.scheme == OF_ALL]


def test_reference_says_its_own_error(compared: Comparison) -> None:
    assert compared.nodal.time is not None
    assert compared.nodal.time[UNDER] < 1e-4
    assert compared.nodal.steps == 800


def test_price(compared: Comparison) -> None:
    (price,) = compared.prices
    assert price.vectors == 8
    assert 0 < price.again < price.scratch
    assert f"{price.again / price.scratch:.2f}, {price.together / price.scratch:.2f}" in price_table([price]).rows[0]


def test_number_of_solves(way: tuple[Travel, Root]) -> None:
    before = counter.COUNTS["factorisations"]
    source = RitzVectors(way[0].model)
    source.generate_all([way[0].loads([x]) for x in (0.2, 0.5, 0.9)], 8)
    assert (counter.COUNTS["factorisations"] - before, source.solved) == (1, 24)


def test_files_and_table(folder: Path, compared: Comparison, monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs are the bases at each number of vectors, the full-FE dofs the first of them; a table has all errors."""
    monkeypatch.setattr(report_module, "compare", lambda *_: compared)
    out = folder / "out"
    document = report_scene(open_job(folder, db=folder / "db", out=out), Effort(repeat=1), silent)
    assert json.loads((out / "report.json").read_text()) == document.as_json()
    with (out / "report.csv").open() as file:
        assert len(list(csv.DictReader(file))) == len(document.runs)
    assert (out / "report.png").read_bytes().startswith(b"\x89PNG")
    nodal, *runs = document.runs
    assert (nodal.kind, nodal.errors, nodal.time) == ("nodal", {}, compared.nodal.time)
    assert [run.name for run in runs] == [f"{one.scheme}, {one.coordinates} vectors" for one in compared.runs]
    for run in runs:
        assert run.largest_error == max(run.errors.values()) == run.errors[run.largest_of or ""]
        modes, solve = (run.stages[stage] for stage in ("modes", "solve"))
        assert modes.cold is not None
        assert modes.warm is not None
        assert solve.cold is not None
        assert run.cpu_seconds == modes.cold.cpu + solve.cold.cpu
        assert run.peak_mib is not None
        assert run.peak_mib > 10
        # What comes before the vectors: modes, a factor, or both.
        assert modes.cold.cpu > modes.warm.cpu
    best = [chain for chain in document.quantities[0].chains if chain.runs[0].startswith("Ritz, again")]
    assert [chain.sizes for chain in best] == [list(COUNTS)]
    assert best[0].differences[0] > best[0].differences[-1] == 0.0
    text = report_text(document)
    assert "| Ritz, again at each place |" in text
    assert "Time error of the reference, from half the step: " in text
    under, root = errors(compared, "normal", 8)
    assert f"| {under:.1e} / {root:.1e} |" in text


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("report.vectors.force=cart", "report.vectors.force: no moving force 'cart', the scene has load"),
        (
            "component.beam.supports=[]",
            "report.vectors: component.beam.supports permit 6 rigid motions",
        ),
        ("report.vectors.root=1e-6", "report.vectors.root: 1e-06 m given, the nearest cell is 0.0"),
        ("report.vectors.counts=[4, 2]", "report.vectors.counts: [4, 2] given, they must ascend from 1 or more"),
        ("report.vectors.counts=[2, 9000]", "report.vectors.counts: 9000 given, the mesh has"),
        ("report.vectors.meshes=[0.0]", "report.vectors.meshes.0: 0.0 given; input should be greater than 0"),
        ("report.vectors.places=1", "report.vectors.places: 1 given; input should be greater than or equal to 2"),
        ("force.load.interface=side", "force.load.interface: no interface 'side', the component has top"),
    ],
)
def test_what_cannot_be_compared_is_refused(
    folder: Path, capsys: pytest.CaptureFixture[str], change: str, message: str
) -> None:
    arguments = ["report", str(folder), "--set", change, "--db", str(folder / "db"), "--out", str(folder / "other")]
    assert main(arguments) == 2
    assert message in capsys.readouterr().err


def test_tolerance_chooses_no_vectors(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """They are no setting of the scene."""
    arguments = ["run", str(folder), "--tolerance", "1%", "--db", str(folder / "db"), "--out", str(folder / "other")]
    assert main(arguments) == 2
    assert "--tolerance: not available for reports of wheels and vectors" in capsys.readouterr().err


def test_design_change_is_refused(folder: Path) -> None:
    changed = {"component.beam.change.profile.offset": 1e-4, "component.beam.change.profile.surface": "front"}
    with pytest.raises(InputError, match=r"design changes are not supported; remove component\.beam\.change"):
        problem_of(open_job(folder, set=changed, db=folder / "db", out=folder / "out"))


def test_nodal_synthesis_of_contacts_knows_no_moving_force(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "scene") / "scene.toml"
    scene.write_text(scene.read_text() + SKIRT)
    job = open_job(scene, db=tmp_path / "db", out=tmp_path / "out")
    with pytest.raises(InputError, match=r"report\.full_fe: moving forces are not supported; remove force\.tool"):
        nodal_problem(job)


def test_force_needs_a_traction_space(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "scene") / "scene.toml"
    scene.write_text(scene.read_text() + SKIRT.replace('interface = "bore"', 'interface = "thrust"'))
    with pytest.raises(InputError, match=r"force\.tool\.interface: interface 'thrust' is of kind 'points', kind 'tra"):
        open_job(scene)
