"""The reference that force.png draws: where the file of a shipped scene has a force over time, the scene names it."""

import json
from pathlib import Path

import numpy as np
import pytest

import gudgeon
from gudgeon.pipeline.stages.reference_curve import reference_curve
from tests.scenes import scene_files, scene_path


def one_contact_scenes() -> dict[str, Path]:
    """Return the files of the scenes with one contact and a file of reference values, by name."""
    files = {}
    for name, path in scene_files().items():
        scene = gudgeon.open_job(path).scene
        contacts, report = getattr(scene, "contact", {}), getattr(scene, "report", None)
        if len(contacts) == 1 and report is not None and report.reference is not None:
            files[name] = path
    return files


def test_every_known_force_over_time_is_drawn() -> None:
    """A history, or a plateau of which height and duration are known."""
    drawn = []
    for name, path in one_contact_scenes().items():
        report = gudgeon.open_job(path).scene.report
        content = json.loads((path.parent / report.reference).read_text(encoding="utf-8"))
        if "histories" in content or "contact_force_plateau" in content["expected"]:
            assert report.history or report.pulse, path
            drawn.append(name)
    assert {"rods-3d/scene.toml", "bars-longitudinal/wall.toml", "bouncing-bar/scene.toml"} <= set(drawn)


@pytest.mark.parametrize(
    "name", ["rods-3d/scene", "bars-longitudinal/scene", "bars-longitudinal/wall", "bouncing-bar/scene"]
)
def test_the_curve_has_the_impulse_of_its_file(name: str) -> None:
    """The area below the curve is the impulse that stands beside it."""
    path = scene_path(f"{name}.toml")
    scene = gudgeon.open_job(path).scene
    curve = reference_curve(path, scene, lambda step: None)
    assert curve is not None
    known = json.loads((path.parent / scene.report.reference).read_text(encoding="utf-8"))["expected"]["impulse"]
    times, force = np.array(curve["times"]), np.array(curve["force"])
    area = float((np.diff(times) * (force[1:] + force[:-1])).sum() / 2)
    assert area == pytest.approx(known["value"], rel=1e-12)
