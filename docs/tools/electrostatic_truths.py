"""`python -m docs.tools.electrostatic_truths [NAME…]`: capacitances and forces of known conductors.

Each scene of electrostatics with a reference runs on four meshes, whose triangles shrink as their strips grow in
number; the table has the error, its estimate, and the order over the mesh sizes by a fit. With `--forces` the gradient
of the co-energy on a grid of seven gaps is compared.
"""

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gudgeon.pipeline.applications.electrostatics.stages import compute_poses
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.solver.forces.fields.pose_field import PoseField
from tests.scenes import scene_path

FOLDER = scene_path("electrostatics")


class Truth(NamedTuple):
    """A scene and its meshes."""

    scene: str
    size: float
    """Edge length of the coarsest mesh [m]."""
    strips: tuple[int, ...]
    """Coarse strips; the size is in inverse proportion."""
    changes: dict[str, Any]


def gap(name: str, value: float) -> dict[str, Any]:
    """Return the position of a conductor in z."""
    return {f"conductor.{name}.position": [0.0, 0.0, value]}


def squares(row: int, value: float) -> Truth:
    """Return two squares at a gap [m], row of the reference."""
    entry = {"report.quantities": {"lower.upper.mutual_capacitance": f"table/{row}/C"}}
    return Truth("squares", 5e-4, (2, 3, 4, 5), gap("upper", value) | entry)


def discs(row: int, value: float) -> Truth:
    """Return two discs at a gap [m], row of the reference."""
    entry = {"report.quantities": {"lower.upper.mutual_capacitance": f"table/{row}/C"}}
    return Truth("scene", 6e-4, (2, 3, 4, 5), gap("upper", value - 1e-3) | entry)


def spheres(row: int, distance: float) -> Truth:
    """Return two spheres at a distance of their centres [m], row of the reference."""
    entry = {"report.quantities": {"left.right.mutual_capacitance": f"two_spheres/{row}/C_mutual"}}
    places = {
        "conductor.left.position": [-distance / 2, 0.0, 0.0],
        "conductor.right.position": [distance / 2, 0.0, 0.0],
    }
    return Truth("spheres", 8e-4, (2, 3, 4, 8), places | entry)


def over_plane(row: int, height: float) -> Truth:
    """Return a sphere over a plane, row of the reference."""
    entry = {"report.quantities": {"ball.capacitance": f"sphere_plane/{row}/C"}}
    return Truth("sphere-plane", 8e-4, (2, 3, 4, 8), gap("ball", height) | entry)


TRUTHS: dict[str, Truth] = {
    "cube": Truth("cube", 0.7, (1, 2, 3, 4), {}),
    "square plate": Truth("square-plate", 0.6, (2, 3, 4, 6), {}),
    **{f"discs, gap {value * 1e3:g} mm": discs(row, value) for row, value in enumerate((5e-5, 1e-4, 2e-4, 5e-4, 1e-3))},
    **{f"squares, gap {value * 1e3:g} mm": squares(row, value) for row, value in enumerate((1e-4, 2.5e-4, 1e-3))},
    **{f"spheres, {value * 1e3:g} mm apart": spheres(row, value) for row, value in enumerate((2.2e-3, 3e-3, 5e-3))},
    **{f"sphere at {value * 1e3:g} mm": over_plane(row, value) for row, value in enumerate((1.1e-3, 1.5e-3, 3e-3))},
}


def rows_of(truth: Truth, db: Path, out: Path) -> list[tuple[float, int, float, float]]:
    """Return mesh size, panels, relative error and its estimate on each mesh."""
    path, rows = FOLDER / f"{truth.scene}.toml", []
    names = list(open_job(path, db=db).scene.conductor)
    for strips in truth.strips:
        size = truth.size * truth.strips[0] / strips
        changes = truth.changes | {"panels.strips": strips} | {f"conductor.{name}.mesh.size": size for name in names}
        report = run(path, set=changes, db=db, out=out / truth.scene, until="solve")
        entry = next(one for one in report.quantities.values() if one["reference"] is not None)
        job = open_job(path, set=changes, db=db)
        panels = job.store.get(job.field().key, "field", only=["counts"]).counts["panels"]
        rows.append((size, panels, entry["error"], sum(report.estimates.values())))
    return rows


class Pull(NamedTuple):
    """A scene whose force is known, and the direction in which one conductor moves away."""

    scene: str
    changes: dict[str, Any]
    moved: str
    axis: str
    gap: float
    """[m]; the grid reaches 15 % of it to both sides."""
    force: str
    """Path in the reference."""


PULLS: dict[str, Pull] = {
    **{
        f"discs, gap {value * 1e3:g} mm": Pull(
            "scene", gap("upper", value - 1e-3), "upper", "z", value, f"table/{row}/force_attraction"
        )
        for row, value in enumerate((5e-5, 1e-4, 2e-4, 5e-4, 1e-3))
    },
    **{
        f"squares, gap {value * 1e3:g} mm": Pull(
            "squares", gap("upper", value), "upper", "z", value, f"table/{row}/force_attraction"
        )
        for row, value in enumerate((1e-4, 2.5e-4, 1e-3))
    },
    **{
        f"spheres, {value * 1e3:g} mm apart": Pull(
            "spheres", spheres(row, value).changes, "right", "x", value - 2e-3, f"two_spheres/{row}/force_attraction"
        )
        for row, value in enumerate((2.2e-3, 3e-3, 5e-3))
    },
}  # fmt: skip


def pull_row(pull: Pull, db: Path) -> tuple[float, float]:
    """Return the relative error of the force at the scene's own gap, and the largest estimate of a cell."""
    shares = np.array([-0.15, -0.1, -0.05, 0.0, 0.05, 0.1, 0.15])
    poses = {"moved": [pull.moved], pull.axis: {"values": (pull.gap * shares).tolist()}}
    entry = {"report.quantities": "unset"}
    path = FOLDER / f"{pull.scene}.toml"
    job = open_job(path, set=pull.changes | entry | {"poses": poses}, db=db, out=db / "pulls" / pull.scene)
    record = compute_poses(job)
    potentials = record.potentials
    force = PoseField.of(record).interaction({}, potentials).gradient[0]
    found: Any = json.loads((FOLDER / job.scene.report.reference).read_text())["expected"]
    for part in pull.force.split("/"):
        found = found[int(part)] if isinstance(found, list) else found[part]
    return -force / found - 1, float(record.cell_errors.max())


def finer(pull: Pull, size: float | None) -> Pull:
    """Return a pull on meshes of an edge length [m]; None: those of the scene."""
    if size is None:
        return pull
    names = open_job(FOLDER / f"{pull.scene}.toml").scene.conductor
    return pull._replace(changes=pull.changes | {f"conductor.{name}.mesh.size": size for name in names})


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help=f"of {', '.join(TRUTHS)}")
    parser.add_argument("--db", type=Path, default=None)
    parser.add_argument("--forces", action="store_true", help="forces from grids of seven gaps, on the scene's mesh")
    parser.add_argument(
        "--size", type=float, default=None, help="with --forces: edge length of both meshes instead [m]"
    )
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        if options.forces:
            for name in options.names or PULLS:
                error, estimate = pull_row(finer(PULLS[name], options.size), options.db or Path(folder) / "db")
                print(f"{name:24} force error {error:+.2e}  estimate of cells, of C {estimate:.1e}", flush=True)
            return
        for name in options.names or TRUTHS:
            rows = rows_of(TRUTHS[name], options.db or Path(folder) / "db", Path(folder) / "out")
            for size, panels, error, estimate in rows:
                print(f"{name:24} size {size:8.3g} m  {panels:6} panels  error {error:+.2e}  estimate {estimate:.1e}")
            sizes, errors = np.array([row[0] for row in rows]), np.abs([row[2] for row in rows])
            print(f"{name:24} order {np.polyfit(np.log(sizes), np.log(errors), 1)[0]:.2f}", flush=True)


if __name__ == "__main__":
    main()
