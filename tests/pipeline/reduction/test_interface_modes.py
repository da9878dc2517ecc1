"""Interface and partial interface modes against their formulas on dense matrices, and their limits; Rubin's basis and
attachment modes."""

from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np
import pytest
from scipy import linalg, sparse

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.interfaces.patch import normal_rows, patch_point
from gudgeon.pipeline.reduction.methods import REDUCTIONS, ContactRows, Reduction
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.scenes.modes import ModesSettings

STEEL = Material(E=2.1e11, nu=0.3, rho=7800.0)
BOX = Box(kind="box", lx=0.02, ly=0.03, lz=0.06)
SAME = 1e-10
"""Two ways to the same basis: round-off of dense eigenproblems."""
FREE, HELD = (), ("front",)


def block(supports: tuple[str, ...] = FREE) -> tuple[FEModel, ContactRows]:
    """A block with a patch on its top as the only row."""
    mesh = BOX.build(0.03)
    model = build_model(mesh, STEEL, supports)
    top = Interface(surface="top", kind="patch")
    B = normal_rows(model, top, patch_point(mesh, top, "here"))
    B.data[np.abs(B.data) < 1e-12] = 0.0  # The normal is that of z but for round-off.
    return model, ContactRows(B, np.empty((1, 0)), {"lid": [0, 1]})


def reduced(reduction: str, case: tuple[FEModel, ContactRows], **more: Any) -> Reduction:
    table = {"reduction": reduction, "normal_count": 0, "fixed_count": 4, "boundary": ["bottom", "top"]} | more
    return REDUCTIONS[reduction](*case, ModesSettings.model_validate(table))


def surface_dofs(model: FEModel, *names: str) -> np.ndarray:
    nodes = np.unique(np.concatenate([model.mesh.surfaces[name].facets.ravel() for name in names]))
    dofs = (3 * nodes[:, None] + np.arange(3)).ravel()
    return dofs[~model.held[dofs]]


def condensed(model: FEModel, b: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return K_II, M_II and [I; Ψ] on all dofs, dense."""
    K, M = model.K.toarray(), model.M.toarray()
    i = np.setdiff1d(model.free, b)
    Psi = np.zeros((len(K), len(b)))
    Psi[b] = np.eye(len(b))
    Psi[i] = -np.linalg.solve(K[np.ix_(i, i)], K[np.ix_(i, b)])
    return Psi.T @ K @ Psi, Psi.T @ M @ Psi, Psi


def elastic_values(K: np.ndarray, M: np.ndarray, rigid: int) -> np.ndarray:
    return np.sqrt(linalg.eigh(0.5 * (K + K.T), 0.5 * (M + M.T), eigvals_only=True)[rigid:])


@pytest.mark.parametrize("supports", [FREE, HELD])
@pytest.mark.parametrize("normal_count", [0, 9])
def test_keeping_all_is_craig_bampton(supports: tuple[str, ...], normal_count: int) -> None:
    case = block(supports)
    whole = reduced("craig-bampton", case, normal_count=normal_count)
    ours = reduced("partial-interface", case, normal_count=normal_count, kept=["top", "bottom"], interface_count=0)
    np.testing.assert_allclose(ours.angular_frequencies, whole.angular_frequencies, rtol=SAME)
    assert ours.quality["kept_dofs"] == ours.quality["boundary_columns"] == whole.quality["boundary_dofs"]
    assert ours.quality["boundary_added"] == 0


@pytest.mark.parametrize("supports", [FREE, HELD])
@pytest.mark.parametrize("kept", [[], ["top"], ["lid"]])
def test_all_interface_modes_are_craig_bampton_too(supports: tuple[str, ...], kept: list[str]) -> None:
    """Whatever is kept, all modes of the rest span the same space; cuts between parts are among the rest."""
    case = block(supports)
    whole = reduced("craig-bampton", case, substructures=2, normal_count=30)
    ours = reduced("partial-interface", case, substructures=2, normal_count=30, kept=kept)
    np.testing.assert_allclose(ours.angular_frequencies, whole.angular_frequencies, rtol=1e-9)


@pytest.mark.parametrize("supports", [FREE, HELD])
def test_keeping_none_gives_the_interface_modes(supports: tuple[str, ...]) -> None:
    """Without fixed-interface modes they are the lowest modes of the condensed boundary, and nothing else."""
    case = block(supports)
    model = case[0]
    K, M, _ = condensed(model, surface_dofs(model, "bottom", "top"))
    expected = elastic_values(K, M, len(model.rigid_twists))[:12]
    for reduction, more in (("partial-interface", {}), ("interface", {"kept": ["top"]})):
        ours = reduced(reduction, case, interface_count=12, fixed_count=0, **more)
        np.testing.assert_allclose(ours.angular_frequencies, expected, rtol=1e-8)


@pytest.mark.parametrize("supports", [FREE, HELD])
@pytest.mark.parametrize("fixed_count", [0, 5])
def test_partial_interface_modes_follow_their_formula(supports: tuple[str, ...], fixed_count: int) -> None:
    case, count = block(supports), 7
    model = case[0]
    b, i = surface_dofs(model, "bottom", "top"), None
    K, M, Psi = condensed(model, b)
    p = np.isin(b, surface_dofs(model, "top"))
    K_rr, M_rr = K[~p][:, ~p], M[~p][:, ~p]
    W = np.zeros((len(b), p.sum() + count))
    W[p, : p.sum()] = np.eye(p.sum())
    W[~p, : p.sum()] = -np.linalg.solve(K_rr, K[~p][:, p])
    W[~p, p.sum() :] = linalg.eigh(K_rr, M_rr)[1][:, :count]
    i = np.setdiff1d(model.free, b)
    fixed = np.zeros((len(model.held), fixed_count))
    whole_K, whole_M = model.K.toarray(), model.M.toarray()
    fixed[i] = linalg.eigh(whole_K[np.ix_(i, i)], whole_M[np.ix_(i, i)])[1][:, :fixed_count]
    T = np.column_stack([Psi @ W, fixed])
    expected = elastic_values(T.T @ whole_K @ T, T.T @ whole_M @ T, len(model.rigid_twists))
    ours = reduced("partial-interface", case, kept=["top"], interface_count=count, fixed_count=fixed_count)
    np.testing.assert_allclose(ours.angular_frequencies, expected, rtol=1e-8)


def test_loads_on_kept_dofs_find_their_exact_statics() -> None:
    """What is reduced follows statically: a held body leaves nothing for R there. Interface modes alone leave much."""
    case = block(HELD)
    exact = reduced("partial-interface", case, kept=["lid"], interface_count=0, fixed_count=0)
    short = reduced("interface", case, interface_count=5, fixed_count=0)
    assert exact.residual_flexibility is not None
    assert short.residual_flexibility is not None
    assert abs(exact.residual_flexibility[0, 0]) < 1e-8 * short.residual_flexibility[0, 0]


@pytest.mark.parametrize("reduction", ["interface", "partial-interface"])
def test_more_interface_modes_never_raise_a_frequency(reduction: str) -> None:
    case, before = block(), np.full(5, np.inf)
    for count in (8, 16, 32):
        now = reduced(reduction, case, kept=["lid"], interface_count=count, normal_count=5).angular_frequencies
        assert np.all(now <= before * (1 + SAME))
        before = now
    whole = reduced("craig-bampton", case, normal_count=5).angular_frequencies
    np.testing.assert_allclose(before, whole, rtol=2e-2)
    assert np.all(before >= whole * (1 - SAME))


def test_a_kept_patch_that_leaves_the_body_loose() -> None:
    """Dofs along z alone hold three motions of six: the other three are columns of their own."""
    case = block()
    ours = reduced("partial-interface", case, kept=["lid"], interface_count=0, fixed_count=8)
    assert ours.quality["boundary_columns"] == ours.quality["kept_dofs"] + 3
    assert np.abs(case[0].rigid_modes.T @ (case[0].M @ ours.Phi)).max() < SAME


def test_rubins_basis_spans_normal_and_attachment_modes() -> None:
    case = block()
    rubin = reduced("rubin", case, normal_count=4)
    parts = [reduced("macneal", case, normal_count=4), reduced("attachment", case)]
    assert [rubin.Phi.shape[1], parts[1].Phi.shape[1]] == [5, 1]
    for part in parts:
        inside = rubin.Phi @ (rubin.Phi.T @ (case[0].M @ part.Phi))
        np.testing.assert_allclose(inside, part.Phi, atol=1e-8 * np.abs(part.Phi).max())


def test_static_fields_that_the_shapes_hold_already_are_dropped() -> None:
    model, rows = block()
    one = replace(rows, pressures=np.eye(1))
    reduction = reduced("attachment", (model, one))
    assert (reduction.Phi.shape[1], reduction.quality["static_dropped"]) == (1, 1)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (
            {"reduction": "partial-interface", "kept": ["lod"]},
            "kept: 'lod' given, the component has the interfaces and",
        ),
        ({"reduction": "partial-interface", "kept": ["bottom"]}, "kept: 'bottom' given, none of its dofs is on the"),
        ({"reduction": "interface", "boundary": ["floor"]}, "boundary: the mesh has no surface 'floor', it has back"),
        ({"reduction": "interface", "interface_count": 999}, "interface_count: 999 given, the boundary has"),
        ({"reduction": "attachment", "normal_count": 2}, "normal_count: 2 given, the 1 rows of the interfaces have 1"),
    ],
)
def test_what_there_is_not_is_refused(table: dict[str, Any], message: str) -> None:
    tables = {"geometry": BOX.model_dump(), "material": STEEL.model_dump()}
    tables["interface"] = {"lid": {"surface": "top", "kind": "patch"}}
    item = Component.model_validate(tables | {"modes": {"normal_count": 3} | table})
    with pytest.raises(InputError) as caught:
        reduce_component(BOX.build(0.03), "ab" * 32, item, "block")
    assert str(caught.value).startswith(f"component.block.modes.{message}")


def test_a_component_keeps_the_dofs_of_its_interface() -> None:
    tables = {"geometry": BOX.model_dump(), "material": STEEL.model_dump()}
    tables["interface"] = {"lid": {"surface": "top", "kind": "patch"}, "foot": {"surface": "bottom", "kind": "patch"}}
    modes = {"reduction": "partial-interface", "normal_count": 6, "kept": ["foot"], "interface_count": 9}
    record = reduce_component(BOX.build(0.03), "ab" * 32, Component.model_validate(tables | {"modes": modes}), "block")
    assert 0 < record.quality["kept_dofs"] < record.quality["boundary_dofs"]


def test_shapes_of_rows_are_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(import_module("gudgeon.pipeline.reduction.methods.macneal"), "LARGEST_BOUNDARY", 0)
    for reduction in ("rubin", "attachment"):
        with pytest.raises(InputError, match=f"modes.reduction: '{reduction}' given, it makes one shape for each of"):
            reduced(reduction, block(), normal_count=3)


def test_attachment_modes_need_a_row() -> None:
    model, _ = block()
    with pytest.raises(InputError, match="the 0 rows of the interfaces have 0 independent"):
        reduced("attachment", (model, ContactRows(sparse.csr_matrix((0, model.K.shape[0])), np.empty((0, 0)))))


def test_keys_left_out_identify_nothing() -> None:
    """Records made before these keys existed are found again."""
    new = {"boundary", "kept", "interface_count"}
    assert not new & set(ModesSettings().model_dump(mode="json"))
    given = ModesSettings(boundary=("a",), kept=("b",), interface_count=0).model_dump(mode="json")
    assert new <= set(given)


@pytest.mark.parametrize("supports", [FREE, HELD])
@pytest.mark.parametrize("dense", [True, False])
def test_craig_bampton_of_rows_is_the_basis_of_constraint_and_fixed_interface_modes(
    supports: tuple[str, ...], dense: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its frequencies are those of the dense basis of {rigid motions, K u = B' lambda, modes with B u = 0}."""
    method = import_module("gudgeon.pipeline.reduction.methods.row_craig_bampton")
    monkeypatch.setattr(method, "DENSE", 10_000 if dense else 0)
    model, _ = block(supports)
    nodes = np.unique(model.mesh.surfaces["top"].facets)
    nodes = nodes[~model.held[3 * nodes + 2]][:5]
    B = model.rows(nodes, np.tile([0.0, 0.0, 1.0], (len(nodes), 1)))
    case = model, ContactRows(sparse.csr_matrix(B), np.empty((len(nodes), 0)), {"lid": [0, len(nodes)]})
    ours = reduced("row-craig-bampton", case, boundary=[], fixed_count=4)
    K, M, b = (one[:, model.free].toarray() for one in (model.K[model.free], model.M[model.free], case[1].B))
    N, rigid = linalg.null_space(b), model.rigid_modes[model.free]
    values, vectors = linalg.eigh(N.T @ K @ N, N.T @ M @ N)
    loose = int((values < 1e-6 * values[-1]).sum())
    basis = [rigid, N @ vectors[:, loose : loose + 4]]
    # Static displacements under row forces without resultant: of K with its rigid motions made stiff.
    stiff = K + 1e-3 * np.trace(K) * (M @ rigid) @ (M @ rigid).T / np.trace(M)
    forces = linalg.null_space((b @ rigid).T) if rigid.shape[1] else np.eye(len(nodes))
    basis.append(np.linalg.solve(stiff, b.T @ forces))
    T = linalg.orth(np.hstack([part / np.linalg.norm(part, axis=0) for part in basis]))
    exact = np.sqrt(linalg.eigh(T.T @ K @ T, T.T @ M @ T, eigvals_only=True)[rigid.shape[1] :])
    assert len(ours.angular_frequencies) == len(exact)
    np.testing.assert_allclose(ours.angular_frequencies, exact, rtol=1e-7)


def test_rows_are_held_in_more_modes_than_there_are() -> None:
    with pytest.raises(InputError, match=r"modes\.fixed_count: 100000 given, the body with its interfaces held has"):
        reduced("row-craig-bampton", block(), boundary=[], fixed_count=100_000)
