"""Tidying a database: records that no key of this release leads to any more."""

from collections.abc import Callable
from typing import Any

from gudgeon.modaldb.stores.base import Leftover, Store

STUDY = "study"
"""Stage of the record of a finished study, whose inputs name its runs."""


def unreferenced(
    store: Store, is_current: Callable[[dict[str, Any]], bool], *, studies: bool = False
) -> list[Leftover]:
    """Return the records that are not current, have no tag, are no study, and that no such record refers to.

    Args:
        is_current: Whether the inputs of a record are those that this release would make a key of.
        studies: Whether studies without a tag are no reason to keep what they refer to, directly or not.
    """
    entries = {e.key: e for e in store.find() if e.inputs}
    study_keys = {key for key, e in entries.items() if e.inputs.get("stage") == STUDY}
    roots = set() if studies else study_keys
    pending = [key for key, e in entries.items() if e.tags or key in roots or is_current(e.inputs)]
    used: set[str] = set()
    while pending:
        key = pending.pop()
        if key not in used:
            used.add(key)
            pending += entries.keys() & entries[key].refers
    why = "made by other code or libraries, and no record of this release refers to it"
    return [
        Leftover(key, entries[key].size, "a study without a tag" if key in study_keys else why)
        for key in sorted(entries.keys() - used)
    ]
