"""Records as domains of HSDS, through h5pyd: the tree of a record as it is, and what makes its file of it again.

A domain has the groups, attributes and arrays of a record's file, for any client of HSDS. Beside them stand
`gudgeon-file`, the bytes of the file outside its arrays one after the other; `gudgeon-digests`, the SHA-256 of each
block of the file; and `gudgeon-layout`, a JSON text that says where in the file each array stands. So every byte of the
file can be had, checked by its digest, and an array is stored once.
"""

import base64
import bisect
import io
import itertools
import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from gudgeon.modaldb.format.blocks import Malformed
from gudgeon.modaldb.stores.manifest import Manifest, manifest_from

FILE, DIGESTS, LAYOUT = "gudgeon-file", "gudgeon-digests", "gudgeon-layout"


def write_domain(domain: Any, image: bytes, manifest: Manifest, made: float) -> None:
    """Write the file of a record to an empty domain.

    Args:
        domain: Open `h5pyd.File`.
        image: All bytes of the file.
        manifest: Of the same bytes.
        made: Time [s since 1970].
    """
    import h5py

    arrays: list[tuple[int, int, str]] = []
    with h5py.File(io.BytesIO(image), "r") as file:
        _copy(file, domain, "", arrays)
    arrays.sort()
    pieces, offset = [], 0
    for array_start, length, _ in arrays:
        pieces.append(image[offset:array_start])
        offset = array_start + length
    pieces.append(image[offset:])
    domain.create_dataset(FILE, data=np.frombuffer(b"".join(pieces), np.uint8))
    row = manifest.as_json()
    digests = np.frombuffer(base64.b64decode(row.pop("digests")), np.uint8).reshape(-1, 32)
    domain.create_dataset(DIGESTS, data=digests)
    domain.attrs[LAYOUT] = json.dumps({"manifest": row, "arrays": arrays, "made": made})


def _copy(group: Any, target: Any, prefix: str, arrays: list[tuple[int, int, str]]) -> None:
    for name, value in group.attrs.items():
        target.attrs[name] = value
    for name, member in group.items():
        if hasattr(member, "items"):
            _copy(member, target.create_group(name), f"{prefix}{name}/", arrays)
            continue
        made = target.create_dataset(name, data=member[()])
        for label, text in member.attrs.items():
            made.attrs[label] = text
        if member.id.get_storage_size():
            arrays.append((member.id.get_offset(), member.id.get_storage_size(), f"{prefix}{name}"))


def read_layout(domain: Any) -> dict[str, Any] | None:
    """Return what a domain says of the file that it was made from; None where it is none, or was not finished."""
    try:
        layout = json.loads(domain.attrs[LAYOUT])
        return layout if isinstance(layout["manifest"]["size"], int) and isinstance(layout["arrays"], list) else None
    except (KeyError, ValueError, TypeError, RecursionError):
        return None


def read_manifest(domain: Any, layout: dict[str, Any], location: str) -> Manifest:
    """Return the digests of the blocks of a domain's file; raise RecordDamaged where there are none."""
    digests = base64.b64encode(np.asarray(domain[DIGESTS][...], np.uint8).tobytes()).decode()
    return manifest_from(layout["manifest"] | {"digests": digests}, location)


class DomainFile:
    """The bytes of the file that a domain was made from; parts of arrays are fetched by rows of their first axis."""

    def __init__(self, domain: Any, layout: dict[str, Any]) -> None:
        self._domain = domain
        self._arrays = [(int(start), int(length), str(path)) for start, length, path in layout["arrays"]]
        self._starts = [start for start, _, _ in self._arrays]
        self._before = list(itertools.accumulate((length for _, length, _ in self._arrays), initial=0))
        self._rest: bytes | None = None
        self._open: dict[str, Any] = {}

    def fetch(self, start: int, end: int) -> bytes:
        """Return the bytes from one place to another; raises Malformed where an array is not there any more."""
        return b"".join(self._parts(start, end))

    def _parts(self, start: int, end: int) -> Iterator[bytes]:
        while start < end:
            i = bisect.bisect_right(self._starts, start) - 1
            array_start, length, path = self._arrays[i] if i >= 0 else (0, 0, "")
            if start < array_start + length:
                stop = min(end, array_start + length)
                yield self._rows(path, start - array_start, stop - array_start)
            else:
                follows = self._starts[i + 1] if i + 1 < len(self._starts) else end
                stop = min(end, follows)
                before = self._before[i + 1]
                yield self._outside()[start - before : stop - before]
            start = stop

    def _outside(self) -> bytes:
        if self._rest is None:
            self._rest = np.asarray(self._domain[FILE][...], np.uint8).tobytes()
        return self._rest

    def _rows(self, path: str, start: int, end: int) -> bytes:
        """Return bytes of an array, from and to places within it."""
        if (array := self._open.get(path)) is None:
            try:
                array = self._open[path] = self._domain[path]
            except KeyError:
                raise Malformed(f"{path}: not there") from None
        if not array.shape:
            return np.asarray(array[()]).tobytes()[start:end]
        width = max(array.dtype.itemsize * int(np.prod(array.shape[1:], dtype=int)), 1)
        low = start // width
        content = np.ascontiguousarray(array[low : -(-end // width)]).tobytes()
        return content[start - low * width : end - low * width]
