"""Full FE of a face that overhangs another: its layer has the area that both share."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.nodal.problem import PointProblem
from gudgeon.pipeline.nodal.scene.problem import nodal_problem
from gudgeon.pipeline.stages.run import run_job

EDGE, LAYER = 0.02, 1e9
SCENE = """
component.a.geometry = { kind = "box", lx = 0.02, ly = 0.02, lz = 0.02 }
component.a.mesh.size = 0.007
component.a.material = { E = 210e9, nu = 0.3, rho = 7850 }
component.a.interface.top.surface = "top"
component.b.geometry = { kind = "box", lx = 0.02, ly = 0.02, lz = 0.03 }
component.b.mesh.size = 0.01
component.b.material = { E = 210e9, nu = 0.3, rho = 7850 }
component.b.interface.bottom.surface = "bottom"
body.a = {}
run.duration = 1e-3

[body.b]
position = [0.0, 0.0, 0.020001]
velocity = [0.0, 0.0, -0.1]

[contact.touch]
body = "a"
interface = "top"
method = "penalty"
against = { shape = "body", body = "b", interface = "bottom" }
"""


@pytest.mark.parametrize(
    ("body", "area"),
    [
        ({}, EDGE**2),
        ({"position": [EDGE / 2, 0.0, 0.020001]}, EDGE**2 / 2),
        # Two squares of the same centre, turned by 45 degrees, share a regular octagon.
        ({"orientation": {"axis": [0, 0, 1], "angle": 45}}, 2 * (np.sqrt(2) - 1) * EDGE**2),
    ],
)
def test_stiffness_is_of_the_shared_area(tmp_path: Path, body: dict[str, Any], area: float) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    changes = {f"body.b.{key}": value for key, value in body.items()}
    for contact, stiffness in (
        ({"contact.touch.surface_stiffness": LAYER}, LAYER * area),
        ({"contact.touch.law": {"kind": "hertz", "stiffness": 1e9}}, 1e9),
    ):
        job = open_job(tmp_path / "scene.toml", set=changes | contact, db=tmp_path / "db", out=tmp_path / "out")
        run_job(job, "morph")
        problem = nodal_problem(job)
        assert isinstance(problem, PointProblem)
        law = problem.contacts["touch"].law
        assert law is not None
        assert law[:, 0].sum() == pytest.approx(stiffness, rel=0.02)
        # A point that meets nothing has no share.
        assert not law[problem.contacts["touch"].gap > 1.0, 0].any()
