"""Coefficients of friction up to which contact forces are unique, and the frequency of points that friction holds."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import FRICTION_NOTES
from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.steps import plan_run
from gudgeon.solver.ports.members import ports_of
from gudgeon.solver.ports.stick import stick_frequency
from gudgeon.solver.ports.uniqueness import SHARE, FrictionLimit, friction_limits
from gudgeon.solver.simulate import simulate
from gudgeon.solver.simulation import Steps
from gudgeon.solver.system.system import System
from tests.solver.systems import block_records, build, with_tangential_rows

POINTS = 5


def thrown(folder: Path, friction: float, **run: Any) -> System:
    """Return an elastic block thrown at a wall."""
    modal, morph = block_records(POINTS)
    wall = {"shape": "plane", "point": [0.0501, 0, 0], "normal": [-1, 0, 0]}
    scene = {
        "body": {"part": {"velocity": [0.2, 0.1, 0.0]}},
        "contact": {
            "wall": {"body": "part", "interface": "face", "against": wall, "friction": {"static": friction}}
        },
        "run": {"duration": 1e-5, "integrator": "small", "checks": False} | run,
    }  # fmt: skip
    return build(folder, (with_tangential_rows(modal, "face"), morph), scene)


def limit(folder: Path) -> FrictionLimit:
    (found,) = friction_limits(thrown(folder, 0.1))
    return found


def flexibility(folder: Path) -> np.ndarray:
    """Return W by point and direction, (c, 3, c, 3)."""
    return ports_of(thrown(folder, 0.1)).residual.dense().reshape(POINTS, 3, POINTS, 3)


def test_the_limits_are_those_of_the_matrix(tmp_path: Path) -> None:
    found, W = limit(tmp_path), flexibility(tmp_path)
    ratios = [W[c, 0, c, 0] / np.hypot(W[c, 0, c, 1], W[c, 0, c, 2]) for c in range(POINTS)]
    assert found.single == pytest.approx(min(ratios), rel=1e-12)
    least = []
    for angle in np.pi / 8 * np.arange(16):
        mixed = np.cos(angle) * W[:, 0, :, 1] + np.sin(angle) * W[:, 0, :, 2]
        half = 0.5 * (mixed + mixed.T)
        least.append([np.linalg.eigvalsh(W[:, 0, :, 0] - share * found.unique * half)[0] for share in (0.999, 1.001)])
    below, above = np.min(least, axis=0)
    assert below > 0 > above


def test_a_coefficient_of_an_ambiguous_point_is_refused(tmp_path: Path) -> None:
    most = SHARE * limit(tmp_path / "limit").single
    above = thrown(tmp_path / "above", 1.001 * most)
    line = rf"^contact\.wall\.friction\.static: {1.001 * most:g} given; .* allowed: up to {most:.3g}$"
    with pytest.raises(SceneError, match=line):
        simulate(above)
    with pytest.raises(SceneError, match=line):
        Steps(above)
    assert simulate(thrown(tmp_path / "below", 0.999 * most)).result == "FINISHED"


def test_a_coefficient_beyond_definiteness_is_noted(tmp_path: Path) -> None:
    found = limit(tmp_path / "limit")
    assert found.unique < SHARE * found.single
    above, below = (simulate(thrown(tmp_path / str(share), share * found.unique)) for share in (1.01, 0.99))
    assert FRICTION_NOTES not in below.counts
    note = above.counts[FRICTION_NOTES]
    assert note.startswith("contact.wall.friction: above a coefficient of")
    assert "\n" not in note


def test_the_step_resolves_points_that_friction_holds(tmp_path: Path) -> None:
    system = thrown(tmp_path, 0.1)
    ports = ports_of(system)
    stiffness = np.diag(system.stiffness) + ports.rows.T @ np.linalg.solve(ports.residual.dense(), ports.rows.dense())
    exact = float(np.sqrt(np.linalg.eigvalsh(stiffness)[-1]))
    assert stick_frequency(system) == pytest.approx(exact, rel=1e-6)
    assert exact > 1.2 * system.critical_frequency()
    plan = plan_run(system)
    assert plan.critical == pytest.approx(min(exact, 30 * np.sqrt(system.stiffness.max())), rel=1e-6)
    given = plan_run(thrown(tmp_path / "given", 0.1, step=10 / plan.critical))
    assert given.schedule.substeps == 3
