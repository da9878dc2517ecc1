"""Scenes of conductors: capacitances, floating conductors, images, records, and what is refused."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.field import FieldRecord
from gudgeon.pipeline.applications.electrostatics.capacitance import VACUUM, state
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job, plan, run
from gudgeon.pipeline.stages.status import status
from tests.scenes import scene_path

SPHERES = scene_path("electrostatics") / "spheres.toml"
COARSE = {"conductor.left.mesh.size": 1e-3, "conductor.right.mesh.size": 1e-3}


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("electrostatics")


def solved(db: Path, **changes: Any) -> Any:
    """Run two coarse spheres with changes, `__` for a full stop; return the report and the record."""
    settings = COARSE | {key.replace("__", "."): value for key, value in changes.items()}
    report = run(SPHERES, set=settings, db=db, out=db / "out", until="solve")
    job = open_job(SPHERES, set=settings, db=db, out=db / "out")
    return report, job.store.get(job.field().key, "field")


def value(report: Any, name: str) -> float:
    return report.quantities[name]["value"]


def test_charges_follow_from_the_matrix_and_the_panels(db: Path) -> None:
    report, record = solved(db)
    assert isinstance(record, FieldRecord)
    corners = record.facets
    facets = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    areas = np.bincount(record.panel, facets)
    charges = [float((areas * (record.density @ record.potentials))[record.conductor == k].sum()) for k in (0, 1)]
    assert charges == pytest.approx(record.charges)
    assert record.charges == pytest.approx(record.capacitance @ record.potentials)
    assert value(report, "left.charge") == pytest.approx(-value(report, "right.charge"), rel=1e-3)
    assert value(report, "co_energy") == pytest.approx(0.5 * record.charges @ record.potentials)
    # Maxwell's matrix: own entries above zero, others below, sums of rows above zero.
    C = record.capacitance
    assert (np.diag(C) > 0).all()
    assert C[0, 1] == C[1, 0] < 0
    assert (C.sum(axis=1) > 0).all()


def test_estimates_are_above_the_error(db: Path) -> None:
    report, _ = solved(db)
    error = abs(report.quantities["left.right.mutual_capacitance"]["error"])
    assert 1e-4 < error < sum(report.estimates.values()) < 30 * error


def test_a_floating_conductor_keeps_its_charge(db: Path) -> None:
    report, record = solved(db, conductor__left__potential="unset", conductor__left__charge=2e-12)
    assert value(report, "left.charge") == pytest.approx(2e-12, rel=1e-12)
    assert value(report, "right.potential") == 5.0
    V = record.potentials
    assert V[0] == pytest.approx((2e-12 - record.capacitance[0, 1] * 5) / record.capacitance[0, 0])


def test_all_conductors_may_float(db: Path) -> None:
    C = np.array([[2.0, -1.0], [-1.0, 3.0]])
    found = state(C, np.full(2, np.nan), np.array([1.0, 2.0]))
    assert C @ found.potentials == pytest.approx([1.0, 2.0])


def test_the_medium_multiplies_capacitances(db: Path) -> None:
    _, vacuum = solved(db)
    _, oil = solved(db, permittivity=2.2)
    assert oil.capacitance == pytest.approx(2.2 * vacuum.capacitance)
    assert vacuum.medium == {"permittivity": VACUUM}


@pytest.mark.validation
def test_a_dielectric_half_space_lies_between_none_and_a_conductor(db: Path) -> None:
    """Far above it nothing changes; with the medium's own permittivity there is none."""
    plane = {"half_space__point": [0.0, 0.0, -1.2e-3]}
    _, without = solved(db)
    found = [solved(db, **plane, half_space__permittivity=e)[1].capacitance[0, 0] for e in (1.0, 4.0, 1e6, "conductor")]
    assert found[0] == pytest.approx(without.capacitance[0, 0], rel=1e-12)
    assert found[0] < found[1] < found[2]
    assert found[2] == pytest.approx(found[3], rel=1e-5)
    _, far = solved(db, half_space__point=[0.0, 0.0, -1.0], half_space__permittivity="conductor")
    assert far.capacitance[0, 0] == pytest.approx(without.capacitance[0, 0], rel=2e-3)


def test_a_grounded_plane_is_the_mirrored_sphere(db: Path) -> None:
    """Two spheres at ±V have the plane between them: one has twice the mutual capacitance over it."""
    report, _ = solved(db, panels__curved_divisions=1)
    alone, _ = solved(
        db, conductor__right="unset", half_space={"normal": [-1.0, 0.0, 0.0], "permittivity": "conductor"},
        report__quantities="unset",
    )  # fmt: skip
    both = value(report, "left.right.mutual_capacitance")
    assert value(alone, "left.capacitance") == pytest.approx(2 * both, rel=1e-3)


def test_stages_are_fresh_and_the_mesh_is_shared(db: Path, tmp_path: Path) -> None:
    solved(db)
    again, _ = solved(db)
    assert [again.stages[stage].state for stage in ("mesh", "solve")] == ["fresh", "fresh"]
    moved, _ = solved(db, conductor__right__position=[1.3e-3, 0.0, 0.0])
    assert [moved.stages[stage].state for stage in ("mesh", "solve")] == ["fresh", "ran"]
    rows = status(open_job(SPHERES, set=COARSE, db=tmp_path / "empty", out=tmp_path / "out"))
    assert [row[:2] for row in rows][:2] == [("mesh", "stale"), ("solve", "stale")]
    terms = plan(SPHERES, db=db)["terms"]
    assert [row["term"] for row in terms if row["present"]] == ["conductors"]


def test_results_are_written(db: Path, tmp_path: Path) -> None:
    settings = [f"--set={key}={value}" for key, value in COARSE.items()]
    assert main(["solve", str(SPHERES), *settings, "--db", str(db), "--out", str(tmp_path)]) == 0
    lines = (tmp_path / "capacitance.csv").read_text().splitlines()
    assert lines[0] == "conductor,conductor,C [F],error by panels [F],error by shape [F]"
    assert [line.split(",")[:2] for line in lines[1:]] == [["left", "left"], ["right", "left"], ["right", "right"]]
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["counts"]["panels"] == 4 * summary["counts"]["coarse_panels"] > 100


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"conductor.left.charge": 1e-12}, r"conductor.left: both given; one of potential \[V\] and, of a floating"),
        ({"conductor.left.potential": "unset"}, r"conductor.left: neither given; one of potential"),
        ({"conductor.right.position": [0.5e-3, 0.0, 0.0]}, "conductor.right: it touches or overlaps 'left' near"),
        ({"conductor.right.position": [-1.2e-3, 0.0, 0.0], "conductor.right.geometry.radius": 3e-4},
         "conductor.right: it lies within 'left', which is solid; conductors need a gap"),
        ({"half_space": {"permittivity": "conductor"}}, r"conductor.left: its lowest point is -0.00\d+ m above the"),
        ({"panels.strips": 0}, "panels.strips: 0 given; input should be greater than or equal to 1"),
        ({"permittivity": 0.5}, "permittivity: 0.5 given; input should be greater than or equal to 1"),
        ({"conductor.left.potential": float("nan")}, "conductor.left.potential: nan given"),
        ({"conductor.left.surfaces": ["lid"]}, "conductor.left.surfaces: the mesh has no surface 'lid', it has"),
        ({"conductor.left.mesh.size": "unset"}, "conductor.left.mesh.size: is missing; give an edge length"),
        ({"report.quantities": {"left.c": "two_spheres/0/C_mutual"}}, "report.quantities: 'left.c' given; the run has"),
        ({"conductor.left.geometry": {"kind": "bar", "length": 1.0, "area": 1.0, "radius": "unset"}},
         "conductor.left: geometry 'bar' has no surface; a conductor is a solid or a plane part"),
    ],
)  # fmt: skip
def test_bad_input_has_one_line(db: Path, changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        run(SPHERES, set=COARSE | changes, db=db, out=db / "bad", until="solve")
    assert "spheres.toml: " in str(caught.value)


def test_a_conductor_may_be_within_a_closed_sheet(db: Path) -> None:
    """Within a sphere of radius b, one of radius a has 4πε ab/(b − a) to it; outside nothing is left of its charge."""
    inner = {"conductor.right.geometry.radius": 5e-4, "conductor.right.mesh.size": 5e-4}
    centred = {f"conductor.{name}.position": [0.0, 0.0, 0.0] for name in ("left", "right")}
    sheet = {"conductor.left.surfaces": ["surface"], "report.quantities": "unset"}
    job = open_job(SPHERES, set=COARSE | inner | centred | sheet, db=db, out=db / "out")
    run(SPHERES, set=job.overrides, db=db, out=db / "out", until="solve")
    C = job.store.get(job.field().key, "field").capacitance
    assert C[1, 1] == pytest.approx(4 * np.pi * VACUUM * 1e-3, rel=5e-3)
    assert C[0, 1] == pytest.approx(-C[1, 1], rel=2e-3)


def test_too_many_panels_are_refused_before_they_are_computed(db: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gudgeon.pipeline.applications.electrostatics.conductors.MOST_PANELS", 100)
    with pytest.raises(InputError, match=r"panels.strips: \d+ panels in all, whose matrix has .* GB; allowed: 100"):
        run(SPHERES, set=COARSE | {"permittivity": 1.5}, db=db, out=db / "bad", until="solve")


@pytest.mark.parametrize("command", ["linear", "wear", "feel", "calibrate", "identify", "wrench", "signals"])
def test_other_commands_are_absent(command: str, db: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, str(SPHERES), "--db", str(db)]) == 2
    has = "run, status, plan, report, robustness"
    line = f"gudgeon: {SPHERES}: {command}: no such command for this scene; it has: {has}\n"
    assert capsys.readouterr().err == line


def test_the_charge_is_drawn(db: Path, tmp_path: Path) -> None:
    from PIL import Image

    report = run(SPHERES, set=COARSE, db=db, out=tmp_path)
    if not report.pictures and any("rendering crashed" in note for note in report.notes):
        pytest.skip("no GL libraries")
    picture = np.asarray(Image.open(tmp_path / "charge.png").convert("RGB")).astype(int)
    assert picture.shape == (1200, 1600, 3)
    # Both signs are there: red on the right sphere, blue on the left.
    red, blue = (picture[:, :1300, 0] - picture[:, :1300, 2] > 60), (picture[:, :1300, 2] - picture[:, :1300, 0] > 60)
    assert red.sum() > 3000 < blue.sum()
    assert np.argwhere(red)[:, 1].mean() > np.argwhere(blue)[:, 1].mean()
