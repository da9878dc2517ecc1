"""The store in a folder of HSDS: what travels, what others see, and servers that fail."""

import pickle
import uuid
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gudgeon import modaldb
from gudgeon.modaldb.errors import StoreUnusable
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.stores.base import Store
from gudgeon.modaldb.stores.query import Query
from tests.hsds import hsds, opened  # noqa: F401
from tests.modaldb.samples import INPUTS, modes, ramp, same

KEY = content_key(INPUTS)
NODES = 20_000
"""Of a mesh whose basis has 20 000 × 3 × 3 numbers, 1.44 MB."""


def large() -> Any:
    return replace(modes(), shapes=ramp(NODES, 3, 3), static_responses=None)


@pytest.fixture
def store(hsds: None) -> Store:  # noqa: F811
    return modaldb.open(f"hsds:///home/{uuid.uuid4().hex}/records")


@pytest.fixture
def received(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Note the bytes of the body of every answer to h5pyd."""
    import requests

    found: list[int] = []
    send = requests.Session.send

    def noted(self: Any, *arguments: Any, **more: Any) -> Any:
        answer = send(self, *arguments, **more)
        found.append(len(answer.content))
        return answer

    monkeypatch.setattr(requests.Session, "send", noted)
    return found


def test_a_tag_that_was_not_written_is_written_again(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    from h5pyd._hl.attrs import AttributeManager

    store.put(KEY, "modes", modes(), INPUTS)
    write, tries = AttributeManager.__setitem__, list[str]()

    def lossy(self: Any, name: str, value: Any) -> None:
        tries.append(name)
        if len(tries) > 1:
            write(self, name, value)

    monkeypatch.setattr(AttributeManager, "__setitem__", lossy)
    store.tag("kept", KEY)
    assert len(tries) == 2
    assert [one.key for one in modaldb.open(store.location).find(Query(tag="kept"))] == [KEY]


def test_contact_rows_travel_without_the_basis(store: Store, received: list[int]) -> None:
    store.put(KEY, "modes", large(), INPUTS)
    fresh = modaldb.open(store.location)
    received.clear()
    read = fresh.get(KEY, "modes", only=["interfaces/thrust/rows", "angular_frequencies"])
    assert same(read.interfaces["thrust"].rows, modes().interfaces["thrust"].rows)
    assert sum(received) < 400_000
    received.clear()
    assert same(modaldb.open(store.location).get(KEY, "modes"), large())
    assert sum(received) > large().shapes.nbytes


def test_others_see_the_arrays(store: Store) -> None:
    """A client of HSDS that knows nothing of gudgeon reads attributes, arrays and their units."""
    store.put(KEY, "modes", modes(), INPUTS)
    with opened(f"{store.location.removeprefix('hsds://')}/{KEY}.h5", "r") as domain:
        found = domain["interfaces/thrust/rows"]
        assert np.array_equal(found[...], modes().interfaces["thrust"].rows)
        assert domain.attrs["encoding-type"] == "gudgeon-modes"
        assert domain["angular_frequencies"].attrs["units"] == "rad/s"


def test_a_store_travels_to_other_processes(store: Store) -> None:
    assert pickle.loads(pickle.dumps(store)).location == store.location


def test_a_wrong_password(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    store.put(KEY, "modes", modes(), INPUTS)
    monkeypatch.setenv("HS_PASSWORD", "wrong")
    for use in (lambda one: one.get(KEY, "modes"), lambda one: list(one.keys())):
        with pytest.raises(StoreUnusable, match="wrong user or password") as caught:
            use(modaldb.open(store.location))
        assert "\n" not in str(caught.value)


def test_a_server_that_does_not_answer(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("h5pyd", reason="the extra 'hsds' is not installed")
    monkeypatch.setenv("GUDGEON_CACHE", str(tmp_path))
    store = modaldb.open("hsds://127.0.0.1:9/home/records")
    for use in (lambda: store.get(KEY, "modes"), lambda: store.find(), lambda: list(store.keys())):
        with pytest.raises(StoreUnusable, match=r"hsds://127.0.0.1:9/home/records: .* \(after \d+\.\d s\)") as caught:
            use()
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("url", ["hsds://host", "hsds://host:x/a", "hsds://user@host/a", "hsds:///", "hsds://h/a?b=c"])
def test_urls_that_are_none(url: str) -> None:
    pytest.importorskip("h5pyd", reason="the extra 'hsds' is not installed")
    with pytest.raises(StoreUnusable, match="expected hsds://HOST:PORT/FOLDER"):
        modaldb.open(url)
