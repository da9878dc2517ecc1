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


def sums_of_deck(path: Path, name: str, **keys: object) -> list[dict[tuple[int, int], float]]:
    """Return the coefficients of each sum by node from 1 and direction."""
    record = read(path, **keys).relations[name]
    sums: list[dict[tuple[int, int], float]] = [{} for _ in record.stiffness]
    for row, node, direction, c in zip(
        record.rows.tolist(), record.nodes.tolist(), record.directions.tolist(), record.coefficients.tolist(),
        strict=True,
    ):  # fmt: skip
        sums[row][node + 1, direction] = c
    return sums


R2 = 2**-0.5
PERPENDICULAR = "CORD2R,5,,0.,0.,0.,0.,0.,1.\n,0.,1.,0.\n"
BUSHES: dict[str, tuple[str, list[dict[tuple[int, int], float]], list[float]]] = {
    "in the basic system": ("CBUSH,9,7,1,,,,,0\n", [{(1, 0): 1.0}, {(1, 1): 1.0}], [5.0, 6.0]),
    "in a system": (PERPENDICULAR + "CBUSH,9,7,1,,,,,5\n", [{(1, 1): 1.0}, {(1, 0): -1.0}], [5.0, 6.0]),
    "of one place": ("GRID,8,,1.,0.,4.\nRBE2,6,8,123456,1,2,3\nCBUSH,9,7,4,8,,,,0\n",
                     [{(4, 0): 1.0, (1, 0): -1.0, (3, 1): 0.0}], [5.0, 6.0]),
}  # fmt: skip
PBUSH = "PBUSH,7,K,5.,6.\n"


@pytest.mark.parametrize("name", BUSHES)
def test_springs_of_a_bush(name: str, tmp_path: Path) -> None:
    text, sums, stiffness = BUSHES[name]
    (tmp_path / "part.bdf").write_text(BDF["plain"] + PBUSH + text)
    np.testing.assert_array_equal(read(tmp_path / "part.bdf").relations["springs"].stiffness, stiffness)
    if name != "of one place":
        assert sums_of_deck(tmp_path / "part.bdf", "springs") == sums


def test_a_bush_between_led_points_strains_in_relative_motion_alone(tmp_path: Path) -> None:
    """Its ends are apart: each end's rotation moves its middle; in rigid motions nothing strains."""
    led = "GRID,8,,1.,0.5,4.\nGRID,9,,2.,0.5,1.\nRBE3,5,,8,123456,1.,123,1,2\n,4\nRBE3,6,,9,123456,1.,123,1,2\n,3\n"
    bush = "PBUSH,7,K,5.,6.,7.,8.,9.,10.\nCBUSH,9,7,8,9,,,,0\n"
    (tmp_path / "part.bdf").write_text(BDF["plain"] + led + bush)
    mesh = read(tmp_path / "part.bdf")
    C = coefficients(mesh, "springs")
    assert C.shape[0] == 6
    for t, omega in (([1.0, 2, 3], [0, 0, 0]), ([0, 0, 0], [1.0, -2.0, 0.5])):
        u = (np.array(t) + np.cross(omega, mesh.nodes)).ravel()
        np.testing.assert_allclose(C @ u, 0, atol=1e-9)
    across = "PBUSH,7,K,5.,6.\nCBUSH,9,7,1,4,,,,0\n"
    (tmp_path / "part.bdf").write_text(BDF["plain"] + across)
    assert "CBUSH: acts on a rotation, which nodes of solids do not have" in refusal(tmp_path / "part.bdf")
    (tmp_path / "part.bdf").write_text(BDF["plain"] + "PBUSH,7,K,5.,,,,,,+\n+,B,3.\nCBUSH,9,7,1,2\n")
    assert "CBUSH is not taken over" in refusal(tmp_path / "part.bdf")


def coefficients(mesh: MeshRecord, name: str) -> np.ndarray:
    record = mesh.relations[name]
    C = np.zeros((len(record.stiffness), 3 * len(mesh.nodes)))
    np.add.at(C, (record.rows, 3 * record.nodes + record.directions), record.coefficients)
    return C


ROUND = "CORD2C,5,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\n"


def with_directions(text: str, nodes: tuple[int, ...], system: int) -> str:
    """Return bulk data whose grid points have directions of a system."""
    lines = text.splitlines(keepends=True)
    return "".join(
        line.rstrip("\n").ljust(48) + f"{system:8}\n" if line.startswith("GRID") and int(line[8:16]) in nodes else line
        for line in lines
    )


@pytest.mark.parametrize(("system", "expected"), [
    (PERPENDICULAR, {(4, 1): 1.0, (3, 0): 2.0}),
    (ROUND, {(4, 0): 1.0, (3, 0): 2 * 2 / 5**0.5, (3, 1): -2 / 5**0.5}),
])  # fmt: skip
def test_directions_of_grid_points(system: str, expected: dict[tuple[int, int], float], tmp_path: Path) -> None:
    """An equation acts along the directions of each node, of a system at its place."""
    text = with_directions(BDF["plain"], (3, 4), 5) + system + "MPC,7,4,1,1.,3,2,-2.\n"
    (tmp_path / "part.bdf").write_text(text)
    (terms,) = sums_of_deck(tmp_path / "part.bdf", "equations")
    assert terms == pytest.approx(expected)


@pytest.mark.parametrize(("transform", "expected"), [
    ("*TRANSFORM, NSET=PAIR\n0, 1, 0, -1, 0, 0\n", {(4, 1): 1.0, (3, 0): 2.0}),
    ("*TRANSFORM, NSET=PAIR, TYPE=C\n0, 0, 0, 0, 0, 1\n", {(4, 0): 1.0, (3, 0): 2 * 2 / 5**0.5, (3, 1): -2 / 5**0.5}),
])  # fmt: skip
def test_directions_by_transform(transform: str, expected: dict[tuple[int, int], float], tmp_path: Path) -> None:
    (tmp_path / "part.inp").write_text(BASE + "*NSET, NSET=PAIR\n3, 4\n" + transform + EQUATION)
    (terms,) = sums_of_deck(tmp_path / "part.inp", "equations")
    assert terms == pytest.approx(expected)


PAIRS = "*NSET, NSET=A\n1, 2\n*NSET, NSET=B\n3, 4\n"
AXIS_14 = (POINTS[3] - POINTS[0]) / np.linalg.norm(POINTS[3] - POINTS[0])
WORDS: dict[str, tuple[str, str, list[dict[tuple[int, int], float]]]] = {
    "an equation of two sets": ("*EQUATION\n2\nB, 1, 1., A, 2, -3.\n", "equations",
                                [{(3, 0): 1.0, (1, 1): -3.0}, {(4, 0): 1.0, (2, 1): -3.0}]),
    "an equation of a set and a node": ("*EQUATION\n3\nB, 3, 2., 1, 3, -1.,\n2, 3, -1.\n", "equations",
                                        [{(n, 2): 2.0, (1, 2): -1.0, (2, 2): -1.0} for n in (3, 4)]),
    "a pin of sets": ("*MPC\nPIN, B, A\n", "equations",
                      [{(b, d): 1.0, (a, d): -1.0} for b, a in ((3, 1), (4, 2)) for d in range(3)]),
    "a link": ("*MPC\nlink, 1, 4\n", "equations", [{(1, 2): -1.0, (4, 2): 1.0}]),
    "a beam": ("*MPC\nBEAM, 1, 4\n", "bars", [{(1, 2): -1.0, (4, 2): 1.0}]),
    "a spring in a system": ("*ELEMENT, TYPE=SPRING2, ELSET=SP\n9, 1, 4\n*ORIENTATION, NAME=OR\n1, 1, 0, -1, 1, 0\n"
                             "*SPRING, ELSET=SP, ORIENTATION=or\n1, 1\n500.\n", "springs",
                             [{(1, 0): R2, (1, 1): R2, (4, 0): -R2, (4, 1): -R2}]),
    "a turned system": ("*ELEMENT, TYPE=SPRING1, ELSET=SP\n9, 1\n*ORIENTATION, NAME=OR\n1, 0, 0, 0, 1, 0\n3, 45\n"
                        "*SPRING, ELSET=SP, ORIENTATION=OR\n2\n500.\n", "springs", [{(1, 0): -R2, (1, 1): R2}]),
}  # fmt: skip


@pytest.mark.parametrize("name", WORDS)
def test_sums_by_sets_and_systems(name: str, tmp_path: Path) -> None:
    text, record, sums = WORDS[name]
    (tmp_path / "part.inp").write_text(BASE + PAIRS + text)
    relations = sums_of_deck(tmp_path / "part.inp", record)
    assert len(relations) == len(sums)
    for terms, expected in zip(relations, sums, strict=True):
        assert terms == pytest.approx(expected)


def test_springs_act_on_led_points(tmp_path: Path) -> None:
    """The displacement of a point that leads a set is that of the set's rigid motion."""
    spring = "*ELEMENT, TYPE=SPRING1, ELSET=SP\n9, 9\n*SPRING, ELSET=SP\n2\n5.\n"
    (tmp_path / "part.inp").write_text(BASE + "*COUPLING, REF NODE=9, SURFACE=FOOT\n*KINEMATIC\n" + spring)
    mesh = read(tmp_path / "part.inp")
    C = coefficients(mesh, "springs")
    for t, omega in (([1.0, 2, 3], [0, 0, 0]), ([0, 0, 0], [1.0, -2.0, 0.5])):
        u = (np.array(t) + np.cross(omega, mesh.nodes)).ravel()
        np.testing.assert_allclose(C @ u, (np.array(t) + np.cross(omega, [0, 0, 9.0]))[1], rtol=1e-9)


CE = ("CE,R5.0,DEFI,       3,       1,  {constant}\nCE,R5.0,NODE,       4,UX  ,  1.0    ,       3,UY  , -2.0\n"
      "CE,R5.0,NODE,       2,UZ  , -1.0    \n")  # fmt: skip


def test_a_constraint_equation_of_ansys(tmp_path: Path) -> None:
    path = tmp_path / "part.cdb"
    path.write_text(CDB.format(spring="") + CE.format(constant="0.0"))
    assert sums_of_deck(path, "equations") == [{(4, 0): 1.0, (3, 1): -2.0, (2, 2): -1.0}]
    path.write_text(CDB.format(spring="") + CE.format(constant="0.5"))
    assert "CE is not taken over" in refusal(path)
    path.write_text(CDB.format(spring="") + CE.format(constant="0.0").replace("-2.0", "two"))
    assert "expected terms of node, direction and coefficient" in refusal(path)


def equations_of(lead: int, place: np.ndarray, followers: tuple[int, ...], *, swapped: bool = False) -> str:
    """Return the equations that CDWRITE writes of CERIG, u − u₀ − θ × r = 0, three terms and more of each."""
    lines, number = [], 0
    for node in followers:
        r = POINTS[node - 1] - place
        for i in range(3):
            about = np.cross(r, np.eye(3)[i])
            terms = [(node, i, 1.0), (lead, i, -1.0), *((lead, 3 + k, -about[k]) for k in range(3) if about[k])]
            terms = terms[::-1] if swapped else terms
            number += 1
            lines.append(f"CE,R5.0,DEFI,{len(terms):8},{number:8},  0.0")
            for pair in (terms[k : k + 2] for k in range(0, len(terms), 2)):
                lines.append("CE,R5.0,NODE" + "".join(f",{n:8},{AXES[axis]:4},{c:16.9E}" for n, axis, c in pair))
    return "\n".join(lines) + "\n"


AXES = ("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ")
LEAD = f"{9:9}{0:9}{0:9}" + "".join(f"{x:21.13E}" for x in (0.1, 0.2, 2.0)) + "\n"
TOP = f"{4:9}{0:9}{0:9}"
REGIONS = {
    "one by one": "CERIG,9,1,UXYZ\nCERIG,9,2,ALL\nCERIG,9,3\n",
    "by a component": "CMBLOCK,TIP,NODE,       2\n(8i10)\n         1        -3\nCMSEL,S,TIP,NODE\nCERIG,9,ALL,UXYZ\n",
    "as CDWRITE writes it": equations_of(9, np.array([0.1, 0.2, 2.0]), (1, 2, 3)),
    "in another order": equations_of(9, np.array([0.1, 0.2, 2.0]), (3, 2, 1), swapped=True),
}


@pytest.mark.parametrize("name", REGIONS)
def test_rigid_regions_of_ansys(name: str, tmp_path: Path) -> None:
    mass = "".join(f"{k:9}" for k in (1, 3, 1, 1, 0, 0, 0, 0, 1, 0, 2, 9)) + "\n"
    text = (
        CDB.format(spring=mass).replace("ET,2,14\n", "ET,3,21\n").replace("KEYOPT,2,2,1\n", "").replace(TOP, LEAD + TOP)
    )
    constants = "RLBLOCK,1,1,3,7\n(2i8,6g16.9)\n(7g16.9)\n" + f"{1:8}{3:8}" + 3 * f"{0.5:16.9f}" + "\n"
    (tmp_path / "part.cdb").write_text(text + constants + REGIONS[name])
    mesh = read(tmp_path / "part.cdb")
    (attachment,) = mesh.attachments.values()
    assert (attachment.kind, attachment.mass) == ("rbe2", 0.5)
    np.testing.assert_allclose(mesh.nodes[attachment.nodes, 2], 0.0)
    assert set(attachment.nodes) >= {0, 1, 2}
    np.testing.assert_allclose(attachment.point, [0.1, 0.2, 2.0])
    assert not mesh.relations


@pytest.mark.parametrize(("commands", "words"), [
    ("NSEL,S,LOC,Z,0\nCERIG,9,ALL\n", "CERIG is not taken over"), ("CERIG,9,1,UX\n", "CERIG is not taken over"),
    (REGIONS["as CDWRITE writes it"].replace("ROTX, 2", "ROTX, 3"), "CE"),
])  # fmt: skip
def test_regions_that_are_not_known_to_be_rigid_are_refused(commands: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "part.cdb").write_text(CDB.format(spring="").replace(TOP, LEAD + TOP) + commands)
    assert words in refusal(tmp_path / "part.cdb")


@pytest.mark.parametrize(("commands", "sums"), [
    ("CP,7,UX,4,3\nCP,7,UX,2\n", [{(3, 0): 1.0, (4, 0): -1.0}, {(2, 0): 1.0, (4, 0): -1.0}]),
    ("CP,NEXT,UZ,4,3\n", [{(3, 2): 1.0, (4, 2): -1.0}]),
    ("CE,1,0,4,UX,1.0,3,UY,-2.0\nCE,1,,2,UZ,-1.0\n", [{(4, 0): 1.0, (3, 1): -2.0, (2, 2): -1.0}]),
    ("CE,NEXT,,4,UX,1,3,UY,-2\nCE,NEXT,0,4,UY,1,3,UY,-1\n",
     [{(4, 0): 1.0, (3, 1): -2.0}, {(4, 1): 1.0, (3, 1): -1.0}]),
])  # fmt: skip
def test_equations_as_commands(commands: str, sums: list[dict[tuple[int, int], float]], tmp_path: Path) -> None:
    (tmp_path / "part.cdb").write_text(CDB.format(spring="") + commands)
    assert sums_of_deck(tmp_path / "part.cdb", "equations") == sums


def test_directions_of_nodes_of_ansys(tmp_path: Path) -> None:
    """Angles about z, then about the new x, then about the new y."""
    old = f"{4:9}{0:9}{0:9}" + "".join(f"{x:21.13E}" for x in POINTS[3].tolist())
    text = CDB.format(spring="").replace(old, old + f"{90:21.13E}{90:21.13E}") + CE.format(constant="0.0")
    (tmp_path / "part.cdb").write_text(text.replace("UX", "UZ"))
    # x of the node is y, its z, after the turn about that, is x.
    assert sums_of_deck(tmp_path / "part.cdb", "equations")[0] == pytest.approx(
        {(4, 0): 1.0, (3, 1): -2.0, (2, 2): -1.0}
    )


ASSEMBLY = (
    "*PART, NAME=P\n" + BASE + "*END PART\n"
    "*ASSEMBLY, NAME=A\n*INSTANCE, NAME=I-1, PART=P\n*END INSTANCE\n{more}*NODE\n1, 1., 1., 5.\n2, 0., 0., 1.\n"
    "*NSET, NSET=RP\n1\n*NSET, NSET=TOP, INSTANCE=I-1\n1, 2, 3\n*SURFACE, NAME=S, TYPE=NODE\nTOP\n"
    "*COUPLING, CONSTRAINT NAME=C, REF NODE=RP, SURFACE=S\n*KINEMATIC\n"
    "*ELEMENT, TYPE=MASS, ELSET=M\n1, 1\n*MASS, ELSET=M\n0.3\n"
    "*ELEMENT, TYPE=SPRING2, ELSET=SP\n2, I-1.4, 1\n*SPRING, ELSET=SP\n3, 3\n5.\n"
    "*EQUATION\n2\nI-1.4, 1, 1., I-1.3, 1, -1.\n"
    "*END ASSEMBLY\n"
)


def test_members_of_an_assembly(tmp_path: Path) -> None:
    """Its own nodes have numbers of their own; sets of one node, numbers of an instance."""
    path = tmp_path / "part.inp"
    path.write_text(ASSEMBLY.format(more=""))
    mesh = read(path)
    (attachment,) = mesh.attachments.values()
    assert (attachment.kind, attachment.mass, attachment.point.tolist()) == ("rbe2", 0.3, [1.0, 1.0, 5.0])
    assert np.allclose(mesh.nodes[attachment.nodes][:, 2], 0)
    assert coefficients(mesh, "equations").sum() == 0
    u = np.tile([0.0, 0, 1.0], len(mesh.nodes))
    u[[11]] = 2.0
    np.testing.assert_allclose(coefficients(mesh, "springs") @ u, 1.0)
    second = "*INSTANCE, NAME=I-2, PART=P\n0, 0, 9\n*END INSTANCE\n"
    path.write_text(ASSEMBLY.format(more=second))
    assert read(path, instance="I-1").attachments.keys() == mesh.attachments.keys()
    assert "SPRING (and EQUATION) is not taken over" in refusal(path, instance="I-2")
    plain = read(path, instance="I-2", leave_out=["SPRING", "EQUATION"])
    assert not plain.attachments


def test_grid_points_on_the_axis_of_their_directions(tmp_path: Path) -> None:
    """x of the system is the radial direction there."""
    text = (
        with_directions(BDF["plain"], (1, 4), 5) + "CORD2C,5,,1.,0.,0.,1.,0.,1.\n,1.,1.,0.\n" + "MPC,7,4,1,1.,3,2,-2.\n"
    )
    (tmp_path / "part.bdf").write_text(text)
    (terms,) = sums_of_deck(tmp_path / "part.bdf", "equations")
    assert terms == pytest.approx({(4, 1): 1.0, (3, 1): -2.0})
