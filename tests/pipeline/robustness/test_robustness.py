"""Robustness cases of scenes: dimensions are whole, operations change what they say, scenes end to end, bad input."""

import json
import tomllib
import typing
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel, Field, create_model

from gudgeon.modaldb.records.mesh import Attachment, MeshRecord, Relation
from gudgeon.pipeline import kinds
from gudgeon.pipeline.applications.wheel.scene import WheelFile
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.geometry.shapes.beam import Beam
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.geometry.shapes.frame import Frame
from gudgeon.pipeline.robustness.cases import SHIPPED, chosen_cases, read_cases
from gudgeon.pipeline.robustness.evidence import Evidence, Refusal
from gudgeon.pipeline.robustness.operations.table import OPERATIONS
from gudgeon.pipeline.robustness.overlap import overlaps
from gudgeon.pipeline.robustness.slivers import with_slivers
from gudgeon.pipeline.robustness.subject import DoesNotApply, Subject
from gudgeon.pipeline.robustness.trial import Trial, approach, run_trial, simulated, sizes
from gudgeon.pipeline.robustness.units import (
    KEPT,
    Units,
    declared_units,
    dimension,
    rescaled,
    rescaled_mesh,
    with_motions,
)
from gudgeon.pipeline.scenes.bodies import SceneFile
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.scenes.robustness import Case, Operation, Set
from gudgeon.pipeline.stages.job import Job, variant
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver import simulate
from gudgeon.solver.joints.coupled import Driven
from gudgeon.solver.joints.markers import Cylindrical, Revolute, Translational
from gudgeon.solver.scene.body import Body
from tests.scenes import ROOT, scene_path

TWO = """
[component.a]
geometry = { kind = "rigid", mass = 2.0, points = { face = { at = [0.0, 0.0, 0.0], normal = [1.0, 0.0, 0.0] } } }
interface.face = { surface = "face" }

[component.b]
geometry = { kind = "rigid", mass = 1.0, points = { face = { at = [0.0, 0.0, 0.0], normal = [-1.0, 0.0, 0.0] } } }
interface.face = { surface = "face" }

[body.a]
velocity = [1.0, 0.0, 0.0]

[body.b]
position = [0.001, 0.0, 0.0]

[contact.pair]
body = "a"
interface = "face"
against = { shape = "body", body = "b", interface = "face" }
method = "penalty"
law = { kind = "linear", stiffness = 1e8 }

[run]
duration = 0.002
samples = 100
frames = 20
"""


OF_REPORTS = ("FullFE", "Report", "Vectors")
"""Models whose numbers no run depends on."""


def quiet(stage: str, share: float) -> None:
    """Progress that nobody sees."""


def two(folder: Path, **changes: Any) -> Job:
    """Return two masses that meet, with changes of the tables."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "two.toml").write_text(TWO)
    return kinds.open_job(folder / "two.toml", db=folder / "db", out=folder / "out", set=changes)


def subject(job: Job, folder: Path) -> Subject:
    """Return a scene that was run as it is."""
    base = run_trial(Trial(job), folder / "base", quiet)
    assert isinstance(base, Evidence)
    meshes = {n: job.store.get(steps["base-mesh"].key, "mesh") for n, steps in job.components().items()}
    return Subject(
        job, meshes, lambda trial, scratch: run_trial(trial, scratch, quiet), lambda changes: variant(job, changes),
        dict(sizes(job)), base, folder,
    )  # fmt: skip


def applied(one: Subject, **operation: Any) -> Trial:
    """Return what an operation makes of a scene."""
    case = Case.model_validate({"operation": operation, "rules": ["energy"]})
    return OPERATIONS[case.operation.kind](one, case.operation)


def models_in(annotation: Any) -> typing.Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in typing.get_args(annotation):
        yield from models_in(part)


def holds_numbers(annotation: Any) -> bool:
    return annotation is float or any(holds_numbers(part) for part in typing.get_args(annotation))


def all_models(*roots: type[BaseModel]) -> set[type[BaseModel]]:
    found, waiting = set(), list(roots)
    while waiting:
        model = waiting.pop()
        if model not in found:
            found.add(model)
            fields = ((n, f) for n, f in model.model_fields.items() if n not in KEPT)
            waiting += [one for _, field in fields for one in models_in(field.annotation)]
    return found


def undeclared(model: type[BaseModel]) -> set[str]:
    """Return the numbers and expressions of a model without a unit, and units without one of them."""
    fields = model.model_fields.items()
    numbers = {name for name, field in fields if holds_numbers(field.annotation) or name == "expression"}
    return numbers ^ set(declared_units(model))


@pytest.mark.parametrize("model", sorted(all_models(SceneFile, WheelFile), key=str), ids=str)
def test_every_number_of_a_scene_has_a_dimension(model: type[BaseModel]) -> None:
    assert undeclared(model) == set()
    for unit in declared_units(model).values():
        for one in [unit] if isinstance(unit, str) else unit:
            assert len(dimension(one, create_model("Law", exponent=(float, 1.5))())) == 3


def test_a_number_without_a_dimension_is_found() -> None:
    body = next(iter(models_in(SceneFile.model_fields["body"].annotation)))
    grown = create_model("Body", __base__=body, drag=(float, Field(default=1.0)))
    assert undeclared(grown) == {"drag"}
    with pytest.raises(StageError, match=r"Body\.drag: no unit is declared"):
        rescaled(grown(), Units(length=2.0))


def test_units_are_parsed() -> None:
    law = create_model("Law", exponent=(float, 1.5))()
    expected = {"1": (0, 0, 0), "deg": (0, 0, 0), "rev/min": (0, 0, -1), "N s/m": (1, 0, -1), "kg m^2": (1, 2, 0)}
    assert {unit: dimension(unit) for unit in expected} == expected
    assert dimension("N/m^exponent", law) == (1, -0.5, -2)


def schema_units(node: Any) -> typing.Iterator[tuple[str, Any]]:
    """Yield a property's name with its schema, for properties of numbers, wherever they stand."""
    if isinstance(node, dict):
        for name, one in node.get("properties", {}).items():
            if '"type": "number"' in json.dumps(one):
                yield name, one
        for one in node.values():
            yield from schema_units(one)


def test_the_schema_shows_the_unit_of_every_number_that_a_run_depends_on() -> None:
    definitions = {name: one for name, one in kinds.schema()["$defs"].items() if name not in OF_REPORTS}
    found = list(schema_units(definitions))
    assert len(found) > 100
    assert [name for name, one in found if '"unit": ' not in json.dumps(one)] == []


@pytest.mark.parametrize(
    ("joint", "motion", "factor"),
    [(Revolute, None, 1.0), (Translational, None, 4.0), (Cylindrical, None, 1.0), (Cylindrical, "displacement", 4.0)],
)
def test_a_drive_is_an_angle_or_a_displacement(joint: type, motion: str | None, factor: float) -> None:
    joints = {
        "guide": SimpleNamespace(slides=joint.slides, turns=joint.turns),  # type: ignore[attr-defined]
        "drive": Driven(kind="driven", joint="guide", motion=motion, values=((0.0, 0.0), (1.0, 0.5))),  # type: ignore[arg-type]
        "other": Driven(kind="driven", joint="guide", motion=motion, expression="0.5 * t"),  # type: ignore[arg-type]
    }
    told, units = with_motions(joints), Units(mass=8.0, length=4.0, time=2.0)
    assert rescaled(told["drive"], units).values == ((0.0, 0.0), (2.0, 0.5 * factor))
    moved = rescaled(told["other"], units).function("").read(np.array([2.0]))[0, 0]
    assert moved == pytest.approx(0.5 * factor, rel=1e-12)


def test_other_units_change_every_number_by_its_dimension(tmp_path: Path) -> None:
    scene = two(tmp_path).scene
    found = rescaled(scene, Units(mass=8.0, length=4.0, time=2.0))
    assert found.contact["pair"].law.stiffness == 1e8 * 8 / 4  # type: ignore[union-attr]
    assert found.body["a"].velocity == (2.0, 0.0, 0.0)
    assert found.component["a"].geometry.mass == 16.0  # type: ignore[union-attr]
    assert found.run.duration == 0.004
    hertz = scene.model_copy(
        update={"contact": two(tmp_path, **{"contact.pair.law.kind": "hertz"}).scene.contact}
    )  # N/m^1.5
    stiffer = rescaled(hertz, Units(length=4.0)).contact["pair"].law
    assert stiffer.stiffness == pytest.approx(1e8 / 2, rel=1e-15)  # type: ignore[union-attr]


def test_a_shape_without_a_dimension_is_refused() -> None:
    mesh = Box(kind="box", lx=1.0, ly=1.0, lz=1.0).build(1.0)
    surface = replace(mesh.surfaces["top"], shape={"kind": "plane", "bulge": 1.0})
    with pytest.raises(StageError, match="no unit is declared for 'bulge'"):
        rescaled_mesh(replace(mesh, surfaces={"top": surface}), Units(length=2.0))
    assert rescaled_mesh(mesh, Units(length=2.0)).nodes.max() == 2 * mesh.nodes.max()


MESHES: dict[str, tuple[Any, tuple[str, ...]]] = {
    "solid": (Box(kind="box", lx=0.1, ly=0.02, lz=0.03), ("left",)),
    "beam": (
        Beam.model_validate(
            {"kind": "beam", "theory": "euler-bernoulli", "length": 0.1, "section": {"kind": "circle", "radius": 0.01}}
        ),
        ("left",),
    ),
    "timoshenko": (
        Beam.model_validate(
            {"kind": "beam", "length": 0.1, "theory": "timoshenko", "section": {"kind": "circle", "radius": 0.01}}
        ),
        ("left",),
    ),
    "frame": (
        Frame.model_validate(
            {
                "kind": "frame", "section": {"kind": "rectangle", "width": 0.01, "height": 0.02},
                "nodes": {"a": [0, 0, 0], "b": [0.1, 0, 0], "c": [0.1, 0.07, 0]},
                "members": {"one": {"start": "a", "end": "b"}, "two": {"start": "b", "end": "c"}},
            }
        ),
        ("a",),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", MESHES)
def test_slivers_lower_frequencies_by_little(name: str) -> None:
    geometry, supports = MESHES[name]
    mesh = geometry.build(0.02)
    split = with_slivers(mesh, 20.0, 3)
    assert len(split.cells) > len(mesh.cells)
    steel = Material(E=210e9, nu=0.3, rho=7850.0)
    first, second = (_lowest(build_model(one, steel, supports, "part", geometry)) for one in (mesh, split))
    assert (second <= first * (1 + 1e-9)).all()
    np.testing.assert_allclose(second, first, rtol=0.1)
    assert _volume(split) == pytest.approx(_volume(mesh), rel=1e-12)


def test_slivers_belong_to_the_volumes_of_what_they_split() -> None:
    """Volumes have the materials of several parts, and the axes of members of a frame."""
    mesh = Box(kind="box", lx=0.1, ly=0.02, lz=0.03).build(0.02)
    middle = mesh.nodes[mesh.cells[:, :4]].mean(axis=1)
    halves = {"low": np.flatnonzero(middle[:, 0] < 0), "high": np.flatnonzero(middle[:, 0] >= 0)}
    mesh = replace(mesh, volumes=halves)
    split = with_slivers(mesh, 20.0, 5)
    assert sorted(np.concatenate([*split.volumes.values()])) == [*range(len(split.cells))]
    for name, cells in halves.items():
        own, part = replace(mesh, cells=mesh.cells[cells]), replace(split, cells=split.cells[split.volumes[name]])
        assert len(part.cells) > len(own.cells)
        assert _volume(part) == pytest.approx(_volume(own), rel=1e-12)


def _lowest(model: Any) -> np.ndarray:
    from scipy.linalg import eigvalsh

    K, M = (matrix.toarray() for matrix in model.free_matrices())
    return np.sqrt(eigvalsh(K, M, subset_by_index=[0, 3]))


def _volume(mesh: MeshRecord) -> float:
    if mesh.cell_type.startswith(("beam", "frame")):
        return float(np.linalg.norm(np.diff(mesh.nodes[mesh.cells[:, :2]], axis=1), axis=2).sum())
    a, b, c, d = np.moveaxis(mesh.nodes[mesh.cells[:, :4]], 1, 0)
    volumes = np.einsum("ei,ei->e", np.cross(b - a, c - a), d - a) / 6
    assert volumes.min() > 0
    return float(volumes.sum())


def test_operations_change_what_they_say(tmp_path: Path) -> None:
    one = subject(two(tmp_path), tmp_path)
    stiffer = applied(one, kind="contact-stiffness", factor=1e3)
    assert (stiffer.job.scene.contact["pair"].law.stiffness, stiffer.factor) == (1e11, 1e3)
    heavier = applied(one, kind="mass", factor=1e6)
    assert heavier.job.scene.component["a"].geometry.mass == 2e6
    assert heavier.job.scene.component["b"].geometry.mass == 1.0
    assert applied(one, kind="restitution", value=0.0).job.scene.contact["pair"].method == "impact"
    grazing = applied(one, kind="grazing", factor=1e-3)
    near = grazing.job.scene.body["a"]
    assert 0.001 - near.position[0] == pytest.approx(1e-6, rel=1e-9)
    left = approach(grazing.job)[1] / approach(one.job)[1]
    assert (grazing.measured, grazing.units, near.velocity[0]) == (True, Units(length=left), left)
    deep = applied(one, kind="penetration", share=1e-3)
    refused = run_trial(deep, tmp_path / "deep", quiet)
    assert isinstance(refused, Refusal)
    assert "start inside the obstacle" in refused.reason
    with pytest.raises(DoesNotApply, match="cannot turn about every axis"):
        applied(one, kind="spin", angle=1.0)
    one = subject(two(tmp_path, **{"component.a.geometry.inertia": [1e-3, 1e-3, 1.5e-3]}), tmp_path)
    refused = run_trial(applied(one, kind="spin", angle=1.0), tmp_path / "turned", quiet)
    assert isinstance(refused, Refusal)
    assert refused.reason.startswith("body 'a' turned by 0.0")
    near = run_trial(applied(one, kind="spin", angle=0.02), tmp_path / "near", quiet)
    assert isinstance(near, Evidence)
    assert near.turned == pytest.approx(0.02 / 0.05, rel=1e-6)
    changed = applied(one, kind="set", values={"run": {"gravity": [0.0, 0.0, -1.0]}})
    assert changed.job.scene.run.gravity == (0.0, 0.0, -1.0)


def test_a_shared_component_is_split_for_the_first_body(tmp_path: Path) -> None:
    back = {"at": [0.0, 0.0, 0.0], "normal": [-1.0, 0.0, 0.0]}
    shared = {f"component.a.geometry.points.l.{key}": value for key, value in back.items()}
    shared |= {"component.b": "unset", "component.a.interface.l.surface": "l"}
    shared |= {"body.b.component": "a", "contact.pair.against.interface": "l"}
    one = subject(two(tmp_path, **shared), tmp_path)
    scene = applied(one, kind="mass", factor=1e-3).job.scene
    assert scene.component[scene.component_of("a")].geometry.mass == 2e-3
    assert scene.component[scene.component_of("b")].geometry.mass == 2.0


def test_a_driven_machine_is_weighed_whole_at_its_own_pace(tmp_path: Path) -> None:
    one = subject(two(tmp_path), tmp_path)
    driven = replace(one, job=replace(one.job, scene=one.scene.model_copy(update={"joint": {"rod": "crank"}})))
    trial = applied(driven, kind="mass", factor=1e6)
    scene = trial.job.scene
    assert trial.units == Units(mass=1e6)
    assert [scene.component[name].geometry.mass for name in "ab"] == [2e6, 1e6]
    assert scene.contact["pair"].law.stiffness == 1e14
    assert scene.body["a"].velocity == (1.0, 0.0, 0.0)


def test_what_has_nothing_to_change_says_why(tmp_path: Path) -> None:
    one = subject(two(tmp_path), tmp_path)
    for kind, values, why in (
        ("poisson", {"nu": 0.49}, "Poisson's ratio affects none"),
        ("slivers", {"aspect": 1000.0}, "rigid"),
        ("collinear", {}, "static shapes"),
        ("material", {"modulus": 2.0}, "rigid"),
    ):
        with pytest.raises(DoesNotApply, match=why):
            applied(one, kind=kind, **values)
    many = replace(one, known={"points": 584, "coordinates": 66})
    with pytest.raises(DoesNotApply, match="rigid impacts of 584 points on 66 coordinates are not unique"):
        applied(many, kind="restitution", value=0.0)


def test_shipped_cases_are_sound_and_every_kind_has_an_operation() -> None:
    cases = read_cases(SHIPPED)
    assert {case.operation.kind for case in cases.values()} | {"set"} == set(OPERATIONS)
    named = {model.model_fields["kind"].annotation for model in models_in(Operation)}
    assert {kind for one in named for kind in typing.get_args(one)} == set(OPERATIONS)
    assert {name for name, case in cases.items() if case.refusal} == {
        "initial penetration", "rotation 0.02 rad", "rotation 1 rad", "nu 0.49", "nu 0.499", "nu 0.4999",
        "slivers 1:1000", "duration 4", "coarser mesh", "reuse 0.02", "friction 100",
        "step 10", "step 100", "step 1000",
    }  # fmt: skip


def test_shipped_cases_go_into_the_package() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]
    assert SHIPPED.name in settings["package-data"]["gudgeon.pipeline.robustness"]


def test_a_scene_end_to_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    two(tmp_path)
    own = tmp_path / "own.toml"
    own.write_text(
        '[case."falls"]\noperation = { kind = "set", values = { run = { gravity = [0.0, 0.0, -9.81] } } }\n'
        'rules = ["momentum", "energy"]\n'
    )
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    chosen = ["--only", "units,restitution,falls,initial penetration,step 1000", "--cases", str(own)]
    assert main(["robustness", str(tmp_path / "two.toml"), *places, *chosen]) == 0  # Eight of nine are right.
    told = capsys.readouterr().out
    document = json.loads((tmp_path / "out" / "robustness.json").read_text())
    verdicts = {row["case"]: row["verdict"] for row in document["rows"]}
    assert verdicts["initial penetration"] == "refused"
    assert {v for name, v in verdicts.items() if name != "initial penetration"} == {"right"}
    assert {row["rule"] for row in document["rows"] if row["group"] == "units"} == {"similarity"}
    assert next(row for row in document["rows"] if row["case"] == "step 1000")["substeps"] > 1
    assert "8 right, 1 refused, 0 wrong" in told
    assert (tmp_path / "out" / "robustness.png").stat().st_size > 20_000
    lines = (tmp_path / "out" / "robustness.csv").read_text().splitlines()
    assert len(lines) == 1 + len(document["rows"])


def test_what_is_wrong_makes_the_command_fail(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    two(tmp_path)
    speed = typing.get_args(typing.get_args(Body.model_fields["velocity"].annotation)[0])[1]
    monkeypatch.setitem(speed.json_schema_extra, "unit", "m")  # A wrong scale is found.
    code = main(
        ["robustness", str(tmp_path / "two.toml"), "--only", "lengths 1e3", "--db", str(tmp_path / "db"), "--out",
         str(tmp_path / "out")]
    )  # fmt: skip
    assert code == 1
    (row,) = json.loads((tmp_path / "out" / "robustness.json").read_text())["rows"]
    assert (row["verdict"], row["rule"]) == ("wrong", "similarity")


@pytest.mark.parametrize("scene", ["data/rod-wall", "two"])
def test_a_force_times_1_001_is_wrong_in_every_case(
    scene: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the record alone: all cases have the same fault, so that no comparison of two runs finds it."""
    two(tmp_path)
    path = str(tmp_path / "two.toml") if scene == "two" else str(ROOT / scene)
    made = simulate.trajectory_of

    def scaled(*arguments: Any) -> Any:
        run = made(*arguments)
        contacts = {name: replace(history, force=np.asarray(1.001 * history.force))
                    for name, history in run.contacts.items()}  # fmt: skip
        return replace(run, contacts=contacts)

    monkeypatch.setattr(simulate, "trajectory_of", scaled)
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    assert main(["robustness", path, "--only", "mm-t-s,samples 50,modulus 1e6", *places]) == 1
    rows = json.loads((tmp_path / "out" / "robustness.json").read_text())["rows"]
    wrong = {row["case"]: (row["verdict"], row["rule"]) for row in rows if row["verdict"] != "does not apply"}
    assert len(wrong) >= 2
    assert set(wrong.values()) == {("wrong", "record")}


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ('[case.a]\noperation = { kind = "mass", factor = -1.0 }\nrules = ["energy"]', "case.a.operation.factor: -1.0"),
        ('[case.a]\noperation = { kind = "mas", factor = 1.0 }\nrules = ["energy"]', "case.a.operation.kind: 'mas'"),
        ('[case.a]\noperation = { kind = "mass", factor = 2.0 }\nrules = []', "case.a.rules: [] given"),
        ('[case.a]\noperation = { kind = "mass", factor = 2.0 }\nrules = ["luck"]', "case.a.rules.0: 'luck' given"),
        ("case = 1", "case: 1 given"),
        ("case", "not valid TOML"),
    ],
)
def test_a_wrong_file_of_cases_is_one_clear_line(text: str, complaint: str, tmp_path: Path) -> None:
    path = tmp_path / "cases.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_cases(path)
    assert complaint in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_case_of_the_scene_itself(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = 'operation = { kind = "set", values = {} }\nrules = ["energy"]\n'
    two(tmp_path)
    (tmp_path / "own.toml").write_text(f'base = "two.toml"\n[robustness.case.again]\n{table}')
    job = kinds.open_job(tmp_path / "own.toml", db=tmp_path / "db", out=tmp_path / "out")
    assert isinstance(job.scene.robustness.case["again"].operation, Set)
    found = chosen_cases(job.scene.robustness, None, ("again",), job.path)
    assert list(found) == ["again"]
    with pytest.raises(InputError, match="--only nonsense: no such case or group; groups are stiffness"):
        chosen_cases(job.scene.robustness, None, ("nonsense",), job.path)
    with pytest.raises(InputError, match=r"cannot be read"):
        chosen_cases(job.scene.robustness, tmp_path / "no.toml", (), job.path)
    assert main(["robustness", str(job.path), "--set", "robustness.duration=-1", "--db", str(tmp_path / "db")]) == 2
    assert "robustness.duration: -1 given" in capsys.readouterr().err
    misspelt = table.replace("{}", "{ run = { gravty = [0.0, 0.0, 0.0] } }")
    (tmp_path / "own.toml").write_text(f'base = "two.toml"\n[robustness.case.typo]\n{misspelt}')
    assert main(["robustness", str(job.path), "--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]) == 2
    assert "case 'typo': " in (said := capsys.readouterr().err)
    assert "run.gravty: unknown key; did you mean 'gravity'" in said
    assert not (tmp_path / "out" / "robustness.json").exists()
    with pytest.raises(SystemExit, match="2"):
        main(["robustness", str(job.path), "--only", ","])


def test_slender_scenes_do_not_depend_on_units(tmp_path: Path) -> None:
    """Beams: an indefinite factor and K Φ once made frequencies, and whether modes were found, depend on the unit."""
    changes = {"component.beam.mesh.size": 0.01, "component.beam.modes.normal_count": 12, "run.duration": 3e-4}
    changes |= {"report": "unset", "run.samples": 200, "run.frames": 20}
    job = kinds.open_job(scene_path("beam-sphere"), db=tmp_path / "db", out=tmp_path / "out", set=changes)
    run_job(job, "morph")
    one = subject(job, tmp_path)
    for kind in ({"kind": "size", "factor": 1e-6}, {"kind": "units", "mass": 1e-3, "length": 1e3}):
        trial = applied(one, **kind)
        found = run_trial(trial, tmp_path / kind["kind"], quiet)
        assert isinstance(found, Evidence)
        assert trial.units is not None
        np.testing.assert_allclose(
            found.frequencies["beam"] * trial.units.time, one.base.frequencies["beam"], rtol=1e-11
        )


RUBBER = """
[component.block]
geometry = { kind = "box", lx = 0.05, ly = 0.05, lz = 0.03 }
material = { E = 12e6, nu = 0.45, rho = 1100.0 }
mesh.size = 0.015
interface.bottom = { surface = "bottom", kind = "points" }
modes = { normal_count = 12, static_count = 100000 }

[body.block]
position = [0.0, 0.0, 1e-5]
velocity = [0.0, 0.0, -0.1]
damping = { ratio = 0.1 }

[contact.floor]
body = "block"
interface = "bottom"
against = { shape = "plane", point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }
method = "constraint"

[run]
duration = 1e-3
samples = 100
frames = 100
integrator = "small"
step = 1e-6
checks = false
"""


def test_rigid_contact_overlaps_by_the_error_of_the_elastic_approach(tmp_path: Path) -> None:
    """Points of an elastic face open and close within steps, whose ends alone hold them: 2 nm of 30 µm of approach."""
    (tmp_path / "block.toml").write_text(RUBBER)
    job = kinds.open_job(tmp_path / "block.toml", db=tmp_path / "db", out=tmp_path / "out", set={})
    one = run_trial(Trial(job), tmp_path / "run", quiet)
    assert isinstance(one, Evidence), one
    assert one.penetration is not None
    assert one.penetration_bound is not None
    assert 1e-10 < one.penetration <= one.penetration_bound
    assert one.penetration_bound < 1e-7
    system, found = simulated(job, quiet)
    sunk = replace(system, gap=system.gap - 1e-7)
    depth, bound = overlaps(sunk, found)[1:]
    assert depth is not None
    assert bound is not None
    assert depth > bound, "a face that the floor holds 0.1 µm too deep"


RUBBING = """
component.part.geometry = { kind = "box", lx = 0.05, ly = 0.03, lz = 0.03 }
component.part.mesh.size = 0.01
component.part.material = { E = 70e9, nu = 0.33, rho = 2700 }
component.part.modes.normal_count = 40
component.part.interface.foot.surface = "bottom"
body.part = { position = [0, 0, 5e-5], velocity = [0.1, 0, -0.3] }
contact.floor = { body = "part", interface = "foot", surface_stiffness = 2e18, friction = { static = 0.2 }, \
against = { shape = "plane", point = [0, 0, 0], normal = [0, 0, 1] } }
run = { duration = 2.5e-4, step = 1e-7, checks = false }
""".replace("\\\n", "")


def test_friction_moves_points_by_the_residual_flexibility_as_well(tmp_path: Path) -> None:
    """Overlap of a nearly rigid layer is round-off beside what R of friction moves along the normals, 60 nm."""
    (tmp_path / "block.toml").write_text(RUBBING)
    job = kinds.open_job(tmp_path / "block.toml", db=tmp_path / "db", out=tmp_path / "out", set={})
    system, found = simulated(job, quiet)
    _, depth, bound = overlaps(system, found)
    assert depth is not None
    assert bound is not None
    assert depth < min(2e-9, bound)
    without = replace(found, contacts={"floor": replace(found.contacts["floor"], friction=None)})
    assert max(overlaps(system, without)[0] or 0.0, 0.0) > 1e-8


def test_masses_and_springs_of_a_deck_change_with_its_units() -> None:
    box = Box(kind="box", lx=1.0, ly=1.0, lz=1.0).build(1.0)
    one = np.array([0])
    mesh = replace(
        box, attachments={"node_1": Attachment(one, np.ones(3), "node", 3.0)},
        relations={"springs": Relation("spring", one, one, one, np.ones(1), np.array([7.0]))},
    )  # fmt: skip
    scaled = rescaled_mesh(mesh, Units(mass=8.0, length=4.0, time=2.0))
    attachment, relation = scaled.attachments["node_1"], scaled.relations["springs"]
    assert (attachment.mass, attachment.point[0], relation.stiffness[0]) == (24.0, 4.0, 14.0)
