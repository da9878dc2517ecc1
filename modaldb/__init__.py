"""Modal database: immutable, content-addressed records of meshes, modes, designs and trajectories."""

from gudgeon.modaldb.errors import (
    ModalDBError,
    RecordDamaged,
    RecordMismatch,
    RecordMissing,
    RecordNotWritten,
    StoreUnusable,
)
from gudgeon.modaldb.stores.folder import FolderStore, Store
from gudgeon.modaldb.stores.folder import open_store as open

__all__ = [
    "FolderStore",
    "ModalDBError",
    "RecordDamaged",
    "RecordMismatch",
    "RecordMissing",
    "RecordNotWritten",
    "Store",
    "StoreUnusable",
    "open",
]
