"""Hertz: two elastic spheres, or cylinders, whose meshes do not match, pressed together; without a law."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import linalg, optimize

from gudgeon.pipeline.geometry.occ import meshing
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.system.compile import compile_system
from gudgeon.solver.system.system import System

RADIUS, REACH = 0.01, 1e-3
"""Of the spheres, and of the part of them that may touch [m]."""
MODULUS = 210e9 / (2 * (1 - 0.3**2))
"""E*: of both [Pa]."""
SCENE = """
[component.upper]
geometry = { kind = "file", path = "upper.msh", unit = 1.0 }
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
interface.face = { surface = "cap" }
modes = { normal_count = 10 }

[component.lower]
geometry = { kind = "file", path = "lower.msh", unit = 1.0 }
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
interface.face = { surface = "cap" }
modes = { normal_count = 10 }

[body.upper]
position = [0.0, 0.0, 0.02]

[body.lower]

[contact.faces]
body = "upper"
interface = "face"
against = { shape = "surface", body = "lower", interface = "face" }

[run]
duration = 1e-5
"""


def sphere(path: Path, size: float, side: float) -> None:
    """Write a sphere whose elements have a size at one of its poles [m], with the surface `cap` around it."""
    with meshing(3.5e-3, {}) as gmsh:
        occ, depth = gmsh.model.occ, REACH**2 / 2 / RADIUS
        ball = occ.addSphere(0, 0, 0, RADIUS)
        disc = occ.addDisk(0, 0, side * (RADIUS - depth), 1.2 * RADIUS, 1.2 * RADIUS)
        occ.fragment([(3, ball)], [(2, disc)])
        pole = occ.addPoint(0, 0, side * RADIUS)
        occ.synchronize()
        volumes = gmsh.model.getEntities(3)
        border = [tag for _, tag in gmsh.model.getBoundary(volumes, combined=True, oriented=False)]
        cap = [tag for tag in border if side * occ.getCenterOfMass(2, tag)[2] > RADIUS - depth]
        assert len(cap) == 1
        gmsh.model.removeEntities([(2, tag) for _, tag in gmsh.model.getEntities(2)
                                   if not len(gmsh.model.getAdjacencies(2, tag)[0])])  # fmt: skip
        gmsh.model.addPhysicalGroup(3, [tag for _, tag in volumes], name="body")
        gmsh.model.addPhysicalGroup(2, cap, name="cap")
        sized(gmsh, pole, (size, 3.5e-3), (REACH, 1.2 * RADIUS))
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        gmsh.write(str(path))


def sized(gmsh: Any, point: int, sizes: tuple[float, float], distances: tuple[float, float]) -> None:
    """Set element sizes at a distance from a point, and those at another one [m]."""
    field = gmsh.model.mesh.field
    away, growing = field.add("Distance"), field.add("Threshold")
    field.setNumbers(away, "PointsList", [point])
    values = zip(("SizeMin", "SizeMax", "DistMin", "DistMax"), (*sizes, *distances), strict=True)
    for key, value in (("InField", away), *values):
        field.setNumber(growing, key, value)
    field.setAsBackgroundMesh(growing)
    for key in ("SizeExtendFromBoundary", "SizeFromPoints", "SizeFromCurvature", "SizeMin"):
        gmsh.option.setNumber(f"Mesh.Mesh{key}", 0)


def pressed(system: System, approach: float) -> tuple[np.ndarray, np.ndarray]:
    """Return which points may touch when bodies approach [m] without acceleration, and their forces [N]."""
    elastic, near = system.stiffness > 0, np.flatnonzero(system.gap < approach)
    rows = system.rows.among(near, np.flatnonzero(elastic))
    compliance = rows / system.stiffness[elastic] @ rows.T + system.residual.among(near, near)
    factor = linalg.cholesky(compliance, lower=True)
    lacking = linalg.solve_triangular(factor, approach - system.gap[near], lower=True)
    return near, optimize.nnls(factor.T, lacking)[0]


def test_spheres_have_the_radius_and_pressure_of_hertz(tmp_path: Path) -> None:
    """Radius of contact and largest pressure within 3 % at three elements a radius and more."""
    sphere(tmp_path / "upper.msh", 2.0e-4, -1.0)
    sphere(tmp_path / "lower.msh", 2.6e-4, 1.0)
    (tmp_path / "scene.toml").write_text(SCENE)
    job = open_job(tmp_path, db=tmp_path / "db", out=tmp_path / "out")
    run_job(job, "morph")
    system = compile_system(job.store, job.scene, job.morphs())
    face = job.record("upper").interfaces["face"]
    aside = np.hypot(*face.points[:, :2].T)
    for approach in (4e-5, 5.5e-5, 7e-5):
        near, forces = pressed(system, approach)
        force = forces.sum()
        radius = (3 * force * RADIUS / 2 / 4 / MODULUS) ** (1 / 3)
        pressure = 3 * force / (2 * np.pi * radius**2)
        found = np.sqrt(2.5 * (forces @ aside[near] ** 2) / force)
        assert found == pytest.approx(radius, rel=0.03)
        inside = aside[near] < 0.7 * radius
        share = face.areas[near][inside] @ np.sqrt(1 - (aside[near][inside] / radius) ** 2)
        assert forces[inside].sum() / share == pytest.approx(pressure, rel=0.03)


WIDTH, CURVATURE = 6e-4, 0.05
"""Half of the edge that may touch, and radius of the cylinders of K1 [m]."""
PLANE = """
[component.{name}]
geometry = {{ kind = "plane-file", path = "{name}.msh", unit = 1.0, thickness = 0.01, state = "plane-strain" }}
material = {{ E = 210e9, nu = 0.3, rho = 7850.0 }}
interface.face = {{ surface = "cap" }}
modes = {{ normal_count = 10 }}

[body.{name}]
position = [0.0, {place}, 0.0]
"""
MEETING = """
[contact.faces]
body = "upper"
interface = "face"
against = { shape = "body", body = "lower", interface = "face" }

[run]
duration = 1e-5
"""


def half_plane(path: Path, size: float, side: float, radius: float | None) -> None:
    """Write half of a disc of a radius [m], or a block, whose elements have a size at the middle of its edge `cap`."""
    with meshing(8e-3, {}) as gmsh:
        occ = gmsh.model.occ
        if radius is None:
            across = (-0.05, 0.05, 0.05, WIDTH, 0.0, -WIDTH, -0.05)
            points = [occ.addPoint(x, -side * 0.05 * (n < 2), 0) for n, x in enumerate(across)]
            lines = [occ.addLine(one, points[(n + 1) % 7]) for n, one in enumerate(points)]
            middle, cap = points[4], lines[3:5]
        else:
            turn = WIDTH / radius
            angles = (-np.pi / 2, -turn, 0.0, turn, np.pi / 2)
            points = [occ.addPoint(radius * np.sin(t), side * radius * np.cos(t), 0) for t in angles]
            centre = occ.addPoint(0, 0, 0)
            lines = [occ.addCircleArc(points[n], centre, points[n + 1]) for n in range(4)]
            middle, cap = points[2], lines[1:3]
            lines = [*lines, occ.addLine(points[4], points[0])]
        face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
        occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [face], name="body")
        gmsh.model.addPhysicalGroup(1, cap, name="cap")
        sized(gmsh, middle, (size, 8e-3), (1.2 * WIDTH, 0.05))
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.setOrder(2)
        gmsh.write(str(path))


@pytest.mark.parametrize("flat", [False, True], ids=["cylinder", "flat"])
def test_cylinders_have_the_half_width_and_pressure_of_hertz(tmp_path: Path, *, flat: bool) -> None:
    """K1, both parts elastic: half width and largest pressure within 1 %, from three elements in the half width."""
    half_plane(tmp_path / "upper.msh", 2e-5, -1.0, CURVATURE)
    half_plane(tmp_path / "lower.msh", 2.7e-5, 1.0, None if flat else CURVATURE)
    height = CURVATURE if flat else 2 * CURVATURE
    parts = PLANE.format(name="upper", place=height) + PLANE.format(name="lower", place=0.0)
    (tmp_path / "scene.toml").write_text(parts + MEETING)
    job = open_job(tmp_path, db=tmp_path / "db", out=tmp_path / "out")
    run_job(job, "morph")
    system = compile_system(job.store, job.scene, job.morphs())
    face, radius = job.record("upper").interfaces["face"], CURVATURE if flat else CURVATURE / 2
    for approach in (0.6e-6, 1.2e-6, 2e-6):
        near, forces = pressed(system, approach)
        line, aside = forces.sum() / 0.01, face.points[near, 0]
        width = np.sqrt(4 * line * radius / np.pi / MODULUS)
        assert 2 * np.sqrt(forces @ aside**2 / forces.sum()) == pytest.approx(width, rel=0.01)
        inside = np.abs(aside) < 0.7 * width
        share = face.areas[near][inside] @ np.sqrt(1 - (aside[inside] / width) ** 2)
        assert forces[inside].sum() / share == pytest.approx(2 * line / np.pi / width, rel=0.01)
