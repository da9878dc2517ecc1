"""Bridges of strain gauges: from strains to signals, with offsets, drift, noise and quantisation.

A bridge with gauges of factor k in its arms has V/V₀ = k/4 (ε₁ − ε₂ + ε₃ − ε₄), to first order in the strains: of a
quarter bridge the second order is a share k ε/2 of its signal, 1e-3 at ε = 1e-3.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from gudgeon.pipeline.scenes.gauge import ARMS, Channel, Sensor


def bridge_matrix(channels: Mapping[str, Channel], gauges: Sequence[str], factor: float) -> np.ndarray:
    """Return the signals per strain of each gauge [V/V], (n, g)."""
    matrix = np.zeros((len(channels), len(gauges)))
    for row, channel in enumerate(channels.values()):
        for sign, gauge in zip(ARMS, channel.gauges, strict=False):
            matrix[row, list(gauges).index(gauge)] += sign * factor / 4
    return matrix


def measured(signals: np.ndarray, interval: float, sensor: Sensor) -> np.ndarray:
    """Return what the electronics make of ideal signals (s, n) at samples `interval` apart [s]: seeded, repeatable."""
    random = np.random.default_rng(sensor.seed)
    count, channels = signals.shape
    offset = sensor.offset * random.standard_normal(channels)
    walk = sensor.drift * np.sqrt(interval) * random.standard_normal((count, channels)).cumsum(axis=0)
    noise = sensor.noise * random.standard_normal((count, channels))
    values = signals + offset + walk + noise
    return values if sensor.resolution == 0 else sensor.resolution * np.round(values / sensor.resolution)
