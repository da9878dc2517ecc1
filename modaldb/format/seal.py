"""The user block of a record's file, by which it is verified with the standard library alone.

It has a magic line, the SHA-256 of everything after the block and of the kind, and the record's kind.
"""

import hashlib
import os
from pathlib import Path

from gudgeon.modaldb.errors import RecordDamaged
from gudgeon.modaldb.format.blocks import USERBLOCK

MAGIC = b"GUDGEON-RECORD 1\n"


def user_block(digest: str, kind: bytes) -> bytes:
    """Return the user block, (512,) bytes."""
    return (MAGIC + digest.encode() + b"\n" + kind + b"\n").ljust(USERBLOCK, b"\0")


def verify_open(descriptor: int, location: Path | str) -> str:
    """Check an open file against its digest and return its kind; `location` is for the message.

    Raises:
        RecordDamaged: the header is not that of a record, or a byte has changed.
    """
    with os.fdopen(os.dup(descriptor), "rb") as raw:
        raw.seek(0)
        block = raw.read(USERBLOCK)
        lines = block.rstrip(b"\0").split(b"\n")
        if not block.startswith(MAGIC) or len(lines) != 4:
            raise RecordDamaged(f"{location}: not a gudgeon record (header damaged)")
        digest = hashlib.file_digest(raw, lambda: hashlib.sha256(lines[2])).hexdigest()
        if block != user_block(digest, lines[2]):
            raise RecordDamaged(f"{location}: checksum differs from the one written")
    return lines[2].decode(errors="replace")
