"""Implicit steps: the method, agreement with explicit ones, what they keep, and when they are taken."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import LINKAGE_NOTES, Trajectory
from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.turning.integrator import Turning
from gudgeon.solver.integrators.turning.tables import table_of
from gudgeon.solver.simulate import simulate
from tests.solver.integrators.turning.flexible_scenes import WIDE, cloud, cloud_run, cloud_system
from tests.solver.integrators.turning.scenes import hinge, solved, system_of
from tests.solver.systems import build_all, rigid_records

SOFT = np.array([60.0, 90.0, 140.0])
STIFF = np.array([60.0, 300.0, 4e3, 3e4])
"""Angular frequencies [rad/s]: of the last one a turn takes a hundred thousandth of that of the body."""
SWIFT = np.array([6e4, 9e4, 1.4e5])
TUMBLING = {"angular_velocity": [3.0, 9.0, 5.0], "velocity": [0.3, -0.2, 0.1]}
PIN = {"kind": "spherical", "body": "part", "interface": "pin", "against_at": [0.0, 0.0, 0.0]}
GRAVITY = [0.0, 0.0, -9.81]


@pytest.mark.parametrize("stages", [1, 3, 5])
def test_collocation_is_exact_on_polynomials_and_keeps_oscillators(stages: int) -> None:
    """Steps of ẏ = t^k to the order of Lobatto's weights, and of ẏ = i ω y, whose size none of any ω changes."""
    table = table_of(stages)
    T = np.hstack([table.back[:, :1], table.back[:, 1:] / 2, table.back[:, 1:].conj() / 2])
    rows = np.vstack([table.there, table.there[1:].conj()])
    values = np.concatenate([table.eigenvalues, table.eigenvalues[1:].conj()])
    inverse = np.real((T * values) @ rows)
    np.testing.assert_allclose(T @ rows, np.eye(stages), atol=1e-12)
    for k in range(2 * stages):
        slopes, first = table.points**k, float(k == 0)
        end = np.linalg.solve(inverse, slopes + table.start * first)[-1]
        assert end == pytest.approx(1 / (k + 1), rel=1e-12)
        lost = table.error_start * first + table.error @ np.linalg.solve(inverse, slopes + table.start * first)
        assert bool(abs(lost) < 1e-11) is (k < stages)
    for omega in (0.1, 3.0, 1e4):
        z = 1j * omega
        increments = np.linalg.solve(inverse - z * np.eye(stages), z * (1 + table.start))
        assert abs(1 + increments[-1]) == pytest.approx(1.0, abs=1e-9)
    places = np.array([0.0, 0.3, 1.0])
    values = (places[:, None] ** np.arange(1 + stages)) @ table.polynomials.T
    np.testing.assert_allclose(values[:, 1:] @ table.points, places, atol=1e-13)


def both(folder: Path, frequencies: np.ndarray, body: dict[str, Any], run: dict[str, Any], **tables: Any):  # type: ignore[no-untyped-def]
    """Return the runs by fine explicit steps and by implicit ones."""
    found = []
    for stepping in ("explicit", "implicit"):
        own = run | {"stepping": stepping} | ({"accuracy": 1e-9} if stepping == "explicit" else {})
        found.append(cloud_run(folder / stepping, frequencies, body, free=True, run=own, **tables))
    kind = "implicit_steps" if "joint" in tables else "exponential_steps"
    assert found[0].counts["implicit_steps"] == found[0].counts["exponential_steps"] == 0
    assert found[1].counts[kind] == found[1].counts["steps_taken"]
    return found


def apart(one: Trajectory, other: Trajectory) -> float:
    """Return the largest difference of places over a tenth of a metre and of rotations."""
    difference = np.abs(one.motion["part"] - other.motion["part"])
    return float(max(10 * difference[:, :3].max(), difference[:, 3:].max()))


def test_a_free_body_keeps_momenta_and_energy(tmp_path: Path) -> None:
    run = {"duration": 0.3, "accuracy": 1e-3}
    explicit, loose = both(tmp_path, STIFF, TUMBLING, run)
    close = cloud_run(tmp_path, STIFF, TUMBLING, free=True, run=run | {"stepping": "implicit", "accuracy": 1e-6})
    for implicit, accuracy in ((loose, 1e-3), (close, 1e-6)):
        assert implicit.momentum_residual < 1e-11
        whole = implicit.energies[:, :2].sum(axis=1)
        assert np.ptp(whole) < accuracy * whole[0]
        assert apart(explicit, implicit) < accuracy


def test_order_of_a_given_step(tmp_path: Path) -> None:
    run = {"duration": 0.5, "stepping": "implicit", "accuracy": 1e-12}
    fine = cloud_run(tmp_path / "fine", SOFT, TUMBLING, free=True, run=run | {"stepping": "explicit"})
    errors, sizes = [], (0.5 / 24, 0.5 / 32)
    for size in sizes:
        system = cloud_system(tmp_path / f"{size}", SOFT, TUMBLING, free=True, run=run)
        found = Turning(system, 0.5, fixed_step=size)
        assert found.steps.advance(0.5) == 0
        assert found.steps.counts["steps_taken"] == round(0.5 / size)
        errors.append(np.abs(found.turned(found.steps.state)[0] - fine.motion["part"][-1, 3:6]).max())
    assert errors[1] < 1e-8
    assert np.log(errors[0] / errors[1]) / np.log(sizes[0] / sizes[1]) > 8


KINDS: dict[str, dict[str, Any]] = {
    "spherical": PIN,
    "revolute": PIN | {"axis": [0.0, 1.0, 0.0]},
    "fixed": PIN,
    "distance": PIN | {"against_at": [0.0, 0.0, 0.2]},
    "slider-crank": {
        "body": "part", "interface": "pin", "crank_radius": 0.01, "rod_length": 0.2, "speed": 60.0,
        "centre": [0.0604, 0.0, 0.1811], "along": [0.0, 0.0, -1.0],
    },
}  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_joints_and_gravity(kind: str, tmp_path: Path) -> None:
    run = {"duration": 0.06, "gravity": GRAVITY, "accuracy": 1e-5}
    explicit, implicit = both(tmp_path, STIFF, {}, run, joint={"pin": KINDS[kind] | {"kind": kind}})
    assert apart(explicit, implicit) < 1e-5
    balance = implicit.energies @ [1, 1, 1, 1, -1]
    assert np.ptp(balance) < 1e-5 * np.abs(implicit.energies).max()
    assert max(joint.violation.max() for joint in implicit.joints.values()) < 1e-12
    scale = np.abs(explicit.joints["pin"].force).max()
    assert np.abs(explicit.joints["pin"].force - implicit.joints["pin"].force).max() < 1e-3 * scale


def test_damping_springs_bushings_and_drives(tmp_path: Path) -> None:
    force = {
        "spring": {"kind": "spring", "body": "part", "interface": "pin", "against_at": [0.1, 0.0, 0.3],
                   "stiffness": 300.0, "damping": 2.0, "length": 0.2},
        "bush": {"kind": "bushing", "body": "part", "interface": "pin", "stiffness": [900.0, 700.0, 800.0],
                 "rotational_stiffness": [2.0, 3.0, 4.0], "damping": [1.0, 2.0, 3.0]},
        "push": {"kind": "wrench", "body": "part", "interface": "pin", "force": [0.0, 1.0, 0.0],
                 "expression": "5*sin(240*t)"},
    }  # fmt: skip
    run = {"duration": 0.06, "gravity": GRAVITY, "accuracy": 1e-5}
    explicit, implicit = both(tmp_path, STIFF, {"damping": {"ratio": 0.02}}, run, force=force)
    assert apart(explicit, implicit) < 1e-5
    assert implicit.energies[-1, 3] == pytest.approx(explicit.energies[-1, 3], rel=1e-3)
    assert implicit.energies[-1, 4] == pytest.approx(explicit.energies[-1, 4], rel=1e-3)
    balance = implicit.energies @ [1, 1, 1, 1, -1]
    assert np.ptp(balance) < 1e-5 * np.abs(implicit.energies).max()


@pytest.mark.parametrize("accuracy", [1e-3, 1e-6])
def test_jointed_free_bodies_keep_momenta_at_any_accuracy(accuracy: float, tmp_path: Path) -> None:
    """A body that deforms and a rigid one, on a ball, tumble."""
    run = {"integrator": "turning", "duration": 0.3, "stepping": "implicit", "accuracy": accuracy, "checks": False,
           "samples": 40, "frames": 2, "limits": WIDE, "start": "undeformed"}  # fmt: skip
    bodies = {"part": {"angular_velocity": [3.0, 9.0, 5.0], "velocity": [0.3, -0.2, 0.1]}, "bob": {}}
    ball = {"kind": "spherical", "body": "part", "interface": "pin", "against": "bob"}
    records = {"part": cloud(STIFF, free=True), "bob": rigid_records(1.0, {}, (1e-3, 2e-3, 1.5e-3))}
    found = simulate(build_all(tmp_path, records, {"body": bodies, "joint": {"ball": ball}, "run": run}))
    assert found.result == "FINISHED"
    assert found.counts["implicit_steps"] == found.counts["steps_taken"]
    assert found.momentum_residual < 1e-11


def test_a_driven_rigid_body(tmp_path: Path) -> None:
    """Motion by an expression is exact whatever the steps; its work is the kinetic energy."""
    joints = {"pin": hinge("revolute"), "motor": {"kind": "driven", "joint": "pin", "expression": "0.4*t**3 + 2*t"}}
    found = solved(tmp_path, {"part": {}}, joints, run={"duration": 1.0, "stepping": "implicit"})
    t = found.times
    np.testing.assert_allclose(found.joints["pin"].angle, 0.4 * t**3 + 2 * t, atol=1e-11)
    assert np.ptp(found.energies @ [1, 1, 1, 1, -1]) < 1e-8 * found.energies[:, 0].max()


def test_implicit_steps_are_taken_where_frequencies_bound_explicit_ones(tmp_path: Path) -> None:
    run = {"duration": 0.3, "accuracy": 1e-3}
    loose = cloud_run(tmp_path / "a", STIFF, TUMBLING, free=True, run=run)
    explicit = cloud_run(tmp_path / "b", STIFF, TUMBLING, free=True, run=run | {"stepping": "explicit"})
    assert loose.counts["exponential_steps"] > 0
    assert loose.counts["steps_taken"] < 0.25 * explicit.counts["steps_taken"]
    pinned = cloud_run(tmp_path / "c", SWIFT, {}, free=True, run=run | {"gravity": GRAVITY}, joint={"pin": PIN})
    assert pinned.counts["implicit_steps"] > 0
    assert "steps are implicit" in str(pinned.counts[LINKAGE_NOTES])
    soft = cloud_run(tmp_path / "d", SOFT, {}, free=True, run={"duration": 0.3, "gravity": GRAVITY}, joint={"pin": PIN})
    assert soft.counts["implicit_steps"] == 0


def test_what_cannot_have_implicit_steps(tmp_path: Path) -> None:
    fixed = {"attachment": "fixed", "attached_to": "pin"}
    run = {"duration": 0.1, "stepping": "implicit"}
    with pytest.raises(SceneError, match=r"run\.stepping: 'implicit' given, and the modes of a body are coupled"):
        Turning(cloud_system(tmp_path / "a", SOFT, fixed, run=run), 0.1)
    law = {"kind": "exact", "stiffness": 1e9, "restitution": 0.6}
    loose = hinge("clearance", clearance=1e-3, radius=0.01, law=law, against_at=[0, 0, 0])
    with pytest.raises(SceneError, match=r"run\.stepping: 'implicit' given, and something touches"):
        simulate(system_of(tmp_path / "b", {"part": {}}, {"pin": loose}, run=run))


@pytest.mark.parametrize("stepping", ["explicit", "implicit"])
def test_long_steps_continue_rotations_beyond_half_a_turn(stepping: str, tmp_path: Path) -> None:
    """The loosest accuracy asks for steps of more than a turn's part that could be told from its complement."""
    spin = {"part": {"angular_velocity": [0.0, 0.0, 40.0]}}
    found = solved(tmp_path, spin, {}, run={"duration": 1.0, "accuracy": 0.1, "stepping": stepping})
    np.testing.assert_allclose(found.motion["part"][:, 5], 40 * found.times, atol=0.1)


def test_what_hangs_still_for_long_is_stepped_beyond_round_off(tmp_path: Path) -> None:
    """The energy balance is measured by kinetic energy, of which there is next to none."""
    run = {"duration": 1e4, "gravity": GRAVITY, "stepping": "implicit"}
    pin = hinge("spherical", at=[0.0, 0.0, 0.1], against_at=[0.0, 0.0, 0.1])
    found = solved(tmp_path, {"part": {}}, {"pin": pin}, run=run)
    assert found.counts["steps_taken"] < 1000
    assert np.abs(found.motion["part"]).max() < 1e-9
