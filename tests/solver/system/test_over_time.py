"""Forces, torques and pressures over time against closed forms."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gudgeon.modaldb.records.modes import LoadModes, ModalRecord, MorphRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.errors import SceneError
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from tests.solver.systems import LENGTH, MASS, SPEED, build, piston_records, rigid_records, rod_records

TABLE = [[0.0, 0.0], [0.013, 5.0], [0.0301, -2.0], [0.0555, 8.0], [0.1, 8.0]]
AREA = float(np.trapezoid(*np.array(TABLE).T[::-1]))
INERTIA = (0.02, 0.03, 0.05)


def scene(force: dict[str, Any], *, duration: float = 0.1, part: dict[str, Any] | None = None, **run: Any) -> dict:
    own = {"duration": duration, "start": "undeformed", "samples": 100, "frames": 20, "limits": {"angle": 10.0}}
    return {"body": {"part": part or {}}, "force": {"f": {"body": "part"} | force}, "run": own | run}


def loaded_rod(count: int) -> tuple[ModalRecord, MorphRecord]:
    """The rod with the mean of its end surface: forces along x reach its modes."""
    modal, morph = rod_records(count)
    rows = np.vstack([modal.interfaces["tip"].rows, np.zeros((2, count))])
    axes, point = np.eye(3), np.array([LENGTH, 0.0, 0.0])
    load = LoadModes(rows, np.column_stack([axes, np.cross(point, axes)]), point, "N")
    residual = np.zeros((4, 4))
    assert modal.residual_flexibility is not None
    residual[:2, :2] = modal.residual_flexibility[0, 0]
    spans = {"tip": [0, 1], "end": [1, 4]}
    return replace(modal, loads={"end": load}, interface_rows=spans, residual_flexibility=residual), morph


def test_a_mode_under_a_harmonic_force(tmp_path: Path) -> None:
    """q̈ + ω² q = b sin Ωt from rest; the mean force of each step makes the error one of second order."""
    records = loaded_rod(1)
    omega, b, W = np.pi * SPEED, -np.sqrt(2 / MASS), 4000.0
    errors = []
    for step in (4e-6, 1e-6):
        force = {"kind": "force", "interface": "end", "direction": [2.0, 0, 0], "expression": f"sin({W}*t)"}
        run = simulate(build(tmp_path / str(step), records, scene(force, duration=4e-3, step=step)))
        t = run.frame_times
        exact = b / (omega**2 - W**2) * (np.sin(W * t) - W / omega * np.sin(omega * t))
        errors.append(np.abs(run.frames[:, 1] - exact).max() / np.abs(exact).max())
        rigid = -(np.sin(W * t) / W - t) / W / np.sqrt(MASS)
        np.testing.assert_allclose(run.frames[:, 0], rigid, atol=1e-3 * rigid.max())
        assert run.energy_drift < 1e-9
        assert run.momentum_residual < 1e-11
    assert errors[1] < 2e-5
    assert errors[1] < 0.1 * errors[0]


def test_the_end_of_a_bar_under_a_step_force(tmp_path: Path) -> None:
    """Until the wave comes back, the end moves at c F / EA."""
    modal, morph = loaded_rod(200)
    force = {"kind": "force", "interface": "end", "direction": [1.0, 0, 0], "values": [[0, 1e3], [1.0, 1e3]]}
    system = build(tmp_path, (modal, morph), scene(force, duration=1.9 * LENGTH / SPEED, step=5e-7))
    run = simulate(system)
    moved = run.frames @ system.driving.rows[0] + system.driving.residual[0, 0] * 1e3
    exact = 1e3 * run.frame_times * LENGTH / (MASS * SPEED)
    np.testing.assert_allclose(moved, exact, atol=2e-3 * exact.max())
    assert run.energy_drift < 1e-9
    at_rest = scene(force, duration=1e-4, start="rest")
    assert np.abs(build(tmp_path / "rest", (modal, morph), at_rest).position[1:]).max() > 0


def rigid_run(folder: Path, force: dict[str, Any], **settings: Any) -> Trajectory:
    records = rigid_records(2.0, {"foot": ([0, 0, -1.0], [0, 0, -1.0])}, INERTIA)
    return simulate(build(folder, records, scene(force, **settings)))


@pytest.mark.parametrize("step", [7e-4, 1e-5])
def test_impulse_is_the_integral_of_the_table(step: float, tmp_path: Path) -> None:
    """Exactly, with rows of the table between the ends of steps."""
    force = {"kind": "force", "at": [0.0, 0.5, 0.0], "direction": [0, 0, 3.0], "values": TABLE}
    run = rigid_run(tmp_path, force, step=step)
    end = run.motion["part"][-1, 6:]
    np.testing.assert_allclose(end, [0, 0, AREA / 2.0, 0.5 * AREA / INERTIA[0], 0, 0], atol=1e-13)
    assert run.momentum_residual < 1e-12
    assert run.energies[-1, 4] == pytest.approx(run.energies[-1, 0], rel=1e-12)


def test_a_point_turns_with_its_body(tmp_path: Path) -> None:
    force = {"kind": "force", "at": [0.5, 0.0, 0.0], "direction": [0, 0, 1.0], "values": TABLE}
    turned = {"orientation": {"axis": [0, 0, 1.0], "angle": 90.0}, "position": [3.0, 4.0, 5.0]}
    run = rigid_run(tmp_path, force, part=turned)
    np.testing.assert_allclose(run.motion["part"][-1, 9:], [0.5 * AREA / INERTIA[1], 0, 0], atol=1e-13)


def test_a_torque(tmp_path: Path) -> None:
    run = rigid_run(tmp_path, {"kind": "torque", "direction": [0, 5.0, 0], "expression": "0.3*t"}, duration=0.02)
    np.testing.assert_allclose(run.motion["part"][-1, 6:], [0, 0, 0, 0, 0.15 * 0.02**2 / INERTIA[1], 0], atol=1e-16)


def test_pressure_pushes_inwards(tmp_path: Path) -> None:
    force = {"kind": "pressure", "interface": "crown", "expression": "1e5 * step(t - 0.01)"}
    run = simulate(build(tmp_path, piston_records(), scene(force, duration=0.02, step=1e-5)))
    assert run.motion["part"][-1, 8] == pytest.approx(-1e5 * 5e-3 * 0.01 / 0.5, rel=1e-9)


@pytest.mark.parametrize(
    ("force", "line"),
    [
        ({"kind": "force", "at": [0, 0, 0], "direction": [1, 0, 0], "values": [[0, 1], [0.05, 1]]},
         "force.f.values: reaches from 0 to 0.05 s, the run from 0 to run.duration = 0.1 s"),
        ({"kind": "force", "at": [0, 0, 0], "direction": [1, 0, 0], "values": [[0.01, 1], [0.5, 1]]},
         "force.f.values: reaches from 0.01 to 0.5 s"),
        ({"kind": "force", "at": [0, 0, 0], "direction": [1, 0, 0], "expression": "1/(t - 0.05)"},
         "force.f.expression: '1/(t - 0.05)' is not a finite number at t = 0.05 s"),
        ({"kind": "force", "interface": "nix", "direction": [1, 0, 0], "expression": "1"},
         "force.f.interface: body 'part' has no load or joint surface 'nix', it has"),
    ],
)  # fmt: skip
def test_what_does_not_fit_a_rigid_body_is_refused(force: dict[str, Any], line: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError) as caught:
        rigid_run(tmp_path, force)
    assert str(caught.value).startswith(line)


@pytest.mark.parametrize(
    ("force", "line"),
    [
        ({"kind": "torque", "direction": [1, 0, 0], "expression": "1"},
         "force.f.body: body 'part' is elastic; a torque acts on rigid bodies"),
        ({"kind": "force", "at": [0, 0, 0], "direction": [1, 0, 0], "expression": "1"},
         "force.f.at: body 'part' is elastic; name an interface of it"),
        ({"kind": "pressure", "interface": "end", "expression": "1"},
         "force.f.interface: 'end' is no interface of kind 'pressure'"),
    ],
)  # fmt: skip
def test_what_does_not_fit_an_elastic_body_is_refused(force: dict[str, Any], line: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError) as caught:
        build(tmp_path, loaded_rod(3), scene(force))
    assert str(caught.value) == line


FORCE = {"kind": "force", "at": [0, 0, 0], "direction": [1, 0, 0]}


@pytest.mark.parametrize(
    ("force", "line"),
    [
        (FORCE, "give one of: table, values, expression"),
        (FORCE | {"values": TABLE, "expression": "1"}, "give one of: table, values, expression"),
        (FORCE | {"values": [[1, 1], [0, 1]]}, "values: at least two rows of rising times are needed"),
        (FORCE | {"expression": "2*x"}, "'x' at character 3 is not allowed"),
        (FORCE | {"expression": "t", "interface": "end"}, "give one of: interface, at"),
        (FORCE | {"expression": "t", "body": "nix"}, "force.f.body: no body 'nix', the scene has part"),
    ],
)
def test_wrong_keys_are_refused(force: dict[str, Any], line: str) -> None:
    with pytest.raises(ValidationError) as caught:
        Scene.model_validate(scene(force))
    assert line in str(caught.value)
