"""`python -m docs.tools.basis_solids`: the estimated error of the modal basis of solids, for docs/basis.md.

Four scenes on coarse meshes with 15, 30 and 60 modes a body, each against 240. Prints rows of the table.
"""

import sys
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.integrators.curves import windowed

DATA = Path(__file__).resolve().parents[2] / "data"
COUNTS, MANY = (15, 30, 60), 240
SAMPLES = 4000
QUANTITIES = ("impulse", "force", "rebound")
COLUMN = """
component.part.geometry = { kind = "box", lx = 0.08, ly = 0.02, lz = 0.01 }
component.part.material = { E = 70e9, nu = 0.33, rho = 2700.0 }
component.part.mesh = { size = 0.006 }
component.part.interface.foot = { surface = "left", kind = "patch" }
body.part.velocity = [-1.0, 0.0, 0.0]
run.duration = 2e-4
[contact.floor]
body = "part"
interface = "foot"
against = { shape = "plane", point = [-0.0401, 0.0, 0.0], normal = [1.0, 0.0, 0.0] }
surface_stiffness = 1e13
"""
RECTANGLE = """
component.part.geometry = { kind = "rectangle", lx = 0.06, ly = 0.03, thickness = 0.005 }
component.part.material = { E = 2e9, nu = 0.3, rho = 1200.0 }
component.part.mesh = { size = 0.0025 }
component.part.interface.foot = { surface = "bottom" }
body.part = { position = [0.0, 0.01502, 0.0], velocity = [0.0, -0.5, 0.0] }
contact.floor.body = "part"
contact.floor.interface = "foot"
contact.floor.against = { shape = "plane", point = [0.0, 0.0, 0.0], normal = [0.0, 1.0, 0.0] }
run.duration = 2e-4
"""


class Scene(NamedTuple):
    """A scene of one contact of solids."""

    file: str
    """In `data`, or the text of a scene."""
    contact: str
    parts: tuple[str, ...]
    speed: float
    """Of the striking body [m/s]."""
    changes: Mapping[str, Any] = {}


SCENES = {
    "steel block on aluminium block": Scene("two-blocks/scene.toml", "faces", ("hammer", "anvil"), 1.0),
    "column on its end": Scene(COLUMN, "floor", ("part",), 1.0),
    "plane rectangle, flat": Scene(RECTANGLE, "floor", ("part",), 0.5),
    "skirt, 12 mm elements": Scene(
        "skirt/scene.toml", "bore", ("skirt",), 0.2,
        {"component.skirt.mesh.size": 0.012, "component.skirt.modes.static_count": 0},
    ),
}  # fmt: skip


def solved(scene: Scene, count: int, folder: Path, checks: bool) -> Trajectory:
    """Return the run of a scene with a number of modes of each body."""
    file = DATA / scene.file if "\n" not in scene.file else folder / "scene.toml"
    if "\n" in scene.file:
        file.write_text(scene.file)
    counts = {f"component.{part}.modes.normal_count": count for part in scene.parts}
    changes = dict(scene.changes) | counts | {"run.samples": SAMPLES, "run.checks": checks}
    job = open_job(file, set=changes, db=folder / "db", out=folder / "out")
    run_job(job, "solve")
    return job.store.get(job.trajectory().key, "trajectory")


def measured(found: Trajectory, contact: str, window: float) -> np.ndarray:
    """Return impulse [N s], windowed force [N] and rebound velocities [m/s] of a run, (3,) or (4,)."""
    edges, force = np.concatenate([[0.0], found.times]), found.contacts[contact].force
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(force, axis=0)]) * found.times[0]
    names = [f"{contact}.{name}" for name in ("rebound_velocity", "rebound_velocity_other")]
    speeds = [found.quantities[name]["value"] for name in names if name in found.quantities]
    return np.array([np.linalg.norm(sums[-1]), windowed(edges, sums, window)[0], *speeds])


def main() -> None:
    """Print the rows of the table."""
    print("| scene | modes | impulse | windowed force | rebound velocity |\n|---|---|---|---|---|")
    for name, scene in SCENES.items():
        with TemporaryDirectory() as place:
            reference = solved(scene, MANY, Path(place), checks=False)
            for count in COUNTS:
                found = solved(scene, count, Path(place), checks=True)
                window = found.quantities[f"{scene.contact}.force_window"]["value"]
                ours, true = (measured(one, scene.contact, window) for one in (found, reference))
                errors = [*np.abs(ours / true - 1)[:2], np.abs(ours - true)[2:].max() / scene.speed]
                cells = [
                    f"{error:.2%} ({found.estimates[f'basis.{one}']:.2%})"
                    for one, error in zip(QUANTITIES, errors, strict=True)
                ]
                print(f"| {name} | {count} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    sys.exit(main())
