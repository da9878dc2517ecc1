"""What every member of `ELEMENTS` and `CELLS` satisfies: one that is listed there is tested here."""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
import pytest
import pyvista as pv
import skfem
from pydantic import BaseModel

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.elements import ELEMENTS, Element
from gudgeon.pipeline.fem.elements.reference import MASS_ORDER, orders, reference, rule, shape_functions
from gudgeon.pipeline.fem.elements.shapes import SPANS, reference_nodes
from gudgeon.pipeline.geometry.cells import (
    CELLS,
    FACETS,
    HEXAHEDRON8,
    HEXAHEDRON20,
    HEXAHEDRON27,
    MIXED,
    PYRAMID,
    QUADRANGLE,
    SOLIDS,
    WEDGE,
    WEDGE6,
    Cell,
    Polytope,
    quadratic_basis,
)
from gudgeon.pipeline.geometry.shapes.bar import Bar
from gudgeon.pipeline.geometry.shapes.beam import Beam
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.geometry.shapes.plane import Rectangle
from gudgeon.pipeline.geometry.shapes.rigid import Rigid
from gudgeon.pipeline.plots.base.surface import CELLS as VTK
from gudgeon.pipeline.scenes.material import Material
from tests.pipeline.solids import FAMILIES, box

STEEL = Material(E=210e9, nu=0.3, rho=7850.0)
SIZE = 0.05
BEAM = {
    "kind": "beam",
    "theory": "euler-bernoulli",
    "length": 0.2,
    "section": {"kind": "rectangle", "width": 0.02, "height": 0.01},
}


class Solid(BaseModel):
    """A box of one type of cell, or of four."""

    name: str

    def build(self, _: float) -> MeshRecord:
        """Return its mesh."""
        return box(
            FAMILIES["serendipity"] if self.name == MIXED.name else [CELLS[self.name]], (2, 2, 2), (0.1, 0.06, 0.05)
        )


PARTS: Mapping[str, BaseModel] = {
    name: Solid(name=name) for name in (*[c.name for c in SOLIDS.values()], MIXED.name)
} | {
    "tetra10": Box.model_validate({"kind": "box", "lx": 0.1, "ly": 0.06, "lz": 0.05}),
    "triangle6": Rectangle.model_validate({"kind": "rectangle", "lx": 0.1, "ly": 0.06, "thickness": 0.01}),
    "line3": Bar.model_validate({"kind": "bar", "length": 0.2, "area": 1e-4}),
    "beam2": Beam.model_validate(BEAM | {"theory": "euler-bernoulli"}),
    "beam3": Beam.model_validate(BEAM | {"theory": "timoshenko"}),
    "frame2": Beam.model_validate(BEAM | {"motion": "space"}),
    "vertex": Rigid.model_validate({"kind": "rigid", "mass": 2.0, "inertia": [1e-3, 2e-3, 3e-3]}),
}
"""A part of each element."""
BASES: set[Cell] = {*SOLIDS.values(), *FACETS.values()} | {e.cell for e in ELEMENTS.values() if e.cell.quadratic}
"""Those with shape functions on a reference element."""
SHAPES = {id(cell.shape): cell.shape for cell in CELLS.values() if cell.shape.corners and cell.dimension}.values()
DRAWN = [cell for cell in CELLS.values() if cell.name in VTK]
VOLUMES = {WEDGE: 1 / 2, PYRAMID: 4 / 3, QUADRANGLE: 1.0, HEXAHEDRON8.shape: 1.0}
"""Of reference elements that are no simplices."""
each_cell = pytest.mark.parametrize("cell", sorted(BASES, key=lambda c: c.name), ids=lambda cell: cell.name)
SIMPLICES = [cell for cell in BASES if cell.quadratic and cell not in SPANS]
simplices = pytest.mark.parametrize("cell", sorted(SIMPLICES, key=lambda cell: cell.name), ids=lambda cell: cell.name)
rng = np.random.default_rng(5)


@pytest.mark.parametrize("element", ELEMENTS.values(), ids=ELEMENTS)
def test_matrices_have_the_rigid_motions_and_mass_of_the_part(element: Element) -> None:
    part = PARTS[element.cell.name]
    mesh = part.build(SIZE)  # type: ignore[attr-defined]
    model = build_model(mesh, STEEL, geometry=part)
    motions, count = model.rigid_modes, len(model.rigid_twists)
    assert mesh.cell_type == element.cell.name
    assert element.cell is MIXED or mesh.cells.shape[1] == element.cell.nodes
    assert model.K.shape == model.M.shape == (len(motions), len(motions))
    for matrix in (model.K, model.M):
        assert abs(matrix - matrix.T).max() == 0.0
    assert abs(model.K @ motions).max(initial=0.0) <= 1e-9 * abs(model.K).max() * abs(motions).max()
    if not element.cell.dofs:
        assert model.K.nnz == model.M.nnz == 0
        return
    assert len(model.directions) == element.cell.dofs
    np.testing.assert_allclose(motions.T @ (model.M @ motions), np.eye(count), atol=1e-9)
    along = model.nodal(motions)[..., 0]  # A translation: all of the mass moves by 1/√m.
    np.testing.assert_allclose(np.linalg.norm(along, axis=1), model.properties.mass**-0.5, rtol=1e-9)


@each_cell
def test_shape_functions_are_a_partition_of_unity(cell: Cell) -> None:
    N, dN = shape_functions(cell, rng.random((cell.dimension, 20)) / cell.dimension)
    np.testing.assert_allclose(N.sum(axis=0), 1.0, rtol=1e-14)
    np.testing.assert_allclose(dN.sum(axis=0), 0.0, atol=1e-14)
    np.testing.assert_allclose(shape_functions(cell, reference_nodes(cell).T)[0], np.eye(cell.nodes), atol=1e-14)


@each_cell
def test_gradients_are_those_of_the_shape_functions(cell: Cell) -> None:
    """Central differences are exact for quadratic functions but for round-off; those of pyramids are rational."""
    X, step = rng.random((cell.dimension, 20)) / cell.dimension, 1e-3
    _, dN = shape_functions(cell, X)
    for k, along in enumerate(step * np.eye(cell.dimension)[:, :, None]):
        difference = (shape_functions(cell, X + along)[0] - shape_functions(cell, X - along)[0]) / (2 * step)
        np.testing.assert_allclose(dN[:, k], difference, atol=2e-5 if cell.shape is PYRAMID else 1e-11)


@simplices
def test_the_basis_of_simplices_is_that_of_scikit_fem(cell: Cell) -> None:
    X = rng.random((cell.dimension, 20)) / cell.dimension
    basis = quadratic_basis(np.vstack([1 - X.sum(axis=0), X]).T, cell.shape)
    for values, expected in zip(basis, shape_functions(cell, X), strict=True):
        np.testing.assert_allclose(np.moveaxis(values, 0, -1), expected, atol=1e-13)


@pytest.mark.parametrize(
    ("cell", "theirs"),
    [
        (HEXAHEDRON8, "ElementHex1"), (HEXAHEDRON20, "ElementHexS2"), (HEXAHEDRON27, "ElementHex2"),
        (WEDGE6, "ElementWedge1"),
    ],
    ids=lambda value: getattr(value, "name", value),
)  # fmt: skip
def test_products_are_those_of_scikit_fem(cell: Cell, theirs: str) -> None:
    element, X = getattr(skfem, theirs)(), rng.random((3, 20)) / 3
    order = [int(np.linalg.norm(reference_nodes(cell) - place, axis=1).argmin()) for place in element.doflocs]
    assert sorted(order) == list(range(cell.nodes))
    N, dN = shape_functions(cell, X)
    for number, a in enumerate(order):
        values, gradients = element.lbasis(X, number)
        np.testing.assert_allclose(N[a], values, atol=1e-13)
        np.testing.assert_allclose(dN[a], gradients, atol=1e-13)


@each_cell
def test_nodes_lie_between_the_corners_of_their_edges(cell: Cell) -> None:
    xi, corners = reference_nodes(cell), cell.shape.corners
    edges = cell.shape.edges if cell.quadratic else cell.shape.edges[:0]
    np.testing.assert_allclose(xi[corners : corners + len(edges)], xi[edges].mean(axis=1), atol=1e-15)
    for face in cell.faces if cell.centred and cell.dimension == 3 else []:
        if len(face) == 9:
            np.testing.assert_allclose(xi[face[8]], xi[face[:4]].mean(axis=0), atol=1e-15)


@each_cell
def test_quadrature_is_exact_for_the_mass(cell: Cell) -> None:
    """Against a rule of higher degree; the weights add up to the measure of the reference cell."""
    lowest = orders(cell)[1] if cell in SPANS else 4
    masses = [(N * W) @ N.T for N, _, W in (reference(cell, order) for order in (lowest, MASS_ORDER, MASS_ORDER + 2))]
    for mass in masses[:2]:
        np.testing.assert_allclose(mass, masses[2], atol=1e-14)
    volume = VOLUMES.get(cell.shape, 1 / np.prod(np.arange(1, cell.dimension + 1)))
    assert rule(cell, MASS_ORDER)[1].sum() == pytest.approx(volume, rel=1e-14)


@each_cell
def test_faces_look_outward(cell: Cell) -> None:
    """On a solid by the right hand, on a plane part to the right of the edge."""
    xi = np.pad(reference_nodes(cell), ((0, 0), (0, 3 - cell.dimension)))
    centre = xi[: cell.shape.corners].mean(axis=0)
    for face in cell.faces if cell.dimension > 1 else []:
        a, b, *more = xi[face[: cell.dimension]]
        normal = np.cross(b - a, more[0] - a if more else [0.0, 0.0, 1.0])
        assert normal @ (a - centre) > 0


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: f"{shape.dimension}D-{shape.corners}")
def test_faces_cover_the_boundary_once(shape: Polytope) -> None:
    """Faces of a solid pass each edge once in each direction; the sides of a plane cell are one loop."""
    edges = set(map(frozenset, shape.edges.tolist()))
    if shape.dimension == 1:
        assert shape.sides == [[0], [1]]
        return
    passes = [pair for side in shape.sides for pair in pairwise((*side, side[0]))]
    if shape.dimension == 2:
        passes = [(a, b) for a, b in shape.sides]
        assert sorted(a for a, _ in passes) == sorted(b for _, b in passes) == list(range(shape.corners))
    else:
        assert sorted(set(passes)) == sorted(passes) == sorted((b, a) for a, b in passes)
    assert {frozenset(pair) for pair in passes} == edges


@pytest.mark.parametrize("cell", DRAWN, ids=lambda cell: cell.name)
def test_edges_and_faces_are_those_of_vtk(cell: Cell) -> None:
    drawn = pv.UnstructuredGrid({VTK[cell.name]: np.arange(cell.nodes)[None]}, rng.random((cell.nodes, 3))).get_cell(0)
    middles = range(cell.shape.corners, cell.nodes)
    edges = [sorted(ends) for ends in cell.shape.edges.tolist()]
    expected = [[*ends, middle] for ends, middle in zip(edges, middles, strict=False)] if cell.quadratic else edges
    assert sorted([*sorted(e.point_ids[:2]), *e.point_ids[2:]] for e in drawn.edges) == sorted(expected)
    if cell.dimension == 3:
        assert sorted(sorted(face.point_ids) for face in drawn.faces) == sorted(map(sorted, cell.faces))


@pytest.mark.parametrize("cell", [cell for cell in CELLS.values() if cell.universal], ids=lambda cell: cell.name)
def test_universal_files_have_each_node_once(cell: Cell) -> None:
    assert cell.universal is not None
    counted = cell.shape.corners + cell.quadratic * len(cell.shape.edges)
    assert sorted(cell.universal[1]) == list(range(counted if cell.dimension > 1 else cell.shape.corners))
