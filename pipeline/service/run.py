"""Starting the server: what is checked before it listens."""

import ipaddress
import logging
import re
import signal
import socket
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from gudgeon import modaldb
from gudgeon.modaldb.stores.folder import FolderStore
from gudgeon.modaldb.stores.transport import DEFAULT
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.service.access import Access, read_access

NAMED = re.compile(r"([A-Za-z0-9][A-Za-z0-9._-]{0,63})=(.+)", re.DOTALL)
LOCAL = frozenset({"localhost", "127.0.0.1", "::1"})
LARGEST = 4.0
"""Largest record that is taken [GB]."""


@dataclass(frozen=True)
class Settings:
    """What `gudgeon serve` is started with."""

    databases: Sequence[str] = (".gudgeon",)
    """Folders, or `NAME=FOLDER`."""
    host: str = "127.0.0.1"
    port: int = 8765
    tokens: Path | None = None
    names: Sequence[str] = ()
    """Further names under which the server is called."""
    largest: float = LARGEST
    """[GB]"""
    audit: Path | None = None
    """File of the audit; standard error if none is given."""


def serve(settings: Settings) -> None:
    """Serve databases until a signal ends it.

    Raises:
        InputError: an extra is missing, a setting is wrong, or nobody could be told apart on a host that others reach.
    """
    try:
        import uvicorn

        from gudgeon.pipeline.service.app import build_app
        from gudgeon.pipeline.service.context import Service
        from gudgeon.pipeline.service.patience import configured
    except ModuleNotFoundError as error:
        raise InputError(f"serve: {error.name} is not installed; pip install 'gudgeon[service]'") from error
    access, stores = read_access(settings.tokens), named_stores(settings.databases)
    check_host(settings.host, access)
    hosts = frozenset() if settings.host not in LOCAL and not settings.names else LOCAL | set(settings.names)
    service = Service(stores, access, hosts, int(settings.largest * 1e9))
    _audit_to(settings.audit)
    listening = bound(settings.host, settings.port)
    host = f"[{settings.host}]" if ":" in settings.host else settings.host
    for name, store in stores.items():
        path = "" if name == DEFAULT else f"/{name}"
        print(f"serving {store.location} at http://{host}:{listening.getsockname()[1]}{path}", flush=True)
    try:
        uvicorn.Server(configured(build_app(service))).run(sockets=[listening])
    except KeyboardInterrupt:  # The usual end.
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, 0)
    finally:
        listening.close()


def named_stores(databases: Sequence[str]) -> dict[str, FolderStore]:
    """Return the databases by their names in URLs; raise InputError where two have one name, or one is no folder."""
    stores: dict[str, FolderStore] = {}
    for text in databases:
        named = NAMED.fullmatch(text)
        name, folder = named.groups() if named else (DEFAULT, text)
        if name in stores:
            raise InputError(f"serve: two databases '{name}'; give names by --db NAME=FOLDER")
        store = modaldb.open(folder)
        if not isinstance(store, FolderStore):
            raise InputError(f"serve: --db {text}: expected a folder")
        stores[name] = store
    return stores


def check_host(host: str, access: Access) -> None:
    """Raise InputError where others could reach a server that asks for no token."""
    try:
        local = ipaddress.ip_address(host).is_loopback
    except ValueError:
        local = host == "localhost"
    if not local and not access.guarded:
        raise InputError(
            f"serve: --host {host} can be reached by others; give tokens by --tokens FILE or GUDGEON_TOKEN, or leave"
            " --host out"
        )


def bound(host: str, port: int) -> socket.socket:
    """Return a socket that listens; port 0 takes a free one. Raises InputError where it cannot be had."""
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        # By this protocol asyncio knows it for TCP and turns Nagle's algorithm off, which would cost 40 ms an answer.
        listener = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((host, port))
        listener.listen(2048)
    except (OSError, OverflowError) as error:
        raise InputError(f"serve: {host}:{port}: {getattr(error, 'strerror', None) or error}") from error
    return listener


def _audit_to(file: Path | None) -> None:
    logger = logging.getLogger("gudgeon.audit")
    try:
        handler = logging.StreamHandler(sys.stderr) if file is None else logging.FileHandler(file, encoding="utf-8")
    except OSError as error:
        raise InputError(f"serve: --audit {file}: {error.strerror}") from error
    handler.setFormatter(logging.Formatter("%(message)s"))
    logger.handlers, logger.propagate = [handler], False
    logger.setLevel(logging.INFO)
