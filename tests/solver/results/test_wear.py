"""Wear of contacts: V = k/H ∫ F |v| dt to round-off where the speed is known, in other axes, and what is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.cli import main
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.run import solve_records
from tests.pipeline.small import block_on_floor

SPEED, HARD, K = 3.0, 1e9, 1e-4
WEAR = f"""
[contact.floor.wear]
coefficient = {K!r}
hardness = {HARD!r}
"""


def scene(velocity: list[float] | None = None, more: str = "") -> str:
    text = block_on_floor().replace(
        "velocity = [0.0, 0.0, -0.5]", f"velocity = {velocity or [SPEED, 0.0, -0.5]}\nfreedom = ['x', 'z']"
    )
    return text + WEAR + more


def worn(folder: Path, text: str, changes: dict[str, Any] | None = None) -> Any:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene.toml").write_text(text)
    job = open_job(folder, set=changes or {}, db=folder / "db", out=folder / "out")
    solve_records(job, "solve")
    return job.store.get(job.trajectory().key, "trajectory")


@pytest.mark.parametrize("frames", [2, 20])
def test_volume_is_force_times_sliding_speed(frames: int, tmp_path: Path) -> None:
    """Without friction the speed along the floor is constant: V = k/H v ∫ F dt, whatever the number of frames."""
    found = worn(tmp_path, scene(), {"run.frames": frames})
    values = {name: one["value"] for name, one in found.quantities.items()}
    assert values["floor.impulse"] > 0
    assert values["floor.load_distance"] == pytest.approx(SPEED * values["floor.impulse"], rel=1e-12)
    assert values["floor.wear_volume"] == pytest.approx(K / HARD * SPEED * values["floor.impulse"], rel=1e-12)
    slide = np.array(found.counts["wear"]["floor"]["load_distance"])
    depths = K / HARD * slide / found.contacts["floor"].areas
    assert depths.max() == pytest.approx(values["floor.wear_depth"], rel=1e-12)
    assert slide.min() >= 0
    assert "floor.against_wear_volume" not in values


@pytest.mark.parametrize("law", [None, {"kind": "linear", "stiffness": 1e8}])
def test_what_has_no_layer_wears_too(law: dict[str, Any] | None, tmp_path: Path) -> None:
    changes = {"contact.floor.surface_stiffness": "unset"}
    if law is not None:
        changes |= {"contact.floor.method": "penalty", "contact.floor.law": law}
    found = worn(tmp_path, scene(), changes)
    values = {name: one["value"] for name, one in found.quantities.items()}
    assert values["floor.impulse"] > 0
    assert values["floor.load_distance"] == pytest.approx(SPEED * values["floor.impulse"], rel=1e-12)
    assert 0 < values["floor.wear_depth"] < np.inf


BALL = """
[component.ball]
interface.foot.surface = "foot"
[component.ball.geometry]
kind = "rigid"
mass = 2.0
inertia = [0.01, 0.01, 0.01]
points.foot = { at = [0.0, 0.0, -0.05], normal = [0.0, 0.0, -1.0], area = 1e-4 }
[body.ball]
position = [0.0, 0.0, 0.051]
velocity = [3.0, 0.0, -1.0]
[contact.floor]
body = "ball"
interface = "foot"
against = { shape = "plane", point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }
[run]
duration = 0.003
"""


@pytest.mark.parametrize(
    ("own", "slide"),
    [
        ({"method": "impact", "restitution": 0.5}, 3.0 * SPEED),
        ({"method": "impact", "restitution": 0.5, "friction.static": 0.2}, 1.71 / 0.2),
        ({"method": "constraint", "friction.static": 0.2, "friction.direction": [1.0, 0.0, 0.0]}, 2.0 * 2.9 * 1.0),
    ],
)
def test_rigid_contact_wears(own: dict[str, Any], slide: float, tmp_path: Path) -> None:
    """An impact wears by its impulse times the mean of the sliding speeds before and after it."""
    own = {"body.ball.freedom": ["x", "y", "z"]} | {f"contact.floor.{key}": one for key, one in own.items()}
    if "contact.floor.friction.direction" in own:
        own["body.ball.freedom"] = ["x", "z"]
    values = worn(tmp_path, BALL + WEAR, own).quantities
    assert values["floor.load_distance"]["value"] == pytest.approx(slide, rel=1e-9)
    assert values["floor.wear_depth"]["value"] == pytest.approx(K / HARD * slide / 1e-4, rel=1e-9)


def test_a_floor_that_moves_with_the_block_wears_nothing(tmp_path: Path) -> None:
    belt = scene().replace("normal = [0.0, 0.0, 1.0] }", f"normal = [0.0, 0.0, 1.0], velocity = [{SPEED}, 0.0, 0.0] }}")
    values = worn(tmp_path, belt).quantities
    assert values["floor.impulse"]["value"] > 0
    assert values["floor.load_distance"]["value"] < 1e-9 * SPEED * values["floor.impulse"]["value"]


def test_wear_counts_from_its_time(tmp_path: Path) -> None:
    """Before and after any time add up to the whole."""
    whole, late = (worn(tmp_path, scene(), {"contact.floor.wear.after": t}) for t in (0.0, 4e-5))
    slid = np.array(whole.contacts["floor"].force[:, 2]) * (whole.times[0]) * SPEED
    expected = slid[whole.times > 4e-5].sum()
    assert 0 < expected < slid.sum()
    assert late.quantities["floor.load_distance"]["value"] == pytest.approx(expected, rel=1e-3)


def test_wear_in_other_units(tmp_path: Path) -> None:
    """In decimetres volumes are in dm³."""
    base = worn(tmp_path / "m", scene())
    text = scene([10 * SPEED, 0.0, -5.0])
    for one, other in (
        ("lx = 0.06, ly = 0.04, lz = 0.02", "lx = 0.6, ly = 0.4, lz = 0.2"),
        ("E = 210e9, nu = 0.3, rho = 7850.0", "E = 210e8, nu = 0.3, rho = 7.85"),
        ("size = 0.015", "size = 0.15"),
        ("[0.0, 0.0, 1e-5]", "[0.0, 0.0, 1e-4]"),
        ("surface_stiffness = 1e12", "surface_stiffness = 1e10"),
        ("hardness = 1000000000.0", "hardness = 1e8"),
    ):
        assert one in text
        text = text.replace(one, other)
    found = worn(tmp_path / "dm", text)
    ratio = found.quantities["floor.wear_volume"]["value"] / base.quantities["floor.wear_volume"]["value"]
    assert ratio == pytest.approx(1e3, rel=1e-6)


REFUSED: list[tuple[list[str], str]] = [
    (["contact.floor.wear.coefficient=-1e-4"], "contact.floor.wear.coefficient"),
    (["contact.floor.wear.hardness=0"], "contact.floor.wear.hardness"),
    (["contact.floor.wear.against_coefficient=1e-4"], "against.shape 'plane' has none"),
    (["contact.floor.wear.journal_coefficient=1e-4"], "contact.floor.wear.journal_coefficient"),
    (["run.integrator=turning"], "'turning' does not support"),
]


@pytest.mark.parametrize(("changes", "text"), REFUSED)
def test_what_cannot_wear_is_refused_in_one_line(
    changes: list[str], text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "scene.toml").write_text(scene())
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    assert main(["run", str(tmp_path), *(part for one in changes for part in ("--set", one)), *places]) == 2
    said = capsys.readouterr().err
    assert text in said
    assert len([line for line in said.splitlines() if line.strip()]) == 1
