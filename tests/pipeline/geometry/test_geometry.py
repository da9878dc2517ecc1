"""Solids drawn in gmsh: volumes and areas against closed forms, sound elements, outward faces, refusals.

The piston's boss, rib and pin bore are integrated over x by Gauss's rule on the exact sections, without gmsh.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel, TypeAdapter, ValidationError

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.elements.reference import nodal_jacobians
from gudgeon.pipeline.fem.elements.solid import mass_properties
from gudgeon.pipeline.geometry import Box, Geometry, Liner, Piston, Plate, Sphere
from gudgeon.pipeline.geometry.surfaces import cylindrical
from gudgeon.pipeline.interfaces.points import contact_points
from gudgeon.pipeline.scenes.interface import Interface

PISTON: dict[str, Any] = {
    "kind": "piston",
    "outer_radius": 0.04296,
    "height": 0.052,
    "crown": 0.008,
    "skirt_height": 0.034,
    "wall": 0.004,
    "pin_radius": 0.011,
    "pin_height": 0.018,
    "pin_offset": 0.0005,
    "boss_radius": 0.016,
    "boss_gap": 0.026,
}
LINER: dict[str, Any] = {
    "kind": "liner",
    "bore_radius": 0.043,
    "wall": 0.006,
    "length": 0.140,
    "flange_height": 0.008,
    "flange_width": 0.005,
}
BOX: dict[str, Any] = {"kind": "box", "lx": 0.04, "ly": 0.03, "lz": 0.02}

VOLUME_CURVED, AREA_CURVED = 1e-4, 1e-3
"""Relative: elements of second order, 14 or more to a full circle; the worst here are at 4e-5 and 6e-4."""
STRAIGHT = 1e-12


@dataclass(frozen=True)
class Case:
    """A geometry, its coarse mesh, and what is known of it."""

    geometry: Piston | Liner | Box | Plate | Sphere
    mesh: MeshRecord
    volume: float
    """[m^3]"""
    areas: dict[str, float]
    """Of each surface [m^2]; `inner` and `crown_inner` of the piston are left out."""
    volume_rtol: float
    area_rtol: float


def over(low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights from low to high; the substitution x = mid + half·sin t takes out roots at both ends."""
    t, w = np.polynomial.legendre.leggauss(80)
    mid, half = (low + high) / 2, (high - low) / 2
    return mid + half * np.sin(t * np.pi / 2), w * np.pi / 2 * half * np.cos(t * np.pi / 2)


def piston_case() -> Case:
    piston = Piston(**PISTON)
    R, r, o = piston.outer_radius, piston.pin_radius, piston.pin_offset
    b, h, under = R - piston.belt_relief, piston.boss_radius, piston.height - piston.crown
    inner, relieved = R - piston.wall, piston.skirt_height + piston.relief_height
    volume = np.pi * R**2 * piston.skirt_height + np.pi * b**2 * (piston.height - relieved) - np.pi * inner**2 * under
    volume += np.pi * piston.relief_height * (R**2 + R * b + b**2) / 3
    half = piston.rib_width / 2
    for low, high in ((o - h, o - half), (o - half, o + half), (o + half, o + h)):
        x, w = over(low, high)
        side = np.sqrt(np.maximum(h**2 - (x - o) ** 2, 0))
        above = under - piston.pin_height if high - low == pytest.approx(piston.rib_width) else side
        volume += 2 * w @ ((side + above) * (np.sqrt(inner**2 - x**2) - piston.boss_gap / 2))
    x, w = over(o - r, o + r)
    side = np.sqrt(np.maximum(r**2 - (x - o) ** 2, 0))
    volume -= 2 * w @ (2 * side * (np.sqrt(R**2 - x**2) - piston.boss_gap / 2))
    angle = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    areas = {
        "skirt": 2 * np.pi * R * piston.skirt_height - 2 * w @ (2 * side * R / np.sqrt(R**2 - x**2)),
        "belt": 2 * np.pi * b * (piston.height - relieved),
        "crown": np.pi * b**2,
        "open_end": np.pi * (R**2 - inner**2),
        "pin_bore": 4 * np.pi * r * np.mean(np.sqrt(R**2 - (o + r * np.cos(angle)) ** 2) - piston.boss_gap / 2),
    }
    return Case(piston, piston.build(0.012), float(volume), areas, VOLUME_CURVED, AREA_CURVED)


def liner_case() -> Case:
    liner = Liner(**LINER)
    r, outer, flange = 0.043, 0.049, 0.054
    areas = {
        "bore": 2 * np.pi * r * 0.140,
        "outer": 2 * np.pi * outer * 0.132,
        "flange": 2 * np.pi * flange * 0.008,
        "flange_under": np.pi * (flange**2 - outer**2),
        "top": np.pi * (flange**2 - r**2),
        "bottom": np.pi * (outer**2 - r**2),
    }
    volume = areas["bottom"] * 0.132 + areas["top"] * 0.008
    return Case(liner, liner.build(0.016), volume, areas, VOLUME_CURVED, AREA_CURVED)


def box_case() -> Case:
    box = Box(**BOX)
    areas = {"left": 6e-4, "right": 6e-4, "front": 8e-4, "back": 8e-4, "bottom": 12e-4, "top": 12e-4}
    return Case(box, box.build(0.01), 24e-6, areas, STRAIGHT, STRAIGHT)


def plate_case() -> Case:
    plate = Plate(kind="plate", lx=0.04, ly=0.03, thickness=0.012, layers=2)
    areas = {"left": 36e-5, "right": 36e-5, "front": 48e-5, "back": 48e-5, "bottom": 12e-4, "top": 12e-4}
    return Case(plate, plate.build(0.01), 144e-7, areas, STRAIGHT, STRAIGHT)


def sphere_case() -> Case:
    ball = Sphere(kind="sphere", radius=0.02)
    volume, area = 4 / 3 * np.pi * 0.02**3, 4 * np.pi * 0.02**2
    return Case(ball, ball.build(0.005), volume, {"surface": area}, VOLUME_CURVED, AREA_CURVED)


@pytest.fixture(scope="module", params=[piston_case, liner_case, box_case, plate_case, sphere_case])
def case(request: pytest.FixtureRequest) -> Case:
    return request.param()


@pytest.fixture(scope="module")
def piston() -> MeshRecord:
    return Piston(**PISTON).build(0.012)


def area_vectors(mesh: MeshRecord, surface: str) -> np.ndarray:
    """Area times outward normal of each facet's corner triangle [m^2], (f, 3)."""
    a, b, c = np.moveaxis(mesh.nodes[mesh.surfaces[surface].facets[:, :3]], 1, 0)
    return np.cross(b - a, c - a) / 2


def test_volume(case: Case) -> None:
    assert mass_properties(case.mesh, 1.0).mass == pytest.approx(case.volume, rel=case.volume_rtol)


def test_surfaces_have_their_areas(case: Case) -> None:
    assert set(case.mesh.surfaces) == set(case.geometry.surface_shapes())
    for name, area in case.areas.items():
        points = contact_points(case.mesh, Interface(surface=name), "test")
        assert points.areas.sum() == pytest.approx(area, rel=case.area_rtol), name


def test_elements_are_sound(case: Case) -> None:
    """No element is near to turning inside out, nor flat: 12 (3V)^⅔ / Σ edge² is 1 where it is regular."""
    jacobians = nodal_jacobians(case.mesh)
    assert (jacobians[:, 0] / jacobians[:, 1]).min() > 0.1
    corners = case.mesh.nodes[case.mesh.cells[:, :4]]
    first, second = np.triu_indices(4, 1)
    squares = ((corners[:, first] - corners[:, second]) ** 2).sum(axis=(1, 2))
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
    assert (12 * (3 * volumes) ** (2 / 3) / squares).min() > 0.3


def test_faces_point_outward(case: Case) -> None:
    for name, shape in case.geometry.surface_shapes().items():
        vectors = area_vectors(case.mesh, name)
        if shape["kind"] == "plane":
            assert (vectors @ np.array(shape["normal"])).min() > 0, name
            continue
        middles = case.mesh.nodes[case.mesh.surfaces[name].facets[:, :3]].mean(axis=1)
        radial = middles - np.array(shape["origin"])
        if shape["kind"] == "cylinder":
            radial -= np.outer(radial @ shape["axis"], shape["axis"])
        sign = -1 if name in ("bore", "inner", "pin_bore") else 1
        assert (sign * np.einsum("fi,fi->f", vectors, radial)).min() > 0, name


def test_same_mesh_twice(case: Case) -> None:
    sizes = {"piston": 0.012, "liner": 0.016, "box": 0.01, "plate": 0.01, "sphere": 0.005}
    again = case.geometry.build(sizes[case.geometry.kind])
    np.testing.assert_array_equal(again.nodes, case.mesh.nodes)
    np.testing.assert_array_equal(again.cells, case.mesh.cells)


def test_contact_points_of_the_skirt(piston: MeshRecord) -> None:
    sector = Interface(surface="skirt", sector_deg=(-45.0, 45.0))
    points = contact_points(piston, sector, "test")
    radius, angle, height = cylindrical(points.points, piston.surfaces["skirt"].shape)
    assert radius == pytest.approx(0.04296, rel=1e-14)
    assert np.degrees(np.abs(angle)).max() <= 45
    assert height.min() >= -1e-12
    assert height.max() <= 0.034 + 1e-12
    np.testing.assert_allclose(points.normals[:, :2], points.points[:, :2] / 0.04296, rtol=0, atol=1e-12)


@pytest.mark.parametrize(("parameters", "surface"), [(PISTON, "skirt"), (LINER, "bore")])
def test_thrust_sides_have_no_seam(parameters: dict[str, Any], surface: str) -> None:
    """Along a seam a row of corners runs from end to end at one angle; away from it no two neighbours share theirs."""
    geometry = TypeAdapter(Geometry).validate_python(parameters)
    assert isinstance(geometry, Piston | Liner)
    mesh = geometry.build(0.016)
    corners = np.unique(mesh.surfaces[surface].facets[:, :3])
    _, angle, height = cylindrical(mesh.nodes[corners], mesh.surfaces[surface].shape)
    within = (height > 1e-6) & (height < height.max() - 1e-6)

    def on(degrees: float) -> int:
        return int(np.count_nonzero(within & (np.abs(np.degrees(angle) - degrees) < 1e-6)))

    assert on(90.0) >= 2
    assert on(-90.0) >= 2
    assert on(0.0) == 0
    assert on(180.0) + on(-180.0) == 0


def test_mass_of_the_piston_is_a_passenger_car_s(piston: MeshRecord) -> None:
    assert 0.3 < mass_properties(piston, 2700.0).mass < 0.5


def test_flat_elements_are_refused() -> None:
    """gmsh's usual algorithm makes a triangle of three nodes on the rib's straight edge at this size."""

    class Usual(Piston):
        OPTIONS = {"Geometry.OCCUnionUnify": 0}  # noqa: RUF012

    with pytest.raises(InputError, match=r"mesh.size: at 0.005 m gmsh makes \d+ flat elements, try another size"):
        Usual(**PISTON).build(0.005)


@pytest.mark.parametrize(
    ("parameters", "key", "value", "message"),
    [
        (PISTON, "wall", 0.05, "wall is 0.05 m, it must be below outer_radius = 0.04296 m"),
        (PISTON, "crown", 0.06, "crown is 0.06 m, it must be below height = 0.052 m"),
        (PISTON, "belt_relief", 0.004, "belt_relief is 0.004 m, it must be below wall = 0.004 m"),
        (PISTON, "skirt_height", 0.05, "skirt_height is 0.05 m, it must be below height - relief_height = 0.048 m"),
        (PISTON, "pin_radius", 0.016, "pin_radius is 0.016 m, it must be below boss_radius = 0.016 m"),
        (PISTON, "boss_radius", 0.019, "boss_radius is 0.019 m, it must be below pin_height = 0.018 m"),
        (PISTON, "pin_height", 0.030, "boss_radius is 0.016 m, it must be below height - crown - pin_height = 0.014 m"),
        (PISTON, "skirt_height", 0.029, "pin_radius is 0.011 m, it must be below skirt_height - pin_height = 0.011 m"),
        (PISTON, "pin_offset", -0.03, "boss_radius + |pin_offset| is 0.046 m, it must be below outer_radius - wall ="),
        (PISTON, "boss_gap", 0.071, "boss_gap is 0.071 m, it must be below the skirt's inner width at the sides of"),
        (PISTON, "rib_width", 0.032, "rib_width is 0.032 m, it must be below 2 boss_radius = 0.032 m"),
        (PISTON, "pin_offset", float("nan"), "finite number"),
        (LINER, "flange_height", 0.14, "flange_height is 0.14 m, it must be below length = 0.14 m"),
        (LINER, "flange_width", 0.0, "greater than 0"),
        (BOX, "lz", -0.02, "greater than 0"),
    ],
)
def test_what_does_not_fit_is_refused(parameters: dict[str, Any], key: str, value: float, message: str) -> None:
    with pytest.raises(ValidationError) as caught:
        TypeAdapter(Geometry).validate_python({**parameters, key: value})
    assert message in str(caught.value)


@pytest.mark.parametrize(("parameters", "member"), [(PISTON, Piston), (LINER, Liner), (BOX, Box)])
def test_members_are_told_apart_by_kind(parameters: dict[str, Any], member: type[BaseModel]) -> None:
    assert type(TypeAdapter(Geometry).validate_python(parameters)) is member
