"""Progress on the terminal."""

import sys


class Console:
    """Draws progress: a bar on a terminal, a line per stage otherwise."""

    last_stage = ""

    def __init__(self, quiet: bool) -> None:
        self._bar = sys.stderr.isatty()
        self._quiet = quiet and not self._bar
        self._shown = ""

    def progress(self, stage: str, share: float) -> None:
        """Show that `share` of a stage is done, 0 to 1."""
        type(self).last_stage = stage if share < 1.0 else ""
        if self._bar:
            text = f"{stage:6} [{'#' * int(24 * share):.<24}] {share:4.0%}" if share < 1.0 else ""
            print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)
        elif not self._quiet and share < 1.0 and stage != self._shown:
            self._shown = stage
            print(f"{stage} …", file=sys.stderr, flush=True)
