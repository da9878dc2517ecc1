"""A bush of the database as an elastic bearing: Hertz, its wear over cycles, and what is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.applications.wear.cycles import Asked
from gudgeon.pipeline.applications.wear.report import marks_of, run_wear
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.solver.integrators.turning.touching.yielding import Pressed
from tests.pipeline.applications.wear.test_cycles import GAP, LENGTH, LOAD, RADIUS, SCENE, SHAFT, SPEED, WORN

E, NU, AROUND = 207e9, 0.3, 120
AT_REST = -GAP - 1.4e-7
"""Place of the shaft where the bush carries about the load [m]."""
LAW = 'law = { kind = "linear", stiffness = 40000000.0, damping = 9e3 }'
BUSH = f"""
[component.bush.geometry]
kind = "ring"
inner_radius = {RADIUS + GAP!r}
outer_radius = 0.02
thickness = {LENGTH}
state = "plane-strain"

[component.bush]
material = {{ E = {E}, nu = {NU}, rho = 7800.0 }}
mesh = {{ size = {2 * np.pi * (RADIUS + GAP) / AROUND!r} }}
supports = ["outer"]
interface = {{ bore = {{ surface = "inner" }} }}
modes = {{ normal_count = 6, static_count = 0 }}
"""  # fmt: skip


def written(folder: Path) -> Path:
    bearing = 'bearing = { component = "bush", interface = "bore", load = 4e4 }'
    text = SCENE.replace(LAW, bearing).replace("after = 0.02", f"after = 0.02\ncells = {AROUND}")
    assert bearing in text
    path = folder / "bush.toml"
    path.write_text(BUSH + text)
    return path


def opened(folder: Path, changes: dict[str, Any] | None = None) -> Any:
    return open_job(written(folder), set=changes or {}, db=folder / "db", out=folder / "out")


def under(pressed: Pressed, load: float, towards: float) -> np.ndarray:
    """Return the forces of places under a load [N] along an angle [rad], (p,)."""
    along = np.array([np.cos(towards), np.sin(towards)])
    low, high = GAP, 1.5 * GAP
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if pressed.potential(middle * along)[1] @ along < load else (low, middle)
    return pressed.forces(low * along)


def test_the_bush_is_pressed_as_lame_and_hertz_say(tmp_path: Path) -> None:
    """An even pressure widens it by Lamé's solution, held outside, to 0.1 %; a rigid cylinder has the width
    a = √(4 P R/(π E* l)) and the pressure 2 P/(π a l), to a place and to 4 %."""
    job = opened(tmp_path)
    run(written(tmp_path), until="morph", db=tmp_path / "db", out=tmp_path / "out")
    bore = system_of(job).bores["pin"]
    assert len(bore.angles) == 2 * AROUND
    assert bore.areas.sum() == pytest.approx(2 * np.pi * (RADIUS + GAP) * LENGTH, rel=1e-6)
    np.testing.assert_allclose(bore.compliance, bore.compliance.T, atol=1e-14)
    a, b, even = RADIUS + GAP, 0.02, 1e8
    strained = even * (1 + NU) * (1 - 2 * NU) / E / (1 / b**2 + (1 - 2 * NU) / a**2)
    np.testing.assert_allclose(bore.compliance @ (even * bore.areas), strained * (1 / a - a / b**2), rtol=1e-3)
    load = 2e4
    forces = under(Pressed(bore, GAP), load, 0.0)
    curved, module = RADIUS * (RADIUS + GAP) / GAP, E / (1 - NU**2)
    half = np.sqrt(4 * load / LENGTH * curved / (np.pi * module))
    angles = (bore.angles + np.pi) % (2 * np.pi) - np.pi
    step = np.pi / AROUND
    assert np.abs(angles[forces > 0]).max() == pytest.approx(half / RADIUS, abs=1.5 * step)
    evened = [0.5 * one + 0.25 * (np.roll(one, 1) + np.roll(one, -1)) for one in (forces, bore.areas)]
    assert (evened[0] / evened[1]).max() == pytest.approx(2 * load / (np.pi * half * LENGTH), rel=0.04)


@pytest.mark.validation
def test_a_shaft_wears_its_bush_over_cycles(tmp_path: Path) -> None:
    """The volume is N k/H F Ω r T, and the worn shape is in the gaps of the next runs: the contact widens."""
    changes = SHAFT | {"run.duration": 0.004, "joint.pin.wear.after": 0.001, "body.shaft.position": [0.0, AT_REST, 0.0]}
    job = opened(tmp_path, changes)
    report = run_wear(job, Asked(marks_of(300, [30, 300]), 0.01), None, lambda stage, share: None)
    assert report.reason is None
    last = report.document["updates"][-1]["joints"]["pin"]["bearing"]
    assert last["volume"] == pytest.approx(300 * WORN * LOAD * SPEED * RADIUS * 0.003, rel=0.02)
    depths = {key: np.array(one["pin"])[0, 0] for key, one in report.document["depths"].items()}
    assert depths["300"].max() < 9 * depths["30"].max()
    bore, worn = system_of(job).bores["pin"], depths["300"]
    towards = 2 * np.pi * float(worn.argmax()) / AROUND
    wide = [np.count_nonzero(under(Pressed(bore, GAP, shape), LOAD, towards)) for shape in (None, worn)]
    assert wide[1] > 2 * wide[0]


BAD: list[tuple[list[str], str]] = [
    (["--set", "joint.pin.bearing.component=rush"], "joint.pin.bearing.component: no component 'rush'"),
    (["--set", "joint.pin.bearing.interface=hole"], "joint.pin.bearing.interface: no interface 'hole'"),
    (["--set", "component.bush.interface.bore.kind=mean"], "is of kind 'mean', kind 'points' is needed"),
    (["--set", "component.bush.supports=[]"], "has no supports"),
    (["--set", "joint.pin.clearance=0"], "joint.pin.clearance"),
    (["--set", "joint.pin.clearance=8e-4"], "joint.pin.bearing.interface: a point of 'bore'"),
    (["--set", "joint.pin.wear.cells=240"], "240 given; the bore has 240 positions"),
    (["--set", "joint.pin.bearing.load=1e9"], "joint.pin.bearing.load"),
    (["--set", "joint.pin.bearing.restitution=0"], "restitution"),
    (["--set", "component.bush.geometry.outer_radius=0.01"], "outer_radius"),
]


@pytest.mark.parametrize(("options", "said"), BAD)
def test_bad_input_is_one_line(
    options: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    where = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    assert main(["run", str(written(tmp_path)), *options, *where]) == 2
    text = capsys.readouterr().err
    assert said in text
    assert "Traceback" not in text
