"""Velocities and accelerations of probes: rates of the coordinates, and what these lack of quasi-static motion.

The residual flexibility carries a displacement R f without a coordinate; its rate is that of its samples. A step of
length h moves each mode exactly under the mean of a given load in it, so that a load with the slope b moves a mode that
is fast beside it with the mean velocity b/ω² of the static displacement only in the middle of steps: at their ends with

    (x/2) cot(x/2) b/ω²,   x = ω h,

the periodic motion under the sawtooth of load less mean. The difference from b/ω² is added.
"""

import numpy as np

from gudgeon.solver.ports.members import ports_of, probe_ports, start_unknowns
from gudgeon.solver.system.system import System

FOLLOWED = 5.0
"""ω h up to which the cotangent is taken: at 2π steps resonate, and modes are as fast as samples."""


class Rates:
    """What the rates of coordinates lack at the ends of samples."""

    def __init__(self, system: System, interval: float, step: float, loads: np.ndarray) -> None:
        """Read a run.

        Args:
            interval: Between samples [s].
            step: Of modes that move under the mean of given loads [s]; 0 where their motion is exact.
            loads: Mean of each load row over the sample intervals [N], (s, L).
        """
        self._system, self._interval = system, interval
        driving, slopes = system.driving, np.zeros_like(loads)
        prescribed = [i for _, rows in driving.given_rows() for i in range(rows.start, rows.stop)]
        if len(loads) > 1:
            slopes[:-1, prescribed] = np.diff(loads[:, prescribed], axis=0) / interval
            slopes[-1] = slopes[-2]
        x = np.sqrt(np.maximum(system.stiffness, 0.0)) * step
        followed = (x > 0) & (x < FOLLOWED)
        lacks = np.where(x > 0, system.flexibility, 0.0)
        lacks[followed] *= 1 - 0.5 * x[followed] / np.tan(0.5 * x[followed])
        self._lacking = (slopes @ driving.rows) * lacks
        ports = ports_of(system)
        self._start = probe_ports(system, ports) @ start_unknowns(system, ports)

    def of(self, number: int, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the velocities of a probe at the start, (k,), and at the ends of samples, (s, k).

        Args:
            number: Of the probe.
            values: What the run recorded: rates of the coordinates, then displacements by R, (s, 2 k).
        """
        system, span = self._system, self._system.probes.places[number]
        count = (span.stop - span.start) // 2
        moving, carried = slice(span.start, span.start + count), slice(span.start + count, span.stop)
        displacement = np.vstack([self._start[carried], values[:, count:]])
        rates = np.zeros_like(displacement)
        if len(values) > 1:
            rates = np.gradient(displacement, self._interval, axis=0, edge_order=2)
        W = system.probes.rates[moving]
        return W @ system.velocity + rates[0], values[:, :count] + rates[1:] + self._lacking @ W.T
