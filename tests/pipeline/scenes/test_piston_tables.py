"""The tables of data/piston: what their script writes is what is committed, and what they promise holds."""

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from gudgeon.pipeline.geometry.profile import ProfileTable, read_profile

FOLDER = Path(__file__).resolve().parents[3] / "data/piston"
TABLES = sorted(path.name for path in FOLDER.glob("*.csv"))
PROFILES = [name for name in TABLES if name.startswith("skirt-profile")]

WRITTEN = 1e-10
"""[m]: the last digit of a deviation."""
BETWEEN = 1e-8
"""[m]: what a periodic cubic spline over 15° may add to 30 µm cos 2φ between its points, 30 µm · (2·15°)⁴ · 5 / 384."""

DIP = 1.5e-7
"""[m]: how far a barrel falls on its way up. A cubic that is zero at the middle and at the bottom end dips between them
by 4/27 of 14³ · 5 / (20² · 34) µm."""


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_tables", FOLDER / "make_tables.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def cycle() -> tuple[np.ndarray, np.ndarray]:
    """Crank angles [deg] and pressures [Pa]."""
    angle, pressure = np.loadtxt(FOLDER / "gas-pressure.csv", delimiter=",", skiprows=1).T
    return angle, pressure


def profile(name: str) -> ProfileTable:
    return read_profile(FOLDER / name)


def test_script_writes_the_tables_as_committed(script: ModuleType, tmp_path: Path) -> None:
    script.write_tables(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == TABLES
    for name in TABLES:
        assert (tmp_path / name).read_bytes() == (FOLDER / name).read_bytes(), name


def test_pressure_peaks_after_dead_centre_and_closes(cycle: tuple[np.ndarray, np.ndarray]) -> None:
    angle, pressure = cycle
    np.testing.assert_array_equal(angle, np.arange(721))
    assert pressure.max() == pytest.approx(70e5, rel=0.01)
    assert 8 <= angle[pressure.argmax()] <= 12
    assert pressure[0] == pressure[-1]


def test_pressure_of_the_gas_exchange(cycle: tuple[np.ndarray, np.ndarray]) -> None:
    angle, pressure = cycle
    assert pressure[(angle >= 200) & (angle <= 345)] == pytest.approx(1.1e5, rel=1e-6)
    assert pressure[(angle >= 385) & (angle <= 540)] == pytest.approx(0.9e5, rel=1e-6)


def test_pressure_has_no_jump_in_slope(script: ModuleType) -> None:
    """Halving the interval halves the largest change of slope; at a kink it would stay."""

    def largest_change(interval: float) -> float:
        angle = np.arange(-200.0, 560.0, interval)
        return float(np.abs(np.diff(np.diff(script.pressure(angle)) / interval)).max())

    assert largest_change(0.05) == pytest.approx(largest_change(0.1) / 2, rel=0.02)


def test_compression_is_polytropic(script: ModuleType) -> None:
    angle = np.linspace(-170.0, script.BURN_START, 20)
    exponent = np.diff(np.log(script.pressure(angle))) / -np.diff(np.log(script.volume(angle)))
    assert exponent == pytest.approx(1.32, rel=1e-9)
    ends = script.volume(np.array([180.0, 0.0]))
    assert ends[0] / ends[1] == pytest.approx(10.0, rel=1e-12)
    assert ends[0] - ends[1] == pytest.approx(np.pi * 0.043**2 * 0.086, rel=1e-12)


@pytest.mark.parametrize("name", PROFILES)
def test_profile_covers_the_skirt_and_is_never_positive(name: str) -> None:
    table = profile(name)
    assert (table.heights[0], table.heights[-1]) == (0.0, 0.034)
    assert table.deviations.max() == 0.0
    height, angle = np.meshgrid(np.linspace(0, 0.034, 69), np.radians(np.linspace(-180, 180, 145)))
    assert table(height.ravel(), angle.ravel()).max() <= BETWEEN


@pytest.mark.parametrize(
    ("name", "bottom", "top", "across"),
    [
        ("skirt-profile.csv", -15e-6, -25e-6, -60e-6),
        ("skirt-profile-barrel-plus.csv", -35e-6, -45e-6, -60e-6),
        ("skirt-profile-barrel-minus.csv", 0.0, -5e-6, -60e-6),
        ("skirt-profile-oval.csv", -15e-6, -25e-6, -100e-6),
    ],
)
def test_profile_depths(name: str, bottom: float, top: float, across: float) -> None:
    table = profile(name)
    height, angle = np.array([0.0, 0.014, 0.034, 0.014, 0.014]), np.radians([0.0, 0.0, 180.0, 90.0, -90.0])
    expected = [bottom, 0.0, top, across, across]
    np.testing.assert_allclose(table(height, angle), expected, rtol=0, atol=WRITTEN)
    ridge = table.deviations[:, 12]
    for half in (ridge[:8], ridge[:6:-1]):
        assert (np.maximum.accumulate(half) - half).max() <= DIP
