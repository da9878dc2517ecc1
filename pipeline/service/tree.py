"""The raw tree of a record for viewers such as H5Web: h5grove's routes behind the same door, where it is installed.

`/NAME/h5grove/meta/?file=KEY.h5&path=/` and its sisters `attr`, `data`, `stats`, `paths` answer as those of h5grove, of
records of the database alone, after the same tokens and the same verification as all other routes.
"""

import functools
import re
from collections.abc import Callable
from importlib.util import find_spec
from typing import Annotated, Any

from fastapi import APIRouter, FastAPI, Query

from gudgeon.pipeline.service import arrays
from gudgeon.pipeline.service.context import Reader

FILE = re.compile(r"([0-9a-f]{64})(\.h5)?")
WHOLE = ("data", "stats")
"""Routes that read a whole array."""


def add_tree(app: FastAPI) -> None:
    """Add the routes of h5grove to an application; nothing where h5grove is not installed."""
    if find_spec("h5grove") is None or find_spec("pydantic_settings") is None:
        return
    from h5grove import fastapi_utils as h5grove  # pyright: ignore[reportMissingImports]

    router = APIRouter(prefix="/{database}/h5grove", route_class=h5grove.H5GroveRoute, include_in_schema=False)
    for name in ("attr", "data", "meta", "stats", "paths"):
        endpoint = _in_one_line(getattr(h5grove, f"get_{name}"))
        for path in (f"/{name}", f"/{name}/"):  # H5Web asks with a slash.
            router.add_api_route(path, endpoint, response_model=None)
    app.include_router(router)
    app.dependency_overrides[h5grove.add_base_path] = _file_of


def _file_of(
    asked: Reader, file: Annotated[str, Query(max_length=80)], path: Annotated[str, Query(max_length=500)] = "/"
) -> str:
    """Return the path of a sound record's file."""
    found = FILE.fullmatch(file)
    if found is None:
        raise arrays.Wrong(f"file={file!r}: expected KEY.h5, 64 hexadecimal digits", 404)
    with asked.store.opened(found[1]) as (_, head):
        if asked.request.url.path.rstrip("/").rpartition("/")[2] in WHOLE:
            dataset = arrays.dataset_of(head, arrays.unwritten(path))
            if dataset.nbytes > arrays.MOST_BYTES:
                text = f"{path}: {dataset.nbytes} bytes are more than {arrays.MOST_BYTES}; ask for rows by /field"
                raise arrays.Wrong(text, 413)
    return str(asked.store.path(found[1]))


def _in_one_line(endpoint: Callable[..., Any]) -> Callable[..., Any]:
    """Return an endpoint that answers a path of the wrong kind with one line."""

    @functools.wraps(endpoint)
    def answer(*arguments: Any, **more: Any) -> Any:
        try:
            return endpoint(*arguments, **more)
        except (TypeError, ValueError, IndexError) as error:
            raise arrays.Wrong(str(error) or type(error).__name__) from error

    return answer
