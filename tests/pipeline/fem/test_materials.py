"""Orthotropic solids and solids of several materials, against energies of uniform strain and the bar of two metals."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy import optimize

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.geometry.cad.part import CadPart
from gudgeon.pipeline.geometry.mesh_file import MeshFile
from gudgeon.pipeline.interfaces.gauges import gauge_rows
from gudgeon.pipeline.modes.estimate import discretisation_errors
from gudgeon.pipeline.modes.normal import normal_modes
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.material import Material
from tests.pipeline.blocks import block

ALONG = (np.cos(0.4), np.sin(0.4), 0.0)
WOOD = {"E": (1.1e10, 8e8, 5e8), "nu": (0.37, 0.47, 0.43), "G": (7e8, 6e8, 4e7)}
STEEL = {"E": 2.1e11, "nu": 0.3, "rho": 7850.0}
SIZE = (0.02, 0.03, 0.05)


def mesh_of(cells: tuple[int, int, int] = (2, 2, 4), size: tuple[float, float, float] = SIZE) -> MeshRecord:
    """Return a block whose halves along z are volumes."""
    mesh = block(size, cells).mesh
    upper = mesh.nodes[mesh.cells].mean(axis=1)[:, 2] > size[2] / 2
    return replace(mesh, volumes={"low": np.flatnonzero(~upper), "high": np.flatnonzero(upper)})


def uniform(mesh: MeshRecord, strain: np.ndarray) -> np.ndarray:
    """Return the displacement of a uniform strain, (3n,)."""
    return (mesh.nodes @ strain).ravel()


def strains() -> list[np.ndarray]:
    rng = np.random.default_rng(1)
    return [one + one.T for one in rng.normal(size=(4, 3, 3))]


def test_equal_constants_in_any_axes_are_an_isotropic_material() -> None:
    mesh, G = mesh_of(), STEEL["E"] / 2 / (1 + STEEL["nu"])
    same = Material(rho=STEEL["rho"], orthotropic={  # type: ignore[call-arg, arg-type]
        "E": [STEEL["E"]] * 3, "nu": [STEEL["nu"]] * 3, "G": [G] * 3, "axes": [ALONG, (0, 0, 1)],
    })  # fmt: skip
    assert (same.E, same.nu) == pytest.approx((STEEL["E"], STEEL["nu"]), rel=1e-12)
    found, wanted = build_model(mesh, same), build_model(mesh, Material(**STEEL))
    assert abs(found.K - wanted.K).max() < 1e-12 * abs(wanted.K).max()
    assert abs(found.M - wanted.M).max() == 0


@pytest.mark.parametrize("curved", [False, True])
def test_energy_of_uniform_strain_in_wood(curved: bool) -> None:
    """Strain energy ½ ε C ε V; tension along direction 1 extends by σ/E1 and contracts by ν12, ν13 of it."""
    mesh = mesh_of()
    if curved:  # Inner mid-edge nodes off their chords: the same block by quadrature.
        inner = np.setdiff1d(mesh.cells[:, 4:], np.concatenate([np.flatnonzero(np.abs(mesh.nodes[:, i] - e) < 1e-9)
            for i in range(3) for e in (mesh.nodes[:, i].min(), mesh.nodes[:, i].max())]))  # fmt: skip
        nodes = mesh.nodes.copy()
        nodes[inner] += 2e-4
        mesh = replace(mesh, nodes=nodes)
    material = Material(rho=500.0, orthotropic={**WOOD, "axes": [ALONG, (-ALONG[1], ALONG[0], 0)]})  # type: ignore
    model, C, volume = build_model(mesh, material), material.orthotropic.tensor, np.prod(SIZE)  # type: ignore
    for strain in strains():
        u = uniform(mesh, strain)
        energy = np.einsum("ij,ijkl,kl->", strain, C, strain) * volume
        assert u @ (model.K @ u) == pytest.approx(energy, rel=1e-10 if not curved else 1e-6)
    one, two = np.array(ALONG), np.array((-ALONG[1], ALONG[0], 0))
    pull = np.outer(one, one)
    compliance = np.linalg.inv(C.transpose(0, 1, 2, 3).reshape(9, 9) + np.eye(9) - _symmetric())
    extension = (compliance @ pull.ravel()).reshape(3, 3)
    assert one @ extension @ one == pytest.approx(1 / WOOD["E"][0], rel=1e-6)
    assert two @ extension @ two == pytest.approx(-WOOD["nu"][0] / WOOD["E"][0], rel=1e-6)
    assert extension[2, 2] == pytest.approx(-WOOD["nu"][1] / WOOD["E"][0], rel=1e-6)


def _symmetric() -> np.ndarray:
    """Return the projection of tensors on symmetric ones, (9, 9)."""
    swap = np.eye(9).reshape(3, 3, 3, 3).transpose(0, 1, 3, 2).reshape(9, 9)
    return 0.5 * (np.eye(9) + swap)


def test_two_materials_add_up() -> None:
    mesh = mesh_of()
    both = Material(**STEEL, volumes={"high": {"E": 7e10, "nu": 0.33, "rho": 2700.0}})  # type: ignore[arg-type]
    model, half = build_model(mesh, both), np.prod(SIZE) / 2
    assert model.properties.mass == pytest.approx(half * (7850 + 2700), rel=1e-12)
    assert model.properties.centre[2] == pytest.approx(SIZE[2] / 4 * (7850 + 3 * 2700) / (7850 + 2700))
    for strain in strains():
        energies = []
        for one in (both, both.volumes["high"]):
            lam, mu = one.lame
            energies.append((lam * np.trace(strain) ** 2 + 2 * mu * (strain**2).sum()) * half)
        u = uniform(mesh, strain)
        assert u @ (model.K @ u) == pytest.approx(sum(energies), rel=1e-10)


def test_a_bar_of_two_metals() -> None:
    """Free-free, ν = 0: Z1 tan(ω l/c1) + Z2 tan(ω l/c2) = 0, Z = √(E ρ); its error is estimated, too."""
    size = (0.005, 0.005, 0.2)
    mesh = mesh_of((1, 1, 20), size)
    low, high = {"E": 2.1e11, "nu": 0.0, "rho": 7850.0}, {"E": 7e10, "nu": 0.0, "rho": 2700.0}
    material = Material(**low, volumes={"high": high})  # type: ignore[arg-type]
    model = build_model(mesh, material)
    (Z1, t1), (Z2, t2) = (((m["E"] * m["rho"]) ** 0.5, size[2] / 2 * (m["rho"] / m["E"]) ** 0.5) for m in (low, high))

    def condition(omega: float) -> float:
        return Z1 * np.sin(omega * t1) * np.cos(omega * t2) + Z2 * np.sin(omega * t2) * np.cos(omega * t1)

    omegas = np.linspace(1e3, 4e5, 4001)
    values = np.array([condition(omega) for omega in omegas])
    roots = [optimize.brentq(condition, omegas[k], omegas[k + 1]) for k in np.flatnonzero(values[1:] * values[:-1] < 0)]
    modes = normal_modes(model, 30)
    axial = np.abs(modes.Phi.reshape(-1, 3, 30)[:, 2]).mean(axis=0) > 2 * np.abs(
        modes.Phi.reshape(-1, 3, 30)[:, 0]
    ).mean(axis=0)
    found = modes.angular_frequencies[axial][0]
    error = found / roots[0] - 1
    assert 0 <= error < 1e-4
    estimates = discretisation_errors(
        model, material, None, modes.angular_frequencies[axial][:1], modes.Phi[:, axial][:, :1]
    )
    assert estimates is not None
    assert estimates[0] < 1e-3, "stress that jumps between materials is no error"


def test_volumes_that_are_not_there_or_overlap() -> None:
    mesh = mesh_of()
    with pytest.raises(
        InputError, match=r"component: material\.volumes: the mesh has no volume 'core', it has high, low"
    ):
        build_model(mesh, Material(**STEEL, volumes={"core": STEEL}))  # type: ignore[arg-type]
    twice = replace(mesh, volumes=mesh.volumes | {"also": mesh.volumes["low"][:3]})
    with pytest.raises(
        InputError, match=r"'also' and 'low' have cells in common|'low' and 'also' have cells in common"
    ):
        build_model(twice, Material(**STEEL, volumes={"low": STEEL, "also": STEEL}))  # type: ignore[arg-type]


@pytest.mark.parametrize(("change", "message"), [
    ({"nu": (0.37, 0.47, 5.0)}, "the strain energy is not positive"),
    ({"axes": [(1, 0, 0), (1, 1, 0)]}, "two directions at a right angle are needed"),
    ({"G": (7e8, 6e8, 0.0)}, "greater than 0"),
])  # fmt: skip
def test_constants_that_are_no_material(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        Material(rho=500.0, orthotropic={**WOOD, **change})  # type: ignore[call-arg, arg-type]


def test_two_kinds_of_constants() -> None:
    with pytest.raises(ValidationError, match="E given with orthotropic"):
        Material(**STEEL, orthotropic=WOOD)  # type: ignore[arg-type]
    own = Material(rho=500.0, orthotropic=WOOD)  # type: ignore[call-arg, arg-type]
    assert Material.model_validate(own.model_dump()) == own


def test_stress_is_that_of_the_material_at_the_gauge() -> None:
    mesh = mesh_of()
    material = {**STEEL, "volumes": {"high": {"rho": 500.0, "orthotropic": WOOD}}}
    component = Component.model_validate({
        "geometry": {"kind": "box", "lx": SIZE[0], "ly": SIZE[1], "lz": SIZE[2]}, "material": material,
        "gauge": {"below": {"point": (0.001, 0.002, 0.01), "quantity": "stress"},
                  "above": {"point": (0.001, 0.002, 0.04), "quantity": "stress"}},
    })  # fmt: skip
    assert component.material is not None
    model = build_model(mesh, component.material)
    rows = gauge_rows(model, component, "component")
    wood = component.material.volumes["high"].orthotropic
    assert wood is not None
    pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)]
    for strain in strains():
        u = uniform(mesh, strain)
        lam, mu = component.material.lame
        steel = lam * np.trace(strain) * np.eye(3) + 2 * mu * strain
        own = np.einsum("ijkl,kl->ij", wood.tensor, strain)
        for name, stress in (("below", steel), ("above", own)):
            np.testing.assert_allclose(
                rows[name] @ u, [stress[p] for p in pairs], rtol=1e-8, atol=1e-6 * abs(stress).max()
            )


def test_volumes_of_cad_and_of_its_mesh_in_a_file(tmp_path: Path) -> None:
    path = tmp_path / "pair.geo"
    path.write_text(
        'SetFactory("OpenCASCADE");\nBox(1) = {0, 0, 0, 2, 3, 4};\nBox(2) = {0, 0, 4, 2, 3, 1};\n'
        'Physical Volume("block") = {1};\nPhysical Volume("lid") = {2};\n'
    )
    mesh = CadPart(kind="cad", path=str(path), unit=0.01).build(0.01)
    assert {"block", "lid", "solid1", "solid2"} <= mesh.volumes.keys()
    material = Material(**STEEL, volumes={"lid": {**STEEL, "rho": 1000.0}})  # type: ignore[arg-type]
    wanted = 1e-6 * (24 * 7850 + 6 * 1000)
    assert build_model(mesh, material).properties.mass == pytest.approx(wanted, rel=1e-9)
    assert np.array_equal(
        np.sort(np.concatenate([mesh.volumes["block"], mesh.volumes["lid"]])), np.arange(len(mesh.cells))
    )
    import meshio

    for ending, names in (("msh", "gmsh:physical"), ("inp", None)):
        file = tmp_path / f"pair.{ending}"
        sets = {"block": [mesh.volumes["block"]], "lid": [mesh.volumes["lid"]]}
        tags = np.where(np.isin(np.arange(len(mesh.cells)), mesh.volumes["lid"]), 2, 1)
        data = {} if names is None else {"gmsh:physical": [tags], "gmsh:geometrical": [tags]}
        written = meshio.Mesh(
            mesh.nodes, [("tetra10", mesh.cells)], cell_data=data, cell_sets=sets if names is None else {},
            field_data={"block": np.array([1, 3]), "lid": np.array([2, 3])} if names else {},
        )  # fmt: skip
        meshio.write(file, written, **({"file_format": "gmsh22", "binary": False} if ending == "msh" else {}))
        read = MeshFile(kind="file", path=str(file)).build(None)
        assert build_model(read, material).properties.mass == pytest.approx(wanted, rel=1e-9)


def test_no_modes_of_several_materials_have_no_errors() -> None:
    """A body of two materials that keeps static shapes alone has no frequency to judge."""
    material = Material(**STEEL, volumes={"high": Material(**STEEL)})  # type: ignore[arg-type]
    model = build_model(mesh_of(), material)
    found = discretisation_errors(model, material, None, np.empty(0), np.empty((len(model.nodes) * 3, 0)))
    assert found is not None
    assert found.shape == (0,)
