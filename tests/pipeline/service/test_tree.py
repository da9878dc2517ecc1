"""h5grove's routes behind the same door: what H5Web asks for, of records alone, with a token."""

import json
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon import modaldb
from gudgeon.modaldb.keys import content_key
from tests.modaldb.samples import INPUTS, modes
from tests.pipeline.service.serving import TOKEN, served

pytest.importorskip("h5grove", reason="h5grove is not installed")
pytest.importorskip("pydantic_settings", reason="pydantic-settings is not installed")
KEY = content_key(INPUTS)


@pytest.fixture
def url(tmp_path: Path) -> Iterator[str]:
    with served(tmp_path / "db") as place:
        modaldb.open(place).put(KEY, "modes", modes(), INPUTS)
        yield f"{place}/default/h5grove"


def ask(url: str, token: str = TOKEN, **query: str) -> tuple[int, Any]:
    """Return status and JSON of an answer."""
    request = urllib.request.Request(f"{url}?{urllib.parse.urlencode(query)}")
    request.add_header("Authorization", f"Bearer {token}")
    try:
        with urllib.request.urlopen(request, timeout=20) as answer:
            return answer.status, json.load(answer)
    except urllib.error.HTTPError as error:
        return error.code, json.load(error)


def test_what_h5web_asks_for(url: str) -> None:
    status, found = ask(f"{url}/meta/", file=f"{KEY}.h5", path="/")
    assert status == 200
    assert {"interfaces", "shapes"} <= {one["name"] for one in found["children"]}
    path = "/interfaces/thrust/rows"
    assert ask(f"{url}/meta/", file=KEY, path=path)[1]["shape"] == list(modes().interfaces["thrust"].rows.shape)
    assert np.array_equal(ask(f"{url}/data/", file=KEY, path=path)[1], modes().interfaces["thrust"].rows)
    assert ask(f"{url}/attr/", file=KEY, path="/")[1]["encoding-type"] == "gudgeon-modes"
    assert ask(f"{url}/paths/", file=KEY, path="/")[0] == 200
    assert ask(f"{url}/stats/", file=KEY, path=path)[0] == 200


@pytest.mark.parametrize(
    ("route", "query", "expected"),
    [
        ("meta", {"file": "../../etc/passwd"}, 404),
        ("meta", {"file": "/etc/passwd"}, 404),
        ("meta", {"file": "names.jsonl"}, 404),
        ("meta", {"file": "0" * 64}, 404),
        ("meta", {"file": KEY, "path": "/nothing"}, 404),
        ("data", {"file": KEY, "path": "/"}, 404),
        ("data", {"file": KEY, "path": "/shapes", "selection": "x"}, 422),
        ("data", {"file": KEY, "path": "/shapes", "format": "exe"}, 422),
        ("attr", {}, 422),
    ],
)
def test_what_is_refused(url: str, route: str, query: dict[str, str], expected: int) -> None:
    status, found = ask(f"{url}/{route}/", **query)
    assert (status, "\n" in str(found)) == (expected, False)


def test_a_token_is_needed(url: str) -> None:
    assert ask(f"{url}/meta/", token="wrong", file=KEY)[0] == 401


def test_a_damaged_record_is_not_shown(url: str, tmp_path: Path) -> None:
    file = tmp_path / "db" / KEY[:2] / f"{KEY}.h5"
    file.write_bytes(file.read_bytes()[:-1] + b"?")
    assert ask(f"{url}/meta/", file=KEY)[0] == 409


def test_an_array_that_is_too_large(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gudgeon.pipeline.service.arrays.MOST_BYTES", 100)
    assert ask(f"{url}/data/", file=KEY, path="/shapes")[0] == 413
