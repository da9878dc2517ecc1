"""A contact law on a face acts once: its points share it, so that the force is that of a rigid block.

A cube of m = 0.0628 kg that strikes at v is as stiff as a rigid body beside these laws. By energy the largest force is
F = K d^n with K d^(n+1)/(n+1) = m v²/2, whatever the mesh.
"""

from math import sqrt
from pathlib import Path
from typing import Any

import pytest

import gudgeon

EDGE, SPEED = 0.02, 0.1
MASS = 7850.0 * EDGE**3
STIFFNESS = {"hertz": 1e9, "linear": 1e6}
FLOOR = {"shape": "plane", "point": [0.0, 0.0, 0.0], "normal": [0.0, 0.0, 1.0]}


def cube(size: float) -> dict[str, Any]:
    faces = {"foot": {"surface": "bottom"}, "head": {"surface": "top"}}
    return {
        "geometry": {"kind": "box", "lx": EDGE, "ly": EDGE, "lz": EDGE}, "mesh": {"size": size},
        "material": {"E": 210e9, "nu": 0.3, "rho": 7850.0}, "interface": faces,
    }  # fmt: skip


def largest_force(kind: str, mass: float) -> float:
    if kind == "linear":
        return SPEED * sqrt(STIFFNESS[kind] * mass)
    depth = (1.25 * mass * SPEED**2 / STIFFNESS[kind]) ** 0.4
    return float(STIFFNESS[kind] * depth**1.5)


def force(
    folder: Path, components: dict[str, Any], bodies: dict[str, Any], contact: dict[str, Any], **run: Any
) -> float:
    scene = {
        "component": components, "body": bodies, "contact": {"touch": contact},
        "run": {"duration": 1.5e-3, "window": 1e-5, "checks": False, **run},
    }  # fmt: skip
    done = gudgeon.run(scene, db=folder / "db", out=folder / "out", until="solve")
    return float(done.quantities["touch.force_peak_raw"]["value"])


@pytest.mark.parametrize("integrator", ["auto", "turning"])
@pytest.mark.parametrize("kind", STIFFNESS)
@pytest.mark.parametrize("size", [0.02, 0.006])
def test_the_force_does_not_follow_the_mesh(tmp_path: Path, size: float, kind: str, integrator: str) -> None:
    contact = {
        "body": "part", "interface": "foot", "against": FLOOR, "method": "penalty",
        "law": {"kind": kind, "stiffness": STIFFNESS[kind]},
    }  # fmt: skip
    body = {"position": [0.0, 0.0, 1e-6], "velocity": [0.0, 0.0, -SPEED]}
    found = force(tmp_path, {"part": cube(size)}, {"part": body}, contact, integrator=integrator)
    assert found == pytest.approx(largest_force(kind, MASS), rel=3e-3)


@pytest.mark.parametrize("sizes", [(0.02, 0.006), (0.006, 0.02)])
def test_between_two_bodies_of_unlike_meshes(tmp_path: Path, sizes: tuple[float, float]) -> None:
    contact = {
        "body": "above", "interface": "foot", "against": {"shape": "body", "body": "below", "interface": "head"},
        "method": "penalty", "law": {"kind": "hertz", "stiffness": STIFFNESS["hertz"]},
    }  # fmt: skip
    bodies = {
        "above": {"component": "fine", "position": [0.0, 0.0, EDGE + 1e-6], "velocity": [0.0, 0.0, -SPEED]},
        "below": {"component": "coarse", "position": [0.0, 0.0, 0.0]},
    }
    components = {"fine": cube(sizes[0]), "coarse": cube(sizes[1])}
    found = force(tmp_path, components, bodies, contact)
    assert found == pytest.approx(largest_force("hertz", MASS / 2), rel=3e-3)


@pytest.mark.parametrize("size", [0.02, 0.006])
def test_a_dashpot_of_a_face_damps_once(tmp_path: Path, size: float) -> None:
    """At the first touch the dashpot gives c v; with K d + c ḋ of ratio ζ the force never passes what is above it."""
    damping = sqrt(STIFFNESS["linear"] * MASS)
    contact = {
        "body": "part", "interface": "foot", "against": FLOOR, "method": "penalty",
        "law": {"kind": "linear", "stiffness": STIFFNESS["linear"], "damping": damping},
    }  # fmt: skip
    body = {"position": [0.0, 0.0, 1e-6], "velocity": [0.0, 0.0, -SPEED]}
    found = force(tmp_path, {"part": cube(size)}, {"part": body}, contact)
    assert found == pytest.approx(damping * SPEED, rel=0.02)
