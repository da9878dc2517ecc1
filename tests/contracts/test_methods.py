"""Every contact method: action is reaction, nothing pulls, energy is lost or kept, and contradictions are refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.capabilities import INTEGRATORS, Feature
from gudgeon.solver.methods import METHODS
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from tests.solver.systems import MASS, SPEED, build_all, rigid_records, rod_records

KEYS: dict[str, dict[str, Any]] = {
    "residual": {},
    "penalty": {"law": {"kind": "linear", "stiffness": 3e8, "damping": 500.0}},
    "constraint": {},
    "impact": {"restitution": 0.6},
}
WRONG: dict[str, dict[str, Any]] = {
    "surface_stiffness": {"surface_stiffness": 1e12},
    "law": {"law": {"kind": "hertz", "stiffness": 1e9}},
    "restitution": {"restitution": 0.5},
    "friction": {"friction": {"static": 0.3, "direction": [0, 1, 0]}},
    "dashpot": {"dashpot": "wave-guide"},
}
ALLOWED = {
    "residual": {"surface_stiffness", "law", "dashpot", "friction"},
    "penalty": {"friction"},
    "constraint": {"friction"},
    "impact": {"restitution", "friction"},
}
"""Keys that a method takes beside its own; penalty has its law already."""


def scene(method: str, **more: Any) -> dict[str, Any]:
    contact = {"body": "rod", "interface": "tip", "against": {"shape": "body", "body": "ball", "interface": "face"}}
    return {
        "body": {"rod": {"velocity": [1.0, 0, 0]}, "ball": {"position": [1.0001, 0, 0]}},
        "contact": {"pair": contact | {"method": method} | KEYS[method] | more},
        "run": {"duration": 2e-3, "integrator": "event", "samples": 400, "frames": 20},
    }


def solved(folder: Path, method: str) -> Trajectory:
    ball = rigid_records(3.0, {"face": ([0, 0, 0], [-1.0, 0, 0])}, axes=(0,))
    return simulate(build_all(folder, {"rod": rod_records(12), "ball": ball}, scene(method)))


def test_every_member_has_a_case() -> None:
    assert set(KEYS) == set(ALLOWED) == set(METHODS)


@pytest.mark.parametrize("method", sorted(METHODS))
def test_action_is_reaction(method: str, tmp_path: Path) -> None:
    found = solved(tmp_path, method)
    assert found.result == "FINISHED"
    before, after = MASS * 1.0, MASS * found.motion["rod"][-1, 6] + 3.0 * found.motion["ball"][-1, 6]
    assert after == pytest.approx(before, rel=1e-12)
    assert found.momentum_residual < 1e-12


@pytest.mark.parametrize("method", sorted(METHODS))
def test_nothing_pulls_and_nothing_overlaps(method: str, tmp_path: Path) -> None:
    found = solved(tmp_path, method)
    pushed = -found.contacts["pair"].force[:, 0]
    # A held gap may pull for less than the kept frequencies resolve: half the shortest period of twelve modes.
    allowed = 0.5 * pushed.max() * 2 / (12 * SPEED) if METHODS[method].rigid else 1e-9 * pushed.max()
    assert -pushed[pushed < 0].sum() * (found.times[1] - found.times[0]) <= allowed
    assert pushed.sum() > 0


@pytest.mark.parametrize("method", sorted(METHODS))
def test_energy_is_lost_or_kept(method: str, tmp_path: Path) -> None:
    found = solved(tmp_path, method)
    lost = found.energies[:, 3]
    assert np.diff(lost).min() >= -1e-12 * found.energies[0, 0]
    assert (lost[-1] > 0) == (method != "residual")
    assert found.energy_drift < 1e-10


@pytest.mark.parametrize("method", sorted(METHODS))
def test_contradicting_keys_are_refused(method: str) -> None:
    for name, keys in WRONG.items():
        if name in ALLOWED[method] or (method == "penalty" and name == "law"):
            continue
        with pytest.raises(ValidationError):
            Scene.model_validate(scene(method, **keys))


@pytest.mark.parametrize("method", sorted(METHODS))
def test_integrators_that_cannot_carry_it_are_refused(method: str) -> None:
    asked = Feature.RIGID_CONTACT if METHODS[method].rigid else Feature.COMPLIANT_CONTACT
    if "law" in KEYS[method]:
        asked = Feature.LINEAR_LAW
    for name, integrator in INTEGRATORS.items():
        settings = scene(method)
        settings["run"]["integrator"] = name
        if {asked, Feature.TWO_BODIES} <= integrator.carries:
            Scene.model_validate(settings)
        else:
            with pytest.raises(ValidationError, match=f"run.integrator: '{name}' does not support"):
                Scene.model_validate(settings)
