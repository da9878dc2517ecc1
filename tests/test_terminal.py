"""Texts of files and servers on standard error: they command no terminal."""

import io
import sys
from pathlib import Path

import pytest

from gudgeon.pipeline.cli import main
from gudgeon.pipeline.cli.streams import CLEAR, usable_streams
from tests.modaldb.test_answers import answering, http


def test_a_key_of_a_scene_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.toml").write_text('"\\u001b]0;owned\\u0007\\u009b2J\\u202e" = 1\n')
    assert main(["plan", str(tmp_path / "scene.toml")]) == 2
    text = capsys.readouterr().err
    assert "owned" in text
    assert text.replace("\n", "").isprintable()


def test_a_detail_of_a_server(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GUDGEON_DB_WAIT", "0")
    answer = http(b'{"error": "StoreUnusable", "detail": "a\\u001b[2Jb\\u0007"}', "404 Not Found")
    with answering(answer) as (url, _):
        assert main(["db", "ls", "--db", url]) == 2
    text = capsys.readouterr().err
    assert "a\N{REPLACEMENT CHARACTER}[2Jb\N{REPLACEMENT CHARACTER}" in text
    assert "\033" not in text


def test_our_own_progress_clears_its_line(monkeypatch: pytest.MonkeyPatch) -> None:
    written = io.StringIO()
    monkeypatch.setattr(sys, "stderr", written)
    with usable_streams():
        print(f"{CLEAR}modes\033[1m", end="", file=sys.stderr)
    assert written.getvalue() == f"{CLEAR}modes\N{REPLACEMENT CHARACTER}[1m"
