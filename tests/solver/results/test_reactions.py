"""Forces of supports and of restricted freedom against statics and waves.

A constant force F on the free end of a rod that is fixed at the other: the support carries 2 F from L/c to 3 L/c,
nothing until 5 L/c, and so on (K. F. Graff, Wave Motion in Elastic Solids, section 2.2).
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import LoadModes, ModalRecord, MorphRecord
from gudgeon.solver.errors import SceneError
from gudgeon.solver.simulate import simulate
from tests.solver.systems import LENGTH, MASS, SPEED, build, build_all, rigid_records, rod_records

SIDE = {"right": ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0]), "bottom": ([0.0, 0.0, 0.0], [0.0, 0.0, -1.0])}
RUN: dict[str, Any] = {"samples": 200, "frames": 20, "checks": False}
PASS = LENGTH / SPEED


def fixed_rod(mode_count: int) -> tuple[ModalRecord, MorphRecord]:
    """The rod of `rod_records`, fixed at x = 0, with a mean of its tip; R from the tail of the series."""
    free, morph = rod_records(mode_count)
    k = np.arange(1, mode_count + 1) - 0.5
    omega, tip = np.pi * SPEED / LENGTH * k, np.sqrt(2 / MASS) * np.sin(np.pi * k)
    R = np.zeros((3, 3))
    R[0, 0] = LENGTH**2 / (MASS * SPEED**2) - float((tip**2 / omega**2).sum())
    rows, participation = np.zeros((3, mode_count)), np.zeros((3, mode_count))
    rows[0], participation[0] = tip, np.sqrt(2 * MASS) / (np.pi * k)
    load = LoadModes(rows, np.column_stack([np.eye(3), np.zeros((3, 3))]), np.array([LENGTH, 0, 0]), "N")
    still = np.zeros((0, 6))
    modal = replace(
        free, angular_frequencies=omega, rigid_twists=still, interfaces={}, interface_rows={"tip": [0, 3]},
        residual_flexibility=R, loads={"tip": load}, participation=participation,
    )  # fmt: skip
    return modal, replace(morph, rigid_twists=still, points={})


@pytest.mark.parametrize(("start", "spring"), [("undeformed", False), ("rest", False), ("rest", True)])
def test_support_of_a_rod(start: str, spring: bool, tmp_path: Path) -> None:
    """By a wave, and at rest, where it is exact, with a preloaded spring that pulls as well."""
    F = 1000.0
    scene: dict[str, Any] = {
        "body": {"part": {}},
        "force": {"push": {"kind": "force", "body": "part", "interface": "tip", "direction": [1, 0, 0],
                           "expression": f"{F}"}},
        "probe": {"support": {"kind": "force", "of": "body.part"}},
        "run": RUN | {"duration": 10 * PASS, "step": PASS / 100, "start": start},
    }  # fmt: skip
    if spring:
        scene["force"]["s"] = {"kind": "spring", "body": "part", "interface": "tip", "direction": [1, 0, 0],
                               "stiffness": 1e7, "preload": 300.0}  # fmt: skip
        scene["probe"]["pull"] = {"kind": "force", "of": "force.s"}
    found = simulate(build(tmp_path, fixed_rod(40), scene))
    held, t = found.probes["support"].values, found.times - 0.5 * found.times[0]
    assert held[:, 1:] == pytest.approx(np.zeros((200, 2)), abs=1e-9)
    if start == "rest":
        pull = found.probes["pull"].values[:, 0] if spring else 0.0
        assert held[:, 0] == pytest.approx(-F + pull + np.zeros(200), rel=1e-6)
        return
    passes = t / PASS
    exact = np.where((passes - 1) % 4 < 2, -2 * F, 0.0) * (passes > 1)
    away = np.abs((passes - 1) % 2 - 1) < 0.8  # From the fronts, where a truncated series rings.
    assert np.abs(held[away, 0] - exact[away]).max() < 0.12 * F
    assert held[:, 0].mean() == pytest.approx(exact.mean(), abs=0.01 * F)


@pytest.mark.parametrize("integrator", ["event", "small"])
def test_restricted_freedom_carries_what_acts_across(integrator: str, tmp_path: Path) -> None:
    """A ball on a vertical guide: gravity aslant, and a bounce on the floor, which the guide does not feel."""
    scene = {
        "body": {"part": {"freedom": ["z"], "velocity": [0, 0, -1.0], "position": [0, 0, 0.01]}},
        "contact": {"floor": {"body": "part", "interface": "bottom", "method": "impact", "restitution": 0.7,
                              "against": {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}}},
        "probe": {"guide": {"kind": "force", "of": "body.part"}},
        "run": RUN | {"duration": 0.05, "gravity": [2.0, 0.0, -9.0], "integrator": integrator}
        | ({} if integrator == "event" else {"step": 1e-4}),
    }  # fmt: skip
    found = simulate(build(tmp_path, rigid_records(0.3, SIDE), scene))
    assert found.quantities["floor.impacts"]["value"] >= 1
    held = found.probes["guide"].values
    assert held == pytest.approx(np.tile([-0.6, 0.0, 0.0], (len(held), 1)), abs=1e-9)


def test_body_that_a_spring_and_another_body_push(tmp_path: Path) -> None:
    """A fixed body between a spring and a ball that is pressed on it carries the difference."""
    pair = {"shape": "body", "body": "post", "interface": "right"}
    left = {"left": ([0.0, 0.0, 0.0], [-1.0, 0.0, 0.0])}
    scene = {
        "body": {"ball": {"freedom": ["x"]}, "post": {"freedom": ["z"]}},
        "contact": {"touch": {"body": "ball", "interface": "left", "against": pair, "method": "constraint"}},
        "force": {"s": {"kind": "spring", "body": "ball", "against": "post", "direction": [1, 0, 0],
                        "stiffness": 1e3, "stretch": 0.02},
                  "push": {"kind": "force", "body": "ball", "at": [0, 0, 0], "direction": [1, 0, 0],
                           "expression": "-7"}},
        "probe": {"post": {"kind": "force", "of": "body.post"}, "touch": {"kind": "force", "of": "contact.touch"}},
        "run": RUN | {"duration": 0.01, "step": 1e-4},
    }  # fmt: skip
    found = simulate(build_all(tmp_path, {"ball": rigid_records(1.0, left), "post": rigid_records(2.0, SIDE)}, scene))
    assert found.probes["touch"].values[:, 0] == pytest.approx(np.full(100, 27.0), rel=1e-9)
    assert found.probes["post"].values[:, 0] == pytest.approx(np.full(100, 7.0), rel=1e-9)


def test_free_body_is_held_by_nothing(tmp_path: Path) -> None:
    scene = {"body": {"part": {}}, "probe": {"r": {"kind": "force", "of": "body.part"}}, "run": RUN | {"duration": 0.1}}
    with pytest.raises(SceneError, match=r"^probe\.r\.of: nothing holds body 'part'"):
        build(tmp_path, rigid_records(1.0, SIDE, (1e-3, 1e-3, 1e-3)), scene)
