"""Stages do what is stale and nothing else; costs are counted, not timed."""

import json
import shutil
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from gudgeon import modaldb
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.pipeline.modes import block_method, flexibility, lanczos, normal
from gudgeon.pipeline.stages import mesh as mesh_stage
from gudgeon.pipeline.stages.run_report import RunReport
from gudgeon.pipeline.stages.status import status
from tests.pipeline.small import TABLE, UPDATE, write_scene
from tests.scenes import scene_files


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, RunReport]:
    folder = tmp_path_factory.mktemp("made")
    write_scene(folder / "scene")
    return folder, run(folder / "scene", db=folder / "db", out=folder / "out", until="solve")


@pytest.fixture
def folder(made: tuple[Path, RunReport], tmp_path: Path) -> Path:
    """A copy of a finished run that a test may spoil."""
    shutil.copytree(made[0], tmp_path / "made")
    return tmp_path / "made"


@pytest.fixture
def counts(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """How many meshes were made and how many matrices factorised."""
    found: Counter[str] = Counter()

    def counted(name: str, whole: object) -> object:
        def call(*args: object, **options: object) -> object:
            found[name] += 1
            return whole(*args, **options)  # type: ignore[operator]

        return call

    monkeypatch.setattr(mesh_stage, "build_mesh", counted("meshes", mesh_stage.build_mesh))
    for module in (block_method, flexibility, lanczos, normal):
        monkeypatch.setattr(module, "factorise", counted("factorisations", module.factorise))
    monkeypatch.setattr(flexibility, "condense", counted("factorisations", flexibility.condense))
    return found


def again(folder: Path, *, until: str = "solve", **changes: str) -> RunReport:
    return run(folder / "scene", set=changes, db=folder / "db", out=folder / "out", until=until)


def states(report: RunReport) -> dict[str, str]:
    return {name: stage.state for name, stage in report.stages.items()}


def test_first_run_counts(tmp_path: Path, counts: Counter[str]) -> None:
    write_scene(tmp_path / "scene")
    report = again(tmp_path)
    assert set(states(report).values()) == {"ran"}
    # Shifted matrix, inertia count, held matrix with contact rows, and the flexibility that tells modes from shapes.
    assert counts == {"meshes": 1, "factorisations": 4}


def test_second_run_does_nothing(folder: Path, counts: Counter[str]) -> None:
    report = again(folder)
    assert set(states(report).values()) == {"fresh"}
    assert not counts


def test_a_change_touches_neither_mesh_nor_modes(folder: Path, counts: Counter[str]) -> None:
    report = again(folder, **{TABLE: "barrel.csv"})
    assert states(report) == {"mesh": "fresh", "modes": "fresh", "morph": "ran", "solve": "ran"}
    assert not counts


def test_recompute_makes_its_own_modes(folder: Path, counts: Counter[str]) -> None:
    report = again(folder, **{TABLE: "barrel.csv", UPDATE: "recompute"})
    assert states(report) == {"mesh": "ran", "modes": "ran", "morph": "ran", "solve": "ran"}
    assert counts == {"factorisations": 4}


def test_going_back_to_an_old_design_finds_it(folder: Path, made: tuple[Path, RunReport]) -> None:
    again(folder, **{TABLE: "barrel.csv"})
    report = again(folder)
    assert set(states(report).values()) == {"fresh"}
    assert report.quantities == made[1].quantities
    assert json.loads((folder / "out" / "summary.json").read_text())["key"] == report.stages["solve"].key


def test_reuse_is_near_recompute_and_far_from_no_change(folder: Path, made: tuple[Path, RunReport]) -> None:
    reused, recomputed = (
        again(folder, **{TABLE: "barrel.csv"}),
        again(folder, **{TABLE: "barrel.csv", UPDATE: "recompute"}),
    )
    impulses = [r.quantities["bore.impulse"]["value"] for r in (made[1], reused, recomputed)]
    assert impulses[1] == pytest.approx(impulses[2], rel=3e-3)
    assert impulses[0] != pytest.approx(impulses[2], rel=1e-2)


def test_an_edited_table_is_another_design(folder: Path) -> None:
    again(folder, **{TABLE: "barrel.csv"})
    table = folder / "scene" / "barrel.csv"
    table.write_text(table.read_text().replace("-2e-5", "-3e-5"))
    assert states(again(folder, **{TABLE: "barrel.csv"}))["morph"] == "ran"


def test_status_says_why(folder: Path) -> None:
    job = open_job(
        folder / "scene", set={"component.skirt.modes.normal_count": 9}, db=folder / "db", out=folder / "out"
    )
    rows = {stage: (state, why) for stage, state, _, why in status(job)}
    assert rows["mesh"] == ("fresh", [])
    assert rows["modes"] == ("stale", ["skirt: modes.normal_count: 8 → 9"])
    assert rows["solve"][0] == "stale"


def test_modes_are_found_whichever_scene_asks(folder: Path, counts: Counter[str]) -> None:
    other = write_scene(folder / "other")
    text = (other / "scene.toml").read_text().replace("velocity = [0.2", "velocity = [0.1")
    (other / "scene.toml").write_text(text)
    report = run(other, db=folder / "db", out=folder / "out2", until="solve")
    assert states(report) == {"mesh": "fresh", "modes": "fresh", "morph": "fresh", "solve": "ran"}
    assert not counts


def test_json_document(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["solve", str(folder / "scene"), "--db", str(folder / "db"), "--out", str(folder / "out"), "--json"]
    assert main(arguments) == 0
    document = json.loads(capsys.readouterr().out)
    assert {"scene", "result", "stages", "quantities", "energy_drift", "momentum_residual", "out"} <= set(document)
    assert set(document["stages"]["modes"]) == {"state", "seconds", "cpu", "key", "keys"}
    assert set(document["quantities"]["bore.impulse"]) == {"value", "unit", "reference", "error"}


def test_trajectory_file_is_the_record(folder: Path, made: tuple[Path, RunReport]) -> None:
    store = modaldb.open(folder / "db")
    path = store.path(made[1].stages["solve"].key)
    assert (folder / "out" / "trajectory.h5").read_bytes() == path.read_bytes()


def test_contact_touches_only_through_the_stored_points(folder: Path, made: tuple[Path, RunReport]) -> None:
    trajectory = modaldb.open(folder / "db").get(made[1].stages["solve"].key, "trajectory")
    contact = trajectory.contacts["bore"]
    assert trajectory.result == "FINISHED"
    assert trajectory.energy_drift < 1e-3
    assert trajectory.momentum_residual < 1e-11
    np.testing.assert_allclose(np.hypot(contact.points[:, 0], contact.points[:, 1]), 0.04296, atol=1e-12)


def test_scenes_that_are_shipped_are_sound() -> None:
    folders = [path.parent for path in scene_files().values() if path.name == "scene.toml"]
    assert len(folders) >= 3
    for folder in folders:
        job = open_job(folder)
        assert job.products(job.stages)


def test_a_stage_that_there_is_not_is_refused(made: tuple[Path, RunReport]) -> None:
    with pytest.raises(InputError, match="no stage 'solv'; its stages are mesh, modes, morph, solve, plot"):
        run(made[0] / "scene", db=made[0] / "db", out=made[0] / "out", until="solv")


def test_one_override_may_be_a_text(made: tuple[Path, RunReport]) -> None:
    one, same = (
        open_job(made[0] / "scene", set=change, db=made[0] / "db")
        for change in ("run.duration=1e-4", {"run.duration": 1e-4})
    )
    assert one.scene == same.scene
    assert one.scene.run.duration == 1e-4


def test_a_reason_is_told_once(made: tuple[Path, RunReport]) -> None:
    """The base mesh and the mesh of the modes are one record where nothing moved."""
    job = open_job(made[0] / "scene", set={"component.skirt.mesh.size": 0.02}, db=made[0] / "db", out=made[0] / "out")
    why = status(job)[0][3]
    assert len(why) == len(set(why)) == 1


@pytest.mark.own_records
def test_progress_tells_each_run_of_the_solver_and_does_not_decrease_within_it(tmp_path: Path) -> None:
    """The solver runs again for the step and the estimates of errors."""
    write_scene(tmp_path / "scene")
    shares: dict[str, list[float]] = {}
    run(
        tmp_path / "scene", db=tmp_path / "db", out=tmp_path / "out", until="solve",
        progress=lambda stage, share: shares.setdefault(stage, []).append(share),
    )  # fmt: skip
    assert {"solve", "solve (run 2)"} <= set(shares)
    for stage in shares:
        assert shares[stage] == sorted(shares[stage]), stage
