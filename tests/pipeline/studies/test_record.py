"""A finished study is a record: its table for the page, and its runs in use as long as it is there."""

from pathlib import Path
from typing import Any

import pytest

from gudgeon import modaldb
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.stores.query import Query
from gudgeon.modaldb.stores.upkeep import unreferenced
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.gudgeon import run, study
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.studies import record
from gudgeon.pipeline.studies.study import Asked, run_study
from tests.modaldb.samples import mesh
from tests.pipeline.service.serving import served
from tests.pipeline.studies import cases
from tests.pipeline.studies.cases import VELOCITY, thread, write_rod


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database of a study of two designs that share mesh and modes, and of a third run beside it."""
    place = tmp_path_factory.mktemp("study")
    scene, places = write_rod(place), dict[str, Any](db=place / "db", out=place / "out")
    run(scene, set=[f"{VELOCITY}=3.0"], until="solve", **places)
    study(scene, {VELOCITY: [1.0, 2.0]}, executor=thread, **places)
    return place


def studies(folder: Path) -> list[Any]:
    return [one for one in modaldb.open(folder / "db").find(Query(kind="report")) if one.inputs["stage"] == "study"]


def test_its_table_and_its_runs(folder: Path) -> None:
    (found,) = studies(folder)
    document = modaldb.open(folder / "db").get(found.key, "report").document
    lines = (folder / "out/study.csv").read_text().splitlines()
    assert document["heads"] == lines[0].split(",")
    assert document["parameters"] == [VELOCITY]
    assert [row[1] for row in document["rows"]] == [1.0, 2.0]
    assert [row[-1] for row in document["rows"]] == found.inputs["runs"]
    assert set(found.inputs["runs"]) <= set(found.refers)
    assert found.uses == ((f"{folder.name}/rod", "study"),)


def test_the_same_study_is_the_same_record(folder: Path) -> None:
    (before,) = studies(folder)
    places = dict[str, Any](db=folder / "db", out=folder / "again")
    assert study(folder / "rod.toml", {VELOCITY: [1.0, 2.0]}, executor=thread, **places).key == before.key
    assert len(studies(folder)) == 1


def test_other_code_leaves_what_a_study_uses(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    store, (kept,) = modaldb.open(folder / "db"), studies(folder)
    entries = {one.key: one for one in store.find()}
    # As after a change of the code: no record is current.
    (other,) = unreferenced(store, lambda inputs: False)
    assert entries[other.place].kind == "trajectory"
    assert other.place not in kept.inputs["runs"]
    every = unreferenced(store, lambda inputs: False, studies=True)
    assert {one.place for one in every} == entries.keys()
    assert {one.why for one in every if one.place == kept.key} == {"a study without a tag"}
    store.tag("kept", kept.key)
    assert [one.place for one in unreferenced(store, lambda inputs: False, studies=True)] == [other.place]
    assert main(["db", "gc", "--studies", "--db", str(folder / "db"), "--out", str(folder / "out")]) == 0
    assert "0 files" in capsys.readouterr().out
    store.tag("kept", None)
    assert main(["db", "gc", "--studies", "--db", str(folder / "db"), "--out", str(folder / "out")]) == 0
    assert f"{kept.key}: " in capsys.readouterr().out


def test_a_run_of_other_code_stays_while_a_study_names_it(tmp_path: Path) -> None:
    store, old = modaldb.open(tmp_path / "db"), {"stage": "mesh", "code": "another"}
    store.put(key := content_key(old), "mesh", mesh(), old)
    assert [one.place for one in unreferenced(store, lambda inputs: False)] == [key]
    inputs = {"stage": "study", "runs": [key]}
    store.put(content_key(inputs), "report", record.ReportRecord({}), inputs)
    assert unreferenced(store, lambda inputs: False) == []


def test_a_study_without_some_designs_is_no_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(cases.MARKS, str(tmp_path))
    job = open_job(write_rod(tmp_path / "scene"), db=tmp_path / "db", out=tmp_path / "out")
    asked = Asked([f"{VELOCITY}=1,2"], executor=thread)
    report = run_study(job, asked, lambda stage, share: None, cases.raising)
    assert (report.counts["LOST"], report.key) == (1, None)
    monkeypatch.setattr(record, "MOST_DESIGNS", 1)
    assert run_study(job, asked, lambda stage, share: None, cases.answer).key is None
    assert studies(tmp_path) == []


def test_a_study_whose_database_is_a_server(tmp_path: Path) -> None:
    """Runs and the study itself are in the server's folder; a second study elsewhere finds them all there."""
    with served(tmp_path / "db") as url:
        scene = write_rod(tmp_path / "scene")
        first = study(scene, {VELOCITY: [1.0, 2.0]}, db=url, out=tmp_path / "out", executor=thread)
        again = study(scene, {VELOCITY: [1.0, 2.0]}, db=url, out=tmp_path / "out2", executor=thread)
    assert (first.fresh, again.fresh, again.key) == (0, 2, first.key)
    (found,) = studies(tmp_path)
    assert found.key == first.key
    assert all(modaldb.open(tmp_path / "db").has(key) for key in found.inputs["runs"])
    assert (tmp_path / "out/study.csv").read_bytes() == (tmp_path / "out2/study.csv").read_bytes()
