"""h5grove's routes behind the same door: what H5Web asks for, of records alone, with a token."""

import io
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
from gudgeon.modaldb.records import ModalRecord
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
    status, _, body = get(url, token, **query)
    return status, json.loads(body)


def get(url: str, token: str = TOKEN, **query: str) -> tuple[int, str, bytes]:
    """Return status, type and bytes of an answer."""
    request = urllib.request.Request(f"{url}?{urllib.parse.urlencode(query)}")
    request.add_header("Authorization", f"Bearer {token}")
    try:
        with urllib.request.urlopen(request, timeout=20) as answer:
            return answer.status, answer.headers["Content-Type"], answer.read()
    except urllib.error.HTTPError as error:
        return error.code, error.headers["Content-Type"], error.read()


PATH = "/interfaces/thrust/rows"
ASKED_BY_H5WEB = (
    ("/meta", {"path": "/"}),
    ("/meta", {"path": "/interfaces/thrust"}),
    ("/attr", {"path": PATH}),
    ("/data", {"path": "/angular_frequencies", "format": "bin", "dtype": "safe"}),
    ("/data", {"path": "/shapes", "selection": "0,:,:", "format": "bin", "dtype": "safe"}),
    ("/data", {"path": PATH, "format": "npy"}),
    ("/data", {"path": PATH, "format": "tiff"}),
    ("/paths", {"path": "/"}),
)
"""Routes and parameters of H5Web 17, as a browser sent them: tree, attributes, lines, slices, exports, search."""


def shapes_of(record: ModalRecord) -> np.ndarray:
    assert record.shapes is not None
    return record.shapes


def test_what_h5web_asks_for(url: str) -> None:
    """Answers as H5Web's own reader takes them: its tree from `meta`, its numbers from bytes of the shape there."""
    asked = [get(f"{url}{route}", file=f"{KEY}.h5", **query) for route, query in ASKED_BY_H5WEB]
    assert [status for status, _, _ in asked] == [200] * len(asked)
    bodies = [body for _, _, body in asked]
    root, group, attributes, paths = (json.loads(bodies[number]) for number in (0, 1, 2, 7))
    assert {"interfaces", "shapes"} <= {one["name"] for one in root["children"] if one["kind"] in ("group", "dataset")}
    assert {"name", "kind", "attributes"} <= root.keys()
    assert all({"name", "shape", "type"} <= one.keys() for one in root["attributes"])
    (rows,) = (one for one in group["children"] if one["name"] == "rows")
    assert (rows["kind"], rows["type"]["class"], rows["type"]["size"], rows["type"]["order"]) == ("dataset", 1, 8, 0)
    expected = modes()
    assert rows["shape"] == list(expected.interfaces["thrust"].rows.shape)
    assert {one["name"] for one in rows["attributes"]} == attributes.keys() == {"units", "long_name"}
    assert np.array_equal(np.frombuffer(bodies[3]), expected.angular_frequencies)
    assert np.array_equal(np.frombuffer(bodies[4]), shapes_of(expected)[0].ravel())
    assert np.array_equal(np.load(io.BytesIO(bodies[5])), expected.interfaces["thrust"].rows)
    assert bodies[6][:4] in (b"II*\0", b"MM\0*")
    assert PATH in paths
    assert asked[3][1] == "application/octet-stream"


def test_routes_with_a_slash_at_their_end(url: str) -> None:
    assert ask(f"{url}/meta/", file=KEY, path=PATH)[1]["shape"] == list(modes().interfaces["thrust"].rows.shape)
    assert np.array_equal(ask(f"{url}/data/", file=KEY, path=PATH)[1], modes().interfaces["thrust"].rows)
    assert ask(f"{url}/attr/", file=KEY, path="/")[1]["encoding-type"] == "gudgeon-modes"
    assert ask(f"{url}/stats/", file=KEY, path=PATH)[0] == 200


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
        ("attr", {"file": KEY, "attr_keys": "none"}, 422),
        ("meta", {"file": KEY, "path": ""}, 404),
        ("meta", {"file": KEY, "path": "/shapes", "resolve_links": "never"}, 422),
        ("data", {"file": KEY, "path": "/shapes", "selection": "0,0,0,0,0"}, 422),
        ("data", {"file": KEY, "path": "/shapes", "selection": "::-1"}, 422),
        ("data", {"file": KEY, "path": "/shapes", "selection": "::0"}, 422),
        ("data", {"file": KEY, "path": "/shapes", "selection": "99999999999999999999"}, 422),
        ("data", {"file": KEY, "path": "/shapes", "format": "csv"}, 422),
        ("data", {"file": KEY, "path": "/shapes", "dtype": "none"}, 422),
        ("stats", {"file": KEY, "path": "/interfaces"}, 404),
        ("paths", {"file": KEY, "path": "/shapes"}, 422),
    ],
)
def test_what_is_refused(url: str, route: str, query: dict[str, str], expected: int) -> None:
    status, found = ask(f"{url}/{route}/", **query)
    assert (status, "\n" in str(found)) == (expected, False)
    assert found.keys() == {"error", "detail", "message"}
    assert found["message"] == found["detail"]  # H5Web shows this, and of other errors only their status.


def test_a_token_is_needed(url: str) -> None:
    status, found = ask(f"{url}/meta/", token="wrong", file=KEY)
    assert (status, found["message"]) == (401, "an unknown token")


def test_a_damaged_record_is_not_shown(url: str, tmp_path: Path) -> None:
    file = tmp_path / "db" / KEY[:2] / f"{KEY}.h5"
    file.write_bytes(file.read_bytes()[:-1] + b"?")
    assert ask(f"{url}/meta/", file=KEY)[0] == 409


def test_an_array_that_is_too_large(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gudgeon.pipeline.service.arrays.MOST_BYTES", 100)
    assert ask(f"{url}/data/", file=KEY, path="/shapes")[0] == 413
    count = shapes_of(modes())[0].nbytes
    monkeypatch.setattr("gudgeon.pipeline.service.arrays.MOST_BYTES", count)
    for selection, expected in (("0,:,:", 200), ("0", 200), ("0:1", 200), ("-1,:", 200), ("0:2,:,:", 413),
                                (":", 413), ("::2", 413)):  # fmt: skip
        answer = get(f"{url}/data", file=KEY, path="/shapes", selection=selection, format="bin")
        assert answer[0] == expected, selection
    assert ask(f"{url}/stats", file=KEY, path="/shapes", selection="0")[0] == 200


def test_more_numbers_than_are_written_as_text(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gudgeon.pipeline.service.arrays.MOST_NUMBERS", 2)
    status, found = ask(f"{url}/data", file=KEY, path="/shapes")
    assert (status, "ask for format=bin" in found["message"]) == (413, True)
    assert get(f"{url}/data", file=KEY, path="/shapes", format="bin")[0] == 200
