"""Small records and systems made without gmsh or scikit-fem, for tests of the solver alone."""

from pathlib import Path
from typing import Any

import numpy as np

import modaldb
from modaldb.schema import InterfaceModes, ModalRecord, MorphRecord
from solver.scene import Scene
from solver.system import System, compile_system

LENGTH, SPEED, MASS = 1.0, 5000.0, 2.0


def rod_records(mode_count: int) -> tuple[ModalRecord, MorphRecord]:
    """A uniform free rod along x by its exact modes, contact at x = LENGTH; R from the series' tail."""
    k = np.arange(1, mode_count + 1)
    omega = np.pi * SPEED / LENGTH * k
    tip = np.sqrt(2 / MASS) * (-1.0) ** k
    total = LENGTH**2 / (3 * MASS * SPEED**2)  # static flexibility of the tip with inertia relief: L / (3 EA)
    residual = total - float((tip**2 / omega**2).sum())
    twist = np.zeros((1, 6))
    twist[0, 0] = 1 / np.sqrt(MASS)
    tip_point, normal = np.array([[LENGTH, 0.0, 0.0]]), np.array([[1.0, 0.0, 0.0]])
    centre, inertia = np.array([LENGTH / 2, 0.0, 0.0]), np.diag([0.0, 1.0, 1.0]) * MASS * LENGTH**2 / 12
    modal = ModalRecord(
        "mesh", "macneal", mode_count, 0, omega, MASS, centre, inertia, twist,
        {"tip": InterfaceModes(np.array([1]), tip_point, normal, np.array([1e-4]), np.zeros(1, bool), tip[None])},
        {"tip": [0, 1]}, np.array([[residual]]), None, None, {},
    )  # fmt: skip
    return modal, MorphRecord("mesh", "modes", "none", {"tip": tip_point}, MASS, centre, inertia, twist, None, {})


def block_records(point_count: int, seed: int = 0, mode_count: int = 8) -> tuple[ModalRecord, MorphRecord]:
    """A solid-like body with several coupled contact points facing +x, mass 2 kg, inertia 0.01 kg m²."""
    rng = np.random.default_rng(seed)
    points = np.column_stack([np.full(point_count, 0.05), rng.uniform(-0.04, 0.04, (point_count, 2))])
    normals = np.tile([1.0, 0.0, 0.0], (point_count, 1))
    omega = np.sort(rng.uniform(1e4, 8e4, mode_count))
    rows = rng.standard_normal((point_count, mode_count)) * 0.5
    root = rng.standard_normal((point_count, point_count))
    R = 1e-9 * (root @ root.T / point_count + 0.1 * np.eye(point_count))
    centre, inertia, edge = np.zeros(3), 0.01 * np.eye(3), np.arange(point_count) == 0
    twists = np.diag([1 / np.sqrt(MASS)] * 3 + [10.0] * 3)
    modal = ModalRecord(
        "mesh", "macneal", mode_count, 0, omega, MASS, centre, inertia, twists,
        {"face": InterfaceModes(np.arange(point_count), points, normals, np.full(point_count, 1e-5), edge, rows)},
        {"face": [0, point_count]}, R, None, None, {},
    )  # fmt: skip
    return modal, MorphRecord("mesh", "modes", "none", {"face": points}, MASS, centre, inertia, twists, None, {})


def build(folder: Path, records: tuple[ModalRecord, MorphRecord], scene: dict[str, Any]) -> System:
    """Store records and compile a scene against them."""
    store = modaldb.open(folder / "db")
    store.put("modes", "modes", records[0], {})
    store.put("morph", "morph", records[1], {})
    return compile_system(store, Scene.model_validate(scene), {"part": "morph"})


def rod_scene(duration: float = 6e-4, **contact: Any) -> dict[str, Any]:
    """A rod at 1 m/s against a wall that it touches already."""
    wall = {"shape": "plane", "point": [LENGTH, 0, 0], "normal": [-1, 0, 0]}
    return {
        "body": {"part": {"velocity": [1.0, 0.0, 0.0]}},
        "contact": {"wall": {"body": "part", "interface": "tip", "against": wall} | contact},
        "run": {"duration": duration},
    }


def block_scene(duration: float = 4e-4, **contact: Any) -> dict[str, Any]:
    """A block at 1 m/s, turning a little, 10 µm before a wall."""
    wall = {"shape": "plane", "point": [0.05001, 0, 0], "normal": [-1, 0, 0]}
    return {
        "body": {"part": {"velocity": [1.0, 0.0, 0.0], "angular_velocity": [0.0, 0.5, 1.0]}},
        "contact": {"wall": {"body": "part", "interface": "face", "against": wall} | contact},
        "run": {"duration": duration},
    }
