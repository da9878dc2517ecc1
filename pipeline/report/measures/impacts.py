"""Impacts in the force histories of a contact, and their impulses, forces and times, the same way for every run.

A run is compared with another one on the impacts of that other one, the reference. Each impact of the reference has a
part of the time axis, from the middle of the separation before it to the middle of the separation after it, and what
the run does in that part is compared. So every run has a value for each impact, also if it separates for a moment
where the reference does not.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gudgeon.pipeline.plots.contact.force_window import windowed_peak

TOUCHING = 1e-6
"""Force over the largest one of the history above which a contact is closed."""
SMALL = 0.05
"""Impulse over the largest one of a contact below which an impact is counted with the nearest larger one."""
SHOWN = 10
"""Number of impacts of a contact that are compared one by one."""
PER_IMPACT = {"impulse": "N s", "force_peak": "N", "time": "s"}
"""Values of an impact and their units."""


@dataclass(frozen=True)
class ForceCourse:
    """The force of a contact up to a time, as the sum of its impulse."""

    edges: np.ndarray
    """Edges of the sample intervals [s], (s + 1,)."""
    impulse: np.ndarray
    """∫ F dt from 0 up to each edge, linear in between [N s], (s + 1, 3)."""
    closed: np.ndarray
    """Whether the contact is closed in each interval, (s,)."""

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return the impulse up to some times [N s], (t, 3)."""
        return np.column_stack([np.interp(times, self.edges, column) for column in self.impulse.T])


def course(times: np.ndarray, force: np.ndarray, until: float) -> ForceCourse:
    """Return the course of a history of mean forces.

    Args:
        times: Ends of the intervals [s], (s,); the first starts at 0.
        force: Mean over each [N], (s, 3).
        until: Time up to which it is compared [s]; an interval that contains it is cut.
    """
    edges = np.concatenate([[0.0], times])
    impulse = np.concatenate([np.zeros((1, 3)), np.cumsum(force * np.diff(edges)[:, None], axis=0)])
    size = np.linalg.norm(force, axis=1)
    count = min(int(np.searchsorted(edges, until * (1 - 1e-12))), len(times))
    end_impulse = np.column_stack([np.interp([until], edges, column) for column in impulse.T])
    edges, impulse = np.append(edges[:count], min(until, edges[-1])), np.vstack([impulse[:count], end_impulse])
    return ForceCourse(edges, impulse, (size > TOUCHING * size.max(initial=0.0))[:count])


def located(history: ForceCourse, window: float) -> np.ndarray:
    """Return begin and end of each impact [s], (b, 2); impacts separated by less than the window are one."""
    changes = np.diff(np.concatenate([[0], history.closed.astype(np.int8), [0]]))
    spans = np.column_stack([history.edges[changes > 0], history.edges[changes < 0]])
    if not len(spans):
        return spans
    separate = spans[1:, 0] - spans[:-1, 1] >= window
    return np.column_stack([spans[np.append(True, separate), 0], spans[np.append(separate, True), 1]])


def parts(history: ForceCourse, window: float) -> np.ndarray:
    """Return the impacts that are compared, (b, 4): begin and end of their part of the time axis, and their own [s].

    Impacts of small impulse are counted with the nearest larger one; one that the end of the history cuts is left out.
    """
    spans = located(history, window)
    if not len(spans):
        return np.empty((0, 4))
    sizes = np.linalg.norm(history.at(spans[:, 1]) - history.at(spans[:, 0]), axis=1)
    spans = spans[sizes >= SMALL * sizes.max()]
    middles = 0.5 * (spans[1:, 0] + spans[:-1, 1])
    rows = np.column_stack([np.append(history.edges[0], middles), np.append(middles, history.edges[-1]), spans])
    cut = spans[-1, 1] > history.edges[-1] - window
    return rows[: len(rows) - int(cut)][:SHOWN]


def values_in(history: ForceCourse, start: float, end: float, window: float) -> dict[str, float]:
    """Return the values of `PER_IMPACT` of the impact between two times.

    The impulse is the size of the integral of the resultant. The peak force is that of the quantity `force_peak`: the
    largest mean over the window of the mean over the window, without force before and after. The time is that at which
    half of the impulse has been given; NaN where there is no impulse.
    """
    interior = history.edges[(history.edges > start) & (history.edges < end)]
    edges = np.concatenate([[start], interior, [end]])
    cumulative = history.at(edges) - history.at(edges[:1])
    size = float(np.linalg.norm(cumulative[-1]))
    fraction = cumulative @ cumulative[-1] / size**2 if size > 0 else np.zeros(len(edges))
    half = int(np.argmax(fraction >= 0.5))
    time = float(np.interp(0.5, fraction[half - 1 : half + 1], edges[half - 1 : half + 1])) if half else float("nan")
    return {"impulse": size, "force_peak": windowed_peak(edges, cumulative, window), "time": time}


def rms(history: ForceCourse, window: float) -> float:
    """Return the root mean square of the mean force over the window, over the whole course [N]."""
    count = max(1, int((history.edges[-1] - history.edges[0]) / window * 4))
    ends = np.linspace(history.edges[0] + window, history.edges[-1], count)
    means = (history.at(ends) - history.at(ends - window)) / window
    return float(np.sqrt((means**2).sum(axis=1).mean()))


def window_of(window: float, *interval: float) -> float:
    """Return the width of the mean that all runs have: the window of the report, or the longest sample interval."""
    return max(window, *interval)


def contact_values(
    courses: Mapping[str, ForceCourse], shares: Mapping[str, np.ndarray], window: float
) -> dict[str, float]:
    """Return the values of all contacts of a run, `CONTACT.impactN.impulse` and so on.

    Args:
        shares: Impacts of each contact, see `parts`.
    """
    values: dict[str, float] = {}
    for name, history in courses.items():
        values[f"{name}.impulse"] = float(np.linalg.norm(history.impulse[-1]))
        values[f"{name}.force_rms"] = rms(history, window)
        for i, (start, end) in enumerate(shares[name][:, :2], 1):
            impact = values_in(history, start, end, window)
            values |= {f"{name}.impact{i}.{key}": value for key, value in impact.items()}
    return values
