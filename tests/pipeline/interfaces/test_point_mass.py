"""Point masses: mass, centre and inertia of the whole, a rod with a mass at its end, and what is refused."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import optimize

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.cells import outer_facets
from gudgeon.pipeline.geometry.section import Rectangle
from gudgeon.pipeline.geometry.shapes.bar import Bar
from gudgeon.pipeline.geometry.shapes.beam import Beam
from gudgeon.pipeline.interfaces.point_mass import with_point_masses
from gudgeon.pipeline.modes.normal import normal_modes
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.material import Material
from tests.pipeline.blocks import block

SIZE = (0.01, 0.01, 0.1)
E, RHO = 2.1e11, 7850.0


def mesh_of(cells: tuple[int, int, int]) -> MeshRecord:
    """Return a rod along z with the surfaces of its ends."""
    mesh = block(SIZE, cells).mesh
    skin = outer_facets(mesh)
    heights = {"foot": 0.0, "tip": SIZE[2]}
    ends = {name: skin[(np.abs(mesh.nodes[skin, 2] - z) < 1e-9).all(axis=1)] for name, z in heights.items()}
    return replace(mesh, surfaces={name: Surface(facets) for name, facets in ends.items()})


def component_of(masses: dict[str, Any], **more: Any) -> Component:
    return Component.model_validate({
        "geometry": {"kind": "box", "lx": SIZE[0], "ly": SIZE[1], "lz": SIZE[2]},
        "material": {"E": E, "nu": 0.0, "rho": RHO}, "point_mass": masses, **more,
    })  # fmt: skip


def model_of(mesh: MeshRecord, component: Component) -> FEModel:
    plain = build_model(mesh, component.material, component.supports, "component.rod", component.geometry)
    return with_point_masses(plain, component, "component.rod")


def test_mass_centre_and_inertia_are_those_of_both() -> None:
    at, own = np.array([0.02, -0.01, 0.13]), np.array([1e-4, 2e-4, 3e-4])
    component = component_of({"engine": {"surface": "tip", "mass": 0.5, "at": at, "inertia": own}})
    model = model_of(mesh_of((1, 1, 5)), component)
    rod = RHO * np.prod(SIZE)
    middle = np.array([0, 0, SIZE[2] / 2])
    mass = rod + 0.5
    centre = (rod * middle + 0.5 * at) / mass
    squares = np.array(SIZE) ** 2
    inertia = np.diag(rod / 12 * (squares.sum() - squares)) + np.diag(own)
    for part, place in ((rod, middle), (0.5, at)):
        arm = place - centre
        inertia += part * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    assert model.properties.mass == pytest.approx(mass)
    np.testing.assert_allclose(model.properties.centre, centre, rtol=1e-12)
    np.testing.assert_allclose(model.properties.inertia, inertia, rtol=1e-9, atol=1e-12)
    rigid = model.rigid_modes
    np.testing.assert_allclose(rigid.T @ (model.M @ rigid), np.eye(6), atol=1e-10)


def test_a_clamped_rod_with_a_mass_at_its_end() -> None:
    """ν = 0: β L tan β L = ρ A L / m, ω = β √(E/ρ) (Meirovitch, Fundamentals of Vibrations, 2001, ch. 8)."""
    mass = 0.03
    component = component_of({"tip": {"surface": "tip", "mass": mass}}, supports=["foot"])
    model = model_of(mesh_of((1, 1, 10)), component)
    ratio = RHO * np.prod(SIZE) / mass
    beta = optimize.brentq(lambda x: x * np.tan(x) - ratio, 1e-6, np.pi / 2 - 1e-6) / SIZE[2]
    modes = normal_modes(model, 8)
    across, _, along = np.abs(modes.Phi.reshape(-1, 3, 8)).mean(axis=0)
    found = modes.angular_frequencies[along > 2 * across][0]
    assert found == pytest.approx(beta * np.sqrt(E / RHO), rel=1e-4)


def test_rigid_motions_that_supports_leave() -> None:
    """A rod that slides along z and turns about it: both are mass-normalised with the mass beside its axis."""
    component = component_of(
        {"tip": {"surface": "tip", "mass": 0.2, "at": (0.05, 0.0, 0.1)}},
        supports=[{"surface": "foot", "hold": ["x", "y"]}],
    )
    model = model_of(mesh_of((1, 1, 4)), component)
    rigid = model.rigid_modes
    assert rigid.shape[1] == len(model.rigid_twists) > 0
    np.testing.assert_allclose(rigid.T @ (model.M @ rigid), np.eye(rigid.shape[1]), atol=1e-10)
    assert np.abs(model.K @ rigid).max() < 1e-9 * abs(model.K).max() * np.abs(rigid).max()


def test_frequencies_of_a_record_keep_their_bounds() -> None:
    """The bound of the element masses does not hold with a mass on many nodes: the mass is then factorised."""
    component = component_of(
        {"tip": {"surface": "tip", "mass": 0.2}}, interface={"foot": {"surface": "foot", "kind": "patch"}},
        modes={"normal_count": 6},
    )  # fmt: skip
    modal = reduce_component(mesh_of((1, 1, 6)), "", component, "rod")
    assert modal.mass == pytest.approx(RHO * np.prod(SIZE) + 0.2)
    assert modal.algebraic_errors is not None
    assert modal.algebraic_errors.max() < 1e-6


@pytest.mark.parametrize(("mass", "message"), [
    ({"surface": "side", "mass": 1.0}, r"component\.rod\.point_mass\.m\.surface: .*'side', it has foot, tip"),
])  # fmt: skip
def test_surfaces_that_are_not_there(mass: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        model_of(mesh_of((1, 1, 2)), component_of({"m": mass}))


def test_a_moved_surface_needs_new_modes() -> None:
    with pytest.raises(ValueError, match="with point masses a moved surface needs update 'recompute'"):
        component_of({"m": {"surface": "tip", "mass": 1.0}}, change={"profile": {"offset": 1e-6}})


def test_the_mesh_command_prints_the_mass_of_all(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.toml").write_text(f"""
[component.rod]
geometry = {{ kind = "box", lx = {SIZE[0]}, ly = {SIZE[1]}, lz = {SIZE[2]} }}
material = {{ E = {E}, nu = 0.3, rho = {RHO} }}
mesh = {{ size = 0.01 }}
point_mass.engine = {{ surface = "top", mass = 1.0 }}

[body.rod]

[run]
duration = 1e-5
""")
    assert main(["mesh", str(tmp_path), "--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert f"{RHO * np.prod(SIZE) + 1:.5g} kg" in said
    assert f"{np.prod(SIZE):.5g} m^3" in said


@pytest.mark.parametrize("geometry", [
    Beam(kind="beam", length=1.0, section=Rectangle(kind="rectangle", width=0.01, height=0.01)),
    Bar(kind="bar", length=1.0, area=1e-4),
])  # fmt: skip
def test_lines_of_one_plane_are_told_what_carries_a_mass(geometry: Beam | Bar) -> None:
    steel = Material(E=E, nu=0.0, rho=RHO)
    model = build_model(geometry.build(0.1), steel, geometry=geometry)
    component = component_of({"engine": {"surface": "right", "mass": 0.5}})
    with pytest.raises(InputError, match=r"point_mass\.engine: given; .* motion = \"space\" and supports, or join"):
        with_point_masses(model, component, "component.rod")
