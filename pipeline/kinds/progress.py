"""Progress of what a notebook calls."""

import html
import sys
import time
from typing import Any

from gudgeon.pipeline.stages.run_report import Progress

OFTEN = 0.2
"""Seconds between two drawings of a bar."""


def shown(progress: Progress | None) -> Progress:
    """Return a progress that may be called: the given one, or a bar below the cell in a notebook, or nothing."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if progress is not None or not hasattr(shell, "kernel"):
        return progress or (lambda stage, fraction: None)
    return Bar().draw


class Bar:
    """A bar below the cell of a notebook; it is emptied where a stage ends."""

    def __init__(self) -> None:
        self._handle: Any = None
        self._drawn = -OFTEN

    def draw(self, stage: str, fraction: float) -> None:
        """Draw the share of a stage that is done, 0 to 1, at most five times a second."""
        clock = time.monotonic()
        if fraction < 1.0 and clock - self._drawn < OFTEN:
            return
        self._drawn = clock
        fraction_done = min(max(float(fraction), 0.0), 1.0)
        text = f'{html.escape(stage)} <progress max="1" value="{fraction_done:.3f}"></progress> {fraction_done:.0%}'
        page = {
            "text/html": text if fraction_done < 1.0 else "",
            "text/plain": f"{stage} {fraction_done:.0%}" if fraction_done < 1.0 else "",
        }
        if self._handle is None:
            self._handle = sys.modules["IPython.display"].display(page, raw=True, display_id=True)
        else:
            self._handle.update(page, raw=True)
