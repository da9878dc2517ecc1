"""Errors of the modal database: each names the record, the file and the cause."""


class ModalDBError(Exception):
    """Base of every error that the database raises; its text is one line."""


class RecordMissing(ModalDBError, KeyError):
    """The database has no record of this key."""

    def __str__(self) -> str:
        return str(self.args[0])


class RecordDamaged(ModalDBError):
    """The bytes of a record have changed since it was written."""


class RecordMismatch(ModalDBError):
    """A record is undamaged, but of another kind or of a schema version that this release cannot read."""


class StoreUnusable(ModalDBError):
    """The database folder cannot be read or written."""
