"""Every integrator: the order that it declares, balances, and the same answer as exact motion."""

import itertools
import math
from pathlib import Path
from typing import Any

import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.integrators.family import INTEGRATORS, make
from gudgeon.solver.integrators.steps import LARGEST
from gudgeon.solver.simulate import simulate
from tests.solver.systems import build, rod_records

LAW = {"method": "penalty", "law": {"kind": "linear", "stiffness": 2e8}}
METHODS: dict[str, dict[str, Any]] = {
    "kick": {"method": "residual"},
    "trapezoid": {"method": "residual"},
    "event": {"method": "residual"},
    "discrete-gradient": {"method": "residual"},
    "collocation": LAW,
}
STEPS = {"kick": 4e-7, "trapezoid": 2e-6, "discrete-gradient": 2e-6, "collocation": 2e-5}
"""Coarse enough for the error to stand above round-off, fine enough to show its order [s]."""
DURATION = 1.6e-4
"""Of a rod of 400 µs of contact: closed from the start to the end."""


def scene(name: str, method: dict[str, Any], **run: Any) -> dict[str, Any]:
    plane = {"shape": "plane", "point": [1, 0, 0], "normal": [-1, 0, 0]}
    return {
        "body": {"part": {"velocity": [1.0, 0, 0]}},
        "contact": {"wall": {"body": "part", "interface": "tip", "against": plane} | method},
        "run": {"duration": DURATION, "integrator": name, "samples": 10, "frames": 2} | run,
    }


def solved(folder: Path, name: str, method: dict[str, Any], **run: Any) -> Trajectory:
    return simulate(build(folder, rod_records(8), scene(name, method, **run)))


def test_every_member_has_a_case() -> None:
    assert set(METHODS) == set(INTEGRATORS)


@pytest.mark.parametrize("name", sorted(STEPS))
def test_the_error_falls_as_declared(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(LARGEST, name, math.inf)  # What is too large for a law is not for this linear one.
    exact = solved(tmp_path / "exact", "event", METHODS[name])
    errors = []
    for number in range(3):
        found = solved(tmp_path / str(number), name, METHODS[name], step=STEPS[name] / 2**number)
        errors.append(abs(found.quantities["wall.impulse"]["value"] / exact.quantities["wall.impulse"]["value"] - 1))
    order = make(name, build(tmp_path / "order", rod_records(8), scene(name, METHODS[name])), 1e-7).order
    measured = [math.log2(a / b) for a, b in itertools.pairwise(errors)]
    assert min(measured) > 0.85 * order


@pytest.mark.parametrize("name", sorted(INTEGRATORS))
def test_balances_close(name: str, tmp_path: Path) -> None:
    found = solved(tmp_path, name, METHODS[name])
    assert found.result == "FINISHED"
    assert found.momentum_residual < 1e-12
    assert found.energy_drift < {"kick": 1e-3, "trapezoid": 0.2, "collocation": 1e-7}.get(name, 1e-11)
    assert found.times[-1] >= DURATION * (1 - 1e-12)
    interval = found.times[1] - found.times[0]
    impulse = found.quantities["wall.impulse"]["value"]
    assert -interval * found.contacts["wall"].force[:, 0].sum() == pytest.approx(impulse, rel=1e-12)
