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
    """A record's bytes are as they were written, but they are not what was looked for: it has another key, kind or
    schema version, or a field that its kind does not allow."""


class RecordNotWritten(ModalDBError):
    """A record could not be written: the disk is full, a quota is reached, or the disk failed."""


class StoreUnusable(ModalDBError):
    """The database folder cannot be read or written."""
