"""Help with examples of every command, and completion by the shell."""

import contextlib
import os
import pty
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from gudgeon.pipeline.cli import main
from gudgeon.pipeline.cli.help.completion import commands, script
from gudgeon.pipeline.cli.help.examples import EXAMPLES
from gudgeon.pipeline.cli.help.usage import GROUPS
from gudgeon.pipeline.cli.parser import build_parser
from tests.pipeline.small import write_scene

ROOT = Path(__file__).resolve().parents[2]
OWN_HELP = {"db", "serve"}
"""Commands whose examples are those of their subcommands, in docs/service.md."""
LINES = [(name, line) for name, lines in EXAMPLES.items() for line, _ in lines if line.startswith("gudgeon ")]


def test_every_command_has_examples() -> None:
    names = {command for command, _ in commands(build_parser()) if command and " " not in command}
    assert names - OWN_HELP == EXAMPLES.keys()


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


def test_help_groups_every_command_once(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--help"])
    printed = capsys.readouterr().out
    texts = {title: printed.partition(f"\n{title}:\n")[2].partition("\n\n")[0] for title in GROUPS}
    shown = {title: tuple(re.findall(r"^  (\w+) ", text, re.MULTILINE)) for title, text in texts.items()}
    assert shown == GROUPS
    names = [command for command, _ in commands(build_parser()) if command and " " not in command]
    assert sorted(name for group in GROUPS.values() for name in group) == sorted(names)


@pytest.mark.parametrize(("variables", "coloured"), [({}, True), ({"NO_COLOR": "1"}, False)])
def test_help_is_coloured_on_a_terminal_alone(variables: dict[str, str], coloured: bool) -> None:
    """The same words on a pseudo-terminal as in a pipe, which gets no colours."""
    command = [sys.executable, "-m", "gudgeon.pipeline", "run", "--help"]
    environment = {key: value for key, value in os.environ.items() if key != "NO_COLOR"} | {"COLUMNS": "100"}
    plain = subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout
    terminal, end = pty.openpty()
    child = subprocess.Popen(command, env=environment | {"TERM": "xterm-256color"} | variables, stdout=end)
    os.close(end)
    printed = b""
    with contextlib.suppress(OSError):  # How a pseudo-terminal ends on Linux.
        while text := os.read(terminal, 65536):
            printed += text
    os.close(terminal)
    assert child.wait() == 0
    assert (b"\x1b[" in printed, "\x1b[" in plain) == (coloured, False)
    assert re.sub(r"\x1b\[[0-9;]*m", "", printed.decode()).lower().split() == plain.lower().split()


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("db l", "ls"),
        ("run --toler", "--tolerance"),
        ("stat", "status"),
        ("example co", "copy"),
        ("run data/two-m", "data/two-mass"),
        ("completion z", "zsh"),
    ],
)
def test_bash_completes(line: str, expected: str) -> None:
    bash = shutil.which("bash")
    assert bash is not None
    words = ["gudgeon", *line.split()]
    test = f"COMP_WORDS=({' '.join(words)}); COMP_CWORD={len(words) - 1}; _shtab_gudgeon; echo ${{COMPREPLY[@]}}"
    text = f"{script('bash', build_parser())}\n{test}"
    child = subprocess.run([bash, "-c", text], capture_output=True, text=True, check=True, cwd=ROOT)
    assert child.stdout.split() == [expected]


READ = {
    "zsh": 'autoload -U compinit; compinit -uD; eval "$(cat)"; print ${_comps[gudgeon]}',
    "fish": 'source; complete -C "gudgeon run --toler"',
}
"""What reads a script and shows that it is in use."""


@pytest.mark.parametrize(("shell", "expected"), [("zsh", "_shtab_gudgeon"), ("fish", "--tolerance")])
def test_other_shells_take_their_script(shell: str, expected: str) -> None:
    text = script(shell, build_parser())
    assert "tolerance" in text
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed")
    child = subprocess.run([shell, "-c", READ[shell]], input=text, capture_output=True, text=True, check=True)
    assert child.stdout.split()[0] == expected


def test_every_command_takes_verbose() -> None:
    parsers = {name: parser for name, parser in commands(build_parser()) if name}
    assert {"run", "db ls", "example copy", "doctor", "serve"} <= parsers.keys()
    assert [name for name, parser in parsers.items() if "--verbose" not in parser._option_string_actions] == []


def test_verbose_tells_what_is_fresh_and_what_is_computed(tmp_path: Path) -> None:
    """In lines of the standard library's logging on standard error; without it none of them."""
    command = [sys.executable, "-m", "gudgeon.pipeline", "mesh", str(write_scene(tmp_path / "skirt"))]
    for extra, said in ((["-v"], "computed in"), (["-v"], "fresh, record"), ([], None)):
        child = subprocess.run([*command, *extra], cwd=tmp_path, capture_output=True, text=True, check=True)
        lines = [line for line in child.stderr.splitlines() if line.startswith("gudgeon.pipeline.stages.run: ")]
        assert [said in line and "mesh of 'skirt'" in line for line in lines] == ([True] if said else [])
    listing = [sys.executable, "-m", "gudgeon.pipeline", "db", "-v", "ls"]
    assert subprocess.run(listing, cwd=tmp_path, capture_output=True).returncode == 0
