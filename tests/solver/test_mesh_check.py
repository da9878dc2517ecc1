"""The estimated error of the mesh against runs on finer meshes, and the note on it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.kinds import open_job, run
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.integrators.curves import windowed
from gudgeon.solver.simulate import simulate
from tests.solver.systems import build, rigid_records, rod_records, rod_scene

LIGHT = """
component.mass.geometry = { kind = "rigid", mass = 0.246, points = { face = { at = [0, 0, 0], normal = [1, 0, 0] } } }
component.mass.interface.front.surface = "face"
component.bar.geometry = { kind = "bar", length = 1.0, area = 3.14e-4 }
component.bar.material = { E = 210e9, nu = 0.3, rho = 7850 }
component.bar.mesh.size = 0.01
component.bar.modes.normal_count = 60
component.bar.interface.back.surface = "left"
body.mass.velocity = [1.0, 0, 0]
body.bar = {}
contact.pair = { body = "mass", interface = "front", against = { shape = "body", body = "bar", interface = "back" } }
run = { duration = 1e-3, window = 1e-5 }
"""


def solved(folder: Path, **changes: Any) -> Any:
    (folder / "scene.toml").write_text(LIGHT)
    job = open_job(folder, set={key.replace("__", "."): one for key, one in changes.items()}, db=folder / "db",
                   out=folder / "out")  # fmt: skip
    run_job(job, "solve")
    return job.store.get(job.trajectory().key, "trajectory")


def test_waves_that_return_too_early_are_estimated(tmp_path: Path) -> None:
    """On 100 elements they change the impulse by 2.5 %, whatever the number of modes; on 200 by 0.07 %."""
    exact = solved(tmp_path, component__bar__mesh__size=0.0025).quantities
    for size, least in ((0.01, 0.02), (0.005, 5e-4)):
        found = solved(tmp_path, component__bar__mesh__size=size)
        error = abs(found.quantities["pair.impulse"]["value"] / exact["pair.impulse"]["value"] - 1)
        assert error > least
        assert error < found.estimates["mesh.impulse"] < 2 * error


@pytest.mark.parametrize("method", ["constraint", "residual"])
def test_by_default_a_light_striker_is_within_one_percent(method: str, tmp_path: Path) -> None:
    """Its wave returns after 20 times the time in which the bar stops it, and takes the bar's end away from it."""
    unset = {"component__bar__mesh__size": "unset", "component__bar__modes__normal_count": "unset"}
    found = solved(tmp_path, **unset, contact__pair__method=method, run__window="unset").quantities
    mass, wave = 0.246, 3.14e-4 * (210e9 * 7850) ** 0.5
    edges = np.linspace(0.0, 3e-4, 30001)
    exact = mass * (1 - np.exp(-wave / mass * edges))[:, None] * [1.0, 0.0, 0.0]
    force = windowed(edges, exact, found["pair.force_window"]["value"])[0]
    assert found["pair.impulse"]["value"] == pytest.approx(mass, rel=0.01)
    assert found["pair.rebound_velocity"]["value"] == pytest.approx(0.0, abs=0.01)
    assert found["pair.force_peak"]["value"] == pytest.approx(force, rel=0.01)


def test_the_mass_of_a_coarse_round_mesh_is_an_error_of_the_impulse(tmp_path: Path) -> None:
    modal, morph = rod_records(6)
    system = build(tmp_path, (replace(modal, quality={"volume_error": -0.014}), morph), rod_scene(checks=True))
    estimates = simulate(system).estimates
    assert estimates["mesh.impulse"] == pytest.approx(0.014)
    assert estimates["mesh.force"] == pytest.approx(0.007)


def test_the_inertia_of_a_coarse_round_mesh_is_an_error_of_rotations(tmp_path: Path) -> None:
    """A free rotor under a torque: its turns have the error of the inertia, its path that of the mass."""
    modal, morph = rigid_records(1.0, {}, (1e-3, 1e-3, 1e-3))
    records = replace(modal, quality={"volume_error": -0.014, "inertia_error": 0.028}), morph
    scene = {
        "body": {"part": {}},
        "force": {"t": {"kind": "torque", "body": "part", "direction": [0, 0, 1], "expression": "1e-3"},
                  "f": {"kind": "force", "body": "part", "at": [0, 0, 0], "direction": [1, 0, 0], "expression": "1"}},
        "run": {"duration": 1e-2, "samples": 20, "frames": 10},
    }  # fmt: skip
    estimates = simulate(build(tmp_path, records, scene)).estimates
    assert estimates["mesh.part.displacement"] == pytest.approx(0.014)
    assert estimates["mesh.part.angular_velocity"] == pytest.approx(0.028)


def test_a_coarse_round_mesh_has_a_note(tmp_path: Path) -> None:
    """A pin on a mesh of twice its radius lacks 1.5 % of its mass; on a quarter of that 0.01 %."""
    scene = """
component.pin.geometry = { kind = "cylinder", radius = 0.01, length = 0.05 }
component.pin.material = { E = 210e9, nu = 0.3, rho = 7850 }
component.pin.mesh.size = SIZE
component.pin.modes.normal_count = 2
body.pin = { velocity = [0, 0, 1] }
run = { duration = 1e-4 }
"""
    for size, count in (("0.02", 1), ("0.005", 0)):
        (tmp_path / "scene.toml").write_text(scene.replace("SIZE", size))
        notes = run(tmp_path, until="modes", db=tmp_path / "db", out=tmp_path / "out").notes
        found = [note for note in notes if "% below that within its true surfaces; refine the mesh" in note]
        assert len(found) == count
        assert all(note.startswith("component.pin.mesh.size: the volume of the mesh") for note in found)


def test_the_note_names_a_smaller_mesh(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(LIGHT)
    report = run(tmp_path, until="solve", db=tmp_path / "db", out=tmp_path / "out")
    (note,) = [one for one in report.notes if "error of the mesh" in one]
    assert "in impulse" in note
    assert "component.bar.mesh.size = 0.005" in note


PAIR = """
component.coarse.geometry = { kind = "bar", length = 1.0, area = 3.14e-4 }
component.coarse.material = { E = 210e9, nu = 0.3, rho = 7850 }
component.coarse.mesh.size = 0.04
component.coarse.modes.normal_count = 40
component.coarse.interface.back.surface = "left"
component.fine.geometry = { kind = "bar", length = 0.6, area = 3.14e-4 }
component.fine.material = { E = 210e9, nu = 0.3, rho = 7850 }
component.fine.mesh.size = 0.002
component.fine.modes.normal_count = 40
component.fine.interface.front.surface = "right"
body.coarse.position = [0.6, 0, 0]
body.fine.velocity = [1.0, 0, 0]
contact.pair = { body = "fine", interface = "front", against = { shape = "body", body = "coarse", interface = "back" } }
run = { duration = 8e-4, tolerance = 2e-3 }
"""


def test_the_note_names_the_mesh_that_matters(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(PAIR)
    report = run(tmp_path, until="solve", db=tmp_path / "db", out=tmp_path / "out")
    (note,) = [one for one in report.notes if "error of the mesh" in one]
    assert "component.coarse.mesh.size = 0.02" in note
    assert "component.fine" not in note


def test_a_scene_states_which_errors_are_noticed(tmp_path: Path) -> None:
    """The key changes no result, so that the run is not repeated."""
    (tmp_path / "scene.toml").write_text(LIGHT)
    own = {"db": tmp_path / "db", "out": tmp_path / "out"}
    assert any("error of the mesh" in one for one in run(tmp_path, until="solve", **own).notes)
    again = run(tmp_path, until="solve", set={"run.tolerance": 0.1}, **own)
    assert again.stages["solve"].state == "fresh"
    assert not any("in impulse" in one for one in again.notes)


@pytest.mark.parametrize("changes", [{"run__checks": False}, {"body__mass__velocity": [-1.0, 0, 0]}])
def test_a_run_without_checks_or_contact_has_none(changes: dict[str, Any], tmp_path: Path) -> None:
    assert not any(name.startswith("mesh.") for name in solved(tmp_path, **changes).estimates)
