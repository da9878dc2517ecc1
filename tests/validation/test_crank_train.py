"""Piston, pin, rod and crank as bodies on joints: side thrust against Newton's laws of a plane slider-crank."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from gudgeon import modaldb
from tests.scenes import scene_path
from tests.validation.solved import Solved, solve

CRANK, ROD, OFFSET, RATE, START, G = 0.043, 0.140, 0.0005, 3000 * 2 * np.pi / 60, np.radians(-20.0), 9.81
MASSLESS = {"component.rod.material.rho": 0.3}
"""Factor 4e-5 on the rod's mass and inertia."""
ELASTIC = {"component.rod.modes": {"reduction": "row-craig-bampton", "normal_count": 0, "fixed_count": 4}}


def thrust(found: Solved) -> np.ndarray:
    """Return the force of the guide on the piston along x at the samples [N], (s,)."""
    return found.history.joints["guide"].force[:, 0]


def gas(times: np.ndarray) -> np.ndarray:
    table = np.loadtxt(scene_path("piston/gas-force.csv"), delimiter=",", skiprows=1)
    return np.interp(times, *table.T)


def expected(times: np.ndarray, mass: float, rod: float, inertia: float) -> np.ndarray:
    """Return the side thrust by Newton's laws [N], (s,).

    Args:
        times: [s]
        mass: Of piston and pin [kg].
        rod: Mass of the rod, whose centre is its middle [kg].
        inertia: Of the rod about its centre [kg m²].
    """
    t = np.linspace(-1e-4, times[-1] + 1e-4, 40001)
    angle = START + RATE * t
    big = np.column_stack([-CRANK * np.sin(angle), CRANK * np.cos(angle)])  # x and z.
    small = np.column_stack([np.full(len(t), OFFSET), big[:, 1] + np.sqrt(ROD**2 - (OFFSET - big[:, 0]) ** 2)])
    way = small - big
    turn = np.arctan2(way[:, 0], way[:, 1])  # About y, from z to x.
    rates = [CubicSpline(t, one).derivative(2)(times) for one in (small[:, 1], big + 0.5 * way, turn)]
    piston, centre, turned = rates
    x, z = CubicSpline(t, way)(times).T
    axial = gas(times) + mass * (piston + G)  # Of the rod on the pin, along z.
    # Moments about the crank pin along y, z × x: those of the pin's force on the rod, of weight and of inertia.
    inertial = inertia * turned + rod * (0.5 * z * centre[:, 0] - 0.5 * x * (centre[:, 1] + G))
    lateral = -(inertial - x * axial) / z  # Of the rod on the pin, along x.
    return -lateral


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("train")


@pytest.fixture(scope="module")
def runs(folder: Path) -> dict[str, Solved]:
    keys: dict[str, Any] = {"run.samples": 720, "run.frames": 2}
    cases: dict[str, dict[str, Any]] = {"massless": MASSLESS, "real": {}}
    return {name: solve("piston/crank-train.toml", folder, keys | more) for name, more in cases.items()}


@pytest.fixture(scope="module")
def mass(folder: Path, runs: dict[str, Solved]) -> float:
    """Return the mass of piston and pin [kg]."""
    store = modaldb.open(folder / "db")
    return 0.126 + float(store.get(runs["real"].history.bodies["piston"], "morph", only=["mass"]).mass)


def test_a_rod_without_inertia_presses_as_the_textbook_says(runs: dict[str, Solved], mass: float) -> None:
    """(F_gas + m (g + a)) tan β at any time of the cycle."""
    found = runs["massless"]
    wanted = expected(found.history.times, mass, 0.0, 0.0)
    assert np.abs(thrust(found) - wanted).max() < 1e-5 * np.abs(wanted).max()


def test_the_inertia_of_the_real_rod(runs: dict[str, Solved], mass: float) -> None:
    found, rod = runs["real"], 7850.0 * ROD * 0.012 * 0.020
    inertia = rod * (ROD**2 + 0.020**2) / 12
    wanted = expected(found.history.times, mass, rod, inertia)
    assert np.abs(thrust(found) - wanted).max() < 1e-3 * np.abs(wanted).max()
    change = np.abs(thrust(found) - thrust(runs["massless"])).max() / np.abs(wanted).max()
    assert 0.06 < change < 0.07
    peaks = [float(np.abs(thrust(runs[name])).max()) for name in ("massless", "real")]
    np.testing.assert_allclose(peaks, [3489.2, 3332.6], rtol=1e-3)


def test_an_elastic_rod_vibrates_about_the_rigid_one(tmp_path: Path) -> None:
    """It starts straight, and bends under its own inertia from there on, less with damping."""
    keys = {"run.duration": 0.006, "run.samples": 600, "run.frames": 2, "run.start": "undeformed"}
    cases: list[dict[str, Any]] = [{}, ELASTIC, ELASTIC | {"body.rod.damping": {"ratio": 0.1}}]
    found = [solve("piston/crank-train.toml", tmp_path / str(n), keys | more) for n, more in enumerate(cases)]
    rigid, *elastic = (thrust(one) for one in found)
    apart = [(one - rigid) / np.abs(rigid).max() for one in elastic]
    largest = [float(np.abs(one).max()) for one in apart]
    assert 0.25 < largest[0] < 0.35
    assert 0.06 < largest[1] < 0.08
    assert max(abs(one.mean()) for one in apart) < 5e-3
    assert max(one.history.energy_drift for one in found) < 1e-9
