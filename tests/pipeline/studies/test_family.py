"""Families: which designs are stored for a range, what a design between them then costs, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import DESIGN
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.pipeline.studies.family import FamilyReport, _candidates, _ranges, family
from tests.pipeline.small import write_scene

CHANGE = "component.skirt.change"
RANGE = f"{CHANGE}.profile.offset=-0.6e-3:0.6e-3"
"""A tenth of the wall of 6 mm."""
TOLERANCE = 1e-3


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_scene(tmp_path_factory.mktemp("family") / "scene")


@pytest.fixture(scope="module")
def found(place: Path) -> FamilyReport:
    return family(place, [RANGE], tolerance=TOLERANCE, db=place / "db", out=place / "out")


def test_the_ends_are_stored_after_the_middle(found: FamilyReport) -> None:
    offsets = [design["offset"] for design in found.designs]
    assert offsets[0] == 0
    assert {abs(offset) for offset in offsets[1:3]} == {0.6e-3}
    assert found.errors == sorted(found.errors, reverse=True)
    assert found.errors[-1] <= TOLERANCE < found.errors[-2]
    assert 'update = "certified"' in found.as_text()


def test_a_design_in_the_range_takes_the_stored_ones(place: Path, found: FamilyReport) -> None:
    settings = {
        f"{CHANGE}.update": "certified", f"{CHANGE}.tolerance": TOLERANCE, f"{CHANGE}.designs": found.designs,
        f"{CHANGE}.profile.offset": 0.35e-3,
    }  # fmt: skip
    job = open_job(place, set=settings, db=place / "db")
    missing = [step for step, made in job.components()["skirt"].items()
               if made.stage == "modes" and not job.store.has(made.key)]  # fmt: skip
    assert missing == ["modes"]
    run(place, set=settings, db=place / "db", out=place / "out", until="modes")
    modal = job.record("skirt")
    assert modal.quality[DESIGN]["way"] == "project"
    assert modal.quality[DESIGN]["designs"] == found.modes
    exact = {f"{CHANGE}.update": "recompute", f"{CHANGE}.profile.offset": 0.35e-3}
    run(place, set=exact, db=place / "db", out=place / "out", until="modes")
    truth = open_job(place, set=exact, db=place / "db").record("skirt")
    assert np.abs(modal.frequencies / truth.frequencies - 1).max() < TOLERANCE


def test_the_record_names_its_parents(place: Path, found: FamilyReport) -> None:
    store = open_job(place, db=place / "db").store
    assert store.get(found.key, "report").document["designs"] == found.designs
    assert set(found.modes) <= {*next(entry for entry in store.find() if entry.key == found.key).refers}


@pytest.mark.parametrize(
    ("vary", "message"),
    [
        (["component.skirt.geometry.height=0.03:0.04"], r"change\.profile\.offset=LOW:HIGH"),
        (["component.skirt.change.profile.offset=1e-4,2e-4"], r"change\.profile\.offset=LOW:HIGH"),
        (["component.none.change.profile.offset=0:1e-4"], "no component 'none'"),
        (["component.skirt.change.profile.scale=0:2"], "has no table that it scales"),
        (["component.skirt.change.profile.offset=-0.1:0.1"], r"inverts \d+ elements.*allowed: up to"),
    ],
)
def test_bad_input(place: Path, vary: list[str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        family(place, vary, db=place / "db", out=place / "none")


def test_two_parameters_have_candidates_at_their_corners(place: Path) -> None:
    job = open_job(place, set={f"{CHANGE}.profile.table": "barrel.csv"}, db=place / "db")
    vary = [f"{CHANGE}.profile.offset=-1e-4:1e-4", f"{CHANGE}.profile.scale=0:2"]
    name, parameters = _ranges(job, vary)
    candidates = _candidates(job, name, parameters)
    assert len(candidates) == 15
    assert candidates[7] == {"surface": "skirt", "table": "barrel.csv", "offset": 0.0, "scale": 1.0}
    ends = {(profile["offset"], profile["scale"]) for profile in candidates}
    assert {(-1e-4, 0.0), (-1e-4, 2.0), (1e-4, 0.0), (1e-4, 2.0)} <= ends


def test_a_range_that_five_designs_do_not_meet_is_refused(
    place: Path, found: FamilyReport, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["family", str(place), "--vary", RANGE, "--tolerance", "1e-9", "--db", str(place / "db")]
    assert main([*command, "--out", str(place / "none")]) == 2
    line = capsys.readouterr().err.strip().splitlines()[-1]
    assert "family: 5 stored designs leave an estimated error of " in line
    assert line.endswith("give a narrower range or a larger tolerance")
    store = open_job(place, db=place / "db").store
    assert [e.key for e in store.find() if e.inputs and e.inputs.get("stage") == "family"] == [found.key]
