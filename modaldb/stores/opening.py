"""Opening a database by its place."""

from pathlib import Path

from gudgeon.modaldb.errors import StoreUnusable
from gudgeon.modaldb.stores.base import Store
from gudgeon.modaldb.stores.folder import open_folder


def open_store(location: str | Path) -> Store:
    """Open the database at a folder, which need not exist yet.

    Raises:
        StoreUnusable: the path exists and is not a folder, no folder can have it, or it is a URL.
    """
    if "://" in str(location):
        raise StoreUnusable(f"{location}: expected a folder, URLs are not supported")
    return open_folder(location)
