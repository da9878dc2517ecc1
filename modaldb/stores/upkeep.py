"""Examining and tidying a database: what cannot be used, what dead writers left, what no key leads to any more."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from gudgeon.modaldb.errors import ModalDBError, RecordMismatch
from gudgeon.modaldb.keys import KEY, canonical_json
from gudgeon.modaldb.stores.folder import DAMAGED, FolderStore
from gudgeon.modaldb.stores.scratch import dead_scratch


class Leftover(NamedTuple):
    """A file or folder that is of no use."""

    path: Path
    size: int
    """[bytes]"""
    why: str


def verify(store: FolderStore) -> Iterator[tuple[Path, ModalDBError | None]]:
    """Read every record in full; yield its file and why it cannot be used, None where it can."""
    for path in sorted(store.root.glob("??/*.h5")):
        key = path.stem
        if store.path(key) != path or not KEY.fullmatch(key):
            yield path, RecordMismatch(f"{path}: not where a record of a key stands")
        else:
            yield path, store.examine(key)


def leftovers(store: FolderStore, is_current: Callable[[dict[str, Any]], bool]) -> Iterator[Leftover]:
    """Yield what may be removed from a database: scratch of dead writers, damaged records, unreferenced records.

    Args:
        is_current: Whether the inputs of a record are those that this release would make a key of. Records that are
            not, and that no current record refers to, are unreferenced.
    """
    for path in dead_scratch(store.root):
        yield Leftover(path, _size(path), "left by a writer that was killed")
    for path in sorted(store.root.glob(f"??/*{DAMAGED}")):
        yield Leftover(path, _size(path), "damaged, set aside")
    for key in unreferenced(store, is_current):
        path = store.path(key)
        yield Leftover(path, _size(path), "made by other code or libraries, and no record of this release refers to it")


def unreferenced(store: FolderStore, is_current: Callable[[dict[str, Any]], bool]) -> list[str]:
    """Return the sound records that are not current, and that no current one refers to, directly or not."""
    refers: dict[str, set[str]] = {}
    rest: list[str] = []
    for key in list(store.keys()):
        try:
            inputs = store.provenance(key)
        except ModalDBError:
            continue
        refers[key] = set(KEY.findall(canonical_json(inputs)))
        if is_current(inputs):
            rest.append(key)
    used: set[str] = set()
    while rest:
        key = rest.pop()
        if key not in used:
            used.add(key)
            rest += refers[key] & refers.keys()
    return sorted(refers.keys() - used)


def _size(path: Path) -> int:
    inside = path.rglob("*") if path.is_dir() else [path]
    try:
        return sum(one.stat().st_size for one in inside if one.is_file())
    except OSError:
        return 0
