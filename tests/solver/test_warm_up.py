"""Compilation ahead of time: what is compiled suffices for any scene, and old machine code is never taken up."""

import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from numba.core.registry import CPUDispatcher

from gudgeon.solver.capabilities import INTEGRATORS
from gudgeon.solver.kernel_cache import COMPILED, cache_folder, compile_beside, is_compiled, sources_digest
from gudgeon.solver.simulate import simulate
from gudgeon.solver.warm_up import CASES, main, warm_up
from tests.solver.systems import (
    block_records,
    block_scene,
    build_all,
    driven_pair_records,
    driven_pair_scene,
    plate_records,
    rod_records,
    rod_scene,
)

MODULES = ("explicit.kernel", "explicit.one_point", "implicit.kernel", "collocation.kernel", "discrete_gradient.kernel")
LAW = {"method": "penalty", "law": {"kind": "hertz", "stiffness": 1e8}}
LAYER = {"surface_stiffness": 1e13}
TOOL = {"kind": "moving", "body": "part", "interface": "top", "force": 10.0, "at": [0.01, 0.0], "speed": 1.0}
SCENES: dict[str, tuple[tuple[dict[str, Any], dict[str, Any]], ...]] = {
    "explicit": (
        ({"part": rod_records(12)}, rod_scene(1e-5)),
        ({"part": block_records(20)}, block_scene(1e-5, **LAYER)),
    ),
    "implicit": (
        ({"part": block_records(20)}, block_scene(1e-5, **LAYER)),
        (driven_pair_records(6), driven_pair_scene(duration=1e-5)),
        ({"part": plate_records()}, {"body": {"part": {}}, "force": {"tool": TOOL}, "run": {"duration": 1e-5}}),
    ),
    "collocation": (({"part": rod_records(12)}, rod_scene(1e-5, **LAW)),),
    "discrete-gradient": (({"part": rod_records(12)}, rod_scene(1e-5, **LAW)),),
}
"""Other numbers of points, modes and bodies than those that were compiled, by integrator."""


def signatures() -> dict[str, int]:
    """Return the number of signatures that each function of the time loops is compiled for."""
    modules = [import_module(f"gudgeon.solver.integrators.{name}") for name in MODULES]
    return {
        f"{module.__name__}.{name}": len(item.signatures)
        for module in modules
        for name, item in vars(module).items()
        if isinstance(item, CPUDispatcher)
    }


@pytest.mark.parametrize("name", SCENES)
def test_a_run_compiles_nothing_more(name: str, tmp_path: Path) -> None:
    warm_up(name)
    before = signatures()
    for number, (records, scene) in enumerate(SCENES[name]):
        run = scene["run"] | {"integrator": name, "samples": 10, "frames": 2}
        found = simulate(build_all(tmp_path / str(number), records, scene | {"run": run}))
        assert found.counts["steps"] > 0
    assert signatures() == before
    assert any(before.values())


def test_every_integrator_but_the_uncompiled_one_is_covered() -> None:
    assert set(COMPILED) == CASES.keys() == SCENES.keys() == INTEGRATORS.keys() - {"event"}
    assert is_compiled("event")


def test_sources_name_the_folder(tmp_path: Path) -> None:
    """One changed line of any compiled source is another folder: numba looks at the file of a function alone."""
    (tmp_path / "solver").mkdir()
    (tmp_path / "solver" / "a.py").write_text("x = 1\n")
    one = sources_digest(tmp_path)
    assert sources_digest(tmp_path) == one
    (tmp_path / "solver" / "a.py").write_text("x = 2\n")
    other = sources_digest(tmp_path)
    (tmp_path / "solver" / "a.py").rename(tmp_path / "solver" / "b.py")
    assert len({one, other, sources_digest(tmp_path)}) == 3
    folder = cache_folder()
    assert folder is not None
    assert folder.name.endswith(sources_digest(Path(__file__).parents[2])) or "NUMBA_CACHE_DIR" in os.environ


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"NUMBA_CACHE_DIR": "{0}/own"}, "{0}/own"),
        ({"NUMBA_CACHE_DIR": "", "XDG_CACHE_HOME": "{0}/xdg"}, "{0}/xdg/gudgeon/kernels-"),
        ({"NUMBA_CACHE_DIR": "", "XDG_CACHE_HOME": "{0}/file"}, "None"),
    ],
)
def test_folder_follows_the_environment(changes: dict[str, str], expected: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    environment = os.environ | {key: value.format(tmp_path) for key, value in changes.items()}
    program = [sys.executable, "-c", "from gudgeon.solver.kernel_cache import cache_folder; print(cache_folder())"]
    child = subprocess.run(program, env=environment, capture_output=True, text=True, check=True)
    assert child.stdout.startswith(expected.format(tmp_path))


def test_the_command_tells_what_it_does(capsys: pytest.CaptureFixture[str]) -> None:
    warm_up("explicit")
    main(["explicit"])
    assert capsys.readouterr().out == "time loop 'explicit': compiled already\n"


def test_an_unknown_time_loop_is_refused() -> None:
    with pytest.raises(SystemExit, match="no compiled time loop 'nonsense'; there are explicit, implicit, "):
        main(["nonsense"])


def test_the_child_takes_no_module_of_the_users_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("gudgeon", "json", "numpy"):
        (tmp_path / f"{name}.py").write_text(f"open('{name}-ran', 'w').close(); raise SystemExit(3)")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("gudgeon.solver.kernel_cache.is_compiled", lambda name: False)
    child = compile_beside("explicit")
    assert child is not None
    assert child.wait(120) == 0
    assert not list(tmp_path.glob("*-ran"))


def test_no_home_is_no_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", homeless)
    assert cache_folder.__wrapped__() is None
