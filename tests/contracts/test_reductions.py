"""Every reduction, on solids of curved and straight elements, plane parts and bars, free, held and tied, and on beams
free, hinged and clamped: orthonormal, diagonal, never too soft, and exact in statics unless R is dropped."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy import linalg, sparse

from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.shapes.bar import Bar
from gudgeon.pipeline.geometry.shapes.beam import Beam
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.geometry.shapes.plane import Rectangle
from gudgeon.pipeline.geometry.shapes.skirt import Skirt
from gudgeon.pipeline.interfaces.points import contact_points, surface_coordinates
from gudgeon.pipeline.interfaces.tie import made_rigid, tie_of, tie_rows
from gudgeon.pipeline.modes import flexibility, normal
from gudgeon.pipeline.modes.static import pressure_fields
from gudgeon.pipeline.reduction.methods import REDUCTIONS, ContactRows, Reduction
from gudgeon.pipeline.reduction.methods.reduction import reference_reaction
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.scenes.modes import ModesSettings
from gudgeon.pipeline.scenes.supports import Support

ORTHOGONALITY = 1e-10
ROUND_OFF = 1e-8
"""Relative round-off of a beam's lowest eigenvalues: eps · largest eigenvalue / lowest one."""
NORMAL, STATIC = 6, 4
DROPS_STATICS = {"normal+static", "rigid"}
"""Reductions without R; with all others Φ and R together give every contact load its exact static answer."""
NORMAL_MODES = {"macneal", "normal+static", "rubin", "rubin-macneal"}
"""Reductions whose first shapes are the normal modes themselves; the others' are Ritz vectors."""
WITHOUT_MODES = {"rigid"}
NOTHING_LEFT = {"rubin", "attachment"}
"""Reductions whose shapes contain the static displacement of every row: R is round-off."""


def held() -> tuple[FEModel, ContactRows]:
    return solid("open_end")


def solid(*supports: Support | str) -> tuple[FEModel, ContactRows]:
    mesh = Skirt(kind="skirt", outer_radius=0.043, wall=0.012, height=0.04, crown=0.012).build(0.02)
    model = build_model(mesh, Material(E=72e9, nu=0.33, rho=2700.0), supports)
    points = contact_points(mesh, Interface(surface="skirt", sector_deg=(-60, 60)), "here")
    coordinates = surface_coordinates(points.points, mesh.surfaces["skirt"].shape)
    rows = model.rows(points.nodes, points.normals)
    return model, ContactRows(rows, pressure_fields(coordinates, points.areas, STATIC))


def block() -> tuple[FEModel, ContactRows]:
    """A solid of straight elements."""
    mesh = Box(kind="box", lx=0.03, ly=0.02, lz=0.05).build(0.025)
    model = build_model(mesh, Material(E=2e11, nu=0.3, rho=7800.0))
    points = contact_points(mesh, Interface(surface="right"), "here")
    return model, ContactRows(model.rows(points.nodes, points.normals), np.eye(len(points.nodes))[:, :STATIC])


def tied() -> tuple[FEModel, ContactRows]:
    """A solid whose crown moves as a rigid body."""
    model, rows = solid()
    tie = tie_of(model.mesh, Interface(surface="crown", kind="tie", tie="rbe2"), "here")
    rigid, L = made_rigid(model, {"crown": tie}, "here")
    B = sparse.csr_matrix(sparse.vstack([rows.B, tie_rows(model, tie).B]) @ L)
    return rigid, ContactRows(B, np.vstack([rows.pressures, np.zeros((6, STATIC))]))


def plane(*supports: str) -> tuple[FEModel, ContactRows]:
    geometry = Rectangle(kind="rectangle", lx=0.1, ly=0.05, thickness=0.004, state="plane-strain")
    mesh = geometry.build(0.02)
    model = build_model(mesh, Material(E=2e11, nu=0.3, rho=7800.0), supports, geometry=geometry)
    points = contact_points(mesh, Interface(surface="right"), "here")
    coordinates = surface_coordinates(points.points, mesh.surfaces["right"].shape)
    rows = model.rows(points.nodes, points.normals)
    return model, ContactRows(rows, pressure_fields(coordinates, points.areas, STATIC))


def bar() -> tuple[FEModel, ContactRows]:
    mesh = Bar(kind="bar", length=1.0, area=1e-4).build(0.05)
    model = build_model(mesh, Material(E=2e11, nu=0.3, rho=8000.0))
    ends = [contact_points(mesh, Interface(surface=name), "here") for name in ("left", "right")]
    B = sparse.csr_matrix(sparse.vstack([model.rows(end.nodes, end.normals) for end in ends]))
    return model, ContactRows(B, np.eye(2))


def sliding() -> tuple[FEModel, ContactRows]:
    """A solid on a smooth floor: it slides along x and y and rotates about z."""
    return solid(Support(surface="open_end", hold=("z",)))


def beam(theory: str, *supports: Support | str) -> tuple[FEModel, ContactRows]:
    section = {"kind": "rectangle", "width": 0.02, "height": 0.04}
    geometry = Beam.model_validate(
        {"kind": "beam", "length": 1.0, "section": section, "theory": theory, "stations": {"mid": 0.4}}
    )
    mesh = geometry.build(0.05)
    model = build_model(mesh, Material(E=2e11, nu=0.3, rho=8000.0), supports, geometry=geometry)
    tips = [contact_points(mesh, Interface(surface=name), "here") for name in ("right-top", "mid-bottom")]
    B = sparse.csr_matrix(sparse.vstack([model.rows(tip.nodes, tip.normals) for tip in tips]))
    return model, ContactRows(B, np.eye(2))


CASES = {
    "solid": solid,
    "held": held,
    "sliding": sliding,
    "block": block,
    "tied": tied,
    "plane": plane,
    "plane held": lambda: plane("left"),
    "bar": bar,
    "beam": lambda: beam("euler-bernoulli"),
    "hinged": lambda: beam("euler-bernoulli", Support(surface="left", hold=("z",))),
    "clamped": lambda: beam("timoshenko", "left"),
}


@cache
def case_of(name: str) -> tuple[FEModel, ContactRows]:
    return CASES[name]()


@cache
def elastic_of(name: str) -> tuple[np.ndarray, np.ndarray]:
    """All elastic eigenvalues and shapes of the dofs that are free."""
    model = case_of(name)[0]
    K, M = model.free_matrices()
    values, vectors = linalg.eigh(K.toarray(), M.toarray())
    rigid = len(model.rigid_twists)
    return values[rigid:], vectors[:, rigid:]


@cache
def reduced_of(name: str, reduction: Any) -> Reduction:
    case = case_of(name)
    surfaces = case[0].mesh.surfaces
    reference, kept = ("crown", "crown") if "crown" in surfaces else ("left", "right")
    settings = ModesSettings(
        reduction=reduction,
        normal_count=0 if reduction == "attachment" else NORMAL,
        static_count=STATIC,
        substructures=2,
        reference=reference,
        boundary=(kept,),
        kept=(kept,),
        interface_count=2,
    )
    return REDUCTIONS[reduction](*case, settings)


@pytest.fixture(params=CASES)
def case_name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def case(case_name: str) -> tuple[FEModel, ContactRows]:
    return case_of(case_name)


@pytest.fixture
def elastic(case_name: str) -> tuple[np.ndarray, np.ndarray]:
    return elastic_of(case_name)


@pytest.fixture(params=sorted(REDUCTIONS))
def reduced(request: pytest.FixtureRequest, case_name: str) -> tuple[str, Reduction]:
    return request.param, reduced_of(case_name, request.param)


def test_mass_and_stiffness_are_diagonal(case: tuple[FEModel, ContactRows], reduced: tuple[str, Reduction]) -> None:
    model, reduction = case[0], reduced[1]
    basis = np.column_stack([model.rigid_modes, reduction.Phi])
    np.testing.assert_allclose(basis.T @ (model.M @ basis), np.eye(basis.shape[1]), atol=ORTHOGONALITY)
    assert reduction.quality.get("basis_orthogonality", 0.0) < ORTHOGONALITY
    omega = reduction.angular_frequencies
    stiffness = reduction.Phi.T @ (model.K @ reduction.Phi) / np.outer(omega, omega)
    np.testing.assert_allclose(stiffness, np.eye(len(omega)), atol=1e-9)


def test_shapes_are_zero_where_the_body_is_held(
    case: tuple[FEModel, ContactRows], reduced: tuple[str, Reduction]
) -> None:
    assert np.all(reduced[1].Phi[case[0].held] == 0)


def test_counts(case: tuple[FEModel, ContactRows], reduced: tuple[str, Reduction]) -> None:
    name, reduction = reduced
    assert reduction.Phi.shape == (case[0].K.shape[0], len(reduction.angular_frequencies))
    rows = case[1].B.shape[0]
    if name == "attachment":
        assert reduction.normal_count == rows - reduction.quality["ritz_dropped"] > 0
        return
    assert reduction.normal_count == (0 if name in WITHOUT_MODES else NORMAL)
    static = min(STATIC, case[1].pressures.shape[1])
    if name == "rubin":
        static = rows - reduction.quality["static_dropped"]
    assert len(reduction.angular_frequencies) == (0 if name in WITHOUT_MODES else NORMAL + static)


def test_full_rank(reduced: tuple[str, Reduction]) -> None:
    Phi = reduced[1].Phi
    if not Phi.shape[1]:
        return
    assert np.linalg.matrix_rank(Phi / np.linalg.norm(Phi, axis=0)) == Phi.shape[1]
    assert Phi.shape[1] == len(reduced[1].angular_frequencies)


def test_ritz_values_are_never_below_the_full_models(
    elastic: tuple[np.ndarray, np.ndarray], reduced: tuple[str, Reduction]
) -> None:
    full, (name, reduction) = elastic[0], reduced
    ours = np.sort(reduction.angular_frequencies) ** 2
    assert np.all(ours >= full[: len(ours)] * (1 - ROUND_OFF))
    lowest = reduction.normal_count if name in NORMAL_MODES else 0
    np.testing.assert_allclose(ours[:lowest], full[:lowest], rtol=1e-8)


def test_statics_are_exact_where_the_reduction_promises_it(
    case: tuple[FEModel, ContactRows], elastic: tuple[np.ndarray, np.ndarray], reduced: tuple[str, Reduction]
) -> None:
    (model, rows), (values, vectors), (name, reduction) = case, elastic, reduced
    if name in DROPS_STATICS:
        assert reduction.residual_flexibility is None
        return
    at_points = rows.B[:, model.free] @ vectors
    exact = (at_points / values) @ at_points.T
    kept = rows.B @ reduction.Phi
    ours = (kept / reduction.angular_frequencies**2) @ kept.T + reduction.residual_flexibility
    np.testing.assert_allclose(ours, exact, atol=1e-9 * np.abs(exact).max())
    R = reduction.residual_flexibility
    assert linalg.eigvalsh(R)[0] >= -1e-9 * np.abs(exact).max()
    if name in NOTHING_LEFT:
        np.testing.assert_allclose(R, 0, atol=1e-8 * np.abs(exact).max())


def test_reference_reaction_is_zero_for_normal_modes_only(
    case: tuple[FEModel, ContactRows], reduced: tuple[str, Reduction]
) -> None:
    (model, _), (name, reduction) = case, reduced
    if name not in ("macneal", "fixed-reference"):
        return
    surface = "crown" if "crown" in model.mesh.surfaces else "left"
    nodes = np.unique(model.mesh.surfaces[surface].facets)
    normal = replace(
        reduction, Phi=reduction.Phi[:, :NORMAL], angular_frequencies=reduction.angular_frequencies[:NORMAL]
    )
    share = reference_reaction(model, normal, nodes)
    free = (~model.held).reshape(len(model.nodes), -1)[nodes].any()
    assert share > 1e-3 if name == "fixed-reference" and free else share < 1e-7


def test_rigid_body_factorises_nothing(case: tuple[FEModel, ContactRows], monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(matrix: sparse.csr_matrix, *rows: sparse.csr_matrix, **how: bool) -> None:
        raise AssertionError("factorised")

    for module, name in ((normal, "factorise"), (flexibility, "factorise"), (flexibility, "condense")):
        monkeypatch.setattr(module, name, refuse)
    reduction = REDUCTIONS["rigid"](*case, ModesSettings(reduction="rigid", normal_count=10_000))
    assert reduction.residual_flexibility is None
    with pytest.raises(AssertionError, match="factorised"):
        REDUCTIONS["macneal"](*case, ModesSettings(normal_count=NORMAL))
