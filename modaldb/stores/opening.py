"""Opening a database by its place."""

import os
from pathlib import Path

from gudgeon.modaldb.stores.base import Store
from gudgeon.modaldb.stores.folder import open_folder

VARIABLE, USUAL = "GUDGEON_DB", ".gudgeon"
"""Where the database is, where no place is given."""


def open_store(location: str | Path | None = None) -> Store:
    """Open the database at a folder, which need not exist yet, at the URL of a `gudgeon serve`, or at that of a
    folder of HSDS, `hsds://HOST:PORT/FOLDER`.

    >>> import gudgeon
    >>> store = gudgeon.open("my-records")
    >>> list(store.keys())
    []

    Args:
        location: Folder or URL of the database; None takes that of the variable `GUDGEON_DB`, or `.gudgeon`.

    Raises:
        StoreUnusable: the path exists and is not a folder, no folder can have it, or it is no URL of a database.
    """
    target = os.environ.get(VARIABLE) or USUAL if location is None else location
    if "://" not in str(target):
        return open_folder(target)
    if str(target).startswith("hsds"):
        from gudgeon.modaldb.stores.hsds import HsdsStore

        return HsdsStore(str(target))
    from gudgeon.modaldb.stores.remote import RemoteStore

    return RemoteStore(str(target))
