"""CPU time of a pose of two parts of about 1000 panels each, from which that of 10⁴ poses in six axes follows."""

import time
from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.applications.electrostatics.poses import PoseProblem
from gudgeon.pipeline.kinds import open_job, run

SCENE = """
[conductor.gripper]
geometry = { kind = "box", lx = 40e-6, ly = 10e-6, lz = 10e-6 }
mesh.size = 4.4e-6
potential = 0.0

[conductor.part]
geometry = { kind = "box", lx = 40e-6, ly = 10e-6, lz = 10e-6 }
mesh.size = 4.4e-6
position = [0.0, 0.0, 15e-6]
potential = 20.0

[panels]
strips = 1
exponent = 2.0
corner_divisions = 0

[poses]
moved = ["part"]
x = { ends = [-4e-6, 4e-6], points = 5 }
y = { ends = [-4e-6, 4e-6], points = 5 }
z = { ends = [0.0, 2e-5], points = 5 }
rx = { ends = [-10, 10], points = 4 }
ry = { ends = [-6, 6], points = 4 }
rz = { ends = [-10, 10], points = 5 }
"""
READ = 200
"""Poses that are computed, evenly over the grid."""


@pytest.mark.benchmark(timer=time.process_time)
def test_poses(benchmark: object, tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    run(path, db=tmp_path / "db", out=tmp_path / "out", until="solve")
    job = open_job(path, db=tmp_path / "db", out=tmp_path / "out")
    record, grid = job.store.get(job.field().key, "field"), job.grid()
    problem, poses = PoseProblem(record, grid.moved), grid.poses()
    assert len(poses) == 10_000
    chosen = iter(poses[np.linspace(0, len(poses) - 1, READ).astype(int)])
    problem.at(np.zeros(6))
    benchmark.pedantic(lambda: problem.at(next(chosen)), rounds=READ, iterations=1)  # type: ignore[operator, attr-defined]
    mean = benchmark.stats.stats.mean  # type: ignore[attr-defined]
    print(f"{record.counts['panels']} panels, {mean:.2f} s a pose, {mean * 1e4 / 3600:.1f} h for 10^4 poses on a core")
