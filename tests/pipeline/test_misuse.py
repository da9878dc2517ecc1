"""Functions of a notebook that are given what they cannot use: an error of this product, in one line."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gudgeon
from gudgeon.modaldb.errors import RecordMismatch, RecordMissing
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.stages.run_report import RunReport
from gudgeon.solver.errors import SceneError
from tests.fuzz.out_folders import SCENE

DEEP = r"set: run\.duration: the value has too many digits or levels; allowed: 40 levels"
TEXTS = r"set: .* given; allowed: texts path\.to\.key=value, or a mapping of such paths"
HUGE = 10**5000


class Place:
    """A scene that has run, and the arguments of its functions."""

    def __init__(self, folder: Path) -> None:
        self.scene, self.db, self.out = folder / "ball", folder / "db", folder / "out"
        self.scene.mkdir()
        (self.scene / "scene.toml").write_text(SCENE)
        self.report: RunReport = gudgeon.run(self.scene, db=self.db, out=self.out, until="solve")

    def run(self, given: Any) -> RunReport:
        return gudgeon.run(self.scene, set=given, db=self.db, out=self.out, until="solve")


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Place:
    return Place(tmp_path_factory.mktemp("misuse"))


def within_itself(kind: type) -> Any:
    found: Any = kind()
    found.append(found) if kind is list else found.update(again=found)
    return found


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"run.duration": HUGE}, DEEP),
        ({"run.duration": [-HUGE]}, DEEP),
        ({"run.duration": np.array([HUGE], dtype=object)}, DEEP),
        ({"run.duration": within_itself(dict)}, DEEP),
        ({"run.duration": within_itself(list)}, DEEP),
        ({"run.duration": [None, HUGE]}, r"set: run\.duration: .* given, a list; allowed: numbers, texts"),
        (5, TEXTS),
        (None, TEXTS),
        ([None], TEXTS),
        (b"run.duration=1", TEXTS),
        (f"run.duration=[0x{'f' * 5000}]", r"run\.duration: whole numbers of more digits than are read given"),
    ],
)  # fmt: skip
def test_overrides_that_no_scene_can_have(given: Any, expected: str, place: Place) -> None:
    with pytest.raises(InputError, match=expected) as caught:
        place.run(given)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize("out", ["\0", "x" * 5000, "\ud800"])
def test_a_folder_of_results_that_cannot_be(out: str, place: Place) -> None:
    with pytest.raises(InputError, match=r"--out .*: no folder can be here"):
        gudgeon.run(place.scene, db=place.db, out=out, until="solve")


def test_options_of_a_report_out_of_range(place: Place) -> None:
    with pytest.raises(InputError, match=r"report: repeat: 0 given; allowed: 1 or more"):
        gudgeon.report(place.scene, db=place.db, out=place.out, repeat=0)
    for tolerance in (-1.0, 0.0, 1.0, float("nan")):
        with pytest.raises(InputError, match=r"report: tolerance: .* given; allowed: between 0 and 1"):
            gudgeon.report(place.scene, db=place.db, out=place.out, tolerance=tolerance)


@pytest.mark.parametrize(("morphs", "have"), [({}, "none"), ({"other": "x"}, "other")])
def test_a_system_whose_components_have_no_keys(morphs: dict[str, str], have: str, place: Place) -> None:
    job = gudgeon.open_job(place.scene, db=place.db)
    with pytest.raises(SceneError, match=rf"morphs: no key for component 'ball'; keys are given for: {have}"):
        gudgeon.compile_system(job.store, job.scene, morphs)


@pytest.mark.parametrize("only", ["nope", "", "mass/nope", "interfaces/foot/nope", "interfaces/foot/rows/nope"])
def test_fields_that_no_such_record_has(only: str, place: Place) -> None:
    store, key = gudgeon.open(place.db), place.report.stages["modes"].keys["ball"]
    with pytest.raises(RecordMismatch, match=f"no field '{only}'"):
        store.get(key, "modes", only=["angular_frequencies", only])


def test_fields_that_a_record_may_have_are_no_mistake(place: Place) -> None:
    """Optional fields, and members of any name of a group."""
    store, key = gudgeon.open(place.db), place.report.stages["modes"].keys["ball"]
    found = store.get(key, "modes", only=["static_responses", "gauges/none/unit", "interfaces/foot"])
    assert found.static_responses is None
    assert found.gauges == {}
    assert [*found.interfaces] == ["foot"]


@pytest.mark.parametrize("key", ["", "x", "\0", "../../etc/passwd", "é" * 64, "A" * 64])
def test_what_is_no_key_is_missing(key: str, place: Place) -> None:
    store = gudgeon.open(place.db)
    assert not store.has(key)
    with pytest.raises(RecordMissing, match="is no key, 64 hexadecimal digits"):
        store.get(key, "modes")
