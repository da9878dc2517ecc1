"""Every store keeps the contract of `Store`: whole records or none, the same answers wherever they are."""

import json
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

import pytest

from gudgeon import modaldb
from gudgeon.modaldb.errors import RecordDamaged, RecordMismatch, RecordMissing, StoreUnusable
from gudgeon.modaldb.hdf5 import verify_record
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.records import KINDS
from gudgeon.modaldb.stores.base import Store
from gudgeon.modaldb.stores.names import NAMES
from gudgeon.modaldb.stores.query import Query, QueryWrong, condition
from gudgeon.modaldb.stores.upkeep import unreferenced
from tests.modaldb.samples import INPUTS, SAMPLES, WITHOUT_ARRAYS, mesh, modes, same
from tests.pipeline.service.serving import served

KEY = content_key(INPUTS)

PLACES: dict[str, Callable[[Path], AbstractContextManager[str]]] = {
    "folder": lambda root: nullcontext(str(root)),
    "HTTP": served,
}
"""Where a store is: gives the location of a store whose records stand in a folder."""


@pytest.fixture(params=PLACES)
def location(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    with PLACES[request.param](tmp_path / "db") as place:
        yield place


@pytest.fixture
def store(location: str) -> Store:
    return modaldb.open(location)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Where the record of KEY stands in the folder behind a store."""
    return tmp_path / "db" / KEY[:2] / f"{KEY}.h5"


@pytest.mark.parametrize("kind", KINDS)
def test_round_trip(kind: str, store: Store, location: str, file: Path) -> None:
    assert not store.has(KEY)
    store.put(KEY, kind, SAMPLES[kind](), INPUTS)
    verify_record(file)
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


def test_damage_is_noticed_and_made_again(store: Store, location: str, file: Path) -> None:
    store.put(KEY, "modes", modes(), INPUTS)
    whole = bytearray(file.read_bytes())
    whole[len(whole) // 2] ^= 1
    file.write_bytes(whole)
    fresh = modaldb.open(location)
    assert isinstance(fresh.examine(KEY), RecordDamaged)
    assert [type(fault) for _, fault in fresh.verify()] == [RecordDamaged]
    fresh.put(KEY, "modes", modes(), INPUTS)
    assert file.with_suffix(".damaged").is_file()
    assert same(modaldb.open(location).get(KEY, "modes"), modes())


def test_set_aside(store: Store, location: str, file: Path) -> None:
    store.put(KEY, "mesh", mesh(), INPUTS)
    file.write_bytes(file.read_bytes()[:-1])
    fresh = modaldb.open(location)
    ((place, _),) = fresh.verify()
    assert fresh.set_aside(place) == f"{KEY}.damaged"
    assert isinstance(fresh.fault(KEY), RecordMissing)
    (left,) = fresh.leftovers()
    assert left.why == "damaged, set aside"
    assert left.size == file.with_suffix(".damaged").stat().st_size
    fresh.remove(left.place)
    assert fresh.leftovers() == []
    with pytest.raises(RecordMissing):
        fresh.set_aside(place)
    with pytest.raises(RecordMissing):
        fresh.remove(str(file.parents[2]))


def test_an_equal_key_is_kept(store: Store, file: Path) -> None:
    store.put(KEY, "mesh", mesh(), INPUTS)
    before = file.stat()
    store.put(KEY, "mesh", mesh(), INPUTS)
    assert (file.stat().st_ino, file.stat().st_mtime_ns) == (before.st_ino, before.st_mtime_ns)


def test_a_key_that_is_not_that_of_the_inputs_is_refused(store: Store) -> None:
    with pytest.raises(RecordMismatch, match="not that of its inputs"):
        store.put("1" * 64, "mesh", mesh(), INPUTS)


def test_threads_put_at_the_same_time(store: Store) -> None:
    with ThreadPoolExecutor(4) as pool:
        keys = list(pool.map(lambda number: _put(store, number), range(40)))
    assert sorted(store.keys()) == sorted(keys)
    assert [fault for _, fault in store.verify() if fault is not None] == []
    assert len(store.find()) == 40


def _put(store: Store, number: int) -> str:
    inputs = INPUTS | {"number": number}
    key = content_key(inputs)
    store.put(key, "modes", modes(), inputs)
    store.note(key, f"scene {number}", "skirt")
    return key


def test_export(store: Store, file: Path, tmp_path: Path) -> None:
    store.put(KEY, "modes", modes(), INPUTS)
    store.export(KEY, tmp_path / "copy.h5")
    assert (tmp_path / "copy.h5").read_bytes() == file.read_bytes()
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


def test_uses_are_noted_once(store: Store, tmp_path: Path) -> None:
    store.put(KEY, "mesh", mesh(), INPUTS)
    for scene in ("a", "b", "a"):
        for component in ("skirt", 'the "liner"'):
            store.note(KEY, scene, component)
    assert store.find()[0].uses == (("a", "skirt"), ("a", 'the "liner"'), ("b", "skirt"), ("b", 'the "liner"'))
    lines = (tmp_path / "db" / NAMES).read_text().splitlines()
    assert len(lines) == 4
    assert {json.loads(line)["key"] for line in lines} == {KEY}


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


@pytest.mark.parametrize("location", ["", "ftp://host/db", "nonsense://", "http://"])
def test_places_where_no_database_can_be(location: str) -> None:
    with pytest.raises(StoreUnusable) as caught:
        modaldb.open(location)
    assert "\n" not in str(caught.value)
