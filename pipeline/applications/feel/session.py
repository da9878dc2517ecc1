"""A session of `gudgeon feel`: a scene, a device, the loop, and what is told of it."""

import asyncio
import json
import threading
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.modaldb.records.field import FieldRecord, PoseGridRecord
from gudgeon.pipeline.applications.feel.coupling import Coupling, Felt, Scales
from gudgeon.pipeline.applications.feel.device import Browser, Device, Scripted
from gudgeon.pipeline.applications.feel.loop import Timing, run_loop, run_script, urgent
from gudgeon.pipeline.applications.feel.tool import Tool, tool_of, unfelt
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import csv_text, write_text
from gudgeon.pipeline.geometry.profile import read_rows
from gudgeon.pipeline.stages.job import Job
from gudgeon.solver.forces.fields.electrostatic import Electrostatic

REACH = 0.05
"""Way of the handle over the largest way of the tool, by default [m]."""
HISTORY, REPORT = "feel.csv", "feel.json"
COLUMNS = ("time [s]", "x [m]", "y [m]", "z [m]", "rx [rad]", "ry [rad]", "rz [rad]", "force x [N]", "force y [N]",
           "force z [N]", "torque x [N m]", "torque y [N m]", "torque z [N m]", "truth x [N]", "truth y [N]",
           "truth z [N]", "reserve [J]", "state")  # fmt: skip


@dataclass(frozen=True)
class Asked:
    """What a session is started with."""

    body: str | None = None
    force_scale: float = 1e6
    length_scale: float | None = None
    """Default: the tool's largest way becomes `REACH`."""
    rate: float = 1000.0
    """Ticks per second [Hz]."""
    seconds: float | None = None
    script: Path | None = None
    """CSV of times [s] and poses of the handle [m, deg]; None: the browser page."""
    device_rate: float = 1000.0
    delay: float = 0.0
    port: int = 0
    at_once: bool = False
    """Whether a script runs as fast as the machine can, not in real time."""


def check_asked(request: Asked) -> None:
    """Raise an InputError for numbers outside of their ranges."""
    ranges = {
        "--force-scale": (request.force_scale, 1e-12, 1e15), "--length-scale": (request.length_scale, 1e-12, 1e15),
        "--rate": (request.rate, 10.0, 5000.0), "--device-rate": (request.device_rate, 10.0, 5000.0),
        "--delay": (request.delay, 0.0, 1.0), "--seconds": (request.seconds, 1e-3, 1e6),
    }  # fmt: skip
    for name, (value, low, high) in ranges.items():
        if value is not None and not low <= value <= high:
            raise InputError(f"feel: {name} {value:g} given; allowed: {low:g} to {high:g}")


def scripted(path: Path, rate: float, delay: float) -> tuple[Scripted, float]:
    """Return a device that follows the rows of a table, linear between them, and the last time [s].

    Raises:
        InputError: it cannot be read, or times do not ascend from 0.
    """
    cells = read_rows(path, "times [s] and poses of the handle")
    start = 0 if cells and all(_is_number(c) for c in cells[0]) else 1
    try:
        rows = np.array(cells[start:], float)
    except ValueError as error:
        raise InputError(f"{path}: {error}; needed: rows of numbers of one length") from None
    if rows.ndim != 2 or rows.shape[1] not in (4, 7) or len(rows) < 2:
        raise InputError(f"{path}: needed: two rows or more of time [s], x, y, z [m], and rx, ry, rz [deg] or none")
    times, poses = rows[:, 0], np.zeros((len(rows), 6))
    poses[:, : rows.shape[1] - 1] = rows[:, 1:]
    poses[:, 3:] = np.radians(poses[:, 3:])
    if times[0] != 0 or not (np.diff(times) > 0).all():
        raise InputError(f"{path}: times [s] in the first column must ascend from 0")

    marks = times.tolist()

    def script(time: float) -> np.ndarray:
        row = min(max(bisect_right(marks, time) - 1, 0), len(marks) - 2)
        fraction = min(max((time - marks[row]) / (marks[row + 1] - marks[row]), 0.0), 1.0)
        return poses[row] + fraction * (poses[row + 1] - poses[row])

    return Scripted(script, rate=rate, delay=delay), float(times[-1])


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def feel(job: Job, request: Asked, say: Callable[[str], None]) -> dict[str, Any]:
    """Run a session of a scene whose records are in the database, and return its report.

    Raises:
        InputError: the scene has no tool, a script is wrong, or the port is taken.
    """
    check_asked(request)
    tool = tool_of(job, request.body)
    scales = Scales(request.force_scale, request.length_scale or REACH / tool.extent)
    if request.script is None:
        return _in_browser(job, tool, scales, request, say)
    device, duration = scripted(request.script, request.device_rate, request.delay)
    seconds = request.seconds or duration
    coupling = Coupling(tool, device, scales, 1 / request.rate)
    if request.at_once:
        ticks, timing = run_script(coupling, seconds), None
    else:
        ticks = list[tuple[float, Felt]]()
        timing = run_loop(coupling, seconds, on_tick=lambda time, felt: ticks.append((time, felt)))
    write_text(job.out / HISTORY, _table(ticks, device))
    return _report(job, tool, coupling, timing, ticks)


def _in_browser(job: Job, tool: Tool, scales: Scales, request: Asked, say: Callable[[str], None]) -> dict[str, Any]:
    try:
        from gudgeon.pipeline.applications.feel.server import Server
    except ModuleNotFoundError as error:
        raise InputError(f"feel: {error.name} is not installed; pip install 'gudgeon[service]'") from error
    device, stop = Browser(), threading.Event()
    coupling = Coupling(tool, device, scales, 1 / request.rate)
    latest: list[Felt] = []
    timing = Timing(coupling.period)

    def told(time: float, felt: Felt) -> None:
        latest[:] = [felt]

    def run() -> None:
        try:
            device.begin()
            result = run_loop(coupling, request.seconds, stop=stop, on_tick=told, timing=timing)
            assert result is timing
        finally:
            stop.set()

    def state() -> dict[str, Any]:
        felt = latest[0] if latest else None
        begun = timing.begun[-200:]
        period = 1e3 * float(np.median(np.diff(begun))) if len(begun) > 1 else 0.0
        return {
            "state": "silent" if felt is None else felt.state,
            "tool": [0.0] * 6 if felt is None else felt.tool.tolist(), "period": period, "missed": timing.missed,
            "truth": None if felt is None or not np.isfinite(felt.truth).all() else felt.truth.tolist(),
            "reserve": 0.0 if felt is None else float(felt.reserve),
        }  # fmt: skip

    server = Server(device, _shown(job, tool, device, scales), state)
    thread = threading.Thread(target=run, name="feel", daemon=True)
    try:
        thread.start()
        with urgent():
            asyncio.run(server.serve(request.port, say, stop))
    except OSError as error:
        raise InputError(f"feel: --port {request.port}: {error.strerror}; give another, or 0 for a free one") from error
    except KeyboardInterrupt:  # The usual end.
        pass
    finally:
        stop.set()
        thread.join(5)
    return _report(job, tool, coupling, timing, [])


def _report(
    job: Job, tool: Tool, coupling: Coupling, timing: Timing | None, ticks: list[tuple[float, Felt]]
) -> dict[str, Any]:
    device: Device = coupling.device
    report: dict[str, Any] = {
        "scene": job.name, "body": tool.body, "notes": unfelt(job, tool.body), "force_scale": coupling.scales.force,
        "length_scale": coupling.scales.length, "coupling_stiffness": coupling.stiffness,
        "device": {"rate": device.rate, "delay": device.delay, "stiffness": device.stiffness, "force": device.force},
    }  # fmt: skip
    if timing is not None:
        report["timing"] = timing.as_json()
    if isinstance(device, Scripted):
        forces = [float(np.linalg.norm(h[2][:3])) for h in device.history]
        report |= {"largest_force": max(forces), "least_reserve": min(felt.reserve for _, felt in ticks)}
    write_text(job.out / REPORT, json.dumps(report, indent=1))
    return report


def _table(ticks: list[tuple[float, Felt]], device: Scripted) -> str:
    """Return the ticks as CSV, with the poses that the handle had and the wrenches that acted on it."""
    times = np.array([h[0] for h in device.history])
    poses = np.array([h[1] for h in device.history])
    rows: list[list[str]] = [list(COLUMNS)]
    for time, felt in ticks:
        row = max(0, int(np.searchsorted(times, time + 1e-12)) - 1)
        numbers = [time, *poses[row], *device.history[row][2], *felt.truth[:3], felt.reserve]
        rows.append([*(f"{x:.9g}" for x in numbers), felt.state])
    return csv_text(rows)


def _shown(job: Job, tool: Tool, device: Browser, scales: Scales) -> dict[str, Any]:
    """Return what the page draws, in sizes of the scene: triangles of what stays and what moves."""
    field = next(f for f in job.scene.fields().values() if f.body == tool.body)
    fixed, moved, pivot = list[np.ndarray](), list[np.ndarray](), np.zeros(3)
    if isinstance(field, Electrostatic) and field.record is not None:
        grid: PoseGridRecord = job.store.get(field.record, "posegrid", only=["field_key", "moved"])
        needed = ["conductors", "facets", "panel", "conductor"]
        record: FieldRecord = job.store.get(grid.field_key, "field", only=needed)
        pivot = np.array(grid.moved["pivot"])
        owner = np.asarray(record.conductor)[np.asarray(record.panel)]
        for n, name in enumerate(record.conductors["names"]):
            (moved if name in grid.moved["names"] else fixed).append(np.asarray(record.facets)[owner == n])
    else:
        side = 4 * tool.extent
        corners = 0.5 * side * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
        square = corners[[[0, 1, 2], [0, 2, 3]]]
        fixed, moved, pivot = [square - [0, 0, tool.extent]], [square], np.zeros(3)
    both = np.concatenate(fixed + moved).reshape(-1, 3)
    size = 0.5 * float(np.linalg.norm(np.ptp(both, axis=0)))
    centre = 0.5 * (both.min(axis=0) + both.max(axis=0))
    return {
        "name": job.name, "body": tool.body, "size": size, "length": scales.length, "force": device.force,
        "mass": device.mass,
        "reach": scales.length * tool.extent, "pivot": ((pivot - centre) / size).tolist(),
        "fixed": [np.round((triangles - centre) / size, 5).tolist() for triangles in fixed],
        "moved": [np.round((triangles - centre) / size, 5).tolist() for triangles in moved],
    }  # fmt: skip
