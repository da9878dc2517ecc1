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
        now = time.monotonic()
        if stage != self._shown or share < self._last:
            self._started = now
        # What comes before the first share, such as compiling, says nothing about the rest.
        if stage != self._shown or share < self._last or self._last == 0.0:
            self._begin, self._first = now, share
            fresh, self._shown = stage != self._shown, stage
            if fresh and not self._bar and not self._quiet and share < 1.0:
                print(f"{stage} …", file=sys.stderr, flush=True)
                self._told = now
        self._last = share
        done, taken = share - self._first, now - self._begin
        if done > 0 and taken > SOON and share < 1.0:
            said += [f"{_duration(now - self._started)} elapsed", f"{_duration(taken * (1.0 - share) / done)} left"]
            if not self._bar and not self._quiet and now - self._told >= LINES:
                self._told = now
                print(f"{stage} … {', '.join([f'{share:.0%}', *said])}", file=sys.stderr, flush=True)
        if self._bar:
            bar = f"{stage:6} [{'#' * int(24 * share):.<24}] {share:4.0%}"
            text = f"{bar}  {', '.join(said)}".rstrip() if share < 1.0 else ""
            print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)


def _duration(seconds: float) -> str:
    """Return a time in one or two units."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    minutes, rest = divmod(whole, 60)
    return f"{minutes} min {rest:02d} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02d} min"
