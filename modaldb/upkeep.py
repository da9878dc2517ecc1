"""Tidying a database: records that no key of this release leads to any more."""

from collections.abc import Callable
from typing import Any

from gudgeon.modaldb.stores.base import Leftover, Store


def unreferenced(store: Store, is_current: Callable[[dict[str, Any]], bool]) -> list[Leftover]:
    """Return the records that are not current, have no tag, and that no such record refers to, directly or not.

    Args:
        is_current: Whether the inputs of a record are those that this release would make a key of.
    """
    entries = {one.key: one for one in store.find() if one.inputs}
    rest, used = [key for key, one in entries.items() if one.tags or is_current(one.inputs)], set()
    while rest:
        key = rest.pop()
        if key not in used:
            used.add(key)
            rest += (one for one in entries[key].refers if one in entries)
    why = "made by other code or libraries, and no record of this release refers to it"
    return [Leftover(key, entries[key].size, why) for key in sorted(entries.keys() - used)]
