"""The micro assembly as it is shipped: an elastic finger pulled down by a field, contact, adhesion, energy."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon import modaldb
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.kinds import run
from tests.validation.scenes import DATA

BUMP = 0.95e-6
"""Way of the peg down to the bump [m]."""


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("assembly")


def solved(db: Path, name: str, **changes: object) -> Trajectory:
    settings = {key.replace("__", "."): value for key, value in changes.items()} | {"run.duration": 8e-6}
    report = run(DATA / "mems-assembly", set=settings, db=db, out=db / name, until="solve")
    assert report.result == "FINISHED", report.reason
    return modaldb.open(db).get(report.stages["solve"].key, "trajectory")


def test_the_peg_lands_on_the_bump_and_stays(db: Path) -> None:
    found = solved(db, "shipped")
    z = found.motion["peg"][:, 2]
    assert z[-1] == pytest.approx(-BUMP, abs=5e-9)
    assert found.energy_drift < 1e-4
    assert found.quantities["bump.impacts"]["value"] >= 1


def test_below_its_pull_in_it_does_not_land(db: Path) -> None:
    """Of F g = π ε R V² and a finger of 3 E I/L³ = 3.2 N/m the static limit is 76 V at a gap of 1 µm; a step of the
    voltage needs less."""
    found = solved(db, "weak", force__attraction__potentials__ball=50.0)
    assert np.abs(found.motion["peg"][:, 2]).max() < 0.5 * BUMP
