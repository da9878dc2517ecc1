"""A server for tests: in a thread of this process, with a token that may do everything."""

import contextlib
import os
import threading
import time
from collections.abc import Iterator, Mapping
from hashlib import sha256
from pathlib import Path

import pytest

from gudgeon.modaldb.stores import transport

TOKEN = "a-token-for-tests"


@contextlib.contextmanager
def variables(changes: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables in a block."""
    before = {name: os.environ.get(name) for name in changes}
    os.environ.update(changes)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextlib.contextmanager
def served(root: Path, *, token: str = TOKEN, largest: int = 10**8, port: int = 0) -> Iterator[str]:
    """Serve a folder; yield its URL. The client's token and its cache beside the folder are set meanwhile."""
    pytest.importorskip("fastapi", reason="the extra 'service' is not installed")
    uvicorn = pytest.importorskip("uvicorn", reason="the extra 'service' is not installed")
    from gudgeon.modaldb.stores.folder import open_folder
    from gudgeon.pipeline.service.access import EVERY, RIGHTS, Access, Token
    from gudgeon.pipeline.service.app import build_app
    from gudgeon.pipeline.service.context import Service
    from gudgeon.pipeline.service.patience import configured
    from gudgeon.pipeline.service.run import LOCAL, bound

    access = Access({sha256(TOKEN.encode()).hexdigest(): Token("tests", (EVERY,), RIGHTS)})
    app = build_app(Service({"default": open_folder(root)}, access, LOCAL, largest))
    listening = bound("127.0.0.1", port)
    transport._silent.clear()  # Another test may have waited in vain for a server at this port.
    server = uvicorn.Server(configured(app, graceful=1))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
    thread.start()
    places = {"GUDGEON_TOKEN": token, "GUDGEON_CACHE": str(root.parent / "cache"), "GUDGEON_DB_WAIT": "2"}
    try:
        while not server.started:
            time.sleep(0.01)
        with variables(places):
            yield f"http://127.0.0.1:{listening.getsockname()[1]}"
    finally:
        server.should_exit = True
        thread.join()
        listening.close()
