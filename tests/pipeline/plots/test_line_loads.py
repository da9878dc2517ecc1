"""Forces that run over a surface: their place and size over time, and what is not drawn."""

from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from gudgeon.pipeline.plots.mechanism.line_loads import draw_line_loads, line_load

ALONG, ACROSS = np.linspace(-0.01, 0.01, 21), np.linspace(-0.002, 0.002, 5)
TIMES = np.linspace(1e-3, 9e-3, 17)
PLACE = np.linspace(-0.006, 0.006, 17)
FORCE = np.linspace(100.0, 300.0, 17)


def drawing(points: np.ndarray, multipliers: np.ndarray, path: Path) -> Any:
    contact = SimpleNamespace(points=points, multipliers=multipliers)
    run = SimpleNamespace(contacts={"flank": contact}, frame_times=TIMES[: len(multipliers)])
    return SimpleNamespace(trajectory=run, file=lambda name: nullcontext(path / name))


def running(direction: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points and forces of a load of 1 mm that runs along a strip, or across it, turned in space."""
    x, y = (one.ravel() for one in np.meshgrid(ALONG, ACROSS))
    own, way = (x, PLACE) if direction == 0 else (y, PLACE / 4)
    weight = np.exp(-0.5 * ((own - way[:, None]) / 5e-4) ** 2)
    forces = FORCE[:, None] * weight / weight.sum(axis=1, keepdims=True)
    turn = np.linalg.qr(np.random.default_rng(3).standard_normal((3, 3)))[0]
    return np.column_stack([x, y, np.zeros_like(x)]) @ turn.T + [1.0, 2.0, 3.0], forces


@pytest.mark.parametrize("direction", [0, 1])
def test_the_integral_is_the_force_and_its_place_runs(direction: int, tmp_path: Path) -> None:
    found = line_load(drawing(*running(direction), tmp_path), "flank")
    assert found is not None
    np.testing.assert_allclose(found.loads @ np.diff(found.edges), FORCE, rtol=1e-12)
    extent = np.ptp(ALONG) if direction == 0 else np.ptp(ACROSS)
    assert np.ptp(found.edges) == pytest.approx(extent, rel=0.01)
    middles = 0.5 * (found.edges[1:] + found.edges[:-1])
    centre = found.loads @ np.diag(np.diff(found.edges)) @ middles / FORCE
    way = PLACE if direction == 0 else PLACE / 4
    # The sign of the direction is free; a bin has a tenth of the extent.
    assert min(np.abs(centre - way).max(), np.abs(centre + way).max()) < 0.1 * extent


def test_what_is_drawn(tmp_path: Path) -> None:
    points, forces = running(0)
    draw_line_loads(drawing(points, forces, tmp_path))
    assert (tmp_path / "line-loads.png").stat().st_size > 10_000


@pytest.mark.parametrize("case", ["no force", "few points", "few frames", "one place"])
def test_what_is_not_drawn(case: str, tmp_path: Path) -> None:
    points, forces = running(0)
    given = {
        "no force": (points, 0 * forces), "few points": (points[:5], forces[:, :5]), "few frames": (points, forces[:2]),
        "one place": (0 * points, forces),
    }  # fmt: skip
    draw_line_loads(drawing(*given[case], tmp_path))
    assert not (tmp_path / "line-loads.png").exists()
