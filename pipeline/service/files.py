"""Whole records and ranges of them, lists of their blocks, and their uploads."""

import asyncio
import os
from collections import OrderedDict
from collections.abc import AsyncIterator
from contextlib import ExitStack
from threading import Lock
from typing import Any

from anyio import to_thread
from fastapi import APIRouter, Request
from fastapi.responses import JSONResponse, Response, StreamingResponse
from starlette.requests import ClientDisconnect

from gudgeon.modaldb.errors import ModalDBError
from gudgeon.modaldb.format.source import FileSource
from gudgeon.modaldb.stores.manifest import BLOCK, Manifest, manifest_of, packed
from gudgeon.pipeline.service.access import Refused
from gudgeon.pipeline.service.arrays import Wrong
from gudgeon.pipeline.service.context import PROBLEMS, Asked, Key, Reader, Service, Writer

router = APIRouter(prefix="/{database}/records/{key}", tags=["files"])
PART = 16 * BLOCK
"""Bytes that are read and sent at a time."""
SLOWEST = 30.0
"""Longest pause [s] of a client that sends a record."""
MANIFESTS = 2048
"""Lists of blocks that are kept in memory."""
BYTES = {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}}


class Manifests:
    """Lists of blocks of the records that were asked for last."""

    def __init__(self) -> None:
        self._found: OrderedDict[tuple[int, ...], Manifest] = OrderedDict()
        self._lock = Lock()

    def of(self, key: str, source: FileSource, place: str) -> Manifest:
        """Return the list of a verified record."""
        stat = os.fstat(source.descriptor)
        stamp = (stat.st_dev, stat.st_ino, stat.st_size, stat.st_mtime_ns, int(key[:15], 16))
        with self._lock:
            if (found := self._found.get(stamp)) is not None:
                self._found.move_to_end(stamp)
                return found
        found = manifest_of(key, source, place)
        with self._lock:
            self._found[stamp] = found
            while len(self._found) > MANIFESTS:
                self._found.popitem(last=False)
        return found


@router.get("/blocks", responses=PROBLEMS)
def get_blocks(key: Key, asked: Reader) -> JSONResponse:
    """Return the digests of a record's blocks, and the blocks that hold all but its arrays."""
    with asked.store.opened(key) as (source, _):
        found = asked.request.app.state.manifests.of(key, source, asked.store.place(key))
        body = found.as_json() | {"blocks": packed(source, found.head)}
    return JSONResponse(body, headers=headers_of(key))


@router.head("", responses=PROBLEMS | {200: {"description": "the record is there"}})
def head_record(key: Key, asked: Reader) -> Response:
    """Say whether a sound record is there."""
    with asked.store.opened(key) as (source, _):
        return Response(headers=headers_of(key) | {"Content-Length": str(source.length), "Accept-Ranges": "bytes"})


@router.get(
    "", response_class=Response,
    responses=PROBLEMS
    | {200: {"content": BYTES, "description": "the file"}, 206: {"content": BYTES, "description": "a part of it"},
       304: {"description": "the same as what the client has"}, 416: PROBLEMS[422] | {"description": "no such range"}},
)  # fmt: skip
def get_record(key: Key, asked: Reader) -> Response:
    """Return the file of a record, or the range that is asked for."""
    given = asked.request.headers
    tag = f'"{key}"'
    if tag in [one.strip() for one in given.get("if-none-match", "").split(",")]:
        return Response(status_code=304, headers=headers_of(key))
    with ExitStack() as stack:
        source, _ = stack.enter_context(asked.store.opened(key))
        size = source.length
        asked_range = given.get("range") if given.get("if-range", tag) == tag else None
        first, end, status = 0, size, 200
        if asked_range is not None and (found := byte_range(asked_range, size)) is not None:
            first, end = found
            status = 206
        if first >= end:
            headers = {"Content-Range": f"bytes */{size}"}
            return JSONResponse({"error": "QueryWrong", "detail": f"{asked_range}: of {size} bytes"}, 416, headers)
        headers = headers_of(key) | {"Accept-Ranges": "bytes", "Content-Length": str(end - first)}
        headers |= {"Content-Range": f"bytes {first}-{end - 1}/{size}"} if status == 206 else {}
        if end - first <= PART:
            part = bytearray(end - first)
            source.read_into(first, memoryview(part))
            return Response(bytes(part), status, headers, "application/octet-stream")
        descriptor = os.dup(source.descriptor)
    return StreamingResponse(_parts(descriptor, first, end), status, headers, "application/octet-stream")


async def _parts(descriptor: int, first: int, end: int) -> AsyncIterator[bytes]:
    """Yield the bytes of an open file as fast as the client takes them, then close it."""
    try:
        while first < end:
            part = await to_thread.run_sync(os.pread, descriptor, min(PART, end - first), first)
            if not part:
                return  # The client sees fewer bytes than it was told.
            yield part
            first += len(part)
    finally:
        os.close(descriptor)


def byte_range(text: str, size: int) -> tuple[int, int] | None:
    """Return first byte and end of a `Range` header of one range, RFC 9110 section 14; None where it is to be ignored.

    The range of a header that cannot be satisfied is empty.
    """
    unit, _, spec = text.partition("=")
    first, dash, last = (part.strip() for part in spec.partition("-"))
    if unit.strip().lower() != "bytes" or not dash or "," in spec or not f"{first}0{last}".isdecimal():
        return None
    if len(first) > 18 or len(last) > 18 or not f"{first}0{last}".isascii():
        return None
    if not first:
        return (max(size - int(last), 0), size if int(last) else 0) if last else None
    if last and int(last) < int(first):
        return None
    return int(first), min(int(last) + 1, size) if last else size


def headers_of(key: str) -> dict[str, str]:
    """Return the headers of what depends on a key alone: it never changes."""
    return {"ETag": f'"{key}"', "Cache-Control": "private, max-age=31536000, immutable"}


@router.put(
    "", status_code=201,
    responses=PROBLEMS
    | {200: {"description": "a sound record of this key was there and is kept"},
       408: PROBLEMS[422] | {"description": "the client paused for too long"},
       411: PROBLEMS[422] | {"description": "no Content-Length"},
       507: PROBLEMS[422] | {"description": "the disk is full"}},
    openapi_extra={"requestBody": {"required": True, "content": BYTES}},
)  # fmt: skip
async def put_record(key: Key, asked: Writer, request: Request) -> JSONResponse:
    """Take a record. It becomes visible once it is on the disk and verified: digest, structure, numbers and key."""
    service: Service = request.app.state.service
    size = content_length(request)
    if size > service.largest:
        raise Wrong(f"a record of {size} bytes; this server takes {service.largest}", 413)
    if await to_thread.run_sync(asked.store.has, key):
        return await to_thread.run_sync(_answer, asked, key, "kept")
    try:
        with ExitStack() as stack:
            descriptor = await to_thread.run_sync(stack.enter_context, asked.store.incoming(key))
            await _receive(request, descriptor, size)
            await to_thread.run_sync(stack.close)
    except (ModalDBError, Refused, Wrong) as error:
        asked.log("refuse", key, bytes=size, why=type(error).__name__)
        raise
    asked.log("put", key, bytes=size)
    return await to_thread.run_sync(_answer, asked, key, "written")


async def _receive(request: Request, descriptor: int, size: int) -> None:
    """Write the body of a request to a file, no more than was told and no slower than is allowed."""
    stream, done = request.stream(), 0
    while True:
        try:
            part = await asyncio.wait_for(anext(stream, b""), SLOWEST)
        except TimeoutError:
            raise Refused(408, f"no byte came for {SLOWEST:g} s after {done} of {size}; nothing is kept") from None
        except ClientDisconnect:
            raise Wrong(f"the connection ended after {done} of {size} bytes; nothing is kept", 400) from None
        if not part:
            break
        done += len(part)
        if done > size:
            raise Wrong(f"more than the {size} bytes of Content-Length; nothing is kept", 413)
        await to_thread.run_sync(_write, descriptor, part)
    if done != size:
        raise Wrong(f"{done} of {size} bytes came; nothing is kept", 400)


def _write(descriptor: int, part: bytes) -> None:
    rest = memoryview(part)
    while rest:
        rest = rest[os.write(descriptor, rest) :]


def content_length(request: Request) -> int:
    """Return the size that a client announces; raise Wrong where it announces none."""
    text = request.headers.get("content-length", "")
    if not (text.isascii() and text.isdecimal()) or len(text) > 18:
        raise Wrong("Content-Length: expected the number of bytes", 411)
    return int(text)


def _answer(asked: Asked, key: str, state: str) -> JSONResponse:
    """Return the digest of all bytes of a record, for the client to compare."""
    with asked.store.opened(key) as (source, _):
        found = asked.request.app.state.manifests.of(key, source, asked.store.place(key))
    body: dict[str, Any] = {"key": key, "state": state, "digest": found.digest, "size": found.size}
    return JSONResponse(body, 201 if state == "written" else 200, headers_of(key))
