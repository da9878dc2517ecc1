"""Slaps of a piston whose motion is known: it leaves one side, flies, meets the other, and bounces or stays.

The rigid piston without clearance is held by 100 N, first at `thrust`, from 5 ms on at `anti`; so the real one is
pushed across by as much from then on, a = −200 m/s², and at 7 ms it meets the other side at −0.4 m/s.
"""

from dataclasses import replace

import numpy as np
import pytest

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.modaldb.records.trajectory import ContactHistory, Trajectory
from gudgeon.pipeline.report.slaps import CycleHistory, Mechanism, Slap, differences, history_of, slaps, windowed

MASS, INERTIA = 0.5, 4e-4
PUSH = 100.0
CHANGE, HIT, END = 5e-3, 7e-3, 20e-3
WINDOW, TOUCH = 2e-3, 1.0
"""Length of a slap [s] and force of a touch [N], as `gudgeon.pipeline.report.slaps` defines them."""
SPEED = PUSH / MASS * (HIT - CHANGE)
"""At which it meets the other side [m/s]."""
STEP = 1e-5
EDGES = STEP * np.arange(2001)
ROUND_OFF = 1e-9
"""Relative: sums of 2000 intervals."""

MECHANISM = Mechanism(
    MASS, INERTIA, np.array([1.0, 0, 0]), np.array([0, 0, 1.0]), np.where(EDGES[1:] < CHANGE + STEP / 2, -PUSH, PUSH),
    EDGES, cycle=0.04,
)  # fmt: skip


def interval(time: float) -> int:
    """Return the number of the interval that begins at a time."""
    return round(time / STEP)


def crossing(*, rebound: float | None = None, hit: float = HIT, tilt: float = 0.0) -> CycleHistory:
    """Return a piston that crosses and meets the other side.

    Args:
        rebound: Share of its speed with which it flies back, after an impact of one interval; None: it stays.
        tilt: Angular velocity that it has until then, and loses [rad/s].
    """
    force = {"thrust": np.zeros(2000), "anti": np.zeros(2000)}
    force["thrust"][: interval(CHANGE)] = -PUSH
    force["anti"][interval(2e-3)] = 50 * TOUCH  # before the side force has changed: no slap
    force["thrust"][interval(2e-3)] -= 50 * TOUCH
    force["anti"][interval(6e-3)] = 0.9 * TOUCH  # grazing: no touch
    force["thrust"][interval(6e-3)] = -0.9 * TOUCH
    at = interval(hit)
    speed = PUSH / MASS * (hit - CHANGE)
    force["anti"][at] = PUSH + MASS * (1 + (rebound or 0.0)) * speed / STEP
    if rebound is None:
        force["anti"][at + 1 :] = PUSH
    rate = (force["thrust"] + force["anti"] - MECHANISM.side_force) / MASS
    frames = EDGES[50::50]
    bore = np.outer(np.sin(300 * frames), [1.0, -2.0, 0.5]) * 1e-6
    return CycleHistory(
        EDGES[1:], force, np.cumsum(rate) * STEP, np.where(EDGES[1:] < hit + STEP / 2, tilt, 0.0), frames,
        {"thrust": bore, "anti": 2 * bore},
    )  # fmt: skip


def test_piston_that_stays() -> None:
    (slap,) = slaps(crossing(), MECHANISM)
    energy = 0.5 * MASS * SPEED**2
    expected = Slap(
        pytest.approx(HIT), "anti", pytest.approx(MASS * SPEED), pytest.approx(energy), pytest.approx(energy)
    )
    assert slap == expected


def test_piston_that_bounces() -> None:
    """At half its speed it flies back, and is pushed towards the wall again for the rest of the window."""
    (slap,) = slaps(crossing(rebound=0.5), MECHANISM)
    after = 0.5 * SPEED - PUSH / MASS * (WINDOW - STEP)
    assert (slap.touch, slap.side) == (pytest.approx(HIT), "anti")
    assert slap.impulse == pytest.approx(MASS * (SPEED + after), rel=ROUND_OFF)
    assert slap.energy_lost == pytest.approx(0.5 * MASS * (SPEED**2 - after**2), rel=ROUND_OFF)
    assert slap.energy == pytest.approx(0.5 * MASS * SPEED**2, rel=ROUND_OFF)


def test_tilt_is_part_of_the_energy() -> None:
    (still,), (tilted,) = (slaps(crossing(tilt=tilt), MECHANISM) for tilt in (0.0, 20.0))
    assert tilted.energy_lost - still.energy_lost == pytest.approx(0.5 * INERTIA * 400, rel=ROUND_OFF)
    assert tilted.energy - still.energy == pytest.approx(0.5 * INERTIA * 400, rel=ROUND_OFF)
    assert tilted.impulse == still.impulse


def test_mirrored_piston_slaps_on_the_other_side() -> None:
    run = crossing(rebound=0.5)
    mirrored = replace(
        run, sides={"thrust": -run.sides["anti"], "anti": -run.sides["thrust"]}, lateral=-run.lateral, tilt=-run.tilt
    )
    (slap,), (other,) = slaps(run, MECHANISM), slaps(mirrored, replace(MECHANISM, side_force=-MECHANISM.side_force))
    assert other == replace(slap, side="thrust", impulse=-slap.impulse)


def test_every_change_of_side_has_its_slap() -> None:
    """After 12 ms the side force changes again, and it touches `thrust` at 13 ms."""
    run = crossing()
    back = replace(MECHANISM, side_force=np.where(EDGES[1:] > 12e-3, -PUSH, MECHANISM.side_force))
    run.sides["anti"][interval(12e-3) :] = 0.0
    run.sides["thrust"][interval(13e-3) :] = -PUSH
    found = slaps(run, back)
    assert [slap.side for slap in found] == ["anti", "thrust"]
    assert found[1].touch == pytest.approx(13e-3, rel=ROUND_OFF)
    # Until the next change only: without the first touch there is no first slap.
    run.sides["anti"][interval(CHANGE) :] = 0.0
    run.sides["anti"][interval(12.5e-3)] = PUSH
    assert [slap.side for slap in slaps(run, back)] == ["thrust"]


def test_slap_that_the_run_cuts_off_is_none() -> None:
    for until, number in ((HIT + WINDOW - STEP, 0), (HIT + WINDOW + STEP, 1)):
        count = interval(until)
        short = replace(MECHANISM, grid=EDGES[: count + 1], side_force=MECHANISM.side_force[:count])
        assert len(slaps(crossing(), short)) == number


def test_grid_need_not_be_that_of_the_run() -> None:
    """A grid of other intervals finds the touch at the beginning of one of its own."""
    edges = np.linspace(0, END, 1301)
    side = np.where(edges[1:] <= CHANGE, -PUSH, PUSH)
    (slap,) = slaps(crossing(), replace(MECHANISM, grid=edges, side_force=side))
    assert HIT - edges[1] <= slap.touch <= HIT + STEP
    assert slap.impulse == pytest.approx(MASS * SPEED, abs=PUSH * edges[1])


# Differences


def test_a_run_does_not_differ_from_itself() -> None:
    errors = differences(crossing(rebound=0.5), crossing(rebound=0.5), MECHANISM, 4e-5)
    assert errors == dict.fromkeys(("slap impulse", "energy lost", "slap time", "force", "liner displacement"), 0.0)


def test_late_slap() -> None:
    """The same piston, but 0.3 ms later and therefore faster."""
    late = 3e-4
    errors = differences(crossing(hit=HIT + late), crossing(), MECHANISM, 0.0)
    faster = (HIT + late - CHANGE) / (HIT - CHANGE)
    assert errors["slap time"] == pytest.approx(late / 0.04, rel=ROUND_OFF)
    assert errors["slap impulse"] == pytest.approx(faster - 1, rel=ROUND_OFF)
    assert errors["energy lost"] == pytest.approx(faster**2 - 1, rel=ROUND_OFF)
    assert errors["force"] > 1


def test_loss_is_a_share_of_the_largest_energy() -> None:
    errors = differences(crossing(rebound=0.5), crossing(), MECHANISM, 0.0)
    after = 0.5 * SPEED - PUSH / MASS * (WINDOW - STEP)
    assert errors["slap time"] == 0
    assert errors["energy lost"] == pytest.approx((after / SPEED) ** 2, rel=ROUND_OFF)
    assert errors["slap impulse"] == pytest.approx(-after / SPEED, rel=ROUND_OFF)
    # Against the one that bounces, whose largest energy is the same, though it loses less.
    errors = differences(crossing(), crossing(rebound=0.5), MECHANISM, 0.0)
    assert errors["energy lost"] == pytest.approx((after / SPEED) ** 2, rel=ROUND_OFF)


def test_missing_and_additional_slap() -> None:
    never = crossing()
    never.sides["anti"][interval(CHANGE) :] = 0.0
    for ours, theirs in ((never, crossing()), (crossing(), never)):
        errors = differences(ours, theirs, MECHANISM, 4e-5)
        assert [errors[name] for name in ("slap impulse", "energy lost", "slap time")] == [np.inf] * 3
        assert 0 < errors["force"] < np.inf
        assert errors["liner displacement"] == 0


def test_slap_of_another_contact_is_another_slap() -> None:
    run = crossing()
    upper = {"thrust": run.sides["thrust"], "anti": np.zeros(2000), "upper": run.sides["anti"]}
    both = replace(run, sides=run.sides | {"upper": np.zeros(2000)})
    errors = differences(replace(run, sides=upper), both, MECHANISM, 0.0)
    assert errors["slap impulse"] == np.inf
    assert errors["force"] > 0.1


def test_scaled_forces_and_displacements() -> None:
    run = crossing()
    scaled = replace(
        run,
        sides={name: 1.1 * force for name, force in run.sides.items()},
        masters={name: 0.8 * rows for name, rows in run.masters.items()},
    )
    errors = differences(scaled, run, MECHANISM, 4e-5)
    assert errors["force"] == pytest.approx(0.1, rel=ROUND_OFF)
    assert errors["liner displacement"] == pytest.approx(0.2, rel=ROUND_OFF)


def test_sides_are_not_added_up() -> None:
    """Forces that move from one side to the other are an error, though their sum stays."""
    run = crossing()
    moved = {"thrust": run.sides["thrust"] + 30.0, "anti": run.sides["anti"] - 30.0}
    assert differences(replace(run, sides=moved), run, MECHANISM, 0.0)["force"] > 0.05
    np.testing.assert_allclose(windowed(run, MECHANISM, 0.0), [run.sides["anti"], run.sides["thrust"]], atol=1e-6)


def test_displacements_at_other_frames_and_up_to_the_end() -> None:
    run = crossing()
    finer = EDGES[25::25]
    bore = np.outer(np.sin(300 * finer), [1.0, -2.0, 0.5]) * 1e-6
    fine = replace(run, frame_times=finer, masters={"thrust": bore, "anti": 2 * bore})
    assert differences(fine, run, MECHANISM, 0.0)["liner displacement"] == pytest.approx(0.0, abs=ROUND_OFF)
    wrong = {name: np.where(run.frame_times[:, None] > 0.01, 0.0, rows) for name, rows in run.masters.items()}
    count = interval(0.01)
    for mechanism, differs in (
        (MECHANISM, True),
        (replace(MECHANISM, grid=EDGES[: count + 1], side_force=MECHANISM.side_force[:count]), False),
    ):
        found = differences(replace(run, masters=wrong), run, mechanism, 0.0)["liner displacement"]
        assert (found > 0.1) == differs


def test_rigid_obstacles_have_no_displacement() -> None:
    run = replace(crossing(), masters={}, frame_times=np.empty(0))
    errors = differences(run, run, MECHANISM, 0.0)
    assert errors == dict.fromkeys(("slap impulse", "energy lost", "slap time", "force"), 0.0)


def test_nothing_differs_from_nothing_by_nothing() -> None:
    """A bore that never gives way, and a slap without motion."""
    run = crossing()
    still = replace(run, lateral=np.zeros(2000), masters={name: 0 * rows for name, rows in run.masters.items()})
    errors = differences(still, still, MECHANISM, 0.0)
    assert (errors["energy lost"], errors["liner displacement"]) == (0, 0)
    errors = differences(run, still, MECHANISM, 0.0)
    assert (errors["energy lost"], errors["liner displacement"]) == (np.inf, np.inf)


# Records


def records() -> tuple[NodalRecord, Trajectory]:
    """Return the same motion as either model tells it."""
    times = EDGES[1:5]
    motion = {"piston": np.arange(48.0).reshape(4, 12), "liner": np.zeros((4, 12))}
    forces = {name: scale * np.arange(12.0).reshape(4, 3) for name, scale in (("thrust", 1), ("anti", -2), ("rod", 5))}
    frames, bore = times[1::2], {"thrust": np.ones((2, 3)), "anti": np.zeros((2, 3))}
    nodal = NodalRecord(
        STEP, times, forces["thrust"], np.zeros((4, 3)), 0.0, 1, 1, 0.0, 0.0,
        forces=forces, motion=motion, frame_times=frames, masters=bore,
    )  # fmt: skip
    contacts = {
        name: ContactHistory("piston", name, forces[name], np.zeros((2, 1)), None, np.zeros((1, 3)), bore[name])
        for name in bore
    }
    modal = Trajectory(
        "FINISHED", {}, {}, times, np.zeros((4, 5)), contacts, frames, np.zeros((2, 0)), np.zeros((2, 0)), {}, 0.0, 0.0,
        {}, motion=motion,
    )  # fmt: skip
    return nodal, modal


def test_both_records_tell_the_same_cycle() -> None:
    nodal, modal = records()
    turned = replace(MECHANISM, lateral=np.array([-0.6, 0.8, 0.0]))
    for record in (nodal, modal):
        run = history_of(record, ["anti", "thrust"], "piston", turned)
        assert list(run.sides) == ["anti", "thrust"]
        np.testing.assert_array_equal(run.times, nodal.times)
        rows = nodal.motion["piston"]
        np.testing.assert_allclose(run.sides["thrust"], -0.6 * nodal.force[:, 0] + 0.8 * nodal.force[:, 1])
        np.testing.assert_allclose(run.sides["anti"], -2 * run.sides["thrust"])
        np.testing.assert_allclose(run.lateral, -0.6 * rows[:, 6] + 0.8 * rows[:, 7])
        # About along × lateral = (−0.8, −0.6, 0).
        np.testing.assert_allclose(run.tilt, -0.8 * rows[:, 9] - 0.6 * rows[:, 10])
        np.testing.assert_array_equal(run.frame_times, modal.frame_times)
        assert {name: rows.mean() for name, rows in run.masters.items()} == {"thrust": 1.0, "anti": 0.0}


def test_records_without_a_master() -> None:
    nodal, modal = records()
    contacts = {name: replace(one, master=None) for name, one in modal.contacts.items()}
    for record in (replace(nodal, frame_times=None, masters={}), replace(modal, contacts=contacts)):
        assert history_of(record, ["thrust"], "piston", MECHANISM).masters == {}
