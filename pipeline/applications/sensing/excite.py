"""`gudgeon calibrate --excite`: the calibration of a plate by the arm that moves on it.

The wrench of the arm on the plate is that of its parameters. Between the drift of the bridges and the plate's own
swinging, which the start of a run leaves, both are compared in a band of frequencies, by the same filter: from below
the trajectory's first harmonic to a share of the lowest frequency of arm and plate. There the plate follows its load,
u = −K⁻¹ h, and the wrench has the inertia of this motion.
"""

from typing import Any

import numpy as np
from scipy import linalg, signal

from gudgeon.pipeline.applications.sensing.bridges import measured
from gudgeon.pipeline.applications.sensing.calibration import Calibration, calibrated, fitted
from gudgeon.pipeline.applications.sensing.identify import SETTLED, Excited, excitation_of, excited, unit_calibration
from gudgeon.pipeline.applications.sensing.robot import Robot
from gudgeon.pipeline.applications.sensing.smoothing import inertias
from gudgeon.pipeline.applications.sensing.standing import Gauged
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.gauge import WRENCH
from gudgeon.pipeline.stages.run_report import Progress

MOVED = Excited(duration=4.0, rate=1000.0, frequency=1.0)
"""Faster than for identification: inertial forces are what tells Fx, Fy and Mz."""
LOW, HIGH = 0.5, 0.4
"""Band: over the first harmonic, and over the lowest frequency of arm and plate."""
ENDS = 0.6
"""Time that the filter's ends take [s]."""
PASSES = 3
"""Of the plate's motion under its own inertia: each brings a power of (f/f₁)²."""


def excite_calibration(
    robot: Robot, parameters: np.ndarray | None, progress: Progress, excitation: Excited = MOVED
) -> tuple[Calibration, dict[str, Any]]:
    """Return the calibration of a plate by the arm that moves on it, and what it is worth.

    Args:
        parameters: Of the links; default: those of the scene.

    Raises:
        InputError: the arm is mounted on load cells, or its wrenches do not span all components.
    """
    if not isinstance(robot.base, Gauged) or robot.sensor is None:
        raise InputError(f"{robot.job.path}: --excite: the arm is mounted on load cells, which have no gauges")
    p = robot.arm.chain.parameters() if parameters is None else parameters
    progress("excite", 0.0)
    series, _, after = excitation_of(robot, excitation)
    trajectory, along = excited(robot, series, excitation, progress)
    times = np.asarray(trajectory.times)
    interval = float(times[1] - times[0])
    signals = measured(robot.signals(trajectory), interval, robot.sensor)
    wrench = -following(along, times, p)
    later = times > SETTLED
    band = LOW * excitation.frequency, HIGH * lowest(along, p)
    if not band[0] < band[1] < 0.45 / interval:
        raise InputError(
            f"{robot.job.path}: --excite: the plate swings at {band[1] / HIGH:.3g} Hz under the arm, too near the"
            f" trajectory's {excitation.frequency:g} Hz"
        )
    passed = [banded(v[later], band, 1 / interval) for v in (wrench, signals)]
    fit = fitted(passed[0], passed[1], WRENCH, robot.job.path)
    offsets = (signals - wrench @ fit["sensitivity"].T)[later].mean(axis=0)
    unit = unit_calibration(robot)
    calibration = calibrated(unit.channels, WRENCH, fit["sensitivity"], offsets, {}, {})
    residual = calibration.wrenches(passed[1] + offsets) - passed[0]
    return calibration, {
        "source": "excitation", "samples": len(passed[0]), "band": list(band), "condition_of_series": after,
        "condition_of_data": fit["condition"], "signal_rms": fit["rms"].tolist(),
        "wrench_rms": np.sqrt((residual**2).mean(axis=0)).tolist(),
        "excited_rms": np.sqrt((passed[0] ** 2).mean(axis=0)).tolist(),
        "unit_wrenches": (calibration.matrix @ unit.sensitivity).tolist(),
    }  # fmt: skip


def banded(values: np.ndarray, band: tuple[float, float], rate: float) -> np.ndarray:
    """Return values (s, k) within a band [Hz], without the ends: first without swinging, then without drift.

    The ends of the second filter are then those of smooth values, the same in all of them.
    """
    cut = round(ENDS / 2 * rate)
    low, high = (signal.butter(n, edge, kind, fs=rate, output="sos")
                 for n, edge, kind in ((4, band[1], "lowpass"), (2, band[0], "highpass")))  # fmt: skip
    smooth = signal.sosfiltfilt(low, values, axis=0)[cut:-cut]
    return signal.sosfiltfilt(high, smooth, axis=0)[cut:-cut]


def lowest(robot: Robot, parameters: np.ndarray) -> float:
    """Return the lowest frequency of an arm on its base at the start [Hz]."""
    moved = tuple(m[:1] for m in robot.arm.angles(np.zeros(1)))
    base = robot.base.yields()
    mass = inertias(robot.arm.chain, robot.arm.mass + base.mass, (moved[0], moved[1], moved[2]), parameters)[0]
    return float(np.sqrt(linalg.eigh(base.stiffness, mass, eigvals_only=True)[0])) / (2 * np.pi)


def following(robot: Robot, times: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    """Return the wrench of the base on the stand of an arm whose base follows its load, (s, 6)."""
    soft, interval = np.linalg.inv(robot.base.yields().stiffness), float(times[1] - times[0])
    carried = np.zeros((len(times), 6))
    for _ in range(PASSES):
        load = robot.load(times, parameters, carried)
        carried = -np.gradient(np.gradient(load, interval, axis=0), interval, axis=0) @ soft.T
    return robot.load(times, parameters, carried)
