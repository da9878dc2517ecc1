"""Motion beside the forces of sliding pairs: velocity of the liner in third octaves, kinetic energy before slaps."""

from collections.abc import Mapping

import numpy as np

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.pipeline.report.force import Ran
from gudgeon.pipeline.stages.job import Job, placed_design

THIRD = 10 ** (1 / 20)
"""Upper limit of a third octave over its centre (IEC 61260-1, base ten)."""
FEWEST_LINES = 2.0
"""Least number of spectral lines within the width of a band."""
HIGHEST = 0.4
"""Upper limit of the highest band over the rate of frames, below half of which there is no information."""


def third_octaves(times: np.ndarray, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the centres of third octaves [Hz], (b,), and the rms velocity in each [m/s], (b,).

    The velocity is the difference quotient of the displacement between frames, with a Hann window over the whole
    duration; mean squares are averaged over the places.

    Args:
        times: Of equally spaced frames [s], (f,).
        displacement: [m], (f, places).
    """
    if len(times) < 4:
        return np.empty(0), np.empty(0)
    interval = float(times[-1] - times[0]) / (len(times) - 1)
    velocity = np.diff(displacement, axis=0) / interval
    weights = np.hanning(len(velocity) + 2)[1:-1, None]
    spectrum = np.abs(np.fft.rfft(weights * velocity, axis=0)) ** 2
    power = 2 * spectrum.mean(axis=1) / (len(velocity) * (weights**2).sum())
    lines = np.fft.rfftfreq(len(velocity), interval)
    lowest = FEWEST_LINES * lines[1] / (THIRD - 1 / THIRD)
    numbers = np.arange(
        np.ceil(10 * np.log10(lowest / 1e3)), np.floor(10 * np.log10(HIGHEST / interval / THIRD / 1e3)) + 1
    )
    centres = 1e3 * 10 ** (numbers / 10)
    in_band = (lines >= centres[:, None] / THIRD) & (lines < centres[:, None] * THIRD)
    return centres, np.sqrt(in_band @ power)


def surface_bands(run: Ran, until: float) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return the third octaves of the normal velocity of the surface under each sliding contact of a run."""
    if run.frame_times is None:
        return {}
    if isinstance(run, NodalRecord):
        masters = run.masters
    else:
        masters = {name: item.master for name, item in run.contacts.items() if item.master is not None}
    compared = run.frame_times <= until * (1 + 1e-9)
    octaves = {name: third_octaves(run.frame_times[compared], rows[compared]) for name, rows in masters.items()}
    return {name: bands for name, bands in octaves.items() if len(bands[0])}


def lateral_energy(job: Job, run: Ran, body: str) -> np.ndarray:
    """Return the kinetic energy of the rigid motion of a driven body across its direction of travel [J], (s,).

    Lateral motion of the centre and rotation, without the motion along the joint's axis.
    """
    joint = next(joint for joint in job.scene.cranks().values() if joint.body == body)
    morph = placed_design(job, body, ["mass", "inertia"])
    along, _ = joint.axes
    velocity, rotation = run.motion[body][:, 6:9], run.motion[body][:, 9:12]
    across = velocity - np.outer(velocity @ along, along)
    return 0.5 * (morph.mass * (across**2).sum(axis=1) + np.einsum("si,ij,sj->s", rotation, morph.inertia, rotation))


def energies_before(
    times: np.ndarray, energy: np.ndarray, impacts: Mapping[str, np.ndarray], middles: Mapping[str, np.ndarray]
) -> np.ndarray:
    """Return the largest energy before each impact, over all sides and in the order of time [J], (b,).

    It is sought from the middle of the flight before the impact, whichever side it began at, to the time at which half
    of the impulse has been given.

    Args:
        times: Of the energies [s], (s,).
        impacts: By contact, see `impacts.parts`.
        middles: Time of each impact of the run, by contact [s], (b,).
    """
    rows = [(*row[2:], middle) for name in impacts for row, middle in zip(impacts[name], middles[name], strict=True)]
    energies, ended = [], 0.0
    for start, end, middle in sorted(rows):
        since = 0.5 * (ended + start) if ended < start else start
        # A run without this impact has no energy before it.
        chosen = (times >= since) & (times <= middle)
        energies.append(float(energy[chosen].max()) if chosen.any() else 0.0)
        ended = max(ended, end)
    return np.array(energies)
