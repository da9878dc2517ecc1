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
from gudgeon.pipeline.service.context import PROBLEMS, Asked, Key, Linked, Service, Writer

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

    def of(self, key: str, source: FileSource, path: str) -> Manifest:
        """Return the list of a verified record."""
        stat = os.fstat(source.descriptor)
        stamp = (stat.st_dev, stat.st_ino, stat.st_size, stat.st_mtime_ns, int(key[:15], 16))
        with self._lock:
            if (manifest := self._found.get(stamp)) is not None:
                self._found.move_to_end(stamp)
                return manifest
        manifest = manifest_of(key, source, path)
        with self._lock:
            self._found[stamp] = manifest
            while len(self._found) > MANIFESTS:
                self._found.popitem(last=False)
        return manifest


@router.get("/blocks", responses=PROBLEMS)
def get_blocks(key: Key, context: Linked) -> JSONResponse:
    """Return the digests of a record's blocks, and the blocks that hold all but its arrays."""
    with context.store.opened(key) as (source, _):
        manifest = context.request.app.state.manifests.of(key, source, context.store.place(key))
        body = manifest.as_json() | {"blocks": packed(source, manifest.head)}
    return JSONResponse(body, headers=headers_of(key))


@router.head("", responses=PROBLEMS | {200: {"description": "the record is there"}})
def head_record(key: Key, context: Linked) -> Response:
    """Say whether a sound record is there."""
    with context.store.opened(key) as (source, _):
        return Response(headers=headers_of(key) | {"Content-Length": str(source.length), "Accept-Ranges": "bytes"})


@router.get(
    "", response_class=Response,
    responses=PROBLEMS
    | {200: {"content": BYTES, "description": "the file"}, 206: {"content": BYTES, "description": "a part of it"},
       304: {"description": "the same as what the client has"}, 416: PROBLEMS[422] | {"description": "no such range"}},
)  # fmt: skip
def get_record(key: Key, context: Linked) -> Response:
    """Return the file of a record, or the range that is asked for."""
    sent = context.request.headers
    tag = f'"{key}"'
    with ExitStack() as stack:
        source, _ = stack.enter_context(context.store.opened(key))
        if tag in [t.strip() for t in sent.get("if-none-match", "").split(",")]:
            return Response(status_code=304, headers=headers_of(key))
        size = source.length
        asked_range = sent.get("range") if sent.get("if-range", tag) == tag else None
        start, end, status = 0, size, 200
        if asked_range is not None and (span := byte_range(asked_range, size)) is not None:
            start, end = span
            status = 206
        if start >= end:
            headers = {"Content-Range": f"bytes */{size}"}
            return JSONResponse({"error": "QueryWrong", "detail": f"{asked_range}: of {size} bytes"}, 416, headers)
        headers = headers_of(key) | {"Accept-Ranges": "bytes", "Content-Length": str(end - start)}
        headers |= {"Content-Range": f"bytes {start}-{end - 1}/{size}"} if status == 206 else {}
        if end - start <= PART:
            data = bytearray(end - start)
            source.read_into(start, memoryview(data))
            return Response(bytes(data), status, headers, "application/octet-stream")
        descriptor = os.dup(source.descriptor)
    return StreamingResponse(_parts(descriptor, start, end), status, headers, "application/octet-stream")


async def _parts(descriptor: int, start: int, end: int) -> AsyncIterator[bytes]:
    """Yield the bytes of an open file as fast as the client takes them, then close it."""
    try:
        while start < end:
            data = await to_thread.run_sync(os.pread, descriptor, min(PART, end - start), start)
            if not data:
                return  # The client sees fewer bytes than it was told.
            yield data
            start += len(data)
    finally:
        os.close(descriptor)


def byte_range(text: str, size: int) -> tuple[int, int] | None:
    """Return first byte and end of a `Range` header of one range, RFC 9110 section 14; None where it is to be ignored.

    The range of a header that cannot be satisfied is empty.
    """
    unit, _, spec = text.partition("=")
    start, dash, stop = (bound.strip() for bound in spec.partition("-"))
    if unit.strip().lower() != "bytes" or not dash or "," in spec or not f"{start}0{stop}".isdecimal():
        return None
    if len(start) > 18 or len(stop) > 18 or not f"{start}0{stop}".isascii():
        return None
    if not start:
        return (max(size - int(stop), 0), size if int(stop) else 0) if stop else None
    if stop and int(stop) < int(start):
        return None
    return int(start), min(int(stop) + 1, size) if stop else size


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
async def put_record(key: Key, context: Writer, request: Request) -> JSONResponse:
    """Take a record. It becomes visible once it is on the disk and verified: digest, structure, numbers and key."""
    service: Service = request.app.state.service
    size = content_length(request)
    if size > service.largest:
        raise Wrong(f"a record of {size} bytes; this server takes {service.largest}", 413)
    if await to_thread.run_sync(context.store.has, key):
        return await to_thread.run_sync(_answer, context, key, "kept")
    try:
        with ExitStack() as stack:
            descriptor = await to_thread.run_sync(stack.enter_context, context.store.incoming(key))
            await _receive(request, descriptor, size)
            await to_thread.run_sync(stack.close)
    except (ModalDBError, Refused, Wrong) as error:
        context.log("refuse", key, bytes=size, why=type(error).__name__)
        raise
    context.log("put", key, bytes=size)
    return await to_thread.run_sync(_answer, context, key, "written")


async def _receive(request: Request, descriptor: int, size: int) -> None:
    """Write the body of a request to a file, no more than was told and no slower than is allowed."""
    stream, done = request.stream(), 0
    while True:
        try:
            data = await asyncio.wait_for(anext(stream, b""), SLOWEST)
        except TimeoutError:
            raise Refused(408, f"no byte came for {SLOWEST:g} s after {done} of {size}; nothing is kept") from None
        except ClientDisconnect:
            raise Wrong(f"the connection ended after {done} of {size} bytes; nothing is kept", 400) from None
        if not data:
            break
        done += len(data)
        if done > size:
            raise Wrong(f"more than the {size} bytes of Content-Length; nothing is kept", 413)
        await to_thread.run_sync(_write, descriptor, data)
    if done != size:
        raise Wrong(f"{done} of {size} bytes came; nothing is kept", 400)


def _write(descriptor: int, data: bytes) -> None:
    remaining = memoryview(data)
    while remaining:
        remaining = remaining[os.write(descriptor, remaining) :]


def content_length(request: Request) -> int:
    """Return the size that a client announces; raise Wrong where it announces none."""
    text = request.headers.get("content-length", "")
    if not (text.isascii() and text.isdecimal()) or len(text) > 18:
        raise Wrong("Content-Length: expected the number of bytes", 411)
    return int(text)


def _answer(context: Asked, key: str, state: str) -> JSONResponse:
    """Return the digest of all bytes of a record, for the client to compare."""
    with context.store.opened(key) as (source, _):
        manifest = context.request.app.state.manifests.of(key, source, context.store.place(key))
    body: dict[str, Any] = {"key": key, "state": state, "digest": manifest.digest, "size": manifest.size}
    return JSONResponse(body, 201 if state == "written" else 200, headers_of(key))
