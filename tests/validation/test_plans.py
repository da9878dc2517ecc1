"""`gudgeon plan` of every scene against `plans.toml`, and against the datasets that the solver opens.

The lists in that file were written from the physics of the scenes, not from what the program says of them.
"""

import re
import tomllib
from dataclasses import replace
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.errors import RecordMismatch
from gudgeon.modaldb.format import hdf5
from gudgeon.modaldb.format.source import FileSource
from gudgeon.modaldb.format.structure import Dataset
from gudgeon.modaldb.records.modes import GaugeModes, ModalRecord, MorphRecord
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.plan import plan
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.errors import SceneError
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.system import compile as compiled
from gudgeon.solver.system.compile import compile_system
from gudgeon.solver.system.system import System
from gudgeon.solver.system.terms.scene_terms import scene_terms
from gudgeon.solver.system.terms.term import Stock
from tests.scenes import scene_files, scene_path
from tests.solver.systems import (
    arrays,
    block_records,
    block_scene,
    driven_pair_records,
    driven_pair_scene,
    keys_of,
    pair_scene,
    part_key,
    plate_records,
    rigid_records,
    stored,
)

EXPECTED = tomllib.loads(Path(__file__).with_name("plans.toml").read_text())
PLANS = {scene: plan for plan in EXPECTED["plan"] for scene in plan["scenes"]}
FIELDS = ("electrostatics/*", "*/field.toml")
"""Scenes without bodies."""
SCENES = [name for name in scene_files() if not any(fnmatch(name, pattern) for pattern in FIELDS)]


def parsed(entry: str) -> tuple[str, tuple[str, ...]]:
    """Return a term's name, and the fields that it reads."""
    found = re.fullmatch(r"(.*?)(?: \((\w+)(?:: (\w+))?\))?", entry)
    assert found is not None
    name, template, place = found.groups()
    reads = EXPECTED["reads"][template] if template else EXPECTED["reads"].get(name, [])
    return name, tuple(field.format(place) for field in reads)


def planned(scene: str, folder: Path) -> list[dict[str, Any]]:
    job = open_job(scene_path(scene), db=folder / "db", out=folder / "out")
    return job.kind.function(job.path, "plan")(job)["terms"]


def test_every_scene_has_a_list() -> None:
    assert sorted([*PLANS, *EXPECTED["wheel"]]) == SCENES
    assert len(PLANS) == sum(len(plan["scenes"]) for plan in EXPECTED["plan"])


@pytest.mark.parametrize("scene", sorted(PLANS))
def test_present_terms_and_what_they_read(scene: str, tmp_path: Path) -> None:
    rows, expected = planned(scene, tmp_path), PLANS[scene]["body"]
    found: dict[str, dict[str, tuple[str, ...]]] = {body: {} for body in expected}
    for row in rows:
        if row["present"]:
            assert row["term"] not in found[row["body"]]
            found[row["body"]][row["term"]] = tuple(row["fields"])
    assert found == {body: dict(map(parsed, entries)) for body, entries in expected.items()}


@pytest.mark.parametrize("scene", sorted(PLANS))
def test_all_else_is_listed_as_left_out_with_a_reason(scene: str, tmp_path: Path) -> None:
    plan = PLANS[scene]
    absent: dict[str, set[str]] = {body: set() for body in plan["body"]}
    for row in planned(scene, tmp_path):
        assert row["reason"]
        if not row["present"]:
            absent[row["body"]].add(row["term"])
    for body, entries in plan["body"].items():
        present = {parsed(entry)[0] for entry in entries}
        own = {
            name.removeprefix("contact ")
            for entry in entries
            if re.search(r"\((points|meeting)", entry)
            for name in [parsed(entry)[0]]
        }
        other = {f"{what} of {name}" for what in EXPECTED["of_contact"] for name in own}
        kinds = {name.split(" ")[0].replace("bushing", "spring") for name in present}
        groups = {f"{kind}s" for kind in kinds}  # "spring spring" is one of the springs
        unused = plan.get("unused", {}).get(body, [])
        expected = ({*EXPECTED["optional"]} - groups) | other | {*EXPECTED["never"]} | {*unused}
        assert absent[body] == expected - present


@pytest.mark.parametrize("scene", sorted(EXPECTED["wheel"]))
def test_terms_of_a_wheel(scene: str, tmp_path: Path) -> None:
    expected, rows = EXPECTED["wheel"][scene], planned(scene, tmp_path)
    spectra = [f"cyclic:harmonics/{n}/angular_frequencies" for n in range(expected["harmonics"])]
    reads = expected["reads"] | {"harmonics": spectra}
    wanted = {}
    for entry in expected["present"]:
        name, _, template = entry.removesuffix(")").partition(" (")
        wanted[name] = reads.get(template, [])
    assert {row["term"]: row["fields"] for row in rows if row["present"]} == wanted
    assert sorted(row["term"] for row in rows if not row["present"]) == sorted(expected["absent"])
    assert all(row["reason"] for row in rows)


# What is read


Opened = dict[tuple[str, str], int]
"""Record and path of each dataset → its bytes, as often as it was read."""


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> Opened:
    """Note every dataset whose values are read from now on."""
    found: Opened = {}
    whole = hdf5.read_array

    def spy(source: FileSource, dataset: Dataset, path: str) -> np.ndarray:
        entry = (Path(f"/proc/self/fd/{source.descriptor}").readlink().stem, path)
        found[entry] = found.get(entry, 0) + dataset.nbytes
        return whole(source, dataset, path)

    monkeypatch.setattr(hdf5, "read_array", spy)
    return found


SMALL = {
    "a law in series with R": ("rod-mass/hertz.toml", {"component.rod.modes.normal_count": 10}),
    "gauges": ("beam-sphere/scene.toml", {"component.beam.modes.normal_count": 10}),
    "weight of a held beam": ("beam-sphere/scene.toml", {"run.gravity": [0.0, 0.0, -9.81]}),
    "weight of a free bar": ("bouncing-bar/scene.toml", {"component.bar.modes.normal_count": 10}),
    "a spring, friction and a belt": ("rigid/belt.toml", {}),
    "restitution of rigid bodies": ("two-mass/scene.toml", {}),
    "a law of rigid bodies": ("hertz/scene.toml", {}),
    "substructures": (
        "bars-longitudinal/scene.toml",
        {"component.bar.mesh.size": 0.01, "component.bar.modes.fixed_count": 5},
    ),
}


@pytest.mark.parametrize("kind", SMALL)
def test_the_solver_reads_what_the_plan_says(kind: str, tmp_path: Path, opened: Opened) -> None:
    """Dataset by dataset, and the bytes of them all."""
    scene, changes = SMALL[kind]
    job = open_job(scene_path(scene), set=changes, db=tmp_path / "db", out=tmp_path / "out")
    run_job(job, "morph")
    found, expected = plan(job), set[tuple[str, str]]()
    for row in found["terms"]:
        steps = job.components()[job.scene.component_of(row["body"])]
        if row["present"]:
            expected |= existing(job.store, {name: step.key for name, step in steps.items()}, row["fields"])
    opened.clear()
    compile_system(job.store, job.scene, {name: steps["morph"].key for name, steps in job.components().items()})
    assert set(opened) == expected
    assert sum(opened.values()) == found["bytes"]


def existing(store: Any, keys: dict[str, str], planned_fields: list[str]) -> set[tuple[str, str]]:
    """Return the datasets that some fields stand for."""
    found = set()
    for record, _, path in (field.partition(":") for field in planned_fields):
        sizes = store.sizes(keys[record])
        below = {name for name in sizes if name == path or name.startswith(f"{path}/")}
        assert below, f"{record}:{path} is planned, the record has none"
        found |= {(keys[record], name) for name in below}
    return found


Records = dict[str, tuple[ModalRecord, MorphRecord]]


def stocked() -> Records:
    """A block with all that a component can have, of which scenes need little."""
    modal, morph = block_records(4)
    rng, plate = np.random.default_rng(0), plate_records()[0]
    tractions, rows, size = {}, dict(modal.interface_rows), len(modal.residual_flexibility)
    for name, space in plate.tractions.items():
        tractions[name] = replace(space, rows=rng.standard_normal((space.size, 8)))
        rows[name], size = [size, size + space.size], size + space.size
    R = np.diag(np.full(size, 1e-9))
    R[: len(modal.residual_flexibility), : len(modal.residual_flexibility)] = modal.residual_flexibility
    gauges = {n: GaugeModes(rng.standard_normal((6, 8)), 1e-9 * rng.standard_normal((6, size)), "Pa") for n in "ab"}
    modal = replace(modal, residual_flexibility=R, interface_rows=rows)
    return {"part": (replace(modal, gauges=gauges, shapes=rng.standard_normal((5, 3, 8)), tractions=tractions), morph)}


def moving_scene() -> dict[str, Any]:
    load = {"kind": "moving", "body": "part", "interface": "top", "force": 40.0, "at": [0.01, -0.1], "speed": 50.0}
    return {"body": {"part": {}}, "force": {"load": load}, "run": {"duration": 1e-3}}


def gauged_scene() -> dict[str, Any]:
    scene = block_scene(surface_stiffness=1e14)
    scene["body"]["part"]["gauges"] = ["b"]
    return scene


FACES = {name: ([x, 0.0, 0.0], [20 * x, 0.0, 0.0]) for name, x in (("face", 0.05), ("back", -0.05))}
MADE: dict[str, tuple[Records, dict[str, Any]]] = {
    "a block of many points": (stocked(), block_scene()),
    "a layer and a gauge": (stocked(), gauged_scene()),
    "a sliding pair": ({"part": block_records(20), "plate": plate_records()}, pair_scene()),
    "a crank and gas": (driven_pair_records(6), driven_pair_scene()),
    "a moving force": ({"part": plate_records()}, moving_scene()),
    "a rigid point": (
        {"part": rigid_records(1.0, FACES, (1, 1, 1))},
        block_scene(method="penalty", law={"kind": "hertz", "stiffness": 1e9}),
    ),
}  # fmt: skip


def kept(kind: str, folder: Path) -> tuple[Any, Scene]:
    """Put the records of a made scene into a store."""
    records, scene = MADE[kind]
    return stored(folder, records), Scene.model_validate(scene)


def wanted(store: Any, scene: Scene) -> list[tuple[str, ...]]:
    """List body, record and path of what the terms of a made scene read."""
    stocks = {body: Stock.of(store.sizes(part_key(scene.component_of(body), "modes"))) for body in scene.body}
    present = [term for term in scene_terms(scene, stocks) if term.present]
    return [(term.body, *field.split(":")) for term in present for field in term.fields]


def compile_made(store: Any, scene: Scene) -> System:
    return compile_system(store, scene, keys_of(scene.component_of(body) for body in scene.body))


@pytest.mark.parametrize("kind", MADE)
def test_made_scenes_read_what_their_terms_say(kind: str, tmp_path: Path, opened: Opened) -> None:
    store, scene = kept(kind, tmp_path)
    expected = set()
    for body, record, path in wanted(store, scene):
        own = scene.component_of(body)
        expected |= existing(store, {record: part_key(own, record)}, [f"{record}:{path}"])
    opened.clear()
    compile_made(store, scene)
    assert set(opened) == expected


@pytest.mark.parametrize("kind", MADE)
def test_nothing_is_read_in_vain(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without any one field of a term the system is another one, or none; inertia counts only where a body turns."""
    store, scene = kept(kind, tmp_path)
    whole, read = list(arrays(compile_made(store, scene))), compiled.fields_read
    for missing in wanted(store, scene):
        sizes = store.sizes(part_key(scene.component_of(missing[0]), missing[1]))
        if missing[1:] in (("morph", "inertia"), ("morph", "centre")) or not sum(
            size for name, size in sizes.items() if name.startswith(missing[2])
        ):
            continue

        def without(terms: Any, body: str, record: str, missing: tuple[str, ...] = missing) -> list[str]:
            return [path for path in read(terms, body, record) if (body, record, path) != missing]

        monkeypatch.setattr(compiled, "fields_read", without)
        try:
            found = list(arrays(compile_made(store, scene)))
        except (SceneError, RecordMismatch, IndexError, KeyError, TypeError, ValueError):
            continue
        same = len(found) == len(whole) and all(map(np.array_equal, found, whole))
        assert not same, f"{missing} changes nothing"
