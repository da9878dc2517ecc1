"""Times of a film's frames, close together around impacts: there the film runs slowly."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.plots.base.run import Drawing

WITHIN = 0.5
"""Share of the frames that are within impacts, where they last for less of the time shown."""
LEAST = 0.01
"""Least duration of an impact as the film slows down for it, of the time shown."""
MARGIN = 0.2
"""Slow time before and after an impact, of its duration."""

Span = tuple[float, float]
"""Start and end [s]."""


@dataclass(frozen=True)
class Pace:
    """Times of a film's frames."""

    times: np.ndarray
    """[s], (n,)"""
    slow: np.ndarray
    """Whether each is in a slow part, (n,)."""
    factor: float
    """By which time runs slower there."""

    def text(self, frame: int) -> str:
        """Return what the corner of a frame says of the pace; empty where no part of the film is slow."""
        if self.factor == 1.0:
            return ""
        return f"{self.factor:.2g} × slower     " if self.slow[frame] else ""


def pace_of(span: Span, impacts: Sequence[Span], count: int, moments: Sequence[float] = ()) -> Pace:
    """Return about `count` times of a span, `WITHIN` of them in impacts if these last for less.

    Args:
        moments: Times of which each replaces the closest one [s].
    """
    slow_spans = merged([_widened(impact, span) for impact in impacts])
    lasts, total = sum(stop - start for start, stop in slow_spans), span[1] - span[0]
    fraction = lasts / total if total > 0 else 1.0
    if not 0 < fraction < WITHIN:
        times, factor = np.linspace(*span, count), 1.0
    else:
        edges = np.array([span[0], *(edge for pair in slow_spans for edge in pair), span[1]])
        pieces, slow = np.diff(edges), np.arange(len(edges) - 1) % 2 == 1
        frames = np.where(slow, WITHIN * count * pieces / lasts, (1 - WITHIN) * count * pieces / (total - lasts))
        passed = np.concatenate([[0.0], np.cumsum(frames)])
        times, factor = np.interp(np.linspace(0.0, passed[-1], count), passed, edges), (1 - fraction) / fraction
        factor *= WITHIN / (1 - WITHIN)
    for moment in moments:
        times[int(np.abs(times - moment).argmin())] = moment
    times = np.unique(times)
    slow = np.zeros(len(times), bool)
    for start, stop in slow_spans:
        slow |= (times >= start) & (times <= stop)
    return Pace(times, slow, factor)


def _widened(impact: Span, span: Span) -> Span:
    """Return an impact with its margins and of the least duration, within a span."""
    middle, half = 0.5 * (impact[0] + impact[1]), 0.5 * max(impact[1] - impact[0], LEAST * (span[1] - span[0]))
    return max(span[0], middle - (1 + MARGIN) * half), min(span[1], middle + (1 + MARGIN) * half)


def merged(spans: Iterable[Span]) -> list[Span]:
    """Return spans that overlap as one, in their order."""
    joined: list[Span] = []
    for start, stop in sorted(span for span in spans if span[1] > span[0]):
        if joined and start <= joined[-1][1]:
            joined[-1] = joined[-1][0], max(stop, joined[-1][1])
        else:
            joined.append((start, stop))
    return joined


def closed_spans(trajectory: Trajectory, names: Iterable[str]) -> list[Span]:
    """Return the times in which some contacts are closed [s], by their forces over samples."""
    step, spans = float(trajectory.times[0]), []
    for name in names:
        closed = np.concatenate([[False], trajectory.contacts[name].force.any(axis=1), [False]])
        edges = np.flatnonzero(np.diff(closed))
        spans += [(step * a, step * b) for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)]
    return merged(spans)


def at_times(drawing: Drawing, times: np.ndarray) -> Drawing:
    """Return a drawing whose frames are those at some times [s], (t,), linear between the frames of the record."""
    trajectory = drawing.trajectory

    def between(values: np.ndarray) -> np.ndarray:
        position = np.interp(times, trajectory.frame_times, np.arange(len(trajectory.frame_times)))
        lower = np.minimum(position.astype(int), len(values) - 1)
        upper, weight = np.minimum(lower + 1, len(values) - 1), position - lower
        weight = weight.reshape(-1, *(1,) * (values.ndim - 1))
        return (1 - weight) * values[lower] + weight * values[upper]

    contacts = {
        name: replace(
            contact,
            multipliers=between(contact.multipliers),
            master=None if contact.master is None else between(contact.master),
            friction=None if contact.friction is None else between(contact.friction),
        )
        for name, contact in trajectory.contacts.items()
    }
    paced = replace(drawing)
    vars(paced)["trajectory"] = replace(
        trajectory, frame_times=times, frames=between(trajectory.frames), velocities=between(trajectory.velocities),
        contacts=contacts,
    )  # fmt: skip
    return paced
