"""What wear changes of a bush's compliance, estimated and computed again: against Lamé's ring of another radius."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from gudgeon.modaldb.records.mesh import Attachment
from gudgeon.pipeline.applications.wear.bush import compliance_change, moved_nodes, worn_profile
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import run
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.job import variant
from gudgeon.pipeline.stages.run import solve_records
from gudgeon.solver.vectors import frame_along
from tests.pipeline.applications.wear.test_cycles import GAP, LENGTH, RADIUS, SHAFT
from tests.pipeline.applications.wear.test_elastic_bearing import AROUND, AT_REST, NU, E, opened, written
from tests.pipeline.blocks import block

BORE, OUTER = RADIUS + GAP, 0.02


def ring(radius: float) -> float:
    """Return the mean radial displacement per radial force on the whole bore of a ring held outside (Lamé) [m/N]."""
    even = (1 + NU) * (1 - 2 * NU) / E / (1 / OUTER**2 + (1 - 2 * NU) / radius**2)
    return even * (1 / radius - radius / OUTER**2) / (2 * np.pi * radius * LENGTH)


def test_even_wear_changes_the_bush_as_another_radius_does(tmp_path: Path) -> None:
    """Under an even pressure δC/C = h d log(u/f)/da to 1 %; of all waves no less, and less than four times that."""
    job = opened(tmp_path)
    run(written(tmp_path), until="morph", db=tmp_path / "db", out=tmp_path / "out")
    joint, depth = job.scene.joint["pin"], 2e-6
    wanted = (ring(BORE + depth) - ring(BORE - depth)) / 2 / ring(BORE)
    import gudgeon.pipeline.applications.wear.bush as own

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(own, "WAVES", 0)
        found = compliance_change(job, "pin", joint, np.full(AROUND, depth))
        assert found == pytest.approx(abs(wanted), rel=0.01)
    largest = compliance_change(job, "pin", joint, np.full(AROUND, depth))
    assert found <= largest < 4 * found
    assert compliance_change(job, "pin", joint, np.full(AROUND, 10 * depth)) == pytest.approx(10 * largest, rel=1e-4)


def test_a_bush_with_a_rigid_surface_does_not_wear(tmp_path: Path) -> None:
    """Its compliance is that of the modes, in which the surface is rigid, and not that of the elements alone."""
    attachment = Attachment(np.arange(3), np.zeros(3), "rbe2", 0.0)
    mesh = replace(block((0.01, 0.01, 0.01), (1, 1, 1)).mesh, attachments={"rbe2_9": attachment})
    job = opened(tmp_path)
    rigid = SimpleNamespace(path=job.path, scene=job.scene, record=lambda component, kind="modes": mesh)
    with pytest.raises(InputError, match=r"component\.bush\.geometry: its deck has the rigid element rbe2_9, the wear"):
        compliance_change(rigid, "pin", job.scene.joint["pin"], np.full(AROUND, 2e-6))


def test_nodes_of_the_bore_move_by_the_depth() -> None:
    depths = np.array([1e-6, 2e-6, 3e-6, 2e-6])
    moved = moved_nodes(np.array([[0.01, 0.0], [0.0, 0.01], [-0.01, 0.0], [0.02, 0.0]]), 0.01, 720, depths)
    np.testing.assert_allclose(moved, [[1e-6, 0.0], [0.0, 2e-6], [-3e-6, 0.0], [0.0, 0.0]], atol=1e-18)


def test_the_bush_that_is_computed_again_is_lames_ring(tmp_path: Path) -> None:
    """Of the worn radius: what it yields to an even pressure differs from the unworn bush by Lamé's change to 1 %."""
    job = opened(tmp_path)
    run(written(tmp_path), until="morph", db=tmp_path / "db", out=tmp_path / "out")
    depth = 2e-5
    changed = job_of_worn(job, np.full(AROUND, depth))
    solve_records(changed, "morph")
    further = job_of_worn(changed, np.full(AROUND, 2 * depth))  # The scene's own table is replaced.
    yields = []
    for one in (job, changed, further):
        solve_records(one, "morph")
        bore = system_of(one).bores["pin"]
        yields.append(bore.areas @ bore.compliance @ bore.areas / bore.areas.sum() ** 2)
    assert yields[1] - yields[0] == pytest.approx(ring(BORE + depth) - ring(BORE), rel=0.01)
    assert yields[2] - yields[0] == pytest.approx(ring(BORE + 2 * depth) - ring(BORE), rel=0.01)


@pytest.mark.parametrize("axis", [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
def test_the_worn_profile_has_the_depths_where_the_joint_has_them(tmp_path: Path, axis: list[float]) -> None:
    job = opened(tmp_path, {"joint.pin.axis": axis})
    run(written(tmp_path), until="morph", db=tmp_path / "db", out=tmp_path / "out")
    at = 2 * np.pi / AROUND * np.arange(AROUND)
    depths = 2e-5 * (1 + np.cos(at - 0.4)) + 1e-5 * np.sin(2 * at)
    depths += 1e-6 - depths.min()
    changed = job_of_worn(job, depths)
    solve_records(changed, "morph")
    across = changed.record("bush").interfaces["bore"].points @ frame_along(np.array(axis))[:, :2]
    angles, radii = np.arctan2(across[:, 1], across[:, 0]) % (2 * np.pi), np.linalg.norm(across, axis=1)
    wanted = CubicSpline(np.append(at, 2 * np.pi), np.append(depths, depths[0]), bc_type="periodic")(angles)
    np.testing.assert_allclose(radii - BORE, wanted, atol=1e-9)


def job_of_worn(job: Any, depths: np.ndarray) -> Any:
    """Return the job whose bush is computed again with worn depths."""
    found = worn_profile(job, "pin", job.scene.joint["pin"], depths)
    worn = {"wear": {"bearing_depth": [depths.tolist()]}}
    return variant(job, {"component": {"bush": {"change": found}}, "joint": {"pin": worn}})


@pytest.mark.validation
def test_a_bush_that_wears_much_is_computed_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Within change.tolerance its modes are kept, above it computed again: the same depths to 1 % where both hold."""
    changes = SHAFT | {"run.duration": 0.004, "joint.pin.wear.after": 0.001, "body.shaft.position": [0.0, AT_REST, 0.0]}
    given = [f"--set={key}={value}" for key, value in changes.items()]
    found = {}
    for name, more in {"kept": [], "again": ["--set=component.bush.change.tolerance=1e-6"]}.items():
        places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / name)]
        command = ["wear", str(written(tmp_path)), "--cycles", "30", "--at", "30", *given, *places, *more]
        assert main(command) == 0
        told = capsys.readouterr().out
        document = json.loads((tmp_path / name / "wear.json").read_text())
        runs = document["bushes"]["pin"]["recomputed"]
        assert runs == (0 if name == "kept" else document["runs"] - 1)
        assert f"joint pin: modes of its bush computed again for {runs} runs" in told
        found[name] = document["updates"][-1]["joints"]["pin"]["bearing"]["volume"]
    assert found["again"] == pytest.approx(found["kept"], rel=0.01)
    assert found["again"] != found["kept"]


def test_a_profile_without_its_depths_in_the_gap_is_refused(tmp_path: Path) -> None:
    (tmp_path / "round.csv").write_text("z,-180,-90,0,90,180\n-1,0,0,0,0,0\n1,0,0,0,0,0\n")
    with pytest.raises(InputError, match=r"joint\.pin\.wear\.bearing_depth"):
        opened(tmp_path, {"component.bush.change.profile.table": "round.csv"})


def test_modes_of_a_plane_part_are_computed_again_not_reused(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"component\.bush\.change\.profile\.offset: modes of a plane part are not reused"
    ):
        run(written(tmp_path), until="morph", db=tmp_path / "db", set={"component.bush.change.profile.offset": 1e-5})


def test_a_given_step_too_long_for_a_bush_ends_the_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Such a step leaves the bush where it touched it, and the next one touches it there again, without end."""
    own = ["run.step=6.5e-5", "run.duration=5e-4", "component.bush.mesh.size=1e-3", "joint.pin.wear=unset"]
    sets = [part for one in [*own, "report=unset"] for part in ("--set", one)]
    scene = Path(__file__).resolve().parents[4] / "data" / "clearance-joint" / "elastic.toml"
    assert main(["solve", str(scene), "--db", str(tmp_path / "db"), "--out", str(tmp_path / "out"), *sets]) == 1
    assert "begins and ends without end: run.step, 6.5e-05 s, is too long for it" in capsys.readouterr().err
