"""Design changes: what moves, what is refused, and that nothing is factorised."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.pipeline.design_change import morph
from gudgeon.pipeline.design_change.family import flexibility_of
from gudgeon.pipeline.design_change.morph import Movement, move_nodes, moved_mesh, reuse
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.elements.solid import mass_properties
from gudgeon.pipeline.geometry import profile
from gudgeon.pipeline.geometry.profile import ProfileTable, read_profile, rows_of
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.stages.keys.products import component_products
from gudgeon.pipeline.stages.mesh import movement_of

ANGLES = np.radians([-180.0, -90.0, 0.0, 90.0, 180.0])
HEIGHTS = np.linspace(0, 0.06, 7)


def barrel(depth: float) -> ProfileTable:
    deviation = -depth * ((HEIGHTS - 0.03) / 0.03) ** 2
    return ProfileTable(HEIGHTS, ANGLES, np.tile(deviation[:, None], 5), "barrel")


def movement(table: ProfileTable | float, surface: str = "skirt") -> Movement:
    return Movement(surface, table, "component.skirt.change.profile")


def test_surface_nodes_move_by_the_table(skirt_mesh: MeshRecord) -> None:
    nodes = move_nodes(skirt_mesh, movement(barrel(20e-6)))
    on = np.unique(skirt_mesh.surfaces["skirt"].facets)
    radius, height = np.hypot(nodes[on, 0], nodes[on, 1]), skirt_mesh.nodes[on, 2]
    np.testing.assert_allclose(radius - 0.04296, -20e-6 * ((height - 0.03) / 0.03) ** 2, atol=1e-12)
    np.testing.assert_array_equal(nodes[on, 2], skirt_mesh.nodes[on, 2])


def test_other_surfaces_stay_and_inner_nodes_follow_softly(skirt_mesh: MeshRecord) -> None:
    shift = np.linalg.norm(move_nodes(skirt_mesh, movement(barrel(20e-6))) - skirt_mesh.nodes, axis=1)
    inner_surface = np.setdiff1d(
        np.unique(skirt_mesh.surfaces["inner"].facets), np.unique(skirt_mesh.surfaces["skirt"].facets)
    )
    assert shift[inner_surface].max() == 0
    assert shift.max() <= 20e-6 * (1 + 1e-9)
    boundary = np.unique(np.concatenate([np.unique(s.facets) for s in skirt_mesh.surfaces.values()]))
    inside = np.setdiff1d(np.arange(len(shift)), boundary)
    assert 0 < shift[inside].max() < 20e-6


def test_uniform_growth_adds_its_volume(skirt_mesh: MeshRecord) -> None:
    table = ProfileTable(HEIGHTS, ANGLES, np.full((7, 5), 30e-6), "growth")
    nodes = move_nodes(skirt_mesh, movement(table))
    gained = mass_properties(replace(skirt_mesh, nodes=nodes), 1.0).mass - mass_properties(skirt_mesh, 1.0).mass
    assert gained == pytest.approx(np.pi * ((0.04296 + 30e-6) ** 2 - 0.04296**2) * 0.06, rel=2e-3)


def test_ovality_turns_with_the_angle(skirt_mesh: MeshRecord) -> None:
    angles = np.radians(np.arange(-180, 181, 15.0))
    table = ProfileTable(HEIGHTS, angles, np.tile(10e-6 * np.cos(2 * angles), (7, 1)), "oval")
    nodes = move_nodes(skirt_mesh, movement(table))
    on = np.unique(skirt_mesh.surfaces["skirt"].facets)
    angle = np.arctan2(nodes[on, 1], nodes[on, 0])
    radius = np.hypot(nodes[on, 0], nodes[on, 1])
    # A cubic spline over 15 degrees leaves 1e-3 of the amplitude.
    np.testing.assert_allclose(radius - 0.04296, 10e-6 * np.cos(2 * angle), atol=2e-8)


def test_table_that_inverts_elements_is_refused_with_the_element(skirt_mesh: MeshRecord) -> None:
    with pytest.raises(
        InputError, match=r"change\.profile\.table: the profile inverts \d+ elements, the worst is element"
    ):
        move_nodes(skirt_mesh, movement(barrel(0.02)))


def test_the_share_that_inverts_nothing_is_the_largest(skirt_mesh: MeshRecord) -> None:
    offset = -0.02
    with pytest.raises(InputError, match="inverts") as refused:
        move_nodes(skirt_mesh, movement(offset))
    (share,) = re.findall(r"allowed: up to ([\d.]+) % of these deviations", str(refused.value))
    assert 0 < float(share) < 100
    move_nodes(skirt_mesh, movement(float(share) / 100 * offset))
    with pytest.raises(InputError, match="inverts"):
        move_nodes(skirt_mesh, movement((float(share) + 0.3) / 100 * offset))


def test_profile_needs_a_cylinder(skirt_mesh: MeshRecord) -> None:
    with pytest.raises(InputError, match="is no cylinder"):
        move_nodes(skirt_mesh, movement(barrel(1e-5), "crown"))
    with pytest.raises(InputError, match="no surface 'hat'"):
        move_nodes(skirt_mesh, movement(barrel(1e-5), "hat"))


def test_recomputed_contact_points_stand_where_reused_ones_do(skirt_mesh: MeshRecord) -> None:
    from gudgeon.pipeline.interfaces.points import contact_points
    from gudgeon.pipeline.scenes.interface import Interface

    change = movement(barrel(20e-6))
    moved = contact_points(moved_mesh(skirt_mesh, change), Interface(surface="skirt"), "here")
    height = moved.points[:, 2]
    radius = np.hypot(moved.points[:, 0], moved.points[:, 1])
    np.testing.assert_allclose(radius, 0.04296 - 20e-6 * ((height - 0.03) / 0.03) ** 2, atol=1e-9)


def test_read_profile(tmp_path: Path) -> None:
    path = tmp_path / "p.csv"
    path.write_text("h\\a,0\n0.0,1e-6\n0.06,3e-6\n")
    table = read_profile(path, scale=2.0)
    np.testing.assert_allclose(table(np.array([0.03]), np.array([1.0])), 4e-6)


def test_numbers_of_a_table_are_parsed_once_while_its_text_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, parsed = tmp_path / "p.csv", []
    monkeypatch.setattr(profile, "rows_of", lambda *given: parsed.append(given) or rows_of(*given))
    path.write_text("h,0\n0.0,1e-6\n0.06,3e-6\n")
    for scale in (1.0, 2.0, -1.0):
        np.testing.assert_array_equal(
            read_profile(path, scale, 1e-6).deviations[:, 0], scale * np.array([1e-6, 3e-6]) + 1e-6
        )
    path.write_text("h,0\n0.0,2e-6\n0.06,3e-6\n")  # Of the same size, maybe in the same tick of the clock.
    assert read_profile(path).deviations[0, 0] == 2e-6
    assert len(parsed) == 2


def test_weights_of_inner_nodes_are_found_once_for_a_mesh(
    skirt_mesh: MeshRecord, monkeypatch: pytest.MonkeyPatch
) -> None:
    trees, tree = [], morph.KDTree
    monkeypatch.setattr(morph, "KDTree", lambda nodes: trees.append(len(nodes)) or tree(nodes))
    morph._followed.cache_clear()
    first = move_nodes(skirt_mesh, movement(1e-6))
    assert len(trees) == 2
    second = move_nodes(skirt_mesh, movement(2e-6))
    assert len(trees) == 2
    np.testing.assert_allclose(second - skirt_mesh.nodes, 2 * (first - skirt_mesh.nodes), atol=1e-15)
    moved = replace(skirt_mesh, nodes=1.5 * skirt_mesh.nodes)
    move_nodes(moved, movement(1e-6))
    assert len(trees) == 4


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "at least two rows"),
        ("h,0,90,180,270,360\n0,0,0,0,0,0\n0.06,0,0\n", "row 3 has 3 cells.*cut off"),
        ("h,0\n0,zero\n1,0\n", "row 2 holds 'zero'"),
        ("h,0\n0,nan\n1,0\n", "finite"),
        ("h,0\n1,0\n0,0\n", "must increase"),
        ("h,0,90,180\n0,0,0,0\n1,0,0,0\n", "span 360"),
        ("h,0,90,180,360\n0,0,0,0,1\n1,0,0,0,0\n", "same direction"),
    ],
)
def test_bad_tables(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "p.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_profile(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_table_must_cover_the_surface(skirt_mesh: MeshRecord) -> None:
    short = ProfileTable(HEIGHTS[:5], ANGLES, np.zeros((5, 5)), "short.csv")
    with pytest.raises(InputError, match=r"short\.csv: heights 0 to 0\.04 m do not cover"):
        move_nodes(skirt_mesh, movement(short))


def component(**given: object) -> Component:
    return Component.model_validate(
        {
            "geometry": {"kind": "skirt", "outer_radius": 0.04296, "wall": 0.004, "height": 0.06, "crown": 0.008},
            "material": {"E": 72e9, "nu": 0.33, "rho": 2700.0},
            "mesh": {"size": 0.012},
            "interface": {
                "thrust": {"surface": "skirt", "sector_deg": [-45, 45]},
                "bottom": {"surface": "open_end"},
                "gas": {"surface": "crown", "kind": "pressure"},
            },
            "modes": {"normal_count": 4},
        }
        | given
    )


def change(**profile: object) -> dict[str, object]:
    return {"change": {"profile": profile}}


@pytest.mark.parametrize("offset", [30e-6, -50e-6])
def test_offset_moves_like_a_constant_table(skirt_mesh: MeshRecord, offset: float) -> None:
    table = ProfileTable(HEIGHTS, ANGLES, np.full((7, 5), offset), "constant")
    by_table = move_nodes(skirt_mesh, movement(table))
    by_offset = move_nodes(skirt_mesh, movement(offset))
    np.testing.assert_allclose(by_offset, by_table, atol=1e-15)
    on = np.unique(skirt_mesh.surfaces["skirt"].facets)
    np.testing.assert_allclose(np.hypot(*by_offset[on, :2].T), 0.04296 + offset, atol=1e-9)


def test_offset_comes_on_top_of_the_table(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("h\\a,0\n0.0,1e-6\n0.06,3e-6\n")
    moved = movement_of(component(**change(table="p.csv", scale=2.0, offset=5e-6)), tmp_path, "skirt")
    assert moved is not None
    np.testing.assert_allclose(moved.deviation(np.array([0.03]), np.array([1.0])), 9e-6)


def test_offset_alone_moves_the_first_interfaces_surface(tmp_path: Path) -> None:
    moved = movement_of(component(**change(offset=5e-6)), tmp_path, "skirt")
    assert moved is not None
    assert moved.surface == "skirt"
    assert movement_of(component(), tmp_path, "skirt") is None


def test_offset_and_supports_are_in_the_keys(tmp_path: Path) -> None:
    def keys(**given: object) -> dict[str, str]:
        made = component_products("skirt", component(**given), tmp_path)
        return {step: product.key for step, product in made.items()}

    base, wider, wide = keys(), keys(**change(offset=2e-5)), keys(**change(offset=1e-5))
    assert base["modes"] == wide["modes"] == wider["modes"]
    assert len({base["morph"], wide["morph"], wider["morph"]}) == 3
    held, twice = keys(supports=["open_end"]), keys(supports=["open_end", "open_end"])
    assert held["mesh"] == base["mesh"]
    assert held["modes"] != base["modes"]
    assert held == twice


@pytest.fixture(scope="module")
def held(skirt_mesh: MeshRecord) -> ModalRecord:
    return reduce_component(skirt_mesh, "ab" * 32, component(supports=["open_end"]), "skirt")


def test_held_body_is_moved_without_rigid_motion(skirt_mesh: MeshRecord, held: ModalRecord) -> None:
    surfaces = {"thrust": "skirt", "bottom": "open_end", "gas": "crown"}
    design = reuse(skirt_mesh, ("a", "b"), held, surfaces, movement(20e-6), 2700.0)
    assert design.rigid_twists.shape == (0, 6)
    assert sorted(design.points) == ["bottom", "thrust"]
    radius = np.hypot(*design.points["thrust"][:, :2].T)
    np.testing.assert_allclose(radius, 0.04296 + 20e-6, atol=1e-9)
    np.testing.assert_array_equal(design.points["bottom"], held.interfaces["bottom"].points)
    assert design.mass > held.mass


@pytest.fixture(scope="module")
def free(skirt_mesh: MeshRecord) -> ModalRecord:
    return reduce_component(skirt_mesh, "ab" * 32, component(), "skirt")


@pytest.mark.parametrize("slope", [1e-3, -2e-3])
@pytest.mark.parametrize("falling", [False, True])
def test_reused_modes_have_mass_centre_and_inertia_of_the_moved_part(
    falling: bool, slope: float, skirt_mesh: MeshRecord, free: ModalRecord
) -> None:
    """A wall that grows by d(h) gains a ring 2 pi R d dh at each height; rigid motions stay mass-normalised."""
    R, H, rho = 0.04296, 0.06, 2700.0
    table = ProfileTable(HEIGHTS, ANGLES, np.tile(slope * np.abs(falling * H - HEIGHTS)[:, None], 5), "cone")
    design = reuse(skirt_mesh, ("a", "b"), free, {"thrust": "skirt", "bottom": "open_end"}, movement(table), rho)
    h = np.linspace(0.0, H, 10_001)
    d = slope * np.abs(falling * H - h)
    ring = [H * (2 * np.pi * rho * (R * d + d**2 / 2) * h**n).mean() for n in range(3)]
    # Chords of the mesh have a little less than the circle.
    assert design.mass - free.mass == pytest.approx(ring[0], rel=1e-2)
    assert design.mass * design.centre[2] - free.mass * free.centre[2] == pytest.approx(ring[1], rel=1e-2)
    about_origin = [record.inertia[0, 0] + record.mass * record.centre[2] ** 2 for record in (free, design)]
    half_ring = H * np.pi * rho * R**3 * d.mean()  # Of y^2 at first order.
    assert about_origin[1] - about_origin[0] == pytest.approx(ring[2] + half_ring, rel=3e-2)
    kinetic = np.zeros((6, 6))
    kinetic[:3, :3], kinetic[3:, 3:] = design.mass * np.eye(3), design.inertia
    np.testing.assert_allclose(design.rigid_twists @ kinetic @ design.rigid_twists.T, np.eye(6), atol=1e-12)


@pytest.mark.parametrize("count", [1, 3, 5])
def test_supports_that_leave_some_rigid_motions_are_refused(
    count: int, skirt_mesh: MeshRecord, held: ModalRecord
) -> None:
    modal = replace(held, rigid_twists=np.eye(6)[:count])
    with pytest.raises(InputError, match="leave some of the rigid motions free, use update 'recompute'"):
        reuse(skirt_mesh, ("a", "b"), modal, {}, movement(20e-6), 2700.0)


def test_inner_nodes_follow_four_neighbours_by_inverse_squares_and_fade_towards_what_stays(
    skirt_mesh: MeshRecord,
) -> None:
    angles, nodes = np.radians(np.arange(-180, 181, 15.0)), skirt_mesh.nodes
    profile = 10e-6 * np.cos(2 * angles) - 20e-6 * ((HEIGHTS[:, None] - 0.03) / 0.03) ** 2
    shift = move_nodes(skirt_mesh, movement(ProfileTable(HEIGHTS, angles, profile, "oval"))) - nodes
    moved = np.unique(skirt_mesh.surfaces["skirt"].facets)
    surfaces = [np.unique(s.facets) for name, s in skirt_mesh.surfaces.items() if name != "skirt"]
    still = np.setdiff1d(np.concatenate(surfaces), moved)
    inner = np.setdiff1d(np.arange(len(nodes)), np.concatenate([moved, still]))
    to_moved, to_still = (np.linalg.norm(nodes[inner, None] - nodes[group], axis=2) for group in (moved, still))
    followed = to_moved <= np.sort(to_moved, axis=1)[:, 3:4] * (1 + 1e-9)  # More where some are equally far.
    weights = np.where(followed, to_moved**-2.0, 0.0)
    mean = weights @ shift[moved] / weights.sum(axis=1)[:, None]
    fade = to_still.min(axis=1) / (to_still.min(axis=1) + to_moved.min(axis=1))
    np.testing.assert_allclose(shift[inner], fade[:, None] * mean, rtol=0, atol=1e-12 * np.abs(shift).max())
    assert np.ptp(fade) > 0.1


GROWN = 2e-3


def grown_part(update: str, **change: object) -> Component:
    """Return a free skirt that grows."""
    shape = {"kind": "skirt", "outer_radius": 0.04296, "wall": 0.004, "height": 0.06, "crown": 0.008}
    return Component.model_validate({
        "geometry": shape, "mesh": {"size": 0.012}, "material": {"E": 71e9, "nu": 0.33, "rho": 2770},
        "interface": {"thrust": {"surface": "skirt", "sector_deg": [-30, 30]}}, "modes": {"normal_count": 6},
        "change": {"update": update, "growth": GROWN, **change},
    })  # fmt: skip


def test_growth_scales_modes_exactly(skirt_mesh: MeshRecord) -> None:
    """Of a body whose lengths grow by s: ω/s, C/s, and mass s³; its true surfaces grow with it."""
    part = grown_part("recompute")
    mesh = skirt_mesh
    moved = movement_of(part, Path(), "skirt")
    assert moved is not None
    larger = moved_mesh(mesh, moved)
    assert larger.surfaces["skirt"].shape["radius"] == (1 + GROWN) * mesh.surfaces["skirt"].shape["radius"]
    base, after = (reduce_component(m, "", part, "skirt") for m in (mesh, larger))
    assert after.mass == pytest.approx(base.mass * (1 + GROWN) ** 3, rel=1e-12)
    np.testing.assert_allclose(after.frequencies * (1 + GROWN), base.frequencies, rtol=1e-9)
    C, grown_C = flexibility_of(base).diagonal(), flexibility_of(after).diagonal()
    np.testing.assert_allclose(grown_C * (1 + GROWN), C, rtol=1e-6)
    design = reuse(mesh, ("", ""), base, {"thrust": "skirt"}, moved, 2770.0)
    np.testing.assert_allclose(design.points["thrust"], after.interfaces["thrust"].points, atol=1e-12)


def test_growth_is_part_of_the_keys_of_mesh_and_design() -> None:
    reused, certified, plain = (component_products("skirt", part, Path())
                                for part in (grown_part("reuse"), grown_part("certified"),
                                             grown_part("certified", growth=0.0)))  # fmt: skip
    assert reused["mesh"].key == reused["base-mesh"].key
    assert reused["morph"].inputs["profile"] == {"growth": GROWN}
    assert certified["designs.0 mesh"].key == certified["base-mesh"].key != certified["mesh"].key
    assert plain["mesh"].key == plain["base-mesh"].key


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"change": {"growth": 0.2}}, r"growth 0\.2 given; allowed: -0\.1 to 0\.1"),
        (
            {"interface": {"bore": {"kind": "traction", "surface": "inner", "spacing": 0.01}}},
            "traction space of interface bore",
        ),
    ],
)
def test_growth_that_is_refused(tables: dict[str, object], message: str) -> None:
    given = grown_part("reuse").model_dump(mode="json", exclude_unset=True) | tables
    with pytest.raises(ValueError, match=message):
        Component.model_validate(given)


def test_a_plane_part_does_not_grow(skirt_mesh: MeshRecord) -> None:
    plane = replace(skirt_mesh, cells=skirt_mesh.cells[:, :3], cell_type="triangle")
    with pytest.raises(InputError, match=r"component\.a\.change\.growth: given; allowed for solids"):
        move_nodes(plane, Movement(None, 0.0, "component.a.change.profile", GROWN))
