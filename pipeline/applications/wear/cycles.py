"""Wear carried on over cycles, in updates of the shapes whose size is controlled by doubling the step.

With w(h) the depth that a cycle wears off shapes h, one update over 2 n cycles, h + 2 n w(h), is compared with two
over n, h + n w(h) + n w(h + n w(h)): they differ by n |w(h + n w(h)) − w(h)|, at every angle. The two are kept where
the largest difference is within the tolerance, else n is reduced.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gudgeon.pipeline.applications.wear.shapes import Cycle, Ended, Shapes, Soft, Worn

SAFETY, LEAST, MOST = 0.8, 0.25, 3.0
"""Of the next step over what the difference asks for; least and largest ratio of two steps."""
FEWEST = 0.5
"""Cycles of the two updates of a step: one cycle is not divided."""
Told = Callable[[str, float], None]


@dataclass(frozen=True)
class Update:
    """Shapes after an update."""

    cycles: float
    shapes: Shapes
    step: float
    """Cycles since the last update."""
    difference: float
    """Between one update and two over half of it, the largest over the clearance of its joint [1]."""
    cycle: Cycle
    """Of the shapes before."""
    mean: Cycle
    """Of the shapes in the middle."""


@dataclass
class History:
    """What wear over cycles found."""

    updates: list[Update] = field(default_factory=list)
    marks: dict[float, Shapes] = field(default_factory=dict)
    """Shapes after the cycles that are asked for."""
    runs: int = 0
    rejected: int = 0
    coarse: int = 0
    """Updates of one cycle whose difference exceeds the tolerance."""
    reason: str | None = None
    """Why it ended before the last cycle."""
    first: Cycle | None = None
    last: Cycle | None = None
    """Runs with the shapes of the start and of the last update."""


@dataclass(frozen=True)
class Asked:
    """What is asked for."""

    marks: Sequence[float]
    """Numbers of cycles after which shapes are kept, ascending."""
    tolerance: float
    """Largest difference over the clearance."""


def run_cycles(scene: Worn, request: Asked, tell: Told, on_update: Callable[[History], None]) -> History:
    """Wear a scene's joints over cycles.

    Args:
        on_update: Called after each update, so that what is done is not lost.
    """
    history = History()
    shapes, done, soft = scene.start(), 0.0, Soft()
    step: float | None = None
    try:
        while done < request.marks[-1]:
            base = _run(scene, shapes, soft, history, _share(tell, done / request.marks[-1]))
            history.first, history.last = history.first or base, base
            soft = base.soft
            step = _first(scene, base, request) if step is None else step
            done, shapes, step = _update(scene, (done, shapes, step), base, request, history, tell)
            if done in request.marks:
                history.marks[done] = shapes
            on_update(history)
            if history.reason is not None:
                return history
        history.last = _run(scene, shapes, soft, history, _share(tell, 1.0))
    except Ended as ended:
        history.reason = f"after {done:g} cycles the run failed: {ended}"
    return history


def _update(
    scene: Worn, state: tuple[float, Shapes, float], base: Cycle, request: Asked, history: History, tell: Told
) -> tuple[float, Shapes, float]:
    """Return cycles and shapes after the first update from `state` that keeps the tolerance, and the next step."""
    done, shapes, step = state
    mark = next(m for m in request.marks if m > done)
    while True:
        size = max(FEWEST, min(step, (mark - done) / 2))
        middle = _worn(shapes, base.rate, size)
        if (reason := _through(scene, middle)) is not None:
            history.reason = f"before {done + size:g} cycles {reason}"
            return done, shapes, step
        mean = _run(scene, middle, base.soft, history, _share(tell, done / request.marks[-1]))
        difference = max(
            float(size * np.abs(mean.rate[name] - base.rate[name]).max()) / scale
            for name, scale in scene.scales().items()
        )
        ratio = float(np.clip(SAFETY * np.sqrt(request.tolerance / max(difference, 1e-300)), LEAST, MOST))
        if difference <= request.tolerance or size <= FEWEST:
            break
        history.rejected += 1
        step = size * min(ratio, 0.7)
    history.coarse += difference > request.tolerance
    end = _worn(middle, mean.rate, size)
    if (reason := _through(scene, end)) is not None:
        history.reason = f"before {done + 2 * size:g} cycles {reason}"
        return done, shapes, step
    cycles = mark if mark - done <= 2 * size * (1 + 1e-9) else done + 2 * size
    history.updates.append(Update(cycles, end, cycles - done, difference, base, mean))
    # A step that a mark cut short says little of the next one.
    return cycles, end, max(size * ratio, step if size < step else 0.0)


def _run(scene: Worn, shapes: Shapes, soft: Soft, history: History, tell: Told) -> Cycle:
    history.runs += 1
    return scene.cycle(shapes, soft, tell)


def _first(scene: Worn, base: Cycle, request: Asked) -> float:
    """Return the first step: it wears off as much as the tolerance of the difference."""
    rate = max(float(base.rate[name].max()) / scale for name, scale in scene.scales().items())
    return max(FEWEST, request.tolerance / rate) if rate > 0 else np.inf


def _worn(shapes: Shapes, rate: Shapes, cycles: float) -> Shapes:
    return {name: shape + cycles * rate[name] for name, shape in shapes.items()}


def _through(scene: Worn, shapes: Shapes) -> str | None:
    """Return why shapes are beyond their walls; None if they are not."""
    for name, shape in shapes.items():
        deepest, reason = scene.deepest(name)
        if shape.max() > deepest:
            return reason
    return None


def _share(tell: Told, fraction: float) -> Any:
    return lambda stage, stage_fraction: tell("wear", min(fraction, 1.0))
