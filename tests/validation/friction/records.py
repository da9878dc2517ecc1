"""Static flexibility of two caps that face each other, from their records alone."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.bodies.small_motion import FlexibleBody
from tests.validation.friction.meshes import Cap, write_pair

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Pair:
    """c pairs of points of two bodies."""

    points: np.ndarray
    """Of the upper body [m], (c, 3)."""
    across: np.ndarray
    """From the lower to the upper point of each pair [m], (c, 3)."""
    areas: np.ndarray
    """[m²], (c,)."""
    W: np.ndarray
    """Relative displacement along x, y, z per force on each pair along x, y, z [m/N], (c, 3, c, 3)."""


def reference(name: str) -> Any:
    """Return an exact solution."""
    return json.loads((HERE / f"{name}.json").read_text())


def made_pair(folder: Path, name: str, cap: Cap, share: float, *, solid: bool) -> Pair:
    """Make the records of a scene on elements of a share of a, and return their flexibility."""
    write_pair(folder, name, cap, share * cap.contact, solid=solid)
    (folder / f"{name}.toml").write_text((HERE / f"{name}.toml").read_text())
    job = open_job(folder / f"{name}.toml", db=folder / "db", out=folder / "out")
    run_job(job, "morph")
    upper, lower = (body(job, side) for side in ("upper", "lower"))
    above, below = upper.morph.points["contact"], lower.morph.points["contact"]
    mirrored = below * np.where(np.arange(3) == (2 if solid else 1), -1.0, 1.0)
    order = np.linalg.norm(above[:, None] - mirrored, axis=2).argmin(axis=1)
    np.testing.assert_allclose(mirrored[order], above, atol=1e-12)
    W = flexibility(upper) + flexibility(lower)[order][:, :, order]
    return Pair(above, above - below[order], upper.modal.interfaces["contact"].areas, W)


def body(job: Job, name: str) -> FlexibleBody:
    """Return a body of a scene by its records."""
    steps = job.components()[name]
    modal, morph = (job.store.get(steps[kind].key, kind) for kind in ("modes", "morph"))
    return FlexibleBody(name, steps["morph"].key, morph, modal, morph.rigid_twists, 0.0, 0)


def flexibility(body: FlexibleBody) -> np.ndarray:
    """Return the static displacement along x, y, z per force on each contact point, by modes and R, (c, 3, c, 3)."""
    rows, frame = body.contact_rows("contact"), body.contact_frame("contact")
    count, flat = len(rows), rows.reshape(-1, rows.shape[2])
    W = flat / body.modal.angular_frequencies**2 @ flat.T + body.contact_residual("contact", "contact")
    return np.einsum("pki,pkql,qlj->piqj", frame, W.reshape(count, 3, count, 3), frame, optimize=True)
