"""Gauges of bodies that turn: the static answer to rotation and to forces, whatever modes the body has."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gudgeon.modaldb.format.hdf5 import read_record
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.kinds import run
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component

LENGTH, SIDE, DENSITY, RATE, MODULUS = 0.4, 0.02, 2700.0, 300.0, 7e10
MATERIAL = {"E": MODULUS, "nu": 0.0, "rho": DENSITY}
BOX = {"kind": "box", "lx": LENGTH, "ly": SIDE, "lz": SIDE}
LINE = {
    "kind": "beam", "theory": "euler-bernoulli", "length": LENGTH, "motion": "space",
    "stations": {"mid": 0.5 * LENGTH, "far": 0.75 * LENGTH},
    "section": {"kind": "rectangle", "width": SIDE, "height": SIDE},
}  # fmt: skip
ENDS = {
    "left": {"surface": "left", "kind": "tie", "tie": "rbe2"},
    "right": {"surface": "right", "kind": "tie", "tie": "rbe2"},
}
PLACES = {"mid": 0.5, "far": 0.75}
"""Of gauges, over the length."""


def part(geometry: dict[str, Any], modes: dict[str, Any], ties: str = "left right") -> dict[str, Any]:
    """Return a bar along x from its origin with gauges of the stress along it at half and three quarters."""
    solid = geometry["kind"] == "box"
    gauges: dict[str, Any] = {
        name: {"point": [(at - 0.5) * LENGTH, 0.0, SIDE], "direction": [1, 0, 0]}
        if solid
        else {"station": name, "fibre": "top"}
        for name, at in PLACES.items()
    }
    interfaces = {name: ENDS[name] for name in ties.split()}
    size = SIDE if solid else LENGTH / 40
    return {"geometry": geometry, "material": MATERIAL, "mesh": {"size": size}, "modes": modes,
            "interface": interfaces, "gauge": gauges}  # fmt: skip


STRETCH = {"reduction": "row-craig-bampton", "normal_count": 0, "fixed_count": 0}
"""Along the bar a uniform stretch alone."""


def centrifugal(at: float) -> float:
    """Return ρ ω² ((L/2)² − x²)/2, x from the middle of a free bar that turns about a transverse axis [Pa]."""
    return 0.5 * DENSITY * RATE**2 * LENGTH**2 * (0.25 - (at - 0.5) ** 2)


@pytest.mark.parametrize("reduction", [STRETCH, {"reduction": "macneal", "normal_count": 3}])
@pytest.mark.parametrize("geometry", [BOX, LINE])
def test_modes_and_what_they_lack_are_the_static_stress(geometry: dict[str, Any], reduction: dict[str, Any]) -> None:
    component = Component.model_validate(part(geometry, reduction))
    found = reduce_component(component.geometry.build(component.mesh.size), "mesh", component, "bar", turns=True)
    couplings = found.inertia_couplings
    assert couplings is not None
    assert couplings.centrifugal_compliance is not None
    C = RATE**2 * np.diag([1.0, 1.0, 0.0])
    q = np.einsum("ij,ijk->k", C, couplings.position_moments) / found.angular_frequencies**2
    for name, at in PLACES.items():
        gauge = found.gauges[name]
        read = gauge.rows[0] @ q + np.einsum("ij,ij->", C, gauge.centrifugal[0])
        assert read == pytest.approx(centrifugal(at), rel=5e-3)
    energy = 0.5 * np.einsum("ij,ijkl,kl->", C, couplings.centrifugal_compliance, C)
    # ∫ N²/(2 E A) dx, N = A ρ ω² (L²/4 − x²)/2; the bar is 5 % wide.
    exact = SIDE**2 / (2 * MODULUS) * (0.5 * DENSITY * RATE**2) ** 2 * LENGTH**5 / 30
    assert energy == pytest.approx(exact, rel=2e-2)


@pytest.mark.parametrize("axis", [[0.0, 0.0, 1.0], [0.0, 0.6, 0.8], [0.6, 0.8, 0.0]])
def test_stress_of_a_beam_by_rotation_is_exact_on_any_mesh(axis: list[float]) -> None:
    """Also at its free ends, where the mean of an element of a quarter of the beam has a quarter of the largest."""
    table = part(LINE, STRETCH)
    table["gauge"]["left"] = {"station": "left", "fibre": "top"}
    table["mesh"]["size"] = LENGTH / 4
    component = Component.model_validate(table)
    found = reduce_component(component.geometry.build(component.mesh.size), "mesh", component, "bar", turns=True)
    couplings, omega = found.inertia_couplings, RATE * np.array(axis)
    assert couplings is not None
    C = (omega @ omega) * np.eye(3) - np.outer(omega, omega)
    q = np.einsum("ij,ijk->k", C, couplings.position_moments) / found.angular_frequencies**2
    for name, at in (PLACES | {"left": 0.0}).items():
        gauge = found.gauges[name]
        read = gauge.rows[0] @ q + np.einsum("ij,ij->", C, gauge.centrifugal[0])
        assert read == pytest.approx(C[0, 0] / RATE**2 * centrifugal(at), rel=1e-9, abs=1e-3)


def solved(scene: dict[str, Any], tmp_path: Path) -> tuple[Trajectory, list[str]]:
    """Return the record of a run, and its notes."""
    path = tmp_path / "bar.toml"
    path.write_text("")
    done = run(
        path,
        set={key: table for key, table in scene.items() if table},
        db=tmp_path / "db",
        out=tmp_path / "out",
        until="solve",
    )
    return read_record(tmp_path / "out/trajectory.h5", "trajectory"), done.notes


def settled(found: Trajectory, gauge: str) -> float:
    """Return the mean of a gauge over the last tenth of a run."""
    read = found.gauges[f"bar.{gauge}"]
    return float(read[-len(read) // 10 :].mean())


@pytest.mark.parametrize("orientation", [None, {"axis": [1.0, 2.0, -1.0], "angle": 63.0}])
def test_a_free_bar_that_turns_has_its_centrifugal_stress(orientation: dict[str, Any] | None, tmp_path: Path) -> None:
    """Modes with one end held have 63 % of it at the middle; that is said of displacements."""
    spin = np.array([0.0, 0.0, RATE])
    body: dict[str, Any] = {"damping": {"ratio": 0.5}, "gauges": ["mid", "far"]}
    if orientation is not None:
        axis = np.array(orientation["axis"])
        turn = Rotation.from_rotvec(np.radians(orientation["angle"]) * axis / np.linalg.norm(axis))
        spin, body["orientation"] = turn.apply(spin), orientation
    found, notes = solved(
        {"component": {"bar": part(BOX, {"reduction": "row-craig-bampton", "normal_count": 0}, "left")},
         "body": {"bar": body | {"angular_velocity": spin.tolist()}}, "run": {"duration": 5e-3, "frames": 4}},
        tmp_path,
    )  # fmt: skip
    for name, at in PLACES.items():
        assert settled(found, name) == pytest.approx(centrifugal(at), rel=5e-3)
    assert any("that its rotation would cause" in note for note in notes)


def test_a_uniform_stretch_lacks_a_sixth_of_the_energy(tmp_path: Path) -> None:
    """(∫ N dx)²/L over ∫ N² dx is 5/6 of N = 1 − s², which a uniform stretch has; 40 elements lack 5.2e-4."""
    found, notes = solved(
        {"component": {"bar": part(LINE, STRETCH)},
         "body": {"bar": {"angular_velocity": [0.0, 0.0, RATE], "damping": {"ratio": 0.5}}},
         "run": {"duration": 2e-3, "frames": 4}},
        tmp_path,
    )  # fmt: skip
    assert found.quantities["bar.inertia_truncation"]["value"] == pytest.approx(1 - 5 / 6 / (1 - 5.2e-4), rel=1e-4)
    note = "body.bar: its modes do not represent 0.17 of the strain energy that its rotation would cause"
    assert any(one.startswith(note) and one.endswith("component.bar.modes.fixed_count") for one in notes)


PULL = 2000.0
"""Force at the right end of a free bar, so that N = F x/L [N]."""
WEIGHT = {"gravity": [40.0, 0.0, 0.0]}
HANGING = {"stiffness": 1e7, "damping": 2e3, "against_at": [-0.1, 0.0, 0.0], "length": 0.1}
HELD = {"stiffness": [1e7] * 3, "damping": [2e3] * 3, "rotational_stiffness": [1e3] * 3}
ACTING: dict[str, tuple[dict[str, Any], Any]] = {
    "rotation about a joint": (
        {"joint": {"root": {"kind": "revolute", "body": "bar", "interface": "left", "axis": [0, 0, 1]}},
         "body": {"angular_velocity": [0.0, 0.0, RATE]}},
        lambda at: 0.5 * DENSITY * RATE**2 * LENGTH**2 * (1 - at**2),
    ),
    "wrench": (
        {"force": {"pull": {"kind": "wrench", "body": "bar", "interface": "right", "force": [PULL, 0.0, 0.0]}}},
        lambda at: PULL * at / SIDE**2,
    ),
    "spring": (
        {"force": {"rope": {"kind": "spring", "body": "bar", "interface": "left"} | HANGING}, "run": WEIGHT},
        lambda at: DENSITY * 40.0 * LENGTH * (1 - at),
    ),
    "bushing": (
        {"force": {"mount": {"kind": "bushing", "body": "bar", "interface": "left"} | HELD}, "run": WEIGHT},
        lambda at: DENSITY * 40.0 * LENGTH * (1 - at),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", list(ACTING))
def test_what_acts_at_interfaces_has_its_static_stress(name: str, tmp_path: Path) -> None:
    """The bar has a uniform stretch alone, whose stress is the mean along it."""
    given, exact = ACTING[name]
    found, _ = solved(
        {"component": {"bar": part(LINE, STRETCH)}, "joint": given.get("joint", {}), "force": given.get("force", {}),
         "body": {"bar": {"damping": {"ratio": 0.5}, "gauges": ["mid", "far"]} | given.get("body", {})},
         "run": {"duration": 5e-3, "frames": 4, "integrator": "turning"} | given.get("run", {})},
        tmp_path,
    )  # fmt: skip
    for gauge, at in PLACES.items():
        assert settled(found, gauge) == pytest.approx(exact(at), rel=5e-3)
