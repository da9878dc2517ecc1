"""Meshes and matrices of Python in place of files: the same body as from a file, and one line for what is wrong."""

import contextlib
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
import skfem
from scipy import linalg, sparse
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

import gudgeon
from gudgeon.pipeline.errors import InputError
from tests.pipeline.small import block_on_floor

E, NU, RHO = 210e9, 0.3, 7850.0
EQUAL = 1e-9
"""Relative difference of a frequency from that of the matrices: eigenvalues are ω², of 1e-12 of the largest."""


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path) -> Iterator[None]:
    with contextlib.chdir(tmp_path):
        yield


@pytest.fixture(scope="module")
def block() -> skfem.MeshTet:
    """A block of 48 tetrahedra, half of them numbered the other way round, with the names of two faces."""
    mesh = skfem.MeshTet.init_tensor(*(np.linspace(0.0, size, 3) for size in (0.03, 0.02, 0.04)))
    return mesh.with_boundaries({"bottom": lambda x: x[2] == 0.0, "top": lambda x: np.isclose(x[2], 0.04)})


@skfem.BilinearForm
def mass_form(u: Any, v: Any, w: Any) -> Any:
    return RHO * dot(u, v)


def assembled(basis: skfem.Basis) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """Return stiffness and mass of scikit-fem's own elements."""
    return skfem.asm(linear_elasticity(*lame_parameters(E, NU)), basis), skfem.asm(mass_form, basis)


def basis_of(mesh: skfem.MeshTet, element: Any) -> skfem.Basis:
    return skfem.Basis(mesh, skfem.ElementVector(element))


def scene(geometry: Any, **entries: Any) -> dict[str, Any]:
    """Return the scene of a block on a floor with a geometry; without material where it is one of matrices."""
    tables = tomllib.loads(block_on_floor())
    part = tables["component"]["block"]
    part.pop("mesh")
    part.update(geometry=geometry, **entries)
    return tables


def exact(K: sparse.csr_matrix, M: sparse.csr_matrix) -> np.ndarray:
    """Return the first elastic frequencies of a free body, by a dense solver [Hz]."""
    values = linalg.eigh(K.toarray(), M.toarray(), eigvals_only=True)
    return np.sqrt(values[6:12]) / (2 * np.pi)


def same_mesh(mesh: skfem.MeshTet) -> list[Any]:
    """Return one mesh in each form that Python has."""
    nodes = np.flatnonzero(mesh.p[2] == 0.0)
    facets = mesh.facets[:, mesh.boundaries["bottom"]].T
    in_sets = meshio.Mesh(mesh.p.T, [("tetra", mesh.t.T)], point_sets={"bottom": nodes})
    tagged = meshio.Mesh(
        mesh.p.T, [("tetra", mesh.t.T), ("triangle", facets)],
        cell_data={"gmsh:physical": [np.zeros(len(mesh.t.T), int), np.full(len(facets), 7)]},
        field_data={"bottom": np.array([7, 2])},
    )  # fmt: skip
    quadratic = skfem.MeshTet2.from_mesh(mesh).with_boundaries({"bottom": lambda x: x[2] == 0.0})
    return [mesh, basis_of(mesh, skfem.ElementTetP1()), quadratic, in_sets, tagged, {"kind": "file", "path": mesh}]


def test_a_mesh_is_that_of_its_file_in_every_form(block: skfem.MeshTet) -> None:
    expected = exact(*assembled(basis_of(block, skfem.ElementTetP2())))
    keys = set()
    for geometry in same_mesh(block):
        job = gudgeon.open_job(scene(geometry))
        gudgeon.run(scene(geometry), until="modes")
        record = job.record("block")
        np.testing.assert_allclose(record.frequencies, expected, rtol=1e-6)  # P2's mass is integrated to fewer points.
        assert len(record.interfaces["foot"].nodes) == 16
        keys.add(job.components()["block"]["mesh"].key)
    assert len(keys) < len(same_mesh(block))  # Equal content is one file and one record.


@pytest.mark.parametrize("element", [skfem.ElementTetP1(), skfem.ElementTetP2()], ids=["P1", "P2"])
def test_matrices_on_a_basis_have_their_own_frequencies(block: skfem.MeshTet, element: Any) -> None:
    basis = basis_of(block, element)
    K, M = assembled(basis)
    result = gudgeon.component(scene((K, M, basis)), "block")
    np.testing.assert_allclose(result.frequencies, exact(K, M), rtol=EQUAL)
    assert sorted(result.record.interfaces) == ["foot"]


def test_matrices_on_nodes_and_on_a_mesh_are_one_body(block: skfem.MeshTet) -> None:
    K, M = assembled(basis_of(block, skfem.ElementTetP1()))
    bottom = block.p[2] == 0.0
    forms = {
        "tuple": (K.toarray(), M, block.p.T, {"bottom": bottom}),
        "table": {"kind": "matrices", "stiffness": K, "mass": M, "model": block.p.T, "sets": {"bottom": bottom}},
        "mesh": (K, M, block),
    }
    for name, geometry in forms.items():
        result = gudgeon.component(scene(geometry), "block")
        np.testing.assert_allclose(result.frequencies, exact(K, M), rtol=EQUAL, err_msg=name)
        np.testing.assert_allclose(result.stiffness.toarray(), K.toarray(), rtol=1e-12, atol=1e-6)
        normals = result.record.interfaces["foot"].normals
        np.testing.assert_allclose(normals, np.broadcast_to([0.0, 0.0, -1.0], normals.shape), atol=1e-12, err_msg=name)


def test_matrices_come_out_as_they_belong_together(block: skfem.MeshTet) -> None:
    result = gudgeon.component(scene(block), "block")
    K, M, modes, R = result.stiffness, result.mass, result.modes, result.residual_flexibility
    assert sparse.issparse(K)
    assert sparse.issparse(M)
    assert modes is not None
    assert R is not None
    Phi = modes.reshape(K.shape[0], -1)
    np.testing.assert_allclose(Phi.T @ (M @ Phi), np.eye(Phi.shape[1]), atol=1e-9)
    omega = result.record.angular_frequencies
    np.testing.assert_allclose(Phi.T @ (K @ Phi), np.diag(omega**2), atol=1e-8 * omega.max() ** 2)
    assert result.rows["foot"] == (0, 16)
    assert R.shape[0] >= 16
    assert result.dofs.shape == (K.shape[0], 2)
    np.testing.assert_allclose(result.nodes[result.dofs[4, 0]], result.nodes[1])


def wrong() -> dict[str, tuple[Any, str]]:
    """Return geometries that are wrong, each with what its line says."""
    points, K = np.eye(3, 3), np.eye(9)
    slanted = K.copy()
    slanted[0, 3] = 0.5
    return {
        "shapes": ((K, np.eye(6), points), r"mass: has the shape \(6, 6\), the stiffness \(9, 9\); allowed: one shape"),
        "oblong": ((K[:3], K, points), r"stiffness: has the shape \(3, 9\); allowed: a square matrix"),
        "unsymmetric": ((slanted, K, points), "stiffness: the matrix is not symmetric, entries differ by 0.5 of at"),
        "infinite": ((K * np.nan, K, points), "stiffness: a number of the matrix is not finite"),
        "no numbers": (("K", K, points), "stiffness: 'K' given; allowed: a value of Python, as mass is"),
        "complex": ((K * 1j, K, points), "stiffness: a ndarray of complex128 given; allowed: a real matrix"),
        "nodes": ((K, K, points[:2]), "stiffness: has 9 rows; allowed: 6 or 12, three or six directions of each of"),
        "plane nodes": ((K, K, points[:, :2]), r"model: a ndarray of shape \(3, 2\) given; allowed: positions"),
        "sets": ((K, K, points, {"a": [3]}), r"set 'a': \[3\] given; allowed: rows of nodes, whole numbers"),
        "tuple": ((K, K), ": a tuple of 2 given; allowed: stiffness, mass, nodes"),
        "no elements": (meshio.Mesh(points, []), "the mesh has no cells; allowed with kind 'file': solid cells"),
        "plane mesh": (skfem.MeshTri(), "the mesh has triangle; allowed with kind 'file': solid cells"),
        "solid as plane": (
            {"kind": "plane-file", "path": skfem.MeshTet(), "thickness": 1.0},
            "the mesh has tetra; allowed with kind 'plane-file': triangle6",
        ),
        "far node": (meshio.Mesh(points, [("tetra", [[0, 1, 2, 3]])]), "damaged, not every node of its cells has"),
        "scalar basis": (
            (K, K, skfem.Basis(skfem.MeshTet(), skfem.ElementTetP1())),
            "model: a basis of other than one node a vertex, edge, face or cell, or not in space",
        ),
    }  # fmt: skip


@pytest.mark.parametrize("name", wrong())
def test_what_is_wrong_is_one_line(name: str) -> None:
    geometry, text = wrong()[name]
    with pytest.raises(InputError, match=f"^<mapping>: component.block.geometry.*{text}") as error:
        gudgeon.open_job(scene(geometry))
    assert "\n" not in str(error.value)
    assert not list(Path().rglob("*.mtx"))  # Nothing is written of what is refused.
