"""Long validations: `make test` runs a share of them that follows from the commit, `make validate` all of them. Tests
of the checked core, which `make checked` runs. And records that tests share."""

import hashlib
import math
import os
import re
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
MARK = "validation"
OWN_RECORDS = "own_records"
CHECKED = "checked"
RUNNING = pytest.StashKey[pytest.Item]()
"""The test that runs."""
START = pytest.StashKey[float]()
"""CPU time of the process when a test starts [s]."""
HEADING = "## Long validations"
"""Of the part of a page that a table replaces to the page's end."""
HEAD = f"""{HEADING}

`make validate` runs all of these tests and writes what they found; `make validate ARGS="-k pendulum"` runs some, and
leaves the rows of the others. `make test` runs those of a share of the files, which follows from the commit, and prints
which.

| test | last run | found | CPU time |
|---|---|---|---|
"""
ROW = re.compile(r"\| `([^`]+)` \|.*")


def pytest_addoption(parser: pytest.Parser) -> None:
    """See the module."""
    parser.addoption("--validation-share", type=float, default=1.0, help="share of files whose long validations run")
    parser.addoption("--validation-table", type=Path, help="page that ends with what validations found")


def pytest_configure(config: pytest.Config) -> None:
    """Name the mark, and keep what validations find; of several processes, in the one that collects reports."""
    config.addinivalue_line("markers", f"{MARK}: takes 8 s of CPU time or more, and runs in full by `make validate`")
    config.addinivalue_line("markers", f"{CHECKED}: needs the core with checked indices, as `make checked` runs it")
    config.addinivalue_line("markers", f"{OWN_RECORDS}: computes all its records, see tests/shared.py")
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(Found(config), "found by validations")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the validations of all files but a share, which follows from the commit, and tests of a core that does
    not run.

    Tests of one file go together, since they share what takes long.
    """
    if os.environ.get("GUDGEON_CORE") != "checked":
        leave_out(config, items, [item for item in items if item.get_closest_marker(CHECKED)])
    share = config.getoption("--validation-share")
    long = {item: item.nodeid.partition("::")[0] for item in items if item.get_closest_marker(MARK)}
    if share >= 1.0 or not long:
        return
    seed, files = commit(), sorted(set(long.values()))
    files.sort(key=lambda file: hashlib.sha256(f"{seed} {file}".encode()).digest())
    chosen = files[: math.ceil(share * len(files))]
    leave_out(config, items, [item for item, file in long.items() if file not in chosen])


def leave_out(config: pytest.Config, items: list[pytest.Item], left_out: list[pytest.Item]) -> None:
    """Take tests out of those that run."""
    config.hook.pytest_deselected(items=left_out)
    items[:] = [item for item in items if item not in left_out]


def commit() -> str:
    """Return the commit that is checked out; without git, nothing."""
    command = ["git", "-C", str(ROOT), "rev-parse", "--short=12", "HEAD"]
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item):  # type: ignore[no-untyped-def]
    """Note the CPU time of a validation, of its fixtures as well."""
    try:
        return (yield)
    finally:
        if item.get_closest_marker(MARK):
            item.user_properties.append(("cpu", round(time.process_time() - item.stash[START], 1)))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item):  # type: ignore[no-untyped-def]
    """Note the test that runs, and when it starts."""
    item.config.stash[RUNNING], item.stash[START] = item, time.process_time()
    return (yield)


@pytest.fixture(scope="session")
def shared_records(tmp_path_factory: pytest.TempPathFactory, pytestconfig: pytest.Config) -> Iterator[None]:
    """Share records of stages between the tests of this session, of all workers; see `tests.shared`."""
    from tests.shared import Records, sharing

    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "shared"
    with sharing(Records(folder, lambda: not computes_itself(pytestconfig.stash[RUNNING]))):
        yield


def computes_itself(item: pytest.Item) -> bool:
    """Whether a test shares no records; see `tests.shared`."""
    return "monkeypatch" in getattr(item, "fixturenames", ()) or item.get_closest_marker(OWN_RECORDS) is not None


class Found:
    """What the validations of a session found, for its last line and the table.

    A test tells its figure by `record_property("found", "1.3e-4 of 1e-3 allowed")`.
    """

    def __init__(self, config: pytest.Config) -> None:
        self._table: Path | None = config.getoption("--validation-table")
        self._rows: dict[str, str] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note the row of a test."""
        told = dict(report.user_properties)
        if "cpu" not in told or report.when != "call":  # Keywords have the names of folders, too.
            return
        found = told.get("found", "") if report.passed else ""
        cells = (f"`{report.nodeid}`", f"{time.strftime('%Y-%m-%d', time.gmtime())}, {commit()}",
                 f"{report.outcome}{': ' if found else ''}{found}", f"{told.get('cpu', 0.0)} s")  # fmt: skip
        self._rows[report.nodeid] = f"| {' | '.join(cells)} |"

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Say which validations ran."""
        if self._rows:
            terminalreporter.write_line(f"validations of commit {commit()}: {', '.join(sorted(self._rows))}")

    def pytest_sessionfinish(self) -> None:
        """Write the table; rows of tests that did not run stay."""
        if self._table is None or not self._rows:
            return
        page, _, before = self._table.read_text().partition(HEADING)
        rows = {match[1]: match[0] for line in before.splitlines() if (match := ROW.fullmatch(line))} | self._rows
        self._table.write_text(page.rstrip() + "\n\n" + HEAD + "".join(f"{rows[name]}\n" for name in sorted(rows)))
