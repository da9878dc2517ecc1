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
    entries = {one.key: one for one in store.find() if one.inputs}
    kept = {key for key, one in entries.items() if not studies and one.inputs.get("stage") == STUDY}
    rest = [key for key, one in entries.items() if one.tags or key in kept or is_current(one.inputs)]
    used: set[str] = set()
    while rest:
        key = rest.pop()
        if key not in used:
            used.add(key)
            rest += (one for one in entries[key].refers if one in entries)
    why = "made by other code or libraries, and no record of this release refers to it"
    study = "a study without a tag"
    return [
        Leftover(key, entries[key].size, study if entries[key].inputs.get("stage") == STUDY else why)
        for key in sorted(entries.keys() - used)
    ]
