"""The store behind a URL: a `gudgeon serve` somewhere, and a local cache of what was read."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

from gudgeon.modaldb.errors import ModalDBError, RecordDamaged, RecordMismatch, RecordMissing, StoreUnusable
from gudgeon.modaldb.format import hdf5
from gudgeon.modaldb.format.source import BytesSource, parts_of
from gudgeon.modaldb.keys import KEY, content_key
from gudgeon.modaldb.stores.base import Leftover, Store, check_inputs, check_key, check_tag
from gudgeon.modaldb.stores.cache import AT_A_TIME, Cache, CachedSource
from gudgeon.modaldb.stores.local.running import is_row
from gudgeon.modaldb.stores.manifest import BLOCK, Manifest, manifest_from, manifest_of, unpacked
from gudgeon.modaldb.stores.query import Entry, Query, QueryWrong, entry_of
from gudgeon.modaldb.stores.transport import KNOWN, Transport, Unanswered

RECORDS = "/records"


class RemoteStore(Store):
    """Records of a server. What was read once is read from the local cache, whether or not the server answers.

    Args:
        url: As `Transport` takes it.
    """

    def __init__(self, url: str) -> None:
        self._server = Transport(url)
        self.location = self._server.url
        self._cache = Cache(self.location)
        self._heads: dict[str, tuple[str, hdf5.Head]] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return RemoteStore, (self.location,)

    def place(self, key: str) -> str:
        """See `Store`."""
        return f"{self.location}{RECORDS}/{key}"

    @contextlib.contextmanager
    def opened(self, key: str, kind: str = "record") -> Iterator[tuple[CachedSource, hdf5.Head]]:
        """See `Store`; a part is fetched when it is read."""
        check_key(self.location, key, kind)
        manifest, along = self._manifest(key, kind)
        source = self._cache.source(manifest, lambda start, end: self._fetch(key, start, end))
        try:
            source.add(along)
            yield source, self._head(key, manifest, source)
        except RecordDamaged as error:
            # Once more from the server: its file was made again, or the list in the cache is an old one.
            self._cache.forget(key)
            self._heads.pop(key, None)
            raise RecordDamaged(f"{self.place(key)}: {error}; run the command again") from error
        finally:
            source.close()

    def put(self, key: str, kind: str, record: Any, inputs: dict[str, Any]) -> None:
        """See `Store`; the server has flushed and verified the record when this returns."""
        if content_key(inputs) != key:
            raise RecordMismatch(f"{kind} record: its key {key[:12]}… is not that of its inputs")
        if self._fault_there(key) is None:
            return
        chunks = hdf5.record_bytes(kind, record, inputs)
        source = BytesSource(b"".join(chunks))
        headers = {"Content-Type": "application/octet-stream", "Content-Length": str(source.length)}
        with self._understood():
            answer = self._server.parsed(self._server.request("PUT", f"{RECORDS}/{key}", body=chunks, headers=headers))
            digest, state = answer["digest"], answer["state"]
        manifest = manifest_of(key, source, self.place(key))
        if digest != manifest.digest:
            if state == "written":
                raise RecordDamaged(f"{self.place(key)}: the server has other bytes than those that were sent")
            return  # A record of this key came from somebody else meanwhile.
        self._keep(manifest, source)

    def keys(self) -> Iterator[str]:
        """See `Store`."""
        with self._understood():
            keys = self._server.json("GET", "/keys")
            if not isinstance(keys, list) or not all(map(KEY.fullmatch, keys)):
                raise ValueError("no keys")
        return iter(keys)

    def find(self, query: Query = Query()) -> list[Entry]:  # noqa: B008
        """See `Store`."""
        parameters: dict[str, Any] = {"inputs": "true", "where": [str(c) for c in query.where]}
        for name in ("kind", "scene", "component", "tag", "key", "text"):
            parameters |= {name: value} if (value := getattr(query, name)) else {}
        for name in ("since", "until", "limit"):
            parameters |= {name: value} if (value := getattr(query, name)) is not None else {}
        with self._understood():
            return [entry_of(row) for row in self._server.json("GET", RECORDS, query=parameters)]

    def export(self, key: str, path: Path) -> None:
        """See `Store`."""
        with self.opened(key) as (source, _), path.open("wb") as file:
            for chunk in parts_of(source, AT_A_TIME * BLOCK):
                file.write(chunk)

    def examine(self, key: str) -> ModalDBError | None:
        """See `Store`; the server reads its own file."""
        try:
            check_key(self.location, key, "record")
            with self._understood():
                fault = self._server.json("GET", f"{RECORDS}/{key}/examine")["fault"]
                return None if fault is None else KNOWN[fault["error"]](f"{self.location}: {fault['detail']}")
        except RecordMissing as error:
            return error

    def note(self, key: str, scene: str, component: str) -> None:
        """See `Store`; a server that takes no names from this user keeps none."""
        if self._server.is_silent:
            return
        with contextlib.suppress(StoreUnusable):
            self._server.json("POST", f"{RECORDS}/{key}/uses", body={"scene": scene, "component": component})

    def tag(self, name: str, key: str | None) -> None:
        """See `Store`."""
        check_tag(name)
        body = None if key is None else {"key": key}
        self._server.json("DELETE" if key is None else "PUT", f"/tags/{quote(name)}", body=body)

    def tell(self, name: str, row: dict[str, Any] | None) -> None:
        """See `Store`."""
        if self._server.is_silent:
            return
        with contextlib.suppress(StoreUnusable, QueryWrong):
            self._server.json("DELETE" if row is None else "PUT", f"/running/{name}", body=row)

    def running(self) -> list[dict[str, Any]]:
        """See `Store`."""
        with self._understood():
            return [row for row in self._server.json("GET", "/running") if is_row(row)]

    def set_aside(self, location: str) -> str:
        """See `Store`."""
        key = self._key_of(location)
        with self._understood():
            name = self._server.json("POST", f"{RECORDS}/{key}/aside")["name"]
        self._forget(key)
        return str(name)

    def remove(self, location: str) -> None:
        """See `Store`."""
        if location.startswith(f"{self.location}/leftovers/"):
            self._server.request("DELETE", location.removeprefix(self.location))
            return
        key = self._key_of(location)
        self._server.request("DELETE", f"{RECORDS}/{key}")
        self._forget(key)

    def leftovers(self) -> list[Leftover]:
        """See `Store`."""
        with self._understood():
            rows = self._server.json("GET", "/leftovers")
            return [Leftover(f"{self.location}/leftovers/{quote(row['name'])}", int(row["size"]), str(row["why"]))
                    for row in rows]  # fmt: skip

    def fault(self, key: str) -> ModalDBError | None:
        """See `Store`; the server says so, whatever the cache has. While it does not answer, the cache does."""
        if not self._server.is_silent:
            with contextlib.suppress(Unanswered):
                if (fault := self._fault_there(key)) is not None:
                    self._forget(key)
                    return fault
        return super().fault(key)

    def _fault_there(self, key: str) -> ModalDBError | None:
        """Return why the server has no sound record of a key, None if it has one."""
        try:
            check_key(self.location, key, "record")
            self._server.request("HEAD", f"{RECORDS}/{key}")
        except (RecordMissing, RecordDamaged, RecordMismatch) as error:
            return error
        return None

    @contextlib.contextmanager
    def _understood(self) -> Iterator[None]:
        """Say of an answer of another form that it is not of such a server."""
        try:
            yield
        except ModalDBError:
            raise
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
            raise StoreUnusable(f"{self.location}: an answer of another form, not of a gudgeon server") from None

    def _key_of(self, location: str) -> str:
        key = location.removeprefix(f"{self.location}{RECORDS}/")
        check_key(self.location, key, "record")
        return key

    def _manifest(self, key: str, kind: str) -> tuple[Manifest, dict[int, bytes]]:
        """Return the manifest of a record and the blocks that came with it, none from the cache."""
        if (cached := self._cache.manifest(key)) is not None:
            return cached, {}
        try:
            row = self._server.json("GET", f"{RECORDS}/{key}/blocks")
        except RecordMissing as error:
            raise RecordMissing(str(error).replace(": no record", f": no {kind} record", 1) if kind != "record"
                                else str(error)) from None  # fmt: skip
        manifest = manifest_from(row, self.place(key))
        if manifest.key != key:
            raise RecordDamaged(f"{self.place(key)}: the list of blocks of another record")
        with self._understood():
            along = unpacked(row["blocks"])
        self._cache.keep(manifest)
        return manifest, along

    def _head(self, key: str, manifest: Manifest, source: CachedSource) -> hdf5.Head:
        cached = self._heads.get(key)
        if cached is not None and cached[0] == manifest.digest:
            return cached[1]
        head = hdf5.read_head(source, self.place(key))
        check_inputs(self.place(key), key, head)
        self._heads[key] = manifest.digest, head
        return head

    def _fetch(self, key: str, start: int, end: int) -> bytes:
        span = {"Range": f"bytes={start}-{end - 1}"}
        answer = self._server.request("GET", f"{RECORDS}/{key}", headers=span, largest=end - start + 2**16)
        if answer.status != 206 or len(answer.data) != end - start:
            raise RecordDamaged(f"bytes {start} to {end}: {len(answer.data)} came with status {answer.status}")
        return answer.data

    def _keep(self, manifest: Manifest, source: BytesSource) -> None:
        self._cache.keep(manifest)
        with contextlib.closing(self._cache.source(manifest, lambda start, stop: source.data[start:stop])) as cached:
            cached.add({n: source.data[n * BLOCK : (n + 1) * BLOCK] for n in range(len(manifest.digests))})

    def _forget(self, key: str) -> None:
        self._cache.forget(key)
        self._heads.pop(key, None)
