"""Copies of shipped scenes: what is printed to try runs."""

import re
from pathlib import Path

import pytest

from gudgeon.pipeline.cli import main


@pytest.mark.parametrize("name", ["base-sensor", "rod-wall"])
def test_what_is_printed_to_try_is_a_scene(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also of a folder whose scenes have other names than scene.toml."""
    monkeypatch.chdir(tmp_path)
    assert main(["example", "copy", name]) == 0
    (place,) = re.findall(r"`gudgeon run (.*)`", capsys.readouterr().out)
    assert main(["plan", place]) == 0
