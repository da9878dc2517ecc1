"""Gauges of several components under the integrators that read them, and quantities made of them."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import GaugeModes
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.cli import main
from gudgeon.solver.registry import definition
from gudgeon.solver.simulate import simulate
from tests.solver.systems import block_records, block_scene, build

POINTS, MODES = 5, 8
SPLIT = 0.03
"""Of the largest reading, at a step of 0.2/ω_c."""


def solved(folder: Path, integrator: str, *, gauge: bool = True, step: float | None = None) -> Trajectory:
    modal, morph = block_records(POINTS)
    rng = np.random.default_rng(3)
    shapes = GaugeModes(rng.standard_normal((6, MODES)), 1e-9 * rng.standard_normal((6, POINTS)), "Pa")
    scene = block_scene(method="residual")
    scene["body"]["part"]["gauges"] = ["g"] if gauge else []
    scene["run"] |= {"integrator": integrator, "samples": 400, "frames": 400}
    if step is not None:
        scene["run"]["step"] = step
    return simulate(build(folder, (replace(modal, gauges={"g": shapes} if gauge else {}), morph), scene))


def test_steps_read_what_located_events_do(tmp_path: Path) -> None:
    """At the end of each sample; the difference falls with the step."""
    exact = solved(tmp_path / "event", "event")
    largest, errors = np.abs(exact.gauges["part.g"]).max(), []
    for step in (1e-6, 1e-7):
        ours = solved(tmp_path / f"{step}", "small", step=step)
        assert ours.gauges["part.g"].shape == (len(ours.times), 6)
        inner = slice(5, -5)
        read = np.column_stack([np.interp(exact.times, ours.times, column) for column in ours.gauges["part.g"].T])
        errors.append(np.abs(read - exact.gauges["part.g"])[inner].max() / largest)
    assert errors[0] < SPLIT
    assert errors[1] < SPLIT / 5


def test_reading_changes_nothing(tmp_path: Path) -> None:
    with_gauge, without = solved(tmp_path / "a", "small"), solved(tmp_path / "b", "small", gauge=False)
    np.testing.assert_allclose(with_gauge.frames, without.frames, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(with_gauge.contacts["wall"].force, without.contacts["wall"].force, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("integrator", ["small", "event"])
def test_peak_of_the_equivalent_stress(tmp_path: Path, integrator: str) -> None:
    found = solved(tmp_path, integrator)
    xx, yy, zz, xy, yz, zx = found.gauges["part.g"].T
    deviator = np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]).transpose(2, 0, 1)
    deviator = deviator - np.trace(deviator, axis1=1, axis2=2)[:, None, None] * np.eye(3) / 3
    expected = np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2))).max()
    assert found.quantities["part.g.von_mises_peak"]["value"] == pytest.approx(expected, rel=1e-12)
    assert found.quantities["part.g.von_mises_peak"]["unit"] == "Pa"


@pytest.mark.parametrize(
    ("unit", "peak"),
    [("Pa", "stress_peak"), ("1", "strain_peak"), ("N m", "bending_moment_peak"), ("N", "shear_force_peak")],
)
def test_peak_of_a_gauge_of_one_number(tmp_path: Path, unit: str, peak: str) -> None:
    """Its value has the sign of the largest size, and every name is in the registry."""
    modal, morph = block_records(POINTS)
    rng = np.random.default_rng(4)
    shapes = GaugeModes(rng.standard_normal((1, MODES)), 1e-9 * rng.standard_normal((1, POINTS)), unit)
    scene = block_scene(method="residual")
    scene["body"]["part"]["gauges"] = ["g"]
    found = simulate(build(tmp_path, (replace(modal, gauges={"g": shapes}), morph), scene))
    values = found.gauges["part.g"]
    most = int(np.abs(values).argmax())
    assert {k: v["value"] for k, v in found.quantities.items() if k.startswith("part.g.")} == {
        f"part.g.{peak}": values[most], "part.g.peak_time": found.times[most],
    }  # fmt: skip
    for name in (peak, "peak_time"):
        known = definition(name, ["gauge"])
        assert known is not None
        assert known.unit == found.quantities[f"part.g.{name}"]["unit"]


SAGGING = """
[component.arm]
geometry = {kind="beam", theory="euler-bernoulli", length=0.8, section={kind="rectangle", width=0.02, height=0.006}}
material = { E = 70e9, nu = 0.33, rho = 2700.0 }
mesh.size = 0.1
supports = ["left"]
interface.tip = { surface = "right-bottom" }
modes.normal_count = 6
gauge.root = { station = "left", quantity = "shear-force" }
[body.arm]
gauges = ["root"]
[contact.floor]
body = "arm"
interface = "tip"
against = { shape = "plane", point = [0.0, 0.0, -0.03], normal = [0.0, 0.0, 1.0] }
[run]
duration = 1e-3
gravity = [0.0, 0.0, -9.81]
"""


@pytest.mark.parametrize("step", ["unset", 1e-5])
@pytest.mark.parametrize("integrator", ["auto", "event", "small"])
def test_gravity_gauges_and_a_given_step_run_or_are_refused_in_one_line(
    integrator: str, step: str | float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "scene.toml").write_text(SAGGING)
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    changes = ["--set", f"run.integrator={integrator}", "--set", f"run.step={step}"]
    code = main(["solve", str(tmp_path), *changes, *places])
    said = capsys.readouterr()
    if code == 2:
        assert len([line for line in said.err.splitlines() if "gudgeon:" in line]) == 1
        assert "run." in said.err
        assert integrator not in ("auto", "small")
        return
    assert code == 0
    assert "Traceback" not in said.err
    weight = 2700.0 * 9.81 * 0.02 * 0.006 * 0.8
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["quantities"]["arm.root.shear_force_peak"]["value"] == pytest.approx(-weight, rel=1e-6)
