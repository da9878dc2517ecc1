"""What drives a scene, by itself: the slider-crank's kinematics, the gas pressure, and how both are refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces import GasPressure
from gudgeon.solver.integrators.implicit.integrator import Implicit
from gudgeon.solver.integrators.outcome import Samples
from gudgeon.solver.joints import SliderCrank
from gudgeon.solver.system.loads import Driving
from tests.solver.systems import PIN, build, march, piston_records, piston_scene

CRANK = SliderCrank(
    kind="slider-crank", body="piston", interface="pin", crank_radius=0.04, rod_length=0.14, speed=3000.0, start=-35.0,
    centre=(0.003, 0.2, -0.1), along=(0.0, 0.6, 0.8), lateral=(2.0, 0.0, 0.0),
)  # fmt: skip
TIMES = np.linspace(0.0, 0.02, 50)
OFFSET = -0.002
GAS: dict[str, Any] = {"kind": "gas", "body": "piston", "interface": "crown", "joint": "rod"}
whole_crank = Driving.crank
ANGLES = np.array([-180.0, -30.0, 0.0, 20.0, 90.0, 300.0, 540.0])
VALUES = np.array([1.2e5, 9e5, 5e6, 4e6, 8e5, 1.1e5, 1.2e5])


def test_pin_is_a_rod_length_from_the_crank_pin() -> None:
    pin, height = CRANK.crank_pin(TIMES), CRANK.piston_pin(TIMES, OFFSET)[:, 0]
    np.testing.assert_allclose(np.hypot(OFFSET - pin[:, 0], height - pin[:, 1]), 0.14, rtol=1e-14)
    assert (height > pin[:, 1]).all()
    centre = np.array(CRANK.centre) @ np.column_stack(CRANK.axes[::-1])
    np.testing.assert_allclose(np.hypot(*(pin[:, :2] - centre).T), 0.04, rtol=1e-12)
    np.testing.assert_allclose(CRANK.tangent(TIMES, OFFSET), (OFFSET - pin[:, 0]) / (height - pin[:, 1]), rtol=1e-12)


def test_upper_dead_centre_is_along_and_then_lateral() -> None:
    at = np.radians([35.0, 125.0]) / CRANK.rate
    along, lateral = CRANK.axes
    centre = np.array(CRANK.centre)
    np.testing.assert_allclose(CRANK.crank_pin(at)[0, :2], [centre @ lateral, centre @ along + 0.04], atol=1e-15)
    np.testing.assert_allclose(CRANK.crank_pin(at)[1, :2], [centre @ lateral + 0.04, centre @ along], atol=1e-15)
    assert CRANK.angle(at) == pytest.approx(np.radians([0.0, 90.0]))


def test_rates_are_derivatives() -> None:
    """Central differences: h² of the third derivative, and eps/h of round-off."""
    h = 1e-7
    for found, columns, rates in (
        (CRANK.crank_pin, [0, 1], [2, 3]),
        (lambda time: CRANK.piston_pin(time, OFFSET), [0, 1], [1, 2]),
    ):
        numeric = (found(TIMES + h) - found(TIMES - h))[:, columns] / (2 * h)
        exact = found(TIMES)[:, rates]
        np.testing.assert_allclose(numeric, exact, atol=1e-7 * np.abs(exact).max())


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"rod_length": 0.04}, "rod_length is 0.04 m"),
        ({"rod_length": 0.03}, "rod_length is 0.03 m"),
        ({"lateral": (1.0, 1.0, 0.0)}, "right angles"),
        ({"speed": 0.0}, "speed"),
        ({"along": (0.0, 0.0, 0.0)}, "along"),
    ],
)
def test_crank_that_does_not_fit_is_refused(change: dict[str, Any], text: str) -> None:
    with pytest.raises(ValidationError, match=text):
        SliderCrank(**(CRANK.model_dump() | change))


def test_rod_that_does_not_reach_its_pin_is_refused(tmp_path: Path) -> None:
    """The crank's own numbers fit; what makes the rod too short is the place of the pin on the body."""
    scene = piston_scene()
    scene["joint"]["rod"] |= {"rod_length": 0.04 + 0.9 * PIN}
    with pytest.raises(SceneError, match=r"^joint\.rod\.rod_length: 0\.04\d* m is below"):
        build(tmp_path / "short", piston_records(), scene)
    scene["joint"]["rod"] |= {"rod_length": 0.04 + 1.1 * PIN}
    build(tmp_path / "long", piston_records(), scene)


def test_pressure_passes_through_its_values_less_ambient() -> None:
    gas = GasPressure(**GAS, values=tuple(zip(ANGLES, VALUES, strict=True)), ambient=0.9e5)
    np.testing.assert_allclose(gas.pressure(np.radians(ANGLES)), VALUES - 0.9e5, rtol=1e-9)
    for turns in (-2, 1, 7):
        between = np.radians(np.linspace(-180, 540, 101))
        np.testing.assert_allclose(gas.pressure(between + turns * 4 * np.pi), gas.pressure(between), rtol=1e-7)
    assert GasPressure(**GAS, values=((0.0, 1e5), (720.0, 1e5))).pressure(np.array([1.0])) == pytest.approx(0.0)


def test_pressure_is_smooth_where_the_cycle_closes() -> None:
    gas, h = GasPressure(**GAS, values=tuple(zip(ANGLES, VALUES, strict=True))), 1e-5
    end = np.radians(540.0)
    before, at, after = gas.pressure(np.array([end - h, end, end + h]))
    assert (at - before) / h == pytest.approx((after - at) / h, rel=1e-3)


@pytest.mark.parametrize("values", [(), ((0.0, 1e5),)])
def test_pressure_needs_values(values: tuple[tuple[float, float], ...]) -> None:
    with pytest.raises(ValidationError, match="give a table"):
        GasPressure(**GAS, values=values)


def test_load_is_the_pressure_in_the_middle_of_each_step(tmp_path: Path) -> None:
    scene = piston_scene(start=-30.0)
    scene["force"]["gas"]["values"] = list(zip(ANGLES.tolist(), VALUES.tolist(), strict=True))
    system = build(tmp_path, piston_records(), scene)
    done = march(system, 1e-5, 40)
    middle = np.radians(-30.0) + 100 * np.pi * (done.times - 0.5e-5)
    np.testing.assert_allclose(done.loads[:, 2], system.scene.gas()["gas"].pressure(middle), rtol=1e-12)


@pytest.mark.parametrize("ahead", [1, 7, 4096])
def test_loads_found_ahead_are_those_of_each_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ahead: int) -> None:
    monkeypatch.setattr("gudgeon.solver.integrators.implicit.integrator.AHEAD", ahead)
    scene, dt, asked = piston_scene(start=-15.0, duration=1e-4, clearance=1e-4), 2e-6, []
    scene["force"]["gas"]["values"] = list(zip([0.0, 360.0, 720.0], [4e6, 2e5, 4e6], strict=True))
    system = build(tmp_path, piston_records(2), scene)
    whole, run = march(system, dt, 50), Implicit(system, dt)
    driving = system.driving
    monkeypatch.setattr(type(driving), "crank", lambda self, time: asked.append(len(time)) or whole_crank(self, time))
    loads, widths, first = [], (len(driving.rows), 2 * len(system.rigid) + len(driving.joints)), 0
    for count in (5, 1, 14, 30):
        rows, snapshots = (np.zeros((count, width)) for width in widths)
        forces, energies = np.zeros((count, 2, 3)), np.zeros((count, 5))
        assert run.advance(first, 1, Samples(forces, energies, rows, snapshots, rows[:, :0]))
        loads.append(rows)
        first += count
    np.testing.assert_array_equal(np.concatenate(loads), whole.loads)
    np.testing.assert_array_equal(run.modes.q, whole.run.modes.q)
    assert np.ptp(whole.loads[:, -1]) > 1.0
    assert asked == {1: [5, 1, 14, 30], 7: [7, 14, 30], 4096: [50]}[ahead]


@pytest.mark.parametrize(
    ("table", "key", "interface", "text"),
    [
        ("joint", "rod", "crown", r"^joint\.rod\.interface: 'crown' is no interface of kind 'mean'$"),
        ("force", "gas", "pin", r"^force\.gas\.interface: 'pin' is no interface of kind 'pressure'$"),
        ("joint", "rod", "bolt", r"^joint\.rod\.interface: body 'part' has no load or joint surface 'bolt'"),
        ("force", "gas", "right", r"^force\.gas\.interface: body 'part' has no load or joint surface 'right'"),
    ],
)
def test_interface_of_another_kind_is_refused(tmp_path: Path, table: str, key: str, interface: str, text: str) -> None:
    scene = piston_scene()
    scene[table][key]["interface"] = interface
    with pytest.raises(SceneError, match=text):
        build(tmp_path, piston_records(), scene)
