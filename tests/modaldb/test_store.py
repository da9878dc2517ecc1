"""The folder of records: whole or not there, never wrong."""

import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from gudgeon import modaldb
from gudgeon.modaldb.errors import (
    ModalDBError,
    RecordDamaged,
    RecordMismatch,
    RecordMissing,
    RecordNotWritten,
    StoreUnusable,
)
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.records import KINDS
from gudgeon.modaldb.stores.folder import FolderStore, set_aside
from tests.modaldb.samples import INPUTS, SAMPLES, mesh, modes, morph, nodal, same

KEY = content_key(INPUTS)


@pytest.fixture
def store(tmp_path: Path) -> FolderStore:
    return modaldb.open(tmp_path / "db")


def filled(store: FolderStore, kind: str = "modes") -> Path:
    """Put a sample under KEY and return its file."""
    store.put(KEY, kind, SAMPLES[kind](), INPUTS)
    return store.path(KEY)


def leftovers(root: Path) -> list[Path]:
    """Return what is neither a record, nor its folder, nor a file that was moved aside."""
    known = (".h5", ".damaged", ".sqlite")
    return [p for p in root.rglob("*") if p.name.startswith(".") or (p.is_file() and p.suffix not in known)]


@pytest.mark.parametrize("kind", KINDS)
def test_a_record_is_one_file_named_by_its_key(kind: str, store: FolderStore) -> None:
    assert filled(store, kind) == store.root / KEY[:2] / f"{KEY}.h5"
    assert leftovers(store.root) == []


def test_keys_are_sorted_and_complete(store: FolderStore) -> None:
    for n in range(20):
        store.put(content_key({"n": n}), "nodal", nodal(), {"n": n})
    assert list(store.keys()) == sorted(content_key({"n": n}) for n in range(20))


def test_a_store_that_does_not_exist_is_empty(tmp_path: Path) -> None:
    store = modaldb.open(tmp_path / "none" / "db")
    assert list(store.keys()) == []
    assert not store.has(KEY)
    assert not (tmp_path / "none").exists()  # asking makes nothing


def test_equal_key_twice_is_left_as_it_is(store: FolderStore) -> None:
    path = filled(store, "nodal")
    before = path.stat()
    store.put(KEY, "nodal", replace(nodal(), wall_seconds=99.0), INPUTS)
    assert (path.stat().st_ino, path.stat().st_mtime_ns) == (before.st_ino, before.st_mtime_ns)
    assert store.get(KEY, "nodal").wall_seconds == nodal().wall_seconds
    assert leftovers(store.root) == []


def _byte_of(marker: bytes) -> Callable[[bytes], int]:
    return lambda whole: whole.index(marker)


PLACES: dict[str, Callable[[bytes], int]] = {
    "magic": lambda whole: 3,
    "digest": lambda whole: 20,
    "kind": lambda whole: 84,
    "padding": lambda whole: 400,
    "superblock": lambda whole: 512 + 9,
    "attribute name": _byte_of(b"encoding-version"),
    "attribute value": _byte_of(b"macneal"),
    "provenance": _byte_of(b'"stage"'),
    "dataset name": _byte_of(b"residual_flexibility"),
    "data": _byte_of(modes().angular_frequencies.tobytes()),
    "last byte": lambda whole: len(whole) - 1,
}


def _flip(path: Path, place: str) -> None:
    whole = bytearray(path.read_bytes())
    whole[PLACES[place](bytes(whole))] ^= 0x10
    path.write_bytes(whole)


def _assert_made_again(store: FolderStore, path: Path) -> None:
    """Nobody but a writer touches a damaged file; what is put in its place is read."""
    for use in (lambda: store.get(KEY, "modes"), lambda: store.sizes(KEY), lambda: store.provenance(KEY)):
        with pytest.raises(RecordDamaged) as caught:
            use()
        assert str(path) in str(caught.value)
        assert "\n" not in str(caught.value)
    assert not store.has(KEY)
    assert isinstance(store.fault(KEY), RecordDamaged)
    assert path.is_file()
    store.put(KEY, "modes", modes(), INPUTS)
    assert path.with_suffix(".damaged").is_file()
    assert same(store.get(KEY, "modes"), modes())


@pytest.mark.parametrize("place", PLACES)
def test_flipped_byte_is_made_again(place: str, store: FolderStore) -> None:
    path = filled(store)
    _flip(path, place)
    _assert_made_again(modaldb.open(store.root), path)


@pytest.mark.parametrize("left", [0, 300, 512, 3000, -1])
def test_cut_off_file_is_made_again(left: int, store: FolderStore) -> None:
    path = filled(store)
    path.write_bytes(path.read_bytes()[:left])
    _assert_made_again(modaldb.open(store.root), path)


def test_damage_after_the_first_read_is_noticed(store: FolderStore) -> None:
    """Verified files are not hashed again while their time stamp stands."""
    path = filled(store)
    assert store.has(KEY)
    _flip(path, "data")
    os.utime(path, ns=(1, 1))
    _assert_made_again(store, path)


def test_a_second_damaged_file_replaces_the_first(store: FolderStore) -> None:
    for _ in range(2):
        path = filled(store, "modes")
        path.write_bytes(b"")
        assert set_aside(path) == path.with_suffix(".damaged")
    assert [p.name for p in store.path(KEY).parent.iterdir()] == [f"{KEY}.damaged"]


@pytest.mark.parametrize("kind", ["mesh", "trajectory"])
def test_a_record_is_bound_to_its_key(kind: str, store: FolderStore) -> None:
    """Two records of a kind that have each other's names are sound files with the wrong numbers."""
    inputs = [INPUTS | {"number": number} for number in (1, 2)]
    keys = [content_key(one) for one in inputs]
    for key, one in zip(keys, inputs, strict=True):
        store.put(key, kind, SAMPLES[kind](), one)
    first, second = map(store.path, keys)
    other = second.read_bytes()
    second.write_bytes(first.read_bytes())
    first.write_bytes(other)
    fresh = modaldb.open(store.root)
    for key in keys:
        assert not fresh.has(key)
        for use in (lambda key=key: fresh.get(key, kind), lambda key=key: fresh.sizes(key)):
            with pytest.raises(RecordMismatch, match="holds the record of another key") as caught:
                use()
            assert "\n" not in str(caught.value)
    fresh.put(keys[0], kind, SAMPLES[kind](), inputs[0])
    assert fresh.provenance(keys[0]) == inputs[0]


def test_a_failed_write_leaves_nothing(store: FolderStore, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(RecordNotWritten, match=r"mesh record of 0\.0\d+ MB was not written \(No space"):
            store.put(KEY, "mesh", mesh(), INPUTS)
    assert not store.has(KEY)
    assert leftovers(store.root) == []


def test_an_interrupted_write_leaves_nothing(store: FolderStore, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(_: int) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", interrupted)
        with pytest.raises(KeyboardInterrupt):
            store.put(KEY, "mesh", mesh(), INPUTS)
    assert not store.has(KEY)
    assert leftovers(store.root) == []


def test_store_that_is_a_file(tmp_path: Path) -> None:
    (tmp_path / "db").write_text("not a folder")
    with pytest.raises(StoreUnusable, match=r"db: not a folder"):
        modaldb.open(tmp_path / "db")


def test_store_below_a_file(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    store = modaldb.open(tmp_path / "file" / "db")
    assert not store.has(KEY)
    with pytest.raises(StoreUnusable, match="cannot be written") as caught:
        store.put(KEY, "mesh", mesh(), INPUTS)
    assert str(tmp_path / "file" / "db") in str(caught.value)
    assert "\n" not in str(caught.value)


def test_records_can_be_carried_to_another_store(store: FolderStore, tmp_path: Path) -> None:
    path = filled(store, "morph")
    other = modaldb.open(tmp_path / "other")
    other.path(KEY).parent.mkdir(parents=True)
    shutil.copyfile(path, other.path(KEY))
    assert same(other.get(KEY, "morph"), morph())


def test_all_errors_are_one_family() -> None:
    for error in (RecordDamaged, RecordMismatch, RecordMissing, StoreUnusable):
        assert issubclass(error, ModalDBError)
        assert str(error("the text")) == "the text"
