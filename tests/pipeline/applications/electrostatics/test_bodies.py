"""Scenes of bodies in a field of conductors: grids computed first and kept, motion by the scalar equation, refusals."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gudgeon import modaldb
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job, plan, run
from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.fields.electrostatic import VACUUM
from gudgeon.solver.forces.fields.pose_field import PoseField
from tests.scenes import scene_path

SCENE = scene_path("pull-in") / "scene.toml"
MASS, STIFFNESS, GAP, AREA, VOLTS = 4.66e-11, 2.0, 2e-6, 1e-8, 6.0


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("pull-in")


@pytest.fixture(scope="module")
def field(db: Path) -> PoseField:
    """The grid of the scene, which the first run computes."""
    report = run(SCENE, db=db, out=db / "first", until="solve")
    assert report.result == "FINISHED", report.reason
    job = open_job(SCENE, db=db, out=db / "first")
    return PoseField.of(modaldb.open(db).get(job.scene.force["attraction"].record, "posegrid"))


@pytest.mark.validation
@pytest.mark.parametrize("integrator", ["small", "turning"])
@pytest.mark.parametrize("share", [0.6, 1.0])
def test_the_plate_moves_by_the_scalar_equation(db: Path, field: PoseField, integrator: str, share: float) -> None:
    """m z̈ = −k z + ½ C′(z) V², with the same C."""
    changes: dict[str, Any] = {
        "force.attraction.potentials.upper": share * VOLTS, "run.integrator": integrator, "run.samples": 500,
    }  # fmt: skip
    if integrator == "turning":
        changes |= {
            "body.plate.freedom": "unset", "component.plate.geometry.inertia": [4e-20, 4e-20, 8e-20], "joint":
            {"guide": {"kind": "translational", "body": "plate", "axis": [0.0, 0.0, 1.0]}}, "force.spring": {
                "kind": "bushing", "body": "plate", "direction": "unset", "stiffness": [0.0, 0.0, STIFFNESS]},
        }  # fmt: skip
    report = run(SCENE, set=changes, db=db, out=db / f"{integrator}{share}", until="solve")
    assert report.result == "FINISHED", report.reason
    found = modaldb.open(db).get(report.stages["solve"].key, "trajectory")

    def rates(t: float, y: np.ndarray) -> list[float]:
        force = field.interaction({"z": y[0]}, np.array([0.0, share * VOLTS])).force[2]
        return [y[1], (force - STIFFNESS * y[0]) / MASS]

    truth = solve_ivp(rates, (0, 1e-4), [0.0, 0.0], t_eval=found.times, rtol=1e-9, atol=1e-18,
                      first_step=1e-9).y[0]  # fmt: skip
    z = found.motion["plate"][:, 2]
    assert np.abs(z - truth).max() < 1e-3 * np.abs(truth).max()
    assert found.energy_drift < 1e-3


def test_close_plates_have_the_force_of_parallel_ones(field: PoseField) -> None:
    """At gaps of 1 and 0.4 % of the edge, with what the edges add to C: 1 + (g/πL)(1 + ln(2πL/g)) a side."""
    for gap in (1e-6, 0.4e-6):
        ideal = 0.5 * VACUUM * AREA * VOLTS**2 / gap**2
        found = -field.interaction({"z": gap - GAP}, np.array([0.0, VOLTS])).force[2]
        assert found == pytest.approx(ideal * (1 + 2 * gap / (np.pi * 1e-4)), rel=1e-2)


def test_pull_in_ends_with_its_cause(db: Path, field: PoseField) -> None:
    """A step that is 3 % above that of plates without edges pulls in, and the travel of 5 % below stays in."""
    limit = np.sqrt(STIFFNESS * GAP**3 / (4 * VACUUM * AREA))
    for share, result in ((0.95, "FINISHED"), (1.01, "FIELD_LEFT")):
        changes = {"force.attraction.potentials.upper": share * limit, "run.duration": 2e-4}
        report = run(SCENE, set=changes, db=db, out=db / f"pull{share}", until="solve")
        assert report.result == result
    assert report.reason is not None
    assert "force.attraction: the body left the grid of poses along z at t = " in report.reason


def test_the_plan_lists_the_field(db: Path, field: PoseField) -> None:
    rows = {row["term"]: row for row in plan(SCENE, db=db)["terms"]}
    assert rows["field attraction"]["present"]


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"field": "none.toml"}, "none.toml"),
        ({"field": "scene.toml"}, "is no scene of conductors"),
        ({"field": str(scene_path("electrostatics/squares.toml"))}, r"has no table \[poses\]"),
        ({"field": "unset"}, "give field, the scene file of conductors"),
        ({"potentials": {"uper": 3.0}}, "no conductor 'uper'; the field has lower, upper"),
        ({"start": [0.0, 0.0, 5e-6]}, "outside of the grid of poses"),
    ],
)
def test_wrong_input_is_one_line(db: Path, field: PoseField, changes: dict[str, Any], text: str) -> None:
    with pytest.raises((InputError, SceneError), match=text) as caught:
        run(SCENE, set={f"force.attraction.{key}": value for key, value in changes.items()}, db=db, out=db / "wrong",
            until="solve")  # fmt: skip
    assert len(str(caught.value).splitlines()) == 1


def test_other_integrators_say_that_they_have_no_fields(db: Path) -> None:
    with pytest.raises(InputError, match=r"does not support the field force\.attraction; use 'auto'"):
        run(SCENE, set={"run.integrator": "event"}, db=db, out=db / "wrong")


def test_scenes_without_fields_load_nothing_of_them(tmp_path: Path) -> None:
    code = (
        "import sys; from gudgeon.pipeline.kinds import open_job; "
        "open_job(sys.argv[1], db=sys.argv[2], out=sys.argv[3]); "
        "print(*[name for name in sys.modules if name.startswith('gudgeon.pipeline.applications.electrostatics.')])"
    )
    places = (tmp_path / "db", tmp_path / "out")
    found = {
        name: subprocess.run(
            [sys.executable, "-c", code, scene_path(name) / "scene.toml", *places],
            capture_output=True, text=True, check=True,
        ).stdout.split()
        for name in ("two-blocks", "pull-in")
    }  # fmt: skip
    assert found["two-blocks"] == []
    assert "gudgeon.pipeline.applications.electrostatics.job" in found["pull-in"]
