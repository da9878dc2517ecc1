"""A record by what a user calls it: a tag, or the first digits of its key."""

import re

from gudgeon.modaldb.stores.base import SHOWN, Store
from gudgeon.modaldb.stores.query import Entry, Query, QueryWrong

DIGITS = re.compile(r"[0-9a-f]{4,64}")
MOST = 5
"""Keys that are named in a message."""


def find_one(store: Store, name: str) -> Entry:
    """Return the record that has a tag, or whose key begins with these digits, at least four.

    Raises:
        QueryWrong: there is none, or there are several.
    """
    if DIGITS.fullmatch(name) is None:
        entries = store.find(Query(tag=name)) if name else []
        if not entries:
            raise QueryWrong(f"{store.location}: no tag {name[:SHOWN]!r}, and no key: four or more of its digits")
        return entries[0]
    entries = store.find(Query(key=name, limit=MOST + 1))
    if not entries:
        raise QueryWrong(f"{store.location}: no record {name[:12]}{'…' if len(name) > 12 else ''}")
    if len(entries) > 1:
        shown = ", ".join(entry.key[:12] for entry in entries[:MOST])
        suffix = " and others" if len(entries) > MOST else ""
        raise QueryWrong(f"{store.location}: {name} begins several keys: {shown}{suffix}; give more digits")
    return entries[0]
