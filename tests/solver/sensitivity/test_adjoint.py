"""Derivatives by the pass back over the steps against differences of fourth order of runs by the same steps."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import ModalRecord, MorphRecord
from gudgeon.solver.sensitivity.adjoint import WEIGHTS, Differentiated, differentiated, prepared
from gudgeon.solver.sensitivity.readings import reader
from gudgeon.solver.system.system import System
from tests.solver.systems import block_records, block_scene, build, rigid_records, rod_records, rod_scene

Records = tuple[ModalRecord, MorphRecord]
STEPS = (1e-3, 1e-4)
"""Of differences, over the parameter: with long ones contact changes in other steps, short ones lose digits."""
GAP = 1.35e-5
"""Of bodies before their wall [m]."""
HERTZ = {"kind": "hertz", "stiffness": 1e9}
DAMPED = {"damping": {"alpha": 30.0, "beta": 2e-7}}


def scaled(name: str, at: tuple[int, ...]) -> Callable[[ModalRecord, float], ModalRecord]:
    """Return a change of an entry of a record by a share of it."""

    def change(modal: ModalRecord, share: float) -> ModalRecord:
        if name == "rows":
            ((key, item),) = modal.interfaces.items()
            rows = item.rows.copy()
            rows[at] *= 1 + share
            return replace(modal, interfaces={key: replace(item, rows=rows)})
        values = getattr(modal, name).copy()
        values[at] *= 1 + share
        if name == "residual_flexibility":
            values[at[::-1]] = values[at]
        return replace(modal, **{name: values})

    return change


MASS = rigid_records(1.0, {"tip": ([1.0, 0.0, 0.0], [1.0, 0.0, 0.0])}, axes=(0,))
OF_RECORDS = {
    "a frequency": scaled("angular_frequencies", (1,)), "the highest": scaled("angular_frequencies", (7,)),
    "a row": scaled("rows", (0, 2)), "R": scaled("residual_flexibility", (0, 0)),
}  # fmt: skip
OF_SCENES: dict[str, tuple[str, ...]] = {
    "speed": ("body", "part", "velocity"), "wall": ("contact", "wall", "against", "point"),
    "layer": ("contact", "wall", "surface_stiffness"), "law": ("contact", "wall", "law", "stiffness"),
    "spring": ("force", "spring", "stiffness"), "dashpot": ("force", "spring", "damping"),
    "damping": ("body", "part", "damping", "beta"), "gravity": ("run", "gravity"),
    "push": ("force", "push", "direction"),
}  # fmt: skip


def changed(scene: dict[str, Any], path: tuple[str, ...], share: float) -> dict[str, Any]:
    """Return a scene with the value at a path changed by a share, of a list the first one."""
    key, *rest = path
    if rest:
        return scene | {key: changed(scene[key], tuple(rest), share)}
    value = scene[key]
    if key == "point":
        return scene | {key: [value[0] + share * GAP, *value[1:]]}
    return scene | {key: [value[0] * (1 + share), *value[1:]] if isinstance(value, list) else value * (1 + share)}


def ways(records: Records, scene: dict[str, Any], folder: Path) -> dict[str, Callable[[float], System]]:
    """Return the systems with each parameter that a scene has changed by a share."""

    def by_record(name: str) -> Callable[[float], System]:
        def system(share: float) -> System:
            place = folder / f"{name} {share!r}"
            return prepared(build(place, (OF_RECORDS[name](records[0], share), records[1]), scene))

        return system

    def by_scene(name: str) -> Callable[[float], System]:
        return lambda share: prepared(build(folder, records, changed(scene, OF_SCENES[name], share)))

    def has(path: tuple[str, ...]) -> bool:
        value: Any = scene
        for key in path:
            if not isinstance(value, Mapping) or key not in value:
                return False
            value = value[key]
        return True

    own = OF_RECORDS if len(records[0].angular_frequencies) else {}
    return {n: by_record(n) for n in own} | {n: by_scene(n) for n, path in OF_SCENES.items() if has(path)}


def run(system: System, names: list[str], dt: float, count: int) -> Differentiated:
    return differentiated(system, [reader(system, name)[0] for name in names], dt, count)


def compared(
    records: Records, scene: dict[str, Any], names: list[str], dt: float, folder: Path
) -> dict[str, np.ndarray]:
    """Return derivatives less difference quotients over the largest relative derivative, by parameter, (q,)."""
    count = round(scene["run"]["duration"] / dt)
    base = run(prepared(build(folder, records, scene)), names, dt, count)
    values = np.array([reading.value for reading in base.readings])
    errors, sizes = {}, []
    for name, system in ways(records, scene, folder).items():
        have = base.slopes({k: system(k * 1e-3) for k in WEIGHTS}, 1e-3)
        best = np.full(len(names), np.inf)
        for step in STEPS:
            found = {k: [r.value for r in run(system(k * step), names, dt, count).readings] for k in WEIGHTS}
            quotient = sum(WEIGHTS[k] * np.array(v) for k, v in found.items()) / step
            best = np.minimum(best, np.abs(quotient - have))
        errors[name] = best / np.abs(values)
        sizes.append(np.abs(have / values))
    largest = np.max(sizes, axis=0)
    return {name: error / largest for name, error in errors.items()}


QUANTITIES = ["wall.impulse", "wall.impulse[0:4e-5]", "wall.force_norm", "part.energy", "part.displacement_x"]
SPRING = {"kind": "spring", "body": "part", "interface": "tip", "direction": [1.0, 0.0, 0.0], "stiffness": 2e7,
          "damping": 500.0}  # fmt: skip
PUSH = {"kind": "force", "body": "part", "at": [0.0, 0.0, 0.0], "direction": [1.0, 0.0, 0.0],
        "values": [[0.0, 0.0], [1e-4, 2e4], [1.0, 2e4]]}  # fmt: skip


def pushed(scene: dict[str, Any]) -> dict[str, Any]:
    """Return the scene of a rigid body with a force over time and gravity."""
    return scene | {"force": {"push": PUSH}, "run": scene["run"] | {"gravity": [300.0, 0.0, 0.0]}}


def held(scene: dict[str, Any]) -> dict[str, Any]:
    """Return the scene of a damped rod whose end a spring holds."""
    return scene | {"body": {"part": scene["body"]["part"] | DAMPED}, "force": {"spring": SPRING}}


def before_wall(scene: dict[str, Any]) -> dict[str, Any]:
    """Return the scene of a rod with its wall moved away by `GAP`."""
    return scene | {"contact": changed(scene["contact"], ("wall", "against", "point"), 1.0)}


@pytest.mark.parametrize(
    ("records", "scene", "dt"),
    [
        (rod_records(8), before_wall(rod_scene(2e-4, law=HERTZ)), 1e-6),
        (rod_records(8), before_wall(rod_scene(2e-4)), 1e-6),
        (rod_records(8), before_wall(rod_scene(2e-4, surface_stiffness=1e13)), 1e-6),
        (rod_records(8), before_wall(held(rod_scene(2e-4, law=HERTZ))), 1e-6),
        (rod_records(8), before_wall(held(rod_scene(2e-4, surface_stiffness=1e13))), 1e-6),
        (rod_records(8), before_wall(rod_scene(2e-4, law=HERTZ, method="penalty")), 1e-6),
        (rod_records(8), before_wall(held(rod_scene(2e-4, law=HERTZ, method="penalty"))), 1e-6),
        (MASS, before_wall(pushed(rod_scene(2e-4, law=HERTZ, method="penalty"))), 1e-6),
        (block_records(3), block_scene(1e-4, surface_stiffness=1e13), 2e-7),
        (block_records(3), block_scene(1e-4, law=HERTZ), 2e-7),
    ],
    ids=[
        "law behind R",
        "R",
        "layer",
        "damped and held",
        "damped and held on a layer",
        "law alone",
        "law alone, damped and held",
        "force and gravity",
        "three points",
        "three points on laws",
    ],
)
def test_derivatives_equal_differences(records: Records, scene: dict[str, Any], dt: float, tmp_path: Path) -> None:
    for name, errors in compared(records, scene, QUANTITIES, dt, tmp_path).items():
        assert errors.max() < 1e-6, (name, errors)
