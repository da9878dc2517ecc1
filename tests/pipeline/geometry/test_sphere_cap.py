"""A sphere with a cap falls on a rigid plane: force, duration and impulse of Hertz's impact."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import run
from gudgeon.solver.errors import SceneError

SCENE = """
[component.s]
geometry = { kind = "sphere", radius = 0.01, cap = { angle = 4.0, size = 1.3e-4 } }
mesh.size = 0.006
material = { E = 210e9, nu = 0.3, rho = 7850 }
interface.skin.surface = "SURFACE"
modes.normal_count = 6

[body.s]
position = [0, 0, 0.010001]
velocity = [0, 0, -0.5]

[contact.floor]
body = "s"
interface = "skin"
against = { shape = "plane", point = [0, 0, 0], normal = [0, 0, 1] }

[run]
duration = 8e-5
window = 3e-6
checks = false
"""
R, V = 0.01, 0.5
MASS, STIFFNESS = 7850 * 4 / 3 * np.pi * R**3, 4 / 3 * 210e9 / (1 - 0.3**2) * np.sqrt(R)


def test_the_cap_of_a_sphere_has_the_impact_of_hertz(tmp_path: Path) -> None:
    """δ = (5 m v²/(4 K))^(2/5), F = K δ^(3/2), T = 2.9432 δ/v: 1005 N, 60.2 µs; a has 2.5 elements."""
    (tmp_path / "scene.toml").write_text(SCENE.replace("SURFACE", "cap"))
    report = run(tmp_path / "scene.toml", until="solve", db=tmp_path / "db", out=tmp_path / "out")
    values = {name: quantity["value"] for name, quantity in report.quantities.items()}
    depth = (1.25 * MASS * V**2 / STIFFNESS) ** 0.4
    assert values["floor.force_peak"] == pytest.approx(STIFFNESS * depth**1.5, rel=0.03)
    assert values["floor.duration"] == pytest.approx(2.9432 * depth / V, rel=0.03)
    assert values["floor.impulse"] == pytest.approx(2 * MASS * V, rel=0.01)


def test_a_whole_sphere_before_a_plane_is_told_of_its_cap(tmp_path: Path) -> None:
    whole = SCENE.replace("SURFACE", "surface").replace(", cap = { angle = 4.0, size = 1.3e-4 }", "")
    (tmp_path / "scene.toml").write_text(whole)
    with pytest.raises(SceneError, match="the cap of a sphere"):
        run(tmp_path / "scene.toml", until="solve", db=tmp_path / "db", out=tmp_path / "out")


def test_a_cap_of_one_element_is_refused(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SCENE.replace("1.3e-4", "1e-3").replace("SURFACE", "cap"))
    with pytest.raises(InputError, match=r"cap\.size 0\.001 m is above the radius of the cap, 0\.00069"):
        run(tmp_path / "scene.toml", until="mesh", db=tmp_path / "db", out=tmp_path / "out")
