"""Estimated errors of the modal basis of bodies that turn, beside true ones against runs with many more modes."""

from pathlib import Path
from typing import Any

import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.run import run_job

BEAM = """
[component.part]
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
mesh.size = 0.02
[component.part.geometry]
kind = "beam"
theory = "euler-bernoulli"
length = 0.5
motion = "space"
section = { kind = "rectangle", width = 0.02, height = 0.02 }
[component.part.interface]
tip = { surface = "right-bottom" }
[body.part]
position = [0.0, 0.0, 0.1]
orientation = { axis = [0.0, 1.0, 0.0], angle = 10.0 }
velocity = [0.3, 0.0, -1.0]
angular_velocity = [0.0, 5.0, 0.0]
[contact.stop]
body = "part"
interface = "tip"
against = { shape = "plane", point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }
method = "penalty"
law = { kind = "hertz", stiffness = 1e9 }
[run]
integrator = "turning"
duration = 0.02
window = 2e-4
"""
BLOCK = """
[component.part]
geometry = { kind = "box", lx = 0.02, ly = 0.02, lz = 0.2 }
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
mesh.size = 0.02
interface.tip = { surface = "bottom", kind = "points" }
[body.part]
position = [0.0, 0.0, 0.0009]
orientation = { axis = [0.0, 1.0, 0.0], angle = 4.0 }
velocity = [0.0, 0.0, -1.0]
[contact.stop]
body = "part"
interface = "tip"
against = { shape = "plane", point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }
surface_stiffness = 1e13
[run]
integrator = "turning"
duration = 6e-4
window = 5e-5
"""


def solved(text: str, modes: int, folder: Path, **more: Any) -> tuple[Trajectory, list[str]]:
    folder.mkdir(exist_ok=True)
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    changes = {"component.part.modes.normal_count": modes} | more
    job = open_job(folder / "scene.toml", set=changes, db=folder / "db", out=folder / f"out{modes}")
    done = run_job(job, until="solve")
    assert done.result == "FINISHED", done.notes
    found: Trajectory = job.store.get(done.stages["solve"].key, "trajectory")
    return found, done.notes


@pytest.mark.validation
@pytest.mark.parametrize("text", [BEAM, BLOCK], ids=["beam", "block"])
def test_no_estimate_is_below_the_error(text: str, tmp_path: Path) -> None:
    many = solved(text, 48, tmp_path, **{"run.checks": False})[0]
    assert not many.estimates
    for modes in (8, 16):
        found, _ = solved(text, modes, tmp_path)
        for name, key in (("impulse", "basis.impulse"), ("force_peak", "basis.force")):
            error = abs(found.quantities[f"stop.{name}"]["value"] / many.quantities[f"stop.{name}"]["value"] - 1)
            assert error < found.estimates[key] < max(60 * error, 0.02), (modes, name)


def test_a_note_names_what_reduces_it(tmp_path: Path) -> None:
    """A law at a point of a body that turns cannot be had together with its residual flexibility."""
    _, notes = solved(BEAM, 8, tmp_path)
    (note,) = [one for one in notes if "modal basis" in one]
    assert "component.part.modes.normal_count = 16" in note
    assert "residual" not in note


def test_layers_are_judged_as_in_small_motion(tmp_path: Path) -> None:
    turning, _ = solved(BLOCK, 8, tmp_path / "a")
    small, _ = solved(BLOCK, 8, tmp_path / "b", **{"run.integrator": "small"})
    for key in ("layer.impulse", "layer.force"):
        assert turning.estimates[key] == pytest.approx(small.estimates[key], rel=0.1, abs=2e-3)
