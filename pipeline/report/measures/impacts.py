"""Impacts in the force histories of a contact, and their impulses, forces and times, the same way for every run.

A run is compared with another one on the impacts of that other one, the reference. Each impact of the reference has a
part of the time axis, from the middle of the separation before it to the middle of the separation after it, and what
the run does in that part is compared. So every run has a value for each impact, also if it separates for a moment
where the reference does not.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

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
    last = np.column_stack([np.interp([until], edges, column) for column in impulse.T])
    edges, impulse = np.append(edges[:count], min(until, edges[-1])), np.vstack([impulse[:count], last])
    return ForceCourse(edges, impulse, (size > TOUCHING * size.max(initial=0.0))[:count])


def located(found: ForceCourse, window: float) -> np.ndarray:
    """Return begin and end of each impact [s], (b, 2); impacts separated by less than the window are one."""
    changes = np.diff(np.concatenate([[0], found.closed.astype(np.int8), [0]]))
    spans = np.column_stack([found.edges[changes > 0], found.edges[changes < 0]])
    if not len(spans):
        return spans
    apart = spans[1:, 0] - spans[:-1, 1] >= window
    return np.column_stack([spans[np.append(True, apart), 0], spans[np.append(apart, True), 1]])


def parts(found: ForceCourse, window: float) -> np.ndarray:
    """Return the impacts that are compared, (b, 4): begin and end of their part of the time axis, and their own [s].

    Impacts of small impulse are counted with the nearest larger one; one that the end of the history cuts is left out.
    """
    spans = located(found, window)
    if not len(spans):
        return np.empty((0, 4))
    sizes = np.linalg.norm(found.at(spans[:, 1]) - found.at(spans[:, 0]), axis=1)
    spans = spans[sizes >= SMALL * sizes.max()]
    middles = 0.5 * (spans[1:, 0] + spans[:-1, 1])
    whole = np.column_stack([np.append(found.edges[0], middles), np.append(middles, found.edges[-1]), spans])
    cut = spans[-1, 1] > found.edges[-1] - window
    return whole[: len(whole) - int(cut)][:SHOWN]


def values_in(found: ForceCourse, begin: float, end: float, window: float) -> dict[str, float]:
    """Return the values of `PER_IMPACT` of the impact between two times.

    The impulse is the size of the integral of the resultant. The peak force is the largest mean of the resultant over
    the window. The time is that at which half of the impulse has been given; NaN where there is no impulse.
    """
    inside = found.edges[(found.edges > begin) & (found.edges < end)]
    # The mean over the window is largest where one of its ends is the edge of an interval.
    ends = np.sort(np.concatenate([inside, inside + window, [begin + window, end]]))
    means = (found.at(np.clip(ends, begin, end)) - found.at(np.clip(ends - window, begin, end))) / window
    edges = np.concatenate([[begin], inside, [end]])
    given = found.at(edges) - found.at(edges[:1])
    size = float(np.linalg.norm(given[-1]))
    share = given @ given[-1] / size**2 if size > 0 else np.zeros(len(edges))
    half = int(np.argmax(share >= 0.5))
    time = float(np.interp(0.5, share[half - 1 : half + 1], edges[half - 1 : half + 1])) if half else float("nan")
    return {"impulse": size, "force_peak": float(np.linalg.norm(means, axis=1).max()), "time": time}


def rms(found: ForceCourse, window: float) -> float:
    """Return the root mean square of the mean force over the window, over the whole course [N]."""
    count = max(1, int((found.edges[-1] - found.edges[0]) / window * 4))
    ends = np.linspace(found.edges[0] + window, found.edges[-1], count)
    means = (found.at(ends) - found.at(ends - window)) / window
    return float(np.sqrt((means**2).sum(axis=1).mean()))


def window_of(window: float, *interval: float) -> float:
    """Return the width of the mean that all runs have: the window of the report, or the longest sample interval."""
    return max(window, *interval)


def contact_values(
    found: Mapping[str, ForceCourse], shares: Mapping[str, np.ndarray], window: float
) -> dict[str, float]:
    """Return the values of all contacts of a run, `CONTACT.impactN.impulse` and so on.

    Args:
        shares: Impacts of each contact, see `parts`.
    """
    values: dict[str, float] = {}
    for name, one in found.items():
        values[f"{name}.impulse"] = float(np.linalg.norm(one.impulse[-1]))
        values[f"{name}.force_rms"] = rms(one, window)
        for number, (begin, end) in enumerate(shares[name][:, :2], 1):
            impact = values_in(one, begin, end, window)
            values |= {f"{name}.impact{number}.{key}": value for key, value in impact.items()}
    return values
