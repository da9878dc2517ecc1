"""Hertz: two elastic spheres whose meshes do not match, pressed together; solids, without a law."""

from pathlib import Path

import numpy as np
import pytest
from scipy import linalg, optimize

from gudgeon.pipeline.geometry.occ import meshing
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.system.compile import compile_system

RADIUS, REACH = 0.01, 1e-3
"""Of the spheres, and of the part of them that may touch [m]."""
MODULUS = 210e9 / (2 * (1 - 0.3**2))
"""E*: of both [Pa]."""
SCENE = """
[component.upper]
geometry = { kind = "file", path = "upper.msh" }
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
interface.face = { surface = "cap" }
modes = { normal_count = 10 }

[component.lower]
geometry = { kind = "file", path = "lower.msh" }
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
        field = gmsh.model.mesh.field
        away, sizes = field.add("Distance"), field.add("Threshold")
        field.setNumbers(away, "PointsList", [pole])
        for key, value in (("InField", away), ("SizeMin", size), ("SizeMax", 3.5e-3), ("DistMin", REACH),
                           ("DistMax", 1.2 * RADIUS)):  # fmt: skip
            field.setNumber(sizes, key, value)
        field.setAsBackgroundMesh(sizes)
        for key in ("SizeExtendFromBoundary", "SizeFromPoints", "SizeFromCurvature", "SizeMin"):
            gmsh.option.setNumber(f"Mesh.Mesh{key}", 0)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        gmsh.write(str(path))


def test_spheres_have_the_radius_and_pressure_of_hertz(tmp_path: Path) -> None:
    """Radius of contact and largest pressure within 3 % at three elements a radius and more."""
    sphere(tmp_path / "upper.msh", 2.0e-4, -1.0)
    sphere(tmp_path / "lower.msh", 2.6e-4, 1.0)
    (tmp_path / "scene.toml").write_text(SCENE)
    job = open_job(tmp_path, db=tmp_path / "db", out=tmp_path / "out")
    run_job(job, "morph")
    system = compile_system(job.store, job.scene, job.morphs())
    elastic = system.stiffness > 0
    rows, face = system.rows[:, elastic], job.record("upper").interfaces["face"]
    compliance = rows / system.stiffness[elastic] @ rows.T + system.residual
    aside = np.hypot(*face.points[:, :2].T)
    for approach in (4e-5, 5.5e-5, 7e-5):
        near = np.flatnonzero(system.gap < approach)
        factor = linalg.cholesky(compliance[np.ix_(near, near)], lower=True)
        forces = optimize.nnls(factor.T, linalg.solve_triangular(factor, approach - system.gap[near], lower=True))[0]
        force = forces.sum()
        radius = (3 * force * RADIUS / 2 / 4 / MODULUS) ** (1 / 3)
        pressure = 3 * force / (2 * np.pi * radius**2)
        found = np.sqrt(2.5 * (forces @ aside[near] ** 2) / force)
        assert found == pytest.approx(radius, rel=0.03)
        inside = aside[near] < 0.7 * radius
        share = face.areas[near][inside] @ np.sqrt(1 - (aside[near][inside] / radius) ** 2)
        assert forces[inside].sum() / share == pytest.approx(pressure, rel=0.03)
