"""Input that attacks: numbers at the edge of arithmetic, endless files, names that leave a folder, full disks."""

import os
import re
import subprocess
import sys
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.geometry.mesh_estimate import refuse_large
from gudgeon.pipeline.geometry.profile import read_rows
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.kinds import open_job, run, schema
from gudgeon.pipeline.stages.keys.products import Product
from gudgeon.pipeline.stages.make import keep, not_finite
from gudgeon.solver.errors import SolverError
from gudgeon.solver.numbers import RANGES
from tests.fuzz.out_folders import SCENE
from tests.scenes import scene_files

ROOT = Path(__file__).resolve().parents[2]
Capture = pytest.CaptureFixture[str]
NORMAL = "contact.floor.against.normal"


@pytest.fixture
def ball(tmp_path: Path) -> Path:
    """The folder of a scene that runs at once."""
    (tmp_path / "ball").mkdir()
    (tmp_path / "ball" / "scene.toml").write_text(SCENE)
    return tmp_path / "ball"


def refused(arguments: list[str], capsys: Capture, code: int = 2) -> str:
    """Return the one line in which a command is refused."""
    assert main(arguments) == code
    (line,) = [one for one in capsys.readouterr().err.splitlines() if not one.endswith(" …")]
    assert line.startswith("gudgeon: ")
    return line.removeprefix("gudgeon: ")


EDGES = [
    ("rod-wall", "contact.wall.against.normal=[5e-324, 0, 0]",
     "normal: [5e-324, 0.0, 0.0] given; allowed magnitude of the largest: 1e-15 to"),
    ("rod-wall", "body.rod.velocity=[1e300, 0, 0]", "velocity.0: 1e+300 given; input should be less than or equal to"),
    ("rod-wall", "component.rod.geometry.area=5e-324", "area: 5e-324 given; allowed magnitude: 1e-36 to 1e+24 m^2"),
    ("rod-wall", "run.gravity=[0, 0, 1e308]", "run.gravity.2: 1e+308 given; input should be less than or equal to"),
    ("rod-wall", "run.duration=1e-320", "run.duration: 1e-320 given; allowed magnitude"),
    ("rod-wall", "component.rod.material.nu=0.4999999999999999", "nu: 0.4999999999999999 given; allowed: 1e-09 away"),
    ("skirt", "component.skirt.change.profile.offset=1e300", "offset: 1e+300 given; input should be less than or"),
    ("hertz", "contact.pair.law.exponent=1e4", "exponent: 10000.0 given; input should be less than or equal to 10"),
    ("rod-wall", "component.rod.modes.normal_count=99999999999999999999", "should be less than or equal to 1000000"),
]  # fmt: skip


@pytest.mark.parametrize(("scene", "change", "expected"), EDGES)
def test_numbers_at_the_edge_are_refused(
    scene: str, change: str, expected: str, tmp_path: Path, capsys: Capture
) -> None:
    path = ROOT / "data" / scene
    line = refused(["status", str(path), "--set", change, "--db", str(tmp_path)], capsys)
    assert line.startswith(f"{path}/scene.toml: {change.partition('=')[0]}")
    assert expected in line


def test_every_number_of_the_schema_has_a_range() -> None:
    """Of every unit; counts have a largest value. Free tables of changes are checked as scenes are."""
    open_ended = []

    def walk(node: object, where: str) -> None:
        if isinstance(node, dict):
            if node.get("type") == "number" and not {"maximum", "exclusiveMaximum"} & set(node):
                open_ended.append(where)
            if node.get("type") == "integer" and "maximum" not in node:
                open_ended.append(where)
            if node.get("type") == "number" and node.get("unit") in RANGES and "maximum" in node:
                assert {"minimum", "least_magnitude", "exclusiveMinimum"} & set(node), where
            for key, value in node.items():
                walk(value, f"{where}.{key}")
        elif isinstance(node, list):
            for number, value in enumerate(node):
                walk(value, f"{where}.{number}")

    walk(schema(), "")
    assert open_ended == []


def test_directions_of_any_length_are_the_same(ball: Path) -> None:
    found = [
        run(
            ball,
            set={"contact.floor.against.normal": [0.0, 0.0, size]},
            db=ball / "db",
            out=ball / f"{k}",
            until="solve",
        )
        for k, size in enumerate((1e-15, 1.0, 1e15))
    ]
    assert found[0].quantities == found[1].quantities == found[2].quantities


def test_a_mesh_beyond_the_memory_is_refused_with_its_figures(tmp_path: Path, capsys: Capture) -> None:
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    for scene, size in (("rod-wall", "component.rod.mesh.size"), ("skirt", "component.skirt.mesh.size")):
        line = refused(["mesh", str(ROOT / "data" / scene), "--set", f"{size}=1e-9", *places], capsys)
        assert f"{size}: 1e-09 m gives about " in line
        assert "GiB of memory" in line
        assert "minutes; this machine has" in line
        (tmp_path / "out" / "scene.json").unlink()


@pytest.mark.parametrize("size", [0.02, 0.05])
def test_the_estimated_number_of_elements_is_that_of_the_mesh_within_a_factor_of_two(size: float) -> None:
    box = Box(kind="box", lx=0.1, ly=0.2, lz=0.1)
    expected = box.expected(2e-3, 0.1, size)
    assert 0.5 < len(box.build(size).cells) / expected < 2


def test_memory_grows_with_the_mesh() -> None:
    with mock.patch("gudgeon.pipeline.geometry.mesh_estimate.total_memory", return_value=2**30):
        refuse_large("solid", 1e4, 0.01)
        with mock.patch.dict("os.environ", GUDGEON_SLEPC="mpirun -n 4 python3"):
            refuse_large("solid", 2e5, 0.01)
        with pytest.raises(InputError, match=r"1e\+06 elements, whose modes need about \d+ GiB of memory and"):
            refuse_large("solid", 1e6, 0.001)


def test_more_steps_than_can_be_taken_are_refused(tmp_path: Path) -> None:
    settings = {"run.step": 1e-25, "run.integrator": "small"}
    with pytest.raises(
        SolverError, match=r"run\.duration: .* with run\.step = 1e-25 s the run has more than 1e\+11 steps"
    ):
        run(ROOT / "data/rod-wall", set=settings, db=tmp_path / "db", out=tmp_path / "out", until="solve")


@pytest.mark.parametrize("path", scene_files().values(), ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_run_step_is_taken_or_refused_in_one_line(path: Path, tmp_path: Path, capsys: Capture) -> None:
    arguments = ["plan", str(path), "--set", "run.step=1e-6", "--db", str(tmp_path)]
    code = main(arguments)
    lines = capsys.readouterr().err.splitlines()
    assert (code, len(lines)) in ((0, 0), (2, 1))


def test_nothing_that_is_not_finite_enters_the_database(tmp_path: Path) -> None:
    store = open_job(ROOT / "data/rod-wall", db=tmp_path).store
    none = np.zeros((0, 0))
    entry = {"wall.force_peak": {"value": float("inf"), "unit": "N"}}
    record = Trajectory("FINISHED", {}, {}, none, none, {}, none, none, none, entry, 0.0, 0.0, {})
    product = Product("solve", "scene", "trajectory", "0" * 64, {})
    with pytest.raises(StageError, match=r"solve of 'scene': quantities/wall.force_peak/value is not finite"):
        keep(store, product, record)
    assert list(store.keys()) == []
    unknown = {"impacts": {"wall": np.array([[0.0, np.nan]])}}
    assert list(not_finite(unknown)) == []
    assert list(not_finite({"impacts": {"wall": np.array([np.inf])}, "times": np.array([np.nan])})) == [
        "impacts/wall",
        "times",
    ]


BAD_NAMES = ["", ".", "..", "../x", "a/b", "/x", r"a\\b", "x" * 101, " x", "x ", r"a\nb", r"a\u0000b", "<x>"]
"""As TOML writes them."""


@pytest.mark.parametrize("name", BAD_NAMES)
@pytest.mark.parametrize("old", ["body.ball", "contact.floor", "component.ball", "interface.foot"])
def test_names_cannot_leave_a_folder(old: str, name: str, ball: Path, capsys: Capture) -> None:
    head = old.partition(".")[0]
    text = SCENE.replace(f"[{old}]", f'[{head}."{name}"]').replace("\ninterface.foot", f'\n{head}."{name}"')
    (ball / "scene.toml").write_text(text if head != "interface" else SCENE.replace(old, f'{head}."{name}"'))
    assert main(["export", str(ball), "results", "--out", str(ball / "out"), "--db", str(ball / "db")]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert any("; allowed: at most 100 letters, digits, '_', '.', '-' and spaces" in line for line in lines)
    assert {path.name for path in ball.iterdir()} <= {"scene.toml", "db"}


def test_plain_names_are_taken(ball: Path) -> None:
    for name in ("ball", "Kolben-1.2", "großer Kolben", "_", "3", "a b"):
        (ball / "scene.toml").write_text(SCENE.replace("[body.ball]", f'[body."{name}"]\ncomponent = "ball"').replace(
            'body = "ball"', f'body = "{name}"'))  # fmt: skip
        assert list(open_job(ball, db=ball / "db").scene.body) == [name]


ENDLESS = {
    "levels": "a = " + "[" * 20_000 + "]" * 20_000,
    "tables": "[" + ".".join(["a"] * 3000) + "]\nx = 1",
    "digits": "a = " + "1" * 5000,
}


@pytest.mark.parametrize("name", ENDLESS)
def test_endless_scenes_are_refused(name: str, tmp_path: Path, capsys: Capture) -> None:
    (tmp_path / "scene.toml").write_text(ENDLESS[name])
    line = refused(["status", str(tmp_path)], capsys)
    assert line.startswith(f"{tmp_path / 'scene.toml'}: ")
    assert "nested too deeply; allowed: 40 levels" in line or "a whole number has too many digits" in line


def test_endless_bases_are_refused(tmp_path: Path, capsys: Capture) -> None:
    for k in range(1200):
        (tmp_path / f"{k}.toml").write_text(f'base = "{k + 1}.toml"')
    (tmp_path / "1200.toml").write_text("")
    assert "more than 40 files are based on each other" in refused(["status", str(tmp_path / "0.toml")], capsys)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (".".join(["a"] * 3000) + "=1", "3000 parts of the path; allowed: 40"),
        ("run.frames=" + "1" * 5000, "too many digits or levels"),
        ("run.frames=" + "[" * 5000 + "]" * 5000, "too many digits or levels"),
        ("run.frames=0x" + "f" * 5000, "a whole number of more digits than are read given; input should be less"),
    ],
)
def test_endless_overrides_are_refused(text: str, expected: str, ball: Path, capsys: Capture) -> None:
    line = refused(["status", str(ball), "--set", text], capsys)
    assert expected in line
    assert len(line) < 1000


@pytest.mark.parametrize("place", ["x" * 5000, "~nobody9/db", "a\0b"])
def test_databases_that_no_folder_can_be_are_refused(place: str, ball: Path, capsys: Capture) -> None:
    assert "no database can be here" in refused(["status", str(ball), "--db", place], capsys)
    assert "no scene here" in refused(["status", place], capsys)


PROGRESS = r"[a-z]+ …( \d+%, .* (elapsed|left))?"
"""Lines of stages, of a slow machine with the share that is done."""


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
@pytest.mark.parametrize(
    "arguments", [["schema"], ["--version"], ["example", "list"], ["solve", "{ball}"], ["status", "{ball}"]]
)
def test_standard_output_on_a_full_disk_is_one_line(arguments: list[str], ball: Path) -> None:
    command = [sys.executable, "-m", "gudgeon.pipeline", *(text.format(ball=ball) for text in arguments)]
    with Path("/dev/full").open("w") as full:
        child = subprocess.run(command, cwd=ball, stdout=full, stderr=subprocess.PIPE, text=True)
    assert child.returncode == 1
    told = child.stderr.splitlines()
    lines = [line for line in told if not re.fullmatch(PROGRESS, line)]
    assert lines == ["gudgeon: standard output: cannot be written (No space left on device)"]


STREAMS = (">&-", "2>&-", "<&- >&- 2>&-", "2>/dev/full")


@pytest.mark.parametrize(
    ("streams", "arguments", "code"),
    [
        ("<&- >&- 2>&-", "run {ball}", 0),
        *(
            (streams, *command)
            for streams in STREAMS
            for command in (
                ("solve {ball} --verbose", 0),
                ("status {ball} --set run.frames=x", 2),
                ("--version", 0),
                ("no", 2),
            )
        ),
    ],
)
def test_closed_streams_change_no_exit_code(streams: str, arguments: str, code: int, ball: Path) -> None:
    """What is left open has no traceback, and the records are whole."""
    if "/dev/full" in streams and not Path("/dev/full").exists():
        pytest.skip("needs a device that is always full")
    command = f"{sys.executable} -m gudgeon.pipeline {arguments.format(ball=ball)} {streams}"
    child = subprocess.run(["sh", "-c", command], cwd=ball, capture_output=True, text=True)
    assert child.returncode == code
    assert "Traceback" not in child.stderr + child.stdout
    if arguments.startswith(("run", "solve")):
        again = subprocess.run(["sh", "-c", command.removesuffix(streams)], cwd=ball, capture_output=True, text=True)
        assert again.returncode == 0
        assert "results in" in again.stdout


NAMES = ["summary.json", "scene.json", "inputs.json", "pictures.json", "trajectory.h5", "unchanged.json"]


@pytest.mark.parametrize("name", NAMES)
def test_pipes_and_devices_among_results_are_made_again(name: str, ball: Path) -> None:
    """Reading them would never end."""
    places = ["solve", str(ball), "--db", str(ball / "db"), "--out", str(ball / "out")]
    assert main(places) == 0
    for put in (os.mkfifo, lambda path: os.symlink("/dev/zero", path)):
        (ball / "out" / name).unlink(missing_ok=True)
        put(ball / "out" / name)
        child = subprocess.run([sys.executable, "-m", "gudgeon.pipeline", *places], capture_output=True, timeout=60)
        assert child.returncode == 0
        assert (ball / "out" / "summary.json").is_file()


def test_a_scene_and_a_table_may_begin_with_a_byte_order_mark(tmp_path: Path) -> None:
    for name, text in (("scene.toml", SCENE), ("table.csv", "0,1\r\n2,3\r\n")):
        (tmp_path / name).write_text(text, encoding="utf-8-sig")
    assert main(["status", str(tmp_path), "--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]) == 0
    assert read_rows(tmp_path / "table.csv", "the table") == [["0", "1"], ["2", "3"]]


def test_a_home_folder_is_that_of_the_user(ball: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(ball))
    monkeypatch.chdir(ball)
    assert main(["solve", str(ball), "--db=~/db", "--out=~/out"]) == 0
    assert (ball / "out" / "summary.json").is_file()
    assert (ball / "db").is_dir()


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (["--db", ""], "database: an empty path is given; a folder is needed"),
        (["--out", ""], "--out: is empty; a folder is needed"),
        (["--out", "~nosuchuser/out"], "--out '~nosuchuser/out': no folder can be here"),
        (["--set", f"run.integrator=0x{'f' * 5000}"], "run.integrator: a whole number of more digits than are read"),
        (
            ["--set", "run.duration=1\n[run]\nsamples=5"],
            "run.duration: '1\\n[run]\\nsamples=5' given; allowed: a number in s",
        ),
    ],
)
def test_places_and_values_that_mean_nothing(options: list[str], expected: str, ball: Path, capsys: Capture) -> None:
    assert expected in refused(
        ["solve", str(ball), "--db", str(ball / "db"), "--out", str(ball / "out"), *options], capsys
    )


def test_every_record_passes_the_gate_for_numbers() -> None:
    """All stages and reports write records through `keep`."""
    sources = [path for part in ("pipeline", "solver") for path in (ROOT / part).rglob("*.py")]
    writing = [
        path.relative_to(ROOT).as_posix() for path in sources if re.search(r"(?<!router)\.put\(", path.read_text())
    ]
    assert writing == ["pipeline/stages/make.py"]
