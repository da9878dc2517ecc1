"""The index: the same answer as the folder's files, whatever became of it; never more work than what is new."""

import json
import os
import sqlite3
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.stores import index
from gudgeon.modaldb.stores.folder import FolderStore, open_folder
from gudgeon.modaldb.stores.local.names import NAMES
from gudgeon.modaldb.stores.query import Query
from tests.modaldb.samples import INPUTS, mesh, modes

COUNT = 5


@pytest.fixture
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FolderStore:
    """A folder of five meshes, each added to the index as it is put."""
    monkeypatch.setattr(index, "EVERY", 0.0)
    made = open_folder(tmp_path / "db")
    for number in range(COUNT):
        put(made, number)
    return made


def put(store: FolderStore, number: int) -> str:
    inputs = INPUTS | {"number": number}
    key = content_key(inputs)
    store.put(key, "mesh", mesh(), inputs)
    return key


def numbers(store: FolderStore) -> list[int]:
    return sorted(one.inputs["number"] for one in store.find())


@pytest.fixture
def looked(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Note every file that an index looks into."""
    found: list[str] = []
    read = index.FolderCatalogue.read

    def noted(self: index.FolderCatalogue, key: str) -> object:
        found.append(key)
        return read(self, key)

    monkeypatch.setattr(index.FolderCatalogue, "read", noted)
    return found


def test_what_was_put_is_not_looked_at_again(store: FolderStore, looked: list[str]) -> None:
    assert numbers(store) == [*range(COUNT)]
    assert looked == []


def test_records_are_added_several_at_a_time(store: FolderStore, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(index, "TOGETHER", 4)
    monkeypatch.setattr(index, "EVERY", 1e9)
    looked: list[str] = []
    read = index.FolderCatalogue.read
    monkeypatch.setattr(index.FolderCatalogue, "read", lambda self, key: (looked.append(key), read(self, key))[1])
    keys = [put(store, COUNT + number) for number in range(6)]
    # Another process, as after this one was killed, looks at the two that it had not added.
    assert numbers(open_folder(store.root)) == [*range(COUNT + 6)]
    assert sorted(looked) == sorted(keys[4:])
    assert numbers(store) == [*range(COUNT + 6)]
    assert len(looked) == 2


def test_what_waits_is_added_when_the_program_ends(tmp_path: Path, looked: list[str]) -> None:
    text = (
        "from tests.modaldb.test_index import open_folder, put\nimport sys\n"
        "store = open_folder(sys.argv[1])\nfor number in range(3): put(store, number)"
    )
    subprocess.run([sys.executable, "-c", text, str(tmp_path / "db")], check=True, cwd=Path(__file__).parents[2])
    assert numbers(open_folder(tmp_path / "db")) == [0, 1, 2]
    assert looked == []


def test_only_what_is_new_is_looked_at(store: FolderStore, looked: list[str]) -> None:
    key = put(store, COUNT)
    os.utime(store.path(key), (1, 1))
    assert numbers(store) == [*range(COUNT + 1)]
    assert looked == [key]


def test_a_missing_index_is_made_anew(store: FolderStore, looked: list[str]) -> None:
    store.index.path.unlink()
    assert numbers(store) == [*range(COUNT)]
    assert len(looked) == COUNT


@pytest.mark.parametrize("content", [b"", b"no database" * 1000, b"SQLite format 3\0" + bytes(4000)])
def test_a_damaged_index_is_made_anew(content: bytes, store: FolderStore) -> None:
    store.index.path.write_bytes(content)
    assert numbers(store) == [*range(COUNT)]
    put(store, COUNT)
    assert numbers(open_folder(store.root)) == [*range(COUNT + 1)]


def test_an_index_of_another_version_is_made_anew(store: FolderStore) -> None:
    with sqlite3.connect(store.index.path) as base:
        base.execute("PRAGMA user_version = 99")
        base.execute("CREATE TABLE later (a)")
    base.close()
    assert numbers(store) == [*range(COUNT)]


def test_an_index_that_is_locked_delays_no_put(store: FolderStore, looked: list[str]) -> None:
    base = sqlite3.connect(store.index.path, isolation_level=None)
    base.execute("BEGIN IMMEDIATE")
    key = put(store, COUNT)
    base.execute("COMMIT")
    base.close()
    assert numbers(store) == [*range(COUNT + 1)]
    assert looked == [key]


def test_an_index_that_cannot_be_kept(store: FolderStore) -> None:
    store.index.path.unlink()
    store.index.path.mkdir()
    assert numbers(store) == [*range(COUNT)]


def test_asking_makes_nothing(tmp_path: Path) -> None:
    assert open_folder(tmp_path / "none").find() == []
    assert not (tmp_path / "none").exists()


def test_removed_and_foreign_files(store: FolderStore) -> None:
    entries = store.find()
    store.path(entries[0].key).unlink()
    (store.root / "notes.txt").write_text("somebody's")
    (store.root / "ab").mkdir(exist_ok=True)
    (store.root / "ab" / f"{'cd' * 32}.h5").write_bytes(b"not where a record stands")
    (store.root / "ab" / f"{'ab' * 32}.h5").write_bytes(b"no record")
    found = store.find()
    assert len(found) == COUNT
    assert [one.kind for one in found].count(index.UNKNOWN) == 1
    assert store.find(Query(kind=index.UNKNOWN))[0].key == "ab" * 32


def test_a_file_of_another_key_is_unknown(store: FolderStore) -> None:
    first, second = (one.key for one in store.find()[:2])
    store.path(first).write_bytes(store.path(second).read_bytes())
    assert {one.key for one in store.find(Query(kind=index.UNKNOWN))} == {first}


def test_names_are_read_on_from_where_the_index_stood(store: FolderStore) -> None:
    key = store.find()[0].key
    store.note(key, "one", "part")
    assert store.find(Query(scene="one"))[0].key == key
    with (store.root / NAMES).open("a") as file:
        file.write('{"component":"part","key":"cut off')
    assert store.find(Query(scene="one"))[0].key == key
    store.note(key, "two", "part")  # The line of a killed writer is ended first.
    assert store.find(Query(scene="two"))[0].uses == (("one", "part"), ("two", "part"))
    (store.root / NAMES).write_text(json.dumps({"component": "c", "key": key, "scene": "three"}) + "\nnonsense\n[]\n")
    assert store.find(Query(key=key))[0].uses == (("three", "c"),)


def test_a_use_is_noted_once_and_again_where_the_file_was_removed(store: FolderStore) -> None:
    key, other = store.find()[0].key, open_folder(store.root)
    for one in (store, other, store):
        one.note(key, "one", "part")
    assert len((store.root / NAMES).read_text().splitlines()) == 1
    (store.root / NAMES).unlink()
    store.note(key, "one", "part")
    assert len((store.root / NAMES).read_text().splitlines()) == 1


def work_of_a_put(store: FolderStore, number: int) -> list[str]:
    """Put a record; return the names of the calls that look at files and folders, and of writes to the index."""
    (store.root / content_key(INPUTS | {"number": number})[:2]).mkdir(exist_ok=True)
    counted: list[str] = []

    def noted(name: str, whole: Any) -> Any:
        return lambda *arguments, **options: (counted.append(name), whole(*arguments, **options))[1]

    with pytest.MonkeyPatch.context() as patch:
        for name in ("open", "scandir", "stat", "listdir"):
            patch.setattr(os, name, noted(name, getattr(os, name)))
        patch.setattr(index, "_insert", noted("insert", index._insert))
        put(store, number)
    return sorted(counted)


def test_a_put_does_as_much_beside_a_hundred_records_as_beside_five(store: FolderStore) -> None:
    few = work_of_a_put(store, 100)
    for number in range(200, 300):
        put(store, number)
    assert len(store.find()) == COUNT + 101
    assert work_of_a_put(store, 101) == few
    assert "insert" in few


def test_modes_refer_to_their_mesh(store: FolderStore) -> None:
    target = store.find()[0].key
    inputs = INPUTS | {"mesh": target}
    store.put(content_key(inputs), "modes", modes(), inputs)
    assert store.find(Query(kind="modes"))[0].refers == (target,)
    assert store.find(Query(key=target))[0].referred == 1
