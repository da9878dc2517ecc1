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
        found = store.find(Query(tag=name)) if name else []
        if not found:
            raise QueryWrong(f"{store.location}: no tag {name[:SHOWN]!r}, and no key: four or more of its digits")
        return found[0]
    found = store.find(Query(key=name, limit=MOST + 1))
    if not found:
        raise QueryWrong(f"{store.location}: no record {name[:12]}{'…' if len(name) > 12 else ''}")
    if len(found) > 1:
        shown = ", ".join(one.key[:12] for one in found[:MOST])
        more = " and others" if len(found) > MOST else ""
        raise QueryWrong(f"{store.location}: {name} begins several keys: {shown}{more}; give more digits")
    return found[0]
