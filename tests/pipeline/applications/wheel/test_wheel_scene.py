"""Scenes of wheels: stages, records, report and pictures of a small bladed disk; what does not fit is refused."""

import csv
import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline import kinds
from gudgeon.pipeline.applications.wheel import report as report_module
from gudgeon.pipeline.applications.wheel import response as solve
from gudgeon.pipeline.applications.wheel.comparison import FREQUENCY, MAGNIFICATION, RESPONSE, Comparison
from gudgeon.pipeline.applications.wheel.cyclic.harmonic import tuned_frequencies
from gudgeon.pipeline.applications.wheel.job import WheelJob
from gudgeon.pipeline.applications.wheel.pictures.curves import harmonic_of
from gudgeon.pipeline.applications.wheel.pictures.shape import whole_wheel
from gudgeon.pipeline.applications.wheel.report import compare, report_wheel
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.report.effort import Effort
from gudgeon.pipeline.report.page.output import report_text
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.run_report import RunReport
from gudgeon.pipeline.stages.status import status
from tests.scenes import scene_path

SECTORS, COUNT, MODES = 6, 12, 4
SMALL: dict[str, Any] = {
    "component.sector.geometry": {
        "sectors": SECTORS,
        "bore_radius": 0.1,
        "hub_radius": 0.12,
        "hub_width": 0.04,
        "web": 0.02,
    },
    "component.sector.mesh.size": 0.04,
    "wheel.disk.sectors": SECTORS,
    "wheel.disk.count": COUNT,
    "wheel.disk.mode_count": MODES,
    "wheel.disk.fixed_count": 6,
    "wheel.disk.interface": {"kept": [], "interface_count": 4},
    "wheel.disk.response": {"engine_order": 2, "band": [500.0, 640.0], "points": 401},
}
CHOICES = {
    "all": {"kept": "all"},
    "all by modes": {"kept": []},
    "none, 2": {"kept": [], "interface_count": 2},
    "none, 8": {"kept": [], "interface_count": 8},
    "rim, 2": {"kept": ["rim"], "interface_count": 2},
}
WHOLE = 1e-8
"""The issue's: tuned by cyclic symmetry equals the whole wheel."""


def job(folder: Path, **changes: Any) -> WheelJob:
    changed = SMALL | {key.replace("__", "."): value for key, value in changes.items()}
    texts = ['report.choices="unset"', *(f"{key}={toml(value)}" for key, value in changed.items())]
    opened = kinds.open_job(scene_path("bladed-disk"), set=texts, db=folder / "db", out=folder / "out")
    assert isinstance(opened, WheelJob)
    return opened


def toml(value: Any) -> str:
    """Return a value as TOML writes it."""
    if isinstance(value, dict):
        return "{" + ", ".join(f'"{key}" = {toml(one)}' for key, one in value.items()) + "}"
    return json.dumps(value)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, RunReport]:
    folder = tmp_path_factory.mktemp("wheel")
    return folder, run_job(job(folder))


def states(report: RunReport) -> dict[str, str]:
    return {name: stage.state for name, stage in report.stages.items()}


def test_second_run_does_nothing(made: tuple[Path, RunReport]) -> None:
    folder, first = made
    assert states(first) == dict.fromkeys(("mesh", "modes", "solve", "plot"), "ran")
    again = run_job(job(folder))
    assert set(states(again).values()) == {"fresh"}
    assert again.quantities == first.quantities
    assert {stage: state for stage, state, _, _ in status(job(folder))} == dict.fromkeys(states(first), "fresh")


def test_pictures_are_drawn(made: tuple[Path, RunReport]) -> None:
    folder, report = made
    assert len(report.notes) == 1
    assert report.notes[0].startswith("the estimated error of the mesh is ")
    assert {Path(name).name for name in report.pictures} == {"nodal-diameters.png", "blades.png", "wheel.png"}
    assert all((folder / "out" / name).stat().st_size > 20_000 for name in map(Path, report.pictures))


def test_other_blades_need_no_other_modes(made: tuple[Path, RunReport]) -> None:
    other = job(made[0], wheel__disk__mistuning={"deviation": 0.01, "seed": 2})
    stale = {stage: why for stage, state, _, why in status(other) if state == "stale"}
    assert stale.keys() == {"solve", "plot"}
    assert any("wheel.changes" in line for line in stale["solve"])
    assert states(run_job(other, "modes")) == {"mesh": "fresh", "modes": "fresh"}


def test_record_of_modes(made: tuple[Path, RunReport]) -> None:
    """Each harmonic has its residuals and its proof that no mode is missed; shapes have unit mass on a sector."""
    one = job(made[0])
    record = one.store.get(one.modes().key, "cyclic")
    sector = solve.sector_of(one.store.get(one.mesh().key, "mesh"), one.component, one.wheel, "disk")
    assert record.harmonics.keys() == {"0", "1", "2", "3"}
    assert record.quality["wheel_dofs"] == SECTORS * sector.own.shape[1]
    for harmonic in record.harmonics.values():
        assert harmonic.residuals.shape == harmonic.angular_frequencies.shape == (MODES,)
        assert harmonic.residuals.max() < 1e-8
        assert harmonic.quality["orthogonality"] < 1e-10
        assert harmonic.quality["found"] == harmonic.quality["expected"] >= MODES
        assert harmonic.quality["shift"] > harmonic.angular_frequencies[-1] ** 2
        assert (harmonic.imaginary is None) == (harmonic.multiplicity == 1)
        u = (harmonic.real + (0j if harmonic.imaginary is None else 1j * harmonic.imaginary)).reshape(-1, MODES)
        np.testing.assert_allclose(u.conj().T @ (sector.model.M @ u), np.eye(MODES), atol=1e-9)


def test_wheel_of_a_picture_is_the_mode_of_the_wheel(made: tuple[Path, RunReport]) -> None:
    """Common nodes are one, and Rayleigh's quotient of the assembled field is the mode's frequency."""
    from gudgeon.modaldb.records.mesh import MeshRecord
    from gudgeon.pipeline.fem.assemble import build_model

    one = job(made[0])
    record = one.store.get(one.modes().key, "cyclic")
    mesh = one.store.get(one.mesh().key, "mesh")
    harmonic = record.harmonics["2"]
    nodes, cells, field = whole_wheel(mesh, record, harmonic, 1)
    low = len(np.unique(mesh.surfaces["low"].facets))
    assert len(nodes) == SECTORS * (len(mesh.nodes) - low)
    whole = build_model(MeshRecord(nodes, cells, "tetra10", {}), one.component.material)
    u = field.ravel()
    square = float(u @ (whole.K @ u)) / float(u @ (whole.M @ u))
    np.testing.assert_allclose(square, harmonic.angular_frequencies[1] ** 2, rtol=1e-8)


def test_response_is_written(made: tuple[Path, RunReport]) -> None:
    folder, report = made
    rows = list(csv.reader((folder / "out/response.csv").open()))
    assert len(rows) == 402
    table = np.array(rows[1:], float)
    assert table.shape[1] == 2 + SECTORS
    gain = table[:, 2:].max() / table[:, 1].max()
    np.testing.assert_allclose(gain, report.quantities["magnification"]["value"], rtol=1e-6)
    assert 1 < gain < (1 + np.sqrt(SECTORS)) / 2 * 1.1


@pytest.fixture(scope="module")
def compared(made: tuple[Path, RunReport]) -> Comparison:
    return compare(job(made[0], report__choices=CHOICES), Effort(repeat=1), silent)


def silent(stage: str, share: float) -> None:
    """Tell nobody."""


def test_harmonics_equal_the_whole_wheel(compared: Comparison) -> None:
    assert compared.harmonics_against_full < WHOLE
    assert compared.rows[0].coordinates == compared.sector["wheel_dofs"]


def test_choices_of_kept_interface(compared: Comparison) -> None:
    """All kept and all by modes are one space; more columns are never worse; sizes are what was asked for."""
    rows = {row.name: row for row in compared.rows}
    face, rim = compared.sector["face_dofs"], rows["rim, 2"].kept
    assert rows["all"].kept == face
    assert rows["all"].coordinates == rows["all by modes"].coordinates == SECTORS * (face + 6)
    assert rows["none, 8"].coordinates == SECTORS * (8 + 6)
    assert rows["rim, 2"].coordinates == SECTORS * (rim + 2 + 6)
    assert rows["rim, 2"].record.counts["interface_modes"] == SECTORS * 2
    error = {name: row.errors[FREQUENCY] for name, row in rows.items()}
    np.testing.assert_allclose(error["all by modes"], error["all"], rtol=1e-4)
    assert error["all"] <= error["none, 8"] * (1 + 1e-4) <= error["none, 2"] * (1 + 2e-4)
    assert error["none, 8"] < 5e-3
    assert abs(rows["none, 8"].errors[MAGNIFICATION]) < 0.02
    np.testing.assert_allclose(rows["all by modes"].errors[RESPONSE], rows["all"].errors[RESPONSE], rtol=1e-3)


def test_errors_of_mesh_and_modes_are_stated(made: tuple[Path, RunReport]) -> None:
    """A mesh of few elements has frequencies that are too high by some percent; the table of modes has them, too."""
    estimates = made[1].estimates
    assert estimates["mesh.amplitude"] == 2 * estimates["mesh.frequency"] > 0
    assert 0 < estimates["basis.amplitude.tuned"] <= estimates["basis.amplitude.mistuned"] < 0.1
    rows = run_job(job(made[0]), "modes").frequencies
    assert all(row["estimated_error"] > 0 for rows_of in rows.values() for row in rows_of)


def test_modes_give_the_amplitude_of_a_direct_solution(compared: Comparison) -> None:
    assert 0 < compared.truncation_error < 1e-2


def test_report_is_written_and_the_full_wheel_kept(
    made: tuple[Path, RunReport], compared: Comparison, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Errors are against the full wheel, their truncation against the largest basis of the same kept dofs."""
    counts: Counter[str] = Counter()
    monkeypatch.setattr(report_module, "full_modes", lambda *_: counts.update(["full"]))
    one = job(made[0], report__choices={name: CHOICES[name] for name in ("none, 2", "none, 8", "all")})
    document = report_wheel(one, Effort(repeat=1), silent)
    assert not counts
    out = made[0] / "out"
    assert json.loads((out / "report.json").read_text()) == document.as_json()
    runs = {run.name: run for run in document.runs}
    assert [row["name"] for row in csv.DictReader((out / "report.csv").open())] == list(runs)
    assert all((out / name).stat().st_size > 20_000 for name in ("report.png", "interfaces.png", "report.html"))
    assert runs["full wheel"].kind == "nodal"
    assert runs["full wheel"].errors == {}
    few, many = runs["none, 2"], runs["none, 8"]
    rows = {row.name: row for row in compared.rows}
    assert few.errors[FREQUENCY] == pytest.approx(rows["none, 2"].errors[FREQUENCY], rel=1e-6)
    assert (few.truncation_against, many.truncation) == ("none, 8", None)
    assert few.truncation is not None
    ratio = rows["none, 2"].record.mistuned_frequencies / rows["none, 8"].record.mistuned_frequencies
    assert few.truncation[FREQUENCY] == pytest.approx((ratio - 1).max(), rel=1e-6)
    assert few.settings == {"wheel": {"disk": {"interface": {"kept": [], "interface_count": 2}}}}
    assert few.scheme == many.scheme == "none kept"
    assert few.largest_of == RESPONSE
    assert runs["all"].cpu_seconds > 0
    assert all(run.peak_mib is not None and run.peak_mib > 10 for run in document.runs)
    text = report_text(document)
    assert "| none, 2 | 0 | 12 | 48 |" in text
    assert f"| full wheel | {compared.rows[0].kept} | 0 |" in text
    (chain,) = document.quantities[0].chains
    assert (chain.runs, chain.differences[-1], chain.converges) == (["none, 2", "none, 8"], 0.0, None)


@pytest.mark.validation
def test_the_budget_has_the_basis_and_the_mesh(made: tuple[Path, RunReport]) -> None:
    """The basis against the full wheel, and the mesh by two other sectors, whose error refuses the wheel."""
    settings = {"component__sector__mesh__size": 0.022, "report__choices": {"none, 8": CHOICES["none, 8"]}}
    document = report_wheel(job(made[0], **settings), Effort(repeat=1, tolerance=0.05), silent)
    assert document.budget is not None
    terms = {one.source: one for one in document.budget.terms}
    assert list(terms) == ["basis", "step", "mesh", "spline spacing", "contact layer"]
    (run,) = [one for one in document.runs if one.name == document.budget.run]
    assert terms["basis"].errors[FREQUENCY] == abs(run.errors[FREQUENCY])
    assert terms["basis"].errors[RESPONSE] > run.errors[RESPONSE]
    assert terms["step"].size is None
    assert terms["mesh"].how.startswith("edges / 1.5 (mean edge × 0.")
    assert terms["mesh"].errors[FREQUENCY] > 0.01
    assert document.choice is not None
    assert document.choice.run is None
    assert "refine component.*.mesh.size" in document.choice.why


def test_reduced_frequencies_lie_above(made: tuple[Path, RunReport]) -> None:
    one = job(made[0])
    record = one.store.get(one.response(one.wheel.interface).key, "wheel")
    exact = tuned_frequencies(list(one.store.get(one.modes().key, "cyclic").harmonics.values()))
    count = min(len(exact), COUNT)
    assert np.all(record.tuned_frequencies[:count] >= exact[:count] * (1 - 1e-9))
    assert record.model == {"kept": [], "interface_count": 4, "fixed_count": 6}


@pytest.mark.parametrize(("order", "harmonic"), [(0, 0), (2, 2), (3, 3), (4, 2), (5, 1)])
def test_harmonic_of_an_engine_order(order: int, harmonic: int) -> None:
    assert harmonic_of(order, 6) == harmonic


BARE = ["wheel.disk.mistuning.deviation=unset", "wheel.disk.mistuning.seed=unset"]
OTHER = (
    "wheel.other={component='sector', sectors=24, mistuning={deviation=0.1}, response={engine_order=1, band=[1, 2]}}"
)
WRONG: list[tuple[list[str], str]] = [
    (["wheel.disk.component=rotor"], "wheel.disk.component: no component 'rotor'; the scene has sector"),
    (["wheel.disk.sectors=1"], "wheel.disk.sectors: 1 given; input should be greater than or equal to 2"),
    (["wheel.disk.sectors=12"], "wheel.disk.sectors: 12 given; the geometry is one of 24 sectors"),
    (["wheel.disk.low=left"], "wheel.disk.low: the geometry has no surface 'left'; it has bore, high"),
    (["wheel.disk.sector=24"], "wheel.disk.sector: unknown key; did you mean 'sectors'?"),
    (["wheel.disk.response.engine_order=24"], "engine_order: 24 given; allowed with 24 blades: 0 to 23"),
    (["wheel.disk.response.engine_order=-1"], "greater than or equal to 0"),
    (["wheel.disk.response.band=[700, 600]"], "wheel.disk.response.band: [700.0, 600.0] given; the first must be"),
    (["wheel.disk.response.loss_factor=0"], "wheel.disk.response.loss_factor: 0 given; input should be greater than 0"),
    (["wheel.disk.response.direction=[0, 0, 0]"], "[0.0, 0.0, 0.0] given, a length above zero is needed"),
    (["wheel.disk.response.surface=top"], "wheel.disk.response.surface: the geometry has no surface 'top'"),
    ([*BARE, "wheel.disk.mistuning.values=[0.01, 0.02]"], "mistuning.values: 2 given; the wheel has 24 blades"),
    (BARE, "none given; one of values, table and deviation is needed"),
    (["wheel.disk.mistuning.table=m.csv"], "table and deviation given; one of values, table and deviation is needed"),
    ([*BARE, "wheel.disk.mistuning.table=no.csv"], "wheel.disk.mistuning.table: no file 'no.csv'"),
    (["wheel.disk.mistuning={deviation=9}"], "given; the change of a blade must be above -1"),
    (["wheel.disk.interface={kept=['rims']}"], "wheel.disk.interface.kept: the geometry has no surface 'rims'"),
    (["wheel.disk.interface={kept='all', interface_count=2}"], "interface_count 2 given; kept = 'all' leaves"),
    (["report.choices.x={kept=['top']}"], "report.choices.x.kept: the geometry has no surface 'top'"),
    (["component.sector.modes.normal_count=3"], "component.sector.modes: given; a wheel reads geometry, material"),
    (["component.sector.point_mass.tip={surface='tip', mass=0.1}"], "sector.point_mass: given; a wheel reads"),
    (["component.sector.geometry.sectors=unset", "component.sector.geometry={kind='box', lx=1, ly=1, lz=1}",
      "wheel.disk.low=left", "wheel.disk.high=right",
      "wheel.disk.response.surface=top", 'report.choices="unset"'], "blade_radius: is missing; geometry 'box' has"),
    (["wheel.disk.response.loss_factor=1e-5"], "0.0056 Hz, which needs at least 44644 points"),
    (["body.disk={}"], "body: unknown key"),
    ([OTHER], "wheel: 2 given; allowed: at most 1"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "message"), WRONG, ids=[" ".join(changes) for changes, _ in WRONG])
def test_wrong_scenes(changes: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    settings = [text for change in changes for text in ("--set", change)]
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    assert main(["run", str(scene_path("bladed-disk")), *settings, *places]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert str(scene_path("bladed-disk/scene.toml")) in error
    assert not (tmp_path / "db").exists()


MISFITS: list[tuple[dict[str, Any], str]] = [
    ({"wheel__disk__blade_radius": 0.5}, "wheel.disk.blade_radius: 0.5 m given; it must separate the cells, whose"),
    ({"wheel__disk__interface": {"kept": ["tip"]}}, "wheel.disk.interface.kept: 'tip' has no free node on"),
    ({"wheel__disk__interface": {"kept": ["bore"]}}, "wheel.disk.interface.kept: 'bore' has no free node"),
    ({"wheel__disk__interface": {"kept": [], "interface_count": 999}}, "interface_count: 999 given; a face has"),
    (
        {"wheel__disk__response": {"engine_order": 1, "band": [500.0, 9000.0], "points": 40001}},
        "wheel.disk.count: 12 given; the highest",
    ),
    ({"wheel__disk__mode_count": 99999}, "wheel.disk.mode_count: 99999 given; a harmonic has"),
    ({"wheel__disk__fixed_count": 99999}, "wheel.disk.fixed_count: 99999 given, a sector has"),
    ({"wheel__disk__count": 99999}, "wheel.disk.count: 99999 given, the reduced wheel has 60 elastic coordinates"),
    ({"wheel__disk__low": "rim"}, "wheel.disk: 'rim' has"),
    ({"component__sector__supports": ["bore", "low"]}, "wheel.disk: the supports of 'low', rotated, are not"),
]


@pytest.mark.parametrize(("changes", "message"), MISFITS, ids=[message for _, message in MISFITS])
def test_misfits_of_the_mesh(changes: dict[str, Any], message: str, made: tuple[Path, RunReport]) -> None:
    with pytest.raises(InputError, match=message.replace("(", r"\(")) as caught:
        run_job(job(made[0], **changes), "solve")
    assert str(caught.value).startswith(str(scene_path("bladed-disk/scene.toml")))


def test_commands_that_a_wheel_has_not(made: tuple[Path, RunReport]) -> None:
    with pytest.raises(InputError, match="no stage 'morph'; its stages are mesh, modes, solve, plot"):
        run_job(job(made[0]), "morph")
    has = "run, status, study, plan, report, robustness$"
    for command in ("export", "linear", "calibrate", "wear", "feel"):
        with pytest.raises(InputError, match=f"toml: {command}: no such command for this scene; it has: {has}"):
            job(made[0]).kind.function(Path("scene.toml"), command)


def test_commands_print_documents(made: tuple[Path, RunReport], capsys: pytest.CaptureFixture[str]) -> None:
    folder = made[0]
    places = ["--db", str(folder / "db"), "--out", str(folder / "out"), "--json"]
    settings = [text for key, value in SMALL.items() for text in ("--set", f"{key}={toml(value)}")]
    scene = [str(scene_path("bladed-disk")), "--set", 'report.choices="unset"', *settings, *places]

    def printed(*command: str) -> Any:
        assert main(list(command)) == 0
        return json.loads(capsys.readouterr().out)

    assert {row["stage"]: row["state"] for row in printed("status", *scene)} == dict.fromkeys(made[1].stages, "fresh")
    plan = printed("plan", *scene)
    assert plan["bytes"] == sum(row["bytes"] for row in plan["terms"] if row["present"]) > 100_000
    modes = printed("modes", *scene)
    assert len(modes["frequencies"]) == SECTORS // 2 + 1
    assert all(len(rows) == MODES for rows in modes["frequencies"].values())
    run = printed("run", *scene)
    assert (run["result"], run["energy_drift"]) == ("FINISHED", None)
    assert run["quantities"]["magnification"]["value"] == made[1].quantities["magnification"]["value"]
    assert {"Wheel", "BladedSector", "Contact"} <= printed("schema")["$defs"].keys()


def test_table_of_mistuning(tmp_path: Path) -> None:
    (tmp_path / "m.csv").write_text("0.01; -0.02\n0.03, 0, 0.001 -0.5\n")
    mistuning = {"table": str(tmp_path / "m.csv")}
    one = kinds.open_job(
        scene_path("bladed-disk"),
        set=[*(f"{key}={toml(value)}" for key, value in SMALL.items()), 'wheel.disk.mistuning="unset"',
             f"wheel.disk.mistuning.table={toml(mistuning['table'])}"],
        db=tmp_path / "db",
    )  # fmt: skip
    assert one.changes == (0.01, -0.02, 0.03, 0.0, 0.001, -0.5)


def test_cases_of_runs_over_time_do_not_apply(made: tuple[Path, RunReport], tmp_path: Path) -> None:
    """A wheel has neither a run nor joints, contacts or friction."""
    chosen = "gravity,step,samples 50,duration 4,friction,field,repeated joint,rotation,turned"
    texts = [text for key, value in SMALL.items() for text in ("--set", f"{key}={toml(value)}")]
    places = ["--db", str(made[0] / "db"), "--out", str(tmp_path), "--jobs", "1"]
    code = main(["robustness", str(scene_path("bladed-disk")), *texts, *places, "--only", chosen])
    assert code == 0
    counts = json.loads((tmp_path / "robustness.json").read_text(encoding="utf-8"))["counts"]
    assert counts["wrong"] == counts["refused"] == 0
    assert counts["does not apply"] > 10
