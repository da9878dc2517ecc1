"""Assembled modes and frequency responses against closed forms."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from gudgeon.solver.errors import SceneError
from gudgeon.solver.linear.modes import AssembledModes, assembled_modes
from gudgeon.solver.linear.response import response
from gudgeon.solver.linear.state import Linearised, linearised, places
from gudgeon.solver.linear.static import static_response
from gudgeon.solver.simulate import simulate
from tests.solver.system.test_drives import solid
from tests.solver.systems import LENGTH, MASS, SPEED, build, build_all, rigid_records, rod_scene
from tests.validation.test_driven_bodies import held_rod

SIDE = {"right": ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0]), "left": ([0.0, 0.0, 0.0], [-1.0, 0.0, 0.0])}
RUN: dict[str, Any] = {"duration": 0.1, "samples": 100, "frames": 10, "checks": False, "step": 1e-4}
X = [1.0, 0.0, 0.0]


def found_of(system: Any, *closed: str) -> tuple[Linearised, AssembledModes]:
    found = linearised(system, closed)
    return found, assembled_modes(found)


def answer(found: Linearised, force: str, at: str, frequencies: np.ndarray, loss: float = 0.0) -> np.ndarray:
    (one,), (other,) = places(found, force, "--force"), places(found, at, "--at")
    return response(found, one, [other], frequencies, loss=loss)[:, 0]


def two_masses(folder: Path, damping: float = 0.0) -> Any:
    """Two masses with a spring between them, one of them on the ground by another."""
    return build_all(folder, {"one": rigid_records(2.0, SIDE), "two": rigid_records(0.5, SIDE)}, {
        "body": {"one": {"freedom": ["x"]}, "two": {"freedom": ["x"]}},
        "force": {
            "ground": {"kind": "spring", "body": "one", "direction": X, "stiffness": 3e4},
            "between": {"kind": "spring", "body": "two", "against": "one", "direction": X, "stiffness": 1e4,
                        "damping": damping},
            "shake": {"kind": "external", "body": "one", "direction": X},
            "other": {"kind": "external", "body": "two", "direction": X},
        },
        "run": RUN,
    })  # fmt: skip


@pytest.mark.parametrize("damping", [0.0, 8.0])
def test_two_masses(damping: float, tmp_path: Path) -> None:
    """Frequencies and damping of the 2 × 2 matrices, and the response to a force on one of them."""
    M, K = np.diag([2.0, 0.5]), np.array([[4e4, -1e4], [-1e4, 1e4]])
    C = damping * np.array([[1, -1], [-1, 1]])
    found, modes = found_of(two_masses(tmp_path, damping))
    state = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    s = np.linalg.eigvals(state)
    s = np.sort_complex(s[s.imag > 0])
    s = s[np.argsort(np.abs(s))]
    assert modes.frequencies == pytest.approx(np.abs(s) / (2 * np.pi), rel=1e-10)
    assert modes.damping == pytest.approx(-s.real / np.abs(s), abs=1e-12)
    assert sum(modes.shares.values()) == pytest.approx([1.0, 1.0])
    assert modes.masses is not None
    if not damping:
        assert modes.masses.sum(axis=0) == pytest.approx([2.5, 0.0, 0.0], abs=1e-12)
    f = np.array([1.0, 15.0, 22.5, 40.0, 300.0])
    for row, name in enumerate(("force.shake", "force.other")):
        exact = [np.linalg.solve(K + 2j * np.pi * one * C - (2 * np.pi * one) ** 2 * M, [1.0, 0.0])[row] for one in f]
        assert answer(found, "force.shake", name, f) == pytest.approx(exact, rel=1e-10)
        assert answer(found, name, "force.shake", f) == pytest.approx(exact, rel=1e-10)


def test_damper_alone_and_in_series_with_flexibility(tmp_path: Path) -> None:
    """A dashpot without stiffness at the end of a rod: the exact rod's response."""
    c = 400.0
    system = build(tmp_path, held_rod(60), {
        "body": {"part": {"freedom": ["x"]}},
        "force": {"c": {"kind": "spring", "body": "part", "interface": "base", "direction": X, "damping": c},
                  "push": {"kind": "external", "body": "part", "interface": "base", "direction": X}},
        "run": RUN})  # fmt: skip
    found = linearised(system)
    f = np.array([300.0, 1234.0, 4000.0, 9000.0])
    w, Z = 2 * np.pi * f, MASS / LENGTH * SPEED
    free = -1 / (w * Z * np.tan(w * LENGTH / SPEED))
    assert answer(found, "force.push", "force.push", f) == pytest.approx(1 / (1 / free + 1j * w * c), rel=2e-3)


@pytest.mark.parametrize("stiffness", [1e5, 1e8, 1e11])
def test_rod_with_a_spring_to_the_ground(stiffness: float, tmp_path: Path) -> None:
    """Z ω tan(ω L/c) = k: with R the modes and the response are right below the highest kept frequency."""
    system = build(tmp_path, held_rod(40), {
        "body": {"part": {"freedom": ["x"]}},
        "force": {"k": {"kind": "spring", "body": "part", "interface": "base", "direction": X, "stiffness": stiffness}},
        "probe": {"tip": {"kind": "displacement", "body": "part", "interface": "tip"}},
        "run": RUN})  # fmt: skip
    found, modes = found_of(system)
    Z, T = MASS / LENGTH * SPEED, LENGTH / SPEED
    exact = [
        brentq(lambda w: Z * w * np.sin(w * T) - stiffness * np.cos(w * T), n * np.pi / T + 1e-6, (n + 0.5) * np.pi / T)
        for n in range(8)
    ]
    assert modes.frequencies[:8] == pytest.approx(np.array(exact) / (2 * np.pi), rel=2e-4)
    f = np.array([200.0, 1000.0, 3333.0, 11000.0])
    w = 2 * np.pi * f
    own = 1 / (stiffness - Z * w * np.tan(w * T))  # At the base; the tip moves 1/cos as far.
    assert answer(found, "force.k", "force.k", f) == pytest.approx(own, rel=5e-3)
    assert answer(found, "force.k", "probe.tip", f) == pytest.approx(own / np.cos(w * T), rel=5e-3)


def test_moving_base_and_loss_factor(tmp_path: Path) -> None:
    """Transmissibility of a rod: 1/cos of a complex phase; the held modes are those of a fixed and free rod."""
    system = build(tmp_path, held_rod(30), {
        "body": {"part": {"freedom": ["x"]}},
        "motion": {"base": {"kind": "translation", "body": "part", "interface": "base", "direction": X,
                            "expression": "0"}},
        "probe": {"tip": {"kind": "displacement", "body": "part", "interface": "tip"}},
        "run": RUN})  # fmt: skip
    found, modes = found_of(system)
    T = LENGTH / SPEED
    assert modes.frequencies[:5] == pytest.approx((np.arange(5) + 0.5) / (2 * T), rel=1e-4)
    f = np.array([500.0, 1250.0, 4000.0])
    for loss in (0.0, 0.05):
        phase = 2 * np.pi * f * T / np.sqrt(1 + 1j * loss)
        if loss:
            assert answer(found, "motion.base", "probe.tip", f, loss) == pytest.approx(1 / np.cos(phase), rel=5e-3)
    assert answer(found, "motion.base", "motion.base", f) == pytest.approx(np.ones(3), rel=1e-9)
    assert np.abs(answer(found, "motion.base", "probe.tip", np.array([1e-3])) - 1) < 1e-9


def test_tie_that_is_held_is_the_limit_of_stiff_bushings(tmp_path: Path) -> None:
    """A held tie and a bushing that is far stiffer have the same modes, and those of a run at rest ring with them."""
    foot = {"kind": "translation", "body": "part", "interface": "foot", "direction": X, "held": True, "expression": "0"}
    held = {"motion": {"foot": foot}}
    stiff = {"force": {"b": {"kind": "bushing", "body": "part", "interface": "foot", "stiffness": [1e16] * 3,
                             "rotational_stiffness": [1e14] * 3}}}  # fmt: skip
    scene = {"body": {"part": {}}, "run": RUN | {"duration": 0.4, "step": 2e-5, "samples": 4000}}
    one, other = (found_of(build(tmp_path, solid(), scene | more))[1] for more in (held, stiff))
    assert len(one.frequencies) == 10  # The tie's own flexibility is R: rigid motions are modes on it.
    assert one.frequencies == pytest.approx(other.frequencies, rel=1e-6)
    push = {"force": {"push": {"kind": "force", "body": "part", "interface": "head", "direction": [0, 1, 0],
                               "expression": "step(1e-4 - t)"}},
            "probe": {"head": {"kind": "velocity", "body": "part", "interface": "head",
                               "direction": [0, 1, 0]}}}  # fmt: skip
    heard = simulate(build(tmp_path, solid(), scene | held | push)).probes["head"].values[:, 0]
    spectrum = np.abs(np.fft.rfft(heard * np.hanning(len(heard)), 1 << 18))
    peak = np.fft.rfftfreq(1 << 18, 0.4 / 4000)[spectrum.argmax()]
    assert np.abs(one.frequencies - peak).min() < 5e-3 * peak


def test_closed_contact(tmp_path: Path) -> None:
    """A rod at a wall: open it is free, declared closed a fixed and free rod, as no force presses at the start."""
    system = build(tmp_path, held_rod(30), rod_scene())
    T = LENGTH / SPEED
    assert linearised(system).closed == {"wall": 0}
    assert assembled_modes(linearised(system)).frequencies[:3] == pytest.approx(np.arange(3) / (2 * T), abs=1e-9)
    found, modes = found_of(system, "contact.wall")
    assert found.closed == {"wall": 1}
    only = modes.frequencies[modes.frequencies > 1.0]
    assert only[:5] == pytest.approx((np.arange(5) + 0.5) / (2 * T), rel=1e-4)


def test_wrong_names_have_one_line(tmp_path: Path) -> None:
    system = two_masses(tmp_path)
    found = linearised(system)
    with pytest.raises(
        SceneError, match=r"^--force 'force\.shak': .*did you mean 'force\.shake'\? it has force\.shake"
    ):
        places(found, "force.shak", "--force")
    with pytest.raises(SceneError, match=r"^--at 'force\.other\[2\]': force\.other has rows 1 to 1$"):
        places(found, "force.other[2]", "--at")
    with pytest.raises(SceneError, match=r"^--closed 'contact\.wall': there is none in the scene, it has none$"):
        linearised(system, ["contact.wall"])


def test_static_answers_of_two_masses(tmp_path: Path) -> None:
    """Unit forces on two springs in series: 1/k₁ of either, 1/k₁ + 1/k₂ of the far one."""
    found, _ = found_of(two_masses(tmp_path))
    ends = [places(found, name, "--at")[0] for name in ("force.shake", "force.other")]
    near, far = 1 / 3e4, 1 / 3e4 + 1 / 1e4
    np.testing.assert_allclose(static_response(found, ends, ends), [[near, near], [near, far]], rtol=1e-12)


def test_a_body_that_nothing_holds_has_no_static_answer(tmp_path: Path) -> None:
    system = build_all(tmp_path, {"one": rigid_records(2.0, SIDE)}, {
        "body": {"one": {"freedom": ["x"]}},
        "force": {"shake": {"kind": "external", "body": "one", "direction": X}}, "run": RUN,
    })  # fmt: skip
    found = linearised(system)
    one = places(found, "force.shake", "--force")
    with pytest.raises(SceneError, match=r"--static: force\.shake moves body 'one', which nothing holds"):
        static_response(found, one, one)


def test_a_wrench_at_a_point_of_a_rigid_body(tmp_path: Path) -> None:
    """Force 2 N along x at 0.1 m along z, and a moment of 0.3 N m about y: the body turns by (0.2 + 0.3)/k."""
    system = build_all(tmp_path, {"one": rigid_records(2.0, SIDE, (0.1, 0.2, 0.3))}, {
        "body": {"one": {}},
        "force": {
            "push": {"kind": "wrench", "body": "one", "at": [0.0, 0.0, 0.1], "force": [2.0, 0.0, 0.0],
                     "moment": [0.0, 0.3, 0.0]},
            "ground": {"kind": "bushing", "body": "one", "at": [0.0, 0.0, 0.0], "stiffness": [1e3, 1e3, 1e3],
                       "rotational_stiffness": [50.0, 50.0, 50.0]},
        },
        "probe": {"turn": {"kind": "rotation", "body": "one"}},
        "run": RUN | {"start": "rest"},
    })  # fmt: skip
    found = linearised(system)
    pushed, read = places(found, "force.push", "--force"), places(found, "probe.turn", "--at")
    answers = static_response(found, pushed, read)
    assert answers[1] == pytest.approx([0.1 / 50, 0, 0, 0, 1 / 50, 0], abs=1e-15)
    assert system.driving.loads(np.zeros(1), 0.0)[0] == pytest.approx([2, 0, 0, 0, 0.3, 0])


@pytest.mark.parametrize("damping", [0.0, 1e-8])
def test_a_soft_mount_beside_a_stiff_spring_is_no_free_motion(damping: float, tmp_path: Path) -> None:
    """Frequencies 10⁸ apart: the slow one keeps its digits, and only what nothing holds is at zero."""
    soft, stiff = 1e-4, 1e12
    system = build_all(tmp_path, {"one": rigid_records(2.0, SIDE), "two": rigid_records(0.5, SIDE)}, {
        "body": {"one": {"freedom": ["x"]}, "two": {"freedom": ["x", "y"]}},
        "force": {
            "ground": {"kind": "spring", "body": "one", "direction": X, "stiffness": soft, "damping": damping},
            "between": {"kind": "spring", "body": "two", "against": "one", "direction": X, "stiffness": stiff},
        },
        "run": RUN,
    })  # fmt: skip
    _, modes = found_of(system)
    slow, fast = np.sqrt(soft / 2.5), np.sqrt(stiff * 2.5)
    assert modes.frequencies == pytest.approx(np.array([0.0, slow, fast]) / (2 * np.pi), rel=1e-6)
    assert modes.damping[1] == pytest.approx(damping / (2 * 2.5 * slow), rel=1e-6, abs=1e-12)
