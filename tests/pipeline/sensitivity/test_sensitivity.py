"""`gudgeon sensitivity` against differences of runs with recomputed modes, closed forms, and what it refuses."""

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gudgeon
from gudgeon.pipeline.design_change.morph import own_modes
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.sensitivity.analysis import with_records
from gudgeon.pipeline.sensitivity.components import component_at, meshes_beside
from gudgeon.pipeline.sensitivity.modal import groups
from gudgeon.pipeline.sensitivity.report import SensitivityReport
from gudgeon.solver.errors import SceneError
from gudgeon.solver.sensitivity.adjoint import WEIGHTS, difference, differentiated
from gudgeon.solver.sensitivity.readings import reader

DATA = Path(__file__).parents[3] / "data"
STEP = 2e-7
BLOCK: dict[str, Any] = {
    "component": {
        "block": {
            "geometry": {"kind": "box", "lx": 0.1, "ly": 0.05, "lz": 0.03},
            "material": {"E": 70e9, "nu": 0.3, "rho": 2700.0},
            "mesh": {"size": 0.03},
            "interface": {"end": {"surface": "right"}},
            "modes": {"normal_count": 6},
        }
    },
    "body": {"block": {"component": "block", "velocity": [1.0, 0.0, 0.0]}},
    "contact": {
        "wall": {
            "body": "block", "interface": "end", "surface_stiffness": 1e14,
            "against": {"shape": "plane", "point": [0.05003, 0.0, 0.0], "normal": [-1.0, 0.0, 0.0]},
        }
    },
    "run": {"duration": 8e-5, "step": STEP},
}  # fmt: skip
LINER: dict[str, Any] = BLOCK | {
    "component": {
        "block": BLOCK["component"]["block"]
        | {
            "geometry": {
                "kind": "liner", "bore_radius": 0.043, "wall": 0.006, "length": 0.1, "flange_height": 0.008,
                "flange_width": 0.005,
            },
            "mesh": {"size": 0.03}, "supports": ["flange"], "interface": {"end": {"surface": "bottom"}},
        }
    },
    "body": {"block": {"component": "block"}},
    "contact": {
        "wall": {
            "body": "block", "interface": "end", "surface_stiffness": 1e14,
            "against": {"shape": "plane", "point": [0.0, 0.0, -1e-3], "normal": [0.0, 0.0, 1.0]},
        }
    },
    "run": {"duration": 6e-5, "step": STEP},
}  # fmt: skip
QUANTITIES = ["wall.impulse[0:4.5e-5]", "wall.impulse[0:6e-5]"]
"""Before a point opens: the means of closing and opening settle to 1e-6 of a force, which differences notice."""


def recomputed(scene: dict[str, Any], key: str, share: float, tmp_path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return the derivatives of frequencies [Hz], of groups, and of quantities by differences with recomputed modes."""
    job = gudgeon.open_job(scene, db=tmp_path / "db", out=tmp_path / "out")
    name, *own = key.removeprefix("component.").split(".")
    value: Any = scene["component"][name]
    for part in own:
        value = value[part]
    step, made = share * value, job.components()[name]
    components = {k: component_at(job, name, key, value + k * step) for k in WEIGHTS}
    meshes = meshes_beside(job, name, key, job.record(name, "mesh"), components)
    omega, values = {}, {}
    of = groups(job.record(name).angular_frequencies)
    for k, component in components.items():
        record = reduce_component(meshes[k], made["mesh"].key, component, name, **job.scene.reduced_with(name))
        omega[k] = np.array([record.angular_frequencies[group].mean() for group in of]) / (2 * np.pi)
        system = with_records(job, name, (record, own_modes(made["mesh"].key, made["modes"].key, record, "none")))
        reads = [reader(system, quantity)[0] for quantity in QUANTITIES]
        run = differentiated(system, reads, STEP, round(scene["run"]["duration"] / STEP))
        values[k] = np.array([reading.value for reading in run.readings])
    return difference(omega, step), difference(values, step)


@pytest.mark.parametrize(
    ("scene", "key", "share"),
    [
        (BLOCK, "component.block.material.nu", 1e-3),
        (BLOCK, "component.block.material.E", 1e-3),
        (BLOCK, "component.block.material.rho", 1e-3),
        (BLOCK, "component.block.geometry.lz", 1e-3),
        (LINER, "component.block.geometry.wall", 1e-3),
    ],
    ids=["nu", "E", "rho", "height", "wall of a liner"],
)
def test_derivatives_equal_differences_with_recomputed_modes(
    scene: dict[str, Any], key: str, share: float, tmp_path: Path
) -> None:
    """Of frequencies to 1e-8 of the largest, of quantities to 1e-6."""
    report = gudgeon.sensitivity(scene, of=QUANTITIES, by=[key], db=tmp_path / "db", out=tmp_path / "out")
    frequencies, quantities = recomputed(scene, key, share, tmp_path)
    have = np.array([row["derivative"] for row in report.frequencies])
    np.testing.assert_allclose(have, frequencies, rtol=0, atol=1e-8 * np.abs(have).max())
    if quantities.any():
        np.testing.assert_allclose([d.slope for d in report.derivatives], quantities, rtol=1e-6)


def relative(report: SensitivityReport, quantity: str) -> list[float | None]:
    return [d.relative for d in report.derivatives if d.quantity == quantity]


HERTZ = ["body.one.velocity.0", "component.sphere.geometry.mass", "contact.pair.law.modulus", "contact.pair.law.radius"]
EXACT = {"force_norm": (1.2, 0.6, 0.4, 0.2), "force_duration": (-0.2, 0.4, -0.4, -0.2), "impulse": (1.0, 1.0, 0.0, 0.0)}


@pytest.mark.parametrize(("step", "allowed"), [("unset", 1e-5), (2e-8, 1e-6)])
def test_sphere_on_a_half_space_has_the_derivatives_of_hertz(step: Any, allowed: float, tmp_path: Path) -> None:
    """Force ∝ (m v²)^3/5 K^2/5 and duration ∝ (m/K)^2/5 v^-1/5, with K ∝ E* R^1/2; m the mass of the sphere."""
    report = gudgeon.sensitivity(
        DATA / "hertz/half-space.toml", of=[f"pair.{name}" for name in EXACT], by=HERTZ, set={"run.step": step},
        db=tmp_path / "db", out=tmp_path / "out",
    )  # fmt: skip
    for name, exact in EXACT.items():
        np.testing.assert_allclose(relative(report, f"pair.{name}"), exact, atol=allowed)


def test_a_run_whose_step_cannot_be_halved_has_the_change_from_twice_the_step_as_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gudgeon.pipeline.sensitivity.analysis.MOST_STEPS", 1)
    report = gudgeon.sensitivity(
        DATA / "hertz" / "half-space.toml", of=["pair.force_norm"], by=["body.one.velocity.0"],
        set={"run.step": "unset"}, db=tmp_path / "db", out=tmp_path / "out",
    )  # fmt: skip
    (derivative,) = report.derivatives
    assert derivative.error is not None
    assert 0 < derivative.error < 0.1 * derivative.slope


def test_bar_that_strikes_a_wall_has_the_derivatives_of_st_venant(tmp_path: Path) -> None:
    """F = A √(E ρ) v, over 2 L √(ρ/E)."""
    bar = "component.rod."
    keys = [bar + "material.E", bar + "material.rho", bar + "geometry.area", "body.rod.velocity.0"]
    coarse = {bar + "modes.normal_count": 20, bar + "mesh.size": 0.02, "run.step": 1e-8, "run.duration": 5e-4}
    report = gudgeon.sensitivity(
        DATA / "rod-wall", of=["wall.impulse", "wall.force_norm", "wall.force_duration"], by=keys,
        set=coarse | {"body.rod.position": [-1e-5, 0.0, 0.0]}, db=tmp_path / "db", out=tmp_path / "out",
    )  # fmt: skip
    np.testing.assert_allclose(relative(report, "wall.impulse"), (0.0, 1.0, 1.0, 1.0), atol=1e-5)
    np.testing.assert_allclose(relative(report, "wall.force_norm"), (0.5, 0.5, 1.0, 1.0), atol=1e-5)
    np.testing.assert_allclose(relative(report, "wall.force_duration"), (-0.5, 0.5, 0.0, 0.0), atol=1e-5)
    with (tmp_path / "out" / "sensitivity.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["parameter"] for row in rows[:4]] == keys
    assert {path.name for path in (tmp_path / "out").iterdir()} >= {"sensitivity.json", "sensitivity.png"}


@pytest.mark.parametrize(
    ("changes", "asked", "text"),
    [
        (
            {"contact.pair.method": "impact", "contact.pair.law": "unset", "contact.pair.restitution": 0.5},
            {},
            "velocities jump",
        ),
        (
            {
                "contact.pair.law": {
                    "kind": "hunt-crossley",
                    "stiffness": 1e9,
                    "restitution": 0.8,
                    "radius": "unset",
                    "modulus": "unset",
                }
            },
            {},
            "speed of approach",
        ),
        ({"run.integrator": "turning", "run.step": "unset"}, {}, "turn by any angle"),
        ({}, {"of": ["pair.peak_time"]}, "no derivative here; pair has impulse"),
        ({}, {"of": ["pear.impulse"]}, "did you mean"),
        ({}, {"of": ["pair.impulse[3e-4:1e-4]"]}, "rising times"),
        ({}, {"by": ["contact.pair.method"]}, "names no number"),
        ({}, {"by": ["run.duration"]}, "how the run is computed"),
        ({}, {"by": ["body.one.position.0"], "set_position": 0.0}, "does not start"),
    ],
)
def test_refusals_are_one_line(changes: dict[str, Any], asked: dict[str, Any], text: str, tmp_path: Path) -> None:
    position = {"body.one.position": [-0.01, 0.0, 0.0]} if "set_position" in asked else {}
    given = {"of": ["pair.impulse"], "by": ["body.one.velocity.0"]} | asked
    given.pop("set_position", None)
    with pytest.raises((InputError, SceneError)) as error:
        gudgeon.sensitivity(
            DATA / "hertz/half-space.toml", set={"run.step": 1e-7} | changes | position, db=tmp_path / "db",
            out=tmp_path / "out", **given,
        )  # fmt: skip
    assert text in str(error.value)
    assert "\n" not in str(error.value)
