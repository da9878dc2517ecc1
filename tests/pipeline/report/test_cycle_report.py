"""What a report says of a cycle: the rigid piston's side force, how far runs agree, and the table."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.report.slaps import GRID, cycle_errors, mechanism_of, reproducible
from gudgeon.pipeline.stages.job import Job, variant
from gudgeon.pipeline.stages.run import run_job

PISTON = Path(__file__).resolve().parents[3] / "data/piston"
COARSE = {
    "component.piston.mesh.size": 0.02,
    "component.liner.mesh.size": 0.03,
    "component.piston.modes.reduction": "rigid",
    "component.liner.modes.reduction": "rigid",
    "component.liner.interface.thrust.spacing": 0.03,
    "component.liner.interface.anti.spacing": 0.03,
}
RADIUS, ROD, RATE, PERIOD = 0.043, 0.140, 100 * np.pi, 0.04
BETWEEN = 5e-4
"""Relative: straight lines for splines between two degrees of the pressure table, and the crown's area on chords."""
PIN = -0.0005 * 0.011**2 / (2 * 0.04296 * (0.04296 - 0.013))
"""By how much the mean of the pin's bore is off its axis [m]: −e r² / (2 R L), as its outer ends follow the skirt."""
DIFFERENCE = 1e-5
"""Step of the central differences [s]: error h²/12 d⁴z/dt⁴ ≈ 4e-3 m/s² of 5000."""


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Job:
    """The piston without elasticity on the coarsest meshes, up to the morph stage."""
    folder = tmp_path_factory.mktemp("cycle")
    job = open_job(PISTON, set=COARSE, db=folder / "db", out=folder / "out")
    run_job(job, "morph")
    return job


def by_hand(mass: float, times: np.ndarray, pin: float, *, side: float, gravity: float) -> np.ndarray:
    """Return the force of the walls on the piston along x [N], from the rod's direction and differences of its height.

    Args:
        pin: x of the piston pin [m].
        side: +1 if the crank goes to +x after its upper dead centre, −1 if it goes to −x.
        gravity: Along z [m/s²].
    """

    def across(t: np.ndarray) -> np.ndarray:
        return pin - side * RADIUS * np.sin(np.radians(-20) + RATE * t)

    def height(t: np.ndarray) -> np.ndarray:
        return RADIUS * np.cos(np.radians(-20) + RATE * t) + np.sqrt(ROD**2 - across(t) ** 2)

    h = DIFFERENCE
    acceleration = (height(times + h) - 2 * height(times) + height(times - h)) / h**2
    degrees, absolute = np.loadtxt(PISTON / "gas-pressure.csv", delimiter=",", skiprows=1).T
    pressure = np.interp(np.mod(-20 + np.degrees(RATE * times), 720), degrees, absolute) - 1e5
    gas = -np.pi * (0.04296 - 0.0003) ** 2 * pressure
    rod_up = mass * (acceleration - gravity) - gas
    return -rod_up * across(times) / np.sqrt(ROD**2 - across(times) ** 2)


@pytest.mark.parametrize(("side", "gravity"), [(-1.0, -9.81), (1.0, -9.81), (-1.0, -2000.0)])
def test_side_force_of_the_rigid_piston(job: Job, side: float, gravity: float) -> None:
    changes = {"joint": {"rod": {"lateral": [side, 0.0, 0.0]}}, "run": {"gravity": [0.0, 0.0, gravity]}}
    mechanism = mechanism_of(variant(job, changes), PERIOD)
    np.testing.assert_array_equal(mechanism.lateral, [side, 0, 0])
    np.testing.assert_array_equal(mechanism.along, [0, 0, 1])
    assert (len(mechanism.side_force), mechanism.grid[0], mechanism.grid[-1]) == (GRID, 0.0, PERIOD)
    pin = job.store.get(job.components()["piston"]["modes"].key, "modes", only=["loads"]).loads["pin"].point
    np.testing.assert_allclose(pin, [0.0005 + PIN, 0, 0.018], atol=0.1 * abs(PIN))
    force = by_hand(mechanism.mass, mechanism.middles, float(pin[0]), side=side, gravity=gravity)
    np.testing.assert_allclose(side * mechanism.side_force, force, rtol=0, atol=BETWEEN * np.abs(force).max())


def test_combustion_presses_on_the_thrust_side(job: Job) -> None:
    """Which is at +x: its wall pushes to −x, and before the dead centre the other one to +x."""
    mechanism = mechanism_of(job, PERIOD)
    degrees = -20 + np.degrees(RATE * mechanism.middles)
    along_x = mechanism.side_force * mechanism.lateral[0]
    assert (along_x[(degrees > 5) & (degrees < 60)] < 0).all()
    assert (along_x[(degrees > -15) & (degrees < -5)] > 0).all()
    # It is largest some 20° after the dead centre: 60 bar on 57 cm² times r/l · sin θ.
    assert degrees[np.argmin(along_x)] == pytest.approx(22, abs=8)
    assert along_x.min() == pytest.approx(-60e5 * 0.0057 * RADIUS / ROD * np.sin(np.radians(22)), rel=0.25)


def test_mechanism(job: Job) -> None:
    mechanism = mechanism_of(job, 0.012)
    morph = job.store.get(job.components()["piston"]["morph"].key, "morph")
    assert mechanism.mass == morph.mass
    assert mechanism.inertia == pytest.approx(morph.inertia[1, 1], rel=1e-12)
    assert mechanism.cycle == pytest.approx(PERIOD, rel=1e-12)
    assert mechanism.grid[-1] == 0.012
    assert mechanism.middles[0] == pytest.approx(0.012 / GRID / 2)
    # Two thirds into a longer run stands the same force.
    longer = mechanism_of(job, 0.018)
    np.testing.assert_allclose(
        np.interp(mechanism.middles, longer.middles, longer.side_force), mechanism.side_force, atol=0.1
    )


def nodal(*, after: float = 1.0, scale: float = 1.0, begin: float = 0.0) -> NodalRecord:
    """Return a run with 100 N at the thrust side and 60 N at the other.

    Args:
        after: From when on the thrust side's force is `scale` times as large [s].
        begin: Until when there is next to no force, 1 mN times `scale` [s].
    """
    times = 1e-5 * np.arange(1, 4001)
    size = np.where(times <= begin, 1e-5 * scale, np.where(times > after, scale, 1.0))
    thrust, anti = np.zeros((4000, 3)), np.zeros((4000, 3))
    thrust[:, 0], anti[:, 0] = -100 * size, np.where(times <= begin, 0.0, 60.0)
    frames = times[99::100]
    masters = {name: np.outer(np.cos(100 * frames), np.ones(6)) for name in ("thrust", "anti")}
    return NodalRecord(
        1e-5, times, thrust + anti, np.zeros((4000, 3)), 0.0, 1, 1, 0.0, 0.0,
        forces={"thrust": thrust, "anti": anti}, motion={"piston": np.zeros((4000, 12))},
        frame_times=frames, masters=masters,
    )  # fmt: skip


@pytest.mark.parametrize("apart", [0.1, 0.2, -0.5])
def test_reproducible_up_to_five_per_cent(job: Job, apart: float) -> None:
    """∫ (100 d)² from t₁ on reaches 0.05² of ∫ 100² (1 + d)² + 60², which grows from the start."""
    t1, share = 0.01, 0.05**2
    first, later = 100**2 + 60**2, (100 * (1 + apart)) ** 2 + 60**2
    expected = t1 + share * first * t1 / ((100 * apart) ** 2 - share * later)
    found = reproducible(job, [nodal(), nodal(after=t1, scale=1 + apart)])
    # Half the window at the beginning, and one interval of the grid.
    assert found == pytest.approx(expected, abs=20e-6 + PERIOD / GRID)


def test_reproducible_to_the_end(job: Job) -> None:
    assert reproducible(job, [nodal(), nodal()]) == PERIOD
    assert reproducible(job, [nodal(), nodal(scale=1.05, after=0.0)]) == PERIOD


def test_reproducible_looks_at_the_two_finest(job: Job) -> None:
    wild = nodal(after=0.01, scale=3.0)
    assert reproducible(job, [wild, nodal(), nodal()]) == PERIOD
    assert reproducible(job, [nodal(), nodal(), wild]) == pytest.approx(0.01, abs=3e-5)


def test_forces_before_the_first_contact_do_not_count(job: Job) -> None:
    assert reproducible(job, [nodal(begin=0.005, scale=2.0), nodal(begin=0.005)]) == PERIOD


def test_comparison_stops_where_the_report_says(job: Job) -> None:
    """The runs differ from 20 ms on; the report compares up to 12 ms."""
    run, reference = nodal(after=0.02, scale=2.0), nodal()
    assert job.scene.report.until == 0.012
    errors = cycle_errors(job, run, reference)
    whole = 100 * np.sqrt(0.5) / np.hypot(100, 60)
    assert errors["force"] == 0
    assert errors["force, whole run"] == pytest.approx(whole, rel=1e-3)
    assert errors["liner displacement"] == 0
    later = cycle_errors(variant(job, {"report": {"until": 0.03}}), run, reference)
    assert later["force"] == pytest.approx(100 * np.sqrt(1 / 3) / np.hypot(100, 60), rel=1e-3)
    assert later["force, whole run"] == errors["force, whole run"]


def test_comparison_of_the_whole_run(job: Job) -> None:
    whole = variant(job, {"report": {"until": 0.04}})
    errors = cycle_errors(whole, nodal(after=0.02, scale=2.0), nodal())
    assert errors["force"] == errors["force, whole run"] > 0.5
