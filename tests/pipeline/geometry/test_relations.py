"""Springs, equations and ties of decks as parts of the body."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.decks.members.tied import nearest_points
from gudgeon.pipeline.interfaces.point_mass import component_model
from gudgeon.pipeline.interfaces.tie import made_rigid, rigid_ties
from gudgeon.pipeline.scenes.component import Component
from tests.pipeline.geometry.test_decks import BASE, BDF, POINTS, read, refusal

CDB = (
    "ET,1,185\nET,2,14\nKEYOPT,2,2,1\nNBLOCK,6,SOLID\n(3i9,6e21.13e3)\n"
    + "".join(f"{n:9}{0:9}{0:9}" + "".join(f"{x:21.13E}" for x in p) + "\n" for n, p in enumerate(POINTS, 1))
    + "-1\nEBLOCK,19,SOLID\n(19i9)\n"
    + "".join(f"{k:9}" for k in (1, 1, 1, 1, 0, 0, 0, 0, 8, 0, 1, 1, 2, 3, 3, 4, 4, 4, 4)) + "\n{spring}-1\n"
)  # fmt: skip
COMBIN14 = "".join(f"{k:9}" for k in (1, 2, 1, 1, 0, 0, 0, 0, 2, 0, 2, 1, 4)) + "\n"
CONSTANTS = "RLBLOCK,1,1,2,7\n(2i8,6g16.9)\n(7g16.9)\n" + f"{1:8}{2:8}{500:16.9f}{0:16.9f}\n"
SPRING2 = "*ELEMENT, TYPE=SPRING2, ELSET=SP\n9, 1, 4\n*SPRING, ELSET=SP\n1, 2\n500.\n"
SPRINGA = "*ELEMENT, TYPE=SPRINGA, ELSET=SP\n9, 1, 2\n*SPRING, ELSET=SP\n\n500.\n"
EQUATION = "*EQUATION\n2\n4, 1, 1., 3, 2, -2.\n"
LINKED: dict[str, tuple[str, str, list[tuple[int, int, float]], float]] = {
    "SPRING": ("part.inp", BASE + SPRING2, [(1, 0, 1.0), (4, 1, -1.0)], 500.0),
    "SPRING along its line": ("part.inp", BASE + SPRINGA, [(1, 0, -1.0), (2, 0, 1.0)], 500.0),
    "SPRING to the ground": ("part.inp", BASE + SPRING2.replace("SPRING2", "SPRING1").replace(", 4\n", "\n").replace(
        "1, 2\n", "3\n"), [(1, 2, 1.0)], 500.0),
    "EQUATION": ("part.inp", BASE + EQUATION, [(4, 0, 1.0), (3, 1, -2.0)], 0.0),
    "MPC": ("part.inp", BASE + "*MPC\nPIN, 4, 1\n", [(n, k, c) for k in range(3) for n, c in ((4, 1.0), (1, -1.0))],
            0.0),
    "CELAS2": ("part.bdf", BDF["plain"] + "CELAS2,9,500.,1,1,4,2\n", [(1, 0, 1.0), (4, 1, -1.0)], 500.0),
    "CELAS1": ("part.bdf", BDF["plain"] + "PELAS,7,500.\nCELAS1,9,7,1,1,4,2\n", [(1, 0, 1.0), (4, 1, -1.0)], 500.0),
    "MPC of Nastran": ("part.bdf", BDF["plain"] + "MPC,7,4,1,1.,3,2,-2.,,+\n+,,2,3,-1.\n",
                       [(4, 0, 1.0), (3, 1, -2.0), (2, 2, -1.0)], 0.0),
    "CP": ("part.cdb", CDB.format(spring="") + "CP,R5.0,       1, UX  ,NODE,       2\n         4         3\n",
           [(3, 0, 1.0), (4, 0, -1.0)], 0.0),
    "COMBIN14": ("part.cdb", CDB.format(spring=COMBIN14) + CONSTANTS, [(1, 0, -1.0), (4, 0, 1.0)], 500.0),
}  # fmt: skip
"""Sums of a body of four nodes by what states them: file, text, node, direction and coefficient, stiffness."""


@pytest.mark.parametrize("name", LINKED)
def test_sums_of_displacements_are_taken_over(name: str, tmp_path: Path) -> None:
    file, text, terms, stiffness = LINKED[name]
    (tmp_path / file).write_text(text)
    mesh = read(tmp_path / file)
    (relation,) = mesh.relations.values()
    assert relation.kind == ("spring" if stiffness else "constraint")
    np.testing.assert_array_equal(relation.stiffness, stiffness)
    nonzero = relation.coefficients != 0
    got = zip(relation.nodes[nonzero] + 1, relation.directions[nonzero], relation.coefficients[nonzero], strict=True)
    assert list(got) == terms
    assert mesh.remarks["notes"]
    assert not read(tmp_path / file, leave_out=[name.partition(" ")[0]]).relations


@pytest.mark.parametrize(("text", "words"), [
    (SPRING2.replace("1, 2\n5", "4, 2\n5"), "line 13: SPRING: acts on a rotation"),
    (SPRING2.replace("9, 1, 4", "9, 1, 9"), "SPRING: node 9 is of no solid"),
    (SPRING2.replace("500.", "-5."), "SPRING: a stiffness of -5 given"),
    (SPRING2.replace("ELSET=SP\n1, 2", "ELSET=SP, NONLINEAR\n1, 2"), "SPRING is not taken over"),
    ("*TRANSFORM, NSET=FOOT\n1, 0, 0, 0, 1, 0\n" + SPRING2, "SPRING is not taken over"),
    (EQUATION.replace("4, 1, 1.", "4, 1, 0."), "the coefficient of the first term is 0"),
    (SPRING2 + "*MATERIAL, NAME=S\n*DENSITY\n7.8e-9\n", "density of 7.8e-09 is not in kg/m^3; geometry.mass_unit"),
    ("*MPC\nELBOW, 1, 4\n", "MPC is not taken over"),
])  # fmt: skip
def test_what_is_no_sum_of_displacements_is_refused(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "part.inp").write_text(BASE + text)
    assert words in refusal(tmp_path / "part.inp")


def halves(gap: float = 0.0, *, turned: bool = False) -> str:
    """A bar of two hexahedra of 20 nodes, tied where they meet or have a gap."""
    corners = np.array([[x, y, z] for z in (0, 1) for y, x in ((0, 0), (0, 1), (1, 1), (1, 0))], float)
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    cell = np.concatenate([corners, [(corners[a] + corners[b]) / 2 for a, b in edges]])
    upper = cell + np.array([0, 0, 1 + gap])
    nodes = "".join(f"{n}, {x!r}, {y!r}, {z!r}\n" for n, (x, y, z) in enumerate([*cell.tolist(), *upper.tolist()], 1))
    first, second = (", ".join(map(str, range(s, s + 20))) for s in (1, 21))
    split = [f"{n}, {row[: row.index(str(15 + 20 * (n - 1)))]}\n{row[row.index(str(15 + 20 * (n - 1))) :]}\n"
             for n, row in ((1, first), (2, second))]  # fmt: skip
    pair = "DOWN, UP" if turned else "UP, DOWN"
    return (
        f"*NODE\n{nodes}*ELEMENT, TYPE=C3D20\n{''.join(split)}*SURFACE, NAME=DOWN\n1, S2\n*SURFACE, NAME=UP\n2, S1\n"
        f"*NSET, NSET=FOOT\n1, 2, 3, 4, 9, 10, 11, 12\n*TIE, NAME=SEAM, POSITION TOLERANCE=0.1\n{pair}\n"
    )


def reduced(mesh: MeshRecord, supports: tuple[str, ...] = ()) -> FEModel:
    component = Component.model_validate({
        "geometry": {"kind": "file", "path": "part.inp"}, "supports": supports,
        "material": {"E": 2e11, "nu": 0.3, "rho": 7800.0},
    })  # fmt: skip
    return made_rigid(component_model(mesh, component, "p"), rigid_ties(mesh, {}), "p.interface")[0]


def frequencies(model: FEModel) -> np.ndarray:
    K, M = model.free_matrices()
    return np.sqrt(np.abs(eigh(K.toarray(), M.toarray(), eigvals_only=True)[:20])) / (2 * np.pi)


@pytest.mark.parametrize(("gap", "turned"), [(0.0, False), (0.0, True), (0.02, False)])
def test_tied_halves_vibrate_as_one_bar(gap: float, turned: bool, tmp_path: Path) -> None:
    """Where nodes lie on each other a tie is the merged mesh; a gap is closed first."""
    (tmp_path / "part.inp").write_text(halves(gap, turned=turned))
    mesh = read(tmp_path / "part.inp")
    assert list(mesh.relations) == ["tie_SEAM"]
    note = next(note for note in mesh.remarks["notes"] if "tied" in note)
    assert ("moved onto it by up to 0.02 m" in note) == (gap > 0)
    _, same = np.unique(np.round(mesh.nodes, 9), axis=0, return_inverse=True)
    nodes, cells = np.unique(np.round(mesh.nodes, 9), axis=0), same.ravel()[mesh.cells]
    merged = replace(mesh, nodes=nodes, cells=cells, surfaces={}, relations={})
    model = reduced(mesh)
    assert len(model.rigid_twists) == 6
    np.testing.assert_allclose(frequencies(model)[6:], frequencies(reduced(merged))[6:], rtol=1e-9)
    assert np.abs(frequencies(model)[:6]).max() < 1e-3 * frequencies(model)[6]


def test_a_node_in_a_curved_face_follows_its_shape_functions() -> None:
    """Facets of 6, 8 and 9 nodes, each with its own nodes as targets, and points of a quadratic surface."""
    grid = np.array([[x, y] for y in (-1.0, 0.0, 1.0) for x in (-1.0, 0.0, 1.0)])
    nodes = np.column_stack([grid, 0.1 * grid[:, 0] ** 2])
    quad9 = np.array([[0, 2, 8, 6, 1, 5, 7, 3, 4]])
    targets = np.array([[0.3, 0.4, 0.1 * 0.09], [-1.0, 0.2, 0.1]])
    for facets in (quad9, quad9[:, :8], np.array([[0, 2, 8, 1, 5, 4], [0, 8, 6, 4, 7, 3]])):
        points, shares = nearest_points(nodes, facets, np.concatenate([targets, nodes[facets[0]]]))
        np.testing.assert_allclose(points, np.concatenate([targets, nodes[facets[0]]]), atol=1e-9)
        for point, (chosen, weights) in zip(points, shares, strict=True):
            np.testing.assert_allclose(weights @ nodes[chosen], point, atol=1e-9)


GROUND = "*ELEMENT, TYPE=SPRING1, ELSET=SP\n9, 4\n*SPRING, ELSET=SP\n3\n5e9\n"


def test_a_spring_to_the_ground_needs_supports(tmp_path: Path) -> None:
    (tmp_path / "part.inp").write_text(BASE + GROUND)
    mesh = read(tmp_path / "part.inp")
    with pytest.raises(InputError, match="1 of the springs of its deck hold rigid motions of the body"):
        reduced(mesh)
    stiff, plain = reduced(mesh, ("FOOT",)), reduced(replace(mesh, relations={}), ("FOOT",))
    added = (stiff.K - plain.K).toarray()
    assert added[11, 11] == pytest.approx(5e9)
    assert np.count_nonzero(added) == 1


@pytest.mark.parametrize(("text", "words"), [
    ("*EQUATION\n2\n4, 1, 1., 3, 1, -2.\n", "1 of the constraints of its deck hold rigid motions"),
    ("*MPC\nPIN, 4, 1\nPIN, 1, 4\n", "express displacements by each other in a circle|are held or expressed"),
])  # fmt: skip
def test_constraints_that_contradict_are_refused(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "part.inp").write_text(BASE + text)
    with pytest.raises(InputError, match=words):
        reduced(read(tmp_path / "part.inp"))


def test_pieces_on_a_hinge_are_refused(tmp_path: Path) -> None:
    """Two halves that share two nodes by an equation turn about the line through them."""
    text = halves().partition("*TIE")[0] + "*MPC\nPIN, 5, 21\nPIN, 6, 22\n"
    (tmp_path / "part.inp").write_text(text)
    with pytest.raises(InputError, match="leave 1 motions of its 2 pieces free"):
        reduced(read(tmp_path / "part.inp"))


def test_a_rigid_element_on_supported_nodes_is_named_by_the_key_of_its_deck(tmp_path: Path) -> None:
    (tmp_path / "part.inp").write_text(BASE + "*COUPLING, REF NODE=9, SURFACE=FOOT\n*KINEMATIC\n")
    words = r"^p.geometry: its deck has the rigid element rbe2_9, supports hold 6 of its 6 nodes; .* geometry.leave_out"
    with pytest.raises(InputError, match=words):
        reduced(read(tmp_path / "part.inp"), ("FOOT",))
