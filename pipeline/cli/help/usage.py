"""Errors of the command line in one line, with what is near or allowed."""

import argparse
import difflib
import re
from typing import Any, NoReturn

CHOICE = re.compile(r"argument (?P<name>.+?): invalid choice: '(?P<given>.*)' \(choose from (?P<allowed>.*)\)")

NEAR = 0.7
"""Least similarity of a name that is suggested, as of difflib."""


class Parser(argparse.ArgumentParser):
    """A parser that ends with one line and exit code 2; those of its commands are of the same kind."""

    def error(self, message: str) -> NoReturn:
        """Print what is wrong and where its help is, and exit."""
        if choice := CHOICE.fullmatch(message):
            name, given = choice["name"], choice["given"]
            allowed = re.findall(r"'([^']*)'", choice["allowed"])
            hint = _nearest(given, allowed) or f"; allowed: {', '.join(allowed)}"
            message = f"{name}: invalid choice: '{given}'{hint}"
        self.exit(2, f"{self.prog}: {message}; see '{self.prog} --help'\n")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> tuple[Any, list[str]]:  # type: ignore[override]
        """Parse; what is no option is refused here, by the command that was given, with its own nearest option."""
        found, rest = super().parse_known_args(args, namespace)
        if rest:
            options = [name for action in self._actions for name in action.option_strings]
            self.error(f"unrecognized arguments: {' '.join(rest)}{_nearest(rest[0].partition('=')[0], options)}")
        return found, rest


def _nearest(given: str, allowed: list[str]) -> str:
    near = difflib.get_close_matches(given, allowed, 1, cutoff=NEAR)
    return f" (did you mean '{near[0]}'?)" if near else ""
