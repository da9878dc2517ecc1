"""Tangential rows are made where a scene has friction on contact points of an elastic part, and only there."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.plan import plan
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.errors import SceneError
from tests.pipeline.small import TABLE, UPDATE, write_scene

RUBS = {"static": 0.3, "direction": [0.0, 0.0, 1.0]}
FRICTION = "contact.bore.friction"
FLOAT = 8
"""Bytes of a number."""
BLOCKS = """
[component.block]
geometry = { kind = "box", lx = 0.02, ly = 0.02, lz = 0.02 }
material = { E = 210e9, nu = 0.3, rho = 7800.0 }
mesh = { size = 0.012 }
interface.top = { surface = "top", kind = "patch" }
interface.bottom = { surface = "bottom", kind = "patch" }
interface.side = { surface = "left", kind = "patch" }
modes = { normal_count = 4 }

[component.ball]
geometry = { kind = "rigid", mass = 1.0, points = { foot = { at = [0.0, 0.0, 0.0], normal = [0.0, 0.0, -1.0] } } }
interface.foot = { surface = "foot" }

[body.one]
component = "block"
velocity = [0.0, 0.0, 1.0]

[body.two]
component = "block"
position = [0.0, 0.0, 0.021]

[body.ball]
position = [0.0, 0.0, 0.05]

[contact.blocks]
body = "one"
interface = "top"
against = { shape = "body", body = "two", interface = "bottom" }

[contact.ball]
body = "ball"
interface = "foot"
against = { shape = "body", body = "two", interface = "top" }

[run]
duration = 1e-5
"""


def skirt(folder: Path, **changes: Any) -> Job:
    """Return the job of a skirt at its bore; keys of changes have `__` for full stops."""
    write_scene(folder)
    return open_job(folder, set=changes, db=folder / "db", out=folder / "out")


def blocks(folder: Path, *rubbed: str) -> Job:
    """Return the job of two blocks and a ball with friction in some contacts."""
    (folder / "scene.toml").write_text(BLOCKS)
    own = {f"contact.{name}.friction": RUBS | {"direction": [1.0, 0, 0]} for name in rubbed}
    return open_job(folder, set=own, db=folder / "db", out=folder / "out")


def modes_key(job: Job, name: str = "skirt") -> str:
    return job.components()[name]["modes"].key


def record(job: Job, name: str = "skirt") -> ModalRecord:
    return job.store.get(modes_key(job, name), "modes")


def test_friction_changes_the_key_of_the_modes_whatever_its_coefficients(tmp_path: Path) -> None:
    without = modes_key(skirt(tmp_path))
    rubs = modes_key(skirt(tmp_path, **{FRICTION: RUBS}))
    assert rubs != without
    assert modes_key(skirt(tmp_path, **{FRICTION: RUBS | {"static": 0.0}})) == without
    other = RUBS | {"static": 0.5, "kinetic": 0.1, "direction": [0, 0, 2.0]}
    assert modes_key(skirt(tmp_path, **{FRICTION: other})) == rubs
    rigid = {"component.skirt.modes.reduction": "rigid"}
    assert modes_key(skirt(tmp_path, **rigid)) == modes_key(skirt(tmp_path, **rigid, **{FRICTION: RUBS}))


def test_interfaces_are_those_of_all_bodies_of_a_component(tmp_path: Path) -> None:
    assert blocks(tmp_path).scene.rubbed_of("block") == []
    assert blocks(tmp_path, "blocks").scene.rubbed_of("block") == ["bottom", "top"]
    assert blocks(tmp_path, "ball").scene.rubbed_of("block") == ["top"]
    assert blocks(tmp_path, "ball").scene.rubbed_of("ball") == []
    assert modes_key(blocks(tmp_path), "ball") == modes_key(blocks(tmp_path, "ball"), "ball")


def test_rows_are_made_for_these_interfaces_alone(tmp_path: Path) -> None:
    job = blocks(tmp_path, "blocks")
    run_job(job, "modes")
    found = record(job, "block")
    assert found.tangential_spans == {"bottom": [3, 5], "top": [5, 7]}
    assert found.interfaces["side"].tangential_rows is None
    assert found.residual_flexibility is not None
    assert found.residual_flexibility.shape == (7, 7)
    assert record(job, "ball").tangential_spans == {}


def test_plan_tells_the_bytes_and_the_solver_is_asked_last(tmp_path: Path) -> None:
    job, plain = skirt(tmp_path, **{FRICTION: RUBS}), skirt(tmp_path)
    run_job(job, "morph")
    run_job(plain, "morph")
    found = record(job)
    c, m = len(found.interfaces["thrust"].nodes), len(found.angular_frequencies)
    rows = {(one["body"], one["term"]): one for one in plan(job)["terms"]}
    before = {(one["body"], one["term"]): one for one in plan(plain)["terms"]}
    term = ("skirt", "friction of bore")
    assert (rows[term]["present"], before[term]["present"]) == (True, False)
    assert rows[term]["fields"] == [f"modes:interfaces/thrust/{name}" for name in ("tangents", "tangential_rows")]
    assert (rows[term]["bytes"], before[term]["bytes"]) == (FLOAT * (6 * c + 2 * c * m), 0)
    term = ("skirt", "residual flexibility")
    assert (rows[term]["bytes"], before[term]["bytes"]) == (FLOAT * (3 * c) ** 2, FLOAT * c**2)
    (port,) = plan(job)["ports"]
    assert (port["member"], port["kind"], port["number"]) == ("contact.bore", "friction cone", 3 * c)
    assert plan(plain)["ports"][0] == port | {"kind": "unilateral", "number": c}
    with pytest.raises(SceneError, match=r"scene\.toml: contact\.bore\.friction\.direction: body 'skirt' is elastic"):
        run_job(job, "solve")


def test_a_design_change_keeps_the_tangents_of_its_modes_as_their_normals(tmp_path: Path) -> None:
    job = skirt(tmp_path, **{FRICTION: RUBS, TABLE: "barrel.csv"})
    run_job(job, "morph")
    assert modes_key(job) == modes_key(skirt(tmp_path, **{FRICTION: RUBS}))
    changed = skirt(tmp_path, **{FRICTION: RUBS, TABLE: "barrel.csv", UPDATE: "recompute"})
    run_job(changed, "morph")
    assert modes_key(changed) != modes_key(job)
    for modal in (record(job), record(changed)):
        place = modal.interfaces["thrust"]
        assert place.tangents is not None
        assert np.abs(np.einsum("cki,ci->ck", place.tangents, place.normals)).max() < 1e-14
        np.testing.assert_allclose(place.tangents[:, 0], np.tile([0, 0, 1.0], (len(place.nodes), 1)), atol=1e-14)
