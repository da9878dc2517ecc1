"""Capacitances against I1 to I4 of scenes/electrostatics, on small meshes; `docs.tools.electrostatic_truths` has more.

I1: Maxwell's and published constants of sphere, disc, square and cube; I2: Love's integral equation; I3: a published
collocation with exact rectangles, to 2e-4; I4: Maxwell's series of images.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.kinds import run
from tests.scenes import scene_path

FOLDER = scene_path("electrostatics")


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("electrostatics")


def found(db: Path, scene: str, **changes: Any) -> tuple[float, float]:
    """Return the relative error of the scene's capacitance and its estimate; `__` in keys stands for a full stop."""
    settings = {key.replace("__", "."): value for key, value in changes.items()}
    report = run(FOLDER / f"{scene}.toml", set=settings, db=db, out=db / scene, until="solve")
    (error,) = (one["error"] for one in report.quantities.values() if one["reference"] is not None)
    return error, sum(report.estimates.values())


@pytest.mark.validation
def test_cube(db: Path) -> None:
    error, estimate = found(db, "cube")
    assert abs(error) < 1e-4
    assert abs(error) < estimate


def test_square_plate(db: Path) -> None:
    error, estimate = found(db, "square-plate", panels__strips=4)
    assert abs(error) < 1e-4
    assert abs(error) < estimate


@pytest.mark.validation
def test_discs(db: Path) -> None:
    error, estimate = found(db, "scene")
    assert abs(error) < 5e-4
    assert abs(error) < estimate


@pytest.mark.validation
def test_squares(db: Path) -> None:
    """The reference itself is known to 2e-4."""
    error, _ = found(db, "squares", panels__strips=3)
    assert abs(error) < 5e-4


def test_sphere_over_a_plane(db: Path) -> None:
    error, estimate = found(db, "sphere-plane", conductor__ball__mesh__size=5e-4)
    assert abs(error) < 1e-5
    assert abs(error) < estimate


@pytest.mark.validation
def test_a_sheet_converges_with_the_third_power_of_its_strips(db: Path) -> None:
    """Panels of uniform density on a mesh graded so that the edge does not spoil their order: 3, in C."""
    strips = np.array([1, 2, 3, 4])
    size = "conductor__plate__mesh__size"
    errors = [found(db, "square-plate", panels__strips=int(m), **{size: 0.9 / m})[0] for m in strips]
    order = -np.polyfit(np.log(strips), np.log(np.abs(errors)), 1)[0]
    print(errors, order)
    assert order == pytest.approx(3.0, abs=0.5)
    assert all(error < 0 for error in errors)  # Charges of Galerkin's method have less than the true capacitance.
