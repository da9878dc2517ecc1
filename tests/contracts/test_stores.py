"""Every store keeps the contract of `Store`: whole records or none, the same answers wherever they are."""

import json
import os
import time
import uuid
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

import pytest

from gudgeon import modaldb
from gudgeon.modaldb.errors import RecordDamaged, RecordMismatch, RecordMissing, StoreUnusable
from gudgeon.modaldb.format.hdf5 import read_record
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.records import KINDS
from gudgeon.modaldb.stores.base import Store
from gudgeon.modaldb.stores.local.names import NAMES
from gudgeon.modaldb.stores.query import Query, QueryWrong, condition
from gudgeon.modaldb.stores.upkeep import unreferenced
from tests.hsds import hsds, opened  # noqa: F401
from tests.modaldb.samples import INPUTS, SAMPLES, WITHOUT_ARRAYS, mesh, modes, same, verify_record
from tests.pipeline.service.serving import served

KEY = content_key(INPUTS)

PLACES: dict[str, Callable[[Path], AbstractContextManager[str]]] = {
    "folder": lambda root: nullcontext(str(root)),
    "HTTP": served,
    "HSDS": lambda root: nullcontext(f"hsds:///home/{root.parent.name}-{uuid.uuid4().hex[:8]}"),
}
"""Where a store is: gives the location of a store whose records stand in a folder, or in one of HSDS."""


@pytest.fixture(params=PLACES)
def location(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    if request.param == "HSDS":
        request.getfixturevalue("hsds")
    with PLACES[request.param](tmp_path / "db") as place:
        yield place


@pytest.fixture
def store(location: str) -> Store:
    return modaldb.open(location)


class Behind:
    """The record of KEY where it is kept, reached without its store."""

    def __init__(self, location: str, folder: Path) -> None:
        self._domain = f"{location.removeprefix('hsds://')}/{KEY}.h5" if location.startswith("hsds") else ""
        self._file = folder / KEY[:2] / f"{KEY}.h5"
        self._names = folder / NAMES

    def _opened(self, mode: str, name: str = "") -> Any:
        return opened(name or self._domain, mode)

    def damage(self) -> None:
        """Change one number."""
        if self._domain:
            with self._opened("r+") as domain:
                array = domain["nodes"] if "nodes" in domain else domain["angular_frequencies"]
                array[0] = array[0] + 1.0
        else:
            whole = bytearray(self._file.read_bytes())
            whole[len(whole) // 2] ^= 1
            self._file.write_bytes(whole)

    def identity(self) -> tuple[Any, ...]:
        """Return what changes where a record is written once more."""
        if self._domain:
            with self._opened("r") as domain:
                return domain.id.id, domain.modified
        return self._file.stat().st_ino, self._file.stat().st_mtime_ns

    def names(self) -> list[dict[str, Any]]:
        """Return the names of records, as they were noted."""
        if self._domain:
            with self._opened("r", f"{self._domain.rpartition('/')[0]}/names") as domain:
                return [json.loads(text) for text in domain.attrs.values()]
        return [json.loads(line) for line in self._names.read_text().splitlines()]


@pytest.fixture
def behind(location: str, tmp_path: Path) -> Behind:
    return Behind(location, tmp_path / "db")


@pytest.mark.parametrize("kind", KINDS)
def test_round_trip(kind: str, store: Store, location: str) -> None:
    assert not store.has(KEY)
    store.put(KEY, kind, SAMPLES[kind](), INPUTS)
    for one in (store, modaldb.open(location)):
        assert one.has(KEY)
        assert one.fault(KEY) is None
        assert one.examine(KEY) is None
        assert same(one.get(KEY, kind), SAMPLES[kind]())
        assert one.provenance(KEY) == INPUTS
        assert (sum(one.sizes(KEY).values()) > 0) == (kind not in WITHOUT_ARRAYS)
        assert list(one.keys()) == [KEY]
        assert [fault for _, fault in one.verify()] == [None]


def test_location_opens_the_same_store(store: Store, location: str) -> None:
    assert store.location == location
    assert KEY in store.place(KEY)


def test_partial_read(store: Store, location: str) -> None:
    store.put(KEY, "modes", modes(), INPUTS)
    read = modaldb.open(location).get(KEY, "modes", only=["angular_frequencies", "interfaces/thrust/rows"])
    assert same(read.angular_frequencies, modes().angular_frequencies)
    assert same(read.interfaces["thrust"].rows, modes().interfaces["thrust"].rows)
    assert read.shapes is None


@pytest.mark.parametrize("key", [KEY, "../../etc/passwd", "", "AB" * 32, "ab/" * 21 + "a", "%2e%2e%2f" * 7, "é" * 64])
def test_a_record_that_is_not_there(key: str, store: Store) -> None:
    for use in (lambda: store.get(key, "mesh"), lambda: store.sizes(key), lambda: store.provenance(key)):
        with pytest.raises(RecordMissing, match=r"no (mesh )?record") as caught:
            use()
        assert "\n" not in str(caught.value)
    assert isinstance(store.fault(key), RecordMissing)
    assert isinstance(store.examine(key), RecordMissing)
    assert list(store.keys()) == []
    assert store.find() == []


def test_wrong_kind(store: Store) -> None:
    store.put(KEY, "morph", SAMPLES["morph"](), INPUTS)
    with pytest.raises(RecordMismatch, match="holds gudgeon-morph, expected gudgeon-modes"):
        store.get(KEY, "modes")


def test_a_field_that_no_record_has(store: Store) -> None:
    store.put(KEY, "mesh", mesh(), INPUTS)
    with pytest.raises(RecordMismatch, match="no field 'knots'; allowed: nodes"):
        store.get(KEY, "mesh", only=["knots"])


def test_damage_is_noticed_and_made_again(store: Store, location: str, behind: Behind) -> None:
    store.put(KEY, "modes", modes(), INPUTS)
    behind.damage()
    fresh = modaldb.open(location)
    assert isinstance(fresh.examine(KEY), RecordDamaged)
    assert [type(fault) for _, fault in fresh.verify()] == [RecordDamaged]
    fresh.put(KEY, "modes", modes(), INPUTS)
    assert [Path(one.place).name for one in fresh.leftovers()] == [f"{KEY}.damaged"]
    assert same(modaldb.open(location).get(KEY, "modes"), modes())


def test_set_aside(store: Store, location: str, behind: Behind, tmp_path: Path) -> None:
    store.put(KEY, "mesh", mesh(), INPUTS)
    (entry,) = store.find()
    behind.damage()
    fresh = modaldb.open(location)
    ((place, _),) = fresh.verify()
    assert fresh.set_aside(place) == f"{KEY}.damaged"
    assert isinstance(fresh.fault(KEY), RecordMissing)
    (left,) = fresh.leftovers()
    assert left.why == "damaged, set aside"
    assert left.size == entry.size
    fresh.remove(left.place)
    assert fresh.leftovers() == []
    with pytest.raises(RecordMissing):
        fresh.set_aside(place)
    with pytest.raises(RecordMissing):
        fresh.remove(str(tmp_path.parent))


def test_an_equal_key_is_kept(store: Store, behind: Behind) -> None:
    store.put(KEY, "mesh", mesh(), INPUTS)
    before = behind.identity()
    store.put(KEY, "mesh", mesh(), INPUTS)
    assert behind.identity() == before


def test_a_key_that_is_not_that_of_the_inputs_is_refused(store: Store) -> None:
    with pytest.raises(RecordMismatch, match="not that of its inputs"):
        store.put("1" * 64, "mesh", mesh(), INPUTS)


def test_threads_put_at_the_same_time(store: Store, location: str) -> None:
    count = 4 if location.startswith("hsds") else 40  # There, a put takes seconds.
    with ThreadPoolExecutor(4) as pool:
        keys = list(pool.map(lambda number: _put(store, number), range(count)))
    assert sorted(store.keys()) == sorted(keys)
    assert [fault for _, fault in store.verify() if fault is not None] == []
    assert len(store.find()) == count


def _put(store: Store, number: int) -> str:
    inputs = INPUTS | {"number": number}
    key = content_key(inputs)
    store.put(key, "modes", modes(), inputs)
    store.note(key, f"scene {number}", "skirt")
    return key


def test_export(store: Store, tmp_path: Path) -> None:
    store.put(KEY, "modes", modes(), INPUTS)
    store.export(KEY, tmp_path / "copy.h5")
    assert verify_record(tmp_path / "copy.h5") == "modes"  # By the digest of all bytes.
    assert same(read_record(tmp_path / "copy.h5", "modes"), modes())
    with pytest.raises(RecordMissing):
        store.export("0" * 64, tmp_path / "none.h5")


def filled(store: Store) -> dict[str, str]:
    """Put a mesh, modes of it, and another mesh, in this order; return their keys by name."""
    keys = {}
    rows = (
        ("mesh", "mesh", {"size": 0.002}),
        ("modes", "modes", {"material": {"E": 2.1e11, "name": "C45 \"ω\""}, "free": True}),
        ("other", "mesh", {"size": 0.005}),
    )  # fmt: skip
    for name, kind, inputs in rows:
        inputs = {"stage": kind, **inputs} | ({"mesh": keys["mesh"]} if kind == "modes" else {})
        keys[name] = content_key(inputs)
        store.put(keys[name], kind, SAMPLES[kind](), inputs)
        store.note(keys[name], "scene" if name != "other" else "folder/variant", "skirt")
    return keys


QUERIES = {
    "all": (Query(), ["other", "modes", "mesh"]),
    "newest": (Query(limit=1), ["other"]),
    "kind": (Query(kind="mesh"), ["other", "mesh"]),
    "scene": (Query(scene="scene"), ["modes", "mesh"]),
    "part of a scene": (Query(scene="older/vari"), ["other"]),
    "component": (Query(component="skirt", kind="modes"), ["modes"]),
    "nobody's component": (Query(component="liner"), []),
    "text": (Query(text='C45 "ω"'), ["modes"]),
    "text with signs": (Query(text="%"), []),
    "since": (Query(since=4e9), []),
    "until": (Query(until=4e9), ["other", "modes", "mesh"]),
    "less": (Query(where=(condition("size < 0.003"),)), ["mesh"]),
    "range": (Query(where=(condition("size>0.003"), condition("size<=0.005"))), ["other"]),
    "nested": (Query(where=(condition("material.E=2.1e11"),)), ["modes"]),
    "a text that is none": (Query(where=(condition("material.E=steel"),)), []),
    "not equal": (Query(where=(condition("stage!=mesh"),)), ["modes"]),
    "truth": (Query(where=(condition("free=true"),)), ["modes"]),
    "truth is no number": (Query(where=(condition("free=1"),)), []),
}


def test_queries(store: Store, location: str) -> None:
    keys = filled(store)
    for one in (store, modaldb.open(location)):
        for name, (query, expected) in QUERIES.items():
            assert [entry.key for entry in one.find(query)] == [keys[each] for each in expected], name
    (entry,) = store.find(Query(key=keys["modes"][:9]))
    assert (entry.kind, entry.uses, entry.refers, entry.referred) == (
        "modes", (("scene", "skirt"),), (keys["mesh"],), 0,
    )  # fmt: skip
    assert entry.inputs == store.provenance(keys["modes"])
    (entry,) = store.find(Query(key=keys["mesh"]))
    assert (entry.refers, entry.referred) == ((), 1)
    assert store.find(Query(key="*")) == []


def test_uses_are_noted_once(store: Store, behind: Behind) -> None:
    store.put(KEY, "mesh", mesh(), INPUTS)
    for scene in ("a", "b", "a"):
        for component in ("skirt", 'the "liner"'):
            store.note(KEY, scene, component)
    assert store.find()[0].uses == (("a", "skirt"), ("a", 'the "liner"'), ("b", "skirt"), ("b", 'the "liner"'))
    assert [one["key"] for one in behind.names()] == 4 * [KEY]


def test_tags(store: Store, location: str) -> None:
    keys = filled(store)
    store.tag("released", keys["mesh"])
    store.tag("best", keys["mesh"])
    store.tag("released", keys["other"])
    fresh = modaldb.open(location)
    assert [one.key for one in fresh.find(Query(tag="released"))] == [keys["other"]]
    assert fresh.find(Query(tag="best"))[0].tags == ("best",)
    fresh.tag("best", None)
    assert store.find(Query(tag="best")) == []
    with pytest.raises(RecordMissing, match="no tag 'best'"):
        store.tag("best", None)
    with pytest.raises(RecordMissing):
        store.tag("best", "0" * 64)
    for name in ("", "ab12", "a b", "-x", "../x", "x" * 65, "a\n"):
        with pytest.raises(QueryWrong, match="expected 1 to 64"):
            store.tag(name, keys["mesh"])


def test_commands_that_run(store: Store, location: str, tmp_path: Path) -> None:
    if location.startswith("hsds"):
        pytest.skip("HSDS keeps no progress")
    row = {"command": "study", "scene": "a", "stage": "study", "share": 0.5, "begun": 1.0, "host": "here"}
    store.tell("0" * 32, row)
    assert store.running() == []  # There is no database yet.
    store.put(KEY, "mesh", mesh(), INPUTS)
    store.tell("0" * 32, row)
    store.tell("1" * 32, row | {"begun": 2.0})
    store.tell("0" * 32, row | {"share": 0.75})
    store.tell("../" + "0" * 29, row)
    assert modaldb.open(location).running() == [row | {"share": 0.75}, row | {"begun": 2.0}]
    old = time.time() - 60
    os.utime(tmp_path / "db/running" / f"{'1' * 32}.json", (old, old))
    assert store.running() == [row | {"share": 0.75}]
    store.tell("0" * 32, None)
    assert store.running() == []
    assert list(store.keys()) == [KEY]


def test_unreferenced(store: Store) -> None:
    """What current or tagged records refer to stays."""
    keys = filled(store)
    assert {one.place for one in unreferenced(store, lambda inputs: False)} == set(keys.values())
    found = unreferenced(store, lambda inputs: inputs["stage"] == "modes")
    assert [one.place for one in found] == [keys["other"]]
    store.tag("kept", keys["other"])
    assert unreferenced(store, lambda inputs: inputs["stage"] == "modes") == []
    store.remove(keys["other"])
    assert sorted(store.keys()) == sorted((keys["mesh"], keys["modes"]))
    assert len(store.find()) == 2


@pytest.mark.parametrize("text", ["", "size", "size<", "size< ", "<3", "a.b.=3", "a b=3", 'a"b=3'])
def test_conditions_that_are_none(text: str) -> None:
    with pytest.raises(QueryWrong, match="given; expected"):
        condition(text)


@pytest.mark.parametrize("location", ["", "ftp://host/db", "nonsense://", "http://", "hsds://host:1"])
def test_places_where_no_database_can_be(location: str) -> None:
    with pytest.raises(StoreUnusable) as caught:
        modaldb.open(location)
    assert "\n" not in str(caught.value)
