"""Keys follow the sources: what shapes a product changes its key, a comment does not."""

import ast
import json
import os
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.keys import products, sources
from gudgeon.pipeline.stages.keys.products import LIBRARIES
from gudgeon.pipeline.stages.keys.sources import ROOTS, Modules, canonical, code_digests, source_texts
from gudgeon.pipeline.stages.status import remember, status
from gudgeon.solver import core
from gudgeon.solver.core.sources import digest
from gudgeon.solver.source_state import PACKAGES, ROOT
from tests.pipeline.small import write_scene

COMMENTED = '''
"""Another docstring."""
# A comment.
def f(x: float, *, y: int = 1) -> float:
    """Return it."""
    return (x +
            y)
'''
PLAIN = "def f(x: float, *, y: int = 1) -> float:\n    return x + y\n"


COMPILED: dict[str, str] = json.loads(core.module.sources)


@pytest.fixture(scope="module")
def texts() -> Mapping[str, bytes]:
    return source_texts(ROOT)


@pytest.fixture(scope="module")
def modules(texts: Mapping[str, bytes]) -> Modules:
    """The sources as they stand; each file is parsed once for all tests."""
    return Modules(texts, COMPILED)


def test_every_stage_has_sources(texts: Mapping[str, bytes], modules: Modules) -> None:
    assert ROOTS.keys() == LIBRARIES.keys()
    for stage in ROOTS:
        assert all(name.partition(":")[0] in texts for name in modules.covered(stage)), stage
        assert len(modules.digest(stage)) == 16


@pytest.mark.parametrize(
    ("module", "stages"),
    [
        ("pipeline.geometry.occ", ROOTS.keys() - {"solve", "plot", "report", "poses", "posegrid"}),
        ("pipeline.modes.lanczos", {"modes", "cyclic", "wheel", "measurement"}),
        ("pipeline.design_change.estimate", {"modes", "morph", "sensitivity", "measurement"}),
        ("solver.integrators.implicit.integrator", {"solve", "measurement", "report"}),
        ("pipeline.applications.wheel.response", {"cyclic", "wheel"}),
        ("modaldb.records.traction", ROOTS.keys() - {"poses", "posegrid"}),
        ("modaldb.stores.folder", set()),
        ("pipeline.cli.parser", set()),
    ],
)
def test_a_module_counts_where_it_shapes_numbers(modules: Modules, module: str, stages: set[str]) -> None:
    assert {stage for stage in ROOTS if module in modules.covered(stage)} == stages


def test_a_digest_follows_code_and_no_comment(texts: Mapping[str, bytes], modules: Modules) -> None:
    name = "pipeline.design_change.morph"
    comment = Modules({**texts, name: texts[name] + b"\n# A comment.\n"}, COMPILED)
    code = Modules({**texts, name: texts[name] + b"\nANOTHER = 1\n"}, COMPILED)
    assert comment.digest("mesh") == modules.digest("mesh") != code.digest("mesh")


def test_a_constant_in_a_header_changes_the_keys_of_what_it_computes(
    tmp_path: Path, texts: Mapping[str, bytes], modules: Modules
) -> None:
    """What a source of the core includes counts for the stages that run it; a comment does not."""
    for path in (ROOT / "solver" / "core").rglob("*.[ch]pp"):
        (tmp_path / path.relative_to(ROOT)).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, tmp_path / path.relative_to(ROOT))
    name = "solver/core/python/bind_implicit.cpp"
    header = tmp_path / "solver" / "core" / "view.hpp"
    assert digest(tmp_path / name) == COMPILED[name]
    header.write_text(header.read_text() + "/* A comment. */\n")
    assert digest(tmp_path / name) == COMPILED[name]
    header.write_text(header.read_text() + "constexpr int ANOTHER = 1;\n")
    changed = Modules(texts, {**COMPILED, name: digest(tmp_path / name)})
    assert {stage for stage in ROOTS if changed.digest(stage) != modules.digest(stage)} >= {"solve", "measurement"}
    assert changed.digest("modes") == modules.digest("modes")


def test_kernels_that_are_imported_by_name_count(modules: Modules) -> None:
    """The solver loads an integrator by its name."""
    covered = modules.covered("solve")
    names = [path.parent.name for path in (ROOT / "solver" / "integrators").glob("*/integrator.py")]
    assert len(names) > 3
    assert {f"solver.integrators.{name}.integrator" for name in names} <= set(covered)


def test_drawing_shapes_no_number(modules: Modules) -> None:
    assert any(name.startswith("pipeline.plots.") for name in modules.covered("plot"))
    for stage in ROOTS.keys() - {"plot"}:
        assert not [name for name in modules.covered(stage) if name.startswith(("pipeline.plots", "pipeline.cli"))]


def test_only_what_runs_counts() -> None:
    assert canonical(ast.parse(COMMENTED)) == canonical(ast.parse(PLAIN))


@pytest.mark.parametrize(
    "other",
    [
        PLAIN.replace("x + y", "x - y"),
        PLAIN.replace("= 1", "= 2"),
        PLAIN.replace("= 1", "= 1.0"),
        PLAIN.replace("= 1", "= None"),
        PLAIN.replace("return x + y", "return None"),
        PLAIN.replace("*, ", ""),
        PLAIN + "f = 1\n",
    ],
)
def test_whatever_runs_counts(other: str) -> None:
    assert canonical(ast.parse(PLAIN)) != canonical(ast.parse(other))


def test_digests_are_kept_and_not_trusted_blindly(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Modules, "digest", lambda self, stage: stage.ljust(16, "0"))
    monkeypatch.setattr(sources, "_cache_folder", lambda: tmp_path / "cache")
    code_digests.cache_clear()
    found = code_digests()
    (kept,) = (tmp_path / "cache").glob("sources-*.json")
    code_digests.cache_clear()
    assert code_digests() == found
    kept.write_text('{"mesh": 1}')
    code_digests.cache_clear()
    assert code_digests() == found
    assert not [path for path in kept.parent.iterdir() if path.name.startswith(".")]


def test_kept_digests_are_those_of_the_files_as_they_stand(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file replaced by another of the same size, with its time of change set back, has digests of its own."""
    made: list[str] = []
    monkeypatch.setattr(Modules, "digest", lambda self, stage: made.append(stage) or f"{len(made)}".rjust(16, "0"))
    monkeypatch.setattr(sources, "_cache_folder", lambda: tmp_path / "cache")
    for name in PACKAGES:
        (tmp_path / name).mkdir()
        (tmp_path / name / "a.py").write_text("x = 1\n")
    path = tmp_path / "solver" / "a.py"
    before = path.stat()
    code_digests.cache_clear()
    first = code_digests(tmp_path)
    code_digests.cache_clear()
    assert code_digests(tmp_path) == first
    assert len(made) == len(ROOTS)
    path.write_text("x = 2\n")
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert (path.stat().st_size, path.stat().st_mtime_ns) == (before.st_size, before.st_mtime_ns)
    code_digests.cache_clear()
    assert code_digests(tmp_path) != first


@pytest.fixture(autouse=True)
def forget() -> Iterator[None]:
    """Leave no digests of these tests behind."""
    yield
    code_digests.cache_clear()


def test_digests_need_no_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Modules, "digest", lambda self, stage: stage.ljust(16, "0"))
    monkeypatch.setattr(sources, "_cache_folder", lambda: Path("/proc/none"))
    code_digests.cache_clear()
    assert code_digests().keys() == ROOTS.keys()


def test_status_names_the_code_that_changed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job = open_job(write_scene(tmp_path / "scene"), db=tmp_path / "db", out=tmp_path / "out")
    remember(job, job.stages[:-1])
    digests = {**products.code_digests(), "modes": "changed"}
    monkeypatch.setattr(products, "code_digests", lambda: digests)
    # A job keeps its products: that of a later command is another one.
    rows = {stage: why for stage, _, _, why in status(replace(job))}
    assert rows["modes"] == ["skirt: code of stage modes changed"]
    assert rows["mesh"] == ["skirt: not in this database"]
