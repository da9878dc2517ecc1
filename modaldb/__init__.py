"""Modal database: immutable, content-addressed records of meshes, modes, designs and trajectories."""

from gudgeon.modaldb.errors import (
    ModalDBError,
    RecordDamaged,
    RecordMismatch,
    RecordMissing,
    RecordNotWritten,
    StoreUnusable,
)
from gudgeon.modaldb.stores.base import Store
from gudgeon.modaldb.stores.opening import open_store as open

__all__ = [
    "ModalDBError",
    "RecordDamaged",
    "RecordMismatch",
    "RecordMissing",
    "RecordNotWritten",
    "Store",
    "StoreUnusable",
    "open",
]
