"""A server under load: `python -m tests.benchmarks.service [--readers 200] [--seconds 10] [--peer]`, two minutes.

Starts `gudgeon serve` on loopback with one large record and prints: a 600-row read alone; requests per second, median
and 99 % of many readers at once, with and without clients that read slowly; puts of several writers while the server is
killed and started again. Every byte that comes is compared. `--peer` adds h5grove alone behind the same uvicorn, which
reads the same rows of the same file (pip install h5grove pydantic-settings).
"""

import argparse
import asyncio
import hashlib
import json
import os
import random
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median

import numpy as np

from gudgeon.modaldb.errors import ModalDBError
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.stores.folder import open_folder
from gudgeon.modaldb.stores.remote import RemoteStore
from tests.modaldb.samples import INPUTS, mesh, modes, ramp, same

TOKEN = "load"
NODES, MODES, ROWS = 60_000, 3, 600
SLOW = 20
"""Clients that take the whole record at 64 kB/s."""
KILLS, WRITERS = 6, 4
KEY = content_key(INPUTS)
PEER = """
import sys, uvicorn
from fastapi import FastAPI
from h5grove.fastapi_utils import router, settings
settings.base_dir = sys.argv[1]
app = FastAPI()
app.include_router(router)
uvicorn.run(app, port=int(sys.argv[2]), log_level="warning", access_log=False)
"""


@dataclass
class Seen:
    """What readers saw."""

    seconds: list[float]
    wrong: int = 0
    failed: int = 0
    cpu: float = 0.0
    """Of the server [s]."""

    def line(self, name: str, whole: float) -> str:
        """Return a line of the table; `whole` is the length of the test [s]."""
        found = sorted(self.seconds)
        at = found[int(0.99 * len(found))]
        return (
            f"{name:44} {len(found) / whole:8.0f}/s  median {1e3 * median(found):7.1f} ms  99 % {1e3 * at:7.1f} ms"
            f"  server's CPU {1e3 * self.cpu / len(found):5.2f} ms  wrong {self.wrong}, failed {self.failed}"
        )


def cpu_of(process: int) -> float:
    """Return the CPU time of a process so far [s]: a figure that other work on the machine changes least."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@contextmanager
def server(root: Path, port: int) -> Iterator[subprocess.Popen]:
    """Start `gudgeon serve` and wait until it listens; kill it at the end."""
    command = [sys.executable, "-m", "gudgeon.pipeline", "serve", "--db", str(root), "--port", str(port)]
    with (root.parent / "audit.log").open("ab") as audit:
        environment = {**os.environ, "GUDGEON_TOKEN": TOKEN}
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=audit, env=environment) as child:
            assert child.stdout is not None
            child.stdout.readline()
            try:
                yield child
            finally:
                child.kill()


@asynccontextmanager
async def connected(port: int) -> AsyncIterator[tuple[asyncio.StreamReader, asyncio.StreamWriter]]:
    """Open a connection that is kept alive."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port, limit=2**22)
    try:
        yield reader, writer
    finally:
        writer.close()


async def ask(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, path: str) -> tuple[int, bytes]:
    """Return status and body of one request."""
    writer.write(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer {TOKEN}\r\n\r\n".encode())
    head = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1").lower()
    size = int(head.partition("content-length: ")[2].partition("\r\n")[0])
    return int(head.split()[1]), await reader.readexactly(size)


async def read_on(port: int, path: str, expected: str | None, seen: Seen, end: float) -> None:
    """Read the same again and again; compare every answer with a digest, or with the first one."""
    try:
        async with connected(port) as (reader, writer):
            while (begun := time.perf_counter()) < end:
                status, body = await ask(reader, writer, path)
                seen.seconds.append(time.perf_counter() - begun)
                digest = hashlib.sha256(body).hexdigest()
                expected = expected or digest
                seen.wrong += status != 200 or digest != expected
    except (OSError, asyncio.IncompleteReadError, ValueError):
        seen.failed += 1


async def read_slowly(port: int, path: str, expected: str, seen: Seen, end: float) -> None:
    """Read a large answer a little at a time; the part that came by the end must be right, too."""
    try:
        async with connected(port) as (reader, writer):
            writer.write(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer {TOKEN}\r\n\r\n".encode())
            await reader.readuntil(b"\r\n\r\n")
            whole, found = Path(expected).read_bytes(), b""
            while time.perf_counter() < end and len(found) < len(whole):
                found += await reader.read(6400)
                await asyncio.sleep(0.1)
            seen.wrong += found != whole[: len(found)]
    except (OSError, asyncio.IncompleteReadError, ValueError):
        seen.failed += 1


async def load(
    port: int, path: str, many: tuple[int, float], process: int, slow: tuple[str, str] | None = None
) -> Seen:
    """Let many read at once for some seconds; `slow` has path and file of what slow clients read beside them.

    Args:
        process: Of the server.
    """
    (readers, seconds), before = many, cpu_of(process)
    seen, beside, end = Seen([]), Seen([]), time.perf_counter() + seconds
    tasks = [read_on(port, path, None, seen, end) for _ in range(readers)]
    if slow is not None:
        tasks += [read_slowly(port, *slow, beside, end) for _ in range(SLOW)]
    await asyncio.gather(*tasks)
    return Seen(seen.seconds, seen.wrong + beside.wrong, seen.failed + beside.failed, cpu_of(process) - before)


def survive(root: Path, port: int) -> str:
    """Put from several threads while the server is killed; return what became of it."""
    stop, done, failed = threading.Event(), [list[int]() for _ in range(WRITERS)], list[str]()
    os.environ |= {"GUDGEON_TOKEN": TOKEN, "GUDGEON_DB_WAIT": "60", "GUDGEON_CACHE": str(root.parent / "cache")}

    def put(number: int) -> None:
        store = RemoteStore(f"http://127.0.0.1:{port}")
        for n in range(10**9):
            if stop.is_set():
                return
            inputs = INPUTS | {"writer": number, "n": n}
            try:
                store.put(content_key(inputs), "mesh", mesh(), inputs)
            except ModalDBError as error:
                failed.append(str(error))
                return
            done[number].append(n)

    threads = [threading.Thread(target=put, args=(number,)) for number in range(WRITERS)]
    for kill in range(KILLS):
        with server(root, port) as child:
            for thread in threads if kill == 0 else ():
                thread.start()
            time.sleep(random.uniform(0.5, 2.0))
            child.kill()
            child.wait()
    with server(root, port):
        stop.set()
        for thread in threads:
            thread.join()
    store = open_folder(root)
    keys = [content_key(INPUTS | {"writer": w, "n": n}) for w, found in enumerate(done) for n in found]
    lost = sum(not store.has(key) or not same(store.get(key, "mesh"), mesh()) for key in keys)
    bad = sum(fault is not None for _, fault in store.verify())
    return (
        f"{len(keys)} puts of {WRITERS} writers were acknowledged over {KILLS} kills: {lost} lost, {bad} bad records,"
        f" {len(failed)} writers gave up {failed}"
    )


def free_port() -> int:
    """Return a port that nobody listens at."""
    import socket

    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


async def alone(port: int, path: str, times: int) -> float:
    """Return the median time of a request that has the server to itself [s]."""
    seen = Seen([])
    async with connected(port) as (reader, writer):
        for _ in range(times):
            begun = time.perf_counter()
            status, _ = await ask(reader, writer, path)
            assert status == 200
            seen.seconds.append(time.perf_counter() - begun)
    return median(seen.seconds)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--readers", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--peer", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        root, port = Path(folder) / "db", free_port()
        store = open_folder(root)
        store.put(KEY, "modes", replace(modes(), shapes=ramp(NODES, 3, MODES), static_responses=None), INPUTS)
        rows = ",".join(map(str, np.sort(np.random.default_rng(1).choice(NODES, ROWS, replace=False))))
        scattered = f"/default/records/{KEY}/field/shapes?rows={rows}"
        together = f"/default/records/{KEY}/field/shapes?rows=0:{ROWS}"
        whole = (f"/default/records/{KEY}", store.place(KEY))
        many = options.readers, options.seconds
        with server(root, port) as child:
            for name, path in (("600 rows together", together), ("600 rows, scattered", scattered)):
                print(f"{name + ', alone':44} median {1e3 * asyncio.run(alone(port, path, 200)):.2f} ms")
            for name, path, slow in (
                (f"{options.readers} readers of 600 rows together", together, None),
                (f"{options.readers} readers of 600 scattered rows", scattered, None),
                (f"{options.readers} readers, {SLOW} slow ones beside", together, whole),
            ):
                found = asyncio.run(load(port, path, many, child.pid, slow))
                print(found.line(name, options.seconds))
        if options.peer:
            program = [sys.executable, "-c", PEER, str(root / KEY[:2]), str(port)]
            with subprocess.Popen(program) as child:
                time.sleep(5)
                path = f"/data?file={KEY}.h5&path=/shapes&selection=0:{ROWS},:,:&format=npy"
                took = 1e3 * asyncio.run(alone(port, path, 100))
                print(f"{'h5grove, 600 rows together, alone':44} median {took:.2f} ms")
                found = asyncio.run(load(port, path, many, child.pid))
                print(found.line(f"h5grove, {options.readers} readers", options.seconds))
                child.kill()
        print(survive(root, port))
        print(json.dumps({"machine": os.cpu_count(), "load": os.getloadavg()}))


if __name__ == "__main__":
    main()
