"""Help with examples of every command, and completion by the shell."""

import shlex
import shutil
import subprocess

import pytest

from gudgeon.pipeline.cli import main
from gudgeon.pipeline.cli.help.completion import script, words
from gudgeon.pipeline.cli.help.examples import EXAMPLES
from gudgeon.pipeline.cli.parser import build_parser

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
