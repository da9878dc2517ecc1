"""NAFEMS R94, benchmark 1: a steel cylinder pressed into an aluminium block, plane strain, with and without friction.

A. W. A. Konter, Advanced finite element contact benchmarks, NAFEMS, 2006: cylinder of 100 mm, block of 200 mm square,
held at its bottom, 35 kN on 1 mm of thickness. Hertz gives the half width 6.21 mm and the largest pressure 3 585 MPa
without friction; with a coefficient of 0.1 the top of the block moves down by 1.303 mm on the axis (MARC).
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.geometry.occ import meshing
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.ports.members import ports_of, start_unknowns
from gudgeon.solver.ports.rest import at_rest
from gudgeon.solver.ports.table import elastic_rows
from gudgeon.solver.system.system import System
from tests.validation.test_hertz_solids import sized

RADIUS, BLOCK, ZONE = 0.05, 0.2, 8.5e-3
"""Of the cylinder, side of the block, half of the edges that may touch [m]."""
FORCE, FRICTION = 35e3, 0.1
HALF_WIDTH, PRESSURE, MOVED = 6.21e-3, 3585e6, -1.303e-3
"""Of the benchmark [m, Pa, m]."""
SCENE = """
[component.roller]
geometry = { kind = "plane-file", path = "roller.msh", unit = 1.0, thickness = 0.001, state = "plane-strain" }
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
interface.face = { surface = "cap" }
interface.top = { surface = "top", kind = "mean" }
modes = { normal_count = 10 }

[component.block]
geometry = { kind = "plane-file", path = "block.msh", unit = 1.0, thickness = 0.001, state = "plane-strain" }
material = { E = 70e9, nu = 0.3, rho = 2700.0 }
supports = ["bottom"]
interface.face = { surface = "cap" }
modes = { normal_count = 10 }

[body.roller]
position = [0.0, 0.05, 0.0]
freedom = ["y"]

[body.block]

[contact.faces]
body = "roller"
interface = "face"
against = { shape = "body", body = "block", interface = "face" }
friction = { static = 1e-6 }                   # as good as none; with any, the start is the equilibrium

[force.load]
kind = "force"
body = "roller"
interface = "top"
direction = [0.0, -1.0, 0.0]
values = [[0.0, 35e3], [1.0, 35e3]]

[run]
duration = 1e-6
start = "rest"
checks = false
"""


def drawn(path: Path, size: float, *, block: bool) -> None:
    """Write a mesh whose elements have a size at the contact [m]: the block below y = 0, or the cylinder."""
    with meshing(0.02, {}) as gmsh:
        occ = gmsh.model.occ
        if block:
            half = BLOCK / 2
            corners = (
                (-half, -BLOCK),
                (half, -BLOCK),
                (half, 0.0),
                (ZONE, 0.0),
                (0.0, 0.0),
                (-ZONE, 0.0),
                (-half, 0.0),
            )
            points = [occ.addPoint(x, y, 0) for x, y in corners]
            lines = [occ.addLine(one, points[(n + 1) % len(points)]) for n, one in enumerate(points)]
            middle, named = points[4], {"cap": lines[3:5], "bottom": lines[:1]}
        else:
            turn = ZONE / RADIUS
            angles = np.array([-np.pi, -np.pi + 0.06, -np.pi / 2, -turn, 0.0, turn, np.pi / 2, np.pi - 0.06])
            points = [occ.addPoint(RADIUS * np.sin(t), -RADIUS * np.cos(t), 0) for t in angles]
            centre = occ.addPoint(0, 0, 0)
            lines = [occ.addCircleArc(one, centre, points[(n + 1) % len(points)]) for n, one in enumerate(points)]
            middle, named = points[4], {"cap": lines[3:5], "top": [lines[0], lines[-1]]}
        face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
        occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [face], name="body")
        for name, own in named.items():
            gmsh.model.addPhysicalGroup(1, own, name=name)
        sized(gmsh, middle, (size, 0.012), (1.1 * ZONE, 0.09))
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.setOrder(2)
        gmsh.write(str(path))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("r94")
    drawn(found / "roller.msh", 6e-4, block=False)
    drawn(found / "block.msh", 8e-4, block=True)
    (found / "scene.toml").write_text(SCENE)
    return found


def pressed(folder: Path, **sets: Any) -> tuple[System, np.ndarray]:
    """Return the system in its static equilibrium, and the forces of all ports [N]."""
    job = open_job(folder, set={key.replace("__", "."): value for key, value in sets.items()},
                   db=folder / "db", out=folder / "out")  # fmt: skip
    run_job(job, "morph")
    system = at_rest(system_of(job))
    return system, start_unknowns(system, ports_of(system))


def test_half_width_and_pressure_are_those_of_hertz(folder: Path) -> None:
    system, _ = pressed(folder)
    (contact,) = system.contacts
    assert contact.areas is not None
    forces, aside = system.start_forces, contact.points[:, 0]
    assert forces.sum() == pytest.approx(FORCE, rel=0.01)  # Along normals, which lean by 7 degrees at the edge.
    width = 2 * np.sqrt(forces @ aside**2 / forces.sum())
    assert width == pytest.approx(HALF_WIDTH, rel=0.03)
    inside = np.abs(aside) < 0.7 * width
    share = contact.areas[inside] @ np.sqrt(1 - (aside[inside] / width) ** 2)
    assert forces[inside].sum() / share == pytest.approx(PRESSURE, rel=0.03)


def test_the_block_moves_down_with_friction(folder: Path) -> None:
    system, forces = pressed(folder, contact__faces__friction__static=FRICTION)
    body, ports = system.bodies["block"], ports_of(system)
    acting = ports.weights["block"] @ forces
    assert body.modal.residual_flexibility is not None
    moved = elastic_rows(body) @ system.position[body.elastic] + body.modal.residual_flexibility @ acting
    first, last = body.modal.interface_rows["face"]
    on_axis = int(np.abs(body.morph.points["face"][:, 0]).argmin())
    assert body.morph.points["face"][on_axis, 0] == pytest.approx(0.0, abs=1e-9)
    assert moved[first:last][on_axis] == pytest.approx(MOVED, rel=0.02)
    # Friction acts: it has slipped at the edge, and sticks in the middle.
    normal, across = system.start_forces, np.linalg.norm(system.start_friction, axis=1)
    closed = normal > 0
    slips = across[closed] > (1 - 1e-6) * FRICTION * normal[closed]
    assert 0.2 < slips.mean() < 0.95
