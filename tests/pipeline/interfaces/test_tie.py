"""RBE2 and RBE3: rigid motions, balance of forces, beam theory, and the dense constrained problem.

A box under a linear traction, which RBE3 applies, has an exact solution of quadratic displacements: tet10 reproduce it.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import linalg, sparse

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.geometry.shapes.sphere import Sphere
from gudgeon.pipeline.interfaces.tie import Tie, made_rigid, tie_of, tie_rows
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.nodal.scene.problem import nodal_problem
from gudgeon.pipeline.reduction.methods import REDUCTIONS, ContactRows
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.scenes.modes import ModesSettings
from gudgeon.pipeline.scenes.supports import Support
from gudgeon.pipeline.stages.run import run_job
from tests.pipeline.small import write_scene

LX, LY, LZ, E = 0.02, 0.03, 0.1, 2e11
STEEL = Material(E=E, nu=0.3, rho=7800.0)
ROUND_OFF = 1e-12
BALANCED = 1e-13
"""Of unit forces and moments of the size of the part."""
EXACT = 1e-9
"""Static solutions of a few hundred dofs."""


@pytest.fixture(scope="module")
def mesh() -> MeshRecord:
    return Box(kind="box", lx=LX, ly=LY, lz=LZ).build(0.02)


@pytest.fixture(scope="module")
def model(mesh: MeshRecord) -> FEModel:
    return build_model(mesh, STEEL)


def tie(mesh: MeshRecord, surface: str, kind: str = "rbe3", point: tuple[float, float, float] | None = None) -> Tie:
    return tie_of(mesh, Interface.model_validate({"surface": surface, "kind": "tie", "tie": kind, "point": point}), "t")


def both_ends(mesh: MeshRecord, model: FEModel) -> tuple[dict[str, Tie], sparse.csr_matrix]:
    ties = {name: tie(mesh, name, "rbe2") for name in ("bottom", "top")}
    return ties, sparse.csr_matrix(sparse.vstack([tie_rows(model, one).B for one in ties.values()]))


def relative(B: sparse.csr_matrix, model: FEModel, motion: int) -> float:
    """Return the motion of the top against the bottom under a unit pair of forces or moments along it."""
    load = np.zeros((12, 1))
    load[[motion, 6 + motion], 0] = -1.0, 1.0
    moved = B @ Flexibility(model).solve(B.T @ load)
    return float(moved[6 + motion, 0] - moved[motion, 0])


@pytest.mark.parametrize("point", [None, (0.01, -0.02, 0.15)])
def test_the_point_follows_rigid_motions(mesh: MeshRecord, model: FEModel, point: tuple | None) -> None:
    one = tie(mesh, "top", point=point)
    np.testing.assert_allclose(one.point, point or (0, 0, LZ), atol=1e-15)
    rows = tie_rows(model, one)
    for motion, twist in enumerate(np.eye(6)):
        about_point = (twist[:3] + np.cross(twist[3:], model.nodes - one.point)).ravel()
        np.testing.assert_allclose(rows.B @ about_point, np.eye(6)[motion], atol=ROUND_OFF)


@pytest.mark.parametrize("surface", ["top", "surface"])
def test_forces_and_moments_balance(mesh: MeshRecord, model: FEModel, surface: str) -> None:
    if surface == "surface":
        mesh = Sphere(kind="sphere", radius=0.05).build(0.03)
        model = build_model(mesh, STEEL)
    rows = tie_rows(model, tie(mesh, surface, point=(0.01, -0.02, 0.15)))
    forces = rows.B.toarray().reshape(6, -1, 3)
    moments = np.cross(mesh.nodes, forces).sum(axis=1)
    np.testing.assert_allclose(np.hstack([forces.sum(axis=1), moments]), rows.resultant, atol=BALANCED)
    assert rows.unit == "N, N m"
    corners = np.setdiff1d(mesh.surfaces[surface].facets[:, :3], mesh.surfaces[surface].facets[:, 3:])
    assert np.abs(forces[0, corners]).max() < np.abs(forces[0]).max()


def test_rbe3_is_exact_for_tension_and_bending(mesh: MeshRecord, model: FEModel) -> None:
    B = sparse.csr_matrix(sparse.vstack([tie_rows(model, tie(mesh, name)).B for name in ("bottom", "top")]))
    assert relative(B, model, 2) == pytest.approx(LZ / (E * LX * LY), rel=EXACT)
    assert relative(B, model, 3) == pytest.approx(LZ / (E * LX * LY**3 / 12), rel=EXACT)
    assert relative(B, model, 4) == pytest.approx(LZ / (E * LY * LX**3 / 12), rel=EXACT)


def test_rbe2_is_stiffer_by_its_rigid_ends_alone(mesh: MeshRecord, model: FEModel) -> None:
    """Without lateral contraction rigid ends hinder nothing; with it they stiffen within a width of each end."""
    for nu, most in ((0.0, EXACT), (0.3, 0.03)):
        free = build_model(mesh, Material(E=E, nu=nu, rho=7800.0))
        ties, B = both_ends(mesh, free)
        tied, L = made_rigid(free, ties, "t")
        for motion, beam in ((2, LZ / (E * LX * LY)), (3, LZ / (E * LX * LY**3 / 12))):
            share = 1 - relative(sparse.csr_matrix(B @ L), tied, motion) / beam
            assert -EXACT <= share <= most
            assert nu == 0 or share > 0.005


def test_tied_surfaces_move_as_rigid_bodies(mesh: MeshRecord, model: FEModel) -> None:
    ties, B = both_ends(mesh, model)
    tied, L = made_rigid(model, ties, "t")
    np.testing.assert_allclose(L @ tied.rigid_modes, model.rigid_modes, atol=1e-12)
    shape = L @ np.where(tied.held, 0.0, np.random.default_rng(1).standard_normal(len(tied.held)))
    for number, one in enumerate(ties.values()):
        motion = (B @ shape)[6 * number : 6 * number + 6]
        expected = one.rigid(mesh.nodes[one.nodes]) @ motion
        np.testing.assert_allclose(shape.reshape(-1, 3)[one.nodes], expected, atol=1e-11 * np.abs(shape).max())
    touched = sparse.csr_matrix(B @ L)
    touched.eliminate_zeros()
    assert len(np.unique(touched.indices)) == 12


def constrained(model: FEModel, ties: dict[str, Tie], fixed: str | None = None) -> np.ndarray:
    """Return all eigenvalues with u = P (t, θ) put in by hand on every tied surface; `fixed` names one that is held."""
    owned = np.concatenate([one.nodes for one in ties.values()])
    free = np.setdiff1d(np.arange(len(model.nodes)), owned)
    T = np.zeros((3 * len(model.nodes), 3 * len(free) + 6 * len(ties)))
    T[(3 * free[:, None] + np.arange(3)).ravel(), np.arange(3 * len(free))] = 1.0
    for number, (name, one) in enumerate(ties.items()):
        if name != fixed:
            arm = model.nodes[one.nodes] - one.point
            for axis in range(6):
                twist = np.eye(6)[axis]
                field = twist[:3] + np.cross(twist[3:], arm)
                dofs = (3 * one.nodes[:, None] + np.arange(3)).ravel()
                T[dofs, 3 * len(free) + 6 * number + axis] = field.ravel()
    T = T[:, T.any(axis=0)]
    T = T / np.linalg.norm(T, axis=0)
    return linalg.eigh(T.T @ (model.K @ T), T.T @ (model.M @ T), eigvals_only=True)


@pytest.fixture(scope="module")
def coarse() -> FEModel:
    """Small enough for dense eigenproblems."""
    return build_model(Box(kind="box", lx=LX, ly=LY, lz=LZ).build(0.04), STEEL)


def test_craig_bampton_between_rigid_ends_is_the_constrained_problem(coarse: FEModel) -> None:
    model = coarse
    ties, B = both_ends(model.mesh, model)
    exact = constrained(model, ties)[6:]
    tied, L = made_rigid(model, ties, "t")
    rows = ContactRows(sparse.csr_matrix(B @ L), np.empty((12, 0)), {"bottom": [0, 6], "top": [6, 12]})
    interior = int((~tied.held).sum()) - 12
    full = REDUCTIONS["craig-bampton"](
        tied, rows, ModesSettings(reduction="craig-bampton", normal_count=40, fixed_count=interior)
    )
    assert full.quality["boundary_dofs"] == 12
    assert full.quality["boundary_added"] == 0
    np.testing.assert_allclose(full.angular_frequencies**2, exact[:40], rtol=1e-7)
    small = REDUCTIONS["craig-bampton"](
        tied, rows, ModesSettings(reduction="craig-bampton", normal_count=8, fixed_count=30)
    )
    error = small.angular_frequencies**2 / exact[:8] - 1
    assert error.min() > -1e-8
    assert error.max() < 2e-2


def test_a_held_reference_point_clamps_its_end(coarse: FEModel) -> None:
    model = coarse
    ties, _ = both_ends(model.mesh, model)
    tied, _ = made_rigid(model, {"bottom": ties["bottom"]}, "t")
    held = tied.held.reshape(-1, 3).copy()
    held[ties["bottom"].nodes] = True
    K, M = replace(tied, held=held.ravel(), rigid_twists=np.empty((0, 6))).free_matrices()
    clamped = build_model(model.mesh, STEEL, ["bottom"])
    exact = linalg.eigh(*(matrix.toarray() for matrix in clamped.free_matrices()), eigvals_only=True)
    np.testing.assert_allclose(linalg.eigh(K.toarray(), M.toarray(), eigvals_only=True), exact, rtol=1e-9)
    np.testing.assert_allclose(constrained(model, {"bottom": ties["bottom"]}, "bottom"), exact, rtol=1e-9)


def component(**interface: dict) -> Component:
    return Component.model_validate(
        {
            "geometry": {"kind": "box", "lx": LX, "ly": LY, "lz": LZ},
            "material": {"E": E, "nu": 0.3, "rho": 7800.0},
            "interface": interface,
            "modes": {"reduction": "macneal", "normal_count": 8},
        }
    )


END = {"surface": "top", "kind": "tie", "tie": "rbe2"}


@pytest.mark.parametrize("reduction", ["macneal", "craig-bampton", "partial-interface", "rubin", "attachment", "ritz"])
def test_records_hold_the_motions_of_reference_points(mesh: MeshRecord, model: FEModel, reduction: str) -> None:
    part = component(head=END, foot=END | {"surface": "bottom", "tie": "rbe3"})
    settings = {"reduction": reduction, "normal_count": 0 if reduction == "attachment" else 8, "kept": ["head"]}
    if reduction != "partial-interface":
        del settings["kept"]
    part = part.model_copy(update={"modes": ModesSettings.model_validate(settings)})
    record = reduce_component(mesh, "ab" * 32, part, "rod")
    Phi = record.shapes.reshape(3 * len(mesh.nodes), -1)
    np.testing.assert_allclose(Phi.T @ (model.M @ Phi), np.eye(Phi.shape[1]), atol=1e-9)
    one, motion = tie(mesh, "top"), record.loads["head"].rows
    expected = one.rigid(mesh.nodes[one.nodes]) @ motion
    np.testing.assert_allclose(record.shapes[one.nodes], expected, atol=1e-9 * np.abs(Phi).max())
    tied, L = made_rigid(model, {"head": one}, "t")
    B = sparse.csr_matrix(sparse.vstack([tie_rows(model, tie(mesh, "bottom")).B, tie_rows(model, one).B]) @ L)
    assert record.interface_rows == {"foot": [0, 6], "head": [6, 12]}
    rows = np.vstack([record.loads["foot"].rows, motion])
    found = (rows / record.angular_frequencies**2) @ rows.T + record.residual_flexibility
    exact = B @ Flexibility(tied).solve(B.T.toarray())
    scale = np.sqrt(np.outer(exact.diagonal(), exact.diagonal()))
    np.testing.assert_allclose(found / scale, exact / scale, atol=1e-8)


LINE = Surface(np.array([[0, 1, 2, 3, 4, 5]]), {})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"surfaces": {"top": Surface(np.zeros((0, 6), int), {})}},
         r"interface\.head\.surface: 'top' given, its 0 nodes are too few to tie; at least 3 nodes"),
        ({"surfaces": {"top": LINE}}, r"its 6 nodes lie on one line and are too few to tie"),
        ({"surfaces": {}}, r"interface\.head\.surface: the mesh has no surface 'top'"),
    ],
)  # fmt: skip
def test_too_few_nodes_are_refused(mesh: MeshRecord, change: dict, message: str) -> None:
    nodes = mesh.nodes.copy()
    nodes[:6] = np.linspace(0, 1, 6)[:, None] * [1.0, 2.0, 3.0]
    with pytest.raises(InputError, match=rf"component\.rod\..*{message}"):
        reduce_component(replace(mesh, nodes=nodes, **change), "ab" * 32, component(head=END), "rod")


def test_a_line_has_too_few_nodes() -> None:
    bar = Component.model_validate(
        {
            "geometry": {"kind": "bar", "length": 1.0, "area": 1e-4},
            "material": {"E": E, "nu": 0.3, "rho": 7800.0},
            "interface": {"end": {"surface": "right", "kind": "tie", "tie": "rbe3"}},
        }
    )
    with pytest.raises(InputError, match=r"component\.bar\.interface\.end\.surface: 'right' given, it has 1 node of a"):
        reduce_component(bar.geometry.build(0.1), "ab" * 32, bar, "bar")


def test_nodes_have_one_master(mesh: MeshRecord) -> None:
    corner = component(head=END, side=END | {"surface": "left"})
    with pytest.raises(InputError, match=r"interface\.side\.tie: 'rbe2' given, interface 'head' ties \d+ of its \d+"):
        reduce_component(mesh, "ab" * 32, corner, "rod")
    held = component(head=END).model_copy(update={"supports": (Support(surface="left"),)})
    with pytest.raises(InputError, match=r"interface\.head\.tie: 'rbe2' given, supports hold \d+ of its \d+ nodes"):
        reduce_component(mesh, "ab" * 32, held, "rod")


def test_the_nodal_synthesis_knows_no_rigid_surfaces(tmp_path: Path) -> None:
    tie = ["component.skirt.interface.lid={surface='crown', kind='tie', tie='rbe2'}"]
    job = open_job(write_scene(tmp_path), set=tie, db=tmp_path / "db")
    run_job(job, "mesh")
    with pytest.raises(
        InputError, match=r"skirt\.interface\.lid\.tie: 'rbe2' given, report\.full_fe does not support rigid surf"
    ):
        nodal_problem(job)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"surface": "top", "kind": "tie"}, "kind 'tie' needs tie, 'rbe2' or 'rbe3'"),
        ({"surface": "top", "tie": "rbe2"}, "tie is for 'tie' only, the kind is 'points'"),
        ({"surface": "top", "kind": "mean", "point": [0, 0, 0]}, "point is for 'tie' only, the kind is 'mean'"),
        ({**END, "height": [0, 1]}, "height is for 'points' and 'traction' only, the kind is 'tie'"),
    ],
)
def test_keys_that_do_not_fit_are_refused(given: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Interface.model_validate(given)


def test_other_interfaces_keep_their_keys() -> None:
    assert not {"tie", "point"} & set(Interface(surface="top").model_dump(mode="json"))
