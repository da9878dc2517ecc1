"""A ring under inner pressure p: Lamé's stresses (Timoshenko & Goodier, Theory of Elasticity, 3rd ed., §28).

σ_r = p a²/(b² − a²) (1 − b²/r²), σ_θ = p a²/(b² − a²) (1 + b²/r²); in plane stress the bore widens by
u = p a/E ((a² + b²)/(b² − a²) + ν). Curved triangles of six nodes.
"""

from pathlib import Path

import gmsh
import numpy as np
import pytest

from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.interfaces.gauges import gauge_rows
from gudgeon.pipeline.interfaces.loads import load_rows
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.pipeline.stages.mesh import build_mesh

A, B, T, E, NU = 0.05, 0.1, 0.01, 2e11, 0.3
SIZES = 0.05 / np.array([6, 8, 12, 16, 24])


def write_ring(path: Path, size: float) -> None:
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MeshSizeMin", size)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        occ = gmsh.model.occ
        ring, _ = occ.cut([(2, occ.addDisk(0, 0, 0, B, B))], [(2, occ.addDisk(0, 0, 0, A, A))])
        occ.synchronize()
        edges = [tag for _, tag in gmsh.model.getBoundary(ring, oriented=False)]
        bore = min(edges, key=lambda tag: gmsh.model.occ.getMass(1, tag))
        gmsh.model.addPhysicalGroup(2, [ring[0][1]], name="all")
        gmsh.model.addPhysicalGroup(1, [bore], name="bore")
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.setOrder(2)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()


@pytest.fixture(scope="module")
def errors(tmp_path_factory: pytest.TempPathFactory) -> dict[str, np.ndarray]:
    """Relative errors at each size: mean widening of the bore, largest of the hoop stress on it, and at a point."""
    folder, found = tmp_path_factory.mktemp("ring"), {"widening": [], "bore": [], "point": []}
    share = A**2 / (B**2 - A**2)
    for size in SIZES:
        write_ring(path := folder / "ring.msh", size)
        component = Component.model_validate(
            {
                "geometry": {"kind": "plane-file", "path": str(path), "thickness": T, "unit": 1.0},
                "material": {"E": E, "nu": NU, "rho": 7800.0},
                "gauge": {"bore": {"surface": "bore"}, "point": {"point": [0.06, 0.03, 0.0]}},
            }
        )
        mesh = build_mesh(component, folder, "ring")
        model = build_model(mesh, component.material, geometry=component.geometry)
        pressure = load_rows(model, Interface(surface="bore", kind="pressure"), "bore")
        u = Flexibility(model).solve(pressure.B.T.toarray())
        widening = A / E * ((A**2 + B**2) / (B**2 - A**2) + NU)
        found["widening"].append((pressure.B @ u).item() / (2 * np.pi * A * T * widening) - 1)
        rows = gauge_rows(model, component, "component.ring")
        places = {"bore": mesh.nodes[np.unique(mesh.surfaces["bore"].facets)], "point": np.array([[0.06, 0.03, 0.0]])}
        for name, at in places.items():
            r, angle = np.hypot(*at[:, :2].T), np.arctan2(at[:, 1], at[:, 0])
            xx, yy, _, xy, _, _ = (rows[name] @ u).reshape(-1, 6).T
            s, c = np.sin(angle), np.cos(angle)
            hoop = xx * s**2 + yy * c**2 - 2 * xy * s * c
            found[name].append(np.abs(hoop / (share * (1 + B**2 / r**2)) - 1).max())
    return {name: np.abs(values) for name, values in found.items()}


def order(errors: np.ndarray) -> float:
    return float(np.polyfit(np.log(SIZES), np.log(errors), 1)[0])


def test_the_bore_widens_as_lame_says(errors: dict[str, np.ndarray]) -> None:
    assert errors["widening"][-1] < 1e-6
    assert order(errors["widening"]) == pytest.approx(4.0, abs=0.2)


def test_stress_at_the_bore_and_inside(errors: dict[str, np.ndarray]) -> None:
    """Recovered stress of quadratic elements: at least the second order, on the edge too."""
    assert errors["bore"][-1] < 1e-3
    assert order(errors["bore"]) > 1.8
    assert errors["point"][-1] < 1e-3
