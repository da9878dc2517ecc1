"""Servers and the folders below them: two at one folder, one that dies at the worst moment, one that cannot write."""

import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

pytest.importorskip("fastapi", reason="the extra 'service' is not installed")

from gudgeon import modaldb
from gudgeon.modaldb.errors import StoreUnusable
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.stores.query import Query
from tests.modaldb.samples import INPUTS, mesh, same
from tests.pipeline.service.serving import TOKEN, served

KEY = content_key(INPUTS)
DIES = """
import os, sys
rename = os.replace
def last(source, target, **more):
    os._exit(9) if str(target).endswith(".h5") else rename(source, target, **more)
os.replace = last
from gudgeon.pipeline.cli import main
main(["serve", "--db", sys.argv[1], "--port", "0"])
"""
"""A server that ends when a record is verified and not yet renamed."""


def test_a_server_that_dies_between_verifying_and_renaming(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GUDGEON_TOKEN", TOKEN)
    monkeypatch.setenv("GUDGEON_DB_WAIT", "0.5")
    monkeypatch.setenv("GUDGEON_CACHE", str(tmp_path / "cache"))
    command = [sys.executable, "-c", DIES, str(tmp_path / "db")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=dict(os.environ)) as child:
        assert child.stdout is not None
        with pytest.raises(StoreUnusable, match="no answer in"):
            modaldb.open(child.stdout.readline().split()[-1]).put(KEY, "mesh", mesh(), INPUTS)
        assert child.wait() == 9
    (left,) = (tmp_path / "db").glob("??/*")
    assert left.suffix != ".h5"
    with served(tmp_path / "db") as url:
        store = modaldb.open(url)
        assert not store.has(KEY)
        assert [one.why for one in store.leftovers()] == ["left by a writer that was killed"]
        store.put(KEY, "mesh", mesh(), INPUTS)
        assert same(store.get(KEY, "mesh"), mesh())
        assert store.leftovers() == []


def test_two_servers_and_a_folder_of_the_same_records(tmp_path: Path) -> None:
    """Each sees what the others put, tag and note; nothing is written twice or lost."""
    count, wrong = 12, []
    with served(tmp_path / "db") as first, served(tmp_path / "db") as second:
        places = (first, second, str(tmp_path / "db"))

        def write(place: str, name: str) -> None:
            store = modaldb.open(place)
            try:
                for number in range(count):
                    inputs = INPUTS | {"n": number}
                    store.put(content_key(inputs), "mesh", mesh(), inputs)
                    store.tag(f"tag-{name}-{number}", content_key(inputs))
                    store.note(content_key(inputs), name, "part")
            except Exception as error:
                wrong.append(error)

        threads = [threading.Thread(target=write, args=(place, f"by{n}")) for n, place in enumerate(places)]
        for one in threads:
            one.start()
        for one in threads:
            one.join()
        assert wrong == []
        for place in places:
            store = modaldb.open(place)
            found = store.find()
            assert (len(found), sum(len(one.tags) for one in found), sum(len(one.uses) for one in found)) == (
                count, 3 * count, 3 * count
            )  # fmt: skip
            assert [fault for _, fault in store.verify() if fault is not None] == []
            assert len(store.find(Query(tag="tag-by2-3"))) == 1


def test_a_folder_that_cannot_be_written_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def read_only(*arguments: object) -> None:
        raise OSError(30, "Read-only file system")

    with served(tmp_path / "db") as url:
        store = modaldb.open(url)
        store.put(KEY, "mesh", mesh(), INPUTS)
        monkeypatch.setattr("gudgeon.modaldb.stores.local.scratch.remove", read_only)
        with pytest.raises(StoreUnusable, match=r"cannot be renamed or removed \(Read-only file system\)"):
            store.remove(KEY)
        assert store.has(KEY)
