"""Damping of bodies in each of its forms: free decay of single coordinates against the closed form, and the energy."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver.errors import SceneError
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.bases.nested import nested
from gudgeon.solver.system.system import System
from tests.solver.systems import block_records, block_scene, build

FAR: dict[str, Any] = {"shape": "plane", "point": [1.0, 0, 0], "normal": [-1, 0, 0]}
MODES = 4
HERTZ = np.sort(block_records(5, mode_count=MODES)[0].angular_frequencies) / (2 * np.pi)
ROUND_OFF = 1e-9
FORMS: dict[str, tuple[dict[str, Any], np.ndarray]] = {
    "one ratio": ({"ratio": 0.03}, np.full(MODES, 0.03)),
    "a list": ({"ratios": [0.01, 0.02, 0.05, 0.3, 0.9]}, np.array([0.01, 0.02, 0.05, 0.3])),
    "a table": (
        {"values": [[HERTZ[0] / 2, 0.0], [2 * HERTZ[-1], 0.2]]},
        np.interp(HERTZ, [HERTZ[0] / 2, 2 * HERTZ[-1]], [0.0, 0.2]),
    ),
    "Rayleigh": ({"alpha": 300.0, "beta": 1e-6}, 150.0 / (2 * np.pi * HERTZ) + 0.5e-6 * 2 * np.pi * HERTZ),
    "alpha": ({"alpha": 300.0}, 150.0 / (2 * np.pi * HERTZ)),
    "beta": ({"beta": 1e-6}, 0.5e-6 * 2 * np.pi * HERTZ),
    "a ratio at a frequency": ({"ratio": 0.05, "frequency": 5000.0}, 0.05 * HERTZ / 5000.0),
}


def system_of(folder: Path, damping: dict[str, Any] | None, **scene: Any) -> System:
    tables = block_scene(**({"duration": 2e-3, "against": FAR} | scene))
    tables["body"]["part"]["damping"] = damping
    return build(folder, block_records(5, mode_count=MODES), tables)


@pytest.mark.parametrize("form", FORMS)
def test_free_decay(form: str, tmp_path: Path) -> None:
    """Every elastic coordinate begins with unit velocity; q = exp(−ζωt) sin(ω' t)/ω'. Rigid ones keep theirs."""
    damping, zeta = FORMS[form]
    system = system_of(tmp_path, damping)
    elastic, omega = system.stiffness > 0, 2 * np.pi * HERTZ
    speed = np.ones(len(elastic))
    run = simulate(replace(system, velocity=speed))
    turn, t = omega * np.sqrt(1 - zeta**2), run.frame_times[:, None]
    exact = np.exp(-zeta * omega * t) * np.sin(turn * t) / turn
    np.testing.assert_allclose(run.frames[:, elastic], exact, atol=ROUND_OFF / omega.min())
    np.testing.assert_allclose(run.frames[:, ~elastic], np.repeat(t, (~elastic).sum(), axis=1), rtol=1e-10)
    np.testing.assert_allclose(run.energies.sum(axis=1), 0.5 * len(elastic), rtol=ROUND_OFF)
    lost = 0.5 * (MODES - (run.velocities[-1, elastic] ** 2 + (omega * run.frames[-1, elastic]) ** 2).sum())
    assert run.energies[-1, 3] == pytest.approx(lost, rel=1e-8)


def test_the_residual_flexibility_has_the_share_that_is_proportional_to_stiffness(tmp_path: Path) -> None:
    highest = 2 * np.pi * HERTZ[-1]
    expected = {
        "one ratio": 2 * 0.03 / highest, "a list": 2 * 0.3 / highest, "Rayleigh": 1e-6, "alpha": 0.0, "beta": 1e-6,
        "a table": 2 * FORMS["a table"][1][-1] / highest, "a ratio at a frequency": 0.05 / (np.pi * 5000.0),
    }  # fmt: skip
    for name, beta in expected.items():
        body = system_of(tmp_path / name, FORMS[name][0]).bodies["part"]
        assert body.stiffness_factor == pytest.approx(beta, rel=1e-14), name
    fewer = nested(system_of(tmp_path / "nested", {"ratios": [0.01, 0.02, 0.05, 0.3]}), 0.5)
    assert fewer is not None
    assert fewer.bodies["part"].stiffness_factor == pytest.approx(2 * 0.02 / (2 * np.pi * HERTZ[1]), rel=1e-14)
    bare = block_scene(against=FAR)
    bare["body"]["part"]["damping"] = {"ratio": 0.1}
    assert build(tmp_path / "bare", block_records(2, mode_count=0), bare).bodies["part"].stiffness_factor == 0.0


@pytest.mark.parametrize("form", FORMS)
def test_energy_closes_through_an_impact(form: str, tmp_path: Path) -> None:
    """The damped residual flexibility has jumps of force at closings: the drift falls with the step."""
    near = {"shape": "plane", "point": [0.05001, 0, 0], "normal": [-1, 0, 0]}
    system, drifts = system_of(tmp_path, FORMS[form][0], against=near, duration=4e-4), []
    for step in (2e-7, 2.5e-8):
        run = system.scene.run.model_copy(update={"integrator": "small", "step": step, "checks": False})
        found = simulate(replace(system, scene=system.scene.model_copy(update={"run": run})))
        assert found.contacts["wall"].force.any()
        drifts.append(found.energy_drift)
    assert drifts[1] < max(0.3 * drifts[0], 1e-5)
    assert drifts[1] < 2e-3


def test_a_form_that_gives_the_same_ratio_gives_the_same_numbers(tmp_path: Path) -> None:
    beta = 0.05 / (np.pi * 5000.0)
    one = system_of(tmp_path / "a", {"ratio": 0.05, "frequency": 5000.0})
    other = system_of(tmp_path / "b", {"beta": beta})
    np.testing.assert_array_equal(one.damping, other.damping)
    np.testing.assert_array_equal(one.damping, np.append(np.zeros(6), beta * (2 * np.pi * HERTZ) ** 2) * 1.0)


@pytest.mark.parametrize(
    ("damping", "line"),
    [
        ({"ratios": [0.1, 0.2]}, "body.part.damping.ratios: 2 given, the body has 4 elastic coordinates; one for each"),
        (
            {"values": [[100.0, 0.1], [5000.0, 0.1]]},
            "body.part.damping.values: reaches from 100 to 5000 Hz, the elastic",
        ),
    ],
)
def test_tables_that_end_early_are_refused(damping: dict[str, Any], line: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError) as caught:
        system_of(tmp_path, damping)
    assert str(caught.value).startswith(line)
