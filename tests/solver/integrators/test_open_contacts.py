"""Contacts that are left out of a step: none of their points may touch, and nothing else may change."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver.integrators.implicit.integrator import Implicit
from gudgeon.solver.integrators.outcome import Samples
from gudgeon.solver.system.system import System
from tests.solver.systems import block_records, build_all, pair_scene, piston_records, piston_scene, plate_records

ROUND_OFF = 1e-9
"""Of the largest coordinate: LCP passes end by a comparison, and contact of many points enlarges what is left."""


def thrown(folder: Path) -> System:
    """The block falls on the plate while it slides, and is thrown back before it is pressed on again."""
    scene = pair_scene(press=2000.0, duration=2e-3)
    scene["body"]["part"] |= {"velocity": [0.5, 10.0, 0.0], "position": [-0.05 - 2e-4, 0, 0]}
    return build_all(folder, {"part": block_records(20), "plate": plate_records()}, scene)


def crossing(folder: Path, **changes: Any) -> System:
    """A piston with clearance, elastic, which the rod throws from side to side."""
    return build_all(folder, {"part": piston_records(6)}, piston_scene(clearance=4e-5, start=-20.0, **changes))


def steps(system: System, dt: float, count: int, near: bool) -> tuple[np.ndarray, np.ndarray, Implicit]:
    """Take steps one by one; coordinates (n, m), which contacts were near (n, k).

    Args:
        near: Whether every contact shall be near in every step.
    """
    run, driving = Implicit(system, dt), system.driving
    if near:
        run.bounds.elastic[:] = 1e30
    widths = len(driving.rows), 2 * len(system.rigid) + len(driving.joints)
    q, flags = np.empty((count, len(run.modes.q))), np.empty((count, len(system.contacts)), bool)
    for number in range(count):
        loads, snapshots = (np.zeros((1, width)) for width in widths)
        out = Samples(np.zeros((1, len(system.contacts), 3)), np.zeros((1, 5)), loads, snapshots, np.zeros((1, 0)))
        assert run.advance(number, 1, out)
        q[number], flags[number] = run.modes.q, run.matrix.candidate
        if not near:
            check_open(run, system)
    return q, flags, run


def check_open(run: Implicit, system: System) -> None:
    """Find the gaps of contacts that were left out from the state itself."""
    points, masters, held = run.points, run.masters, run.loads.residual_force
    deformed = system.residual @ points.residual_force + system.driving.to_gap @ held
    gaps = system.gap + system.rows @ run.modes.q + deformed
    inward = system.functions @ run.modes.q + system.function_residual @ masters.residual_force
    for number, contact in enumerate(system.contacts):
        if run.matrix.candidate[number]:
            continue
        least = gaps[contact.rows].min()
        if contact.master is not None:
            least += inward[contact.functions].min()
        assert least > 0.0
        assert not points.multipliers[contact.rows].any()


@pytest.mark.parametrize("dt", [1e-6, 4e-6, 1.6e-5])
@pytest.mark.parametrize("damping", [None, {"ratio": 0.05, "frequency": 5000.0}])
@pytest.mark.parametrize("case", [thrown, crossing])
def test_what_is_left_out_changes_nothing(tmp_path: Path, case: Any, damping: Any, dt: float) -> None:
    system = case(tmp_path)
    if damping is not None:
        settings = system.scene.model_dump()
        for body in settings["body"].values():
            body["damping"] = damping
        names = {"part": block_records(20), "plate": plate_records()} if case is thrown else {"part": piston_records(6)}
        system = build_all(tmp_path / "damped", names, settings)
    count = min(600, round(2e-3 / dt))
    (found, flags, run), (expected, all_near, _) = (steps(system, dt, count, near) for near in (False, True))
    assert all_near.all()
    assert 0.1 < flags.mean() < 0.95
    assert run.energy.counts[1] > 10
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUND_OFF * np.abs(expected).max())
