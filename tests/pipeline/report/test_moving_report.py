"""A force that moves over a held body: full FE, and the ordinary report of reduced models against it."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.nodal.scene.problem import nodal_problem
from gudgeon.pipeline.nodal.sliding.loop import simulate_nodal
from gudgeon.pipeline.report.bodies import report_scene
from gudgeon.pipeline.report.effort import Effort
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

[report]
full_fe = { steps = [1.8e-5, 4.5e-6] }

[report.models]
"Ritz, R" = {}
"normal, R" = { component.beam.modes.reduction = "macneal" }
"normal" = { component.beam.modes.reduction = "normal+static" }

[report.sweep]
"component.beam.modes.normal_count" = [2, 4, 8]
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
STEPS = (9e-6, 4.5e-6, 2.25e-6, 1.125e-6)
PEAK, END = "load.deflection_peak", "load.deflection_end"
TIME_ERROR = 2e-4
"""Of the midpoint rule at a step of 4.5 µs."""
TOLERANCE = 5e-4
"""Vectors with R meet it, normal modes alone do not: which run is the fastest is the machine's choice."""


def silent(stage: str, share: float) -> None:
    """Tell nobody."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("moving")
    (path / "scene.toml").write_text(SCENE)
    return path


def full_fe(folder: Path, step: float, **change: float) -> tuple[NodalRecord, Trajectory]:
    """Return full FE at a step, and the reduced run."""
    changes = {key.replace("__", "."): value for key, value in change.items()}
    job = open_job(folder, set=changes, db=folder / "db", out=folder / "out")
    report = run_job(job, "solve")
    found = job.store.get(report.stages["solve"].key, "trajectory")
    return simulate_nodal(nodal_problem(job), step), found


def value(run: NodalRecord | Trajectory, name: str) -> float:
    return float(run.quantities[name]["value"])


def test_full_fe_is_second_order(folder: Path) -> None:
    """By the strain energy at common times; the deflection at one time holds modes that no step resolves."""
    runs = [full_fe(folder, step)[0] for step in STEPS]
    strain = [run.energies[len(run.times) // 50 - 1 :: len(run.times) // 50, 1] for run in runs]
    apart = [float(np.linalg.norm(one - other)) for one, other in pairwise(strain)]
    order = np.polyfit(np.log(STEPS[:-1]), np.log(apart), 1)[0]
    assert order == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize("gravity", [0.0, -9.81])
def test_the_solver_agrees_with_full_fe(folder: Path, gravity: float) -> None:
    """24 vectors of all places and R, exact modal motion, against the midpoint rule on the mesh."""
    change = {"run__gravity": [0.0, 0.0, gravity]}
    nodal, reduced = full_fe(folder, STEPS[1], **change)  # type: ignore[arg-type]
    for name in (PEAK, END):
        assert value(nodal, name) == pytest.approx(value(reduced, name), rel=TIME_ERROR)
    assert nodal.quantities["load.peak_time"] == pytest.approx(reduced.quantities["load.peak_time"], abs=1e-5)


def test_a_force_that_stands_still_deflects_by_twice_the_static_deflection(folder: Path) -> None:
    """At the tip, where the first mode has nearly all of it: suddenly, against slowly."""
    still = {"force__load__speed": 0.0, "force__load__at": [0.0, 0.09], "run__duration": 2e-3}
    suddenly, reduced = full_fe(folder, STEPS[1], **still, force__load__rise=0.0)  # type: ignore[arg-type]
    slowly, _ = full_fe(folder, 10 * STEPS[0], **still | {"run__duration": 0.05}, force__load__rise=0.04)  # type: ignore
    assert value(suddenly, PEAK) == pytest.approx(value(reduced, PEAK), rel=5e-3)
    assert value(suddenly, PEAK) == pytest.approx(2 * value(slowly, END), rel=0.05)


def test_energy_of_full_fe_is_the_work_of_the_force(folder: Path) -> None:
    nodal, reduced = full_fe(folder, STEPS[1])
    assert nodal.energies[-1].sum() == pytest.approx(reduced.energies[-1, 4], rel=1e-3)


@pytest.mark.validation
def test_report_against_full_fe(folder: Path) -> None:
    """Few vectors with R are as good as the steps; without it their deflection lacks the other modes'."""
    job = open_job(folder, db=folder / "db", out=folder / "out")
    document = report_scene(job, Effort(repeat=1, tolerance=TOLERANCE, same_mesh=True), silent)
    assert document.reference == {"kind": "nodal", "source": "full FE at 4.5 µs"}
    errors = {run.name: run.errors for run in document.runs if run.kind == "reduced"}
    assert len(errors) == 9
    assert {PEAK, END, "energy drift"} == {one.name for one in document.quantities}
    for count in (2, 4, 8):
        for kind in ("Ritz, R", "normal, R"):
            assert abs(errors[f"{kind}, {count} modes"][END]) < 5 * TIME_ERROR
    few, many = (errors[f"normal, {count} modes"][END] for count in (2, 8))
    assert few < 10 * many < 0
    assert many < -2 * TIME_ERROR
    assert document.choice is not None
    assert ", R, " in (document.choice.run or "")


def test_tolerance_chooses_vectors(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    how = Effort(repeat=1, tolerance=TOLERANCE, same_mesh=True)
    report_scene(open_job(folder, db=folder / "db", out=folder / "out"), how, silent)
    arguments = [
        "run",
        str(folder),
        "--tolerance",
        str(TOLERANCE),
        "--same-mesh",
        "--db",
        str(folder / "db"),
        "--out",
        str(folder / "other"),
    ]
    assert main(arguments) == 0
    assert ", R, " in capsys.readouterr().err


def test_full_fe_knows_no_moving_force_beside_contacts(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "scene") / "scene.toml"
    scene.write_text(scene.read_text() + SKIRT)
    job = open_job(scene, db=tmp_path / "db", out=tmp_path / "out")
    with pytest.raises(
        InputError, match=r"report\.full_fe: force\.tool: moving forces together with contacts or joints"
    ):
        nodal_problem(job)


def test_force_needs_a_traction_space(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "scene") / "scene.toml"
    scene.write_text(scene.read_text() + SKIRT.replace('interface = "bore"', 'interface = "thrust"'))
    with pytest.raises(InputError, match=r"force\.tool\.interface: interface 'thrust' is of kind 'points', kind 'tra"):
        open_job(scene)
