"""The raw tree of a record for viewers such as H5Web: h5grove's routes behind the same door, where it is installed.

`/NAME/h5grove/meta?file=KEY.h5&path=/` and its sisters `attr`, `data`, `stats`, `paths` answer as those of h5grove, of
records of the database alone, after the same tokens and the same verification as all other routes.
"""

import functools
import math
import re
from collections.abc import Callable, Coroutine
from importlib.util import find_spec
from typing import Annotated, Any

from fastapi import APIRouter, FastAPI, Query, Request
from fastapi.responses import Response
from fastapi.routing import APIRoute

from gudgeon.modaldb.format.structure import Dataset
from gudgeon.pipeline.service import arrays
from gudgeon.pipeline.service.context import EXPLAINED, Reader, explained, one_line, problem

FILE = re.compile(r"([0-9a-f]{64})(\.h5)?")
WHOLE = ("data", "stats")
"""Routes that read an array."""
TEXTS = ("json", "csv")
"""Formats of an answer that writes numbers as text."""


def add_tree(app: FastAPI) -> None:
    """Add the routes of h5grove to an application; nothing where h5grove is not installed."""
    if find_spec("h5grove") is None or find_spec("pydantic_settings") is None:
        return
    from h5grove import fastapi_utils as h5grove  # pyright: ignore[reportMissingImports]

    router = APIRouter(prefix="/{database}/h5grove", route_class=TreeRoute, include_in_schema=False)
    for name in ("attr", "data", "meta", "stats", "paths"):
        endpoint = _in_one_line(getattr(h5grove, f"get_{name}"), h5grove.H5GroveException)
        for path in (f"/{name}", f"/{name}/"):  # H5Web asks with a slash up to version 5.
            router.add_api_route(path, endpoint, response_model=None)
    app.include_router(router)
    app.dependency_overrides[h5grove.add_base_path] = _file_of


class TreeRoute(APIRoute):
    """A route whose errors have the text of `detail` as `message`, too: H5Web shows nothing else of them."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """See `APIRoute`."""
        handler = super().get_route_handler()

        async def answer(request: Request) -> Response:
            try:
                return await handler(request)
            except EXPLAINED as error:
                status, kind, text = explained(error)
                return problem(status, kind, text, message=one_line(text))

        return answer


def _file_of(
    context: Reader, file: Annotated[str, Query(max_length=80)], path: Annotated[str, Query(max_length=500)] = "/", *,
    selection: Annotated[str | None, Query(max_length=200)] = None,
    format: Annotated[str, Query(max_length=20)] = "json",
) -> str:  # fmt: skip
    """Return the path of a sound record's file."""
    match = FILE.fullmatch(file)
    if match is None:
        raise arrays.Wrong(f"file={file!r}: expected KEY.h5, 64 hexadecimal digits", 404)
    with context.store.opened(match[1]) as (_, head):
        route = context.request.url.path.rstrip("/").rpartition("/")[2]
        if route in WHOLE:
            dataset = arrays.dataset_of(head, arrays.unwritten(path))
            _check_size(dataset, path, selection, as_text=route == "data" and format in TEXTS)
    return str(context.store.path(match[1]))


def _check_size(dataset: Dataset, path: str, selection: str | None, *, as_text: bool) -> None:
    """Raise Wrong where an answer would be too large: H5Web asks for a slice of an array with three axes or more."""
    count = math.prod(dataset.shape) if selection is None else _selected(dataset.shape, selection)
    size = count * (dataset.nbytes // max(math.prod(dataset.shape), 1))
    if size > arrays.MOST_BYTES:
        raise arrays.Wrong(
            f"{path}: {size} bytes are more than {arrays.MOST_BYTES}; ask for a selection, or for rows by /field", 413
        )
    if as_text and count > arrays.MOST_NUMBERS:
        raise arrays.Wrong(f"{path}: {count} numbers are more than {arrays.MOST_NUMBERS} as text; ask for format=bin or"
                           " npy, or a selection", 413)  # fmt: skip


def _selected(shape: tuple[int, ...], selection: str) -> int:
    """Return the number of items that a selection such as `0,:,::10` takes; an axis without one is taken whole."""
    from h5grove.utils import parse_slice  # pyright: ignore[reportMissingImports]

    try:
        members = parse_slice(selection)
        counts = [1 if isinstance(m, int) else len(range(*m.indices(length)))
                 for m, length in zip(members, shape, strict=False)]  # fmt: skip
    except (TypeError, ValueError) as error:
        raise arrays.Wrong(f"selection={selection[:80]}: expected numbers and ranges such as 0,:,::10") from error
    return math.prod(counts) * math.prod(shape[len(counts) :])


def _in_one_line(endpoint: Callable[..., Any], failure: type[Exception]) -> Callable[..., Any]:
    """Return an endpoint that answers a path or name of the wrong kind with one line.

    Args:
        failure: What h5grove raises, with `status_code` and `message`.
    """

    @functools.wraps(endpoint)
    def answer(*arguments: Any, **keywords: Any) -> Any:
        try:
            return endpoint(*arguments, **keywords)
        except failure as error:
            raise arrays.Wrong(error.message, error.status_code) from error  # type: ignore[attr-defined]
        except (TypeError, ValueError, LookupError) as error:
            raise arrays.Wrong(str(error).strip("\"'") or type(error).__name__) from error

    return answer
