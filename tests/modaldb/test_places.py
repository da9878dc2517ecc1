"""Folders as file systems have them: without locks, behind links that lead nowhere, under clocks that go wrong."""

import errno
import fcntl
import json
import os
import sqlite3
import time
from pathlib import Path
from typing import Any

import pytest

from gudgeon import modaldb
from gudgeon.modaldb.errors import StoreUnusable
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.stores.folder import open_folder
from gudgeon.modaldb.stores.local import running, scratch
from tests.modaldb.samples import INPUTS, mesh

KEY = content_key(INPUTS)
NAME = "a" * 32
ROW = {"command": "run", "scene": "a", "stage": "modes", "share": 0.5, "begun": 1e9, "host": "here"}


def age(path: Path, seconds: float) -> None:
    """Make a file look as if it was written some time ago."""
    written = time.time() - seconds
    os.utime(path, (written, written))


def test_what_is_told_is_read_whatever_its_length(tmp_path: Path) -> None:
    running.tell(tmp_path, NAME, ROW | {"scene": "é" * 5000})
    (row,) = running.running(tmp_path)
    assert row == ROW | {"scene": "é" * 200}


@pytest.mark.parametrize(
    "text",
    [
        "{",
        "[1]",
        "[" * 100_000,
        '{"command": 1}',
        json.dumps(ROW | {"begun": "now"}),
        json.dumps(ROW | {"begun": 1e13}),
    ],
)
def test_what_says_nothing_is_left_out_and_removed(text: str, tmp_path: Path) -> None:
    running.tell(tmp_path, NAME, ROW)
    path = tmp_path / running.FOLDER / f"{'b' * 32}.json"
    path.write_text(text)
    path.with_suffix(".new").write_text(text)
    assert running.running(tmp_path) == [ROW]
    for one in (path, path.with_suffix(".new")):
        age(one, 2 * running.SILENT)
    assert running.running(tmp_path) == [ROW]
    assert [one.stem for one in path.parent.iterdir()] == [NAME]


def test_a_clock_that_is_set_back_by_a_day(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A command that is dead is not alive for a day, one that lives tells so again, and what it makes is found."""
    running.tell(tmp_path, NAME, ROW)
    age(tmp_path / running.FOLDER / f"{NAME}.json", -86400)
    assert running.running(tmp_path) == []
    running.tell(tmp_path, NAME, ROW)
    assert running.running(tmp_path) == [ROW]
    store = open_folder(tmp_path / "db")
    store.put(KEY, "mesh", mesh(), INPUTS)
    age(store.path(KEY), -86400)
    now = time.time()
    monkeypatch.setattr(time, "time", lambda: now - 86400)
    store.put(other := content_key({"n": 1}), "mesh", mesh(), {"n": 1})
    store.tag("first", KEY)
    store.note(other, "scene", "part")
    assert {entry.key for entry in modaldb.open(store.root).find()} == {KEY, other}
    assert modaldb.open(store.root).fault(KEY) is None
    assert not list(scratch.dead_scratch(store.root))


def test_a_file_system_without_locks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Records are whole by their names, the index is made in memory, and a file that is being written is left alone."""

    def refused(*arguments: Any, **keywords: Any) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    connect = sqlite3.connect

    def connected(path: Any, **keywords: Any) -> sqlite3.Connection:
        if str(path) != ":memory:":
            raise sqlite3.OperationalError("disk I/O error")
        return connect(path, **keywords)

    monkeypatch.setattr(fcntl, "flock", refused)
    monkeypatch.setattr(sqlite3, "connect", connected)
    store = open_folder(tmp_path / "db")
    store.put(KEY, "mesh", mesh(), INPUTS)
    store.tag("first", KEY)
    written = store.path(KEY).parent / f"{scratch.PREFIX}{'0' * 32}"
    written.write_bytes(b"of somebody who writes")
    store = open_folder(tmp_path / "db")
    assert store.fault(KEY) is None
    assert [(entry.key, entry.tags) for entry in store.find()] == [(KEY, ("first",))]
    assert not store.leftovers()
    age(written, 2 * scratch.DAY)
    assert [leftover.place for leftover in store.leftovers()] == [str(written)]


def test_links_that_lead_nowhere(tmp_path: Path) -> None:
    (tmp_path / "db").symlink_to(tmp_path / "gone")
    with pytest.raises(StoreUnusable, match=r"db: a link to .*gone, which is no folder; make that folder, or remove"):
        modaldb.open(tmp_path / "db").put(KEY, "mesh", mesh(), INPUTS)
    (tmp_path / "gone").mkdir()
    (tmp_path / "gone" / KEY[:2]).symlink_to(tmp_path / "lost")
    with pytest.raises(StoreUnusable, match=f"{KEY[:2]}: cannot be written"):
        modaldb.open(tmp_path / "db").put(KEY, "mesh", mesh(), INPUTS)
