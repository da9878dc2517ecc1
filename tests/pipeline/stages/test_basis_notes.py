"""Notes on the error of the modal basis name the keys that reduce it; sweeps run without the estimates."""

from pathlib import Path
from typing import Any

import pytest

from docs.tools.basis_solids import RECTANGLE
from gudgeon.modaldb.records.trajectory import ONE_COORDINATE
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.pipeline.stages.notes import estimates as notes_of
from gudgeon.solver.scene.run import Run
from tests.pipeline.facts import of_run
from tests.scenes import scene_path

SEVERAL = {"basis.impulse": 0.03, "basis.force": 0.2, "step.force": 0.5}
UNKNOWN = {"basis.impulse": 1.0, "basis.force": 1.0}


def notes(scene: str, estimates: dict[str, float], **changes: Any) -> list[str]:
    job = open_job(scene_path(scene), set={key.replace("__", "."): value for key, value in changes.items()})
    return [*notes_of.basis(of_run(job.scene, estimates, window=4e-6))]


def test_small_errors_and_those_of_the_step_give_none() -> None:
    assert not notes("rod-wall", {"basis.impulse": 0.009, "step.force": 0.5})


@pytest.mark.parametrize(
    ("scene", "changes", "estimates", "keys"),
    [
        ("rod-wall", {}, SEVERAL, ["component.rod.modes.normal_count = 200"]),
        ("rod-wall", {}, {"basis.force": 0.2}, ["contact.wall.dashpot = 'wave-guide'"]),
        ("rod-wall", {"contact__wall__method": "constraint"}, {"basis.force": 0.2}, ["with method 'residual'"]),
        ("rod-wall", {"contact__wall__dashpot": "wave-guide"}, {"basis.force": 0.2}, ["run.window = 1e-05"]),
        ("rod-wall", {"contact__wall__dashpot": "wave-guide"}, SEVERAL, ["normal_count = 200"]),
        ("skirt", {"contact__bore__method": "penalty"}, SEVERAL, ["contact.bore.method = 'residual'"]),
        ("bars-longitudinal", {}, SEVERAL, ["component.bar.modes.fixed_count = 120"]),
        ("beam-sphere", {"contact__pair__method": "penalty"}, SEVERAL, ["contact.pair.method = 'residual'"]),
    ],
)
def test_a_note_names_the_key(
    scene: str, changes: dict[str, Any], estimates: dict[str, float], keys: list[str]
) -> None:
    (note,) = notes(scene, estimates, **changes)
    assert all(key in note for key in keys)
    assert "50.0%" not in note
    assert all(f"{error:.1%}" in note for name, error in estimates.items() if name.startswith("basis"))


def test_a_force_alone_gets_more_modes_or_a_wider_window() -> None:
    """Where impulse and rebound are accurate, the force over one period converges slowly at rigid contact."""
    (note,) = notes("skirt", {"basis.force": 0.2, "basis.impulse": 0.009, "basis.rebound": 0.001})
    assert note.endswith("component.skirt.modes.normal_count = 240 or run.window = 1e-05")
    assert "run.window" not in notes("skirt", {"basis.force": 0.2, "basis.impulse": 0.011})[0]
    assert "run.window" not in notes("skirt", {"basis.force": 0.2}, run__duration=9e-6)[0]


def test_a_note_says_why_the_error_is_unknown() -> None:
    job = open_job(scene_path("rod-wall"))
    (note,) = notes_of.basis(of_run(job.scene, UNKNOWN, "contact.wall: no start"))
    assert "unknown" in note
    assert "contact.wall: no start" in note
    assert "component.rod.modes.normal_count = 200" in note


def test_a_note_says_that_one_coordinate_is_kept() -> None:
    job = open_job(scene_path("rod-wall"), set={"component.rod.modes.normal_count": 1})
    assert [*notes_of.basis(of_run(job.scene, UNKNOWN, ONE_COORDINATE))] == [
        "the error of the modal basis is unknown: one elastic coordinate is kept; set"
        " component.rod.modes.normal_count = 2"
    ]


def test_a_run_with_few_modes_gives_the_note_and_with_many_modes_not(tmp_path: Path) -> None:
    said = {}
    for count in (3, 100):
        changes = {"component.rod.modes.normal_count": count, "contact.wall.dashpot": "wave-guide"}
        report = run(scene_path("rod-wall"), set=changes, db=tmp_path / "db", out=tmp_path / "out", until="solve")
        said[count] = [note for note in report.notes if "modal basis" in note and "impulse" in note]
        assert report.estimates["basis.impulse"] > 0
    assert len(said[3]) == 1
    assert not said[100]


@pytest.mark.parametrize(("size", "count"), [(0.1, 30), (0.01, 60), (0.001, 180), ("unset", 180)])
def test_a_bar_has_as_many_modes_as_its_mesh_resolves(size: float | str, count: int) -> None:
    job = open_job(
        scene_path("rod-wall"), set={"component.rod.modes.normal_count": "unset", "component.rod.mesh.size": size}
    )
    assert job.scene.component["rod"].modes.normal_count == count


@pytest.mark.parametrize(("reduction", "count"), [("craig-bampton", 30), ("ritz", 30), ("rubin", 180)])
def test_other_reductions_keep_their_default(reduction: str, count: int) -> None:
    modes = {"component.rod.modes.normal_count": "unset", "component.rod.modes.reduction": reduction}
    job = open_job(scene_path("rod-wall"), set=modes | {"component.rod.mesh.size": 0.001})
    assert job.scene.component["rod"].modes.normal_count == count


def test_robustness_cases_run_without_checks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of a report are tested with its steps."""
    from gudgeon.pipeline.robustness import run as robustness

    seen: list[Run] = []

    class Stop(Exception):
        pass

    def look(job: Any, *rest: Any) -> None:
        seen.append(job.scene.run)
        raise Stop

    monkeypatch.setattr(robustness, "run_job", look)
    job = open_job(scene_path("rod-wall"), db=tmp_path / "db", out=tmp_path / "out")
    assert job.scene.run.checks
    with pytest.raises(Stop):
        robustness.robustness(job, None, (), lambda *_: None)
    assert not seen[0].checks


@pytest.mark.parametrize(("error", "beyond"), [(0.02, False), (0.22, True)])
def test_a_step_far_too_large_for_its_estimate_says_so(error: float, beyond: bool, tmp_path: Path) -> None:
    """Runs with one and two steps that miss an impact alike differ by less than they are wrong."""
    job = open_job(scene_path("rod-wall"), db=tmp_path / "db", out=tmp_path / "out", set={"run.step": 1e-6})
    (note,) = notes_of.step(of_run(job.scene, {"step.impulse": error}))
    assert note.startswith(f"run.step: 1e-06 s given; its estimated error is {error:.1%} in impulse")
    assert ("too large for the estimate" in note) == beyond


def test_a_plate_that_strikes_with_its_whole_face_has_its_error_stated(tmp_path: Path) -> None:
    """From 15 to 60 modes its error does not decrease, and all bases lack the same waves."""
    (tmp_path / "scene.toml").write_text(RECTANGLE)
    found = {}
    for count in (60, 240):
        changes = {"component.part.modes.normal_count": count, "component.part.mesh.size": 0.005}
        found[count] = run(tmp_path, set=changes, db=tmp_path / "db", out=tmp_path / "out", until="solve")
    impulse = {count: one.quantities["floor.impulse"]["value"] for count, one in found.items()}
    error = abs(impulse[60] / impulse[240] - 1)
    assert error > 0.04
    assert error < found[60].estimates["basis.impulse"] < 2 * error
    assert any("modal basis" in note and "impulse" in note for note in found[60].notes)
