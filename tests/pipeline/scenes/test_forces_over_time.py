"""Forces over time in scene files: tables, kinds of interfaces, other units, turned scenes, full FE."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.nodal.scene.problem import nodal_problem
from gudgeon.pipeline.robustness.turning import turned
from gudgeon.pipeline.robustness.units import Units, rescaled
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job
from tests.validation.test_turned_scenes import compared

SCENE = """
[component.block]
geometry = { kind = "box", lx = 0.03, ly = 0.02, lz = 0.025 }
material = { E = 72e9, nu = 0.33, rho = 2700.0 }
mesh = { size = 0.012 }
interface.top = { surface = "top", kind = "mean" }
interface.lid = { surface = "top", kind = "pressure" }
interface.sole = { surface = "bottom" }
modes = { normal_count = 6, static_count = 2 }

[component.floor]
geometry = { kind = "box", lx = 0.03, ly = 0.02, lz = 0.01 }
material = { E = 72e9, nu = 0.33, rho = 2700.0 }
mesh = { size = 0.012 }
interface.top = { surface = "top" }
interface.under = { surface = "bottom", kind = "mean" }
supports = ["left"]
modes = { normal_count = 6, static_count = 2 }

[body.block]
position = [0.0, 0.0, 0.02]

[body.floor]
position = [0.0, 0.0, -0.01]
damping = { ratio = 0.02 }

[force.push]
kind = "force"
body = "block"
interface = "top"
direction = [0.1, 0.2, -1.0]
table = "push.csv"

[force.lid]
kind = "pressure"
body = "block"
interface = "lid"
expression = "1e5 * (1 + sin(2e4*t))"

[force.back]
kind = "force"
body = "floor"
interface = "under"
direction = [0.0, 0.0, 1.0]
expression = "1e3 * step(t - 4e-5)"

[contact.floor]
body = "block"
interface = "sole"
against = { shape = "plane", point = [0.0, 0.0, 0.01999], normal = [0.0, 0.0, 1.0] }
surface_stiffness = 1e14

[run]
duration = 1e-4
step = 1e-7
checks = false
samples = 400
frames = 20
limits = { angle = 0.5 }
"""
TABLE = "time [s],force [N]\n0,0\n4e-5,2e3\n1,2e3\n"


def job_of(folder: Path, table: str = TABLE, **changes: Any) -> Job:
    (folder / "scene.toml").write_text(SCENE)
    (folder / "push.csv").write_text(table)
    return open_job(folder, set=changes, db=folder / "db", out=folder / "out")


def test_a_scene_with_all_of_them_in_any_axes(tmp_path: Path) -> None:
    job = job_of(tmp_path)
    other, found = replace(job, scene=turned(job.scene), out=tmp_path / "turned"), []
    for one in (job, other):
        assert run_job(one, "solve").result == "FINISHED"
        found.append(one.store.get(one.trajectory().key, "trajectory"))
    assert found[0].contacts["floor"].force.any()
    assert found[0].energy_drift < 5e-3  # Of the contact: it is 2e-15 without.
    assert found[0].momentum_residual < 1e-12
    compared(*found, job.scene)


@pytest.mark.parametrize(
    ("table", "changes", "line"),
    [
        ("t,f\n0,0\n5e-5,1\n", {}, "force.push.table: reaches from 0 to 5e-05 s, the run from 0 to run.dur"),
        ("t,f\n0,0\n1,x\n", {}, "push.csv"),
        ("t,f\n0,0\n1,1\n0.5,1\n", {}, "push.csv: row 4: 0.5 must be above 1 of the row before"),
        (TABLE, {"force.push.table": "none.csv"}, "force.push.table: no file 'none.csv'"),
        (TABLE, {"force.push.interface": "sole"},
         "force.push.interface: interface 'sole' is of kind 'points', kind 'mean' is needed"),
        (TABLE, {"force.lid.interface": "top"}, "kind 'pressure' is needed"),
        (TABLE, {"force.lid.expression": "sin(q)"}, "force.lid.expression: 'q' at character 5 is not allowed"),
        (TABLE, {"force.push.kind": "torqe"}, "force.push.kind: 'torqe' given; did you mean 'torque'?"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_refused_in_one_line(table: str, changes: dict[str, Any], line: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        job_of(tmp_path, table, **changes)
    assert line in str(caught.value)
    assert "\n" not in str(caught.value)


def test_other_units_change_amounts_and_times(tmp_path: Path) -> None:
    scene, units = job_of(tmp_path).scene, Units(mass=8.0, length=4.0, time=2.0)
    times = np.linspace(0, 4e-4, 9)
    for name, unit in (("push", "N"), ("lid", "Pa")):
        one, other = scene.over_time()[name], rescaled(scene, units).over_time()[name]
        np.testing.assert_allclose(other.amounts(2.0 * times, ""), units.of(unit) * one.amounts(times, ""), rtol=1e-12)


def test_full_fe_refuses_them(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"report\.full_fe: force\.push: forces of kind 'force' are not supported"):
        nodal_problem(job_of(tmp_path))
