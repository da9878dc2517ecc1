"""Decks of other programs: the same body however it is written, what is left out, and several bodies in a deck."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import cell_blocks, sides_of
from gudgeon.pipeline.geometry.decks.ansys.cells import Row, solid_of_row
from gudgeon.pipeline.geometry.decks.included import included_files
from gudgeon.pipeline.geometry.decks.model import Source
from gudgeon.pipeline.geometry.mesh_file import MeshFile

POINTS = np.array([[1.0, 0, 0], [3, 0, 0], [1, 2, 0], [1, 0, 4]])
ROUND_OFF = 1e-9


def read(path: Path, **more: object) -> MeshRecord:
    return MeshFile.model_validate({"kind": "file", "path": str(path), **more}).build(None)


def refusal(path: Path, **more: object) -> str:
    with pytest.raises(InputError) as caught:
        read(path, **more)
    assert "\n" not in str(caught.value)
    return str(caught.value).removeprefix(str(path.parent)).lstrip("/")


def same(mesh: MeshRecord, points: np.ndarray = POINTS) -> bool:
    """Whether a mesh is the tetrahedron of four points, with its base as the surface FOOT."""
    base = np.unique(mesh.nodes[mesh.surfaces["FOOT"].facets[:, :3]].reshape(-1, 3), axis=0)
    near = np.abs(mesh.nodes[:, None] - points).sum(axis=2).min(axis=0)
    return len(mesh.cells) == 1 and near.max() < ROUND_OFF and np.allclose(base, np.unique(points[:3], axis=0))


def rows(points: np.ndarray, labels: tuple[int, ...] = (1, 2, 3, 4)) -> str:
    return "".join(f"{n}, {x!r}, {y!r}, {z!r}\n" for n, (x, y, z) in zip(labels, points.tolist(), strict=True))


def cylindrical(points: np.ndarray) -> np.ndarray:
    x, y, z = points.T
    return np.column_stack([np.hypot(x, y), np.degrees(np.arctan2(y, x)), z])


NODES = "*NODE\n" + rows(POINTS)
SOLID = "*ELEMENT, TYPE=C3D4, ELSET=BODY\n1, 1, 2, 3, 4\n"
FOOT = "*NSET, NSET=FOOT\n1, 2, 3\n"
LARGE = (3000000001, 7, 8, 900)
TURNED = (POINTS - [1, 1, 0]) @ np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
INP: dict[str, str] = {
    "plain": NODES + SOLID + FOOT,
    "lower case": (NODES + SOLID).lower() + "*nset, nset=FOOT\n1, 2, 3\n",
    "blanks, tabs, CRLF": (NODES + SOLID + FOOT).replace("*", "* ").replace(", ", " ,\t").replace("\n", " \r\n"),
    "a keyword over two lines": NODES + "*ELEMENT,\nTYPE=C3D4, ELSET=BODY\n1,1,2,3,4\n" + FOOT,
    "an element over two lines": NODES + "*ELEMENT, TYPE=C3D4\n1, 1, 2,\n3, 4\n" + FOOT,
    "exponents of Fortran": NODES.replace("3.0", "3.0D0") + SOLID + FOOT,
    "large numbers": "*NODE\n" + rows(POINTS, LARGE) + "*ELEMENT, TYPE=C3D4\n5000000000, 3000000001, 7, 8, 900\n"
    "*NSET, NSET=FOOT\n3000000001, 7, 8\n",
    "a cylindrical system": "*NODE, SYSTEM=C\n" + rows(cylindrical(POINTS)) + SOLID + FOOT,
    "a Cartesian system": "*SYSTEM\n1, 1, 0, 1, 2, 0\n0, 1, 0\n*NODE\n" + rows(TURNED) + SOLID + FOOT,
    "a system of one node": "*NODE\n" + rows(POINTS[:2], (1, 2)) + "*SYSTEM\n1, 0, 0\n*NODE\n"
    + rows(POINTS[2:] - [1, 0, 0], (3, 4)) + SOLID + FOOT,
    "a set on nodes": "*NODE, NSET=FOOT\n" + rows(POINTS[:3], (1, 2, 3)) + "*NODE\n" + rows(POINTS[3:], (4,)) + SOLID,
    "GENERATE": NODES + SOLID + "*NSET, NSET=FOOT, GENERATE\n1, 3, 2\n2, 2\n",
    "a set of sets, before them": NODES + SOLID + "*NSET, NSET=FOOT\nLeft, 3\n*NSET, NSET=LEFT\n1, 2\n",
    "a surface by the name of its set": NODES + SOLID + FOOT + "*SURFACE, NAME=Foot, TYPE=NODE\nfoot\n",
    "the nodes of a set of elements": NODES + SOLID + "*ELEMENT, TYPE=S3, ELSET=SKIN\n2, 1, 2, 3\n"
    "*NSET, NSET=FOOT, ELSET=SKIN\n",
    "a surface of faces": NODES + SOLID + "*SURFACE, NAME=FOOT\n1, S1\n",
    "a surface of sets and faces": NODES + SOLID + "*SURFACE, NAME=FOOT, TYPE=ELEMENT\nBody, s1\n",
    "a surface of nodes": NODES + SOLID + "*NSET, NSET=A\n1, 2, 3\n*SURFACE, NAME=FOOT, TYPE=NODE\nA, 1.0\n",
    "a part": "*PART, NAME=P\n" + NODES + SOLID + FOOT + "*END PART\n",
    "a moved instance": "*PART, NAME=P\n*NODE\n" + rows(TURNED - [5, 0, 0]) + SOLID + FOOT + "*END PART\n"
    "*ASSEMBLY, NAME=A\n*INSTANCE, NAME=I, PART=p\n6, 1, 0\n1, 1, 0, 1, 1, 1, 90\n*END INSTANCE\n*END ASSEMBLY\n",
    "a set of the assembly": "*PART, NAME=P\n" + NODES + SOLID + "*NSET, NSET=S\n1, 2\n*END PART\n*ASSEMBLY, NAME=A\n"
    "*INSTANCE, NAME=I-1, PART=P\n*END INSTANCE\n*NSET, NSET=FOOT, INSTANCE=I-1\n3\n*NSET, NSET=FOOT\nI-1.S\n"
    "*END ASSEMBLY\n",
    "included": "*INCLUDE, INPUT=sub/nodes.inc\n" + SOLID + FOOT,
    "data of another file": "*NODE, INPUT=sub/rows.txt\n" + SOLID + FOOT,
    "mirrored": NODES + SOLID.replace("1, 1, 2, 3, 4", "1, 1, 3, 2, 4") + FOOT,
    "words before keywords": "> deck\n*\n" + NODES + SOLID + FOOT,
    "unused nodes": NODES + "99, 1e3, 0, 0\n" + SOLID + FOOT.replace("3\n", "3, 99\n"),
}  # fmt: skip
"""Decks of Abaqus and CalculiX of the same tetrahedron."""


def card(name: str, *fields: object, wide: bool = False) -> str:
    """Return a card in small or large field."""
    width, count = (16, 4) if wide else (8, 8)
    texts = [f"{field!s:{width}}" for field in fields]
    lines = ["".join(texts[k : k + count]) for k in range(0, len(texts), count)]
    head, more = (f"{name}*", "*") if wide else (name, "+")
    return "".join(f"{head if k == 0 else more:8}{line}\n" for k, line in enumerate(lines))


def grids(points: np.ndarray, system: object = "", *, wide: bool = False) -> str:
    return "".join(
        card("GRID", n, system, *(f"{x:.{11 if wide else 5}f}" for x in p), wide=wide)
        for n, p in enumerate(points.tolist(), 1)
    )


TETRA, SET = card("CTETRA", 1, 1, 1, 2, 3, 4), card("SET1", 1, 1, "THRU", 3)
SHIFTED = card("CORD2R", 5, 0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0) + card("", 1.0, 2.0, 0.0).replace(" ", "+", 1)
CHAIN = card("CORD2C", 6, 5, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0) + card("", 1.0, 0.0, 0.0).replace(" ", "+", 1)
BDF: dict[str, str] = {
    "plain": grids(POINTS) + TETRA + SET,
    "large field": grids(POINTS, wide=True) + card("CTETRA", 1, 1, 1, 2, 3, 4, wide=True) + SET,
    "free field": "".join(f"GRID,{r}".replace(", ", ",,", 1) for r in rows(POINTS).splitlines(True)) + TETRA + SET,
    "lower case": grids(POINTS).lower() + TETRA.lower() + SET,
    "a blank continuation": grids(POINTS) + "CTETRA,1,1,1,2,3\n,\n".replace("\n,", ",4\n") + SET,
    "named continuations apart": grids(POINTS) + f"{'SET1':8}{1:8}{1:8}{'':48}+A\n" + TETRA + f"{'+A':8}{2:8}{3:8}\n",
    "exponents without E": grids(POINTS).replace("3.00000", "30.0-1 ") + TETRA + SET,
    "a system": SHIFTED + grids(TURNED, 5) + TETRA + SET,
    "a system by GRDSET": "GRDSET,,5\n" + SHIFTED + grids(TURNED) + TETRA + SET,
    "a chain of systems, before them": grids(cylindrical(TURNED), 6, wide=True) + CHAIN + SHIFTED + TETRA + SET,
    "points of a system": "".join(
        card("GRID", n, "", *p) for n, p in ((11, (1.0, 1.0, 0.0)), (12, (1.0, 1.0, 1.0)), (13, (1.0, 2.0, 0.0)))
    ) + card("CORD1R", 5, 11, 12, 13) + grids(TURNED, 5) + TETRA + SET,
    "after BEGIN BULK, before ENDDATA": "CEND\nBEGIN BULK\n" + grids(POINTS) + TETRA + SET + "ENDDATA\nGRID,1\n",
    "comments": "$ GRID\n" + grids(POINTS).replace("\n", "   $ here\n") + TETRA + SET,
    "included": "INCLUDE 'sub/\ngrids.bdf'\n" + TETRA + SET,
    "a shell without a property": grids(POINTS) + TETRA + SET + card("CTRIA3", 2, 2, 1, 2, 3),
}  # fmt: skip
"""Bulk data of Nastran of the same tetrahedron."""


def write_included(folder: Path) -> None:
    """Write the files that decks include into a new folder, which they call `sub`."""
    folder.mkdir()
    (folder / "nodes.inc").write_text("*INCLUDE, INPUT=sub/more.inc\n")
    (folder / "more.inc").write_text(NODES)
    (folder / "rows.txt").write_text(rows(POINTS))
    (folder / "grids.bdf").write_text(grids(POINTS))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_included(tmp_path / "sub")
    return tmp_path


@pytest.mark.parametrize("case", INP)
def test_a_deck_of_abaqus(case: str, folder: Path) -> None:
    (folder / "part.inp").write_text(INP[case])
    assert same(read(folder / "part.inp"))


@pytest.mark.parametrize("case", BDF)
def test_bulk_data_of_nastran(case: str, folder: Path) -> None:
    (folder / "part.bdf").write_text(BDF[case])
    mesh = read(folder / "part.bdf")
    assert same(MeshRecord(mesh.nodes, mesh.cells, mesh.cell_type, {"FOOT": mesh.surfaces["set1"]}))


BASE = NODES + "9, 0, 0, 9\n" + SOLID + FOOT
LEFT: dict[str, tuple[str, str, str]] = {
    "MASS": ("part.inp", BASE + "*ELEMENT, TYPE=MASS, ELSET=M\n9, 4\n*MASS, ELSET=M, TYPE=ANISOTROPIC\n1, 2\n",
             "line 13: MASS"),
    "COUPLING": ("part.inp", BASE + "*COUPLING, REF NODE=9, SURFACE=FOOT\n*KINEMATIC\n1, 2\n", "line 11: COUPLING"),
    "EQUATION": ("part.inp", BASE + "*NSET, NSET=TWO\n1, 2\n*EQUATION\n2\nFOOT, 1, 1., TWO, 1, -1.\n",
                 "line 13: EQUATION"),
    "SPRING": ("part.inp", BASE + "*ELEMENT, TYPE=SPRING1, ELSET=S\n9, 4\n*SPRING, ELSET=S, NONLINEAR\n1\n5\n",
               "line 13: SPRING"),
    "S3": ("part.inp", BASE + "*ELEMENT, TYPE=S3, ELSET=K\n9, 1, 2, 3\n*SHELL SECTION, ELSET=K\n1.\n", "line 11: S3"),
    "SC8R": ("part.inp", BASE + "*ELEMENT, TYPE=SC8R\n9, 1, 2, 3, 4, 1, 2, 3, 4\n", "line 11: SC8R"),
    "SOLID SECTON": ("part.inp", BASE + "*SOLID SECTON, ELSET=BODY\n", "line 11: SOLID SECTON"),
    "CONM1": ("part.bdf", BDF["plain"] + "CONM1,5,4,,0.3\n", "line 7: CONM1"),
    "RBE2": ("part.bdf", BDF["plain"] + "RBE2,5,4,12,1,2,3\n", "line 7: RBE2"),
    "CQUAD4": ("part.bdf", BDF["plain"] + "PSHELL,9,1,0.1\nCQUAD4,5,9,1,2,3,4\n", "line 8: CQUAD4"),
}  # fmt: skip
"""What alters a body, by the keyword that leaves it out: file, text, and the words of the line."""


@pytest.mark.parametrize("keyword", LEFT)
def test_what_is_not_taken_over_is_said(keyword: str, tmp_path: Path) -> None:
    name, text, words = LEFT[keyword]
    (tmp_path / name).write_text(text)
    said = refusal(tmp_path / name)
    assert said.startswith(f"{name}: {words} is not taken over: ")
    assert said.endswith(f'geometry.leave_out = ["{keyword}"] leaves it out')
    mesh = read(tmp_path / name, leave_out=[keyword])
    assert any(f"{words} is left out" in note for note in mesh.remarks["notes"])
    (tmp_path / name).write_text(BASE if name == "part.inp" else BDF["plain"])
    assert f"'{keyword}' given, the deck has nothing" in refusal(tmp_path / name, leave_out=[keyword])


def test_a_scene_says_what_its_deck_leaves_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "part.inp").write_text(LEFT["MASS"][1])
    (tmp_path / "scene.toml").write_text(
        'component.p = { geometry = { kind = "file", path = "part.inp", unit = 1.0, leave_out = ["MASS"] },'
        ' material = { E = 2e11, nu = 0.3, rho = 7800.0 } }\nbody.b = { component = "p" }\nrun = { duration = 1e-3 }\n'
    )
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    assert main(["mesh", str(tmp_path / "scene.toml"), *places]) == 0
    assert "component.p.geometry: line 13: MASS is left out: a point mass" in capsys.readouterr().err


def test_a_deck_by_the_ending_of_a_mesh(tmp_path: Path) -> None:
    (tmp_path / "part.msh").write_text(INP["plain"])
    assert same(read(tmp_path / "part.msh"))


def test_supports_and_steps_are_noted(tmp_path: Path) -> None:
    (tmp_path / "part.inp").write_text(BASE + "*BOUNDARY\nFOOT, 1, 3\n*STEP\n*FREQUENCY\n5\n*END STEP\n")
    (note,) = read(tmp_path / "part.inp").remarks["notes"]
    assert "BOUNDARY (line 11), STEP (line 13)" in note


TWO = ("*PART, NAME=P\n" + NODES + SOLID + FOOT + "*END PART\n*ASSEMBLY, NAME=A\n"
       "*INSTANCE, NAME=I-1, PART=P\n*END INSTANCE\n*INSTANCE, NAME=I-2, PART=P\n0, 0, 7\n*END INSTANCE\n"
       "*NSET, NSET=TIP\nI-1.FOOT, I-2.FOOT\n*END ASSEMBLY\n")  # fmt: skip


def test_one_of_several_bodies_is_named(tmp_path: Path) -> None:
    path = tmp_path / "part.inp"
    path.write_text(TWO)
    assert "has the parts P and the instances I-1, I-2 (*INSTANCE); name one by geometry.part" in refusal(path)
    assert same(read(path, part="p"))
    moved = read(path, instance="I-2")
    assert same(moved, POINTS + np.array([0, 0, 7]))
    assert "TIP" in moved.surfaces
    assert 'has no instance = "I-3"' in refusal(path, instance="I-3")
    assert "allowed: one of them" in refusal(path, part="P", instance="I-1")


WRONG: dict[str, tuple[str, str, str]] = {
    "a file that is missing": ("part.inp", "*INCLUDE, INPUT=gone.inc\n", r"line 1: names the file \S*gone.inc"),
    "a file that includes itself": ("part.inp", "*INCLUDE, INPUT=part.inp\n", "which includes itself"),
    "a word for a number": ("part.inp", NODES + "*ELEMENT, TYPE=C3D4\n1, 1, 2, x, 4\n", "line 7: .*whole numbers"),
    "a node of no place": ("part.inp", NODES.replace("3.0", "nan") + SOLID, "line 3: .*expected finite numbers"),
    "a node that is not there": ("part.inp", NODES + SOLID.replace("4", "44"), "element 1 names node 44|TYPE=C3D44"),
    "nodes by generation": ("part.inp", NODES + SOLID + "*NGEN\n1, 4\n", r"line 8: \*NGEN makes nodes"),
    "a face of no element": ("part.inp", NODES + SOLID + "*SURFACE, NAME=A\n1, S7\n", "line 9: face 'S7'"),
    "a system of a line": ("part.inp", "*SYSTEM\n0,0,0,1,0,0\n2,0,0\n" + NODES + SOLID, "line 1: .*on a line"),
    "a grid in no system": ("part.bdf", grids(POINTS, 8) + TETRA, "line 1: names coordinate system 8"),
    "a system of itself": ("part.bdf", grids(POINTS, 6) + CHAIN.replace("5", "6", 1) + TETRA, "is defined by itself"),
    "a corner that is blank": ("part.bdf", grids(POINTS) + card("CTETRA", 1, 1, 1, "", 3, 4), "line 5: .*blank"),
    "a card that is none": ("part.bdf", "1 + 1\n", "line 1: .*the name of a card"),
    "a continuation of nothing": ("part.bdf", f"{'+XY':8}{2:8}\n" + grids(POINTS) + TETRA, "line 1: continuation"),
    "a repeated card": ("part.bdf", grids(POINTS) + "=,*(1),=\n" + TETRA, "line 5: .*replicated"),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_deck_is_one_line_with_its_place(case: str, tmp_path: Path) -> None:
    name, text, pattern = WRONG[case]
    (tmp_path / name).write_text(text)
    assert re.search(pattern, refusal(tmp_path / name))


def test_included_files_are_found_without_reading(folder: Path) -> None:
    for name, text, count in (("part.inp", INP["included"], 2), ("part.bdf", BDF["included"], 1)):
        (folder / name).write_text(text)
        assert len(included_files(str(folder / name))) == count


HEX = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)


def bricks(write: Callable[[list[int]], str], order: list[int]) -> str:
    return "*NODE\n" + "".join(f"{n}, {x}, {y}, {z}\n" for n, (x, y, z) in enumerate(HEX.tolist(), 1)) + write(order)


def test_twisted_and_mirrored_bricks(tmp_path: Path) -> None:
    path = tmp_path / "part.inp"
    line: Callable[[list[int]], str] = lambda order: "*ELEMENT, TYPE=C3D8\n3, " + ", ".join(map(str, order)) + "\n"  # noqa: E731
    path.write_text(bricks(line, [1, 2, 4, 3, 5, 6, 7, 8]))
    assert "hexahedron 3 is folded or twisted, its Jacobian is negative" in refusal(path)
    path.write_text(bricks(line, [5, 6, 7, 8, 1, 2, 3, 4]))
    mesh = read(path)
    assert "1 of 1 elements were numbered the other way round" in mesh.remarks["notes"][0]
    _, facets, _ = sides_of(cell_blocks(mesh))
    a, b, c = np.moveaxis(mesh.nodes[facets[:, :3]], 1, 0)
    assert (np.einsum("fi,fi->f", np.cross(b - a, c - a), a - HEX.mean(axis=0)) > 0).all()


def test_a_part_has_the_sets_and_members_of_its_assembly(tmp_path: Path) -> None:
    """Sets by the instance's name; of an only instance also its masses, in the axes of the part."""
    path = tmp_path / "part.inp"
    path.write_text(TWO)
    assert {"I-1.TIP", "I-2.TIP"} <= read(path, part="P").surfaces.keys()
    mass = "*ELEMENT, TYPE=MASS, ELSET=M\n1, I-2.4\n*MASS, ELSET=M\n0.3\n*END ASSEMBLY\n"
    only = TWO.replace("*INSTANCE, NAME=I-1, PART=P\n*END INSTANCE\n", "").replace("I-1.FOOT, ", "")
    path.write_text(only.replace("*END ASSEMBLY\n", mass).replace("0, 0, 7\n", "0, 0, 7\n0, 0, 0, 0, 0, 1, 90\n"))
    mesh = read(path, part="P")
    assert same(mesh)
    assert "I-2.TIP" in mesh.surfaces
    (attachment,) = mesh.attachments.values()
    np.testing.assert_allclose(attachment.point, POINTS[3], atol=1e-12)
    moved = read(path, instance="I-2")
    assert "TIP" in moved.surfaces
    np.testing.assert_allclose(next(iter(moved.attachments.values())).point, [0, 1, 11], atol=1e-12)


def test_linear_cells_among_quadratic_ones(tmp_path: Path) -> None:
    """They become quadratic: the mid-edge nodes of a common face are those of both."""
    edges = [(1, 2), (2, 3), (3, 1), (1, 4), (2, 4), (3, 4)]
    middles = "".join(
        f"{11 + k}, " + ", ".join(repr(x) for x in ((POINTS[a - 1] + POINTS[b - 1]) / 2).tolist()) + "\n"
        for k, (a, b) in enumerate(edges)
    )
    second = "*NODE\n5, 1, 0, -4\n*ELEMENT, TYPE=C3D4\n2, 1, 3, 2, 5\n"
    path = tmp_path / "part.inp"
    path.write_text(NODES + middles + "*ELEMENT, TYPE=C3D10\n1, 1, 2, 3, 4, 11, 12, 13, 14, 15, 16\n" + second)
    mesh = read(path)
    assert (mesh.cell_type, mesh.cells.shape, len(mesh.nodes)) == ("tetra10", (2, 10), 14)
    assert len(np.intersect1d(*mesh.cells)) == 6
    path.write_text(path.read_text() + "*ELEMENT, TYPE=C3D4\n3, 2, 3, 1, 4\n")
    assert len(read(path).cells) == 2, "a cell that is given twice, as a linear one too"
    assert "1 linear elements (tetra) among quadratic ones are computed as quadratic" in mesh.remarks["notes"][0]


def test_an_instance_with_nodes_of_its_own(tmp_path: Path) -> None:
    """As Abaqus writes meshes that belong to the assembly: its part is empty."""
    path = tmp_path / "part.inp"
    head = "*PART, NAME=P\n*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=I, PART=P\n0, 0, 7\n"
    path.write_text(head + NODES + SOLID + FOOT + "*END INSTANCE\n*END ASSEMBLY\n")
    assert same(read(path), POINTS + np.array([0, 0, 7]))
    path.write_text(head.replace("*END PART", NODES + "*END PART") + NODES + SOLID + "*END INSTANCE\n*END ASSEMBLY\n")
    assert "*INSTANCE I has nodes or elements, its part too" in refusal(path)


def test_mid_edge_nodes_that_ansys_leaves_out_at_the_end() -> None:
    source = Source("part.cdb", 1)
    assert solid_of_row(Row(1, 187, 1, [*range(1, 10)], source)) == ("tetra10", [*range(1, 10), 0])
    assert solid_of_row(Row(1, 187, 1, [*range(1, 5)], source)) == ("tetra", [*range(1, 5)])
