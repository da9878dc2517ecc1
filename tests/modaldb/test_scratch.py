"""Files that are being written, and the folders of a database that a group shares."""

import fcntl
import os
import resource
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from gudgeon import modaldb
from gudgeon.modaldb.format import hdf5
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.stores.folder import FolderStore
from gudgeon.modaldb.stores.local import scratch
from tests.modaldb.samples import INPUTS, mesh, modes

KEY = content_key(INPUTS)
FULL = """
import resource, sys
from gudgeon import modaldb
from gudgeon.modaldb.keys import content_key
from tests.modaldb.samples import INPUTS, modes
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]),) * 2)
try:
    modaldb.open(sys.argv[1]).put(content_key(INPUTS), "modes", modes(), INPUTS)
except modaldb.RecordNotWritten as error:
    print(error)
    sys.exit(1)
"""


@pytest.fixture
def store(tmp_path: Path) -> FolderStore:
    return modaldb.open(tmp_path / "db")


@pytest.mark.parametrize("limit", [0, 512, 5000, 30_000])
def test_a_file_that_may_not_grow_is_one_line(limit: int, tmp_path: Path) -> None:
    """The kernel ends the write, as it does on a full disk."""
    command = [sys.executable, "-c", FULL, str(tmp_path / "db"), str(limit)]
    found = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parents[2])
    assert (found.returncode, found.stderr) == (1, "")
    assert "the modes record of 0.1" in found.stdout
    assert "MB was not written (File too large)" in found.stdout
    assert found.stdout.count("\n") == 1
    assert [path for path in (tmp_path / "db").rglob("*") if path.is_file()] == []
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] == resource.RLIM_INFINITY


def test_records_are_built_in_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """HDF5's library opens no file, whatever stands in the folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mesh record").write_text("somebody's")
    hdf5.record_bytes("mesh", mesh(), INPUTS)
    assert [path.read_text() for path in tmp_path.iterdir()] == ["somebody's"]


@pytest.mark.parametrize("mode", [0o755, 0o775, 0o2770, 0o700])
def test_folders_and_files_take_the_permissions_of_the_root(mode: int, store: FolderStore) -> None:
    store.root.mkdir()
    store.root.chmod(mode)
    group = 12345 if os.geteuid() == 0 else store.root.stat().st_gid
    os.chown(store.root, -1, group)
    store.root.chmod(mode)
    old = os.umask(0o077)
    try:
        store.put(KEY, "mesh", mesh(), INPUTS)
    finally:
        os.umask(old)
    folder, record = store.path(KEY).parent.stat(), store.path(KEY).stat()
    assert (stat.S_IMODE(folder.st_mode), folder.st_gid) == (mode, group)
    assert (stat.S_IMODE(record.st_mode), record.st_gid) == (mode & 0o666, group)


def test_scratch_of_living_writers_stays(store: FolderStore) -> None:
    store.put(KEY, "modes", modes(), INPUTS)
    folder = store.path(KEY).parent
    dead, living = folder / ".writing-dead", folder / ".writing-living"
    dead.write_bytes(b"x")
    with living.open("wb") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert scratch.dead_scratch(store.root) == [dead]
        modaldb.open(store.root).put(content_key({"n": 1}), "mesh", mesh(), {"n": 1})
        assert sorted(path.name for path in folder.iterdir()) == sorted([living.name, f"{KEY}.h5"])


def test_a_scratch_that_was_removed_is_made_again(store: FolderStore, monkeypatch: pytest.MonkeyPatch) -> None:
    """Between its making and its lock another process may take it for a dead writer's."""
    store.root.mkdir()
    lock, taken = fcntl.flock, []

    def remove_first(descriptor: int, how: int) -> None:
        if not taken:
            taken.extend(store.root.glob(".writing-*"))
            taken[0].unlink()
        lock(descriptor, how)

    monkeypatch.setattr(fcntl, "flock", remove_first)
    with scratch.scratch_file(store.root, store.root.stat()) as (descriptor, path):
        assert path != taken[0]
        scratch.write_whole(descriptor, (b"abc", b"def"))
        assert path.read_bytes() == b"abcdef"
    assert [*store.root.iterdir()] == []


def test_a_write_that_takes_a_part_goes_on(store: FolderStore, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on a file system over a network, or at a signal."""
    whole, sizes = os.write, list[int]()
    monkeypatch.setattr(os, "write", lambda descriptor, data: sizes.append(len(data)) or whole(descriptor, data[:1000]))
    store.put(KEY, "mesh", mesh(), INPUTS)
    monkeypatch.undo()
    assert len(sizes) > 3
    assert modaldb.open(store.root).examine(KEY) is None
