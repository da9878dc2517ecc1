"""Contact of turning bodies with planes and bores of the ground by residual flexibility and layers: conservation, small
motion, closed forms."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import InterfaceModes, ModalRecord, MorphRecord
from gudgeon.modaldb.records.tangents import tangents
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.simulate import simulate
from tests.solver.integrators.turning.flexible_scenes import WIDE, cloud
from tests.solver.systems import build_all

FLOOR = {"shape": "plane", "point": [0.0, 0.0, 0.0], "normal": [0.0, 0.0, 1.0]}
BORE = {"shape": "bore", "radius": 0.15, "axis": [0.0, 1.0, 0.0], "origin": [0.0, 0.0, 0.15]}
FEET = [[-0.06, 0.02, -0.1], [0.03, 0.05, -0.1], [0.05, -0.04, -0.1]]


def soft(frequencies: list[float], points: list[list[float]] = FEET, seed: int = 1) -> tuple[ModalRecord, MorphRecord]:
    """Return records of point masses with any rows and any R, normal and tangential, of contact points `foot`."""
    modal, morph = cloud(np.array(frequencies), seed=seed)
    rng, m, c = np.random.default_rng(seed), len(frequencies), len(points)
    normals = np.tile([0.0, 0.0, -1.0], (c, 1))
    foot = InterfaceModes(
        np.arange(c), np.array(points), normals, np.full(c, 1e-4), np.zeros(c, bool), 0.3 * rng.standard_normal((c, m)),
        tangents(normals), 0.3 * rng.standard_normal((c, 2, m)),
    )  # fmt: skip
    root, R = rng.standard_normal((3 * c, 3 * c)), np.zeros((6 + 3 * c,) * 2)
    R[6:, 6:] = 1e-7 * (root @ root.T / c + 0.2 * np.eye(3 * c))
    modal = replace(
        modal, interfaces={"foot": foot}, interface_rows={"pin": [0, 6], "foot": [6, 6 + c]}, residual_flexibility=R,
        tangential_spans={"foot": [6 + c, 6 + 3 * c]},
    )  # fmt: skip
    return modal, replace(morph, points={"foot": np.array(points)})


def struck(
    folder: Path, records: tuple[ModalRecord, MorphRecord], body: dict[str, Any], contact: dict[str, Any], **run: Any
) -> Trajectory:
    """Return the finished run of a part that meets the ground."""
    touch = {"body": "part", "interface": "foot", "against": FLOOR} | contact
    given = {"integrator": "turning", "samples": 20, "frames": 2, "limits": WIDE} | run
    scene = {"body": {"part": body}, "contact": {"touch": touch}, "run": given}
    found = simulate(build_all(folder, {"part": records}, scene))
    assert found.result == "FINISHED", (found.counts, found.energy_drift)
    return found


TUMBLING = {"position": [0.01, 0.0, 0.115], "velocity": [3.0, 0.5, -2.0], "angular_velocity": [3.0, 20.0, 40.0]}


@pytest.mark.parametrize("against", [FLOOR, BORE], ids=["plane", "bore"])
@pytest.mark.parametrize("layer", [{}, {"surface_stiffness": 1e10}], ids=["bare", "layer"])
def test_a_part_that_tumbles_keeps_energy(against: dict[str, Any], layer: dict[str, Any], tmp_path: Path) -> None:
    """Any rows and R: as it turns on its points R acts along another direction, whose energy it gives back."""
    found = struck(tmp_path, soft([300.0, 700.0]), TUMBLING, {"against": against} | layer, duration=0.02)
    assert found.quantities["touch.impulse"]["value"] > 0.1
    assert found.energy_drift < 1e-8
    assert found.momentum_residual < 1e-10
