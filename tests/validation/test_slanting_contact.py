"""Contact of bodies that stand at a slant before their obstacle: small motion beside bodies that turn, and rows beside
the shapes of the mesh. A slender part is much softer across its face's normal than along it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.nodal.scene.points import meeting_problem
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.checks.placing import slanting_notes
from gudgeon.solver.errors import SceneError
from tests.validation.test_block_on_floor import solved

ANGLE = 4.0
SCENE = """
[component.block]
geometry = { kind = "box", lx = 0.02, ly = 0.02, lz = 0.2 }
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
mesh.size = 0.02
interface.foot = { surface = "bottom", kind = "points" }
modes = { normal_count = 12 }

[body.block]
position = [0.0, 0.0, 0.0008]
orientation = { axis = [0.0, 1.0, 0.0], angle = 4.0 }
velocity = [0.0, 0.0, -1.0]

[contact.floor]
body = "block"
interface = "foot"
against = { shape = "plane", point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }
surface_stiffness = 1e13

[run]
duration = 6e-4
window = 5e-5
samples = 600
checks = false
"""
TWO = """
[component.anvil]
geometry = { kind = "box", lx = 0.05, ly = 0.05, lz = 0.03 }
material = { E = 70e9, nu = 0.33, rho = 2700.0 }
mesh.size = 0.02
interface.face = { surface = "top", kind = "points" }
modes = { normal_count = 6 }
[body.anvil]
position = [0.0, 0.0, -0.032]
"""
PLANE = 'against = { shape = "plane", point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }'
FACE = 'against = { shape = "body", body = "anvil", interface = "face" }'


def job_of(folder: Path, changes: dict[str, Any], text: str = SCENE) -> Job:
    folder.mkdir(exist_ok=True)
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    return open_job(folder / "scene.toml", set=changes, db=folder / "db", out=folder / "out")


def turn_of(job: Job) -> np.ndarray:
    orientation = job.scene.body["block"].orientation
    assert orientation is not None
    return orientation.matrix()


@pytest.fixture(scope="module")
def turning(tmp_path_factory: pytest.TempPathFactory) -> Trajectory:
    return solved(job_of(tmp_path_factory.mktemp("turning"), {"run.integrator": "turning"}))


@pytest.mark.parametrize(
    "changes",
    [
        {"run.integrator": "small"},
        {"contact.floor.friction": {"static": 1e-7}},
    ],
    ids=["small", "friction"],
)  # fmt: skip
def test_small_motion_is_that_of_bodies_that_turn(changes: dict[str, Any], turning: Trajectory, tmp_path: Path) -> None:
    """The impact turns the block by 2e-3 rad. Along its face's normal alone, the impulse would be 5 % less."""
    found = solved(job_of(tmp_path, changes | {"run.checks": True}))
    for name, tolerance in (("impulse", 2e-3), ("force_peak", 4e-3), ("impact1.end", 1e-3)):
        value = turning.quantities[f"floor.{name}"]["value"]
        assert found.quantities[f"floor.{name}"]["value"] == pytest.approx(value, rel=tolerance), name


def test_rows_are_the_shapes_along_the_obstacle_and_full_fe_has_the_same(tmp_path: Path) -> None:
    job = job_of(tmp_path, {})
    run_job(job, until="morph")
    record, turn = job.record("block"), turn_of(job)
    shapes = record.shapes[record.interfaces["foot"].nodes]
    system = system_of(job)
    body = system.bodies["block"]
    expected = np.einsum("i,cim->cm", turn.T @ [0.0, 0.0, 1.0], shapes)
    rows = system.rows.dense()[:, body.elastic]
    np.testing.assert_allclose(rows, expected, atol=1e-9 * np.abs(expected).max())
    contact = meeting_problem(job).contacts["floor"]
    whole = record.shapes.reshape(-1, shapes.shape[2])
    assert contact.rows[0] is not None
    np.testing.assert_allclose(contact.rows[0] @ whole, expected, atol=1e-9 * np.abs(expected).max())


def test_the_other_body_moves_along_the_normal_of_the_first(tmp_path: Path) -> None:
    job = job_of(tmp_path, {}, SCENE.replace(PLANE, FACE) + TWO)
    run_job(job, until="morph")
    system = system_of(job)
    normal = turn_of(job) @ [0.0, 0.0, -1.0]
    body, record = system.bodies["anvil"], job.record("anvil")
    share = next(one[2] for one in system.contacts[0].sides if one[0] == "anvil")
    expected = share @ np.einsum("i,cim->cm", normal, record.shapes[record.interfaces["face"].nodes])
    np.testing.assert_allclose(system.rows.dense()[:, body.elastic], expected, atol=1e-9 * np.abs(expected).max())


def test_upright_bodies_need_no_tangential_rows(tmp_path: Path) -> None:
    upright = {"body.block.orientation": {"axis": [0.0, 0.0, 1.0], "angle": 90.0}}
    job = job_of(tmp_path, upright)
    assert job.scene.rubbed_of("block") == []
    assert job_of(tmp_path, {}).scene.rubbed_of("block") == ["foot"]


def test_one_interface_before_two_planes_is_refused(tmp_path: Path) -> None:
    text = (
        SCENE
        + """
[contact.ramp]
body = "block"
interface = "foot"
against = { shape = "plane", point = [0.0, 0.0, -0.01], normal = [0.02, 0.0, 1.0] }
surface_stiffness = 1e13
"""
    )
    job = job_of(tmp_path, {}, text)
    run_job(job, until="morph")
    with pytest.raises(SceneError, match=r"contact\.ramp: interface 'foot' .* two directions"):
        system_of(job)


def test_modes_without_rows_across_are_said(tmp_path: Path) -> None:
    """A face that is slanted on its part, before a plane across an axis, or a record of another scene."""
    upright = {"body.block.orientation": {"axis": [0.0, 0.0, 1.0], "angle": 90.0}}
    job = job_of(tmp_path, upright)
    run_job(job, until="morph")
    system = system_of(job)
    assert not slanting_notes(system)
    (contact,) = system.contacts
    tilted = np.tile([np.sin(0.07), 0.0, np.cos(0.07)], (len(contact.points), 1))
    (note,) = slanting_notes(replace(system, contacts=[replace(contact, directions=tilted)]))
    assert note.startswith("contact.floor: the face of 'foot' is 4 degrees off the direction to its obstacle")
    run_job(slanted := job_of(tmp_path, {}), "morph")
    assert not slanting_notes(system_of(slanted))
