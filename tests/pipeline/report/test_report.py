"""`gudgeon report`: a sweep against its reference, errors split; nothing that is done is done again."""

import csv
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.nodal.scene import runs as nodal_runs
from gudgeon.pipeline.report import timing as runs
from gudgeon.pipeline.report.bodies import report_job
from gudgeon.pipeline.report.changes import change_rows
from gudgeon.pipeline.report.choice import keep_report, kept_reports, newest_report
from gudgeon.pipeline.report.document import Document, Run
from gudgeon.pipeline.report.effort import Effort
from gudgeon.pipeline.report.force import GRID, ForceReference, pulse_reference, smooth
from gudgeon.pipeline.report.page.output import report_text, write_report
from gudgeon.pipeline.stages.job import Job
from tests.pipeline import documents
from tests.pipeline.small import write_scene

REPORT = """
[report]
full_fe = { steps = [8e-6, 4e-6] }

[report.models]
"residual" = {}
"penalty" = { component.skirt.modes.static_count = 0, contact.bore.method = "penalty" }

[report.sweep]
"component.*.modes.normal_count" = [4, 8, 12]

[report.changes]
"barrel" = { component.skirt.change.profile.table = "barrel.csv" }
"""
ONCE = Effort(repeat=1)
Tell = Callable[[str, float], None]


def silent(stage: str, share: float) -> None:
    """Hear of progress and say nothing."""


def reported(folder: Path, text: str = REPORT, how: Effort = ONCE) -> tuple[Job, Document]:
    """Return the small skirt's job and report."""
    scene = write_scene(folder / "scene") / "scene.toml"
    scene.write_text(scene.read_text() + text)
    job = open_job(scene, db=folder / "db", out=folder / "out")
    return job, report_job(job, how, silent)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Job, Document]:
    folder = tmp_path_factory.mktemp("report")
    return (folder, *reported(folder))


def by_name(document: Document) -> dict[str, Run]:
    return {run.name: run for run in document.runs}


def test_runs(made: tuple[Path, Job, Document]) -> None:
    found = by_name(made[2])
    assert list(found) == [
        "full FE, 8 µs", "full FE, 4 µs",
        "residual, 4 modes", "residual, 8 modes", "residual, 12 modes",
        "penalty, 4 modes", "penalty, 8 modes", "penalty, 12 modes",
    ]  # fmt: skip
    assert found["full FE, 4 µs"].errors == {}
    assert found["full FE, 4 µs"].time_against == "it is the reference"
    assert abs(found["residual, 12 modes"].errors["impulse"]) < 0.05
    assert found["residual, 12 modes"].errors["force"] < 0.5 * found["penalty, 12 modes"].errors["force"]
    assert [run.coordinates for run in made[2].runs[2:]] == [14, 18, 22, 10, 14, 18]
    for run in made[2].runs:
        assert run.result == "FINISHED"
        assert run.energy_drift is not None
        assert run.energy_drift < 1e-2
        assert run.cpu_seconds > 0


def test_runs_have_the_name_of_their_scene(made: tuple[Path, Job, Document]) -> None:
    """In the list of a database, where runs of a report are many."""
    records = [entry for entry in made[1].store.find() if entry.kind in ("trajectory", "nodal", "modes")]
    assert len(records) > 6
    assert [entry.key for entry in records if not entry.uses] == []


def test_errors_are_split(made: tuple[Path, Job, Document]) -> None:
    """Truncation is measured against the largest basis of the same scheme, time error against the finest step."""
    found = by_name(made[2])
    few, most = found["residual, 4 modes"], found["residual, 12 modes"]
    assert few.truncation_against == "residual, 12 modes"
    assert most.truncation is None
    assert most.truncation_against.startswith("no larger basis")
    assert few.time_against == "residual, 4 modes, step / 4"
    assert few.truncation is not None
    assert few.time is not None
    assert most.time is not None
    # What the basis lacks is most of its error, and the parts make up the whole.
    assert few.truncation["force"] > 10 * few.time["force"]
    assert few.errors["force"] <= few.truncation["force"] + most.errors["force"] + 1e-12
    both = (1 + few.truncation["impulse"]) * (1 + most.errors["impulse"]) - 1
    assert few.errors["impulse"] == pytest.approx(both, abs=1e-9)
    assert found["full FE, 8 µs"].truncation is None
    assert found["full FE, 8 µs"].time == pytest.approx(found["full FE, 8 µs"].errors, abs=1e-9)


def test_stages_are_timed_cold_and_warm(made: tuple[Path, Job, Document]) -> None:
    run = by_name(made[2])["residual, 8 modes"]
    assert list(run.stages) == ["mesh", "modes", "morph", "solve"]
    for stage in run.stages.values():
        assert stage.cold is not None
        assert stage.warm is not None
        assert stage.cold.wall > 0
    cold, warm = run.stages["modes"].cold, run.stages["modes"].warm
    assert cold is not None
    assert warm is not None
    assert cold.wall > 3 * warm.wall
    assert run.peak_mib is not None
    assert run.peak_mib > 50


def test_change(made: tuple[Path, Job, Document]) -> None:
    (row,) = made[2].changes
    assert row["reuse_stages"] == {"mesh": "fresh", "modes": "fresh", "morph": "ran", "solve": "ran"}
    assert abs(row["impulse_error"]) < 3e-3
    assert row["force_error"] < 0.1 * row["force_change"]
    assert row["force_error_of_the_change"] == row["force_error"] / row["force_change"]
    assert 0 < row["impact_error"] < 0.1 * row["impact_change"]
    assert row["impact_error_of_the_change"] == row["impact_error"] / row["impact_change"]
    assert f"{row['impact_error_of_the_change']:.2%}" in report_text(made[2])


def test_the_scenes_own_change_is_compared_where_none_is_named(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "scene")
    job = open_job(scene, set={"component.skirt.change.profile.table": "barrel.csv"}, db=tmp_path / "db")
    (row,) = change_rows(job, silent)
    assert row["change"] == "the scene's own"
    assert row["reuse_stages"]["modes"] == "fresh"
    assert row["force_change"] > 0.01
    assert row["force_error"] < 0.1 * row["force_change"]


def test_files(made: tuple[Path, Job, Document]) -> None:
    folder, _, document = made
    assert json.loads((folder / "out" / "report.json").read_text()) == document.as_json()
    with (folder / "out" / "report.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    assert [row["name"] for row in table] == [run.name for run in document.runs]
    assert (folder / "out" / "report.png").stat().st_size > 20_000
    assert (folder / "out" / "report-force.png").stat().st_size > 20_000
    assert "residual, 12 modes" in (folder / "out" / "report.html").read_text()


def test_what_is_done_is_not_done_again(made: tuple[Path, Job, Document], monkeypatch: pytest.MonkeyPatch) -> None:
    folder, _, document = made

    def never(*arguments: object) -> None:
        raise AssertionError("it ran again")

    monkeypatch.setattr(nodal_runs, "simulate_nodal", never)
    monkeypatch.setattr(runs, "simulate", never)
    monkeypatch.setattr(runs, "_measure", never)
    job = open_job(folder / "scene", db=folder / "db", out=folder / "again")
    assert report_job(job, ONCE, silent).runs == document.runs


def test_a_run_is_warmed_up_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By itself, whole: what only comes with contact is compiled then too."""
    called, original = [], runs.simulate
    monkeypatch.setattr(runs, "simulate", lambda system, *given: (called.append(system), original(system, *given))[1])
    job = open_job(write_scene(tmp_path / "scene"), db=tmp_path / "db", out=tmp_path / "out")
    runs.timed(job, 2)
    assert [system.scene.run for system in called] == 3 * [job.scene.run]


def test_interrupted_report_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C in the third setting: the first two are not run again, and the report is that of a run without it."""
    scene = write_scene(tmp_path / "scene") / "scene.toml"
    scene.write_text(scene.read_text() + '[report.sweep]\n"component.skirt.modes.normal_count" = [4, 6, 8]\n')
    job = open_job(scene, db=tmp_path / "db", out=tmp_path / "out")

    def until_third(stage: str, share: float) -> None:
        if stage == "setting 3 of 3":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        report_job(job, ONCE, until_third)
    assert not (tmp_path / "out" / "report.json").exists()
    measured, original = [], runs._measure
    monkeypatch.setattr(runs, "_measure", lambda *given: (measured.append(1), original(*given))[1])
    document = report_job(job, ONCE, silent)
    assert len(measured) == 1
    assert len(document.runs) == 3


def test_finest_setting_is_the_reference_of_last_resort(tmp_path: Path) -> None:
    sweep = '[report.sweep]\n"component.skirt.modes.normal_count" = [4, 8, 12]\n"run.step" = [4e-7, 2e-7, 1e-7]\n'
    _, document = reported(tmp_path, sweep)
    finest = "12 modes, 0.1 µs, step / 4"
    assert document.reference == {"kind": "finest", "source": f"the finest setting of the sweep: {finest}"}
    found = by_name(document)
    best, coarse = found["12 modes, 0.1 µs"], found["12 modes, 0.4 µs"]
    # The finest of the steps that the sweep names has a time error as well.
    assert best.time_against == coarse.time_against == finest
    assert best.time is not None
    assert coarse.time is not None
    assert 0 < abs(best.errors["bore.impulse"]) < abs(coarse.errors["bore.impulse"])
    assert coarse.errors["bore.impulse"] == coarse.time["bore.impulse"]
    assert found["4 modes, 0.2 µs"].truncation_against == "12 modes, 0.2 µs"


def test_a_misspelt_quantity_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"report\.interest: no run has 'bore\.impulze'; did you mean 'bore\.impulse'"):
        reported(tmp_path, '[report]\ninterest = ["bore.impulze"]\n[report.models]\n"a" = {}\n')
    assert not (tmp_path / "out" / "report.json").exists()


def test_a_choice_belongs_to_its_reference(tmp_path: Path) -> None:
    """Another value in the same file is another report."""
    (write_scene(tmp_path / "scene") / "exact.json").write_text('{"expected": {"i": 0.01}}')
    job = open_job(tmp_path / "scene", set={"report.reference": "exact.json"}, db=tmp_path / "db")
    before = next(kept_reports(job)).key
    assert next(kept_reports(job)).key == before
    (tmp_path / "scene" / "exact.json").write_text('{"expected": {"i": 0.02}}')
    assert next(kept_reports(job)).key != before


def test_the_newest_report_counts(tmp_path: Path) -> None:
    """The same scene with other seconds is another report; the same once more is none."""
    job = open_job(write_scene(tmp_path / "scene"), db=tmp_path / "db")
    assert newest_report(job) is None
    first, second = documents.large(), documents.small()
    for number, document in ((1, first), (1, first), (2, second), (3, first)):
        keep_report(job, document)
        assert newest_report(job) == document
        assert len(list(kept_reports(job))) == number + 1


def test_a_report_with_a_number_that_is_not_finite_is_not_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job = open_job(write_scene(tmp_path / "scene"), db=tmp_path / "db")
    monkeypatch.setattr(Document, "as_json", lambda document: {"runs": [{"cpu_seconds": float("nan")}]})
    with pytest.raises(StageError, match=r"document/runs/0/cpu_seconds is not finite"):
        keep_report(job, documents.small())
    assert newest_report(job) is None


def test_a_folder_holds_this_report_or_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A report whose runs fail takes the files of an earlier one; wrong input and other scenes' reports leave them."""
    scene = write_scene(tmp_path / "scene") / "scene.toml"
    job = open_job(scene, db=tmp_path / "db", out=tmp_path / "out")
    write_report(replace(documents.small(), scene=job.name), job.out)
    misspelt = open_job(scene, set={"report.until": 1.0}, db=tmp_path / "db", out=tmp_path / "out")
    with pytest.raises(InputError, match=r"report\.until: 1 s given"):
        report_job(misspelt, ONCE, silent)
    assert (job.out / "report.json").is_file()
    monkeypatch.setattr(runs, "simulate", lambda *given: (_ for _ in ()).throw(StageError("it broke")))
    with pytest.raises(StageError, match=r"no setting ran: .*it broke"):
        report_job(job, ONCE, silent)
    assert {path.name for path in job.out.iterdir()} == {"inputs.json", "scene.json"}
    write_report(documents.small(), job.out)
    with pytest.raises(InputError, match=r"out: holds the report of 'rod', 'scene' needs a folder of its own"):
        report_job(job, ONCE, silent)
    assert json.loads((job.out / "report.json").read_text())["scene"] == "rod"


def test_jobs_change_nothing_but_who_does_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is not timed goes over processes, and no process of the pool is alive while a run is timed."""
    sweep = '[report.sweep]\n"component.skirt.modes.normal_count" = [4, 8]\n'
    _, alone = reported(tmp_path / "one", sweep)
    state = {"pool": False, "timed": 0}
    original_measure, original_spread = runs._measure, runs.spread

    def measure(*given: Any) -> Any:
        assert not state["pool"]
        state["timed"] += 1
        return original_measure(*given)

    def spread(*given: Any) -> None:
        state["pool"] = True
        original_spread(*given)
        state["pool"] = False

    monkeypatch.setattr(runs, "_measure", measure)
    monkeypatch.setattr("gudgeon.pipeline.report.bodies.spread", spread)
    _, spread_out = reported(tmp_path / "two", sweep, Effort(repeat=1, jobs=2))
    assert state["timed"] == 2
    assert [run.errors for run in alone.runs] == [run.errors for run in spread_out.runs]
    assert [run.time for run in alone.runs] == [run.time for run in spread_out.runs]


def test_errors_are_relative_to_the_reference() -> None:
    grid = np.linspace(0, 1e-3, GRID + 1)
    times = np.linspace(0, 1e-3, 501)[1:]
    force = np.zeros((500, 3))
    force[100:200, 0] = 5.0
    exact = ForceReference(grid, smooth(times, force, grid, 4e-5), 5.0 * 2e-4, 4e-5)
    np.testing.assert_allclose(exact.errors(times, force), [0, 0], atol=1e-12)
    np.testing.assert_allclose(exact.errors(times, 1.1 * force), [0.1, 0.1], rtol=1e-9)
    assert exact.errors(times, np.roll(force, 50, axis=0))[0] == pytest.approx(0.0, abs=1e-12)
    assert exact.errors(times, np.roll(force, 50, axis=0))[1] > 0.5


def test_a_scene_without_a_pulse_has_none(tmp_path: Path) -> None:
    assert pulse_reference(open_job(write_scene(tmp_path / "scene"), db=tmp_path / "db")) is None


def test_command_and_tolerance(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The cheapest setting is named, kept, and used from then on."""
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    changes = [
        "--set", 'report.models="unset"', "--set", 'report.interest=["wall.impulse", "wall.duration"]',
        "--set", 'report.sweep={"component.rod.modes.normal_count" = [5, 20, 40]}',
    ]  # fmt: skip
    assert main(["run", "data/rod-wall", *places, *changes, "--tolerance", "1%"]) == 2
    assert "--tolerance: the database has no report of this scene; run: gudgeon report" in capsys.readouterr().err
    assert main(["report", "data/rod-wall", *places, *changes, "--repeat", "1", "--tolerance", "1%"]) == 0
    capsys.readouterr()
    kept = json.loads((tmp_path / "out" / "report.json").read_text())
    best = kept["choice"]
    assert kept["command"].startswith("gudgeon report data/rod-wall/scene.toml --set 'report.models=\"unset\"' --set ")
    assert kept["command"].endswith(" --repeat 1")
    assert best["run"] is not None
    assert best["error"] <= 0.01
    assert main(["solve", "data/rod-wall", *places, *changes, "--tolerance", "0.01", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert best["run"] in report["notes"][-1]
    assert report["stages"]["solve"]["state"] == "fresh"
    assert abs(report["quantities"]["wall.duration"]["error"]) <= 0.01
    assert main(["solve", "data/rod-wall", *places, *changes, "--tolerance", "1e-9"]) == 2
    assert "none meets 1e-09; nearest is" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[report.sweep]\n"component.skirt.modes.normal_count" = []\n', "report.sweep"),
        ('[report.sweep]\n"contact.*.no_such_key" = [1]\n', "no_such_key"),
        ('[report.sweep]\n"joint.*.speed" = [1]\n', "no key 'joint.*.speed' in this scene"),
        ('[report.models]\n"a" = { contact.bore.methd = "penalty" }\n', "did you mean 'method'"),
        (
            '[report.sweep]\n"report.until" = [1e-4, 2e-4]\n',
            "report.sweep: 'report' given, which does not affect the motion",
        ),
        (
            '[report.models]\n"a" = { plot.label = "b" }\n',
            "report.models.a: 'plot' given, which does not affect the motion",
        ),
        ("[report]\nuntil = 0.1\n", "report.until: 0.1 s given, '2 modes' lasts 0.0003 s"),
        ('[report]\nmodels = {}\n[report.changes]\n"a" = { component.skirt.chnge = 1 }\n', "did you mean 'change'"),
    ],
)
def test_wrong_sweeps_are_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message.replace("*", r"\*").replace(".", r"\.")):
        reported(tmp_path, text)
    assert not (tmp_path / "out" / "report.json").exists()


@pytest.mark.parametrize("text", ["0", "100%", "-1%", "one", "1%%", "nan"])
def test_wrong_tolerances_are_refused(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["report", "data/rod-wall", f"--tolerance={text}"])
    assert ended.value.code == 2
    assert "expected a tolerance between 0 and 1, such as 1% or 0.01" in capsys.readouterr().err
