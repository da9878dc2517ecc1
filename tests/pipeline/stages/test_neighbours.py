"""Neighbours of the shipped scenes end in one line, never in a traceback."""

import sys
from pathlib import Path
from typing import Any

import pytest

import gudgeon
from gudgeon import examples
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.geometry.occ import meshing

SCENE = """
[component.one]
geometry.kind = "rigid"
geometry.mass = 1.0
geometry.inertia = [1e-3, 1e-3, 1e-3]
geometry.points.front = { at = [0.01, 0.0, 0.0], normal = [1.0, 0.0, 0.0] }
interface.front = { surface = "front" }

[component.two]
geometry.kind = "rigid"
geometry.mass = 2.0
geometry.inertia = [1e-3, 1e-3, 1e-3]
geometry.points.back = { at = [-0.01, 0.0, 0.0], normal = [-1.0, 0.0, 0.0] }
interface.back = { surface = "back" }

[body.one]
velocity = [1.0, 0.0, 0.0]

[body.two]
position = [0.03, 0.0, 0.0]

[contact.pair]
body = "one"
interface = "front"
against = { shape = "body", body = "two", interface = "back" }
method = "impact"
restitution = 0.5

[run]
duration = 0.02
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    return path


def test_a_step_with_an_integrator_that_has_none_is_refused(scene: Path) -> None:
    exact = {"run.step": 1e-4, "run.integrator": "event"}
    with pytest.raises(InputError, match=r"run.step: integrator 'event' has no step, since its motion is exact"):
        gudgeon.run(scene, set=exact, db=scene.parent / "db", out=scene.parent / "out", until="solve")


def test_records_of_two_components_are_found_by_their_names(scene: Path) -> None:
    places: dict[str, Any] = {"db": scene.parent / "db", "out": scene.parent / "out"}
    report = gudgeon.run(scene, until="solve", **places)
    store, job = gudgeon.open(scene.parent / "db"), gudgeon.open_job(scene, **places)
    assert store.get(report.stages["modes"].keys["two"], "modes").mass == 2.0
    system = gudgeon.compile_system(store, job.scene, report.stages["morph"].keys)
    assert gudgeon.simulate(system).result == "FINISHED"
    assert store.get(report.stages["solve"].keys[job.name], "trajectory").result == "FINISHED"


def test_a_gmsh_that_does_not_load_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    class Broken:
        def find_spec(self, name: str, path: Any = None, target: Any = None) -> None:
            if name == "gmsh":
                raise OSError("libGLU.so.1: cannot open shared object file: No such file or directory\nmore")

    monkeypatch.delitem(sys.modules, "gmsh", raising=False)
    monkeypatch.setattr(sys, "meta_path", [Broken(), *sys.meta_path])
    message = r"^gmsh does not load: libGLU.so.1: .* directory; 'gudgeon doctor' prints"
    with pytest.raises(StageError, match=message), meshing(0.1, {}):
        pass


def test_a_run_without_contact_says_how_near_it_came(scene: Path) -> None:
    places: dict[str, Any] = {"db": scene.parent / "db", "out": scene.parent / "out"}
    notes = gudgeon.run(scene, set={"run.duration": 5e-3}, until="solve", **places).notes
    assert any("no contact touched; the smallest gap was 0.005 m, of contact pair at 0.005 s" in note for note in notes)


def test_the_reason_of_a_run_that_left_its_range_has_figures(scene: Path) -> None:
    places: dict[str, Any] = {"db": scene.parent / "db", "out": scene.parent / "out"}
    changes = {"body.one.angular_velocity": [0.0, 0.0, 10.0], "component.one.geometry.inertia": [1e-3, 1e-3, 1.5e-3]}
    report = gudgeon.run(scene, set=changes, until="solve", **places)
    assert report.result == "ROTATION"
    assert report.reason is not None
    assert report.reason.startswith("body 'one' turned by 0.0")
    assert not any("increase run.duration" in note for note in report.notes)


ASIDE = """
[component.one]
geometry.kind = "rigid"
geometry.mass = 1.3
geometry.inertia = [2e-3, 1e-3, 3e-3]
geometry.points.foot = { at = [0.03, 0.01, -0.02], normal = [0.0, 0.0, -1.0] }
interface.foot = { surface = "foot" }

[body.one]
velocity = [0.1, 0.0, -1.0]
position = [0.0, 0.0, 0.0205]

[contact.floor]
body = "one"
interface = "foot"
against = { shape = "plane", point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }
method = "impact"
restitution = 0.0
friction = { static = 0.3 }

[run]
duration = 0.002
"""


@pytest.mark.parametrize("step", ["unset", 1e-5, 1e-6])
def test_a_plastic_impact_with_friction_and_without_weight_is_a_jump(step: Any, tmp_path: Path) -> None:
    """What round-off leaves of the approach is no force: it had a peak of 0.6 mN and an end, and runs were refused."""
    (tmp_path / "scene.toml").write_text(ASIDE)
    places: dict[str, Any] = {"db": tmp_path / "db", "out": tmp_path / "out"}
    report = gudgeon.run(tmp_path / "scene.toml", set={"run.step": step}, until="solve", **places)
    assert report.result == "FINISHED"
    values = {name: entry["value"] for name, entry in report.quantities.items()}
    assert values["floor.impulse"] == pytest.approx(0.650725, rel=1e-5)
    assert values["floor.end"] == values["floor.start"] == pytest.approx(5e-4, rel=1e-9)
    assert "floor.force_peak" not in values
    assert "floor.force_peak_raw" not in values


def test_impacts_of_no_duration_whose_times_converge_are_accurate(tmp_path: Path) -> None:
    """Seven impacts of a mass on a spring: the run was refused, since times of order two are never the same."""
    scene = Path(examples.__file__).parent / "two-mass" / "scene.toml"
    exact, found = (
        gudgeon.run(scene, set={"run.integrator": name}, until="solve", db=tmp_path / "db", out=tmp_path / name)
        for name in ("event", "small")
    )
    assert found.result == "FINISHED"
    assert found.quantities["pair.impacts"]["value"] == exact.quantities["pair.impacts"]["value"] == 7
    for key in ("pair.impulse", "pair.impact7.start", "pair.impact7.impulse", "striker.velocity_x"):
        assert found.quantities[key]["value"] == pytest.approx(exact.quantities[key]["value"], rel=1e-3)
