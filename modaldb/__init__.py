"""Modal database: immutable, content-addressed records of meshes, modes, designs and trajectories."""

from modaldb.errors import ModalDBError, RecordDamaged, RecordMismatch, RecordMissing, StoreUnusable
from modaldb.store import FolderStore, Store
from modaldb.store import open_store as open

__all__ = [
    "FolderStore",
    "ModalDBError",
    "RecordDamaged",
    "RecordMismatch",
    "RecordMissing",
    "Store",
    "StoreUnusable",
    "open",
]
