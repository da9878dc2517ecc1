"""What every request needs: the database that its path names, the right to it, and one-line errors."""

import logging
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from fastapi import Depends, Path, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from fastapi.routing import APIRoute
from pydantic import BaseModel

from gudgeon.modaldb.errors import (
    ModalDBError,
    RecordDamaged,
    RecordMismatch,
    RecordMissing,
    RecordNotWritten,
    StoreUnusable,
)
from gudgeon.modaldb.stores.folder import FolderStore
from gudgeon.modaldb.stores.query import QueryWrong
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.service.access import Access, Refused
from gudgeon.pipeline.service.arrays import Wrong

audit = logging.getLogger("gudgeon.audit")
STATUS: dict[type[Exception], int] = {
    RecordMissing: 404, RecordDamaged: 409, RecordMismatch: 409, QueryWrong: 422, RecordNotWritten: 507,
    StoreUnusable: 500,
}  # fmt: skip
"""Status of the answer to an error of the database."""


class Problem(BaseModel):
    """An answer that says in one line why there is no other."""

    error: str
    """Name of the error."""
    detail: str


PROBLEMS: dict[int | str, dict[str, Any]] = {
    status: {"model": Problem, "description": text}
    for status, text in {
        401: "no token, or an unknown one", 403: "the token has no such right", 404: "not there",
        409: "the record is damaged, or of another kind", 413: "too large", 422: "wrong parameters",
        400: "wrong host or request", 500: "the database cannot be read or written",
    }.items()
}  # fmt: skip
"""What any route may answer."""


@dataclass(frozen=True)
class Service:
    """What a server serves."""

    stores: Mapping[str, FolderStore]
    """By the names in URLs."""
    access: Access
    hosts: frozenset[str]
    """Names under which it may be called; none: any."""
    largest: int
    """Bytes of a record that it takes."""


@dataclass(frozen=True)
class Asked:
    """A database, and who asks for it."""

    request: Request
    name: str
    store: FolderStore
    who: str

    def log(self, action: str, key: str, **details: Any) -> None:
        """Write a line of the audit."""
        client = self.request.client.host if self.request.client else "-"
        stamp = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
        text = " ".join(f"{name}={value}" for name, value in details.items())
        audit.info("%s %s %s %s by=%s from=%s %s", stamp, action, self.name, key, self.who, client, text)


SIGNED = ("expires", "signature")
"""Parameters of a signed link."""
LINK = "link"
"""Who asks by a signed link."""
NAME = r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$"
KEY = r"^[0-9a-f]{64}$"
Database = Annotated[str, Path(pattern=NAME, description="name of the database", examples=["default"])]
Key = Annotated[str, Path(pattern=KEY, description="key of the record, 64 hexadecimal digits")]


def asked(right: str, *, linked: bool = False) -> Any:
    """Return a dependency that gives the database of a request to whoever has a right to it.

    Args:
        linked: Whether a signed link opens the route, too: one that reads the record of its key and nothing else.
    """

    def find(request: Request, database: Database) -> Asked:
        service: Service = request.app.state.service
        query = request.query_params
        if linked and "signature" in query:
            _check_link(service.access, request, database)
            who = LINK
        else:
            who = service.access.check(request.headers.get("authorization"), right, database).name
        if (store := service.stores.get(database)) is None:
            raise RecordMissing(f"no database '{database}' on this server")
        return Asked(request, database, store, who)

    return Depends(find)


def _check_link(access: Access, request: Request, database: str) -> None:
    """Raise Refused unless a link is signed for the record of this request, or for this route of it."""
    key = request.path_params["key"]
    route = request.scope["path"].removeprefix(f"/{database}/records/{key}").strip("/")
    expires, signature = request.query_params.get("expires", ""), request.query_params["signature"]
    if not any(access.is_signed(f"{database}/{key}{end}", expires, signature) for end in {"", f"/{route}"}):
        raise Refused(403, "the link is not signed by this server for this, or has expired")


Reader = Annotated[Asked, asked("read")]
Linked = Annotated[Asked, asked("read", linked=True)]
"""Who reads one record and nothing else: the holder of a link to it, too."""
Writer = Annotated[Asked, asked("put")]
Remover = Annotated[Asked, asked("delete")]


async def known_parameters(request: Request) -> None:  # Not in a thread of its own: every request asks.
    """Refuse a query parameter that a route of the schema does not have: it would be left out in silence."""
    route = request.scope.get("route")
    if not request.query_params or not isinstance(route, APIRoute) or not route.include_in_schema:
        return
    described = request.app.openapi()["paths"][route.path_format][request.method.lower()]
    allowed_names = [p["name"] for p in described.get("parameters", ()) if p["in"] == "query"]
    unknown = next((name for name in request.query_params if name not in allowed_names and name not in SIGNED), None)
    if unknown is not None:
        allowed = ", ".join(allowed_names) or "none"
        raise Wrong(f"{unknown[:80]}: no such parameter of {route.path.rpartition('/')[2]}; allowed: {allowed}")


def problem(status: int, kind: str, text: str, **extra: str) -> JSONResponse:
    """Return an answer that says why there is no other."""
    headers = {"WWW-Authenticate": "Bearer"} if status == 401 else None
    return JSONResponse({"error": kind, "detail": one_line(text), **extra}, status, headers)


def one_line(text: str) -> str:
    """Return a text with single spaces for all that is white."""
    return " ".join(text.split())


def explain(request: Request, error: Exception) -> JSONResponse:
    """Answer an error of the database, of a choice, or of a right."""
    return problem(*explained(error))


def explained(error: Exception) -> tuple[int, str, str]:
    """Return status, name and text of the answer to one of `EXPLAINED`."""
    if isinstance(error, Refused):
        return error.status, "StoreUnusable", str(error)
    if isinstance(error, InputError):
        return 422, "QueryWrong", str(error)
    if isinstance(error, Wrong):
        return error.status, "RecordMissing" if error.status == 404 else "QueryWrong", str(error)
    if isinstance(error, RequestValidationError):
        return _invalid(error)
    status = next((status for kind, status in STATUS.items() if isinstance(error, kind)), 500)
    return status, type(error).__name__, str(error)


def _invalid(error: RequestValidationError) -> tuple[int, str, str]:
    """Answer wrong parameters; a database or record of a name that none can have is not there."""
    mistake = error.errors()[0]
    location = [str(step) for step in mistake["loc"]]
    if location[0] == "path" and location[-1] != "tag":
        return 404, "RecordMissing", f"no record: {location[-1]} {str(mistake.get('input'))[:80]!r} is none"
    return 422, "QueryWrong", f"{'.'.join(location[1:]) or location[0]}: {mistake['msg']}"


EXPLAINED = (ModalDBError, InputError, Refused, Wrong, RequestValidationError)
