"""Scenes turned as a whole: the scalars of a result do not depend on the axes in which the scene is written."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.exporters.export import export
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.robustness.turning import ANY, CYCLIC, turned
from gudgeon.pipeline.scenes.reading import merged
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.scene.body import ALL_FREE
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from tests.pipeline.small import write_scene
from tests.scenes import scene_path
from tests.solver.systems import (
    block_records,
    block_scene,
    build_all,
    driven_pair_records,
    driven_pair_scene,
    pair_scene,
    piston_records,
    piston_scene,
    plate_records,
)

SAME = 1e-9
VECTORS = ("displacement", "velocity")


def compared(one: Trajectory, other: Trajectory, scene: Scene) -> None:
    """Compare scalars, and vectors turned back."""
    held = any(tuple(body.freedom) != ALL_FREE for body in scene.body.values())
    Q = (CYCLIC if held else ANY).matrix()
    sizes: dict[str, float] = {}
    for item in one.quantities.values():
        sizes[item["unit"]] = max(sizes.get(item["unit"], 0.0), abs(item["value"]))
    for name, item in one.quantities.items():
        if not name.endswith(("_x", "_y", "_z")):
            close(other.quantities[name]["value"], item["value"], sizes[item["unit"]])
    close(other.energies, one.energies, np.abs(one.energies).max())
    for name, contact in one.contacts.items():
        close(other.contacts[name].force, contact.force @ Q.T, np.abs(contact.force).max())
    for name, motion in one.motion.items():
        turned_motion = np.column_stack([motion[:, k : k + 3] @ Q.T for k in range(0, 12, 3)])
        close(other.motion[name], turned_motion, np.abs(motion).max())
    for name, joint in one.joints.items():
        close(other.joints[name].force, joint.force @ Q.T, np.abs(joint.force).max())
    assert set(one.gauges) == set(other.gauges)
    for name, values in one.gauges.items():
        close(other.gauges[name], values, np.abs(values).max())


def close(found: Any, expected: Any, size: float) -> None:
    np.testing.assert_allclose(found, expected, rtol=SAME, atol=SAME * float(size))


def run_of(job: Job) -> Trajectory:
    assert run_job(job, "solve").result == "FINISHED"
    return job.store.get(job.trajectory().key, "trajectory")


SCENES: dict[str, dict[str, Any]] = {
    "rod-wall": {}, "bars-longitudinal": {}, "hertz": {}, "rods-3d": {}, "beam-sphere/i-beam.toml": {},
    "rigid/rolling.toml": {},
    "pendulum": {"run.duration": 0.01, "run.start": "undeformed", "run.gravity": [0.0, 0.0, -9.0]},
}  # fmt: skip


@pytest.mark.validation
@pytest.mark.parametrize("name", SCENES)
def test_a_shipped_scene(name: str, tmp_path: Path) -> None:
    job = open_job(scene_path(name), set=SCENES[name], db=tmp_path / "db", out=tmp_path / "a")
    other = replace(job, scene=turned(job.scene), out=tmp_path / "b")
    compared(run_of(job), run_of(other), job.scene)


def test_turned_bars_of_two_orientations(tmp_path: Path) -> None:
    """Bars are the same about their axes."""
    job = open_job(scene_path("bars-longitudinal"), db=tmp_path / "db", out=tmp_path / "a")
    changes = {f"body.{n}.orientation": {"axis": [1.0, 0, 0], "angle": a} for n, a in (("one", 77.0), ("two", -30.0))}
    mixed = open_job(scene_path("bars-longitudinal"), set=changes, db=tmp_path / "db", out=tmp_path / "b")
    mixed = replace(mixed, scene=turned(mixed.scene))
    compared(run_of(job), run_of(mixed), job.scene)


SHORT: dict[str, Any] = {"duration": 1e-3, "step": 2e-7, "samples": 400}
LAYER = {"surface_stiffness": 1e14}
CASES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "block": ({"part": block_records(5)}, merged(block_scene(**LAYER), {"run": {"gravity": [3.0, 5.0, -7.0]}})),
    "sliding pair": (
        {"part": block_records(5), "plate": plate_records()}, pair_scene(duration=1e-3, step=1e-6),
    ),
    "free sliding pair": (
        {"part": block_records(5), "plate": plate_records(free=True)},
        merged(pair_scene(duration=4e-4, step=1e-6), {"body": {"part": {"freedom": list(ALL_FREE)}}}),
    ),
    "elastic piston": ({"part": piston_records(6)}, piston_scene(clearance=1e-5, **SHORT)),
    "piston on a plate": (driven_pair_records(6), driven_pair_scene(clearance=1e-5, **SHORT)),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_joints_loads_and_sliding_pairs(name: str, tmp_path: Path) -> None:
    records, tables = CASES[name]
    scene = Scene.model_validate(tables)
    found = [
        simulate(build_all(tmp_path / str(number), records, one.model_dump()))
        for number, one in enumerate((scene, turned(scene)))
    ]
    assert [one.result for one in found] == ["FINISHED"] * 2
    assert any(contact.force.any() for contact in found[0].contacts.values())
    compared(*found, scene)


def test_exports_and_pictures_of_a_turned_skirt(tmp_path: Path) -> None:
    """Files for other programs have nodes and vectors in the axes of the scene; pictures are drawn."""
    job = open_job(write_scene(tmp_path / "skirt"), db=tmp_path / "db", out=tmp_path / "a")
    other, Q = replace(job, scene=turned(job.scene), out=tmp_path / "b"), ANY.matrix()
    first, second = (meshio.read(export(at, "results", 10)[1]) for at in (job, other))
    assert np.abs(first.point_data["displacement"]).max() > 0
    for one, again in ((first.points, second.points), *((first.point_data[n], second.point_data[n]) for n in VECTORS)):
        close(again, one @ Q.T, np.abs(one).max())
    pressure = first.point_data["contact_pressure"]
    close(second.point_data["contact_pressure"], pressure, np.abs(pressure).max())
    report = run_job(other, "plot")
    assert {"force.png", "deformation.png", "pressure.png"} <= {path.name for path in other.out.iterdir()}, report.notes
