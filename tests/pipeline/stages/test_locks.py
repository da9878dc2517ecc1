"""One run at a time writes in a folder of results; what was edited or cut is made again; killed runs leave nothing."""

import errno
import json
import os
import subprocess
import sys
import threading
import time
import uuid
from pathlib import Path

import pytest

from gudgeon.modaldb.errors import StoreUnusable
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.files import read_sealed, whole_file, write_sealed
from gudgeon.pipeline.kinds import run, status
from gudgeon.pipeline.stages.folder import LOCK, held
from tests.fuzz.out_folders import SCENE


@pytest.fixture
def ball(tmp_path: Path) -> Path:
    """A finished run of a scene that runs at once, in `scene`, `db` and `out`."""
    (tmp_path / "scene").mkdir()
    (tmp_path / "scene" / "scene.toml").write_text(SCENE)
    solve(tmp_path)
    return tmp_path


def solve(folder: Path, **settings: float) -> dict[str, float]:
    """Run the scene of a folder and return its quantities."""
    changes = {f"run.{name}": value for name, value in settings.items()}
    found = run(folder / "scene", set=changes, db=folder / "db", out=folder / "out", until="solve")
    return {name: entry["value"] for name, entry in found.quantities.items()}


def test_runs_in_one_folder_wait_for_each_other(tmp_path: Path) -> None:
    order, waited = [], threading.Event()

    def other() -> None:
        with held(tmp_path, waited.set):
            order.append("other")

    with held(tmp_path):
        thread = threading.Thread(target=other)
        thread.start()
        assert waited.wait(10)
        time.sleep(0.05)
        order.append("first")
    thread.join(10)
    assert order == ["first", "other"]
    assert list(tmp_path.iterdir()) == []


def test_many_runs_never_hold_a_folder_at_once(tmp_path: Path) -> None:
    """The lock file is removed by each and made anew by the next."""
    inside, most = [], []

    def work() -> None:
        for _ in range(20):
            with held(tmp_path):
                inside.append(1)
                most.append(len(inside))
                inside.pop()

    threads = [threading.Thread(target=work) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert len(most) == 120
    assert max(most) == 1


@pytest.mark.parametrize("moment", ["made", "locked"])
def test_a_signal_while_a_folder_is_taken_leaves_no_lock(
    moment: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also between two instructions, before the process knows the file that it made."""

    def stopped(*arguments: os.stat_result) -> bool:
        monkeypatch.setattr(os.path, "samestat", samestat)
        raise KeyboardInterrupt

    def made(*arguments: int) -> int:
        os_open(*arguments)
        monkeypatch.setattr(os, "open", os_open)
        raise KeyboardInterrupt

    os_open, samestat = os.open, os.path.samestat
    if moment == "made":
        monkeypatch.setattr(os, "open", made)
    else:
        monkeypatch.setattr(os.path, "samestat", stopped)
    with pytest.raises(KeyboardInterrupt), held(tmp_path):
        pytest.fail("the folder was taken")
    assert list(tmp_path.iterdir()) == []
    with held(tmp_path):
        assert (tmp_path / LOCK).exists()
    assert list(tmp_path.iterdir()) == []


HOLD = """
import sys, time
from pathlib import Path
from gudgeon.pipeline.stages.folder import held
with held(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


def test_a_killed_run_is_not_waited_for(ball: Path) -> None:
    out, name = ball / "out", uuid.uuid4().hex
    with subprocess.Popen([sys.executable, "-c", HOLD, str(out)], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "held\n"
        child.kill()
    assert (out / LOCK).exists()
    (out / f".drawing-{name}").mkdir()
    (out / f".drawing-{name}" / "flat.json").write_text("{}")
    (out / f".summary.json.{name}.part").write_text("cut")
    (out / "vtu" / "ball").mkdir(parents=True)
    (out / "vtu" / "ball" / f".frame_000.vtu.{name}.part").write_text("cut")
    (out / ".of-the-user.part").write_text("kept")
    solve(ball)
    assert [path.name for path in out.rglob(".*")] == [".of-the-user.part"]


def test_an_edited_figure_is_made_again(ball: Path) -> None:
    before = solve(ball)
    path = ball / "out" / "summary.json"
    document = json.loads(path.read_text())
    document["quantities"]["floor.impulse"]["value"] = 12345.7
    path.write_text(json.dumps(document))
    assert solve(ball) == before
    assert json.loads(path.read_text())["quantities"]["floor.impulse"]["value"] == before["floor.impulse"]


def test_a_trajectory_that_is_not_that_of_the_summary_is_made_again(ball: Path) -> None:
    """As where another run wrote its own beside the summary."""
    path = ball / "out" / "trajectory.h5"
    own = path.read_bytes()
    solve(ball, samples=50)
    other = path.read_bytes()
    solve(ball)
    assert path.read_bytes() == own
    for content in (other, own[:-1], own[:100] + b"x" + own[101:]):
        path.write_bytes(content)
        solve(ball)
        assert path.read_bytes() == own


@pytest.mark.parametrize("content", ["", "[]", "null", "NaN", "[" * 100_000, '{"key": 1}', '{"files": ["../x"]}'])
@pytest.mark.parametrize("name", ["summary.json", "inputs.json", "pictures.json", "scene.json"])
def test_broken_files_of_a_folder_never_raise(name: str, content: str, ball: Path) -> None:
    before = solve(ball)
    (ball / "out" / name).write_text(content)
    assert [row[1] for row in status(ball / "scene", db=ball / "db", out=ball / "out")] == ["fresh"] * 4 + ["stale"]
    assert solve(ball) == before


def test_fresh_results_are_read_where_nothing_can_be_written(ball: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before, opened = solve(ball), os.open

    def closed(path: Path, flags: int, *mode: int) -> int:
        if flags & os.O_CREAT:
            raise OSError(errno.EROFS, "Read-only file system", str(path))
        return opened(path, flags, *mode)

    monkeypatch.setattr("os.open", closed)
    assert solve(ball) == before
    with pytest.raises(StoreUnusable, match="cannot be written"):
        solve(ball, samples=30)


def test_sealed_documents_are_read_as_written(tmp_path: Path) -> None:
    path, content = tmp_path / "x.json", {"a": [1.0, 2], "b": {"c": None, "ω": "é"}}
    write_sealed(path, content)
    assert read_sealed(path) == content
    path.write_text(path.read_text().replace("2", "3", 1))
    assert read_sealed(path) is None
    assert read_sealed(tmp_path / "none.json") is None


def test_temporary_names_cannot_be_foretold_and_links_are_not_followed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with whole_file(tmp_path / "x") as one, whole_file(tmp_path / "x") as other:
        assert one != other
        assert str(os.getpid()) not in one.name.split(".")
    (tmp_path / "victim").write_text("untouched")
    fixed = uuid.uuid4()
    monkeypatch.setattr("uuid.uuid4", lambda: fixed)
    (tmp_path / f".x.{fixed.hex}.part").symlink_to(tmp_path / "victim")
    with pytest.raises(Exception, match="cannot be written"), whole_file(tmp_path / "x") as scratch:
        scratch.write_text("led astray")
    assert (tmp_path / "victim").read_text() == "untouched"


@pytest.mark.parametrize(("number", "kind"), [(errno.ENOSPC, StageError), (errno.EACCES, InputError)])
def test_a_full_disk_is_no_mistake_of_the_user(
    number: int, kind: type[Exception], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(*given: object) -> int:
        raise OSError(number, "no")

    monkeypatch.setattr("os.open", failing)
    with pytest.raises(kind, match="x: cannot be written"), whole_file(tmp_path / "x"):
        pass


def test_a_drawing_process_ends_with_the_one_that_started_it(tmp_path: Path) -> None:
    program = (
        "from gudgeon.pipeline.process.lifeline import end_with_parent; import time; end_with_parent(); time.sleep(60)"
    )
    alive, end = os.pipe()
    child = subprocess.Popen([sys.executable, "-c", program], stdin=alive)
    os.close(alive)
    time.sleep(0.2)
    assert child.poll() is None
    os.close(end)
    assert child.wait(30) == 1
