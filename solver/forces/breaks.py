"""Where steps should end, so that none passes over a part of a function of time without reading it.

An error estimate knows what a method's stages have read. A pulse between them changes nothing, and steps over what is
constant on both sides grow without bound. A function is read on grids of several spacings before the run: where its
second difference is a noticeable part of its range, something happens on the scale of that grid. Steps end before and
after such a span of time, so that the stages of a step lie within it.
"""

from collections.abc import Callable, Iterable

import numpy as np

FINEST = 2**17
"""Intervals of the finest grid: shorter pulses that no table has as rows may be passed over."""
COARSER, GRIDS = 8, 5
"""Ratio of the spacings of two grids, and how many there are."""
NOTICED = 1e-2
"""Second difference of a function over its range."""
APART = 4
"""Intervals between two points of one span at most."""
TRAIN, OFF = 8, 2.0
"""Spans in a row, and the longest gap between two over the shorter of them, that are one: an oscillation, as a sine,
whose stages are read in any step that follows it."""
MOST_ROWS = 5000
"""Rows of a table at whose kinks steps end at most."""
NARROWER = 26
"""Grids on which a kink or a jump is looked for, each a quarter of the one before."""
RESOLVED = 1e-12
"""Second difference of a function over its range that is above round-off."""
SMOOTHER = 0.05
"""Least second difference of a kink over that of one which decreases as the spacing."""
JUMP = 1e-6
"""Least change at a jump over the range of a function."""
KINK = 1e-6
"""Deviation of a row from the line through its neighbours, over the range of the table, that is a kink."""


def breaks_of(read: Callable[[np.ndarray], np.ndarray], duration: float, *, trains: bool = True) -> np.ndarray:
    """Return the times at which steps should end, and where the next ones begin, (b, 2) [s], ascending.

    The two differ, by round-off, where a function jumps, which may have any value there.

    Args:
        read: Values of functions at times, (t,) → (t, k).
        duration: Of the run [s].
        trains: Whether each crest of an oscillation may be a span of its own, which steps with an error estimate need
            not.
    """
    values = read(np.linspace(0.0, duration, FINEST + 1)).reshape(FINEST + 1, -1)
    size = np.ptp(values, axis=0)
    size[size == 0] = np.inf
    spans, sharp = list[np.ndarray](), np.empty((0, 2))
    for grid in range(GRIDS):
        every = COARSER**grid
        spacing = duration * every / FINEST
        bent = np.abs(np.diff(values[::every], 2, axis=0)) > NOTICED * size
        bends = 1 + np.flatnonzero(bent.any(axis=1))
        if not len(bends):
            continue
        gaps = np.diff(bends) > APART
        starts, stops = bends[np.append(True, gaps)] - 1, bends[np.append(gaps, True)] + 1
        if not trains:
            starts, stops = _without_trains(starts, stops)
        spans.append(np.repeat(spacing * np.concatenate([starts, stops])[:, None], 2, axis=1))
        if grid == 0 and len(bends) <= MOST_ROWS:
            sharp = _sharp(lambda times: read(times).reshape(len(times), -1) / size, spacing * bends, spacing)
    return within([*spans, sharp], duration)


def _without_trains(starts: np.ndarray, stops: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where spans begin and end, of which many in a row with short gaps are one."""
    lengths, gaps = stops - starts, starts[1:] - stops[:-1]
    close = gaps <= OFF * np.minimum(lengths[1:], lengths[:-1])
    train = np.append(0, np.cumsum(~close))
    within = np.bincount(train)[train] >= TRAIN
    inner = within[1:] & within[:-1] & close
    return starts[np.append(True, ~inner)], stops[np.append(~inner, True)]


def _sharp(read: Callable[[np.ndarray], np.ndarray], centres: np.ndarray, spacing: float) -> np.ndarray:
    """Return the kinks and jumps of functions of range 1 about some times, (n,), each between two times, (b, 2) [s].

    The place of the largest second difference is looked for on ever finer grids. From one to the next it decreases as
    the spacing at a kink, not at all at a jump, and as its square where a function is smooth.
    """
    half, begun, bend_before = np.full(len(centres), spacing), np.zeros(len(centres)), np.zeros(len(centres))
    kink, round_off = np.full(len(centres), True), 8 * np.spacing(float(centres.max()) + spacing)
    for halving in range(NARROWER):
        times = centres[:, None] + half[:, None] * np.linspace(-1.0, 1.0, 9)
        bent = np.abs(np.diff(read(times.ravel()).reshape(len(centres), 9, -1), 2, axis=1)).max(axis=2)
        peak, bend = bent.argmax(axis=1), bent.max(axis=1)
        begun = bend if halving == 0 else begun
        clear = (bend > RESOLVED) & (half > round_off)
        kink &= ~clear | (bend > SMOOTHER * begun * 4.0**-halving)
        centres = np.where(clear, times[np.arange(len(centres)), 1 + peak], centres)
        half, bend_before = np.where(clear, 0.25 * half, half), np.where(clear, bend, bend_before)
    jump = kink & (bend_before > JUMP)
    centres, half = centres[kink], np.where(jump, 4 * half + round_off, 0.0)[kink]
    return np.column_stack([centres - half, centres + half])


def kinks_of(values: Iterable[tuple[float, float]], duration: float) -> np.ndarray:
    """Return the times of the rows of a table that is linear between them at which it has a kink, (b, 2) [s]."""
    times, amounts = np.array(list(values), float).T
    size = float(np.ptp(amounts))
    if len(times) < 3 or len(times) > MOST_ROWS or size == 0:
        return np.empty((0, 2))
    fraction = (times[1:-1] - times[:-2]) / (times[2:] - times[:-2])
    line = amounts[:-2] + fraction * (amounts[2:] - amounts[:-2])
    kinks = times[1:-1][np.abs(amounts[1:-1] - line) > KINK * size]
    return within([np.column_stack([kinks, kinks])], duration)


def within(times: Iterable[np.ndarray], duration: float) -> np.ndarray:
    """Return those of some pairs of times that are inside of a run, ascending and each once, (b, 2) [s]."""
    spans = np.unique(np.concatenate([np.empty((0, 2)), *times]), axis=0)
    return spans[(spans[:, 0] > 0) & (spans[:, 1] < duration)]
