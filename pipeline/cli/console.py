"""Progress on the terminal."""

import sys
import time
from collections.abc import Callable
from typing import ClassVar

from gudgeon.pipeline.cli.streams import CLEAR

LINES = 10.0
"""Seconds between lines of a stage where standard error is no terminal."""
SOON = 1.0
"""Seconds of a stage after which the time left is shown."""


class Console:
    """Draws progress: one line that is renewed on a terminal, and elsewhere a line per stage and every few seconds."""

    last_stage = ""
    begins: ClassVar[list[Callable[[], None]]] = []
    """What is called where a stage begins."""

    def __init__(self, quiet: bool) -> None:
        self._bar = sys.stderr.isatty()
        self._quiet = quiet and not self._bar
        self._shown = ""
        self._started = self._begin = self._told = 0.0
        self._first = self._last = 0.0

    def progress(self, stage: str, share: float) -> None:
        """Show the share of a stage that is done, 0 to 1, and the time taken and left; one that decreases begins anew.

        Args:
            stage: Its name; what is done of it may follow in brackets, as in `plot (3 of 7 pictures)`.
        """
        stage, _, detail = stage.partition(" (")
        said = [detail.removesuffix(")")] if detail else []
        type(self).last_stage = stage if share < 1.0 else ""
        clock = time.monotonic()
        restarted = stage != self._shown or share < self._last
        if restarted:
            self._begin_stage()
            self._started = clock
        # What comes before the first share, such as loading modules, says nothing about the rest.
        if restarted or self._last == 0.0:
            self._begin, self._first = clock, share
            if stage != self._shown and share < 1.0:
                self._print_line(f"{stage} …", clock)
            self._shown = stage
        self._last = share
        done, taken = share - self._first, clock - self._begin
        if done > 0 and taken > SOON and share < 1.0:
            said += [f"{_duration(clock - self._started)} elapsed", f"{_duration(taken * (1.0 - share) / done)} left"]
            if clock - self._told >= LINES:
                self._print_line(f"{stage} … {', '.join([f'{share:.0%}', *said])}", clock)
        if self._bar:
            bar = f"{stage:6} [{'#' * int(24 * share):.<24}] {share:4.0%}"
            text = f"{bar}  {', '.join(said)}".rstrip() if share < 1.0 else ""
            print(f"{CLEAR}{text}", end="", file=sys.stderr, flush=True)

    def _begin_stage(self) -> None:
        for call in self.begins:
            call()

    def _print_line(self, text: str, clock: float) -> None:
        """Print a line of progress where there is no bar."""
        if not self._bar and not self._quiet:
            print(text, file=sys.stderr, flush=True)
            self._told = clock


def _duration(seconds: float) -> str:
    """Return a time in one or two units."""
    total = round(seconds)
    if total < 60:
        return f"{total} s"
    minutes, seconds_left = divmod(total, 60)
    return f"{minutes} min {seconds_left:02d} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02d} min"
