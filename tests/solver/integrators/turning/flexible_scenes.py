"""A body that deforms, made of point masses without a mesh: every tensor of its floating frame is a sum over them."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.modaldb.records.modes import InertiaCouplings, LoadModes, ModalRecord, MorphRecord
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.system import System
from tests.solver.systems import build_all, rigid_records

LEVI = np.zeros((3, 3, 3))
for _a, _b, _c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    LEVI[_a, _b, _c], LEVI[_a, _c, _b] = 1.0, -1.0
MASSES = 9
WIDE = {"deflection": 10.0}
"""Limits of runs of arbitrary shapes: what is tested of them holds at any deflection."""


def cloud(frequencies: np.ndarray, *, seed: int = 0, free: bool = False) -> tuple[ModalRecord, MorphRecord]:
    """Return records of point masses whose m shapes are orthonormal, and `free` of rigid motion or not.

    It has a tie `pin`, and stiffness by stress of arbitrary symmetric matrices: conservation holds for any.
    """
    m, rng = len(frequencies), np.random.default_rng(seed)
    masses = rng.uniform(0.05, 0.2, MASSES)
    places = rng.uniform(-0.1, 0.1, (MASSES, 3)) * [1.0, 0.6, 0.3]
    places -= masses @ places / masses.sum()
    weight = np.sqrt(np.repeat(masses, 3))[:, None]
    guess = weight * rng.standard_normal((3 * MASSES, m))
    if free:
        turns = np.einsum("iak,pk->pia", LEVI, places).reshape(3 * MASSES, 3)
        rigid = np.linalg.qr(weight * np.hstack([np.tile(np.eye(3), (MASSES, 1)), turns]))[0]
        guess -= rigid @ (rigid.T @ guess)
    shapes = (np.linalg.qr(guess)[0] / weight).reshape(MASSES, 3, m)
    J = (masses[:, None] * places).T @ places
    inertia = np.trace(J) * np.eye(3) - J
    S = np.einsum("p,pi,pjk->ijk", masses, places, shapes)
    G = np.einsum("p,pik,pjl->ijkl", masses, shapes, shapes)
    K = 0.2 * rng.standard_normal((3, 3, m + 3, m + 3))
    K = K + K.transpose(1, 0, 2, 3)
    K = K + K.transpose(0, 1, 3, 2)
    pin = 0.3 * rng.standard_normal((6, m + 3, m + 3))
    load = LoadModes(
        np.vstack([shapes[0], rng.standard_normal((3, m))]), np.zeros((6, 6)), places[0], "N, N m",
        pin + pin.transpose(0, 2, 1),
    )  # fmt: skip
    couplings = InertiaCouplings(
        np.einsum("p,pik->ik", masses, shapes), np.einsum("abc,bck->ak", LEVI, S),
        np.einsum("abc,bckl->akl", LEVI, G), S, G, K,
    )  # fmt: skip
    modal, morph = rigid_records(float(masses.sum()), {}, (1.0, 1.0, 1.0))
    values, axes = np.linalg.eigh(inertia)
    twists = np.zeros((6, 6))
    twists[:3, :3], twists[3:, 3:] = np.eye(3) / np.sqrt(masses.sum()), (axes / np.sqrt(values)).T
    own: dict[str, Any] = {"inertia": inertia, "rigid_twists": twists, "centre": np.zeros(3)}
    modal = replace(
        modal, reduction="macneal", normal_count=m, angular_frequencies=np.asarray(frequencies, float),
        inertia_couplings=couplings, loads={"pin": load}, interface_rows={"pin": [0, 6]}, **own,
    )  # fmt: skip
    return modal, replace(morph, **own)


def cloud_system(
    folder: Path, frequencies: np.ndarray, body: dict[str, Any], *, free: bool = False, **tables: Any
) -> System:
    """Return a compiled scene of one such body, `part`."""
    run = {"integrator": "turning", "checks": False, "samples": 40, "frames": 2, "limits": WIDE, "start": "undeformed"}
    run |= tables.pop("run", {})
    scene = {"body": {"part": body}, "joint": {}, "run": run} | tables
    own = folder / f"{len(frequencies)}-{frequencies.sum():.6g}"
    return build_all(own, {"part": cloud(frequencies, free=free)}, scene)


def cloud_run(folder: Path, frequencies: np.ndarray, body: dict[str, Any], **tables: Any):  # type: ignore[no-untyped-def]
    """Return the finished run of such a scene."""
    found = simulate(cloud_system(folder, frequencies, body, **tables))
    assert found.result == "FINISHED", found.counts
    return found
