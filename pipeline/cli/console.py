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
        """Take note that `share` of a stage is done."""
        type(self).last_stage = stage if share < 1.0 else ""
        if self._bar:
            filled = int(24 * share)
            text = (
                "\r\033[K" if share >= 1.0 else f"\r\033[K{stage:6} [{'#' * filled}{'.' * (24 - filled)}] {share:4.0%}"
            )
            print(text, end="", file=sys.stderr, flush=True)
        elif not self._quiet and share < 1.0 and stage != self._shown:
            self._shown = stage
            print(f"{stage} …", file=sys.stderr, flush=True)
