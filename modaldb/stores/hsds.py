"""The store in a folder of an HSDS server: a domain for each record, read and written through h5pyd.

A record is written to a domain of another name, read back, and then linked under its key: nobody sees it before. Every
part that is read is compared with its digest.
"""

import contextlib
import json
import logging
import os
import random
import socket
import threading
import time
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from gudgeon.modaldb.errors import RecordDamaged, RecordMismatch, RecordMissing, StoreUnusable
from gudgeon.modaldb.format import hdf5
from gudgeon.modaldb.format.blocks import Malformed
from gudgeon.modaldb.format.source import BytesSource, parts_of
from gudgeon.modaldb.keys import KEY, content_key, read_inputs, text_key
from gudgeon.modaldb.stores import domains
from gudgeon.modaldb.stores.base import SHOWN, Leftover, Store, check_inputs, check_key, check_tag, missing
from gudgeon.modaldb.stores.cache import AT_A_TIME, Cache, CachedSource
from gudgeon.modaldb.stores.index import UNKNOWN, Index, Stamp
from gudgeon.modaldb.stores.local.names import LONGEST
from gudgeon.modaldb.stores.manifest import BLOCK, Manifest, manifest_of
from gudgeon.modaldb.stores.query import Entry, Query
from gudgeon.modaldb.stores.transport import allowed_wait

SCHEMES = {"hsds": "http", "hsds+https": "https"}
ENDING, DAMAGED, WRITING = ".h5", ".damaged", "writing-"
NAMES = "names"
"""Domain that has the names of records as attributes."""
DAY = 86400.0
"""Age [s] above which an unfinished domain is its writer's no longer."""
OPTIONS = ("endpoint", "username", "password", "bucket")
"""Of h5pyd, with its variables `HS_ENDPOINT` and so on."""
TRIES = 3
"""Times that h5pyd repeats a request that fails."""


class Busy(StoreUnusable):
    """The server has more requests than it takes; worth another try."""


class HsdsStore(Store):
    """Records of a folder of HSDS. User, password and the endpoint, where the URL has none, are h5pyd's configuration.

    Args:
        url: `hsds://HOST:PORT/FOLDER`, `hsds+https://HOST/FOLDER`, or `hsds:///FOLDER`.

    Raises:
        StoreUnusable: the URL is none of these, or h5pyd is not installed.
    """

    def __init__(self, url: str) -> None:
        try:
            import h5pyd  # pyright: ignore[reportMissingImports]
        except ModuleNotFoundError as error:
            raise StoreUnusable(f"{url}: {error.name} is not installed; pip install 'gudgeon[hsds]'") from error
        logging.getLogger("h5pyd").setLevel(logging.CRITICAL)  # It warns of what is not there.
        self._h5pyd = h5pyd
        self.location = url.rstrip("/")
        endpoint, self._folder = _checked(url)
        # h5pyd reads its variables once in a process.
        environment = {name: text for name in OPTIONS if (text := os.environ.get(f"HS_{name.upper()}"))}
        self._options: dict[str, Any] = environment | {"retries": TRIES} | ({"endpoint": endpoint} if endpoint else {})
        folder = Cache(self.location).folder
        with contextlib.suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
        self.index = Index(folder, self)
        self._turn = threading.Lock()  # A server of the usual size refuses what several threads write at a time.
        self._heads: dict[str, tuple[str, hdf5.Head]] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return HsdsStore, (self.location,)

    def place(self, key: str) -> str:
        """See `Store`."""
        return f"{self.location}/{key}{ENDING}"

    @contextlib.contextmanager
    def opened(self, key: str, kind: str = "record") -> Iterator[tuple[CachedSource, hdf5.Head]]:
        """See `Store`; a part is fetched when it is read."""
        check_key(self.location, key, kind)
        with self._domain(f"{key}{ENDING}") as domain:
            if domain is None:
                raise RecordMissing(missing(self.location, key, kind))
            location = self.place(key)
            with _damaged(location):
                layout, manifest = _described(domain, location)
                source = CachedSource(manifest, domains.DomainFile(domain, layout).fetch, None)
            cached = self._heads.get(key)
            with _damaged(location):
                if cached is None or cached[0] != manifest.digest:
                    head = hdf5.read_head(source, location)
                    check_inputs(location, key, head)
                    cached = self._heads[key] = manifest.digest, head
                yield source, cached[1]

    def put(self, key: str, kind: str, record: Any, inputs: dict[str, Any]) -> None:
        """See `Store`; the record was read back when this returns."""
        if content_key(inputs) != key:
            raise RecordMismatch(f"{kind} record: its key {key[:12]}… is not that of its inputs")
        if self.has(key):
            return
        image = b"".join(hdf5.record_bytes(kind, record, inputs))
        manifest = manifest_of(key, BytesSource(image), self.place(key))
        self._patiently(lambda: self._write(key, image, manifest))

    def _write(self, key: str, image: bytes, manifest: Manifest) -> None:
        """Write a record, unless there is a sound one by then."""
        unfinished = f"{WRITING}{uuid.uuid4().hex}"
        self._make_folder()
        try:
            with self._domain(unfinished, "x") as domain:
                domains.write_domain(domain, image, manifest, time.time())
                domain.flush()
            with self._domain(unfinished) as domain:
                if domain is None or not _is_written(domain, manifest):
                    # h5pyd says nothing of an array that a busy server has refused.
                    raise Busy(f"{self.place(key)}: the server has other bytes than those that were sent")
            if (fault := self.fault(key)) is None:
                return
            if not isinstance(fault, RecordMissing):
                self.set_aside(self.place(key))
            with contextlib.suppress(FileExistsError):  # A record of this key came from somebody else meanwhile.
                self._link(f"{key}{ENDING}", unfinished)
                self._remove(unfinished, keep_root=True)
                unfinished = ""
        finally:
            if unfinished:
                with contextlib.suppress(StoreUnusable):
                    self._remove(unfinished)

    def keys(self) -> Iterator[str]:
        """See `Store`."""
        keys = (name.removesuffix(ENDING) for name in self._names() if name.endswith(ENDING))
        return iter(sorted(key for key in keys if KEY.fullmatch(key)))

    def find(self, query: Query = Query()) -> list[Entry]:  # noqa: B008
        """See `Store`; the index is kept in the local cache."""
        return self.index.find(query)

    def export(self, key: str, path: Path) -> None:
        """See `Store`."""
        with self.opened(key) as (source, _), path.open("wb") as file:
            for chunk in parts_of(source, AT_A_TIME * BLOCK):
                file.write(chunk)

    def note(self, key: str, scene: str, component: str) -> None:
        """See `Store`."""
        use = {"component": component[:LONGEST], "key": key, "scene": scene[:LONGEST]}
        with contextlib.suppress(StoreUnusable):
            self._patiently(lambda: self._name(f"use-{content_key(use)}", use))

    def tag(self, name: str, key: str | None) -> None:
        """See `Store`."""
        check_tag(name)
        if key is not None and isinstance(fault := self.fault(key), RecordMissing):
            raise fault
        if key is None and not self.find(Query(tag=name)):
            raise RecordMissing(f"{self.location}: no tag '{name}'")
        attribute = f"tag-{time.time_ns():020d}-{uuid.uuid4().hex}"  # The last one holds.
        self._patiently(lambda: self._name(attribute, {"key": key or "", "tag": name}))

    def set_aside(self, location: str) -> str:
        """See `Store`."""
        name = location.removeprefix(f"{self.location}/")
        if not KEY.fullmatch(key := name.removesuffix(ENDING)) or name not in self._names():
            raise RecordMissing(f"{self.location}: no domain of a record: {location[:SHOWN]!r}")
        with contextlib.suppress(StoreUnusable):  # One that was set aside before.
            self._remove(f"{key}{DAMAGED}")
        self._link(f"{key}{DAMAGED}", name)
        self._remove(name, keep_root=True)
        self._heads.pop(key, None)
        return f"{key}{DAMAGED}"

    def remove(self, location: str) -> None:
        """See `Store`."""
        if KEY.fullmatch(location):
            self._remove(f"{location}{ENDING}")
            self._heads.pop(location, None)
        elif location in {leftover.place for leftover in self.leftovers()}:
            self._remove(location.removeprefix(f"{self.location}/"))
        else:
            raise RecordMissing(f"{self.location}: neither a record nor a leftover: {location[:SHOWN]!r}")

    def leftovers(self) -> list[Leftover]:
        """See `Store`."""
        leftovers = []
        for name in sorted(self._names()):
            if not name.startswith(WRITING) and not name.endswith(DAMAGED):
                continue
            with self._domain(name) as domain:
                if domain is None:
                    continue
                size = (domains.read_layout(domain) or {"manifest": {"size": 0}})["manifest"]["size"]
                if name.endswith(DAMAGED):
                    leftovers.append(Leftover(f"{self.location}/{name}", size, "damaged, set aside"))
                elif time.time() - domain.modified.timestamp() > DAY:
                    leftovers.append(Leftover(f"{self.location}/{name}", size, "left by a writer that was killed"))
        return leftovers

    def stamps(self, known: Mapping[str, Stamp]) -> Iterable[tuple[str, Stamp]]:
        """See `index.Catalogue`; what a key stands for does not change, so that known records are not read again."""
        for key in self.keys():
            if (stamp := known.get(key)) is not None:
                yield key, stamp
                continue
            with self._domain(f"{key}{ENDING}") as domain:
                if domain is not None:
                    layout = domains.read_layout(domain) or {"made": 0.0, "manifest": {"size": 0}}
                    yield key, (int(1e9 * layout["made"]), layout["manifest"]["size"], 0)

    def read(self, key: str) -> tuple[str, dict[str, Any]]:
        """See `index.Catalogue`."""
        from gudgeon.modaldb.records import KINDS

        with self._domain(f"{key}{ENDING}") as domain:
            try:
                kind = str(domain.attrs["encoding-type"]).removeprefix("gudgeon-")
                inputs = read_inputs(text := str(domain.attrs["provenance"]))
                sound = kind in KINDS and text_key(text) == key
            except (AttributeError, KeyError, ValueError, TypeError):
                return UNKNOWN, {}
        return (kind, inputs) if sound else (UNKNOWN, {})

    def names(self, start: int) -> tuple[list[dict[str, Any]], int]:
        """See `index.Catalogue`; all of them come every time."""
        with self._domain(NAMES) as domain:
            return ([] if domain is None else [json.loads(text) for _, text in sorted(domain.attrs.items())]), 0

    def _name(self, attribute: str, entry: dict[str, str]) -> None:
        self._make_folder()
        with self._domain(NAMES) as domain:
            if domain is None:
                with contextlib.suppress(FileExistsError), self._domain(NAMES, "x"):
                    pass
        with self._domain(NAMES, "r+") as domain:
            assert domain is not None
            if attribute not in domain.attrs:
                domain.attrs[attribute] = json.dumps(entry, sort_keys=True)
        with self._domain(NAMES) as domain:  # h5pyd may write later, and say nothing where that fails.
            if domain is None or attribute not in domain.attrs:
                raise Busy(f"{self.location}: a name was not kept")

    @contextlib.contextmanager
    def _domain(self, name: str, mode: str = "r") -> Iterator[Any]:
        """Yield an open domain; None where there is none to read.

        Raises:
            FileExistsError: there is one that should be made.
        """
        with self._asked():
            try:
                domain = self._h5pyd.File(f"{self._folder}/{name}", mode, **self._options)
            except OSError as error:
                if mode != "x" and error.errno in (404, 410):
                    domain = None
                elif mode == "x" and error.errno == 409:
                    raise FileExistsError(name) from None
                else:
                    raise
            try:
                yield domain
            finally:
                if domain is not None:
                    domain.close()

    def _link(self, name: str, target: str) -> None:
        """Give the content of a domain another name, in one step; raises FileExistsError where there is one."""
        # h5pyd 1.0 has no other way to it.
        from h5pyd.httpconn import HttpConn  # pyright: ignore[reportMissingImports]

        with self._asked(), contextlib.closing(HttpConn(f"{self._folder}/{name}", mode="w", **self._options)) as server:
            server.open()
            answer = server.PUT("/", body={"linked_domain": f"{self._folder}/{target}"})
            if answer.status_code == 409:
                raise FileExistsError(name)
            if answer.status_code != 201:
                raise OSError(answer.status_code, answer.reason)

    def _remove(self, name: str, *, keep_root: bool = False) -> None:
        with self._asked():
            self._h5pyd.Folder(f"{self._folder}/", mode="a", **self._options).delete_item(name, keep_root=keep_root)

    def _names(self) -> list[str]:
        with self._asked():
            try:
                return list(self._h5pyd.Folder(f"{self._folder}/", **self._options))
            except OSError as error:
                if error.errno in (404, 410):
                    return []
                raise

    def _make_folder(self) -> None:
        names = self._folder.strip("/").split("/")
        with self._asked():
            for count in range(1, len(names) + 1):
                folder = f"/{'/'.join(names[:count])}/"
                try:
                    self._h5pyd.Folder(folder, **self._options)
                except OSError as error:
                    if error.errno not in (404, 410):
                        raise
                    with contextlib.suppress(FileExistsError):
                        self._h5pyd.Folder(folder, mode="w", **self._options)

    @contextlib.contextmanager
    def _asked(self) -> Iterator[None]:
        """Turn errors of the server, and of the way there, into one line."""
        begun = time.monotonic()
        try:
            self._reach()
            yield
        except FileExistsError:
            raise
        except OSError as error:
            status = {401: "wrong user or password", 403: "this user may not", 503: "the server is busy"}
            cause = status.get(error.errno or 0) or " ".join(str(error.strerror or error).split())
            waited = time.monotonic() - begun
            kind = Busy if error.errno == 503 or "503" in cause else StoreUnusable
            raise kind(f"{self.location}: {cause[:SHOWN]} (after {waited:.1f} s)") from error

    def _reach(self) -> None:
        """Raise an OSError where nothing listens: h5pyd would take minutes to say so."""
        endpoint = urlsplit(self._options.get("endpoint", ""))
        if endpoint.scheme in ("http", "https"):
            port = endpoint.port or (443 if endpoint.scheme == "https" else 80)
            socket.create_connection((endpoint.hostname or "", port), max(allowed_wait(), 1.0)).close()

    def _patiently(self, work: Callable[[], None]) -> None:
        """Do what may be repeated without harm until the server is not busy, for as long as is allowed."""
        begun, pause, allowed = time.monotonic(), 0.1, allowed_wait()
        while True:
            try:
                with self._turn:
                    return work()
            except Busy:
                if time.monotonic() - begun + pause > allowed:
                    raise
            time.sleep(pause * random.uniform(0.5, 1.0))
            pause = min(2 * pause, 2.0)


def _checked(url: str) -> tuple[str, str]:
    """Return endpoint, empty for that of h5pyd's configuration, and folder of a URL."""
    try:
        address = urlsplit(url)
        sound = address.scheme in SCHEMES and address.port != 0 and address.path.strip("/") and "//" not in address.path
    except ValueError:
        address, sound = urlsplit(""), False
    if not sound or address.query or address.fragment or address.username:
        raise StoreUnusable(f"{url[:SHOWN]}: no folder of HSDS; expected hsds://HOST:PORT/FOLDER or hsds:///FOLDER")
    return f"{SCHEMES[address.scheme]}://{address.netloc}" if address.netloc else "", f"/{address.path.strip('/')}"


def _described(domain: Any, location: str) -> tuple[dict[str, Any], Manifest]:
    layout = domains.read_layout(domain)
    if layout is None:
        raise RecordDamaged("no record: it does not say what it was made from")
    return layout, domains.read_manifest(domain, layout, location)


def _is_written(domain: Any, manifest: Manifest) -> bool:
    """Whether a domain has the bytes of a manifest; all of them are read."""
    try:
        layout, stored = _described(domain, "")
        if "provenance" not in domain.attrs:
            return False
        for _ in parts_of(CachedSource(stored, domains.DomainFile(domain, layout).fetch, None), AT_A_TIME * BLOCK):
            pass
    except (RecordDamaged, Malformed):
        return False
    return stored == manifest


@contextlib.contextmanager
def _damaged(location: str) -> Iterator[None]:
    """Name the place of damage, and take what a domain lacks for damage."""
    try:
        yield
    except (RecordDamaged, Malformed, KeyError) as error:
        text = str(error)
        raise RecordDamaged(text if text.startswith(location) else f"{location}: {text}") from error
