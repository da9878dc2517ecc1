"""Details of decks that are easily read otherwise than they are meant."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from tests.pipeline.geometry.test_decks import BASE, BDF, read, refusal
from tests.pipeline.geometry.test_relations import CDB

SHELL = "*ELEMENT, TYPE=S3{options}\n9, 1, 2, 3\n"
SECTION = "*SHELL SECTION, ELSET=SHELLS, MATERIAL=X\n0.1\n"


@pytest.mark.parametrize("text", [
    SHELL.format(options=", ELSET=SHELLS") + SECTION, SHELL.format(options="") + "*ELSET, ELSET=SHELLS\n9\n" + SECTION,
    SHELL.format(options=", ELSET=A") + "*ELSET, ELSET=SHELLS\nA\n" + SECTION,
])  # fmt: skip
def test_a_section_names_shells_by_any_set(text: str, tmp_path: Path) -> None:
    (tmp_path / "part.inp").write_text(BASE + text)
    assert "S3 is not taken over: structural elements" in refusal(tmp_path / "part.inp")


def test_a_section_of_surface_elements_may_have_mass(tmp_path: Path) -> None:
    membrane = "*ELEMENT, TYPE=SFM3D3, ELSET=A\n9, 1, 2, 3\n*SURFACE SECTION, ELSET=A{density}\n"
    (tmp_path / "part.inp").write_text(BASE + membrane.format(density=""))
    assert "A" in read(tmp_path / "part.inp").surfaces
    (tmp_path / "part.inp").write_text(BASE + membrane.format(density=", DENSITY=3."))
    assert "a mass by area" in refusal(tmp_path / "part.inp")


def test_surfaces_of_surfaces(tmp_path: Path) -> None:
    both = "*SURFACE, NAME=A\n1, S1\n*SURFACE, NAME=B\n1, S2\n*SURFACE, NAME=C, COMBINE=UNION\nA, B\n"
    (tmp_path / "part.inp").write_text(BASE + both)
    assert len(read(tmp_path / "part.inp").surfaces["C"].facets) == 2


def test_a_node_may_stand_twice_at_one_place(tmp_path: Path) -> None:
    first = next(line for line in BASE.splitlines() if line.startswith("1,"))
    (tmp_path / "part.inp").write_text(f"{BASE}*NODE\n{first}\n")
    assert read(tmp_path / "part.inp").cell_type == "tetra10"
    (tmp_path / "part.inp").write_text(f"{BASE}*NODE\n1, 9., 9., 9.\n")
    assert "node 1 is given twice" in refusal(tmp_path / "part.inp")


def test_a_mark_of_the_order_of_bytes_is_no_text(tmp_path: Path) -> None:
    (tmp_path / "part.inp").write_text(f"\ufeff{BASE}", encoding="utf-8")
    assert read(tmp_path / "part.inp").cell_type == "tetra10"


@pytest.mark.parametrize(("case", "count"), [("SPC = 3", 0), ("MPC = 2", 0), ("  mpc=1", 1)])
def test_equations_are_those_that_a_case_chooses(case: str, count: int, tmp_path: Path) -> None:
    bulk = BDF["plain"] + "MPC,1,4,1,1.,3,2,-2.\n"
    (tmp_path / "part.bdf").write_text(f"SOL 103\nCEND\n{case}\nBEGIN BULK\n{bulk}")
    mesh = read(tmp_path / "part.bdf")
    assert len(mesh.relations) == count
    assert any("no case chooses" in note for note in mesh.remarks.get("notes", [])) == (not count)


def test_names_of_cards_before_a_blank_and_a_star(tmp_path: Path) -> None:
    """As punches of superelements have them."""
    card = f"{'GRID':7}*{50:16}{'':16}{9.0:16}{9.0:16}\n{'*':8}{9.0:16}\n"
    (tmp_path / "part.bdf").write_text(BDF["plain"] + card + "RBE2,8,50,123456,1,2,3\nCONM2,9,50,,2.\n")
    (attachment,) = read(tmp_path / "part.bdf").attachments.values()
    np.testing.assert_array_equal(attachment.point, [9.0, 9.0, 9.0])


def test_a_block_of_nodes_that_nothing_ends(tmp_path: Path) -> None:
    (tmp_path / "part.cdb").write_text(CDB.format(spring="").replace("-1\nEBLOCK", "EBLOCK", 1))
    assert read(tmp_path / "part.cdb").cell_type == "tetra10"


def test_real_constants_as_a_command(tmp_path: Path) -> None:
    mass = "".join(f"{k:9}" for k in (1, 3, 1, 1, 0, 0, 0, 0, 1, 0, 2, 4)) + "\n"
    text = CDB.format(spring=mass).replace("ET,2,14\n", "ET,3,21\n").replace("KEYOPT,2,2,1\n", "")
    (tmp_path / "part.cdb").write_text(f"{text}R,1,0.5,0.5,0.5\n")
    (attachment,) = read(tmp_path / "part.cdb").attachments.values()
    assert attachment.mass == 0.5


@pytest.mark.parametrize("end", ["N,R5.3,LOC,       -1,", "N,UNBL,LOC,       -1,"])
def test_what_ends_a_block_of_nodes(end: str, tmp_path: Path) -> None:
    (tmp_path / "part.cdb").write_text(CDB.format(spring="").replace("-1\nEBLOCK", f"{end}\nEBLOCK", 1))
    assert read(tmp_path / "part.cdb").cell_type == "tetra10"


def test_inner_nodes_of_incompatible_modes(tmp_path: Path) -> None:
    """As decks of CalculiX list them behind the eight of an element."""
    corners = [(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    nodes = "".join(f"{n}, {x}., {y}., {z}.\n" for n, (x, y, z) in enumerate([*corners, (5, 5, 5)], 1))
    text = f"*NODE\n{nodes}*ELEMENT, TYPE=C3D8I, ELSET=ALL\n1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9\n"
    (tmp_path / "part.inp").write_text(text)
    assert len(read(tmp_path / "part.inp").nodes) == 8
    (tmp_path / "part.inp").write_text(text.replace("C3D8I", "C3D8"))
    assert "has 11 nodes here, allowed: 8" in refusal(tmp_path / "part.inp")


COMBIN39 = "".join(f"{k:9}" for k in (1, 2, 1, 1, 0, 0, 0, 0, 2, 0, 2, 1, 4)) + "\n"
SPRINGS = {
    "SPRING": ("part.inp", f"{BASE}*ELEMENT, TYPE=SPRING2, ELSET=A\n9, 1, 4\n*SPRING, ELSET=A, NONLINEAR\n1, 2\n"
                           "-5., -0.1\n0., 0.\n9., 0.2\n"),
    "CELAS1": ("part.bdf", f"{BDF['plain']}CELAS1,9,7,1,1,4,1\nPELAS,7,100.\nPELAST,7,5\n"),
    "CBUSH": ("part.bdf", f"{BDF['plain']}CBUSH,9,7,1,4,,,,0\nPBUSH,7,K,100.\nPBUSHT,7,K,5\n"),
    "COMBIN39": ("part.cdb", CDB.format(spring=COMBIN39).replace("ET,2,14\nKEYOPT,2,2,1", "ET,2,39")
                 + "R,1,-0.1,-5.,0.,0.,0.2,9.\n"),
}  # fmt: skip
"""Nonlinear springs by the keyword that leaves them out."""


@pytest.mark.parametrize("keyword", SPRINGS)
def test_nonlinear_springs_are_left_out_by_their_keyword_alone(keyword: str, tmp_path: Path) -> None:
    name, text = SPRINGS[keyword]
    (tmp_path / name).write_text(text)
    line = refusal(tmp_path / name)
    assert f"{keyword} is not taken over" in line
    assert f'geometry.leave_out = ["{keyword}"] leaves it out' in line
    assert not read(tmp_path / name, leave_out=(keyword,)).relations


def test_names_in_a_western_encoding(tmp_path: Path) -> None:
    (tmp_path / "part.inp").write_bytes(f"** Stützfläche…\n{BASE}*NSET, NSET=FLÄCHE\n1, 2, 3\n".encode("cp1252"))
    assert "FLÄCHE" in read(tmp_path / "part.inp").surfaces


@pytest.mark.parametrize(("name", "text", "kind"), [
    ("part.inp", gzip.compress(BASE.encode()), "compressed by gzip"), ("part.bdf", BASE.encode("utf-16"), "in UTF-16"),
    ("part.inp.gz", gzip.compress(BASE.encode()), "compressed by gzip"),
])  # fmt: skip
def test_packed_decks_are_said_to_be(name: str, text: bytes, kind: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(text)
    assert kind in refusal(tmp_path / name)
