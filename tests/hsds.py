"""A server of HSDS for tests, where it is installed."""

import os
from collections.abc import Iterator
from typing import Any

import pytest

from docs.tools.hsds_server import program, started
from tests.pipeline.service.serving import variables


def opened(path: str, mode: str) -> Any:
    """Return an open domain, as any client of HSDS has it."""
    import h5pyd

    names = ("endpoint", "username", "password")
    return h5pyd.File(path, mode, **{name: os.environ[f"HS_{name.upper()}"] for name in names})


@pytest.fixture(scope="module")
def hsds(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A server, which every store of a file has a folder of."""
    pytest.importorskip("h5pyd", reason="the extra 'hsds' is not installed")
    if program() is None:
        pytest.skip("HSDS is not installed: run `make hsds`")
    folder = tmp_path_factory.mktemp("hsds")
    with started(folder / "data") as places, variables({**places, "GUDGEON_CACHE": str(folder / "cache")}):
        yield
