"""Damaged records: one run makes them all again, and only a run touches them."""

import json
from pathlib import Path

import pytest

from gudgeon import modaldb
from gudgeon.modaldb.errors import RecordMissing
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.stores.folder import FolderStore
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.gudgeon import run
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.status import status
from tests.pipeline.small import write_scene

BESIDE = {"index.sqlite", "names.jsonl"}
"""Files of a database that are no records."""
STAGES = ("mesh", "modes", "morph", "solve")


@pytest.fixture
def made(tmp_path: Path) -> Path:
    """A folder with a scene and its finished run, up to the trajectory."""
    scene = write_scene(tmp_path / "scene")
    run(scene, db=tmp_path / "db", out=tmp_path / "out", until="solve")
    return tmp_path


def records(store: FolderStore) -> list[Path]:
    return [store.path(key) for key in [*store.keys()]]


def damage(path: Path) -> None:
    whole = bytearray(path.read_bytes())
    whole[len(whole) // 2] ^= 1
    path.write_bytes(whole)


def test_one_run_makes_all_damaged_records_again(
    made: Path, capsys: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    store = modaldb.open(made / "db")
    paths = records(store)
    before = [path.read_bytes() for path in paths]
    assert len(paths) == len(STAGES)
    for path in paths:
        damage(path)
    command = [str(made / "scene"), "--db", str(made / "db"), "--out", str(made / "out"), "--json"]
    assert main(["solve", *command]) == 0
    stages = json.loads(capsys.readouterr().out)["stages"]
    assert [stage["state"] for stage in stages.values()] == ["ran"] * 4
    told = [line for line in caplog.messages if "renamed to" in line]
    assert len(told) == 4
    assert all("checksum differs" in line for line in told)
    # Counts hold seconds, but the mesh and what follows from it are the same to the last byte.
    assert sum(one == path.read_bytes() for one, path in zip(before, paths, strict=True)) >= 1
    assert all(modaldb.open(store.root).has(path.stem) for path in paths)


def test_swapped_records_are_made_again(made: Path) -> None:
    """Two meshes that have each other's names are both sound."""
    scene, places = made / "scene", {"db": made / "db", "out": made / "out"}
    job = open_job(scene, **places)
    other = open_job(scene, set={"component.skirt.mesh.size": 0.016}, **places)
    run(scene, set={"component.skirt.mesh.size": 0.016}, until="mesh", **places)
    keys = [one.products(["mesh"])["skirt.base-mesh"].key for one in (job, other)]
    first, second = (job.store.path(key) for key in keys)
    kept = first.read_bytes(), second.read_bytes()
    first.write_bytes(kept[1])
    second.write_bytes(kept[0])
    report = run(scene, until="mesh", **places)
    assert report.stages["mesh"].state == "ran"
    nodes = modaldb.open(made / "db").get(keys[0], "mesh").nodes
    first.write_bytes(kept[0])
    assert nodes.shape == modaldb.open(made / "db").get(keys[0], "mesh").nodes.shape


def test_status_only_reports(made: Path) -> None:
    paths = records(modaldb.open(made / "db"))
    for path in paths:
        damage(path)
    for _ in range(2):
        rows = status(open_job(made / "scene", db=made / "db", out=made / "out"))
        assert [state for _, state, _, _ in rows] == ["stale"] * 5
        assert all("checksum differs" in why[0] for _, _, _, why in rows[:-1])
        assert all(path.is_file() for path in paths)


def test_verify_and_repair(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    store = modaldb.open(made / "db")
    bad, swapped = records(store)[:2]
    damage(bad)
    (swapped.with_name(f"{'0' * 64}.h5")).write_bytes(swapped.read_bytes())
    command = ["db", "verify", "--db", str(made / "db")]
    assert main(command) == 1
    text = capsys.readouterr().out
    assert f"{bad}: checksum differs" in text
    assert "5 records, 2 cannot be used" in text
    assert bad.is_file()
    assert main([*command, "--repair", "--json"]) == 0
    faults = json.loads(capsys.readouterr().out)["faults"]
    assert {fault["file"] for fault in faults} == {str(bad), str(swapped.with_name(f"{'0' * 64}.h5"))}
    assert not bad.exists()
    assert bad.with_suffix(".damaged").is_file()
    assert main(command) == 0
    assert isinstance(modaldb.open(store.root).fault(bad.stem), RecordMissing)


def test_gc_lists_and_removes(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    store = modaldb.open(made / "db")
    current = set(store.keys())
    key = next(key for key in current if store.provenance(key)["stage"] == "mesh")
    old = store.provenance(key) | {"code": "another"}
    old_key = content_key(old)
    store.put(old_key, "mesh", store.get(key, "mesh"), old)
    folder = store.path(key).parent
    (folder / ".writing-1").write_bytes(b"half of a record")
    (folder / f"{'1' * 64}.damaged").write_bytes(b"")
    command = ["db", "gc", "--db", str(made / "db"), "--out", str(made / "out")]
    assert main(command) == 0
    text = capsys.readouterr().out
    assert "3 files of" in text
    assert "removed with --delete" in text
    assert store.path(old_key).is_file()
    assert main([*command, "--delete"]) == 0
    assert set(modaldb.open(store.root).keys()) == current
    assert {path.name for path in store.root.rglob("*") if path.is_file() and path.suffix != ".h5"} == BESIDE


def test_gc_keeps_what_current_records_refer_to(made: Path, capsys: pytest.CaptureFixture[str],
                                                monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    """A mesh of older code that the modes of this code were made of."""
    from gudgeon.pipeline.stages.keys import products

    digests = products.code_digests() | {"mesh": "changed"}
    monkeypatch.setattr(products, "code_digests", lambda: digests)
    assert main(["db", "gc", "--db", str(made / "db"), "--json", "--out", str(made / "out")]) == 0
    assert json.loads(capsys.readouterr().out)["files"] == []
    digests |= dict.fromkeys(("modes", "morph", "solve"), "changed")
    assert main(["db", "gc", "--db", str(made / "db"), "--json", "--out", str(made / "out")]) == 0
    assert len(json.loads(capsys.readouterr().out)["files"]) == 4
