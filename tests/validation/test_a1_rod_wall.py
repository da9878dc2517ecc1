"""Reference case A1: free elastic rod against a rigid wall, d'Alembert's exact solution.

Values in data/rod-wall/A1_rod_rigid_wall.json; the bounds are those the scene is shipped with.
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from gudgeon import modaldb
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.pipeline.report.force import pulse_reference
from gudgeon.pipeline.stages.notes.facts import FIELDS
from gudgeon.pipeline.stages.plan import plan
from gudgeon.pipeline.stages.run_report import RunReport

SCENE = Path(__file__).parents[2] / "data" / "rod-wall"
EXACT = json.loads((SCENE / "A1_rod_rigid_wall.json").read_text())["expected"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("rod")


@pytest.fixture(scope="module")
def report(folder: Path) -> RunReport:
    return run(SCENE, db=folder / "db", out=folder / "out", until="solve")


@pytest.mark.parametrize(
    ("quantity", "name", "bound"),
    [
        ("wall.restitution", "restitution", 1e-3),
        ("wall.duration", "contact_duration", 2e-3),
        ("wall.impulse", "impulse", 1e-3),
    ],
)
def test_quantities(report: RunReport, quantity: str, name: str, bound: float) -> None:
    assert report.result == "FINISHED"
    assert report.quantities[quantity]["value"] == pytest.approx(EXACT[name]["value"], rel=bound)
    assert report.quantities[quantity]["reference"] == EXACT[name]["value"]


def test_balances(report: RunReport) -> None:
    assert report.energy_drift is not None
    assert report.energy_drift <= 1e-4
    assert report.momentum_residual is not None
    assert report.momentum_residual < 1e-12


def test_force_with_wave_guide_dashpot(folder: Path) -> None:
    job = open_job(SCENE, set={"contact.wall.dashpot": "wave-guide"}, db=folder / "db", out=folder / "dashpot")
    done = run(
        SCENE, set={"contact.wall.dashpot": "wave-guide"}, db=folder / "db", out=folder / "dashpot", until="solve"
    )
    history = modaldb.open(folder / "db").get(done.stages["solve"].key, "trajectory")
    reference = pulse_reference(job)
    assert reference is not None
    # A jump that a Hann window of width W smooths lowers the integral of the squared force by F^2 W times this number:
    # the integral over v of H - S^2 with S = 1/2 + v + sin(2 pi v) / (2 pi). The record begins inside the pulse.
    lost = reference.window * (1 / 6 - 5 / (8 * np.pi**2))
    assert reference.window > 0
    assert np.linalg.norm(reference.force) ** 2 * job.scene.run.duration / len(reference.force) == pytest.approx(
        EXACT["contact_force_plateau"]["value"] ** 2 * (EXACT["contact_duration"]["value"] - lost), rel=1e-4
    )
    _, force_error = reference.errors(history.times, history.contacts["wall"].force)
    assert force_error <= 0.055


def test_frequencies_are_those_of_the_bar(report: RunReport, folder: Path) -> None:
    modal = modaldb.open(folder / "db").get(report.stages["modes"].key, "modes")
    exact = np.pi * EXACT["wave_speed"]["value"] / 1.0 * np.arange(1, 101)
    # Quadratic elements, eight to the shortest wave: 3e-4 there, fourth order below.
    np.testing.assert_allclose(modal.angular_frequencies, exact, rtol=3e-4)
    np.testing.assert_allclose(modal.angular_frequencies[:20], exact[:20], rtol=1e-6)


def test_the_plan_leaves_out_what_the_rod_does_not_need(report: RunReport, folder: Path) -> None:
    rows = plan(open_job(SCENE, db=folder / "db"))
    present = {row["term"] for row in rows["terms"] if row["present"]}
    left_out = {row["term"] for row in rows["terms"] if not row["present"]}
    own = {"rigid motion", "elastic flight", "contact wall", "residual flexibility", "errors of frequencies"}
    assert present == own
    assert {"inertia couplings", "surface and volume mesh", "mode shapes"} <= left_out
    assert rows["bytes"] < 4000


def test_solve_reads_just_the_plan_and_imports_no_mesher(report: RunReport, folder: Path) -> None:
    """The fields that the store is asked for are those of the plan; neither gmsh nor pyvista is ever loaded."""
    code = """
import json, sys
from gudgeon.pipeline import kinds
from gudgeon.modaldb.stores.folder import FolderStore
asked = []
whole = FolderStore.get
def spy(self, key, kind, *, only=None):
    asked.append([kind, list(only) if only is not None else None])
    return whole(self, key, kind, only=only)
FolderStore.get = spy
kinds.run(sys.argv[1], set=["run.duration=5e-4"], db=sys.argv[2] + "/db", out=sys.argv[2] + "/again", until="solve")
print(json.dumps([asked, [m for m in ("gmsh", "pyvista", "skfem", "meshio", "matplotlib") if m in sys.modules]]))
"""
    child = subprocess.run([sys.executable, "-c", code, SCENE, folder], capture_output=True, text=True, check=True)
    asked, loaded = json.loads(child.stdout)
    assert loaded == []
    # Notes read the estimates of the modes' errors, lines on parts their extents and mass, after the solver.
    parts = (["mesh", ["nodes"]], ["morph", ["mass"]])
    asked = [one for one in asked if one not in parts and not set(FIELDS) <= set(one[1] or [])]
    fields = {
        f"{kind}:{field}"
        for kind, only in asked
        for field in (["everything"] if only is None else only)
        if kind != "trajectory"
    }
    assert fields == {
        "morph:centre", "morph:inertia", "morph:rigid_twists", "morph:points/tip",
        "modes:angular_frequencies", "modes:discretisation_errors",
        "modes:interfaces/tip/rows", "modes:interfaces/tip/normals",
        "modes:interfaces/tip/edge",
        "modes:residual_flexibility",
    }  # fmt: skip


def test_a_step_that_is_too_large_is_divided_and_noted(folder: Path) -> None:
    found = run(SCENE, set={"run.step": 1e-4}, db=folder / "db", out=folder / "divided", until="solve")
    note = (
        "run.step: 0.0001 s exceeds the limit of integrator 'small', 40/ω_c = 2.04e-05 s; each step was divided into"
        " 5 substeps"
    )
    assert note in found.notes


@pytest.mark.validation
def test_a_stated_accuracy_chooses_the_step(folder: Path) -> None:
    """The step is halved until its errors are below it; too small an accuracy for any step is a failure."""
    errors = []
    for number, accuracy in enumerate((1e-4, 1e-6)):
        out = folder / f"accurate-{number}"
        found = run(SCENE, set={"run.accuracy": accuracy}, db=folder / "db", out=out, until="solve")
        assert found.reason is None
        assert found.energy_drift is not None
        assert found.energy_drift <= accuracy
        errors.append(max(found.estimates["step.impulse"], found.estimates["step.force"]))
        assert errors[-1] <= accuracy
    assert errors[1] < errors[0]
    refused = run(
        SCENE, set={"run.accuracy": 1e-12, "run.duration": 4.2e-4}, db=folder / "db", out=folder / "no", until="solve"
    )
    assert refused.result == "INACCURATE"
    assert "run.accuracy" in str(refused.reason)
