"""A body that meets itself: the tines of a fork that falls on a floor, against full FE of the same mesh."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.nodal.scene.problem import nodal_problem
from gudgeon.pipeline.nodal.sliding.loop import simulate_nodal
from gudgeon.pipeline.robustness.turning import turned
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.errors import SceneError

FORK = """SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 0.06, 0.01, 0.006};
Box(2) = {0, 0, 0.0062, 0.06, 0.01, 0.006};
Box(3) = {-0.006, 0, 0, 0.006, 0.01, 0.0122};
BooleanUnion(4) = { Volume{1}; Delete; }{ Volume{2,3}; Delete; };
"""
SCENE = """
[component.fork]
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
mesh.size = 0.006
interface.low = { surface = "low", kind = "points" }
interface.high = { surface = "high", kind = "points" }
interface.side = { surface = "side", kind = "points" }
interface.foot = { surface = "bottom", kind = "points" }
modes = { normal_count = 60 }
geometry.kind = "cad"
geometry.path = "fork.geo"
geometry.unit = 1.0
geometry.surfaces.low = { at = [0.03, 0.005, 0.006] }
geometry.surfaces.high = { at = [0.03, 0.005, 0.0062] }
geometry.surfaces.side = { at = [0.03, 0.0, 0.003] }
geometry.surfaces.bottom = { at = [0.03, 0.005, 0.0] }

[body.fork]
position = [0.0, 0.0, 1e-5]
velocity = [0.0, 0.0, -2.0]

[contact.floor]
body = "fork"
interface = "foot"
against = { shape = "plane", point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }
surface_stiffness = 1e11

[contact.tines]
body = "fork"
interface = "low"
against = { shape = "body", body = "fork", interface = "high" }
surface_stiffness = 1e11

[run]
duration = 0.0006
checks = false
"""
COMPARED = {"floor.impulse": 1e-4, "tines.start": 1e-4, "tines.impulse": 1e-4, "fork.velocity_z": 1e-4}


def job_of(folder: Path, **settings: Any) -> Job:
    folder.mkdir(exist_ok=True)
    (folder / "fork.geo").write_text(FORK, encoding="utf-8")
    (folder / "scene.toml").write_text(SCENE, encoding="utf-8")
    given = {key.replace("__", "."): value for key, value in settings.items()}
    return open_job(folder / "scene.toml", set=given, db=folder / "db", out=folder / "out")


def test_the_tines_have_the_impulse_of_full_fe(tmp_path: Path) -> None:
    job = job_of(tmp_path)
    run_job(job, "solve")
    found = job.store.get(job.trajectory().key, "trajectory", only=["quantities"]).quantities
    run = simulate_nodal(nodal_problem(job), 4e-7)
    for name, allowed in COMPARED.items():
        assert found[name]["value"] == pytest.approx(run.quantities[name]["value"], rel=allowed), name
    # What the tines exchange moves the body not at all: the floor alone does.
    mass = found["floor.impulse"]["value"] / (found["fork.velocity_z"]["value"] + 2.0)
    assert mass == pytest.approx(7850 * 0.01 * (2 * 0.06 * 0.006 + 0.006 * 0.0122), rel=1e-6)
    assert not [name for name in (*found, *run.quantities) if name.startswith("tines.rebound")]


@pytest.mark.parametrize(
    ("settings", "line"),
    [
        ({"contact__tines__against__interface": "low"}, "'low' of 'fork' on both sides"),
        ({"contact__tines__against__interface": "side"}, "'side' shares 10 points with 'low'"),
        ({"contact__tines__interface": "auto"}, "'auto' finds surfaces of two different bodies"),
        (
            {
                "contact__tines__against": {"shape": "surface", "body": "fork", "interface": "high"},
                "component__fork__interface__high": {
                    "surface": "high",
                    "kind": "traction",
                    "along": [1.0, 0.0, 0.0],
                    "spacing": [0.01, 0.005],
                },
            },
            "traction space of their own body",
        ),
        ({"run__integrator": "turning"}, "'turning' does not support"),
    ],
)
def test_what_is_no_contact_of_a_body_with_itself_is_one_line(
    tmp_path: Path, settings: dict[str, Any], line: str
) -> None:
    with pytest.raises((InputError, SceneError), match=re.escape(line)):
        run_job(job_of(tmp_path, **settings), "solve")


STRUCK = ("floor.impulse", "tines.start", "tines.impulse")


def solved(job: Job) -> dict[str, float]:
    """Return what is compared of a run, which keeps energy and momentum."""
    run_job(job, "solve")
    wanted = ["quantities", "energy_drift", "momentum_residual"]
    found = job.store.get(job.trajectory().key, "trajectory", only=wanted)
    assert found.momentum_residual < 1e-12
    assert found.energy_drift < 1e-4
    return {name: found.quantities[name]["value"] for name in STRUCK}


def test_tines_strike_alike_by_the_implicit_integrator_and_turned(tmp_path: Path) -> None:
    """Impulses to 1e-4 between integrators, to 1e-9 where the whole is turned about an axis across all normals."""
    job = job_of(tmp_path)
    found = solved(job)
    turned_one = solved(replace(job, scene=turned(job.scene)))
    implicit = solved(job_of(tmp_path, run__integrator="small", run__step=5e-7))
    for name in STRUCK:
        assert turned_one[name] == pytest.approx(found[name], rel=1e-9), name
        assert implicit[name] == pytest.approx(found[name], rel=1e-4), name


def test_friction_between_tines_moves_the_fork_not_at_all(tmp_path: Path) -> None:
    """Internal forces: with friction on the tines alone, the floor's impulse still is all that moves the fork."""
    job = job_of(
        tmp_path, run__step=5e-7, contact__tines__friction={"static": 0.5}, body__fork__velocity=[0.5, 0.0, -2.0]
    )
    run_job(job, "solve")
    found = job.store.get(job.trajectory().key, "trajectory", only=["quantities", "energies"])
    mass = found.quantities["floor.impulse"]["value"] / (found.quantities["fork.velocity_z"]["value"] + 2.0)
    assert mass == pytest.approx(7850 * 0.01 * (2 * 0.06 * 0.006 + 0.006 * 0.0122), rel=1e-6)
    assert found.quantities["fork.velocity_x"]["value"] == pytest.approx(0.5, rel=1e-9)
    assert found.energies[-1, 3] > 0  # It rubs.


SPRINGS = {
    "contact__floor__method": "penalty", "contact__floor__law": {"kind": "linear", "stiffness": 2e6},
    "contact__floor__surface_stiffness": "unset", "contact__tines__surface_stiffness": "unset",
    "component__fork__mesh__size": 0.005, "component__fork__modes__normal_count": 20, "run__duration": 3e-4,
}  # fmt: skip
"""Of a floor that both small motion and mechanisms have."""


@pytest.mark.validation
def test_a_fork_that_may_turn_meets_itself_as_one_of_small_motion(tmp_path: Path) -> None:
    """Points on splines of 5 by 2.5 mm in a mechanism, points on facets in small motion: to 2 %."""
    space = {"surface": "high", "kind": "traction", "along": [1.0, 0.0, 0.0], "spacing": [0.005, 0.0025]}
    splines = {"shape": "surface", "body": "fork", "interface": "high"}
    found = solved(job_of(tmp_path / "small", **SPRINGS))
    turns = {"component__fork__interface__high": space, "contact__tines__against": splines}
    turning = solved(job_of(tmp_path / "turning", **SPRINGS, **turns, run__integrator="turning"))
    for name in STRUCK:
        assert turning[name] == pytest.approx(found[name], rel=2e-2), name
