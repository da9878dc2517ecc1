"""Errors of frequencies: bounds hold against dense algebra, estimates lie next to the errors of exact solutions."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import linalg

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.cli.results import frequency_text
from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.elements import ELEMENTS
from gudgeon.pipeline.fem.elements.strain import StrainSamples
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.cells import HEXAHEDRON8, TETRA10, cell_of
from gudgeon.pipeline.geometry.shapes.bar import Bar
from gudgeon.pipeline.geometry.shapes.beam import Beam
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.geometry.shapes.plane import Rectangle
from gudgeon.pipeline.geometry.shapes.sphere import Sphere
from gudgeon.pipeline.modes.bounds import algebraic_errors, lumped_share, residuals, round_off
from gudgeon.pipeline.modes.estimate import discretisation_errors
from gudgeon.pipeline.modes.normal import normal_modes
from gudgeon.pipeline.modes.patch_recovery import Recovery
from gudgeon.pipeline.modes.problem import Count
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.scenes.supports import Support
from gudgeon.pipeline.stages.mesh import build_mesh
from gudgeon.pipeline.stages.notes.frequencies import coarse, frequency_rows
from tests.pipeline.facts import of_modes
from tests.pipeline.solids import box as solid

STEEL = Material(E=2e11, nu=0.3, rho=8000.0)
ROUND_OFF = 1e-12
COUNT = 8
SECTION = {"kind": "rectangle", "width": 0.02, "height": 0.04}
HINGES = (Support(surface="left", hold=("z",)), Support(surface="right", hold=("z",)))

Case = tuple[FEModel, Box | Sphere | Rectangle | Bar | Beam]


def box(*supports: Support | str) -> Case:
    geometry = Box(kind="box", lx=0.04, ly=0.02, lz=0.02)
    return build_model(geometry.build(0.01), STEEL, supports), geometry


def sphere() -> Case:
    geometry = Sphere(kind="sphere", radius=0.05)
    return build_model(geometry.build(0.03), STEEL), geometry


def sheet(size: float, state: str = "plane-stress") -> Case:
    geometry = Rectangle.model_validate({"kind": "rectangle", "lx": 0.2, "ly": 0.1, "thickness": 0.003, "state": state})
    return build_model(geometry.build(size), STEEL, ("left",), geometry=geometry), geometry


def bar(elements: int, *supports: Support | str) -> Case:
    geometry = Bar(kind="bar", length=1.0, area=1e-4)
    return build_model(geometry.build(1 / elements), STEEL, supports), geometry


def beam(theory: str, elements: int, *supports: Support | str) -> Case:
    tables = {"kind": "beam", "length": 1.0, "section": SECTION, "theory": theory}
    geometry = Beam.model_validate(tables)
    return build_model(geometry.build(1 / elements), STEEL, supports, geometry=geometry), geometry


CASES = {
    "box": box,
    "held box": lambda: box("left"),
    "sliding box": lambda: box(Support(surface="left", hold=("x",))),
    "sphere": sphere,
    "sheet": lambda: sheet(0.03),
    "plane strain": lambda: sheet(0.03, "plane-strain"),
    "bar": lambda: bar(10),
    "euler-bernoulli": lambda: beam("euler-bernoulli", 12),
    "timoshenko": lambda: beam("timoshenko", 12, "left"),
}


@pytest.fixture(scope="module", params=CASES)
def case(request: pytest.FixtureRequest) -> Case:
    return CASES[request.param]()


# Bounds


@pytest.fixture(scope="module")
def dense(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """Elastic eigenvalues and shapes over all dofs."""
    model = case[0]
    K, M = (matrix.toarray() for matrix in model.free_matrices())
    values, vectors = linalg.eigh(K, M)
    Phi = np.zeros((len(model.held), len(values)))
    Phi[model.free] = vectors
    rigid = len(model.rigid_twists)
    return values[rigid:], Phi[:, rigid:]


def cut(dense: tuple[np.ndarray, np.ndarray]) -> Count:
    """The widest gap after 5 to 11 modes, so that no multiplet is cut."""
    count = 5 + int(np.argmax(dense[0][5:12] / dense[0][4:11]))
    return float(dense[0][count - 1 : count + 1].mean()), count


def ritz(model: FEModel, dense: tuple[np.ndarray, np.ndarray], noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Ritz pairs of the lowest shapes with a little of all the others, less of the stiff ones."""
    (values, Phi), count = dense, cut(dense)[1]
    rest = np.random.default_rng(3).standard_normal((Phi.shape[1] - count, count)) / values[count:, None]
    basis = Phi[:, :count] + Phi[:, count:] @ (noise * rest / np.linalg.norm(rest, axis=0))
    values, Z = linalg.eigh(basis.T @ (model.K @ basis), basis.T @ (model.M @ basis))
    return np.sqrt(values), basis @ Z


@pytest.mark.parametrize("noise", [1e-3, 1e-5])
@pytest.mark.parametrize("counted", [False, True])
def test_bounds_hold(counted: bool, noise: float, case: Case, dense: tuple[np.ndarray, np.ndarray]) -> None:
    model = case[0]
    pairs = ritz(model, dense, noise)
    exact = np.sqrt(dense[0][: len(pairs[0])])
    found = algebraic_errors(model, pairs, residuals(model, *pairs)[1], cut(dense) if counted else None, True)
    errors = np.abs(pairs[0] / exact - 1)
    assert np.all(errors <= found * (1 + 1e-6))
    assert errors.max() > noise**2 / 10


def test_a_count_sharpens_bounds_to_second_order(case: Case, dense: tuple[np.ndarray, np.ndarray]) -> None:
    """Residuals ten times less: bounds of ρ become ten times less, those of ρ² over the gap a hundred times."""
    model, found = case[0], []
    for noise in (1e-6, 1e-7):
        pairs = ritz(model, dense, noise)
        rest = residuals(model, *pairs)[1]
        floor = round_off(model) / (2 * pairs[0] ** 2)
        found.append(
            [(algebraic_errors(model, pairs, rest, proven, True) - floor).max() for proven in (None, cut(dense))]
        )
    ratio = np.divide(*found)
    assert ratio[0] == pytest.approx(10, rel=0.2)
    assert ratio[1] > 50


def test_mixed_up_modes_keep_the_plain_bound(dense: tuple[np.ndarray, np.ndarray], case: Case) -> None:
    """Shapes so bad that their intervals overlap say nothing about gaps."""
    model = case[0]
    pairs = ritz(model, dense, 1.0)
    rest = residuals(model, *pairs)[1]
    plain = algebraic_errors(model, pairs, rest, None, True)
    assert np.array_equal(algebraic_errors(model, pairs, rest, cut(dense), True), plain)


@pytest.mark.parametrize("name", ["box", "sphere"])
def test_lumped_mass_bounds_the_consistent_one(name: str) -> None:
    model = CASES[name]()[0]
    share, lumped = lumped_share(model.mesh), model.M.diagonal()
    scale = 1 / np.sqrt(lumped)
    least = linalg.eigvalsh(model.M.toarray() * np.outer(scale, scale), subset_by_index=(0, 0))[0]
    assert 0 < share <= least * (1 + ROUND_OFF)
    straight = lumped_share(Box(kind="box", lx=1.0, ly=1.0, lz=1.0).build(1.0))
    assert straight == pytest.approx(0.25, abs=1e-6)
    assert (share < 0.24) == (name == "sphere")


def test_both_norms_are_bounds_of_each_other(case: Case, dense: tuple[np.ndarray, np.ndarray]) -> None:
    """The lumped one lies above the exact one, and not by more than the root of what the share allows."""
    model = case[0]
    pairs = ritz(model, dense, 1e-3)
    rest = residuals(model, *pairs)[1]
    exact, bound = (algebraic_errors(model, pairs, rest, None, whole) for whole in (False, True))
    assert np.all(bound >= exact * (1 - 1e-9))
    assert np.all(bound <= exact * 4.6)


# Estimates


def samples_of(model: FEModel, geometry: object) -> StrainSamples:
    samples = ELEMENTS[model.mesh.cell_type].samples
    assert samples is not None
    return samples(model.mesh, STEEL, geometry)[0]


@pytest.mark.parametrize("case", [name for name in CASES if name != "sphere"], indirect=True)
def test_strains_hold_the_energy(case: Case) -> None:
    """Straight elements: the Gauss rule is exact for the squares of linear strains."""
    model, geometry = case
    samples = samples_of(model, geometry)
    u = np.random.default_rng(1).standard_normal((len(model.held), 3))
    values = samples.strains(u)
    energy = np.einsum("eqsk,e->k", values**2, samples.sizes) / samples.points.shape[1]
    np.testing.assert_allclose(energy, np.einsum("dk,dk->k", u, model.K @ u), rtol=1e-9)


def test_linear_strains_are_recovered_exactly(case: Case) -> None:
    model, geometry = case
    samples = samples_of(model, geometry)
    slopes = np.random.default_rng(2).standard_normal((3, samples.components, 2))
    values = 1.0 + np.einsum("eqi,isk->eqsk", samples.points, slopes)
    if isinstance(geometry, Sphere):
        assert np.all(Recovery([samples]).error_energy([values]) < 1e-3 * samples.sizes.sum())
    else:
        assert np.all(Recovery([samples]).error_energy([values]) < 1e-11 * samples.sizes.sum())


def test_quadratic_strains_show_their_lack() -> None:
    """What a straight element cannot carry of x²: its error against the best linear fit, known in closed form."""
    model, geometry = bar(20)
    samples = samples_of(model, geometry)
    places = samples.points[:, :, :1, None]
    # Through the Gauss points goes the linear part; what is left is h⁴/180 an element (Legendre's second polynomial).
    h = 1 / 20
    assert Recovery([samples]).error_energy([places**2])[0] == pytest.approx(20 * h * h**4 / 180, rel=0.05)


@pytest.mark.parametrize("elements", [10, 20, 40])
@pytest.mark.parametrize("supports", [(), ("left",)])
def test_bar(supports: tuple[str, ...], elements: int) -> None:
    model, geometry = bar(elements, *supports)
    modes = normal_modes(model, 5)
    waves = np.arange(5) + (0.5 if supports else 1.0)
    errors = modes.angular_frequencies / (np.pi * waves * np.sqrt(STEEL.E / STEEL.rho)) - 1
    found = discretisation_errors(model, STEEL, geometry, modes.angular_frequencies, modes.Phi)
    np.testing.assert_allclose(found / errors, 1.0, atol=0.12)


@pytest.mark.parametrize("theory", ["euler-bernoulli", "timoshenko"])
@pytest.mark.parametrize("supports", [(), ("left",), HINGES], ids=["free", "clamped", "hinged"])
def test_beam(supports: tuple[Support | str, ...], theory: str) -> None:
    """Against eight times as many elements, whose own error is 4000 times less."""
    exact = normal_modes(beam(theory, 96, *supports)[0], 5).angular_frequencies
    model, geometry = beam(theory, 12, *supports)
    modes = normal_modes(model, 5)
    found = discretisation_errors(model, STEEL, geometry, modes.angular_frequencies, modes.Phi)
    np.testing.assert_allclose(found[1:] / (modes.angular_frequencies / exact - 1)[1:], 1.0, atol=0.2)


@pytest.mark.parametrize("state", ["plane-stress", "plane-strain"])
def test_sheet(state: str) -> None:
    """Against a mesh of a fifth of the size; the clamp's corners are singular."""
    exact = normal_modes(sheet(0.003, state)[0], 6).angular_frequencies
    model, geometry = sheet(0.015, state)
    modes = normal_modes(model, 6)
    found = discretisation_errors(model, STEEL, geometry, modes.angular_frequencies, modes.Phi)
    ratio = found / (modes.angular_frequencies / exact - 1)
    assert 0.5 < ratio.min() < ratio.max() < 1.5


def test_estimates_do_not_depend_on_how_many_modes_go_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    model, geometry = box()
    modes = normal_modes(model, COUNT)
    whole = discretisation_errors(model, STEEL, geometry, modes.angular_frequencies, modes.Phi)
    monkeypatch.setattr("gudgeon.pipeline.modes.estimate.BLOCK_BYTES", 1)
    monkeypatch.setattr("gudgeon.pipeline.modes.patch_recovery.BATCH", 7)
    parts = discretisation_errors(model, STEEL, geometry, modes.angular_frequencies, modes.Phi)
    np.testing.assert_allclose(parts, whole, rtol=1e-4)


# Records


COMPONENT = {
    "geometry": {"kind": "box", "lx": 0.04, "ly": 0.02, "lz": 0.02},
    "material": {"E": 2e11, "nu": 0.3, "rho": 8000.0},
    "mesh": {"size": 0.01},
    "interface": {"face": {"surface": "right"}},
    "modes": {"normal_count": COUNT, "static_count": 4},
}


def record(**changes: object) -> ModalRecord:
    component = Component.model_validate(COMPONENT | changes)
    return reduce_component(component_mesh(component), "", component, "block")


def component_mesh(component: Component) -> MeshRecord:
    return build_mesh(component, Path(), "block")


def test_record_of_normal_modes_and_static_shapes() -> None:
    """Residuals of round-off and estimates where a mode is, NaN where a static shape is."""
    found = record()
    assert found.normal_count == COUNT
    assert found.residuals is not None
    assert found.algebraic_errors is not None
    assert found.discretisation_errors is not None
    assert found.residuals.shape == found.algebraic_errors.shape == found.angular_frequencies.shape
    assert np.all(found.residuals[:COUNT] < 1e-8)
    assert np.all(found.residuals[COUNT:] > 1e-3)
    assert np.all(found.algebraic_errors[:COUNT] < 1e-11)
    assert found.quality["inertia_found"] == found.quality["inertia_expected"] == COUNT
    shift = found.quality["inertia_shift"]
    assert np.sum(found.angular_frequencies[:COUNT] ** 2 < shift) == COUNT
    assert np.all(found.discretisation_errors[:COUNT] > 1e-4)
    assert np.all(np.isnan(found.discretisation_errors[COUNT:]))


def test_estimates_of_a_record_fall_with_the_mesh() -> None:
    """Half the size: the frequencies fall by what the coarse mesh's estimates say, the finer one's own error aside."""
    coarse, fine = record(), record(mesh={"size": 0.005})
    assert coarse.discretisation_errors is not None
    assert fine.discretisation_errors is not None
    ratio = coarse.angular_frequencies[:COUNT] / fine.angular_frequencies[:COUNT]
    told = (1 + coarse.discretisation_errors[:COUNT]) / (1 + fine.discretisation_errors[:COUNT])
    np.testing.assert_allclose((told - 1) / (ratio - 1), 1.0, atol=0.35)


def test_record_with_a_surface_made_rigid() -> None:
    """Residuals are of the tied dofs, stress of all."""
    tied = record(interface={"face": {"surface": "right", "kind": "tie", "tie": "rbe2"}})
    assert tied.residuals is not None
    assert np.all(tied.residuals < 1e-8)
    assert tied.discretisation_errors is not None
    assert np.all((tied.discretisation_errors > 1e-4) & (tied.discretisation_errors < 0.1))


def test_record_of_ritz_vectors() -> None:
    """Fixed-interface synthesis: Ritz vectors near modes have estimates, the highest do not pretend to be modes."""
    modes = {"reduction": "craig-bampton", "normal_count": COUNT, "fixed_count": 12, "static_count": 0}
    found = record(modes=modes)
    assert found.residuals is not None
    assert found.algebraic_errors is not None
    assert found.discretisation_errors is not None
    exact = record().angular_frequencies[:COUNT]
    assert np.all(found.angular_frequencies / exact - 1 <= found.algebraic_errors)
    known = np.isfinite(found.discretisation_errors)
    assert np.array_equal(known, found.algebraic_errors < 0.1)


def test_curved_elements_that_lock_are_refused() -> None:
    """Of a sphere of 130 nodes, errors at ν = 0.4999 are five times those at 0.3; at 0.49 they are not."""
    ball: dict[str, object] = {"geometry": {"kind": "sphere", "radius": 0.02}, "mesh": {"size": 0.02}, "interface": {}}
    ball |= {"modes": {"normal_count": 6, "static_count": 0}}
    assert record(**ball, material=nearly(0.49)).normal_count == 6
    with pytest.raises(StageError, match=r"material\.nu: 0\.4999 given, elements of this size lock: .* allowed: 6\.9%"):
        record(**ball, material=nearly(0.4999))


@pytest.mark.parametrize("nu", [0.49, 0.499999])
def test_estimates_of_nearly_incompressible_blocks_are_close(nu: float) -> None:
    """Two elements across; errors are two to three times those at ν = 0.3, against a mesh of half the size."""
    few = {"modes": {"normal_count": 6, "static_count": 0}}
    coarse, fine = (record(**few, mesh={"size": size}, material=nearly(nu)) for size in (0.01, 0.005))
    assert coarse.discretisation_errors is not None
    assert fine.discretisation_errors is not None
    exact = fine.angular_frequencies * (1 - fine.discretisation_errors)
    true = coarse.angular_frequencies / exact - 1
    assert true.max() > 0.04
    ratios = (coarse.discretisation_errors / true)[true > 0.005]
    assert np.all((ratios > 0.5) & (ratios < 2.0))


def test_torsion_on_one_element_across_is_judged_by_the_traction_of_its_sides() -> None:
    """Linear strains cannot warp a square section, and are smooth: √(G J / ρ I_p) / 2 L with J = 0.1406 a⁴ (de
    Saint-Venant)."""
    bar = {"geometry": {"kind": "box", "lx": 0.02, "ly": 0.02, "lz": 0.2}, "mesh": {"size": 0.02}, "interface": {}}
    E, nu, rho, a, length = 1e7, 0.499, 1100.0, 0.02, 0.2
    found = record(**bar, modes={"normal_count": 6}, material={"E": E, "nu": nu, "rho": rho})
    assert found.discretisation_errors is not None
    exact = (E / (2 * (1 + nu)) * 0.140577 * a**4 / (rho * a**4 / 6)) ** 0.5 / (2 * length)
    true = found.angular_frequencies[4] / (2 * np.pi * exact) - 1
    assert true > 0.05
    assert 0.5 * true < found.discretisation_errors[4] < 2 * true


def nearly(nu: float) -> dict[str, float]:
    return {"E": 2e11, "nu": nu, "rho": 8000.0}


def test_rigid_body_has_no_errors() -> None:
    found = record(modes={"reduction": "rigid", "normal_count": 1})
    assert found.residuals is not None
    assert found.residuals.shape == (0,)
    assert found.discretisation_errors is None
    assert (frequency_rows(found), [*coarse(of_modes({"block": found}))]) == ([], [])


# What is said of them


def test_table_and_warning() -> None:
    found = record()
    rows = frequency_rows(found)
    assert [row["mode"] for row in rows] == list(range(1, COUNT + 1))
    assert rows[0]["frequency"] == pytest.approx(found.angular_frequencies[0] / (2 * np.pi))
    assert found.discretisation_errors is not None
    assert rows[2]["estimated_error"] == found.discretisation_errors[2]
    text = frequency_text({"block": rows}).splitlines()
    assert text[1] == "component.block"
    assert len(text) == COUNT + 3
    longer = frequency_text({"block": [rows[i % COUNT] | {"mode": i + 1} for i in range(60)]}).splitlines()
    assert len(longer) == 3 + 24
    assert [line.split()[0] for line in longer[-5:]] == ["20", "…", "58", "59", "60"]
    assert longer[-4].split()[1] == "37"
    made = np.array([1e-4, 0.004, 0.02, 0.013, *np.full(COUNT - 4, 1e-3), *np.full(4, np.nan)])
    free = replace(found, discretisation_errors=made, quality={})
    (note,) = coarse(of_modes({"block": free}))
    where = "component.block.mesh.size: the estimated frequency error of"
    assert note.startswith(f"{where} 2 of {COUNT} modes is above 1%; the largest is 2.0%, at mode 3 (")
    assert note.endswith("keep fewer modes, or refine the mesh by a smaller size")
    assert [
        *coarse(of_modes({"block": replace(free, discretisation_errors=np.where(made > 0.01, 0.0099, made))}))
    ] == []


def test_a_body_that_is_touched_is_judged_by_its_flexibility() -> None:
    """High modes that are wrong are no news there; a mesh file cannot be refined by a key."""
    wrong = np.full(COUNT + 4, 0.05)
    fine = replace(record(), discretisation_errors=wrong, quality={"compliance_errors": {"a": 0.019, "b": 1e-3}})
    assert [*coarse(of_modes({"block": fine}))] == []
    poor = replace(fine, quality={"compliance_errors": {"a": 0.019, "b": 0.034}})
    (note,) = coarse(of_modes({"block": poor}))
    assert note.startswith("component.block.mesh.size: the mesh error of the contact's flexibility is about 3.4% at")
    assert "interface 'b', above 2% (" in note
    assert note.endswith("refine the mesh by a smaller size")
    for cell, end in ((TETRA10, ""), (HEXAHEDRON8, "; its linear hexahedra lock in bending: mid-edge nodes or")):
        facts = of_modes({"block": poor}, {"block": SimpleNamespace(from_file=True)})
        cube = solid([cell], (1, 1, 1), (1.0, 1.0, 1.0))
        facts.store, facts.meshes = SimpleNamespace(get=lambda *_, cube=cube: cube), {"block": ""}
        (note,) = coarse(facts)
        assert note.startswith("component.block.geometry.path: the mesh error of ")
        assert note.endswith(f"refine the mesh in its file{end}" + " incompatible modes (C3D8I) do not" * bool(end))


def test_compliance_error_is_what_a_finer_mesh_adds() -> None:
    """A clamped block under pressure on its end face, whose static compliance converges with the mesh."""
    held = {"supports": ["left"], "interface": {"face": {"surface": "top"}}}
    found = [record(**held, mesh={"size": size}) for size in (0.02, 0.005)]
    errors = [one.quality["compliance_errors"]["face"] for one in found]
    traces = []
    for one in found:
        assert one.static_responses is not None
        # Pressures of unit size: per area, which the sum over nodes of both meshes has.
        traces.append(float(one.static_responses.compliance[0, 0]))
    assert errors[1] < 0.5 * errors[0]
    assert 0.4 < (errors[0] - errors[1]) / (traces[1] / traces[0] - 1) < 2.5


def test_records_of_older_versions_have_no_errors() -> None:
    old = replace(record(), residuals=None, algebraic_errors=None, discretisation_errors=None, quality={})
    assert frequency_rows(old)[0]["estimated_error"] is None
    assert frequency_text({"block": frequency_rows(old)}).splitlines()[3].split()[2:] == ["–", "–"]
    assert [*coarse(of_modes({"block": old}))] == []


def test_lumped_types_have_one_mass_for_all_directions() -> None:
    """The share is of scalar shape functions: a cell type with turns would need another one."""
    for build in CASES.values():
        model = build()[0]
        if cell_of(model.mesh).dimension > 1:
            assert not model.rotations.any()


SCENE = """
[component.block]
geometry = { kind = "box", lx = 0.04, ly = 0.02, lz = 0.02 }
material = { E = 2e11, nu = 0.3, rho = 8000.0 }
mesh = { size = 0.02 }
interface.face = { surface = "right" }
modes = { normal_count = 4 }

[body.block]

[run]
duration = 1e-5
"""


def test_command_prints_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A table from `gudgeon modes`, the same numbers as JSON, and the warning from any command that makes modes."""
    (tmp_path / "scene.toml").write_text(SCENE)
    where = [str(tmp_path), "--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    assert main(["modes", *where]) == 0
    printed = capsys.readouterr()
    lines = printed.out.splitlines()
    start = lines.index("component.block")
    table = [line.split() for line in lines[start + 2 :]]
    assert [row[0] for row in table] == ["1", "2", "3", "4"]
    warning = "gudgeon: component.block.mesh.size: the mesh error of the contact's flexibility is about "
    assert warning in printed.err
    assert main(["modes", *where, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    rows = document["frequencies"]["block"]
    assert [f"{row['estimated_error']:.1e}" for row in rows] == [row[2] for row in table]
    assert [f"{row['residual']:.1e}" for row in rows] == [row[3] for row in table]
    assert len(document["notes"]) == 1
    assert main(["morph", *where]) == 0
    printed = capsys.readouterr()
    assert "component.block" not in printed.out
    assert warning in printed.err
