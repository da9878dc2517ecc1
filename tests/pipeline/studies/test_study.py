"""Studies of a rod on a wall: tables, what is done again, and what several designs share."""

import csv
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gudgeon
from gudgeon import modaldb
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.studies.executors import processes
from gudgeon.pipeline.studies.planning import planned
from gudgeon.pipeline.studies.study import Asked, StudyReport, run_study
from gudgeon.pipeline.studies.task import Source, solve_design, version_key
from tests.pipeline.applications.wheel.test_wheel_scene import SMALL, toml
from tests.pipeline.small import block_on_floor
from tests.pipeline.studies import cases
from tests.pipeline.studies.cases import SIZE, VELOCITY, thread, write_rod
from tests.scenes import scene_path

Capture = pytest.CaptureFixture[str]
VELOCITIES = {VELOCITY: [0.5, 1.0, 1.5]}


def done(scene: Path, vary: Any, folder: Path, **options: Any) -> StudyReport:
    """Run a study in this process, with database and results in a folder."""
    options = {"db": folder / "db", "out": folder / "out", "executor": thread} | options
    return gudgeon.study(scene, vary, **options)


def read(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return [*csv.DictReader(file)]


def test_table_has_what_single_runs_have(tmp_path: Path) -> None:
    scene = write_rod(tmp_path)
    report = done(scene, VELOCITIES, tmp_path)
    assert report.counts == {"FINISHED": 3}
    rows = read(tmp_path / "out/study.csv")
    assert [row[VELOCITY] for row in rows] == ["0.5", "1.0", "1.5"]
    frame = report.to_frame()
    assert list(frame.columns) == [*rows[0]]
    assert frame[VELOCITY].tolist() == [0.5, 1.0, 1.5]
    page = report._repr_html_()
    assert "3 FINISHED" in page
    assert page.count("<tr>") == 4
    assert "data:image/png;base64" in page
    for row in rows:
        single = gudgeon.run(
            scene, set=[f"{VELOCITY}={row[VELOCITY]}"], db=tmp_path / "other", out=tmp_path / "single", until="solve"
        )
        assert row["result"] == single.result
        for name, one in single.quantities.items():
            assert float(row[f"{name} [{one['unit']}]"]) == one["value"]
        for name, value in single.estimates.items():
            assert float(row[f"relative error by {name}"]) == value
        share = sum(single.estimates.get(f"{term}.force", 0.0) for term in ("step", "basis", "mesh"))
        stated = float(row["wall.force_peak error [N]"])
        assert stated == pytest.approx(share * single.quantities["wall.force_peak"]["value"], rel=1e-12)
        assert row["key"] == single.stages["solve"].key
        assert row["notes"] == "; ".join(single.notes)
    assert "" not in [row["wall.impulse [N s]"] for row in rows]
    assert (tmp_path / "out/study.png").stat().st_size > 10_000


def test_done_designs_are_not_run_again(tmp_path: Path) -> None:
    scene = write_rod(tmp_path / "here")
    assert done(scene, VELOCITIES, tmp_path).fresh == 0
    first = (tmp_path / "out/study.csv").read_bytes()
    again = done(scene, VELOCITIES, tmp_path)
    assert again.fresh == 3
    assert (tmp_path / "out/study.csv").read_bytes() == first
    assert done(scene, {VELOCITY: [1.5, 2.0]}, tmp_path).fresh == 1
    # Another machine has a copy of the database, and the scene elsewhere.
    shutil.copytree(tmp_path / "db", tmp_path / "there/db")
    moved = done(write_rod(tmp_path / "there/scenes"), VELOCITIES, tmp_path / "there")
    assert moved.fresh == 3
    assert (tmp_path / "there/out/study.csv").read_bytes() == first


def test_equal_designs_are_run_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(cases.MARKS, str(tmp_path / "marks"))
    (tmp_path / "marks").mkdir()
    (tmp_path / "designs.csv").write_text(f"{VELOCITY}\n1.0\n2.0\n1.0\n")
    job = open_job(write_rod(tmp_path), db=tmp_path / "db", out=tmp_path / "out")
    asked = Asked(over=tmp_path / "designs.csv", executor=thread)
    report = run_study(job, asked, lambda stage, share: None, cases.marked)
    # Mesh, modes and design, which both share, and the run.
    assert Counter(path.name.partition("-")[0] for path in (tmp_path / "marks").iterdir()) == {"1": 4, "2": 1}
    one, two, three = report.table.records()
    assert one | {"design": 3} == three != two


def test_a_failed_design_is_a_row_with_its_reason(tmp_path: Path) -> None:
    (tmp_path / "designs.csv").write_text(f"{VELOCITY},body.rod.position.0\n1.0,0.0\n1.0,0.5\n-1.0,0.0\n1.0,-1e-5\n")
    report = done(write_rod(tmp_path), (), tmp_path, over=tmp_path / "designs.csv")
    rows = read(tmp_path / "out/study.csv")
    assert [row["result"] for row in rows] == ["FINISHED", "REFUSED", "FINISHED", "FINISHED"]
    assert "start" in rows[1]["reason"] or "inside" in rows[1]["reason"]
    assert rows[1]["wall.impulse [N s]"] == ""
    assert report.reasons == {rows[1]["reason"]: 1}
    assert "no contact touched" in rows[2]["notes"]
    assert "nan" not in (tmp_path / "out/study.csv").read_text().lower()


def test_a_run_that_fails_physically_is_a_row(tmp_path: Path) -> None:
    (tmp_path / "block.toml").write_text(block_on_floor())
    vary, aside = {"run.limits.angle": [1e-5, 0.5]}, {"body.block.angular_velocity": [0.0, 5.0, 0.0]}
    report = done(tmp_path / "block.toml", vary, tmp_path, set=aside)
    rows = read(tmp_path / "out/study.csv")
    assert [row["result"] for row in rows] == ["ROTATION", "FINISHED"]
    assert "turned" in rows[0]["reason"]
    assert done(tmp_path / "block.toml", vary, tmp_path, set=aside).fresh == 2
    assert report.fresh == 0


def test_shared_meshes_and_modes_are_steps_before_their_designs(tmp_path: Path) -> None:
    job = open_job(write_rod(tmp_path), db=tmp_path / "db", out=tmp_path / "out")
    source = Source(job.name, str(job.path), json.dumps(job.tables), str(tmp_path / "db"), version_key())
    stages, paths = ("mesh", "modes", "morph", "solve"), [SIZE, VELOCITY]
    designs = [(size, speed) for size in (0.05, 0.1) for speed in (1.0, 2.0, 3.0)] + [(0.2, 1.0)]
    steps = planned(source, stages, paths, designs)
    early, late = [step for step in steps if not step.designs], [step for step in steps if step.designs]
    # Mesh, modes and design of each size that several designs share.
    assert [step.task.stages[-1] for step in early] == ["mesh", "mesh", "modes", "modes", "morph", "morph"]
    assert [step.designs for step in late] == [(number,) for number in range(1, 8)]
    assert [len(step.after) for step in late] == [3, 3, 3, 3, 3, 3, 0]
    assert all(max(step.after, default=-1) < number for number, step in enumerate(steps))
    gudgeon.run(job.path, set=[f"{SIZE}=0.05"], db=tmp_path / "db", out=tmp_path / "out", until="modes")
    steps = planned(source, stages, paths, designs)
    assert [step.task.stages[-1] for step in steps if not step.designs] == ["mesh", "modes", "morph", "morph"]


def test_components_that_groups_share_have_one_maker(tmp_path: Path) -> None:
    scene = cases.write_rod(tmp_path)
    scene.write_text(
        scene.read_text() + scene.read_text().partition("[body")[0].replace(".rod", ".other") + "[body.other]\n"
    )
    job = open_job(scene, db=tmp_path / "db", out=tmp_path / "out")
    source = Source(job.name, str(job.path), json.dumps(job.tables), str(tmp_path / "db"), version_key())
    steps = planned(source, ("mesh", "modes", "morph", "solve"), [SIZE], [(0.05,), (0.1,), (0.2,)])
    made = [step for step in steps if not step.designs]
    assert [step.task.stages[-1] for step in made] == ["mesh", "modes", "morph"]
    assert all(step.after == {0, 1, 2} for step in steps if step.designs)


def test_results_do_not_depend_on_workers(tmp_path: Path) -> None:
    """A process pool, in which a worker is killed, gives the bytes of a single thread; nothing is computed twice."""
    scene = write_rod(tmp_path)
    vary = {VELOCITY: "0.5:2:4", SIZE: [0.05, 0.1]}
    done(scene, vary, tmp_path / "one")
    marks = tmp_path / "marks"
    marks.mkdir()
    os.environ[cases.MARKS] = str(marks)
    try:
        job = open_job(scene, db=tmp_path / "two/db", out=tmp_path / "two/out")
        asked = Asked([f"{VELOCITY}=0.5:2:4", f"{SIZE}=0.05,0.1"], jobs=2)
        report = run_study(job, asked, lambda stage, share: None, cases.killed_once)
    finally:
        del os.environ[cases.MARKS]
    assert report.counts == {"FINISHED": 8}
    assert (tmp_path / "two/out/study.csv").read_bytes() == (tmp_path / "one/out/study.csv").read_bytes()
    stores = [modaldb.open(tmp_path / name / "db") for name in ("one", "two")]
    assert [*stores[0].keys()] == [*stores[1].keys()]


def test_workers_of_another_version_are_refused(tmp_path: Path) -> None:
    job = open_job(write_rod(tmp_path), db=tmp_path / "db", out=tmp_path / "out")
    source = Source(job.name, str(job.path), json.dumps(job.tables), str(tmp_path / "db"), "another")
    (step,) = planned(source, ("mesh", "modes", "morph", "solve"), [VELOCITY], [(1.0,)])
    row = solve_design(step.task)
    assert row.result == "LOST"
    assert "other sources of gudgeon" in row.reason
    assert not (tmp_path / "db").exists()


def test_interrupted_command_goes_on(tmp_path: Path) -> None:
    """Ctrl-C ends the workers, writes the table of what is done, and the same command computes the rest."""
    scene = write_rod(tmp_path)
    command = ["study", str(scene), "--vary", f"{VELOCITY}=0.1:2:40", "--jobs", "1", "--db", str(tmp_path / "db")]
    command += ["--out", str(tmp_path / "out"), "--set", "run.samples=2000", "--set", f"{SIZE}=0.002"]
    program = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    program += "from gudgeon.pipeline.cli import entry\nif __name__ == '__main__':\n    entry()\n"
    (tmp_path / "command.py").write_text(program)
    child = subprocess.Popen(
        [sys.executable, str(tmp_path / "command.py"), *command], stderr=subprocess.PIPE, text=True
    )
    limit = time.monotonic() + 120
    while len(records(tmp_path / "db")) < 6 and time.monotonic() < limit:
        time.sleep(0.01)
    os.kill(child.pid, signal.SIGINT)
    _, errors = child.communicate(timeout=60)
    assert child.returncode == 1
    assert "interrupted in stage study; finished stages are in the database" in errors
    results = Counter(row["result"] for row in read(tmp_path / "out/study.csv"))
    assert results["MISSING"] > 0
    assert results["FINISHED"] > 0
    kept = len(records(tmp_path / "db"))
    time.sleep(0.5)
    assert len(records(tmp_path / "db")) == kept  # No worker goes on.
    assert main([*command, "--json"]) == 0
    results = Counter(row["result"] for row in read(tmp_path / "out/study.csv"))
    assert results == {"FINISHED": 40}


def records(folder: Path) -> list[Path]:
    return [*folder.glob("??/*.h5")]


def test_workers_end_when_the_study_is_killed(tmp_path: Path) -> None:
    text = (
        "import os, time\nfrom gudgeon.pipeline.studies.executors import processes\n"
        "if __name__ == '__main__':\n"
        "    pool = processes(1).open()\n    print(pool.submit(os.getpid).result(), flush=True)\n    time.sleep(60)\n"
    )
    (tmp_path / "parent.py").write_text(text)
    parent = subprocess.Popen([sys.executable, str(tmp_path / "parent.py")], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    worker = int(parent.stdout.readline())
    parent.kill()
    parent.wait()
    limit = time.monotonic() + 20
    while Path(f"/proc/{worker}").exists() and _state(worker) != "Z" and time.monotonic() < limit:
        time.sleep(0.05)
    assert not Path(f"/proc/{worker}").exists() or _state(worker) == "Z"


def _state(number: int) -> str:
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return "Z"


def test_each_process_has_one_thread() -> None:
    workers = processes(2)
    pool = workers.open()
    try:
        names = [*pool.map(os.getenv, ["OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"] * 4)]
    finally:
        workers.close(pool)
    assert names == ["1"] * 12


def test_command_and_its_document(tmp_path: Path, capsys: Capture) -> None:
    scene = write_rod(tmp_path)
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out"), "--jobs", "1"]
    command = ["study", str(scene), "--vary", f"{VELOCITY}=1,2", *places]
    assert main(command) == 0
    out = capsys.readouterr().out
    assert "2 designs: 2 FINISHED\n" in out
    assert f"results in {tmp_path / 'out'}: study.json, study.csv" in out
    assert main([*command, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["fresh"] == 2
    assert [row[VELOCITY] for row in document["designs"]] == [1, 2]
    asked = json.loads((tmp_path / "out/study.json").read_text())
    assert (asked["designs"], asked["parameters"], asked["sampling"]) == (2, [VELOCITY], {"kind": "full"})


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], "study: nothing varies; give --vary"),
        (["--vary", f"{VELOCITY}=1:2"], "a range without number of values"),
        (["--over", "absent.csv"], "absent.csv: cannot be read (No such file or directory)"),
        (["--over", "absent.csv", "--vary", "a.b=1"], "--over absent.csv: given with --vary"),
        (["--vary", "body.no.velocity.0=1,2"], "no 'no' in body; it has rod"),
        (["--vary", f"{VELOCITY}=1,2", "--executor", "nonsense"], "--executor nonsense: expected module:function"),
    ],
)
def test_wrong_input_ends_before_anything_runs(
    tmp_path: Path, capsys: Capture, options: list[str], message: str
) -> None:
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out"), "--jobs", "1"]
    assert main(["study", str(write_rod(tmp_path)), *options, *places]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert message in line
    assert not (tmp_path / "db").exists()
    assert not (tmp_path / "out").exists()


def test_a_folder_that_cannot_be_written_is_found_first(tmp_path: Path, capsys: Capture) -> None:
    (tmp_path / "out").write_text("a file")
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out"), "--jobs", "1"]
    assert main(["study", str(write_rod(tmp_path)), "--vary", f"{VELOCITY}=1,2", *places]) == 2
    assert "cannot be written" in capsys.readouterr().err
    assert not (tmp_path / "db").exists()


def test_a_database_that_cannot_be_written_ends_the_study(tmp_path: Path, capsys: Capture) -> None:
    (tmp_path / "db").mkdir()
    for number in range(256):
        (tmp_path / f"db/{number:02x}").write_text("no folder")
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out"), "--jobs", "1"]
    assert main(["study", str(write_rod(tmp_path)), "--vary", f"{VELOCITY}=1,2", *places]) == 2
    assert "cannot be written" in capsys.readouterr().err.splitlines()[-1]
    assert [row["result"] for row in read(tmp_path / "out/study.csv")] == ["MISSING", "MISSING"]


def test_all_designs_refused_is_exit_code_1(tmp_path: Path, capsys: Capture) -> None:
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out"), "--jobs", "1"]
    assert main(["study", str(write_rod(tmp_path)), "--vary", "body.rod.position.0=0.5,0.6", *places]) == 1
    assert "2 designs: 2 REFUSED" in capsys.readouterr().out
    assert not (tmp_path / "out/study.png").exists()


def test_function_takes_arrays_and_texts(tmp_path: Path) -> None:
    scene = write_rod(tmp_path)
    report = done(scene, {VELOCITY: np.array([1.0, 2.0]), SIZE: "0.05,0.1"}, tmp_path)
    assert [(row[VELOCITY], row[SIZE]) for row in report.table.records()] == [
        (1.0, 0.05), (1.0, 0.1), (2.0, 0.05), (2.0, 0.1)
    ]  # fmt: skip
    with pytest.raises(InputError, match="allowed: one of them"):
        done(scene, VELOCITIES, tmp_path, random=2, latin=2)
    assert len(done(scene, {VELOCITY: "1:2"}, tmp_path, latin=3, seed=1).table.rows) == 3
    assert len(done(scene, {VELOCITY: 1.0}, tmp_path).table.rows) == 1
    with pytest.raises(InputError, match=r"set: 5 given; allowed: texts"):
        done(scene, [5], tmp_path)
    with pytest.raises(InputError, match="jobs: 0 given; allowed: 1 or more"):
        done(scene, VELOCITIES, tmp_path, jobs=0)


def test_progress_is_the_share_of_what_was_missing(tmp_path: Path) -> None:
    scene, shares = write_rod(tmp_path), list[float]()
    done(scene, {VELOCITY: [1.0, 2.0]}, tmp_path)
    done(scene, {VELOCITY: "1:4:4"}, tmp_path, progress=lambda stage, share: shares.append(share))
    assert shares == pytest.approx([0.0, 0.0, 0.0, 0.5, 1.0, 1.0], abs=1e-6)


def test_picture_of_named_quantities(tmp_path: Path) -> None:
    scene = write_rod(tmp_path)
    done(scene, VELOCITIES, tmp_path, quantities=["wall.imp*"])
    assert (tmp_path / "out/study.png").is_file()
    with pytest.raises(InputError, match=r"--quantity wall\.restitution: no design has such a quantity"):
        done(scene, {VELOCITY: [-1.0]}, tmp_path, quantities=["wall.restitution"])


def test_a_quantity_that_no_run_can_have_is_refused_before_any_runs(tmp_path: Path) -> None:
    scene = write_rod(tmp_path)
    for pattern, hint in (("wall.force_pek", "did you mean 'wall.force_peak'"), ("*energy*", "of wall, rod")):
        with pytest.raises(InputError, match=rf"--quantity {re.escape(pattern)}: no run of the scene has it; .*{hint}"):
            done(scene, VELOCITIES, tmp_path, quantities=["wall.imp*", pattern])
    assert not (tmp_path / "db").exists()


def test_a_scene_of_conductors_has_no_studies(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"cube\.toml: study: no such command for this scene; it has: run, status"):
        done(scene_path("electrostatics/cube.toml"), {"conductor.cube.mesh.size": [0.1, 0.2]}, tmp_path)
    assert not (tmp_path / "out").exists()


def test_notes_that_differ_by_numbers_are_one_line(tmp_path: Path, capsys: Capture) -> None:
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out"), "--jobs", "1"]
    options = ["--vary", f"{VELOCITY}=-1,-2,-3,1", *places]
    assert main(["study", str(write_rod(tmp_path)), *options]) == 0
    lines = [line for line in capsys.readouterr().err.splitlines() if "no contact touched" in line]
    assert len(lines) == 1
    assert lines[0].startswith("gudgeon: 3 of 4 designs, such as: no contact touched; the smallest gap was")


def test_study_of_a_wheel(tmp_path: Path) -> None:
    settings = [f"{key}={toml(value)}" for key, value in SMALL.items()]
    report = done(scene_path("bladed-disk"), ["wheel.disk.mistuning.seed=1,2,3"], tmp_path, set=settings)
    assert report.counts == {"FINISHED": 3}
    single = gudgeon.run(
        scene_path("bladed-disk"), set=[*settings, "wheel.disk.mistuning.seed=2"], db=tmp_path / "db",
        out=tmp_path / "one", until="solve",
    )  # fmt: skip
    assert single.stages["solve"].state == "fresh"
    values = [row["magnification [1]"] for row in report.table.records()]
    assert values[1] == single.quantities["magnification"]["value"]
    assert len({*values}) == 3
    assert [*single.quantities] == [*open_job(scene_path("bladed-disk")).quantities()]
    with pytest.raises(
        InputError, match=r"--quantity magnif: no run of the scene has it; did you mean 'magnification'"
    ):
        done(scene_path("bladed-disk"), ["wheel.disk.mistuning.seed=4"], tmp_path, set=settings, quantities=["magnif"])
    assert [row["wheel.disk.mistuning.seed"] for row in read(tmp_path / "out/study.csv")] == ["1", "2", "3"]
