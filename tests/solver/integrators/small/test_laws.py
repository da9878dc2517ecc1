"""Contact laws over ports: order of convergence, laws' restitution, balances, histories."""

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter
from scipy import integrate
from scipy.special import gamma

from gudgeon.modaldb.records.modes import ModalRecord, MorphRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.laws import Law
from gudgeon.solver.laws.restitution import delivered_restitution
from gudgeon.solver.simulate import simulate
from tests.scenes import scene_path
from tests.solver.systems import block_records, block_scene, build_all, rigid_records, rod_records, rod_scene

X, BACK, UP, DOWN = [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]
ORIGIN = [0.0, 0.0, 0.0]
HERTZ = {"kind": "hertz", "stiffness": 1e9}
HALF = {"kind": "exact", "stiffness": 1e9, "restitution": 0.5}
Records = dict[str, tuple[ModalRecord, MorphRecord]]


def reference(name: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return parameters and expected values."""
    found = json.loads(scene_path(f"{name}.json").read_text())
    return found["parameters"], found["expected"]


def run(folder: Path, records: Records, scene: dict[str, Any], steps: int | None = None, **settings: Any) -> Trajectory:
    """Simulate with a number of steps, or those of run.accuracy, and check the momentum, which depends on neither."""
    table = {"samples": 200, "frames": 20} | scene["run"] | settings
    if steps is not None:
        table |= {"step": table["duration"] / steps, "checks": False}
    scene = scene | {"run": table}
    trajectory = simulate(build_all(folder, records, scene))
    assert trajectory.result == "FINISHED"
    assert trajectory.counts["integrator"] == "small"
    assert trajectory.momentum_residual < 1e-12
    return trajectory


def wall(x: float, normal: list[float]) -> dict[str, Any]:
    return {"shape": "plane", "point": [x, 0, 0], "normal": normal}


def shot(law: dict[str, Any], mass: float = 1.0, speed: float = 1.0, gap: float = 0.0) -> tuple[Records, dict]:  # type: ignore[type-arg]
    """A mass against a wall."""
    contact = {"body": "a", "interface": "p", "against": wall(gap, BACK), "method": "penalty", "law": law}
    scene = {"body": {"a": {"velocity": [speed, 0, 0]}}, "contact": {"w": contact}, "run": {"duration": 4e-3}}
    return {"a": rigid_records(mass, {"p": (ORIGIN, X)}, axes=(0,))}, scene


def row(gaps: list[float], law: dict[str, Any]) -> tuple[Records, dict[str, Any]]:
    """Masses of 1 kg along x, the first one at 1 m/s."""
    names = "abcd"[: len(gaps) + 1]
    records = {name: rigid_records(1.0, {"r": (ORIGIN, X), "l": (ORIGIN, BACK)}, axes=(0,)) for name in names}
    places = np.concatenate([[0.0], np.cumsum(gaps)])
    bodies: dict[str, Any] = {name: {"position": [x, 0, 0]} for name, x in zip(names, places, strict=True)}
    bodies["a"]["velocity"] = X
    contacts = {
        one + other: {
            "body": one, "interface": "r", "against": {"shape": "body", "body": other, "interface": "l"},
            "method": "penalty", "law": law,
        }
        for one, other in pairwise(names)
    }  # fmt: skip
    return records, {"body": bodies, "contact": contacts, "run": {"duration": 4e-3}}


def of(expected: dict[str, Any], name: str) -> float:
    return expected[name]["value"]


def test_two_steel_spheres(tmp_path: Path) -> None:
    """Hertz's impact, from the spheres' own radius and modulus."""
    given, expected = reference("hertz/C1_sphere_sphere_steel")
    law = {"kind": "hertz", "radius": given["R_eff"], "modulus": given["E_star"]}
    records, scene = row([1e-4], law)
    mass = 2 * given["m_eff"]
    records = {name: rigid_records(mass, {"r": (ORIGIN, X), "l": (ORIGIN, BACK)}, axes=(0,)) for name in records}
    scene["body"]["a"]["velocity"] = [given["v0"], 0, 0]
    found = run(tmp_path, records, scene, steps=400_000, duration=3e-4)
    start, end, impulse, force, when, closing, opening = found.impacts["ab"][0, :7]
    assert start == pytest.approx(1e-4 / given["v0"], rel=1e-14)
    assert force == pytest.approx(of(expected, "max_force"), rel=1e-9)
    assert end - start == pytest.approx(of(expected, "contact_duration"), rel=1e-9)
    assert when - start == pytest.approx(0.5 * (end - start), rel=1e-4)
    assert (closing, opening) == (pytest.approx(given["v0"]), pytest.approx(given["v0"], rel=1e-9))
    assert impulse == pytest.approx(mass * given["v0"], rel=1e-9)
    np.testing.assert_allclose(found.velocities[-1] / np.sqrt(mass), [0.0, given["v0"]], atol=1e-9 * given["v0"])


def test_sphere_against_a_steel_half_space(tmp_path: Path) -> None:
    given, expected = reference("hertz/C2_sphere_halfspace_steel")
    law = {"kind": "hertz", "radius": given["R_eff"], "modulus": given["E_star"]}
    records, scene = shot(law, given["m_eff"], given["v0"])
    found = run(tmp_path, records, scene, steps=100_000, duration=1.5 * of(expected, "contact_duration"))
    impact = found.impacts["w"][0]
    assert impact[3] == pytest.approx(of(expected, "max_force"), rel=1e-8)
    assert impact[1] == pytest.approx(of(expected, "contact_duration"), rel=1e-8)


def test_error_follows_the_accuracy(tmp_path: Path) -> None:
    """Force, duration and restitution are within what was asked, and finer costs more steps, as of order 2."""
    given, expected = reference("hertz/C1_sphere_sphere_steel")
    law = {"kind": "hertz", "stiffness": of(expected, "K")}
    records, scene = shot(law, given["m_eff"], given["v0"])
    errors, steps = [], []
    for accuracy in (1e-3, 1e-5, 1e-7):
        found = run(tmp_path / f"{accuracy:g}", records, scene, duration=3e-4, accuracy=accuracy)
        impact = found.impacts["w"][0]
        worst = [
            impact[3] / of(expected, "max_force") - 1, impact[1] / of(expected, "contact_duration") - 1,
            impact[6] / given["v0"] - 1,
        ]  # fmt: skip
        errors.append(max(map(abs, worst)))
        steps.append(found.counts["steps"])
        assert errors[-1] < accuracy
        assert found.energy_drift < 1e-12
    for coarse, fine in ((0, 1), (1, 2)):
        assert steps[fine] > 2 * steps[coarse]
        assert errors[coarse] / errors[fine] == pytest.approx((steps[fine] / steps[coarse]) ** 2, rel=0.3)


LOSSY = ("hunt-crossley", "lankarani-nikravesh", "flores", "hu-guo", "gonthier", "exact")


@pytest.mark.parametrize("restitution", [0.2, 0.6, 0.95])
@pytest.mark.parametrize("kind", LOSSY)
def test_laws_deliver_their_restitution(kind: str, restitution: float, tmp_path: Path) -> None:
    """What leaves is what the law's loss gives by its first integral; with 'exact' what was asked."""
    law = {"kind": kind, "stiffness": 1e9, "restitution": restitution}
    records, scene = shot(law)
    found = run(tmp_path, records, scene, steps=50_000)
    loss = TypeAdapter(Law).validate_python(law).coefficients().loss
    delivered = -float(found.velocities[-1, 0])
    assert delivered == pytest.approx(delivered_restitution(loss), rel=1e-6)
    assert found.impacts["w"][0, 6] == pytest.approx(delivered, rel=1e-6)
    if kind == "exact":
        assert delivered == pytest.approx(restitution, rel=1e-6)
    assert found.energies[-1, 3] == pytest.approx(0.5 * (1 - delivered**2), rel=1e-4)


def test_any_exponent(tmp_path: Path) -> None:
    """Deepest indentation and force of F = K dⁿ."""
    for exponent in (1.1, 2.0, 3.0):
        records, scene = shot({"kind": "hertz", "stiffness": 1e9, "exponent": exponent})
        found = run(tmp_path / str(exponent), records, scene, steps=1_000_000, duration=0.02)
        deepest = (0.5 * (exponent + 1) / 1e9) ** (1 / (exponent + 1))
        assert found.impacts["w"][0, 3] == pytest.approx(1e9 * deepest**exponent, rel=1e-6)
        assert found.velocities[-1, 0] == pytest.approx(-1.0, rel=1e-7)


@pytest.mark.parametrize("law", [HERTZ, HALF])
@pytest.mark.parametrize(("samples", "frames"), [(10, 2), (40, 5), (2000, 100)])
def test_histories_do_not_touch_the_motion(samples: int, frames: int, law: dict[str, Any], tmp_path: Path) -> None:
    """Samples add up to the impulse; the motion does not know of them, nor of frames that a contact spans."""
    records, scene = row([1e-4, 3e-5], law)
    scene["run"]["duration"] = 1.5e-3
    plain = run(tmp_path / "plain", records, scene, steps=4000)
    found = run(tmp_path / "found", records, scene, steps=4000, samples=samples, frames=frames)
    interval = found.times[1] - found.times[0]
    for name in ("ab", "bc"):
        impulse = -found.contacts[name].force[:, 0].sum() * interval
        assert impulse == pytest.approx(found.impacts[name][:, 2].sum(), rel=1e-12)
        np.testing.assert_allclose(found.impacts[name], plain.impacts[name], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(found.velocities[-1], plain.velocities[-1], rtol=0, atol=1e-13)
    np.testing.assert_allclose(found.energies[-1], plain.energies[-1], rtol=1e-12, atol=1e-13)


def test_frames_within_a_contact_lie_on_its_motion(tmp_path: Path) -> None:
    """A contact over forty frames: states between are those of a run that looks at other times."""
    records, scene = shot(HERTZ)
    fine = run(tmp_path / "fine", records, scene, steps=56_000, duration=7e-4, samples=1400, frames=40)
    coarse = run(tmp_path / "coarse", records, scene, steps=56_000, duration=7e-4, samples=40, frames=8)
    np.testing.assert_allclose(fine.frames[4::5], coarse.frames, rtol=0, atol=1e-13)
    np.testing.assert_allclose(fine.velocities[4::5], coarse.velocities, rtol=0, atol=1e-11)
    depth = fine.motion["a"][:, 0]
    expected = 0.5 * fine.motion["a"][:, 6] ** 2 + 0.4e9 * np.maximum(depth, 0) ** 2.5
    np.testing.assert_allclose(expected, 0.5, rtol=1e-9)
    np.testing.assert_allclose(fine.energies[:, [0, 2]].sum(axis=1), 0.5, rtol=1e-9)


def test_a_run_that_ends_in_contact(tmp_path: Path) -> None:
    """An impact that goes on has what it has given by then."""
    records, scene = shot(HERTZ)
    found = run(tmp_path, records, scene, steps=30_000, duration=3e-4)
    start, end, impulse = found.impacts["w"][0, :3]
    assert (start, end) == (0.0, pytest.approx(3e-4, rel=1e-12))
    assert impulse == pytest.approx(1.0 - found.velocities[-1, 0], rel=1e-12)
    assert found.contacts["w"].multipliers[-1, 0] == pytest.approx(1e9 * found.frames[-1, 0] ** 1.5, rel=1e-7)


@pytest.mark.parametrize("gap", [0.0, 1e-6, 1e-4])
def test_mass_between_two_walls(gap: float, tmp_path: Path) -> None:
    """At no gap both walls are touched at once, and one takes over from the other."""
    records = {"a": rigid_records(1.0, {"r": (ORIGIN, X), "l": (ORIGIN, BACK)}, axes=(0,))}
    walls = {"right": ("r", wall(gap, BACK)), "left": ("l", wall(-gap, X))}
    contacts = {
        name: {"body": "a", "interface": face, "against": against, "method": "penalty", "law": HERTZ}
        for name, (face, against) in walls.items()
    }
    scene = {"body": {"a": {"velocity": X}}, "contact": contacts, "run": {"duration": 6e-3}}
    found = run(tmp_path, records, scene, steps=60_000)
    right, left = found.impacts["right"], found.impacts["left"]
    assert len(right) > 2
    assert 0 <= len(right) - len(left) <= 1
    # One period: both contacts of Hertz's duration, and both ways between.
    lasting = 2 * np.sqrt(np.pi) * gamma(1.4) / gamma(0.9) * 1.25e-9**0.4
    np.testing.assert_allclose(np.diff(right[:-1, 0]), 2 * (lasting + 2 * gap), rtol=1e-6)
    np.testing.assert_allclose(right[:-1, 2], 2.0, rtol=1e-6)
    np.testing.assert_allclose(right[:, 5], 1.0, rtol=1e-6)
    assert found.energy_drift < 1e-7


@pytest.mark.parametrize("gaps", [[1e-4, 0.0], [1e-4, 3e-5], [1e-4, 1e-7]])
def test_three_spheres_in_a_row(gaps: list[float], tmp_path: Path) -> None:
    """Both contacts are closed together; by a plain integration of the three equations of motion."""
    records, scene = row(gaps, HERTZ)
    found = run(tmp_path, records, scene, steps=200_000)

    def rates(_: float, state: np.ndarray) -> np.ndarray:
        depth = np.array([state[0] - state[1], state[1] - state[2]]) - gaps
        first, second = 1e9 * np.maximum(depth, 0.0) ** 1.5
        return np.array([*state[3:], -first, first - second, second])

    span, begin = (0.0, 4e-3), [0.0, 0, 0, 1, 0, 0]
    expected = integrate.solve_ivp(rates, span, begin, method="DOP853", rtol=1e-11, atol=1e-14, max_step=1e-5).y
    np.testing.assert_allclose(found.velocities[-1], expected[3:, -1], rtol=0, atol=3e-8)
    for name, body in (("ab", 0), ("bc", 2)):
        change = abs(expected[3 + body, -1] - begin[3 + body])
        assert found.impacts[name][:, 2].sum() == pytest.approx(change, rel=1e-7)
    assert found.energy_drift < 1e-8


@pytest.mark.parametrize(("steps", "accuracy"), [(2000, 1e-5), (8000, 1e-6), (80_000, 1e-8)])
def test_approach_speed_of_a_contact_that_closes_during_another(steps: int, accuracy: float, tmp_path: Path) -> None:
    """v⁻ of a lossy law is found within the step, not where the step began."""
    records, scene = row([1e-4, 3e-5], HALF)
    fine = run(tmp_path / "fine", records, scene, steps=800_000)
    found = run(tmp_path / "found", records, scene, steps=steps)
    np.testing.assert_allclose(found.velocities[-1], fine.velocities[-1], rtol=0, atol=10 * accuracy)
    first, second = fine.impacts["bc"][0], found.impacts["bc"][0]
    assert second[0] == pytest.approx(first[0], rel=10 * accuracy)
    assert second[5] == pytest.approx(first[5], rel=10 * accuracy)
    # It comes while the first one presses: neither at rest nor at full speed.
    assert 0.1 < first[5] < 0.9
    assert found.energy_drift < 10 * accuracy


def test_law_behind_the_residual(tmp_path: Path) -> None:
    """R of a rod and Hertz's law, one behind the other: the compliances add up at every force."""
    stiffness = 1e12
    scene = rod_scene(2e-4, law=HERTZ | {"stiffness": stiffness})
    system = build_all(tmp_path / "system", {"part": rod_records(8)}, scene)
    found = run(tmp_path, {"part": rod_records(8)}, scene, steps=200_000)
    series = system.residual[0][0]
    force, gap = found.contacts["wall"].multipliers[:, 0], found.frames @ system.rows[0] + system.gap[0]
    np.testing.assert_allclose(-gap, series * force + (force / stiffness) ** (2 / 3), rtol=1e-6)
    assert 0.1 < float((series * force / -gap).max()) < 0.9
    assert found.energy_drift < 1e-8


def test_soft_law_behind_the_residual_bounces_back(tmp_path: Path) -> None:
    """A law far softer than the rod is Hertz's impact of a rigid body."""
    scene = rod_scene(0.2, law={"kind": "hertz", "stiffness": 1e5})
    found = run(tmp_path, {"part": rod_records(3)}, scene, steps=200_000)
    deepest = (0.5 * 2.5 * 2.0 / 1e5) ** 0.4
    assert found.impacts["wall"][0, 3] == pytest.approx(1e5 * deepest**1.5, rel=1e-3)
    assert found.impacts["wall"][0, 2] == pytest.approx(4.0, rel=1e-3)


def test_points_of_an_elastic_block(tmp_path: Path) -> None:
    """Several points under one law: one impact, whose impulse is that of their resultant."""
    found = run(tmp_path, {"part": block_records(3)}, block_scene(method="penalty", law=HERTZ), steps=20_000)
    assert len(found.impacts["wall"]) == 1
    assert found.energy_drift < 1e-8
    impulse = found.contacts["wall"].force[:, 0].sum() * (found.times[1] - found.times[0])
    assert -impulse == pytest.approx(found.impacts["wall"][:, 2].sum(), rel=1e-12)


def dropped(law: dict[str, Any], height: float, duration: float, speed: float = 0.0) -> tuple[Records, dict]:  # type: ignore[type-arg]
    floor = {"shape": "plane", "point": ORIGIN, "normal": UP}
    scene = {
        "body": {"a": {"position": [0, 0, height], "velocity": [0, 0, speed]}},
        "contact": {"f": {"body": "a", "interface": "p", "against": floor, "method": "penalty", "law": law}},
        "run": {"duration": duration, "gravity": [0, 0, -10.0]},
    }
    return {"a": rigid_records(1.0, {"p": (ORIGIN, DOWN)}, axes=(2,))}, scene


def test_bouncing_ball_on_a_law(tmp_path: Path) -> None:
    """Without loss it comes back each time; the flight takes what a free flight takes."""
    found = run(tmp_path, *dropped(HERTZ, 0.05, 2.0), steps=400_000)
    impacts = found.impacts["f"]
    assert len(impacts) > 8
    np.testing.assert_allclose(impacts[:, 5], 1.0, rtol=1e-7)
    np.testing.assert_allclose(impacts[1:, 0] - impacts[:-1, 1], 0.2, rtol=1e-6)
    assert found.energy_drift < 1e-7
    # Weight and contact balance over a period: 2 v m and the weight's part while pressed.
    np.testing.assert_allclose(impacts[:-1, 2], 2 + 10 * (impacts[:-1, 1] - impacts[:-1, 0]), rtol=1e-6)


def test_lossy_ball_comes_to_rest_on_its_indentation(tmp_path: Path) -> None:
    """Impacts get lower; in the end it lies at K d^1.5 = m g and nothing stops the run."""
    found = run(tmp_path, *dropped(HALF, 0.01, 1.0), steps=20_000)
    impacts = found.impacts["f"]
    falling, lasting = impacts[:4, 5], impacts[:3, 1] - impacts[:3, 0]
    # The law's restitution is that of a free impact; weight acts as long as this one lasts.
    weight = 10 * lasting / falling[:-1]
    assert (np.abs(falling[1:] / falling[:-1] - 0.5) < weight).all()
    assert weight[0] < 0.03
    depth = (10 / 1e9) ** (2 / 3)
    assert found.frames[-1, 0] == pytest.approx(-0.01 - depth, abs=0.2 * depth)
    assert found.contacts["f"].force[-1, 2] == pytest.approx(10.0, rel=0.1)
    assert found.energies[-1, 3] == pytest.approx(0.1, rel=1e-3)


@pytest.mark.parametrize("depth", [1e-6, 1e-10])
def test_grazing_a_floor(depth: float, tmp_path: Path) -> None:
    """A mass on a spring that just reaches the wall: the contact is short and weak, and found."""
    law = HALF
    contact = {"body": "a", "interface": "p", "against": wall(0.1 * (1 - depth), BACK), "method": "penalty", "law": law}
    spring = {"kind": "spring", "body": "a", "direction": X, "stiffness": 100.0}
    scene = {
        "body": {"a": {"velocity": X}}, "contact": {"w": contact}, "force": {"s": spring},
        "run": {"duration": 0.4},
    }  # fmt: skip
    found = run(tmp_path, {"a": rigid_records(1.0, {"p": (ORIGIN, X)}, axes=(0,))}, scene, steps=40_000)
    assert len(found.impacts["w"]) >= 1
    start, closing = found.impacts["w"][0, [0, 5]]
    assert start == pytest.approx(0.1 * np.arcsin(1 - depth), rel=1e-9)
    assert closing == pytest.approx(np.sqrt(2 * depth - depth**2), rel=1e-4)
    # The spring turns the weaker one before the law takes anything that round-off shows.
    assert (1e-3 * depth if depth > 1e-9 else -1e-15) < found.energies[-1, 3] < 2 * depth


@pytest.mark.parametrize("stretch", [0.0, -0.05])
def test_spring_behind_a_mass(stretch: float, tmp_path: Path) -> None:
    """Springs pull in flight and in contact; their energy and impulse are booked in both."""
    records, scene = shot(HERTZ, gap=0.01)
    scene["force"] = {"s": {"kind": "spring", "body": "a", "direction": X, "stiffness": 100.0, "stretch": stretch}}
    found = run(tmp_path, records, scene, steps=200_000, duration=1.0)
    impacts = found.impacts["w"]
    assert len(impacts) > 2
    speed = np.sqrt(1 + 100 * (stretch**2 - (0.01 + stretch) ** 2))
    np.testing.assert_allclose(impacts[:, 5], speed, rtol=1e-7)
    np.testing.assert_allclose(impacts[:-1, 6], speed, rtol=1e-7)
    assert found.energy_drift < 1e-7


def test_what_a_dashpot_holds_back_is_given_away_when_it_recovers(tmp_path: Path) -> None:
    """The force of a spring with a dashpot ends at an indentation; the balance once missed what it recovers from."""
    law = {"kind": "linear", "stiffness": 1e8, "damping": 4000.0}
    found = run(tmp_path, *shot(law, mass=2.0, speed=0.5), steps=20_000, integrator="small")
    assert found.energies[-1, 2] == 0.0
    assert found.energy_drift < 1e-9
    assert found.energies[-1, 3] == pytest.approx(0.25 - found.energies[-1, :3].sum(), rel=1e-9)


def test_round_off_of_the_gap_costs_no_accuracy(tmp_path: Path) -> None:
    """Forces of 1e15 N/m follow from a gap that is known to 2e-18 m."""
    records, scene = shot({"kind": "linear", "stiffness": 1e15}, mass=1e-3, gap=0.01)
    scene["run"]["duration"] = 0.0101
    found = run(tmp_path, records, scene, steps=2_000_000, integrator="small")
    assert found.energy_drift < 1e-7
    assert found.velocities[-1, 0] == pytest.approx(-(1e-3**0.5), rel=1e-7)


def test_given_step_is_taken(tmp_path: Path) -> None:
    """A step that the scene states is not refined; its error is of order 2."""
    records, scene = shot(HALF)
    errors = []
    for step in (6e-6, 6e-7):
        found = run(tmp_path / str(step), records, scene, duration=1.2e-3, step=step, checks=False)
        assert found.counts["steps"] == round(1.2e-3 / step)
        errors.append(abs(found.velocities[-1, 0] + 0.5))
    assert errors[1] < errors[0] / 90


@pytest.mark.parametrize("restitution", [0.01, 0.1])
@pytest.mark.parametrize("steps", [500, 5000, 50_000])
def test_what_recovers_without_force_is_balanced(restitution: float, steps: int, tmp_path: Path) -> None:
    """Behind much damping a surface gives its energy back with hardly a force: the balance holds at any step, and the
    contact lasts until the gap opens, also where the force is round-off."""
    law = {"kind": "exact", "stiffness": 1e9, "restitution": restitution}
    found = run(tmp_path, *shot(law), steps=steps, duration=0.05)
    assert found.energy_drift < 1e-12
    assert len(found.impacts["w"]) == 1
