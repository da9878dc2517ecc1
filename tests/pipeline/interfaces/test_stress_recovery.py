"""Stress and strain at points and on surfaces: exact fields, beam theory, and static solutions of the full model."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon import run
from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.geometry.shapes.skirt import Skirt
from gudgeon.pipeline.geometry.shapes.sphere import Sphere
from gudgeon.pipeline.interfaces.gauges import gauge_rows
from gudgeon.pipeline.interfaces.loads import load_rows
from gudgeon.pipeline.interfaces.points import contact_points
from gudgeon.pipeline.interfaces.stress_recovery import hooke, strain_rows, von_mises
from gudgeon.pipeline.interfaces.tie import tie_of, tie_rows
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.gauge import Gauge
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.pipeline.scenes.material import Material

LX, LY, LZ = 0.02, 0.03, 0.1
STEEL = {"E": 2e11, "nu": 0.3, "rho": 7800.0}
ROUND_OFF = 1e-9
"""Of the largest stress: static solutions of a thousand dofs."""


@pytest.fixture(scope="module")
def mesh() -> MeshRecord:
    return Box(kind="box", lx=LX, ly=LY, lz=LZ).build(0.02)


def part(gauge: dict[str, Any], **more: Any) -> Component:
    return Component.model_validate(
        {"geometry": {"kind": "box", "lx": LX, "ly": LY, "lz": LZ}, "material": STEEL, "gauge": gauge} | more
    )


def under_end_loads(mesh: MeshRecord, motion: int) -> tuple[FEModel, np.ndarray]:
    """Return a free box and its displacement under a pair of unit forces or moments on its ends, spread linearly."""
    model = build_model(mesh, Material.model_validate(STEEL))
    ties = [tie_of(mesh, Interface(surface=s, kind="tie", tie="rbe3"), "t") for s in ("bottom", "top")]
    bottom, top = (tie_rows(model, tie).B[motion].toarray().T for tie in ties)
    return model, Flexibility(model).solve(top - bottom)


def test_linear_and_quadratic_fields_are_met(mesh: MeshRecord) -> None:
    x, y, z = mesh.nodes.T
    S = strain_rows(mesh, np.arange(len(mesh.nodes)))
    u = np.column_stack([x * y + 2 * y, y * z + x * x, z * x - x])
    expected = np.column_stack([y, z, x, (x + 2 + 2 * x) / 2, y / 2, (z - 1) / 2])
    np.testing.assert_allclose((S @ u.ravel()).reshape(-1, 6), expected, atol=1e-12)
    turn = np.cross([1.0, -2.0, 3.0], mesh.nodes)
    np.testing.assert_allclose(S @ turn.ravel(), 0, atol=1e-12)


def test_tension_has_one_stress_everywhere(mesh: MeshRecord) -> None:
    """The patch test, at points between nodes and on a surface."""
    gauge = {"in": {"point": [0.003, 0.004, 0.05]}, "on": {"surface": "left"}, "e": {"point": [0, 0, 0.03]}}
    gauge["e"]["quantity"] = "strain"
    model, u = under_end_loads(mesh, 2)
    rows = gauge_rows(model, part(gauge), "component.rod")
    sigma = 1 / (LX * LY)
    exact = sigma * np.array([0, 0, 1, 0, 0, 0])
    np.testing.assert_allclose((rows["in"] @ u).ravel(), exact, atol=ROUND_OFF * sigma)
    on = (rows["on"] @ u).reshape(-1, 6)
    np.testing.assert_allclose(on, np.tile(exact, (len(on), 1)), atol=ROUND_OFF * sigma)
    strain = sigma / STEEL["E"] * np.array([-0.3, -0.3, 1, 0, 0, 0])
    np.testing.assert_allclose((rows["e"] @ u).ravel(), strain, atol=ROUND_OFF * strain.max())


def test_pure_bending_has_a_linear_stress(mesh: MeshRecord) -> None:
    _, u = under_end_loads(mesh, 3)
    nodes = np.arange(len(mesh.nodes))
    strain = (strain_rows(mesh, nodes) @ u).reshape(-1, 6)
    stress = strain @ hooke(Material(**STEEL))
    expected = np.zeros_like(stress)
    expected[:, 2] = mesh.nodes[:, 1] / (LX * LY**3 / 12)
    np.testing.assert_allclose(stress, expected, atol=ROUND_OFF * expected.max())


def test_a_cantilever_under_a_tip_force_follows_beam_theory() -> None:
    """σ = F (L − z) y / I, away from clamp and force; shear makes plane stress states, the lateral ones vanish."""
    mesh = Box(kind="box", lx=LX, ly=LX, lz=0.2).build(0.01)
    model = build_model(mesh, Material(**STEEL), ["bottom"])
    tie = tie_of(mesh, Interface(surface="top", kind="tie", tie="rbe3"), "t")
    u = Flexibility(model).solve(tie_rows(model, tie).B[1].toarray().T)
    for z in (0.06, 0.1, 0.14):
        # Load upwards: compression on the upper side.
        gauge = part({"up": {"point": [0, LX / 2, z]}, "down": {"point": [0, -LX / 2, z]}})
        rows = gauge_rows(model, gauge, "component.rod")
        beam = -(0.2 - z) * (LX / 2) / (LX**4 / 12)
        for name, sign in (("up", 1), ("down", -1)):
            stress = (rows[name] @ u).ravel()
            assert stress[2] == pytest.approx(sign * beam, rel=0.02)  # two elements across
            assert np.abs(stress[[0, 1, 3, 4, 5]]).max() < 0.03 * abs(beam)


def test_a_sphere_under_pressure_is_under_its_pressure_everywhere() -> None:
    """Curved elements carry a uniform state exactly: a pressure's consistent forces are those of p on the facets."""
    mesh = Sphere(kind="sphere", radius=0.05).build(0.02)
    model = build_model(mesh, Material(**STEEL))
    u = Flexibility(model).solve(load_rows(model, Interface(surface="surface", kind="pressure"), "p").B.T.toarray())
    ball = Component.model_validate(
        {
            "geometry": {"kind": "sphere", "radius": 0.05},
            "material": STEEL,
            "gauge": {"pole": {"point": [0, 0, 0.05]}, "skin": {"surface": "skin"}},
        }
    )
    rows = gauge_rows(model, ball, "component.ball")
    assert rows["skin"].shape[0] == 6 * len(np.unique(mesh.surfaces["surface"].facets))
    for name in rows:
        stress = (rows[name] @ u).reshape(-1, 6)
        np.testing.assert_allclose(stress, np.tile([-1.0, -1, -1, 0, 0, 0], (len(stress), 1)), atol=ROUND_OFF)


SKIRT = {"kind": "skirt", "outer_radius": 0.043, "wall": 0.012, "height": 0.04, "crown": 0.012}
READ = {"inside": {"point": [0.037, 0.0, 0.02]}, "outside": {"surface": "skirt"}}


def skirt(settings: dict[str, Any], **more: Any) -> tuple[MeshRecord, FEModel, Component]:
    component = Component.model_validate(
        {
            "geometry": SKIRT,
            "material": {"E": 72e9, "nu": 0.33, "rho": 2700.0},
            "gauge": READ,
            "interface": {"thrust": {"surface": "skirt", "sector_deg": [-60, 60]}},
            "modes": settings,
        }
        | more
    )
    mesh = Skirt.model_validate(SKIRT).build(0.02)
    return mesh, build_model(mesh, component.material, component.supports), component


def static(record: ModalRecord, forces: np.ndarray) -> np.ndarray:
    return (record.interfaces["thrust"].rows.T @ forces) / record.angular_frequencies**2


@pytest.mark.parametrize(
    ("settings", "supports"),
    [
        ({"normal_count": 1}, []),
        ({"normal_count": 12, "static_count": 4}, []),
        ({"normal_count": 3}, ["open_end"]),
        ({"reduction": "ritz", "normal_count": 5}, []),
        ({"reduction": "rubin", "normal_count": 2}, []),
    ],
)
def test_contact_loads_make_the_stress_of_the_full_model(settings: dict[str, Any], supports: list[str]) -> None:
    """At any number of coordinates, straight and curved: the residual part adds what the modes lack."""
    mesh, model, component = skirt(settings, supports=supports)
    record = reduce_component(mesh, "ab" * 32, component, "cup")
    forces = np.random.default_rng(2).random(len(record.interfaces["thrust"].areas))
    points = contact_points(mesh, component.interface["thrust"], "i")
    u = Flexibility(model).solve(model.rows(points.nodes, points.normals).T @ forces[:, None])
    exact = {name: (S @ u).ravel() for name, S in gauge_rows(model, component, "component.cup").items()}
    q, gauge, field = static(record, forces), record.gauges["inside"], record.gauges["outside"]
    assert gauge.unit == field.unit == "Pa"
    np.testing.assert_array_equal(field.nodes, np.unique(mesh.surfaces["skirt"].facets))
    np.testing.assert_allclose(
        gauge.rows @ q + gauge.residual @ forces, exact["inside"], atol=1e-9 * np.abs(exact["inside"]).max()
    )
    found = field.rows @ q + field.residual @ forces
    np.testing.assert_allclose(found.ravel(), exact["outside"], atol=1e-9 * np.abs(exact["outside"]).max())
    if "normal_count" in settings and settings["normal_count"] == 1:
        assert np.abs((field.rows @ q).ravel() - exact["outside"]).max() > 0.1 * np.abs(exact["outside"]).max()


def test_without_residual_nothing_is_added() -> None:
    mesh, _, component = skirt({"reduction": "normal+static", "normal_count": 4})
    record = reduce_component(mesh, "ab" * 32, component, "cup")
    assert not record.gauges["inside"].residual.any()
    assert record.gauges["outside"].residual.shape == (6 * len(record.gauges["outside"].nodes), 0)


def test_von_mises_of_simple_states() -> None:
    tension, shear, pressure = [5.0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 3.0, 0], [-7.0, -7, -7, 0, 0, 0]
    np.testing.assert_allclose(von_mises(np.array([tension, shear, pressure])), [5.0, 3 * np.sqrt(3), 0.0])


@pytest.mark.parametrize(
    ("gauge", "message"),
    [
        ({"point": [0.0, 0.0, 0.11]}, r"component\.rod\.gauge\.g\.point: \[0\.0, 0\.0, 0\.11\] given, it lies outside"),
        ({"point": [9.0, 0.0, 0.0]}, r"gauge\.g\.point: .* outside the part; the nearest node is 8\.99"),
        ({"surface": "pin"}, r"component\.rod\.gauge\.g\.surface: the mesh has no surface 'pin', it has"),
    ],
)
def test_places_that_the_part_lacks_are_refused(mesh: MeshRecord, gauge: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        gauge_rows(build_model(mesh, Material(**STEEL)), part({"g": gauge}), "component.rod")


@pytest.mark.parametrize(
    ("gauge", "message"),
    [
        ({}, "none given; exactly one of station, point and surface is needed"),
        ({"point": [0, 0, 0], "surface": "top"}, "point and surface given; exactly one of"),
        ({"point": [0, 0, 0], "fibre": "top"}, "fibre, 'top' or 'bottom', must be given with a station, and only then"),
        ({"station": "mid"}, "must be given with a station"),
        ({"station": "mid", "fibre": "top", "direction": [1, 0, 0]}, "direction is that of a strain gauge at a point"),
        ({"point": [0, 0, 0], "length": 1e-3}, "length is that of a strain gauge's grid; give its direction"),
        ({"station": "mid", "fibre": "top", "quantity": "shear-force"}, "of a whole section: give a station, and no f"),
        ({"point": [0, 0, 0], "quantity": "bending-moment"}, "'bending-moment' is of a whole section: give a station"),
        ({"point": [0, 0, float("nan")]}, r"(?s)point\.2.*should be a finite number"),
    ],
)
def test_keys_that_do_not_fit_are_refused(gauge: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Gauge.model_validate(gauge)


def test_too_large_a_surface_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gudgeon.pipeline.interfaces.gauges.LARGEST", 1e3)
    mesh, _, component = skirt({"normal_count": 1})
    with pytest.raises(
        InputError, match=r"component\.cup\.gauge\.outside\.surface: \d+ nodes under \d+ rows of interfaces"
    ):
        reduce_component(mesh, "ab" * 32, component, "cup")


SCENE = """
[component.block]
geometry = { kind = "box", lx = 0.02, ly = 0.02, lz = 0.04 }
material = { E = 2e11, nu = 0.3, rho = 7800.0 }
mesh = { size = 0.01 }
interface.foot = { surface = "bottom", kind = "patch" }
gauge.middle = { point = [0.0, 0.0, 0.02] }
gauge.stretch = { point = [0.0, 0.0, 0.02], quantity = "strain" }
gauge.skin = { surface = "skin" }
modes = { reduction = "macneal", normal_count = 20 }

[body.block]
position = [0.0, 0.0, 1e-6]
velocity = [0.0, 0.0, -1.0]
gauges = ["middle", "stretch"]

[contact.floor]
body = "block"
interface = "foot"
against = { shape = "plane", point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }

[run]
duration = 3e-5
samples = 60
frames = 30
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("stress")
    (folder / "scene.toml").write_text(SCENE)
    return folder


def test_point_gauges_are_recorded_with_their_equivalent_stress(scene: Path) -> None:
    report = run(scene, db=scene / "db", out=scene / "out", until="solve")
    job = open_job(scene, db=scene / "db", out=scene / "out")
    trajectory = job.store.get(job.trajectory().key, "trajectory")
    stress, strain = trajectory.gauges["block.middle"], trajectory.gauges["block.stretch"]
    assert stress.shape == strain.shape == (len(trajectory.times), 6)
    assert stress[:, 2].min() < -1e6  # pressed against the floor
    np.testing.assert_allclose(stress, strain @ hooke(Material(**STEEL)), rtol=1e-9, atol=1.0)
    peak = report.quantities["block.middle.von_mises_peak"]
    assert von_mises(stress).max() <= peak["value"] < 1.01 * von_mises(stress).max()  # Of steps, not of samples alone.
    assert peak["unit"] == "Pa"
    assert not any("stretch" in name for name in report.quantities)


def test_a_surface_is_no_gauge_of_a_body(scene: Path) -> None:
    with pytest.raises(InputError, match=r"body\.block\.gauges: 'skin' is a surface, for pictures only; name stations"):
        open_job(scene, set={"body.block.gauges": ["skin"]})
