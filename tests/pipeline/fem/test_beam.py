"""Beams against closed forms: frequencies of both theories, sections, statics, and the stress that a gauge reads."""

from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError
from scipy import linalg

from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry import Geometry
from gudgeon.pipeline.geometry.section import Section
from gudgeon.pipeline.geometry.shapes.beam import Beam
from gudgeon.pipeline.interfaces.loads import load_rows
from gudgeon.pipeline.interfaces.points import contact_points
from gudgeon.pipeline.modes.normal import NormalModes, normal_modes
from gudgeon.pipeline.reduction.methods import REDUCTIONS, ContactRows
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.scenes.modes import ModesSettings
from gudgeon.pipeline.scenes.supports import Support

STEEL = Material(E=2.1e11, nu=0.3, rho=7800.0)
SECTION = {"kind": "rectangle", "width": 0.01, "height": 0.1}
AREA, SECOND, LENGTH = 1e-3, 0.01 * 0.1**3 / 12, 2.0
PINNED = (Support(surface="left", hold=("z",)), Support(surface="right", hold=("z",)))
TABLE: dict[str, Any] = {"kind": "beam", "length": LENGTH, "section": SECTION, "stations": {"mid": 1.0, "third": 0.7}}


def beam(theory: str = "euler-bernoulli", **changes: Any) -> Beam:
    return Beam.model_validate(TABLE | {"theory": theory} | changes)


def modes_of(geometry: Beam, elements: int, supports: tuple[Support | str, ...], count: int) -> NormalModes:
    return normal_modes(model_of(geometry, elements, supports), count)


def model_of(geometry: Beam, elements: int, supports: tuple[Support | str, ...] = ()) -> FEModel:
    return build_model(geometry.build(LENGTH / elements), STEEL, supports, geometry=geometry)


def wave_numbers(omega: np.ndarray) -> np.ndarray:
    """β L of Euler-Bernoulli from ω."""
    return np.sqrt(omega / np.sqrt(STEEL.E * SECOND / (STEEL.rho * AREA))) * LENGTH


@pytest.mark.parametrize(
    ("supports", "rigid", "exact"),
    [
        (PINNED, 0, np.pi * np.arange(1, 4)),
        ((), 2, [4.730040744862704, 7.853204624095838, 10.995607838001671]),
        (("left",), 0, [1.8751040687119611, 4.694091132974174, 7.854757438237613]),
        (PINNED[:1], 1, [3.926602312047919, 7.068582745628732, 10.210176122813031]),
        (("left", "right"), 0, [4.730040744862704, 7.853204624095838, 10.995607838001671]),
    ],
    ids=["pinned-pinned", "free-free", "clamped-free", "pinned-free", "clamped-clamped"],
)
def test_euler_bernoulli_frequencies(supports: tuple[Support | str, ...], rigid: int, exact: list[float]) -> None:
    """Roots of the frequency equations (Blevins 1979, table 8-1); Hermite elements are off by (βh)⁴/1440."""
    model = model_of(beam(), 120, supports)
    assert model.rigid_twists.shape == (rigid, 6)
    modes = normal_modes(model, 3)
    np.testing.assert_allclose(wave_numbers(modes.angular_frequencies), exact, rtol=1e-6)


def test_rigid_motions_are_stress_free_and_mass_orthonormal() -> None:
    for theory in ("euler-bernoulli", "timoshenko"):
        model = model_of(beam(theory), 16)
        rigid = model.rigid_modes
        np.testing.assert_allclose(rigid.T @ (model.M @ rigid), np.eye(2), atol=1e-12)
        assert np.abs(model.K @ rigid).max() < 1e-12 * abs(model.K).max() * np.abs(rigid).max()
        turn = model.nodal(rigid)[:, :, 1]
        expected = np.cross(model.rigid_twists[1, 3:], model.nodes - model.properties.centre)
        np.testing.assert_allclose(turn, expected, atol=1e-12)


def test_pinned_beam_of_one_hinge_turns_about_it() -> None:
    model = model_of(beam(), 16, PINNED[:1])
    (twist,) = model.rigid_twists
    assert twist[2] / twist[4] == pytest.approx(-LENGTH / 2, rel=1e-12)
    assert model.rigid_modes[0, 0] == 0.0


def exact_timoshenko(count: int) -> np.ndarray:
    """Both branches of a pinned-pinned beam: w = sin kx, θ = cos kx, k = nπ/L, and n = 0 of the second (rad/s)."""
    shear = 5 / 6 * STEEL.E / 2 / (1 + STEEL.nu) * AREA
    mass = np.diag([STEEL.rho * AREA, STEEL.rho * SECOND])
    found = [np.sqrt(shear / (STEEL.rho * SECOND))]
    for n in range(1, 30):
        k = n * np.pi / LENGTH
        stiffness = np.array([[shear * k**2, shear * k], [shear * k, STEEL.E * SECOND * k**2 + shear]])
        found += list(np.sqrt(linalg.eigh(stiffness, mass, eigvals_only=True)))
    return np.sort(found)[:count]


def test_timoshenko_frequencies_of_both_branches() -> None:
    """The second branch begins at √(κGA/ρI), here the 26th of all; elements are off by (kh)⁴/1440."""
    exact = exact_timoshenko(28)
    cut_on = np.sqrt(5 / 6 * STEEL.E / 2.6 * AREA / (STEEL.rho * SECOND))
    assert (np.abs(exact / cut_on - 1) < 1e-12).sum() == 1
    found = modes_of(beam("timoshenko"), 160, PINNED, 28).angular_frequencies
    np.testing.assert_allclose(found[:4], exact[:4], rtol=1e-6)
    np.testing.assert_allclose(found, exact, rtol=3e-4)
    np.testing.assert_allclose(found[np.abs(exact / cut_on - 1) < 1e-12], cut_on, rtol=1e-9)


@pytest.mark.parametrize("theory", ["euler-bernoulli", "timoshenko"])
def test_frequencies_converge_to_the_fourth_order(theory: str) -> None:
    plain = beam(theory, stations={})
    exact = (
        exact_timoshenko(3)[2]
        if theory == "timoshenko"
        else (3 * np.pi / LENGTH) ** 2 * np.sqrt(STEEL.E * SECOND / (STEEL.rho * AREA))
    )
    sizes = np.array([8, 12, 16, 24])
    errors = [modes_of(plain, n, PINNED, 3).angular_frequencies[2] / exact - 1 for n in sizes]
    assert -np.polyfit(np.log(sizes), np.log(errors), 1)[0] == pytest.approx(4.0, abs=0.2)


def test_slender_timoshenko_does_not_lock() -> None:
    thin = beam("timoshenko", section={"kind": "rectangle", "width": 0.01, "height": 1e-3})
    slender = np.sqrt(STEEL.E * 1e-6 / 12 / STEEL.rho)
    found = modes_of(thin, 20, PINNED, 1).angular_frequencies[0]
    assert found == pytest.approx((np.pi / LENGTH) ** 2 * slender, rel=5e-6)


SECTIONS: list[tuple[dict[str, Any], float, float, float]] = [
    (SECTION, 1e-3, SECOND, 5 / 6),
    ({"kind": "circle", "radius": 0.02}, np.pi * 4e-4, np.pi * 0.02**4 / 4, 0.9),
    ({"kind": "i-beam", "height": 0.1, "width": 0.05, "flange": 0.01, "web": 0.05}, 5e-3, 0.05 * 1e-3 / 12, 5 / 6),
    (
        {"kind": "i-beam", "height": 0.2, "width": 0.1, "flange": 0.01, "web": 0.006},
        2 * 1e-3 + 0.18 * 0.006,
        0.1 * 0.2**3 / 12 - 0.094 * 0.18**3 / 12,
        0.38307,
    ),
    (
        {"kind": "general", "area": 2e-3, "second_moment": 3e-6, "height": 0.1, "shear_coefficient": 0.4},
        2e-3,
        3e-6,
        0.4,
    ),
]


@pytest.mark.parametrize(("table", "area", "second", "kappa"), SECTIONS)
def test_sections(table: dict[str, Any], area: float, second: float, kappa: float) -> None:
    """An I-beam whose web is as wide as its flanges is a rectangle; the other is near web × height / area."""
    geometry = beam("timoshenko", section=table)
    assert geometry.section.area == pytest.approx(area, rel=1e-12)
    assert geometry.section.second_moment == pytest.approx(second, rel=1e-12)
    assert geometry.shear_coefficient == pytest.approx(kappa, rel=1e-5 if kappa == 0.38307 else 1e-12)
    assert beam(section=table | {"shear_coefficient": 0.7}).shear_coefficient == 0.7


def test_shear_form_is_the_energy_of_the_shear_stress() -> None:
    """κ of an I-beam by brute force over its height."""
    section: Any = TypeAdapter(Section).validate_python(SECTIONS[3][0])
    z = (np.arange(200_000) + 0.5) / 200_000 * 0.1
    width = np.where(z > 0.09, 0.1, 0.006)
    Q = np.cumsum((width * z)[::-1])[::-1] * (z[1] - z[0])
    energy = 2 * (Q**2 / width).sum() * (z[1] - z[0])
    assert section.shear_form == pytest.approx(section.second_moment**2 / (section.area * energy), rel=1e-4)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"stations": {"mid": 2.0}}, "mid = 2.0 given, a station is between 0 and the length 2.0 m"),
        ({"stations": {"left": 1.0}}, "'left' given"),
        ({"stations": {"mid-top": 1.0}}, "'mid-top' given"),
        ({"stations": {"a": 1.0, "b": 1.0 + 1e-9}}, "of the length apart from each other"),
        ({"section": SECTIONS[3][0] | {"flange": 0.1}}, "0.1 given, two flanges must be lower than the height 0.2 m"),
        ({"section": SECTIONS[3][0] | {"web": 0.11}}, "0.11 given, the web is at most as thick as the flanges"),
        (
            {"theory": "timoshenko", "section": {"kind": "general", "area": 1.0, "second_moment": 1.0, "height": 1.0}},
            "'timoshenko' given, it needs section.shear_coefficient",
        ),
        ({"theory": "rayleigh"}, "Input should be 'euler-bernoulli' or 'timoshenko'"),
    ],
)
def test_what_does_not_fit_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError) as caught:
        TypeAdapter(Geometry).validate_python(TABLE | change)
    assert message in str(caught.value)


@pytest.mark.parametrize("theory", ["euler-bernoulli", "timoshenko"])
def test_surfaces_stand_at_stations(theory: str) -> None:
    mesh = beam(theory).build(0.3)
    assert np.diff(np.sort(mesh.nodes[mesh.cells[:, :2]][:, :, 0])).max() <= 0.3 * (1 + 1e-12)
    for name, x in {"left": 0.0, "mid": 1.0, "third": 0.7, "right": LENGTH}.items():
        for side, sign in (("top", 1.0), ("bottom", -1.0)):
            points = contact_points(mesh, Interface(surface=f"{name}-{side}"), "here")
            np.testing.assert_allclose(points.points, [[x, 0, sign * 0.05]], atol=1e-15)
            np.testing.assert_allclose(mesh.nodes[points.nodes], [[x, 0, 0]], atol=1e-15)
            np.testing.assert_array_equal(points.normals, [[0, 0, sign]])


def test_mean_of_an_end_moves_as_the_beam() -> None:
    model = model_of(beam(), 8)
    load = load_rows(model, Interface(surface="right", kind="mean"), "here")
    np.testing.assert_allclose(load.B @ model.rigid_modes, load.resultant @ _at_origin(model).T, atol=1e-12)


def _at_origin(model: FEModel) -> np.ndarray:
    twists = model.rigid_twists.copy()
    twists[:, :3] -= np.cross(twists[:, 3:], model.properties.centre)
    return twists


def component(theory: str, reduction: str, supports: list[Any], **modes: Any) -> Component:
    count = 2 if reduction == "attachment" else 3  # Two rows have two attachment modes.
    return Component.model_validate(
        {
            "geometry": TABLE | {"theory": theory},
            "material": STEEL.model_dump(),
            "mesh": {"size": 0.1},
            "supports": supports,
            "interface": {"hit": {"surface": "mid-bottom"}, "tip": {"surface": "right-top"}},
            "gauge": {
                "under": {"station": "third", "fibre": "bottom"},
                "root": {"station": "left", "fibre": "top"},
                "middle": {"station": "mid", "fibre": "top"},
                "moment": {"station": "third", "quantity": "bending-moment"},
                "shear": {"station": "third", "quantity": "shear-force"},
                "held": {"station": "left", "quantity": "bending-moment"},
            },
            "modes": {"reduction": reduction, "normal_count": count, "reference": "left"} | modes,
        }
    )


@pytest.mark.parametrize("theory", ["euler-bernoulli", "timoshenko"])
@pytest.mark.parametrize("static_count", [0, 1])
@pytest.mark.parametrize("reduction", sorted(set(REDUCTIONS) - {"rigid", "normal+static"}))
def test_gauge_of_a_cantilever_reads_moment_over_modulus(theory: str, reduction: str, static_count: int) -> None:
    """Force F up at the tip and P down at x = 1: M = E I w″ = F (L − x) − P (1 − x), σ(top) = −M / W."""
    item = component(theory, reduction, ["left"], static_count=static_count)
    record = reduce_component(item.geometry.build(0.1), "ab" * 32, item, "beam")
    P, F = 400.0, 150.0
    forces = np.zeros(2)
    forces[record.interface_rows["hit"][0]], forces[record.interface_rows["tip"][0]] = P, F
    rows = np.vstack([record.interfaces[name].rows for name in sorted(record.interfaces)])
    q = (rows / record.angular_frequencies**2).T @ forces
    modulus = SECOND / 0.05
    for name, x, sign in (("root", 0.0, -1.0), ("under", 0.7, 1.0), ("middle", 1.0, -1.0)):
        gauge = record.gauges[name]
        assert gauge.unit == "Pa"
        (value,) = gauge.rows @ q + gauge.residual @ forces
        moment = F * (LENGTH - x) - P * (1.0 - x)
        assert value == pytest.approx(sign * moment / modulus, rel=1e-7)
    exact = {"moment": F * (LENGTH - 0.7) - P * 0.3, "held": F * LENGTH - P, "shear": F - P}
    for name, force in exact.items():
        gauge = record.gauges[name]
        assert gauge.unit == ("N" if name == "shear" else "N m")
        assert (gauge.rows @ q + gauge.residual @ forces)[0] == pytest.approx(force, rel=1e-6)


def test_gauge_of_a_free_beam_reads_its_inertia() -> None:
    """A unit force down at its middle, and inertia 1/L up along it: M = x²/(2 L)."""
    item = component("euler-bernoulli", "macneal", [])
    assert isinstance(item.geometry, Beam)
    record = reduce_component(item.geometry.build(0.1), "ab" * 32, item, "beam")
    row = record.interface_rows["hit"][0]
    gauge, rows = record.gauges["under"], record.interfaces["hit"].rows
    ours = gauge.rows @ (rows / record.angular_frequencies**2).T + gauge.residual[:, row : row + 1]
    assert ours.item() == pytest.approx(0.7**2 / (2 * LENGTH) / (SECOND / 0.05), rel=1e-6)


def test_pictures_get_nodal_displacements() -> None:
    item = component("timoshenko", "macneal", ["left"])
    mesh = item.geometry.build(0.1)
    record = reduce_component(mesh, "ab" * 32, item, "beam")
    assert record.shapes is not None
    assert record.shapes.shape == (len(mesh.nodes), 3, 3)
    assert np.all(record.shapes[:, :2] == 0)
    assert np.all(record.shapes[0] == 0)
    assert record.inertia_couplings is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"gauge": {"g": {"station": "end", "fibre": "top"}}}, "g: station 'end' given, the beam has left, mid, third"),
        (
            {"modes": {"reduction": "rigid"}},
            "reduction 'rigid' given; a gauge needs a reduction with elastic coordinates",
        ),
        ({"material": None}, "is missing; geometry 'beam' needs E, nu and rho"),
        (
            {"geometry": {"kind": "bar", "length": 1.0, "area": 1.0}},
            "under, root, middle, moment, shear, held given; gauges need a beam, solid or plane",
        ),
    ],
)
def test_gauges_that_do_not_fit_are_refused(change: dict[str, Any], message: str) -> None:
    tables = component("timoshenko", "macneal", []).model_dump()
    with pytest.raises(ValidationError) as caught:
        Component.model_validate(tables | change)
    assert message in str(caught.value)


def test_contact_along_the_axis_is_refused() -> None:
    item = component("euler-bernoulli", "macneal", [])
    wrong = item.model_copy(update={"interface": {"end": Interface(surface="right")}})
    with pytest.raises(Exception, match=r"component\.beam\.interface\.end\.surface: 'right' given, the beam does not"):
        reduce_component(item.geometry.build(0.1), "ab" * 32, wrong, "beam")


@pytest.mark.parametrize("parts", [1, 2, 4, 8])
@pytest.mark.parametrize("theory", ["euler-bernoulli", "timoshenko"])
def test_substructures_have_the_frequencies_of_the_whole(theory: str, parts: int) -> None:
    model = model_of(beam(theory), 80)
    rows = model.rows(model.mesh.surfaces["right-top"].facets[0], np.array([[0, 0, 1.0]]))
    settings = ModesSettings(reduction="craig-bampton", normal_count=3, substructures=parts, fixed_count=18)
    reduction = REDUCTIONS["craig-bampton"](model, ContactRows(rows, np.empty((1, 0))), settings)
    whole = normal_modes(model, 3).angular_frequencies
    np.testing.assert_allclose(reduction.angular_frequencies, whole, rtol=1e-4)
    assert reduction.quality["boundary_dofs"] == 2 * (parts - 1) + 1 + reduction.quality["boundary_added"]
    assert reduction.quality["boundary_added"] == (1 if parts == 1 else 0)
