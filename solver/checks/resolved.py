"""Forces over the time that the modes resolve, beside those over short windows, and peaks of what samples pass over."""

from dataclasses import replace

import numpy as np

from gudgeon.modaldb.records.trajectory import SAMPLE_NOTES, Trajectory
from gudgeon.modaldb.records.types import Json
from gudgeon.solver.results.contact_events import named
from gudgeon.solver.results.probes import probe_quantities
from gudgeon.solver.system.system import System

FOLLOWED = 0.1
"""Motion between two samples over the range of a coordinate up to which samples follow it: of an amplitude A it is
A ω h over 2 A, and a sampled peak is low by (ω h)²/8, 0.5 % there."""
NOTICED = 1e-2
"""Rate of a coordinate over the largest one of its body, rigid or elastic, below which it is not noticed."""
PEAKS = ("_peak", "_peak_time")
"""Ends of the names of quantities that are the largest value of a history."""


def unresolved(system: System) -> list[str]:
    """Return the contacts whose windows are below the shortest kept period."""
    return [name for name, window in system.impact_windows.items() if window < system.resolution]


def with_resolved_forces(system: System, trajectory: Trajectory, wide: Trajectory) -> Trajectory:
    """Return a run with the force that the modes resolve of contacts whose window is below the shortest kept period.

    Args:
        wide: The run whose windows were `System.separation`.
    """
    json: Json = {}
    for name in unresolved(system):
        if (peak := wide.quantities.get(f"{name}.force_peak")) is not None:
            window = float(system.separation)
            json |= named(name, {"force_resolved": (peak["value"], "N"), "resolved_window": (window, "s")})
    if not json:
        return trajectory
    merged = trajectory.quantities | json
    owners = list(dict.fromkeys(name.partition(".")[0] for name in merged))
    together = dict(sorted(merged.items(), key=lambda item: owners.index(item[0].partition(".")[0])))
    return replace(trajectory, quantities=together)


def passed_over(system: System, trajectory: Trajectory) -> bool:
    """Whether samples pass over a vibration of a run, so that peaks of what is read at them may be larger."""
    scene = system.scene
    if not (scene.probe or scene.joint or scene.force or system.gauges) or not len(trajectory.frames):
        return False
    travel, rate = np.ptp(trajectory.frames, axis=0), np.abs(trajectory.velocities).max(axis=0)
    for name, body in system.bodies.items():
        start = trajectory.coordinate_offsets[name]
        middle, end = start + body.rigid_count, start + body.record_count
        for span in (slice(start, middle), slice(middle, end)):
            noticed = rate[span] > NOTICED * rate[span].max(initial=0.0)
            if np.any(noticed & (float(trajectory.times[0]) * rate[span] > FOLLOWED * travel[span])):
                return True
    return False


def with_peaks(trajectory: Trajectory, close: Trajectory) -> Trajectory:
    """Return a run with the peaks of its probes, joints, gauges and forces by the same run with closer samples."""
    peaks = {
        name: entry
        for name, entry in close.quantities.items()
        if name.endswith(PEAKS) and name.partition(".")[0] not in trajectory.contacts
    }
    at_points = probe_quantities(close.times, close.probes, between=True)
    peaks |= {name: entry for name, entry in at_points.items() if name in peaks}
    notes = [str(trajectory.counts.get(SAMPLE_NOTES, ""))]
    notes += [f"peak of {line}" for line in str(close.counts.get(SAMPLE_NOTES, "")).splitlines()]
    counts = {SAMPLE_NOTES: "\n".join(filter(None, notes))} if any(notes) else {}
    return replace(trajectory, quantities=trajectory.quantities | peaks, counts=trajectory.counts | counts)
