"""Cases on settings: what a result must not depend on, and estimates that must hold, each with a program that errs."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gudgeon.pipeline import kinds
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.robustness import trial
from gudgeon.pipeline.robustness.operations.settings import AGREES, EXACT
from gudgeon.pipeline.robustness.subject import DoesNotApply
from gudgeon.pipeline.robustness.trial import approach
from gudgeon.pipeline.stages import bodies
from tests.pipeline.robustness.test_robustness import applied, quiet, subject, two
from tests.pipeline.small import write_scene
from tests.scenes import scene_path
from tests.solver.test_mesh_check import LIGHT

ROD = """
[component.rod]
geometry = { kind = "bar", length = 1.0, area = 1e-4 }
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
mesh = { size = 0.02 }
interface.tip = { surface = "right" }
modes = { normal_count = 16 }

[body.rod]
velocity = [1.0, 0.0, 0.0]

[contact.wall]
body = "rod"
interface = "tip"
against = { shape = "plane", point = [1.0001, 0.0, 0.0], normal = [-1.0, 0.0, 0.0] }

[run]
duration = 1.2e-3
samples = 400
frames = 20
"""


def verdicts(scene: Path, only: str, folder: Path) -> dict[str, dict[str, Any]]:
    code = main(["robustness", str(scene), "--only", only, "--db", str(folder / "db"), "--out", str(folder / "out")])
    document = json.loads((folder / "out" / "robustness.json").read_text())
    assert code == int(not document["passed"])
    rows = document["rows"]
    return {row["case"]: row for row in rows}


@pytest.fixture
def rod(tmp_path: Path) -> Path:
    path = tmp_path / "rod.toml"
    path.write_text(ROD)
    return path


def test_a_rod_is_right_in_all_settings(rod: Path, tmp_path: Path) -> None:
    rows = verdicts(rod, "settings,basis", tmp_path)
    applied = {name: row for name, row in rows.items() if row["verdict"] != "does not apply"}
    assert {name: (row["verdict"], row["rule"]) for name, row in applied.items()} == {
        "samples 50": ("right", "impact"), "samples 4e4": ("right", "impact"), "duration 4": ("right", "impact"),
        "gravity": ("right", "impact"), "half the modes": ("right", "basis"),
    }  # fmt: skip


def test_a_step_from_the_samples_is_found(rod: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps of a sample each, as the implicit integrator once took them."""
    whole = trial.simulate

    def coarse(system: Any, progress: Any = None) -> Any:
        run = system.scene.run
        step = 5 * run.duration / run.samples
        fixed = run.model_copy(update={"step": step, "checks": False, "integrator": "small"})
        return whole(replace(system, scene=system.scene.model_copy(update={"run": fixed})), progress)

    monkeypatch.setattr(trial, "simulate", coarse)
    rows = verdicts(rod, "samples 50", tmp_path)
    assert rows["samples 50"]["verdict"] == "wrong"


def test_an_estimate_of_the_basis_that_is_too_small_is_found(
    rod: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gudgeon.pipeline.robustness.rules.STEPPED", 0.0)
    monkeypatch.setattr("gudgeon.solver.checks.basis.REBOUND", ())
    monkeypatch.setattr(
        "gudgeon.solver.simulate.with_basis_estimates",
        lambda system, found, run: replace(found, estimates=found.estimates | {"basis.impulse": 0.0}),
    )
    changes = {"contact.wall.method": "penalty", "contact.wall.surface_stiffness": 1e15}
    sets = [text for key, value in changes.items() for text in ("--set", f"{key}={value}")]
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    assert main(["robustness", str(rod), "--only", "basis", *places, *sets]) == 1
    (row,) = json.loads((tmp_path / "out" / "robustness.json").read_text())["rows"]
    assert (row["verdict"], row["rule"]) == ("wrong", "basis")


def test_an_estimate_of_the_mesh_that_is_too_small_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A light mass on a bar of 50 elements: the impulse of its first impact changes by 0.3 % with the mesh."""
    light = tmp_path / "light.toml"
    light.write_text(LIGHT.replace("size = 0.01", "size = 0.02").replace("normal_count = 60", "normal_count = 30"))
    row = verdicts(light, "coarser mesh", tmp_path)["coarser mesh"]
    assert (row["verdict"], row["rule"]) == ("right", "mesh")
    assert row["value"] > 1e-3
    monkeypatch.setattr("gudgeon.solver.checks.mesh.MARGIN", 0.0)
    monkeypatch.setattr("gudgeon.pipeline.robustness.rules.STEPPED", 0.0)
    other = tmp_path / "other"
    other.mkdir()
    assert verdicts(light, "coarser mesh", other)["coarser mesh"]["verdict"] == "wrong"


def test_grazing_in_a_bore_starts_at_the_gap_that_it_says(tmp_path: Path) -> None:
    """Rows are those of the start: 20 µm further on they are off by 1e-9 m, more than a millionth of the gap."""
    job = kinds.open_job(write_scene(tmp_path / "scene"), db=tmp_path / "db", out=tmp_path / "out")
    one = subject(job, tmp_path)
    for factor in (1e-3, 1e-5):
        grazing = applied(one, kind="grazing", factor=factor)
        assert approach(grazing.job)[1] == pytest.approx(factor * approach(one.job)[1], rel=1e-2)


def test_reuse_is_accepted_within_its_tolerance_and_refused_beyond(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = write_scene(tmp_path / "scene")
    rows = verdicts(scene, "reuse", tmp_path)
    assert (rows["reuse 1e-5"]["verdict"], rows["reuse 1e-5"]["rule"]) == ("right", "reuse")
    assert rows["reuse 0.02"]["verdict"] == "refused"
    assert "'reuse' given, the profile is estimated to change" in rows["reuse 0.02"]["reason"]
    for room in (trial, bodies):  # Reuse is no longer refused.
        monkeypatch.setattr(room, "refuse_reuse", lambda job: None)
    rows = verdicts(scene, "reuse 0.02", tmp_path)
    assert rows["reuse 0.02"]["verdict"] == "wrong"


def test_operations_on_settings_change_what_they_say(tmp_path: Path) -> None:
    one = subject(two(tmp_path), tmp_path)
    few = applied(one, kind="samples", count=50)
    assert (few.job.scene.run.samples, few.like is None, few.same) == (50, True, EXACT)
    longer = applied(one, kind="duration", factor=4.0)
    assert (longer.job.scene.run.duration, longer.same) == (0.008, EXACT)
    with pytest.raises(DoesNotApply, match="first impact does not end within"):
        applied(one, kind="duration", factor=0.1)
    falling = applied(one, kind="gravity")
    assert falling.job.scene.run.gravity == (9.81, 0.0, 0.0)  # Body a strikes b along x.
    assert falling.same is not None
    assert AGREES < falling.same < 0.1
    held = subject(two(tmp_path / "g", **{"run.gravity": [1.0, 0.0, 0.0]}), tmp_path / "g")
    doubled = applied(held, kind="gravity")
    assert (doubled.job.scene.run.gravity, doubled.same) == ((2.0, 0.0, 0.0), None)
    for kind, values, why in (("modes", {"factor": 0.5}, "no body has 8"), ("change", {"share": 1e-5}, "cylindrical")):
        with pytest.raises(DoesNotApply, match=why):
            applied(one, kind=kind, **values)
    assert trial.run_trial(falling, tmp_path / "falling", quiet).contact is not None  # type: ignore[union-attr]


def test_a_turn_moves_the_nearest_point_to_contact(tmp_path: Path) -> None:
    """The rod's tip is beside its centre: turned the other way, within 1 µs it would leave the floor."""
    scene = scene_path("rigid/rod-end.toml")
    assert verdicts(scene, "rotation 0.02 rad", tmp_path)["rotation 0.02 rad"]["verdict"] == "right"


HEAVY = """
[component.block]
geometry = { kind = "box", lx = 0.01, ly = 0.01, lz = 0.03 }
material = { E = 1e9, nu = 0.2, rho = 1200.0 }
mesh = { size = 0.01 }
interface.side = { surface = "left" }
interface.foot = { surface = "bottom" }
modes = { normal_count = 4 }

[body.block]

[contact.floor]
body = "block"
interface = "foot"
against = { shape = "plane", point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }

[contact.step.against]
shape = "plane"
point = [0.02, 0.0, 0.0]
normal = [1.0, 0.0, 0.0]
edges = [{ point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }]

[contact.step]
body = "block"
interface = "side"

[run]
duration = 2e-4
gravity = [0.0, 0.0, -9810.0]
checks = false
"""


def test_a_side_above_an_edge_does_not_overlap_by_what_the_foot_yields(tmp_path: Path) -> None:
    """The step's face ends at the floor's height, on which a heavy block stands: its side is beside no face."""
    path = tmp_path / "heavy.toml"
    path.write_text(HEAVY)
    rows = verdicts(path, "mass,collinear", tmp_path)
    assert {row["verdict"] for name, row in rows.items() if row["group"] == "mass"} == {"right"}
    assert rows["collinear static shapes"]["verdict"] == "does not apply"
    assert "contact.step: a face with edges" in rows["collinear static shapes"]["reason"]
