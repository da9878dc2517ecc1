"""Peak memory and CPU time of a conductor of nearly as many panels as a scene may have."""

import json
import subprocess
import sys
import time
from pathlib import Path

import pytest

from gudgeon.pipeline.applications.electrostatics.conductors import MOST_PANELS

SCENE = """
[conductor.block]
geometry = { kind = "box", lx = 1.0, ly = 1.0, lz = 0.96 }
mesh.size = 0.09
potential = 1.0
"""
MOST = 4e9
"""Memory of the process that is allowed [bytes]."""
COUNTED = """
import json, resource, sys
from gudgeon.pipeline.kinds import run
scene, database, out = sys.argv[1:]
run(scene, db=database, out=out, until="solve")
counts = json.load(open(f"{out}/summary.json"))["counts"]
print(json.dumps(counts | {"bytes": 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss}))
"""


@pytest.mark.benchmark(timer=time.perf_counter)
def test_most_panels(benchmark: object, tmp_path: Path) -> None:
    """In a process of its own, whose peak is that of this run alone."""
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    command = [sys.executable, "-c", COUNTED, str(path), str(tmp_path / "db"), str(tmp_path / "out")]
    done = benchmark.pedantic(  # type: ignore[attr-defined]
        lambda: subprocess.run(command, check=True, capture_output=True, text=True), rounds=1, iterations=1
    )
    found = json.loads(done.stdout.splitlines()[-1])
    assert 0.9 * MOST_PANELS < found["panels"] <= MOST_PANELS
    # What grows with the panels is that of their matrix and that of the coarse ones, a quarter as many.
    grows = 8 * (MOST_PANELS**2 - found["panels"] ** 2) * (1 + 1 / 16)
    assert found["bytes"] + grows < MOST
    print(f"{found['panels']} panels: {found['bytes'] / 1e9:.2f} GB, {found['cpu_seconds']:.0f} s of CPU time")
