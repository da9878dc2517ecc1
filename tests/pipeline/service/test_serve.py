"""`gudgeon serve` as a process: what it prints, how it ends, and what is lost when it is killed."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path

import pytest

pytest.importorskip("fastapi", reason="the extra 'service' is not installed")

from gudgeon import modaldb
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.stores.remote import RemoteStore
from gudgeon.pipeline.cli import main
from tests.modaldb.samples import INPUTS, mesh, same
from tests.pipeline.small import write_scene

KILLS = 3
TOKEN = "secret"


@contextmanager
def process(folder: Path, *arguments: str, port: int = 0, token: str = TOKEN) -> Iterator[tuple[subprocess.Popen, str]]:
    """Start `gudgeon serve`; yield the process and the URL that it prints; kill it if it still runs."""
    command = [sys.executable, "-m", "gudgeon.pipeline", "serve", "--db", str(folder), "--port", str(port), *arguments]
    environment = {**os.environ, "GUDGEON_TOKEN": token}
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment) as child:
        assert child.stdout is not None
        line = child.stdout.readline()
        found = re.fullmatch(r"serving .* at (http://127\.0\.0\.1:\d+)\n", line)
        assert found is not None, (line, child.stderr and child.stderr.read())
        try:
            yield child, found[1]
        finally:
            child.kill()


@pytest.fixture(autouse=True)
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GUDGEON_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("GUDGEON_DB_WAIT", "30")
    monkeypatch.setenv("GUDGEON_TOKEN", TOKEN)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_in_peace(number: int, tmp_path: Path) -> None:
    with process(tmp_path / "db") as (child, url):
        store = modaldb.open(url)
        store.put(content_key(INPUTS), "mesh", mesh(), INPUTS)
        child.send_signal(number)
        _, messages = child.communicate(timeout=20)
        assert child.returncode == 0
    (line,) = messages.splitlines()
    assert f"put default {content_key(INPUTS)} by=environment" in line
    assert modaldb.open(tmp_path / "db").has(content_key(INPUTS))


def test_a_run_with_its_database_at_a_url(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """All stages, then all of them fresh from another folder of results and another cache; by the variable, too."""
    scene = write_scene(tmp_path / "scene")
    with process(tmp_path / "db") as (_, url):
        command = ["solve", str(scene), "--json"]
        assert main([*command, "--db", url, "--out", str(tmp_path / "out")]) == 0
        os.environ["GUDGEON_CACHE"] = str(tmp_path / "other")
        os.environ["GUDGEON_DB"] = url
        try:
            capsys.readouterr()
            assert main(["status", str(scene), "--json", "--out", str(tmp_path / "out2")]) == 0
            rows = json.loads(capsys.readouterr().out)
            assert [row["state"] for row in rows] == ["fresh"] * 4 + ["stale"]
            assert main([*command, "--out", str(tmp_path / "out2")]) == 0
        finally:
            del os.environ["GUDGEON_DB"]
    summaries = [(tmp_path / out / "trajectory.h5").read_bytes() for out in ("out", "out2")]
    assert summaries[0] == summaries[1]
    entries = modaldb.open(tmp_path / "db").find()
    assert {one.kind for one in entries} == {"mesh", "modes", "morph", "trajectory"}
    assert {use[0] for one in entries for use in one.uses} == {"scene"}


def test_nothing_that_was_acknowledged_is_lost_by_kills(tmp_path: Path) -> None:
    """A client puts records while the server is killed and started again: what `put` returned for is there, whole."""
    acknowledged: list[int] = []
    stop = threading.Event()
    port = 0

    def put(url: str) -> None:
        store = RemoteStore(url)
        number = 0
        while not stop.is_set():
            inputs = INPUTS | {"n": number}
            store.put(content_key(inputs), "mesh", mesh(), inputs)
            acknowledged.append(number)
            number += 1

    thread: threading.Thread | None = None
    for _ in range(KILLS):
        with process(tmp_path / "db", port=port) as (child, url):
            port = int(url.rpartition(":")[2])
            if thread is None:
                thread = threading.Thread(target=put, args=(url,))
                thread.start()
            before = len(acknowledged)
            while len(acknowledged) < before + 10:
                assert thread.is_alive()
                threading.Event().wait(0.01)
            child.kill()
            child.wait()
    with process(tmp_path / "db", port=port):
        stop.set()
        assert thread is not None
        thread.join(30)
        assert not thread.is_alive()
    folder = modaldb.open(tmp_path / "db")
    assert len(acknowledged) >= 10 * KILLS
    for number in acknowledged:
        assert same(folder.get(content_key(INPUTS | {"n": number}), "mesh"), mesh())
    assert [fault for _, fault in folder.verify() if fault is not None] == []


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--host", "0.0.0.0"], "serve: --host 0.0.0.0 can be reached by others; give tokens by --tokens FILE or"),
        (["--host", "no.such.host.invalid", "--tokens", "TOKENS"], "serve: no.such.host.invalid:8765: "),
        (["--tokens", "none.toml"], "none.toml: cannot be read (No such file or directory)"),
        (["--db", "a=x", "--db", "a=y"], "serve: two databases 'a'"),
        (["--db", "http://host"], "serve: --db http://host: expected a folder"),
        (["--port", "70000"], "expected a number from 0 to 65535"),
        (["--largest", "-1"], "expected a size in GB, above 0"),
        (["--audit", "none/audit.log"], "serve: --audit none/audit.log: No such file or directory"),
    ],
)
def test_wrong_settings_are_one_line(
    arguments: list[str], line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("GUDGEON_TOKEN")
    (tmp_path / "TOKENS").write_text(f'[[token]]\nname="a"\nsha256="{"0" * 64}"\ndatabases=["*"]\nrights=["read"]\n')
    try:
        code = main(["serve", *arguments])
    except SystemExit as end:
        code = int(str(end.code))
    message = capsys.readouterr().err
    assert (code, "Traceback" in message) == (2, False)
    assert line in message


def test_without_the_extra_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    assert main(["serve"]) == 2
    assert "serve: uvicorn is not installed; pip install 'gudgeon[service]'" in capsys.readouterr().err


UNIT = Path(__file__).parents[3] / "docs/deploy/gudgeon.service"


def unit_settings() -> dict[str, str]:
    """Return the settings of the systemd unit of the documents."""
    lines = [line.partition("=") for line in UNIT.read_text().splitlines() if line and line[0] not in "#["]
    return {name: text for name, _, text in lines}


def test_the_systemd_unit_is_valid(tmp_path: Path) -> None:
    program = shutil.which("systemd-analyze")
    if program is None:
        pytest.skip("systemd-analyze is not installed")
    trial = tmp_path / "gudgeon.service"
    trial.write_text(UNIT.read_text().replace("/opt/gudgeon/bin/gudgeon", sys.executable))
    found = subprocess.run([program, "verify", trial], capture_output=True, text=True, timeout=60)
    assert (found.returncode, found.stderr) == (0, "")


def test_the_command_of_the_systemd_unit(tmp_path: Path) -> None:
    """Its line as it is but for the folders: it serves with tokens, writes its audit, and ends by its signal."""
    unit = unit_settings()
    program, *arguments = unit["ExecStart"].split()
    assert program == "/opt/gudgeon/bin/gudgeon"
    state = unit["WorkingDirectory"]
    assert state == f"/var/lib/{unit['StateDirectory']}"
    here = [one.replace(state, str(tmp_path)).replace("/etc/gudgeon", str(tmp_path)) for one in arguments]
    digest = sha256(TOKEN.encode()).hexdigest()
    row = f'[[token]]\nname="ann"\nsha256="{digest}"\ndatabases=["*"]\nrights=["read", "put"]\n'
    (tmp_path / "tokens.toml").write_text(row)
    environment = {name: text for name, text in os.environ.items() if name != "GUDGEON_TOKEN"}
    command = [sys.executable, "-m", "gudgeon.pipeline", *here, "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment, cwd=tmp_path) as child:
        try:
            assert child.stdout is not None
            url = child.stdout.readline().split()[-1]
            modaldb.open(url).put(content_key(INPUTS), "mesh", mesh(), INPUTS)
            child.send_signal(getattr(signal, unit["KillSignal"]))
            assert child.wait(int(unit["TimeoutStopSec"])) == 0
        finally:
            child.kill()
    (line,) = (tmp_path / "audit.log").read_text().splitlines()
    assert f" put default {content_key(INPUTS)} by=ann from=127.0.0.1 bytes=" in line
    assert modaldb.open(tmp_path / "db").has(content_key(INPUTS))
