"""Scenes of friction on elastic parts, stepped from their files."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.pipeline.kinds import open_job, simulation
from gudgeon.solver.simulation import Steps
from tests.validation.friction.meshes import MIRRORED, Cap, Lower, write_pair

HERE = Path(__file__).parent
SLIPS = 1e-6
"""Share of the largest friction by which the friction of a point that sticks is below it, at least."""


def reference(name: str) -> Any:
    """Return an exact solution."""
    return json.loads((HERE / f"{name}.json").read_text())


@dataclass(frozen=True)
class Touch:
    """The forces at c points of a contact."""

    normal: np.ndarray
    """[N], (c,)."""
    friction: np.ndarray
    """[N], (c, 3)."""
    slide: np.ndarray
    """Displacement along both tangents [m], (c, 2)."""
    stuck: np.ndarray
    """Whether each is closed and sticks, (c,)."""


@dataclass(frozen=True)
class Pair:
    """Two caps at time zero."""

    steps: Steps
    points: np.ndarray
    """Of the upper body [m], (c, 3)."""
    areas: np.ndarray
    """[m²], (c,)."""


def touch(steps: Steps, contact: str, mu: float) -> Touch:
    """Return the present forces of a contact with a coefficient of friction."""
    found, table = steps.port(f"contact.{contact}"), steps._run.ports
    directions = table.blocks[0].directions
    assert directions is not None
    forces, across = found.force.reshape(-1, 3), directions.reshape(-1, 3, 3)[:, 1:]
    size = np.hypot(forces[:, 1], forces[:, 2])
    return Touch(
        forces[:, 0], np.einsum("cd,cdi->ci", forces[:, 1:], across), found.displacement.reshape(-1, 3)[:, 1:],
        (forces[:, 0] > 0) & (size < (1 - SLIPS) * mu * forces[:, 0]),
    )  # fmt: skip


def made_pair(
    folder: Path, name: str, cap: Cap, share: float, *, solid: bool, lower: Lower = MIRRORED, **sets: Any
) -> Pair:
    """Make the records of two caps on elements of a share of a, and start their scene."""
    write_pair(folder, name, cap, share * cap.contact, solid=solid, lower=lower)
    (folder / f"{name}.toml").write_text((HERE / f"{name}.toml").read_text())
    changed = {key.replace("__", "."): value for key, value in sets.items()}
    job = open_job(folder / f"{name}.toml", set=changed, db=folder / "db", out=folder / "out")
    steps = simulation(job)
    record = job.store.get(job.components()["upper"]["modes"].key, "modes")
    return Pair(steps, steps.system.bodies["upper"].morph.points["contact"], record.interfaces["contact"].areas)
