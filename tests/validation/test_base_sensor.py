"""The spoked plates of data/base-sensor under unit wrenches against reference J1."""

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.kinds import kind_of, open_job
from gudgeon.pipeline.linear.analysis import Asked
from tests.validation.scenes import DATA, reference

EXPECTED = reference("base-sensor/J1_spoked_plate.json")
ORDER = [f"{side}{spoke}" for spoke in range(4) for side in ("top", "side")]
"""Gauges in the rows of the reference."""


def quiet(*told: Any) -> None:
    """Take progress and say nothing."""


def per_wrench(scene: str, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return strains of the gauges (8, 6) and motions of the hub (6, 6) per unit wrench, from linear-static.csv."""
    job = open_job(DATA / "base-sensor" / scene, db=folder / "db", out=folder / "out")
    kind_of(job).linear(job, Asked(static=True), quiet)
    rows = list(csv.reader((folder / "out" / "linear-static.csv").read_text().splitlines()))
    assert rows[0][2:] == [f"per force.wrench {c} [1/({'N' if c[0] == 'F' else 'N m'})]"
                           for c in ("Fx", "Fy", "Fz", "Mx", "My", "Mz")]  # fmt: skip
    found = {row[0]: np.array(row[2:], float) for row in rows[1:]}
    strains = np.array([found[f"gauge.plate.{name}"] for name in ORDER])
    return strains, np.array([found[f"force.wrench[{n}]"] for n in range(1, 7)])


def within(found: np.ndarray, expected: np.ndarray, share: float) -> None:
    """Compare each column with a share of its largest value."""
    np.testing.assert_array_less(np.abs(found - expected) / np.abs(expected).max(axis=0), share)


def test_spokes_as_beams(tmp_path: Path) -> None:
    """Asked: 1 %; cubic elements are exact under forces at their nodes, so that round-off is left."""
    strains, motions = per_wrench("plate-beams.toml", tmp_path)
    within(strains, np.array(EXPECTED["strain_per_wrench_8x6_euler_bernoulli"]), 1e-9)
    stiffness = np.linalg.inv(motions)
    np.testing.assert_allclose(np.diag(stiffness), np.diag(EXPECTED["hub_stiffness_6x6_euler_bernoulli"]), rtol=1e-9)
    np.testing.assert_allclose(motions, motions.T, atol=1e-12 * np.abs(motions).max())


def test_spokes_as_a_solid(tmp_path: Path) -> None:
    """Asked: 1 % of the strains; the reference is sure to 0.4 %. The hub's stiffness by its own tolerance, 1 %."""
    strains, motions = per_wrench("plate.toml", tmp_path)
    expected = np.array(EXPECTED["strain_per_wrench_8x6_solid3D"])
    within(strains, expected, 0.01)
    large = np.abs(expected) > 0.02 * np.abs(expected).max(axis=0)
    assert strains[large] == pytest.approx(expected[large], rel=0.01)
    stiffness = np.diag(np.linalg.inv(motions))
    assert stiffness == pytest.approx(np.diag(EXPECTED["hub_stiffness_6x6_solid3D"]), rel=0.01)
