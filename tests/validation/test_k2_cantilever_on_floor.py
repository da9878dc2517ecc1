"""Reference case K2: a cantilever under its weight above a rigid floor, which it touches at its tip or over a length.

Closed forms of Euler-Bernoulli, values in K2_cantilever_on_floor.json; the part is plane stress with ν = 0, so that
beam theory holds but for shear, which is below 1e-3 at this slenderness.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.system import System

REFERENCE = json.loads((Path(__file__).parent / "K2_cantilever_on_floor.json").read_text())
PARAMETERS, TABLE = REFERENCE["parameters"], REFERENCE["expected"]["table"]
DENSITY = 7850.0
PER_GRAVITY = DENSITY * PARAMETERS["width"] * PARAMETERS["height"]
"""Load per length over gravity [kg/m]."""
FLOOR = -PARAMETERS["height"] / 2 - PARAMETERS["gap"]
L, H, B = (PARAMETERS[name] for name in ("L", "height", "width"))
SCENE = f"""
[component.beam]
geometry = {{ kind = "rectangle", lx = {L}, ly = {H}, thickness = {B} }}
material = {{ E = {PARAMETERS["E"]}, nu = 0.0, rho = {DENSITY} }}
mesh = {{ size = 0.0025 }}
supports = ["left"]
interface.below = {{ surface = "bottom" }}
modes = {{ reduction = "macneal", normal_count = 20 }}

[body.beam]

[contact.floor]
body = "beam"
interface = "below"
surface_stiffness = 1e14  # 1e-8 m under the largest pressure; without it the points on the support could not yield
against = {{ shape = "plane", point = [0.0, {FLOOR}, 0.0], normal = [0.0, 1.0, 0.0] }}

[run]
duration = 1e-4
samples = 10
frames = 2
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("k2")


def compiled(folder: Path, load: float, **run: Any) -> System:
    (folder / "scene.toml").write_text(SCENE)
    settings = {"run.gravity": [0.0, -load / PER_GRAVITY, 0.0]} | {f"run.{key}": value for key, value in run.items()}
    job = open_job(folder / "scene.toml", set=settings, db=folder / "db", out=folder / "out")
    run_job(job, "morph")
    return system_of(job)


@pytest.mark.parametrize("case", TABLE, ids=[f"{entry['load_per_length']:g} N/m" for entry in TABLE])
def test_the_floor_carries_its_share_at_the_start(folder: Path, case: dict[str, float]) -> None:
    system = compiled(folder, case["load_per_length"])
    reaction = float(system.start_forces.sum())
    assert reaction == pytest.approx(case["reaction"], rel=0.01)
    gaps = system.gap + system.rows @ system.position + system.compliance @ system.start_forces
    assert gaps.min() > -1e-9 * PARAMETERS["gap"]
    moment = float(case["load_per_length"] * PARAMETERS["L"] ** 2 / 2)
    arms = system.contacts[0].points[:, 0] + PARAMETERS["L"] / 2
    assert moment - float(system.start_forces @ arms) == pytest.approx(case["clamp_moment"], rel=0.01)


def test_nothing_moves_after_the_start(folder: Path) -> None:
    found = simulate(compiled(folder, 590.0))
    pressed = np.linalg.norm(found.contacts["floor"].force, axis=1)
    np.testing.assert_allclose(pressed, pressed[0], rtol=1e-6)
    stored = found.energies[:, 1].max()
    assert found.energies[:, 0].max() < 1e-9 * stored
    # Relative to the energy that contact exchanges, which is that of round-off here.
    assert found.energy_drift < 1e-6


def test_a_damped_body_at_rest_on_a_floor_finishes(tmp_path: Path) -> None:
    """Its exchange of energy is round-off, which no error of energy is compared with."""
    path = tmp_path / "scene.toml"
    path.write_text(
        """
component.bar.geometry.kind = "beam"
component.bar.geometry.theory = "euler-bernoulli"
component.bar.geometry.length = 0.5
component.bar.geometry.section = { kind = "rectangle", width = 0.01, height = 0.005 }
component.bar.mesh.size = 0.05
component.bar.material = { E = 210e9, nu = 0.3, rho = 7850.0 }
component.bar.supports = ["left"]
component.bar.interface.tip.surface = "right-bottom"
component.bar.modes.normal_count = 6
body.bar.damping = { ratio = 0.05, frequency = 20.0 }
run = { duration = 0.002, gravity = [0.0, 0.0, -9.81] }

[contact.floor]
body = "bar"
interface = "tip"
against = { shape = "plane", point = [0.0, 0.0, -0.003], normal = [0.0, 0.0, 1.0] }
"""
    )
    job = open_job(path, db=tmp_path / "db", out=tmp_path / "out")
    run_job(job, "morph")
    found = simulate(system_of(job))
    assert found.result == "FINISHED"
    assert found.energy_drift < 1e-3
    # 3 E I / L³ times what the sag of ρ A g L⁴ / 8 E I is above the gap.
    bending, weight = 210e9 * 0.01 * 0.005**3 / 12, 7850.0 * 5e-5 * 9.81
    gap = 0.003 - 0.0025
    expected = 3 * bending / 0.5**3 * (weight * 0.5**4 / (8 * bending) - gap)
    np.testing.assert_allclose(found.contacts["floor"].force[-1, 2], expected, rtol=1e-3)
