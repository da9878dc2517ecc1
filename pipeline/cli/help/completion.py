"""`gudgeon completion`: scripts by which a shell completes commands, options and files."""

import argparse
from collections.abc import Iterator

SHELLS = ("bash", "zsh", "fish", "tcsh")


def commands(parser: argparse.ArgumentParser, name: str = "") -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Yield each command with its parser; the program itself as the empty command."""
    yield name, parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for child, command in action.choices.items():
                yield from commands(command, f"{name} {child}".strip())


def script(shell: str, parser: argparse.ArgumentParser) -> str:
    """Return the script of a shell; an argument without choices is completed as the path of a file."""
    import shtab

    for _, command in commands(parser):
        for action in command._actions:
            if action.nargs != 0 and action.choices is None:
                action.complete = shtab.FILE  # type: ignore[attr-defined]
    return shtab.complete(parser, shell)
