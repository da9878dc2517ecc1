"""A rigid block on three or four points slides to rest: more places across than a rigid body has motions."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job

GRAVITY, HEIGHT = 9.81, 0.02
FEET = {
    "three": [(0.05, 0.03), (-0.05, 0.03), (0.0, -0.06)],
    "four": [(0.05, 0.03), (-0.05, 0.03), (0.05, -0.03), (-0.05, -0.03)],
    "six": [(0.05, 0.03), (0.0, 0.03), (-0.05, 0.03), (0.05, -0.03), (0.0, -0.03), (-0.05, -0.03)],
}
CONTACT = """
[contact.{name}]
body = "b"
interface = "{name}"
against = {{ shape = "plane", point = [0, 0, 0], normal = [0, 0, 1] }}
surface_stiffness = {layer}
friction = {{ static = {friction} }}
"""


def slid(folder: Path, feet: str, speed: tuple[float, float], layer: float, friction: float, run: str) -> Trajectory:
    """Return the run of a block that starts flat on a floor with a speed [m/s]."""
    names = [f"f{i}" for i in range(len(FEET[feet]))]
    points = ", ".join(
        f"{name} = {{ at = [{x}, {y}, {-HEIGHT}], normal = [0, 0, -1], area = 1e-4 }}"
        for name, (x, y) in zip(names, FEET[feet], strict=True)
    )
    geometry = f'kind = "rigid", mass = 2.0, inertia = [0.01, 0.01, 0.01], points = {{ {points} }}'
    (folder / "scene.toml").write_text(
        f"component.b.geometry = {{ {geometry} }}\n"
        + "".join(f'component.b.interface.{name}.surface = "{name}"\n' for name in names)
        + f"body.b = {{ position = [0, 0, {HEIGHT}], velocity = [{speed[0]}, {speed[1]}, 0] }}\n"
        + f"run = {{ gravity = [0, 0, {-GRAVITY}], limits.offset = 1.0, {run} }}\n"
        + "".join(CONTACT.format(name=name, layer=layer, friction=friction) for name in names)
    )
    job = open_job(folder, db=folder / "db", out=folder / "out")
    assert isinstance(job, Job)
    report = run_job(job, "solve")
    assert report.result == "FINISHED", report.reason
    found: Trajectory = job.store.get(job.trajectory().key, "trajectory")
    return found


@pytest.mark.parametrize(
    ("feet", "speed", "layer", "friction", "run"),
    [
        ("three", (1.0, 0.0), 1e10, 0.2, "duration = 0.6, step = 1.5e-3"),
        ("three", (1.0, 0.0), 1e10, 0.2, "duration = 0.6, step = 2e-4"),
        ("four", (0.8, 0.1), 1e11, 0.3, "duration = 0.5, step = 6.25e-4"),
        ("four", (0.8, 0.1), 1e11, 0.3, "duration = 0.5, step = 3e-4"),
        ("six", (0.5, -0.4), 1e11, 0.25, "duration = 0.4, step = 4e-4"),
    ],
)  # fmt: skip
def test_a_rigid_block_slides_to_rest_and_stays(
    feet: str, speed: tuple[float, float], layer: float, friction: float, run: str, tmp_path: Path
) -> None:
    """Its way is v²/(2 μ g); no step fails, though its points are held at places that no motion of it reaches.

    It starts without force and rocks, and its points come to touch while others are held.
    """
    found = slid(tmp_path, feet, speed, layer, friction, run)
    size = float(np.hypot(*speed))
    way, stop = size**2 / (2 * friction * GRAVITY), size / (friction * GRAVITY)
    places = found.motion["b"][:, :2]
    assert np.linalg.norm(places[-1]) == pytest.approx(way, rel=2e-3)
    late = places[found.times > 1.15 * stop]
    assert len(late) >= 10
    assert np.ptp(late, axis=0).max() < 1e-3 * way
    assert found.energy_drift < 1e-3
