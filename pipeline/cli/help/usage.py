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
    "daily": ("new", "run", "mesh", "modes", "morph", "solve", "plot", "study", "family", "wear"),
    "look": ("faces", "schema", "example", "status", "plan", "linear", "doctor", "completion"),
    "judge": ("report", "robustness"),
    "share": ("db", "serve", "export"),
    "sensors": ("calibrate", "signals", "infer", "wrench", "identify", "feel"),
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
            name, got = choice["name"], choice["given"]
            allowed = re.findall(r"'([^']*)'", choice["allowed"])
            hint = _nearest(got, allowed) or f"; allowed: {', '.join(allowed)}"
            message = f"{name}: invalid choice: '{got}'{hint}"
        self.exit(2, f"{self.prog}: {message}; see '{self.prog} --help'\n")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> tuple[Any, list[str]]:  # type: ignore[override]
        """Parse; what is no option is refused here, by the command that was given, with its own nearest option."""
        options_found, unknown = super().parse_known_args(args, namespace)
        if unknown:
            options = [name for action in self._actions for name in action.option_strings]
            self.error(f"unrecognized arguments: {' '.join(unknown)}{_nearest(unknown[0].partition('=')[0], options)}")
        return options_found, unknown


def _nearest(name: str, allowed: list[str]) -> str:
    matches = difflib.get_close_matches(name, allowed, 1, cutoff=NEAR)
    return f" (did you mean '{matches[0]}'?)" if matches else ""
