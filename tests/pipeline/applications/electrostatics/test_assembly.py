"""The micro assembly as it is shipped: friction carries a peg to a hole, a field pulls it down, it stays."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon import modaldb
from gudgeon.modaldb.records.field import PoseGridRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.solver.forces.fields.pose_field import PoseField
from tests.scenes import scene_path

pytestmark = pytest.mark.validation

SCENE = scene_path("mems-assembly")
LIFTED, CARRIED, RELEASED = 25e-6, 60e-6, 115e-6
"""Ends of parts of the path [s]."""
WEIGHT = 1200.0 * 3e-15 * 9.81
GRIP, RUBS, WALL = 0.15e-6, 0.4, 5.3e-6


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("assembly")


def solved(db: Path, name: str, **changes: object) -> Trajectory:
    settings = {key.replace("__", "."): value for key, value in changes.items()}
    report = run(SCENE, set=settings, db=db, out=db / name, until="solve")
    assert report.result == "FINISHED", report.reason
    return modaldb.open(db).get(report.stages["solve"].key, "trajectory")


@pytest.fixture(scope="module")
def shipped(db: Path) -> Trajectory:
    return solved(db, "shipped")


def mean(found: Trajectory, name: str, begin: float, end: float) -> np.ndarray:
    """Return the mean force of a contact on the peg over a time [N], (3,)."""
    within = (found.times > begin) & (found.times <= end)
    return np.asarray(found.contacts[name].force[within].mean(axis=0))


def pull(db: Path, gap: float) -> float:
    """Return the force of the field over a gap between foot and electrode [N], by the gradient of its co-energy."""
    job = open_job(SCENE / "field.toml", db=db, out=db / "field")
    (product,) = job.pose_grid().values()
    record: PoseGridRecord = job.store.get(product.key, "posegrid")
    return -float(PoseField.of(record).interaction({"z": gap - 1.05e-5}, record.potentials).gradient[0])


@pytest.mark.validation
def test_the_peg_is_in_the_hole(shipped: Trajectory) -> None:
    """10 µm deep, between the walls, let go by the fingers, at rest; energy and momentum balance."""
    end = shipped.motion["peg"][-1]
    assert end[2] == pytest.approx(-1e-5, abs=2e-8)
    assert abs(end[0] - 2e-5) <= WALL - 5e-6 + 1e-9
    late = shipped.times > RELEASED
    for name in ("grip_near", "grip_far"):
        assert not shipped.contacts[name].force[late].any()
    assert shipped.energy_drift < 1e-5
    assert shipped.momentum_residual < 1e-9
    assert np.ptp(shipped.motion["peg"][shipped.times > 1.35e-4, 2]) < 1e-9


def test_friction_carries_weight_and_field(shipped: Trajectory, db: Path) -> None:
    """On the way, high over the plate, and low over the bottom: the forces of both fingers are weight and field."""
    for begin, end, height, swings in ((30e-6, 55e-6, 3e-6, 4e-10), (96e-6, 99e-6, -9.8e-6, 0.0)):
        grips = [mean(shipped, name, begin, end) for name in ("grip_near", "grip_far")]
        held = pull(db, height + 1.05e-5) + WEIGHT
        # On the way fingers and peg swing up and down by 2 mm/s; adhesion at 0.2 µm is 0.1 nN.
        assert sum(grips)[2] == pytest.approx(held, rel=0.02, abs=swings)
        for force in grips:
            assert np.hypot(force[0], force[2]) <= RUBS * abs(force[1]) * (1 + 1e-6)


def test_fingers_press_as_beams_do(shipped: Trajectory) -> None:
    """3 E I/a³ of cantilevers, times the way of their roots beyond the gap: bent, they touch the peg at its edge that
    is nearer to the root, a = 90 µm; shear and the peg's own give take 1 %."""
    stiffness = 3 * 160e9 * (1e-5 * (4e-6) ** 3 / 12) / (9e-5) ** 3
    pressed = abs(mean(shipped, "grip_near", 30e-6, 55e-6)[1])
    assert pressed == pytest.approx(stiffness * (2 * GRIP - 1e-7), rel=0.03)


def test_the_bottom_carries_weight_field_and_adhesion(shipped: Trajectory, db: Path) -> None:
    force = mean(shipped, "bottom", 1.3e-4, 1.4e-4)[2]
    adheres = 2 * np.pi * 0.05 * 5e-7
    assert force == pytest.approx(pull(db, 0.5e-6) + WEIGHT + adheres, rel=0.02)


@pytest.mark.validation
def test_without_a_field_it_stays_as_well(db: Path) -> None:
    """At 0 V it falls by its weight alone from 0.2 µm above the bottom, for which the run is too short."""
    found = solved(db, "uncharged", force__attraction__potentials__peg=0.0)
    assert found.motion["peg"][-1, 2] > -1e-5 - 2e-8
    assert found.energy_drift < 1e-5
    fell = 0.5 * 9.81 * (1.4e-4 - 1.05e-4) ** 2
    assert found.motion["peg"][-1, 2] == pytest.approx(-9.8e-6, abs=5 * fell + 5e-8)


def test_without_friction_it_is_not_lifted(db: Path) -> None:
    """The fingers close on it and rise without it."""
    changes = {f"contact__grip_{side}__friction__static": 0.0 for side in ("near", "far")}
    found = solved(db, "slippery", run__duration=LIFTED, **changes)
    assert found.motion["near"][-1, 2] == pytest.approx(3e-6, rel=1e-3)
    assert abs(found.motion["peg"][-1, 2]) < 1e-7


@pytest.mark.parametrize("volts", [40.0, 80.0])
def test_gravity_and_voltage_next_to_the_shipped_ones(db: Path, volts: float) -> None:
    """Twice the voltage, and no gravity, up to over the hole: the peg is where the fingers are, less its slip."""
    found = solved(
        db, f"volts {volts:g}", run__duration=CARRIED + 1e-6, run__gravity=[0.0, 0.0, 0.0],
        force__attraction__potentials__peg=volts,
    )  # fmt: skip
    assert found.motion["peg"][-1, 2] == pytest.approx(3e-6, abs=3e-8)
    assert found.motion["peg"][-1, 0] == pytest.approx(2.02e-5, abs=3e-8)
    assert found.energy_drift < 1e-5
