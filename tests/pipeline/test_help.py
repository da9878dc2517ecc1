"""Help with examples of every command, and completion by the shell."""

import argparse
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from gudgeon.pipeline.cli import main
from gudgeon.pipeline.cli.help.completion import script, words
from gudgeon.pipeline.cli.help.examples import EXAMPLES
from gudgeon.pipeline.cli.parser import build_parser
from tests.pipeline.small import write_scene

OWN_HELP = {"db", "serve"}
"""Commands whose examples are those of their subcommands, in docs/service.md."""
LINES = [(name, line) for name, lines in EXAMPLES.items() for line, _ in lines if line.startswith("gudgeon ")]


def test_every_command_has_examples() -> None:
    commands = {command for command, _ in words(build_parser()) if command and " " not in command}
    assert commands - OWN_HELP == EXAMPLES.keys()


@pytest.mark.parametrize(("command", "line"), LINES)
def test_examples_are_commands(command: str, line: str) -> None:
    line = line.partition(" | ")[0].partition(" > ")[0]
    options = build_parser().parse_args(shlex.split(line)[1:])
    assert shlex.split(line)[1] == command
    assert options.action


def test_help_shows_the_examples_of_its_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["linear", "--help"])
    printed = capsys.readouterr().out
    assert "gudgeon linear data/held-beam --force contact.stop" in printed
    assert "gudgeon doctor" not in printed


@pytest.mark.parametrize(
    ("line", "expected"),
    [(["db", "l"], "ls"), (["run", "--toler"], "--tolerance"), (["stat"], "status"), (["example", "co"], "copy")],
)
def test_bash_completes(line: list[str], expected: str) -> None:
    bash = shutil.which("bash")
    assert bash is not None
    given = " ".join(shlex.quote(word) for word in ["gudgeon", *line])
    test = f"COMP_WORDS=({given}); COMP_CWORD={len(line)}; _gudgeon; echo ${{COMPREPLY[@]}}"
    text = f"{script('bash', build_parser)}\n{test}"
    found = subprocess.run([bash, "-c", text], capture_output=True, text=True, check=True)
    assert found.stdout.split() == [expected]


def parsers(parser: argparse.ArgumentParser, name: str = "gudgeon") -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Yield every command, also those below another one."""
    below = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    if name != "gudgeon":
        yield name, parser
    for action in below:
        for one, command in action.choices.items():
            yield from parsers(command, f"{name} {one}")


def test_every_command_takes_verbose() -> None:
    found = dict(parsers(build_parser()))
    assert {"gudgeon run", "gudgeon db ls", "gudgeon example copy", "gudgeon doctor", "gudgeon serve"} <= found.keys()
    assert [name for name, one in found.items() if "--verbose" not in one._option_string_actions] == []


def test_verbose_tells_what_is_fresh_and_what_is_computed(tmp_path: Path) -> None:
    """In lines of the standard library's logging on standard error; without it none of them."""
    command = [sys.executable, "-m", "gudgeon.pipeline", "mesh", str(write_scene(tmp_path / "skirt"))]
    for extra, said in ((["-v"], "computed in"), (["-v"], "fresh, record"), ([], None)):
        child = subprocess.run([*command, *extra], cwd=tmp_path, capture_output=True, text=True, check=True)
        lines = [line for line in child.stderr.splitlines() if line.startswith("gudgeon.pipeline.stages.make: ")]
        assert [said in line and "mesh of 'skirt'" in line for line in lines] == ([True] if said else [])
    listing = [sys.executable, "-m", "gudgeon.pipeline", "db", "-v", "ls"]
    assert subprocess.run(listing, cwd=tmp_path, capture_output=True).returncode == 0
