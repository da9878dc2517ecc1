"""The step of points that friction holds does not depend on the scene's axes."""

from dataclasses import replace
from pathlib import Path

import pytest

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.robustness.turning import turned
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.ports.stick import stick_frequency

SCENE = Path(__file__).parents[3] / "data/beam-sphere"


def test_a_beam_that_is_rigid_across_its_plane_is_held_alike_in_any_axes(tmp_path: Path) -> None:
    """Both tangents of a turned scene have a share of its flexibility, and together they depend on each other."""
    settings = {
        "contact.pair.friction.static": 0.3, "run.integrator": "small", "run.limits.angle": 1e3,
        "run.limits.offset": 1e6,
    }  # fmt: skip
    job = open_job(SCENE, set=settings, db=tmp_path / "db", out=tmp_path / "out")
    found = []
    for one in (job, replace(job, scene=turned(job.scene))):
        run_job(one, "morph")
        found.append(stick_frequency(system_of(one)))
    assert found[0] > 0
    assert found[1] == pytest.approx(found[0], rel=1e-9)
