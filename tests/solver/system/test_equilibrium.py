"""The start of a run: static equilibrium of held bodies with gravity and contact."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import ModalRecord, MorphRecord
from gudgeon.solver.contact.rows import touching_depth
from gudgeon.solver.errors import SceneError
from gudgeon.solver.ports.rest import at_rest
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.system import System
from tests.solver.systems import block_records, build, build_all, rigid_records

WEIGHT = 200.0
"""Gravity [m/s²] that presses the block on its wall."""
ROUND_OFF = 1e-9
"""Of energies and forces, relative to those of the equilibrium; Newton's method and the integrators reach it."""
INTEGRATORS: dict[str, dict[str, Any]] = {
    "event": {"method": "residual"},
    "small": {"method": "residual", "surface_stiffness": 1e13},
    "small, law": {"method": "penalty", "law": {"kind": "hertz", "stiffness": 1e9}},
}


def held(point_count: int = 3) -> tuple[ModalRecord, MorphRecord]:
    """The block of `block_records` on supports, each mode with a share of its weight."""
    modal, morph = block_records(point_count)
    none, rng = np.zeros((0, 6)), np.random.default_rng(2)
    weight = rng.uniform(0.2, 0.5, (3, len(modal.angular_frequencies)))
    # Gravity along +x bends every mode towards the wall at the first point.
    weight[0] = -np.abs(weight[0]) * np.sign(-modal.interfaces["face"].rows[0])
    return replace(modal, rigid_twists=none, participation=weight), replace(morph, rigid_twists=none)


def scene(gap: float, contact: dict[str, Any], **run: Any) -> dict[str, Any]:
    wall = {"shape": "plane", "point": [0.05 + gap, 0, 0], "normal": [-1, 0, 0]}
    return {
        "body": {"part": {}},
        "contact": {"wall": {"body": "part", "interface": "face", "against": wall} | contact},
        "run": {"duration": 1e-3, "gravity": [WEIGHT, 0, 0], "samples": 100, "frames": 10} | run,
    }


def final_gaps(system: System) -> np.ndarray:
    """Return gaps with R, at the start [m], (c,)."""
    return system.gap + system.rows @ system.position + system.residual @ system.start_forces


def test_the_start_is_in_equilibrium_with_contact(tmp_path: Path) -> None:
    system = build(tmp_path, held(6), scene(1e-8, {}))
    forces, gaps = system.start_forces, final_gaps(system)
    assert 0 < (forces > 0).sum() < len(forces)
    size = float(np.abs(system.rows @ (system.driving.gravity / system.stiffness)).max())
    np.testing.assert_allclose(gaps[forces > 0], 0.0, atol=1e-12 * size)
    assert gaps.min() > -1e-12 * size
    unbalanced = system.stiffness * system.position - system.driving.gravity - system.rows.T @ forces
    assert np.abs(unbalanced).max() < 1e-12 * np.abs(system.driving.gravity).max()


def test_a_law_is_indented_by_its_force(tmp_path: Path) -> None:
    contact = {"law": {"kind": "hertz", "stiffness": 1e9}}
    system = build(tmp_path, held(4), scene(0.0, contact))
    forces, gaps = system.start_forces, final_gaps(system)
    assert (forces > 0).any()
    stiffness = system.law[:, 0]
    assert stiffness.sum() == pytest.approx(1e9, rel=1e-12)
    np.testing.assert_allclose(forces, stiffness * np.maximum(-gaps, 0.0) ** 1.5, rtol=1e-9, atol=1e-12 * forces.max())


@pytest.mark.parametrize("name", sorted(INTEGRATORS))
@pytest.mark.parametrize("points", [1, 3])
def test_a_run_from_rest_stays_at_rest(name: str, points: int, tmp_path: Path) -> None:
    run = {"integrator": name.partition(",")[0], "checks": False}
    system = build(tmp_path, held(points), scene(1e-9, INTEGRATORS[name], **run))
    assert system.start_forces.max() > 0
    found = simulate(system)
    assert found.result == "FINISHED"
    start = 0.5 * float(system.stiffness @ system.position**2) + system.start_contact_energy
    total = found.energies[:, :4].sum(axis=1) - found.energies[:, 4]
    np.testing.assert_allclose(total, start, rtol=ROUND_OFF)
    assert found.energies[:, 0].max() < ROUND_OFF * start
    pressed = float(np.linalg.norm(system.start_forces @ system.directions))
    np.testing.assert_allclose(np.linalg.norm(found.contacts["wall"].force, axis=1), pressed, rtol=1e-6)


def test_undeformed_starts_without_deformation(tmp_path: Path) -> None:
    system = build(tmp_path, held(), scene(1e-9, {}, start="undeformed"))
    assert not system.position.any()
    assert not system.start_forces.any()
    assert simulate(system).energies[:, 0].max() > 0


def test_the_overlap_check_sees_the_deformed_shape(tmp_path: Path) -> None:
    """A free body stands where the loads press a held one: it has no equilibrium there."""
    plate, modes = held(1), rigid_records(1.0, {"face": ((0.0, 0, 0), (-1, 0, 0))}, axes=(0,))
    pair = {"shape": "body", "body": "ball", "interface": "face"}
    place = plate[1].points["face"][0]
    scene_ = {
        "body": {"part": {}, "ball": {"position": place.tolist()}},
        "contact": {"pair": {"body": "part", "interface": "face", "against": pair, "surface_stiffness": 1e14}},
        "run": {"duration": 1e-5, "gravity": [WEIGHT, 0, 0]},
    }
    with pytest.raises(SceneError, match=r"contact.pair: 1 of 1 points start inside .* deformed by the loads"):
        at_rest(build_all(tmp_path / "pressed", {"part": plate, "ball": modes}, scene_))
    # Overlap beyond round-off of the places is refused at every scale; less is none.
    sag = float(abs(build(tmp_path / "alone", plate, scene(1.0, {})).position @ plate[0].interfaces["face"].rows[0]))
    least = touching_depth(place[None])
    for name, depth in (("touching", 0.5 * least), ("inside", 10 * least)):
        scene_["body"]["ball"]["position"] = (place + (sag - depth) * np.array([1.0, 0, 0])).tolist()
        if name == "touching":
            at_rest(build_all(tmp_path / name, {"part": plate, "ball": modes}, scene_))
        else:
            with pytest.raises(SceneError, match="deformed by the loads"):
                at_rest(build_all(tmp_path / name, {"part": plate, "ball": modes}, scene_))
    scene_["body"]["ball"]["position"] = place.tolist()
    scene_["run"]["start"] = "undeformed"
    assert not build_all(tmp_path / "undeformed", {"part": plate, "ball": modes}, scene_).position.any()


def test_an_undeformed_shape_may_overlap_where_the_loads_clear_it(tmp_path: Path) -> None:
    """Gravity bends the block away by more than it reaches into the wall; without gravity it is refused."""
    records, away = held(1), {"gravity": [-WEIGHT, 0, 0]}
    system = build(tmp_path / "cleared", records, scene(-2e-9, {}, **away))
    assert final_gaps(system).min() > 0
    with pytest.raises(SceneError, match="1 of 1 points start inside"):
        build(tmp_path / "undeformed", records, scene(-2e-9, {}, start="undeformed", **away))
