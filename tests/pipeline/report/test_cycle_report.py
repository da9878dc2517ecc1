"""What a report compares in a cycle: forces up to its end and beyond, impacts, the liner's velocity, slap energy."""

from dataclasses import replace

import numpy as np
import pytest

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.modaldb.records.trajectory import ContactHistory, Trajectory
from gudgeon.pipeline.report.force import GRID, reproducible
from gudgeon.pipeline.report.reference import errors_against, external_reference
from gudgeon.pipeline.stages.job import Job, variant
from tests.pipeline.small import rigid_piston

PERIOD = 0.04


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Job:
    return rigid_piston(tmp_path_factory.mktemp("cycle"))


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
    frames = times[9::10]
    masters = {name: np.outer(1e-6 * np.cos(2e3 * np.pi * frames), np.ones(6)) for name in ("thrust", "anti")}
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
    run, reference = nodal(after=0.02, scale=2.0), external_reference(job, [nodal()])
    assert reference is not None
    assert job.scene.report.until == 0.012
    errors = errors_against(job, run, reference)
    whole = 100 * np.sqrt(0.5) / np.hypot(100, 60)
    assert errors["force"] == 0
    assert errors["force, whole run"] == pytest.approx(whole, rel=1e-3)
    assert errors["thrust.impulse"] == errors["anti.force_rms"] == errors["thrust.surface_velocity"] == 0
    longer = variant(job, {"report": {"until": 0.03}})
    later = errors_against(longer, run, external_reference(longer, [nodal()]))
    assert later["force"] == pytest.approx(100 * np.sqrt(1 / 3) / np.hypot(100, 60), rel=1e-3)
    assert later["force, whole run"] == errors["force, whole run"]
    assert later["thrust.impulse"] == pytest.approx(1 / 3, rel=1e-9)
    assert later["anti.impulse"] == 0


def test_comparison_of_the_whole_run(job: Job) -> None:
    whole = variant(job, {"report": {"until": 0.04}})
    errors = errors_against(whole, nodal(after=0.02, scale=2.0), external_reference(whole, [nodal()]))
    assert "force, whole run" not in errors
    assert errors["force"] > 0.5


def slapping(*, late: float = 0.0, scale: float = 1.0, speed: float = 0.3) -> NodalRecord:
    """Return a run that meets the other side at 4 ms and comes back at 8 ms, for 1 ms each.

    Args:
        late: Delay of the second impact [s].
        scale: Of its force.
        speed: Lateral velocity before the first impact [m/s].
    """
    base, times = nodal(), 1e-5 * np.arange(1, 4001)
    thrust, anti = np.zeros((4000, 3)), np.zeros((4000, 3))
    anti[(times > 4e-3) & (times <= 5e-3), 0] = 500.0
    thrust[(times > 8e-3 + late) & (times <= 9e-3 + late), 0] = -300.0 * scale
    motion = np.zeros((4000, 12))
    motion[:, 6] = np.interp(times, [0, 4e-3, 5e-3, 8e-3, 9e-3], [0.0, -speed, 0.1, 0.2, 0.0])
    motion[:, 8] = 10.0
    return replace(base, forces={"thrust": thrust, "anti": anti}, motion={"piston": motion})


def compared(job: Job, run: NodalRecord) -> dict[str, float]:
    reference = external_reference(job, [slapping()])
    assert reference is not None
    return errors_against(job, run, reference)


def test_impacts_of_both_sides(job: Job) -> None:
    """Each by itself; what one of them lacks is no error of the other."""
    errors = compared(job, slapping(scale=1.1))
    for key in ("impulse", "force_peak", "time"):
        assert errors[f"anti.impact1.{key}"] == 0
    assert errors["thrust.impact1.impulse"] == pytest.approx(0.1, rel=1e-9)
    assert errors["thrust.impact1.force_peak"] == pytest.approx(0.1, rel=1e-9)
    assert errors["thrust.force_rms"] == pytest.approx(0.1, rel=1e-9)
    late = compared(job, slapping(late=2e-4))
    assert late["thrust.impact1.time"] == pytest.approx(2e-4 / 8.5e-3, rel=1e-3)
    assert late["thrust.impact1.impulse"] == pytest.approx(0.0, abs=1e-9)
    lacking = compared(job, slapping(scale=0.0))
    assert lacking["thrust.impact1.impulse"] == -1
    assert lacking["thrust.impact1.time"] == np.inf


def test_an_impact_at_the_end_of_the_comparison_is_not_judged(job: Job) -> None:
    cut = variant(job, {"report": {"until": 0.0085}})
    errors = errors_against(cut, slapping(), external_reference(cut, [slapping()]))
    assert "anti.impact1.impulse" in errors
    assert not [name for name in errors if name.startswith("thrust.impact")]
    assert "thrust.impulse" in errors


def test_energy_before_slaps(job: Job) -> None:
    """½ m v² with v = 0.3 and 0.2 m/s; the motion along the axis of 10 m/s is no part of it."""
    assert compared(job, slapping())["piston.slap_energy"] == 0
    found = compared(job, slapping(speed=0.33))["piston.slap_energy"]
    assert found == pytest.approx((0.33**2 - 0.3**2) / np.hypot(0.3**2, 0.2**2), rel=1e-3)


def test_velocity_of_the_liner(job: Job) -> None:
    run = slapping()
    louder = replace(run, masters={name: 1.25 * rows for name, rows in run.masters.items()})
    errors = compared(job, louder)
    assert errors["thrust.surface_velocity"] == errors["anti.surface_velocity"] == pytest.approx(0.25, rel=1e-9)
    # Another number of functions, as on splines of another spacing.
    fewer = replace(run, masters={name: rows[:, :3] for name, rows in run.masters.items()})
    assert compared(job, fewer)["thrust.surface_velocity"] == pytest.approx(0.0, abs=1e-9)


def test_reduced_and_full_fe_runs_are_compared_alike(job: Job) -> None:
    """The same forces and motion, as either record holds them."""
    run = slapping(scale=1.1)
    assert run.frame_times is not None
    contacts = {
        name: ContactHistory("piston", name, force, np.zeros((400, 1)), None, np.zeros((1, 3)), run.masters[name])
        for name, force in run.forces.items()
    }
    modal = Trajectory(
        "FINISHED", {}, {}, run.times, np.zeros((4000, 5)), contacts, run.frame_times, np.zeros((400, 0)),
        np.zeros((400, 0)), {}, 0.0, 0.0, {}, motion=run.motion,
    )  # fmt: skip
    reference = external_reference(job, [slapping()])
    assert reference is not None
    assert errors_against(job, modal, reference) == compared(job, run)
