"""Driven bodies against closed forms: a shaken oscillator, a rod on a moving base, a ball on a shaker, a moving wall.

Transmissibility: S. S. Rao, Mechanical Vibrations, 5th ed., section 3.6. Waves of a rod: K. F. Graff, Wave Motion in
Elastic Solids, section 2.2: the end of a rod of impedance Z = ρ A c moves by 2 Σ (−1)^k u₀(t − (2 k + 1) L/c) where the
other one is moved by u₀, which needs the force Z (u̇₀(t) + 2 Σ (−1)^k u̇₀(t − 2 k L/c)).
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from gudgeon.modaldb.records.modes import LoadModes, ModalRecord, MorphRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.errors import SceneError
from gudgeon.solver.simulate import simulate
from tests.solver.systems import LENGTH, MASS, SPEED, build, build_all, rigid_records, rod_records

UP = {"top": ([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]), "bottom": ([0.0, 0.0, 0.0], [0.0, 0.0, -1.0])}
RUN: dict[str, Any] = {"samples": 400, "frames": 100, "checks": False}
PASS = LENGTH / SPEED
"""Time of a wave from one end of the rod to the other [s]."""


def held_rod(mode_count: int) -> tuple[ModalRecord, MorphRecord]:
    """The free rod of `rod_records` with a mean of its other end, at x = 0; R from the tails of the series."""
    modal, morph = rod_records(mode_count)
    tip, omega = modal.interfaces["tip"].rows[0], modal.angular_frequencies
    base = np.full(mode_count, np.sqrt(2 / MASS))
    static = LENGTH**2 / (MASS * SPEED**2)  # L / EA; with inertia relief a third of it, and −1/6 between the ends.
    R = np.zeros((4, 4))
    R[0, 0] = modal.residual_flexibility[0, 0]  # type: ignore[index]
    R[1, 1] = static / 3 - float((base**2 / omega**2).sum())
    R[0, 1] = R[1, 0] = -static / 6 - float((base * tip / omega**2).sum())
    rows = np.zeros((3, mode_count))
    rows[0] = base
    load = LoadModes(rows, np.column_stack([np.eye(3), np.zeros((3, 3))]), np.zeros(3), "N")
    spans = {"tip": [0, 1], "base": [1, 4]}
    return replace(modal, interface_rows=spans, residual_flexibility=R, loads={"base": load}), morph


def shaken(folder: Path, step: float, duration: float, W: float) -> tuple[Trajectory, np.ndarray]:
    """An oscillator on a base that moves by A sin W t, and its exact motion."""
    m, k, c, A = 0.5, 2000.0, 3.0, 1e-3
    scene = {
        "body": {"base": {"freedom": ["x"]}, "mass": {"freedom": ["x"]}},
        "force": {"s": {"kind": "spring", "body": "mass", "against": "base", "direction": [1, 0, 0], "stiffness": k,
                        "damping": c}},
        "motion": {"shake": {"kind": "translation", "body": "base", "direction": [2, 0, 0],
                             "expression": f"{A}*sin({W}*t)"}},
        "probe": {
            "mass": {"kind": "displacement", "body": "mass", "direction": [1, 0, 0]},
            "base": {"kind": "displacement", "body": "base", "direction": [1, 0, 0]},
            "push": {"kind": "force", "of": "motion.shake"},
        },
        "run": RUN | {"duration": duration, "step": step},
    }  # fmt: skip
    found = simulate(build_all(folder, {"base": rigid_records(3.0, UP), "mass": rigid_records(m, UP)}, scene))
    t, s = found.times, 1j * W
    H = (k + c * s) / (m * s * s + c * s + k)
    roots = np.roots([m, c, k])
    shares = np.linalg.solve(np.array([[1, 1], roots]), [-A * H.imag, -A * (s * H).imag])
    return found, A * (H * np.exp(s * t)).imag + sum(a * np.exp(r * t) for a, r in zip(shares, roots, strict=True)).real


def pulled(folder: Path, expression: str, **run: Any) -> Trajectory:
    """A mass of 0.5 kg on a spring of 20 N/m and a dashpot of 50 N s/m to a base that moves along x."""
    link = {
        "kind": "spring",
        "body": "mass",
        "against": "base",
        "direction": [1, 0, 0],
        "stiffness": 20.0,
        "damping": 50.0,
    }
    scene = {
        "body": {"base": {"freedom": ["x"]}, "mass": {"freedom": ["x"]}},
        "force": {"s": link},
        "motion": {"pulse": {"kind": "translation", "body": "base", "direction": [1, 0, 0], "expression": expression}},
        "probe": {"mass": {"kind": "displacement", "body": "mass", "direction": [1, 0, 0]}},
        "run": {"duration": 0.1, "samples": 400, "frames": 100} | run,
    }
    return simulate(build_all(folder, {"base": rigid_records(3.0, UP), "mass": rigid_records(0.5, UP)}, scene))


PULSE = "1e-4*exp(-((t - 0.03312)/2e-5)**2)"


@pytest.mark.parametrize("run", [{}, {"checks": False}])
def test_steps_read_motions_that_come_back_between_two_samples(tmp_path: Path, run: dict[str, Any]) -> None:
    found = pulled(tmp_path, PULSE, **run)

    def rates(t: float, y: np.ndarray) -> list[float]:
        base = 1e-4 * np.exp(-(((t - 0.03312) / 2e-5) ** 2))
        base_rate = -2 * (t - 0.03312) / 4e-10 * base
        return [y[1], (20.0 * (base - y[0]) + 50.0 * (base_rate - y[1])) / 0.5]

    start = 0.0331 - 1e-4
    exact = solve_ivp(
        rates, (start, 0.1), [0.0, 0.0], t_eval=found.times[found.times > start][:-1], rtol=1e-9, atol=1e-15,
        max_step=5e-6,
    )  # fmt: skip
    peak = np.abs(exact.y[0]).max()
    assert peak > 3e-7
    assert np.abs(found.probes["mass"].values[:, 0]).max() == pytest.approx(peak, rel=0.01)


def test_given_steps_that_pass_over_a_motion_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"motion\.pulse: it moves and comes back near t = 0\.0331.* set run\.step"):
        pulled(tmp_path, PULSE, step=2.5e-4)


def test_a_jump_and_back_between_two_looks_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"motion\.pulse\.expression: it jumps at t = 0\.03331"):
        pulled(tmp_path, "1e-4*step(t - 0.033311)*step(0.033319 - t)")


def test_shaken_oscillator_is_of_second_order(tmp_path: Path) -> None:
    errors = []
    for number, step in enumerate((2e-3, 1e-3, 5e-4)):
        found, exact = shaken(tmp_path / str(number), step, 2.0, 50.0)
        x = found.probes["mass"].values[:, 0]
        errors.append(float(np.abs(x - exact).max() / np.abs(exact).max()))
        assert found.result == "FINISHED"
        assert found.energy_drift < 1e-12
        assert found.momentum_residual < 1e-12
    orders = np.diff(np.log(errors)) / np.log(0.5)
    assert orders == pytest.approx(2.0, abs=0.1)
    assert errors[-1] < 6e-4


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
def test_transmissibility_and_phase(ratio: float, tmp_path: Path) -> None:
    """After the transient, amplitude and phase of the mass over the base, and the force that the shaker needs."""
    m, k, c, A = 0.5, 2000.0, 3.0, 1e-3
    W = ratio * np.sqrt(k / m)
    found, _ = shaken(tmp_path, 2e-4, 6.0, W)
    t, late = found.times, found.times > 4.0
    waves = np.column_stack([np.sin(W * t), np.cos(W * t)])[late]
    s = 1j * W
    H = (k + c * s) / (m * s * s + c * s + k)
    a, b = np.linalg.lstsq(waves, found.probes["mass"].values[late, 0], rcond=None)[0] / A
    assert complex(a, b) == pytest.approx(H, abs=2e-3 * abs(H))
    push = np.linalg.lstsq(waves, found.probes["push"].values[late, 0], rcond=None)[0] / A
    half = np.exp(0.5 * s * t[0])  # The force is the mean over a sample.
    needed = (3.0 * s * s + m * s * s * H) * np.sinc(W * t[0] / 2 / np.pi) / half
    assert complex(*push) == pytest.approx(needed, rel=2e-3)


@pytest.mark.parametrize(("modes", "tip", "force"), [(10, 4e-4, 0.02), (40, 3e-5, 2.5e-3)])
def test_rod_on_a_moving_base(modes: int, tip: float, force: float, tmp_path: Path) -> None:
    """The far end and the reaction, by waves; the base is where it is given to round-off."""
    W, A = 3000.0, 1e-4
    scene = {
        "body": {"part": {"freedom": ["x"]}},
        "motion": {"base": {"kind": "translation", "body": "part", "interface": "base", "direction": [1, 0, 0],
                            "held": True, "expression": f"{A}*(1-cos({W}*t))"}},
        "probe": {
            "tip": {"kind": "displacement", "body": "part", "interface": "tip"},
            "base": {"kind": "displacement", "body": "part", "interface": "base", "direction": [1, 0, 0]},
            "force": {"kind": "force", "of": "motion.base"},
        },
        "run": RUN | {"duration": 4e-3, "step": 2e-6},
    }  # fmt: skip
    found = simulate(build(tmp_path, held_rod(modes), scene))
    t, read = found.times, {name: probe.values[:, 0] for name, probe in found.probes.items()}
    middle, Z = t - 0.5 * t[0], MASS / LENGTH * SPEED
    far = sum(2 * (-1) ** k * _after(t, (2 * k + 1) * PASS, A * (1 - np.cos(W * (t - (2 * k + 1) * PASS))))
              for k in range(12))  # fmt: skip
    speed = [_after(middle, 2 * k * PASS, A * W * np.sin(W * (middle - 2 * k * PASS))) for k in range(12)]
    needed = Z * (speed[0] + 2 * sum((-1) ** k * one for k, one in enumerate(speed[1:], 1)))
    assert np.abs(read["base"] - A * (1 - np.cos(W * t))).max() < 1e-13 * A
    assert np.abs(read["tip"] - far).max() < tip * np.abs(far).max()
    assert np.abs(read["force"] - needed).max() < force * np.abs(needed).max()
    assert found.energy_drift < 1e-12


def _after(t: np.ndarray, begin: float, values: np.ndarray) -> np.ndarray:
    return np.where(t > begin, values, 0.0)


def test_base_that_moves_by_a_table(tmp_path: Path) -> None:
    """Rows of a smooth motion give what its expression gives, by a cubic spline."""
    W, A, scenes = 3000.0, 1e-4, []
    t = np.linspace(0.0, 4e-3, 201)
    rows = [[float(one), float(A * (1 - np.cos(W * one)))] for one in t]
    for number, amount in enumerate(({"expression": f"{A}*(1-cos({W}*t))"}, {"values": rows})):
        scene = {
            "body": {"part": {"freedom": ["x"]}},
            "motion": {"base": {"kind": "translation", "body": "part", "interface": "base", "direction": [1, 0, 0]}
                       | amount},
            "probe": {"tip": {"kind": "displacement", "body": "part", "interface": "tip"}},
            "run": RUN | {"duration": 4e-3, "step": 2e-6},
        }  # fmt: skip
        found = simulate(build(tmp_path / str(number), held_rod(20), scene))
        scenes.append(found.probes["tip"].values)
    assert np.abs(scenes[0] - scenes[1]).max() < 1e-4 * np.abs(scenes[0]).max()


def ball_on_shaker(folder: Path, A: float, W: float, step: float, restitution: float = 0.0) -> Trajectory:
    pair = {"shape": "body", "body": "table", "interface": "top"}
    scene = {
        "body": {"table": {"freedom": ["z"]}, "ball": {"freedom": ["z"], "velocity": [0, 0, A * W]}},
        "contact": {"touch": {"body": "ball", "interface": "bottom", "against": pair, "method": "impact",
                              "restitution": restitution}},
        "motion": {"shake": {"kind": "translation", "body": "table", "direction": [0, 0, 1],
                             "expression": f"{A}*sin({W}*t)"}},
        "probe": {
            "ball": {"kind": "displacement", "body": "ball", "direction": [0, 0, 1]},
            "press": {"kind": "force", "of": "contact.touch"},
            "push": {"kind": "force", "of": "motion.shake"},
        },
        "run": RUN | {"duration": 0.2, "step": step, "gravity": [0, 0, -9.81]},
    }  # fmt: skip
    table, ball = rigid_records(4.0, UP), rigid_records(0.1, UP)
    return simulate(build_all(folder, {"table": table, "ball": ball}, scene))


def test_ball_stays_on_a_slow_shaker(tmp_path: Path) -> None:
    """Below A W² = g it is pressed by m (g + z̈); the shaker carries both."""
    A, W = 1e-3, 80.0
    found = ball_on_shaker(tmp_path, A, W, 1e-4)
    t, press = found.times[5:], found.probes["press"].values[5:, 2]
    means = A * W * (np.cos(W * t) - np.cos(W * (t - t[1] + t[0]))) / (t[1] - t[0])
    assert press == pytest.approx(0.1 * (9.81 + means), abs=2e-3)
    assert found.probes["push"].values[5:, 0] == pytest.approx(4.0 * (means + 9.81) + press, abs=2e-2)
    assert found.energy_drift < 1e-6


@pytest.mark.parametrize("restitution", [0.0, 0.4])
def test_ball_leaves_a_fast_shaker(restitution: float, tmp_path: Path) -> None:
    """Where the table decelerates by more than g the ball flies off, and meets it again where the parabola does."""
    A, W, g = 1e-3, 150.0, 9.81
    found = ball_on_shaker(tmp_path, A, W, 2e-5, restitution)
    leaves = np.arcsin(g / (A * W**2)) / W
    z, v = A * np.sin(W * leaves), A * W * np.cos(W * leaves)

    def apart(t: float) -> float:
        return z + v * (t - leaves) - 0.5 * g * (t - leaves) ** 2 - A * np.sin(W * t)

    lands = brentq(apart, leaves + 0.2 / W, leaves + 6 / W)
    t, ball = found.times, found.probes["ball"].values[:, 0]
    flying = (t > leaves) & (t < lands)
    assert np.count_nonzero(flying) > 20
    assert ball[flying] == pytest.approx(
        z + v * (t[flying] - leaves) - 0.5 * g * (t[flying] - leaves) ** 2, abs=2e-3 * A
    )
    # Newton's restitution of the velocity relative to the table.
    closing = v - g * (lands - leaves) - A * W * np.cos(W * lands)
    after = A * W * np.cos(W * lands) - restitution * closing
    if restitution:
        soon = (t > lands + 2e-5) & (t < lands + 2e-3)
        assert ball[soon] == pytest.approx(
            A * np.sin(W * lands) + after * (t[soon] - lands) - 0.5 * g * (t[soon] - lands) ** 2, abs=5e-3 * A
        )


def test_driven_wall_strikes_a_rod(tmp_path: Path) -> None:
    """In the axes of the wall the rod is thrown at it: impulse 2 m V, contact over 2 L/c, then the rod moves at 2 V."""
    V, gap = 0.5, 1e-4
    wall = {"shape": "body", "body": "wall", "interface": "face"}
    scene = {
        "body": {"rod": {"freedom": ["x"]}, "wall": {"freedom": ["x"], "position": [LENGTH + gap, 0, 0]}},
        "contact": {"hit": {"body": "rod", "interface": "tip", "against": wall}},
        "motion": {"push": {"kind": "translation", "body": "wall", "direction": [-1, 0, 0],
                            "values": [[0.0, 0.0], [1e-3, V * 1e-3]]}},
        "probe": {"push": {"kind": "force", "of": "motion.push"}},
        "run": RUN | {"duration": 1e-3, "step": 1e-6},
    }  # fmt: skip
    face = rigid_records(7.0, {"face": ([0.0, 0.0, 0.0], [-1.0, 0.0, 0.0])})
    found = simulate(build_all(tmp_path, {"rod": rod_records(60), "wall": face}, scene))
    ends = found.quantities
    assert ends["hit.impulse"]["value"] == pytest.approx(2 * MASS * V, rel=2e-3)
    assert ends["hit.start"]["value"] == pytest.approx(gap / V, rel=1e-2)
    assert ends["rod.velocity_x"]["value"] == pytest.approx(-2 * V, rel=2e-3)
    assert ends["wall.velocity_x"]["value"] == pytest.approx(-V, rel=1e-12)
    impulse = float(found.probes["push"].values.sum()) * found.times[0]
    assert impulse == pytest.approx(ends["hit.impulse"]["value"], rel=1e-9)
    assert found.energy_drift < 1e-4
