"""Elastic bearings of joints with clearance: complementarity, potential and table, impacts, rest, what is refused."""

from functools import cache
from math import comb
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.integrate import quad

from gudgeon.modaldb.records.trajectory import WEAR, Trajectory
from gudgeon.solver import core
from gudgeon.solver.contact.bores import ElasticBore, foundation
from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.turning.touching.yielding import (
    DEGREE,
    Pressed,
    Table,
    table_of,
    yielding_arrays,
)
from gudgeon.solver.joints.clearance import Clearance
from gudgeon.solver.simulate import simulate
from tests.solver.integrators.turning.scenes import hinge, solved, system_of

GAP, RADIUS, LENGTH, STIFF, LOAD = 1e-3, 0.02, 0.01, 1e11, 5e3
BED = {"foundation": STIFF, "length": LENGTH, "load": LOAD, "places": 360}
WEARS = {"coefficient": 1e-3, "hardness": 2e9, "cells": 180}
SMOOTH = 3e-3
"""Error of a table's force over the largest one at places between its own: that of splines of 1.25 powers."""


def knee(**more: Any) -> dict[str, Any]:
    bearing = BED | more.pop("bearing", {})
    return hinge("clearance", clearance=GAP, radius=RADIUS, bearing=bearing, against_at=[0, 0, 0], **more)


def joint(**more: Any) -> Clearance:
    return Clearance.model_validate(knee(**more) | {"at": [0, 0, 0]})


@cache
def round_table() -> Table:
    return table_of(Pressed(foundation(joint()), GAP), RADIUS, LOAD, "joint.knee.bearing")


def value(found: Trajectory, name: str) -> float:
    return found.quantities[f"knee.{name}"]["value"]


def coupled(count: int) -> np.ndarray:
    """Return a compliance whose places pull each other in and push each other out, positive definite."""
    rng = np.random.default_rng(5)
    A = rng.normal(size=(count, count))
    return 1e-8 * (A @ A.T / count + 0.2 * np.eye(count))


def at(offset: float, angle: float) -> np.ndarray:
    return offset * np.array([np.cos(angle), np.sin(angle)])


def read(table: Table, offset: np.ndarray) -> tuple[float, np.ndarray]:
    """Return δ [m] of a table, and its force [N], (2,)."""
    model = SimpleNamespace(**yielding_arrays([table]), touch_size=np.array([[GAP, RADIUS, 0.0]]))
    H, *slope = core.yielding_depth(model, 0, *offset)
    size = float(np.linalg.norm(offset))
    depth = size - GAP - H
    return depth, table.stiffness * max(depth, 0.0) * (offset / size - slope)


@pytest.mark.parametrize("angle", [0.0, 1.234, 4.5])
def test_forces_press_where_gaps_close_and_nowhere_else(angle: float) -> None:
    """λ ≥ 0, g ≥ 0, λ g = 0 for a compliance with couplings of both signs; the force is the potential's gradient."""
    angles = 2 * np.pi / 72 * np.arange(72)
    pressed = Pressed(ElasticBore(angles, np.full(72, 1e-6), coupled(72)), GAP, 1e-4 * (1 + np.cos(3 * angles)))
    e = at(GAP + 4e-4, angle)
    forces = pressed.forces(e)
    gaps = pressed.gap - pressed.turns @ e + pressed.bore.compliance @ forces
    assert (forces >= 0).all()
    assert np.count_nonzero(forces) > 2
    assert gaps.min() > -1e-15
    assert np.abs(forces * gaps).max() < 1e-12 * forces.max() * GAP
    step = 1e-9
    slope = [(pressed.potential(e + d)[0] - pressed.potential(e - d)[0]) / (2 * step) for d in step * np.eye(2)]
    np.testing.assert_allclose(slope, pressed.potential(e)[1], rtol=1e-6, atol=1e-6 * float(np.linalg.norm(slope)))


@pytest.mark.parametrize("depth", [1e-5, 5e-5])
def test_a_foundation_has_its_closed_form(depth: float) -> None:
    """V = ½ k (r + c) l ∫ (e cos θ − c)² dθ over the pressed angle, and its derivative the force."""
    e = GAP + depth
    half, size = np.arccos(GAP / e), STIFF * (RADIUS + GAP) * LENGTH
    energy = 0.5 * size * quad(lambda t: (e * np.cos(t) - GAP) ** 2, -half, half)[0]
    force = size * quad(lambda t: (e * np.cos(t) - GAP) * np.cos(t), -half, half)[0]
    found, pushed = Pressed(foundation(joint()), GAP).potential(at(e, 0.7))
    assert found == pytest.approx(energy, rel=1e-3)
    np.testing.assert_allclose(pushed, at(force, 0.7), rtol=2e-3)
    table = round_table()
    depth_of, tabled = read(table, at(e, 0.7))
    assert 0.5 * table.stiffness * depth_of**2 == pytest.approx(energy, rel=2e-3)
    np.testing.assert_allclose(tabled, at(force, 0.7), atol=SMOOTH * LOAD)


@pytest.mark.parametrize("worn", [None, 2e-4 * (1 + np.cos(2 * np.pi * np.arange(180) / 180 - 1.0))])
def test_the_table_is_the_bearing_and_has_a_potential(worn: np.ndarray | None) -> None:
    """Between its own places forces are those of the complementarity problem; δ has the slope that is said of it."""
    pressed = Pressed(foundation(joint()), GAP, worn)
    table = round_table() if worn is None else table_of(pressed, RADIUS, LOAD, "joint.knee.bearing")
    for angle in (0.3, 1.01, 2.2, 4.4):
        touch = pressed.first_touch(angle)[0]
        for share in (0.2, 0.5, 0.9):
            e = at(touch + share * table.reach[-1], angle)
            np.testing.assert_allclose(read(table, e)[1], pressed.potential(e)[1], atol=2 * SMOOTH * LOAD)
            step = 1e-9
            slope = [(read(table, e + d)[0] - read(table, e - d)[0]) / (2 * step) for d in step * np.eye(2)]
            depth, force = read(table, e)
            np.testing.assert_allclose(table.stiffness * depth * np.array(slope), force, rtol=1e-5, atol=1e-2)
        assert read(table, at(0.9 * touch, angle))[0] < 0
        assert read(table, at(0.2 * touch, angle))[0] < read(table, at(0.9 * touch, angle))[0]
    assert read(table, np.array([1e-30, 0.0]))[0] < 0


@pytest.mark.parametrize("way", [0, 1])
def test_cells_of_the_table_meet_with_four_derivatives(way: int) -> None:
    """A kink at a border makes steps of high order try again and again there; 0: along the offset, 1: around."""
    table = round_table()
    cells = np.moveaxis(table.depth, way, 0)
    widths = np.diff(table.reach) if way == 0 else np.full(len(cells), 2 * np.pi / len(cells))
    powers = np.moveaxis(cells, 2 + way, 0)[::-1]
    for order in range(DEGREE):
        above = range(order, DEGREE + 1)
        here = sum(comb(power, order) * powers[power][:-1].T * widths[:-1] ** power for power in above)
        there = powers[order][1:].T * widths[:-1] ** order
        np.testing.assert_allclose(here, there, atol=1e-9 * np.abs(powers[0]).max())


def thrown(folder: Path, **more: Any) -> Trajectory:
    bodies = {
        "part": {"velocity": [0.4, 0.3, 0.0], "angular_velocity": [0.0, 0.0, 20.0]},
        "mate": {"velocity": [-0.1, 0.0, 0.0], "angular_velocity": [0.0, 0.0, -3.0]},
    }
    run = {"duration": 0.05, "accuracy": 1e-9}
    return solved(folder, bodies, {"knee": knee(against="mate", **more)}, run=run)


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"wear": WEARS | {"bearing_depth": [(1e-4 * (1 + np.cos(2 * np.pi * np.arange(36) / 36))).tolist()]}},
        {"friction": {"coefficient": 0.2}},
        {"bearing": {"restitution": 0.5}},
    ],
    ids=["round", "worn", "friction", "loss"],
)
def test_momentum_and_energy_are_kept(more: dict[str, Any], tmp_path: Path) -> None:
    found = thrown(tmp_path, **more)
    assert value(found, "impacts") >= 2
    assert found.momentum_residual < 1e-12
    balance = found.energies @ [1, 1, 1, 1, -1]
    np.testing.assert_allclose(balance, balance[0], rtol=1e-6)
    cells = found.counts[WEAR]["knee"]
    assert np.sum(cells["load_distance"]) == pytest.approx(value(found, "load_distance"), rel=1e-9)


def dropped(folder: Path, **more: Any) -> Trajectory:
    bodies = {"part": {"velocity": [0.3, 0.1, 0.0]}}
    return solved(folder, bodies, {"knee": knee(**more)}, run={"duration": 0.008, "accuracy": 1e-9})


@pytest.mark.parametrize("asked", [1.0, 0.7, 0.3])
def test_an_impact_gives_its_restitution_back(asked: float, tmp_path: Path) -> None:
    """Straight impacts separate at the asked share of their approach: whatever the potential."""
    found = dropped(tmp_path, bearing={"restitution": asked})
    first = {key: value(found, f"impact1.{key}") for key in ("approach_speed", "separation_speed")}
    assert first["separation_speed"] / first["approach_speed"] == pytest.approx(asked, rel=1e-6)


def test_a_journal_rests_on_its_bearing(tmp_path: Path) -> None:
    """Started where the bearing carries its weight it stays there, and the pressure adds up to the weight."""
    table, weight = round_table(), 2.0 * 9.81
    low, high = GAP, GAP + table.reach[-1]
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if read(table, at(middle, -np.pi / 2))[1][1] > -weight else (low, middle)
    bodies, run = {"part": {"position": [0.0, -low, 0.0]}}, {"duration": 0.02, "gravity": [0.0, -9.81, 0.0]}
    found = solved(tmp_path, bodies, {"knee": knee()}, run=run)
    assert np.abs(found.motion["part"][:, :2]).max() < 1e-9
    assert value(found, "impulse") == pytest.approx(weight * 0.02, rel=1e-6)
    cells = np.array(found.counts[WEAR]["knee"]["pressure"][0])
    turn = 2 * np.pi / len(cells) * np.arange(len(cells))
    area = 2 * np.pi * (RADIUS + GAP) * LENGTH / len(cells)
    pushed = [float(cells @ one) * area for one in (np.cos(turn), np.sin(turn))]
    # The marker's first axis is that of x: the weight is borne at 270°.
    np.testing.assert_allclose(pushed, [0.0, -weight], atol=5e-3 * weight)
    assert value(found, "pressure_peak") == pytest.approx(cells.max())


def test_a_force_beyond_the_table_ends_the_run(tmp_path: Path) -> None:
    bodies = {"part": {"velocity": [0.3, 0.1, 0.0]}}
    found = simulate(system_of(tmp_path, bodies, {"knee": knee(bearing={"load": 20.0})}, run={"duration": 0.01}))
    assert found.result == "OVERLOADED"
    assert "exceeds 20 N" in found.counts["reason"]
    assert "joint.knee.bearing.load" in found.counts["reason"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"law": {"kind": "hertz", "stiffness": 1e6}}, "give either a law, or an elastic bearing"),
        ({"length": 0.05}, "leave it out"),
        ({"wear": WEARS | {"journal_coefficient": 1e-3}}, "wear.journal_coefficient"),
        ({"wear": WEARS | {"journal_depth": [[1e-5] * 8]}}, "wear.journal_depth"),
        ({"wear": WEARS | {"indentation": 1e-5}}, "wear.indentation"),
        ({"bearing": {"length": None}}, "length: is missing"),
        ({"bearing": {"component": "bush"}}, "give either component with interface, or foundation"),
        ({"bearing": {"restitution": 0.0}}, "restitution"),
        ({"bearing": {"load": 0.0}}, "load"),
        ({"clearance": 0.0}, "clearance"),
    ],
)
def test_what_does_not_fit_is_refused(change: dict[str, Any], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        Clearance.model_validate(knee() | {"at": [0, 0, 0]} | change | (
            {"bearing": BED | change["bearing"]} if "bearing" in change else {}))  # fmt: skip


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"bearing": {"load": 1e12}}, "more than 0.1 of its radius"),
        ({"wear": WEARS | {"cells": 360}}, "360 given; the bore has 360 positions.* allowed: up to 180"),
    ],
)
def test_what_the_bearing_does_not_carry_is_refused(change: dict[str, Any], said: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=said):
        simulate(system_of(tmp_path, {"part": {}}, {"knee": knee(**change)}, run={"duration": 0.01}))
