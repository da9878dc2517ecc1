"""A free part whose only load is a pressure on a face."""

from pathlib import Path

import pytest

from gudgeon.pipeline.kinds import run

SCENE = """
component.p.geometry = { kind = "box", lx = 0.03, ly = 0.03, lz = 0.03 }
component.p.material = { E = 210e9, nu = 0.3, rho = 7850 }
component.p.mesh.size = 0.015
component.p.interface.top = { surface = "top", kind = "pressure" }
component.p.modes.normal_count = 6
body.p = { }
force.p = { kind = "pressure", body = "p", interface = "top", expression = "1e4" }
run = { duration = 1e-2, checks = false }
"""


def test_a_free_part_under_pressure_alone_moves_by_it(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    report = run(tmp_path / "scene.toml", db=tmp_path / "db", out=tmp_path / "out", until="solve")
    speed = 1e4 * 0.03**2 * 1e-2 / (7850 * 0.03**3)
    assert abs(report.quantities["p.velocity_z"]["value"]) == pytest.approx(speed, rel=1e-6)
