"""Errors of the command line in one line, with what is near or allowed; help in colour, its commands in groups."""

import argparse
import difflib
import os
import re
import sys
from typing import Any, NoReturn

CHOICE = re.compile(r"argument (?P<name>.+?): invalid choice: '(?P<given>.*)' \(choose from (?P<allowed>.*)\)")

NEAR = 0.7
"""Least similarity of a name that is suggested, as of difflib."""

GROUPS = {
    "stages": ("run", "mesh", "modes", "morph", "solve", "plot", "status", "plan"),
    "results and reports": ("report", "study", "robustness", "linear", "export"),
    "applications": ("wear", "calibrate", "identify", "wrench", "signals", "infer", "feel"),
    "parts and files": ("new", "faces", "example", "schema"),
    "database and service": ("db", "serve"),
    "machine": ("doctor", "completion"),
}
"""Commands of each group of the program's help."""


class Parser(argparse.ArgumentParser):
    """A parser that ends with one line and exit code 2; those of its commands are of the same kind."""

    def print_help(self, file: Any = None) -> None:
        """Print the help, in colour on a terminal, but for NO_COLOR."""
        if (file or sys.stdout).isatty() and not os.environ.get("NO_COLOR"):
            from rich_argparse import RawDescriptionRichHelpFormatter

            self.formatter_class = RawDescriptionRichHelpFormatter
        super().print_help(file)

    def group_commands(self, commands: Any) -> None:
        """List the commands of `add_subparsers` in the help by the groups of `GROUPS`."""
        self._positionals._group_actions.remove(commands)
        listed = {action.dest: action for action in commands._get_subactions()}
        for title, names in GROUPS.items():
            self.add_argument_group(title)._group_actions.extend(listed[name] for name in names)

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
