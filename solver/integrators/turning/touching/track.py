"""Forces and impulses of a contact with an obstacle over time, and the impacts that they make."""

import numpy as np

from gudgeon.modaldb.records.trajectory import (
    BEGINS,
    CLOSING,
    ENDS,
    IMPACT_COLUMNS,
    IMPULSE,
    OPENING,
    PEAK,
    PEAK_TIME,
    WINDOWED,
    WINDOWED_TIME,
)
from gudgeon.solver.integrators.curves import least_of_cubics, windowed


class Track:
    """What is kept of one contact while it presses."""

    def __init__(self, sections: np.ndarray) -> None:
        """
        Args:
            sections: Numbers of its points' sections.
        """
        self.sections = sections
        self.least = (np.inf, 0.0)
        """Smallest gap so far [m], and its time [s]."""
        self._times: list[np.ndarray] = []
        self._forces: list[np.ndarray] = []
        self._pushes: list[np.ndarray] = []

    def add(self, times: np.ndarray, forces: np.ndarray, pushes: np.ndarray) -> None:
        """Keep times [s], (t,), resultants on the body [N], (t, 3), and their integrals since the start [N s]."""
        self._times.append(times)
        self._forces.append(forces)
        self._pushes.append(pushes)

    def watch(self, times: np.ndarray, gaps: np.ndarray, rates: np.ndarray) -> None:
        """Keep the smallest gap of its points, (t, c) [m], which change by rates [m/s]; none once it has touched."""
        if not self._times:
            self.least = min(self.least, least_of_cubics(times, gaps, rates))

    @property
    def touched(self) -> bool:
        """Whether it has pressed."""
        return bool(self._times)

    def impacts(self, section_impacts: np.ndarray, separation: float, window: float) -> np.ndarray:
        """Return the impacts of the contact, (b, 9) as `Trajectory.impacts`.

        Args:
            section_impacts: Those of its sections, sorted by their begins.
            separation: Time below which impacts are one [s].
            window: Time over which forces are averaged [s].
        """
        if not len(section_impacts):
            return np.zeros((0, IMPACT_COLUMNS))
        groups: list[list[np.ndarray]] = []
        end = -np.inf
        for impact in section_impacts:
            if groups and impact[BEGINS] - end <= separation:
                groups[-1].append(impact)
            else:
                groups.append([impact])
            end = max(end, float(impact[ENDS]))
        times, unique = np.unique(np.concatenate(self._times), return_index=True)
        forces, pushes = (np.concatenate(a)[unique] for a in (self._forces, self._pushes))
        return np.array([_joined(group, times, forces, pushes, window) for group in groups])


def _joined(
    group: list[np.ndarray], times: np.ndarray, forces: np.ndarray, pushes: np.ndarray, window: float
) -> np.ndarray:
    """Return one impact from those of sections that overlap, (9,)."""
    final = max(group, key=lambda impact: float(impact[ENDS]))
    start, end = float(group[0][BEGINS]), float(final[ENDS])
    within = (times >= start) & (times <= end)
    edges, sizes, impulse = times[within], np.linalg.norm(forces[within], axis=1), pushes[within] - pushes[within][0]
    joined = np.full(IMPACT_COLUMNS, np.nan)
    joined[[BEGINS, ENDS, CLOSING, OPENING]] = start, end, group[0][CLOSING], final[OPENING]
    joined[IMPULSE] = float(np.linalg.norm(impulse[-1]))
    joined[[PEAK, PEAK_TIME]] = group[0][[PEAK, PEAK_TIME]] if len(group) == 1 else _highest(edges, sizes)
    joined[[WINDOWED, WINDOWED_TIME]] = joined[[PEAK, PEAK_TIME]]
    if window > 0 and len(edges) > 1:
        joined[[WINDOWED, WINDOWED_TIME]] = windowed(edges, impulse, window)
    return joined


def _highest(times: np.ndarray, sizes: np.ndarray) -> tuple[float, float]:
    """Return the largest of some forces and its time, by a parabola through those beside it."""
    peak = int(sizes.argmax())
    if not 0 < peak < len(sizes) - 1:
        return float(sizes[peak]), float(times[peak])
    x, y = times[peak - 1 : peak + 2] - times[peak], sizes[peak - 1 : peak + 2] - sizes[peak]
    slope_before, slope_after = y[0] / x[0], y[2] / x[2]
    square = (slope_after - slope_before) / (x[2] - x[0])
    slope = slope_before - square * x[0]
    if not square < 0:
        return float(sizes[peak]), float(times[peak])
    shift = -slope / (2 * square)
    return float(sizes[peak] + 0.5 * slope * shift), float(times[peak] + shift)
