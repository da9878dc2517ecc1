"""Errors of the modal database: each names the record, the file and what is wrong."""


class ModalDBError(Exception):
    """Base of every error that the database raises; its text is one line."""


class RecordMissing(ModalDBError, KeyError):
    """No record stands under the key that was asked for."""

    def __str__(self) -> str:
        return str(self.args[0])


class RecordDamaged(ModalDBError):
    """A record's bytes are not the bytes that were written."""


class RecordMismatch(ModalDBError):
    """A record is sound but of another kind, or of a schema this release cannot read."""


class StoreUnusable(ModalDBError):
    """The database folder cannot be read or written."""
