"""Two solids whose meshes do not match, face to face: the patch test, by their records."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.system.compile import compile_system

SCENE = """
[component.upper]
geometry = {{ kind = "box", lx = 0.03, ly = 0.03, lz = 0.02 }}
material = {{ E = 210e9, nu = 0.3, rho = 7850.0 }}
mesh = {{ size = {upper} }}
supports = [{{ surface = "top", hold = ["z"] }}]
interface.face = {{ surface = "bottom" }}
modes = {{ normal_count = 10 }}

[component.lower]
geometry = {{ kind = "box", lx = 0.03, ly = 0.03, lz = 0.02 }}
material = {{ E = 210e9, nu = 0.3, rho = 7850.0 }}
mesh = {{ size = {lower} }}
supports = [{{ surface = "bottom", hold = ["z"] }}]
interface.face = {{ surface = "top" }}
modes = {{ normal_count = 10 }}

[body.upper]
position = [0.0, 0.0, 0.02]

[body.lower]

[contact.faces]
body = "upper"
interface = "face"
against = {{ shape = "body", body = "lower", interface = "face" }}

[run]
duration = 1e-4
"""
STIFFNESS = 210e9 / 0.04
"""Pressure per approach of the two ends [Pa/m]."""


@pytest.mark.parametrize(("upper", "lower"), [(0.007, 0.0095), (0.0095, 0.007)])
def test_patch_test(tmp_path: Path, upper: float, lower: float) -> None:
    """Blocks pressed together have a uniform pressure, E times the strain, to round-off."""
    path = tmp_path / "scene.toml"
    path.write_text(SCENE.format(upper=upper, lower=lower))
    job = open_job(path)
    run_job(job, "morph")
    system = compile_system(job.store, job.scene, job.morphs())
    elastic = system.stiffness > 0
    rows = system.rows[:, elastic]
    compliance = rows / system.stiffness[elastic] @ rows.T + system.residual
    assert system.gap == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.eigvalsh(compliance)[0] > 0
    forces = np.linalg.solve(compliance, np.full(len(compliance), 1e-6))
    areas = job.record("upper").interfaces["face"].areas
    assert len(areas) != len(job.record("lower").interfaces["face"].areas)
    assert forces / areas == pytest.approx(1e-6 * STIFFNESS, rel=1e-9)
    assert forces.sum() == pytest.approx(1e-6 * STIFFNESS * 0.03**2, rel=1e-11)
    moment = np.cross(system.contacts[0].points, [0.0, 0.0, 1.0]).T @ forces
    assert moment == pytest.approx(0.0, abs=1e-9 * forces.sum() * 0.03)
