"""Progress on the terminal."""

import sys
import time

LINES = 10.0
"""Seconds between lines of a stage where standard error is no terminal."""
SOON = 1.0
"""Seconds of a stage after which the time left is shown."""


class Console:
    """Draws progress: one line that is renewed on a terminal, and elsewhere a line per stage and every few seconds."""

    last_stage = ""

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
        if stage != self._shown or share < self._last:
            self._started = clock
        # What comes before the first share, such as compiling, says nothing about the rest.
        if stage != self._shown or share < self._last or self._last == 0.0:
            self._begin, self._first = clock, share
            fresh, self._shown = stage != self._shown, stage
            if fresh and not self._bar and not self._quiet and share < 1.0:
                print(f"{stage} …", file=sys.stderr, flush=True)
                self._told = clock
        self._last = share
        done, taken = share - self._first, clock - self._begin
        if done > 0 and taken > SOON and share < 1.0:
            said += [f"{_duration(clock - self._started)} elapsed", f"{_duration(taken * (1.0 - share) / done)} left"]
            if not self._bar and not self._quiet and clock - self._told >= LINES:
                self._told = clock
                print(f"{stage} … {', '.join([f'{share:.0%}', *said])}", file=sys.stderr, flush=True)
        if self._bar:
            bar = f"{stage:6} [{'#' * int(24 * share):.<24}] {share:4.0%}"
            text = f"{bar}  {', '.join(said)}".rstrip() if share < 1.0 else ""
            print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)


def _duration(seconds: float) -> str:
    """Return a time in one or two units."""
    total = round(seconds)
    if total < 60:
        return f"{total} s"
    minutes, seconds_left = divmod(total, 60)
    return f"{minutes} min {seconds_left:02d} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02d} min"
