"""What a record says twice: a fault on the way into it is found, whatever it is in."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import RECORD_NOTES, Trajectory
from gudgeon.solver import simulate as module
from gudgeon.solver.results.written import disagreements, unequal
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.system import System
from tests.solver.systems import build_all, rod_records, rod_scene

PROBES = {
    "tip": {"kind": "displacement", "body": "part", "interface": "tip"},
    "push": {"kind": "force", "of": "contact.wall"},
}


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> tuple[System, Trajectory]:
    scene = rod_scene() | {"probe": PROBES}
    scene["run"] = scene["run"] | {"samples": 40, "frames": 8, "checks": False, "integrator": "event"}
    system = build_all(tmp_path_factory.mktemp("rod"), {"part": rod_records(8)}, scene)
    return system, simulate(system)


def contact(run: Trajectory, **changes: Any) -> dict[str, Any]:
    return {"contacts": {"wall": replace(run.contacts["wall"], **changes)}}


def probe(run: Trajectory, name: str) -> dict[str, Any]:
    return {"probes": run.probes | {name: replace(run.probes[name], values=1.001 * run.probes[name].values)}}


FAULTS: dict[str, tuple[Callable[[Trajectory], dict[str, Any]], str]] = {
    "force": (lambda run: contact(run, force=1.001 * run.contacts["wall"].force), "impulse of contact.wall"),
    "impulse": (lambda run: {"quantities": {"wall.impulse": {"value": 1.0, "unit": "N s"}}}, "impulse of contact.wall"),
    "velocities": (lambda run: {"velocities": 1.001 * run.velocities}, "momentum of body.part"),
    "frames": (lambda run: {"frames": 1.001 * run.frames}, "strain energy"),
    "kinetic energy": (lambda run: {"energies": run.energies * [1.001, 1, 1, 1, 1]}, "kinetic energy"),
    "displacement": (lambda run: probe(run, "tip"), "probe.tip"),
    "force probe": (lambda run: probe(run, "push"), "probe.push"),
    "peak": (lambda run: {"peak_times": run.times[:1]}, "peak of contact.wall"),
}  # fmt: skip


def test_a_sound_record_is_alike(ran: tuple[System, Trajectory]) -> None:
    system, run = ran
    assert unequal(system, run) == ""
    assert {name.partition(" ")[0] for name in disagreements(system, run)} >= {
        "impulse", "momentum", "kinetic", "strain", "probe.tip", "probe.push", "peak"}  # fmt: skip
    assert max(disagreements(system, run).values()) < 1e-10


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_found(fault: str, ran: tuple[System, Trajectory]) -> None:
    change, name = FAULTS[fault]
    system, run = ran
    assert name in unequal(system, replace(run, **change(run)))


def test_a_run_that_contradicts_itself_says_so(ran: tuple[System, Trajectory], monkeypatch: pytest.MonkeyPatch) -> None:
    made = module.trajectory_of

    def scaled(*arguments: Any) -> Trajectory:
        run = made(*arguments)
        return replace(run, **contact(run, force=np.asarray(1.001 * run.contacts["wall"].force)))

    monkeypatch.setattr(module, "trajectory_of", scaled)
    note = simulate(ran[0]).counts[RECORD_NOTES]
    assert note.startswith("the record contradicts itself: impulse of contact.wall, relative difference")


def test_frames_at_the_time_of_an_impact_are_not_compared(ran: tuple[System, Trajectory]) -> None:
    """Velocities jump there: a frame has those before or those after it."""
    system, run = ran
    struck = run.impacts["wall"].copy()
    struck[0, :2] = run.frame_times[-1]
    after = replace(run, velocities=-run.velocities, impacts={"wall": struck})
    assert "momentum" in unequal(system, replace(after, impacts=run.impacts))
    assert unequal(system, after) == ""


def test_force_of_a_body_at_rest(tmp_path: Path) -> None:
    """Without contact there is nothing to compare but energies."""
    scene = rod_scene()
    scene["body"]["part"]["velocity"] = [0.0, 0.0, 0.0]
    scene["run"] = scene["run"] | {"samples": 10, "frames": 2, "checks": False, "integrator": "event"}
    system = build_all(tmp_path, {"part": rod_records(8)}, scene)
    assert unequal(system, simulate(system)) == ""
