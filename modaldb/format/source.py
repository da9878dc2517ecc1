"""Bytes of records, in open files and in memory."""

import os
from collections.abc import Iterator

from gudgeon.modaldb.format.blocks import Malformed, Source


class FileSource:
    """An open file.

    Args:
        descriptor: Of the file, which stays open.
    """

    def __init__(self, descriptor: int) -> None:
        self.descriptor = descriptor

    @property
    def length(self) -> int:
        """Number of bytes, as the file is now."""
        return os.fstat(self.descriptor).st_size

    def read_into(self, offset: int, buffer: memoryview) -> None:
        """See `blocks.Source`."""
        done = 0
        while done < len(buffer):
            count = os.preadv(self.descriptor, [buffer[done:]], offset + done)
            if not count:
                raise Malformed("the file was cut while it was read")
            done += count


class BytesSource:
    """A record in memory."""

    def __init__(self, data: bytes) -> None:
        self.data, self.length = data, len(data)

    def read_into(self, offset: int, buffer: memoryview) -> None:
        """See `blocks.Source`."""
        content = self.data[offset : offset + len(buffer)]
        if len(content) != len(buffer):
            raise Malformed("the bytes end before")
        buffer[:] = content


def parts_of(source: Source, size: int) -> Iterator[memoryview]:
    """Yield all bytes of a record in parts of a size; each part is valid until the next one."""
    buffer = memoryview(bytearray(size))
    for start in range(0, source.length, size):
        chunk = buffer[: source.length - start]
        source.read_into(start, chunk)
        yield chunk
