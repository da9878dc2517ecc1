"""Plane parts: Lamé's modes of a square, bars without Poisson's ratio, edges, ties, gauges and mesh files.

Lamé: a free square of side a has the equivoluminal mode u = cos(πx/a) sin(πy/a), v = −sin(πx/a) cos(πy/a) (corner at
the origin) of frequency √2 π c_s / a, whose boundary is free of traction; it is the same in plane stress and strain
(Graff, Wave Motion in Elastic Solids, 1975, §8.1).
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import sparse

from gudgeon import run
from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.interfaces.gauges import gauge_rows
from gudgeon.pipeline.interfaces.loads import load_rows
from gudgeon.pipeline.interfaces.patch import normal_rows, patch_point
from gudgeon.pipeline.interfaces.points import contact_points, surface_coordinates
from gudgeon.pipeline.interfaces.tie import made_rigid, tie_of, tie_rows
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.modes.normal import normal_modes
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.pipeline.stages.mesh import build_mesh

E, NU, RHO, T = 2e11, 0.3, 7800.0, 0.01
STATES = ("plane-stress", "plane-strain")
EXACT = 1e-9


def sheet(lx: float, ly: float, state: str = "plane-stress", nu: float = NU, **more: Any) -> Component:
    geometry = {"kind": "rectangle", "lx": lx, "ly": ly, "thickness": T, "state": state}
    return Component.model_validate({"geometry": geometry, "material": {"E": E, "nu": nu, "rho": RHO}} | more)


def modelled(component: Component, size: float) -> FEModel:
    mesh = component.geometry.build(size)
    return build_model(mesh, component.material, component.supports, "component.sheet", component.geometry)


@pytest.mark.parametrize("state", STATES)
def test_lames_mode_of_a_square_converges_with_the_fourth_power(state: str) -> None:
    exact = np.pi * np.sqrt(2 * E / (2 * (1 + NU)) / RHO)
    sizes, errors = 1 / np.array([4, 6, 8, 12, 16, 24, 32]), []
    for size in sizes:
        found = normal_modes(modelled(sheet(1.0, 1.0, state), size), 5).angular_frequencies
        errors.append(found[np.abs(found - exact).argmin()] / exact - 1)
    assert min(errors) > 0
    assert errors[-1] < 1e-6
    order = np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert order == pytest.approx(4.0, abs=0.2)


@pytest.mark.parametrize("state", STATES)
def test_a_strip_without_contraction_is_a_bar(state: str) -> None:
    found = normal_modes(modelled(sheet(1.0, 0.02, state, nu=0.0), 0.02), 40).angular_frequencies
    for n in (1, 2, 3):
        bar = n * np.pi * np.sqrt(E / RHO)
        assert np.abs(found / bar - 1).min() < 1e-6


def test_mass_and_rigid_motions() -> None:
    model = modelled(sheet(0.3, 0.2), 0.05)
    mass = RHO * 0.3 * 0.2 * T
    assert model.properties.mass == pytest.approx(mass, rel=1e-12)
    expected = mass / 12 * np.array([0.2**2, 0.3**2, 0.2**2 + 0.3**2])
    np.testing.assert_allclose(np.diag(model.properties.inertia), expected, rtol=1e-12)
    rigid = model.rigid_modes
    assert rigid.shape[1] == 3
    np.testing.assert_allclose(rigid.T @ (model.M @ rigid), np.eye(3), atol=1e-12)
    np.testing.assert_allclose(model.K @ rigid, 0, atol=1e-10 * model.K.diagonal().max() * np.abs(rigid).max())


def test_supports_know_the_plane() -> None:
    assert len(modelled(sheet(0.3, 0.2, supports=[{"surface": "left", "hold": ["x"]}]), 0.1).rigid_twists) == 1
    assert not len(modelled(sheet(0.3, 0.2, supports=["left"]), 0.1).rigid_twists)
    with pytest.raises(InputError, match=r"component\.sheet\.supports: 'z' given in hold of 'left'; .* has x, y"):
        modelled(sheet(0.3, 0.2, supports=[{"surface": "left", "hold": ["z"]}]), 0.1)


def test_points_of_an_edge_share_its_area() -> None:
    mesh = sheet(0.3, 0.2).geometry.build(0.05)
    for name, normal, length in (("right", [1, 0, 0], 0.2), ("bottom", [0, -1, 0], 0.3)):
        points = contact_points(mesh, Interface(surface=name), "i")
        np.testing.assert_array_equal(points.nodes, np.unique(mesh.surfaces[name].facets))
        np.testing.assert_allclose(points.normals, np.tile(normal, (len(points.nodes), 1)), atol=1e-12)
        assert points.areas.sum() == pytest.approx(length * T, rel=1e-12)
        assert points.areas.min() > 0
        assert surface_coordinates(points.points, mesh.surfaces[name].shape).shape == (len(points.nodes), 1)


def test_patch_pressure_and_mean_of_an_edge() -> None:
    component = sheet(0.3, 0.2)
    model = modelled(component, 0.05)
    mesh, right = model.mesh, Interface(surface="right", kind="patch")
    point = patch_point(mesh, right, "i")
    np.testing.assert_allclose(point.points, [[0.15, 0, 0]], atol=1e-15)
    assert point.areas[0] == pytest.approx(0.2 * T, rel=1e-12)
    stretch = (mesh.nodes * [1e-3, 0, 0])[:, :2].ravel()
    assert (normal_rows(model, right, patch_point(mesh, right, "i")) @ stretch).item() == pytest.approx(0.15e-3)
    pressure = load_rows(model, Interface(surface="right", kind="pressure"), "i")
    np.testing.assert_allclose(pressure.resultant, [[-0.2 * T, 0, 0, 0, 0, 0]], atol=1e-15)
    mean = load_rows(model, Interface(surface="right", kind="mean"), "i")
    np.testing.assert_allclose((mean.B @ stretch).ravel(), [0.15e-3, 0, 0], atol=1e-15)


@pytest.mark.parametrize("state", STATES)
def test_edges_tied_to_points_stretch_and_bend_as_beams(state: str) -> None:
    """A linear traction on the ends has an exact quadratic solution; plane strain is stiffer by 1 − ν²."""
    lx, ly = 0.3, 0.1
    model = modelled(sheet(lx, ly, state), 0.05)
    ties = [tie_of(model.mesh, Interface(surface=s, kind="tie", tie="rbe3"), "t") for s in ("left", "right")]
    B = sparse.csr_matrix(sparse.vstack([tie_rows(model, tie).B for tie in ties]))
    assert B.shape[0] == 6
    modulus = E if state == "plane-stress" else E / (1 - NU**2)
    for motion, compliance in ((0, lx / (modulus * ly * T)), (2, lx / (modulus * T * ly**3 / 12))):
        load = np.zeros((6, 1))
        load[[motion, 3 + motion], 0] = -1.0, 1.0
        moved = (B @ Flexibility(model).solve(B.T @ load)).ravel()
        assert moved[3 + motion] - moved[motion] == pytest.approx(compliance, rel=EXACT)
    tied, L = made_rigid(model, {"left": ties[0]}, "t")
    np.testing.assert_allclose(L @ tied.rigid_modes, model.rigid_modes, atol=1e-12)


@pytest.mark.parametrize("state", STATES)
def test_gauges_know_the_stress_across(state: str) -> None:
    gauge = {"s": {"point": [0.03, 0.02, 0.0]}, "e": {"point": [0.03, 0.02, 0.0], "quantity": "strain"}}
    component = sheet(0.3, 0.1, state, gauge=gauge | {"all": {"surface": "skin"}})
    model = modelled(component, 0.05)
    ends = [load_rows(model, Interface(surface=s, kind="mean"), "i").B[0] for s in ("left", "right")]
    u = Flexibility(model).solve((ends[1] - ends[0]).T.toarray())
    rows = gauge_rows(model, component, "component.sheet")
    sigma = 1 / (0.1 * T)
    across = 0.0 if state == "plane-stress" else NU * sigma
    exact = np.array([sigma, 0, across, 0, 0, 0])
    np.testing.assert_allclose((rows["s"] @ u).ravel(), exact, atol=EXACT * sigma)
    thinning = -NU * sigma / E if state == "plane-stress" else 0.0
    assert (rows["e"] @ u)[2, 0] == pytest.approx(thinning, abs=EXACT * sigma / E)
    np.testing.assert_allclose(
        (rows["all"] @ u).reshape(-1, 6), np.tile(exact, (len(model.nodes), 1)), atol=1e-8 * sigma
    )
    with pytest.raises(InputError, match=r"gauge\.g\.point: .* lies outside the part"):
        gauge_rows(model, sheet(0.3, 0.1, gauge={"g": {"point": [0.0, 0.0, 0.05]}}), "component.sheet")


def test_a_thin_solid_plate_is_in_plane_stress() -> None:
    plate = Component.model_validate(
        {
            "geometry": {"kind": "plate", "lx": 0.3, "ly": 0.2, "thickness": 0.01, "layers": 1},
            "material": {"E": E, "nu": NU, "rho": RHO},
        }
    )
    solid = build_model(plate.geometry.build(0.02), plate.material)
    found = normal_modes(solid, 40).angular_frequencies
    plane = normal_modes(modelled(sheet(0.3, 0.2), 0.02), 2).angular_frequencies
    # Thinning has inertia: (ν k t)²/24 of the frequency, k = π/lx, is 1e-4 and less.
    for omega in plane:
        assert np.abs(found / omega - 1).min() < 1e-3


def ring(path: Path, *, order: int = 2, lift: float = 0.0) -> None:
    """Write a disc of radius 1 with its rim as a physical group."""
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.4)
        disc = gmsh.model.occ.addDisk(0, 0, lift, 1.0, 1.0)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [disc], name="all")
        gmsh.model.addPhysicalGroup(1, [tag for _, tag in gmsh.model.getEntities(1)], name="rim")
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.setOrder(order)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()


def from_file(path: Path, **geometry: Any) -> Component:
    return Component.model_validate(
        {
            "geometry": {"kind": "plane-file", "path": str(path), "thickness": T, "unit": 1.0, **geometry},
            "material": {"E": E, "nu": NU, "rho": RHO},
        }
    )


@pytest.mark.parametrize("ending", ["msh", "vtu"])
def test_a_disc_from_a_file_keeps_its_round_edge(tmp_path: Path, ending: str) -> None:
    ring(path := tmp_path / "disc.msh")
    if ending == "vtu":
        import meshio

        read = meshio.read(path)
        rim = np.zeros(len(read.points), int)
        rim[np.unique(read.cells_dict["line3"])] = 1
        meshio.Mesh(read.points, [("triangle6", read.cells_dict["triangle6"])], {"rim": rim}).write(
            path := tmp_path / "disc.vtu"
        )
    component = from_file(path, unit=0.05)
    mesh = build_mesh(component, tmp_path, "disc")
    assert set(mesh.surfaces) >= {"edge", "rim"}
    np.testing.assert_array_equal(mesh.surfaces["rim"].facets, mesh.surfaces["edge"].facets)
    points = contact_points(mesh, Interface(surface="rim"), "i")
    np.testing.assert_allclose(points.normals, points.points / 0.05, atol=0.02)
    assert points.areas.sum() == pytest.approx(2 * np.pi * 0.05 * T, rel=1e-4)
    model = build_model(mesh, component.material, geometry=component.geometry)
    assert model.properties.mass == pytest.approx(RHO * T * np.pi * 0.05**2, rel=1e-4)
    squeeze = load_rows(model, Interface(surface="rim", kind="pressure"), "i")
    component = component.model_copy(update={"gauge": sheet(1, 1, gauge={"g": {"surface": "skin"}}).gauge})
    stress = gauge_rows(model, component, "d")["g"] @ Flexibility(model).solve(squeeze.B.T.toarray())
    exact = np.tile([-1.0, -1.0, 0, 0, 0, 0], (len(mesh.nodes), 1))
    np.testing.assert_allclose(stress.reshape(-1, 6), exact, atol=EXACT)


def test_files_that_are_no_plane_parts_are_refused(tmp_path: Path) -> None:
    ring(tmp_path / "linear.msh", order=1)
    ring(tmp_path / "lifted.msh", lift=0.1)
    for name, message in (
        ("linear", r"linear\.msh: has triangle; a plane part is made of triangle6 alone"),
        ("lifted", r"lifted\.msh: nodes lie up to 0\.1 m off z = 0"),
        ("absent", r"component\.disc\.geometry\.path: no file"),
    ):
        with pytest.raises(InputError, match=message):
            build_mesh(from_file(tmp_path / f"{name}.msh"), tmp_path, "disc")


def test_flat_elements_are_refused() -> None:
    component = sheet(0.3, 0.2)
    mesh = component.geometry.build(0.1)
    nodes = mesh.nodes.copy()
    nodes[:, 1] *= 1e-12
    with pytest.raises(InputError, match=r"component\.sheet: mesh: element \d+ has no area, .* of its extent squared"):
        build_model(
            MeshRecord(nodes, mesh.cells, mesh.cell_type, mesh.surfaces), component.material, (), "component.sheet",
            component.geometry,
        )  # fmt: skip


SCENE = f"""
[component.sheet]
geometry = {{ kind = "rectangle", lx = 0.2, ly = 0.05, thickness = {T} }}
material = {{ E = {E}, nu = 0.0, rho = {RHO} }}
mesh = {{ size = 0.02 }}
interface.head = {{ surface = "right", kind = "patch" }}
modes = {{ reduction = "macneal", normal_count = 60 }}

[body.sheet]
velocity = [1.0, 0.0, 0.0]

[contact.wall]
body = "sheet"
interface = "head"
against = {{ shape = "plane", point = [0.1, 0.0, 0.0], normal = [-1.0, 0.0, 0.0] }}

[run]
duration = 1.2e-4
"""


def test_a_sheet_strikes_a_wall_as_a_rod_does(tmp_path: Path) -> None:
    """St Venant: the impact of a rod lasts 2L/c and turns its momentum round."""
    (tmp_path / "scene.toml").write_text(SCENE)
    report = run(tmp_path, db=tmp_path / "db", out=tmp_path / "out", until="solve")
    mass, c = RHO * 0.2 * 0.05 * T, np.sqrt(E / RHO)
    assert report.quantities["wall.impulse"]["value"] == pytest.approx(2 * mass, rel=0.01)
    assert report.quantities["wall.duration"]["value"] == pytest.approx(2 * 0.2 / c, rel=0.05)
    job = open_job(tmp_path, db=tmp_path / "db")
    modal = job.store.get(job.components()["sheet"]["modes"].key, "modes")
    assert modal.rigid_twists.shape == (3, 6)
    assert not modal.shapes[:, 2].any()


def test_records_of_plane_parts_hold_what_contacts_need() -> None:
    component = sheet(0.3, 0.2, interface={"hit": {"surface": "right"}}, modes={"normal_count": 5, "static_count": 3})
    mesh = component.geometry.build(0.05)
    record = reduce_component(mesh, "ab" * 32, component, "sheet")
    assert record.inertia_couplings is None
    assert (record.normal_count, record.static_count) == (5, 3)
    model = modelled(component, 0.05)
    points = contact_points(mesh, component.interface["hit"], "i")
    B = model.rows(points.nodes, points.normals)
    exact = B @ Flexibility(model).solve(B.T.toarray())
    rows = record.interfaces["hit"].rows
    found = (rows / record.angular_frequencies**2) @ rows.T + record.residual_flexibility
    np.testing.assert_allclose(found, exact, atol=EXACT * np.abs(exact).max())
