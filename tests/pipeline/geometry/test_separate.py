"""Several bodies in a file without parts: each is a set of elements, or a piece that shares no node with the others."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.drafts.decks import write_deck_draft
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.mesh_file import MeshFile

CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
NODES = "*NODE\n" + "".join(f"{n}, {x}, {y}, {z}\n" for n, (x, y, z) in enumerate(CUBE, 1))
NODES += "".join(f"{n}, {2 * x}, {y}, {z + 1.5}\n" for n, (x, y, z) in enumerate(CUBE, 11)) + "30, 0.5, 0.5, 9.\n"
LOWER, UPPER = "1, 1, 2, 3, 4, 5, 6, 7, 8\n", "2, 11, 12, 13, 14, 15, 16, 17, 18\n"
NAMED = f"{NODES}*ELEMENT, TYPE=C3D8, ELSET=LOWER\n{LOWER}*ELEMENT, TYPE=C3D8, ELSET=UPPER\n{UPPER}"
PLAIN = f"{NODES}*ELEMENT, TYPE=C3D8, ELSET=ALL\n{LOWER}{UPPER}"
SETS = "*NSET, NSET=FLOOR\n1, 2, 3, 4\n*SURFACE, NAME=BOTH\n1, S2\n2, S1\n*NSET, NSET=TOP\n15, 16, 17, 18\n"
COUPLED = "*COUPLING, REF NODE=30, SURFACE=TOP\n*KINEMATIC\n*ELEMENT, TYPE=MASS, ELSET=M\n9, 30\n*MASS, ELSET=M\n2.\n"


def body(path: Path, name: str | None = None, **keys: object) -> MeshRecord:
    return MeshFile(kind="file", path=str(path), part=name, **keys).build(None)


@pytest.mark.parametrize(("text", "lower", "upper"), [(NAMED, "lower", "UPPER"), (PLAIN, "piece1", "PIECE2")])
def test_each_body_has_its_elements_sets_and_members(text: str, lower: str, upper: str, tmp_path: Path) -> None:
    path = tmp_path / "two.inp"
    path.write_text(text + SETS + COUPLED)
    low, high = body(path, lower), body(path, upper)
    assert np.ptp(low.nodes, axis=0).tolist() == [1.0, 1.0, 1.0]
    assert np.ptp(high.nodes, axis=0).tolist() == [2.0, 1.0, 1.0]
    assert [set(low.surfaces), set(high.surfaces)] == [{"FLOOR", "BOTH"}, {"TOP", "BOTH"}]
    np.testing.assert_allclose(low.nodes[low.surfaces["BOTH"].facets][..., 2], 1.0)
    np.testing.assert_allclose(high.nodes[high.surfaces["BOTH"].facets][..., 2], 1.5)
    assert not low.attachments
    (attachment,) = high.attachments.values()
    assert attachment.mass == 2.0


def test_without_a_name_the_bodies_are_listed(tmp_path: Path) -> None:
    path = tmp_path / "two.inp"
    path.write_text(PLAIN + SETS)
    with pytest.raises(InputError, match=r'2 pieces .* by geometry\.part = "…": piece1, piece2'):
        body(path)
    with pytest.raises(InputError, match=r'no part = "x" .*; it has the sets ALL, piece1, piece2'):
        body(path, "x")
    path.write_text(NAMED + SETS)
    with pytest.raises(InputError, match=r'by geometry\.part = "…": LOWER, UPPER'):
        body(path)


def test_what_joins_a_body_with_another_is_left_out_on_request_alone(tmp_path: Path) -> None:
    path = tmp_path / "two.inp"
    path.write_text(NAMED + "*EQUATION\n2\n5, 1, 1., 11, 1, -1.\n")
    with pytest.raises(InputError, match=r"EQUATION .*joins the body with another"):
        body(path, "LOWER")
    assert not body(path, "LOWER", leave_out=("EQUATION",)).relations


def test_a_set_of_another_format_is_a_body(tmp_path: Path) -> None:
    """Numbers of properties of Nastran."""
    grids = "".join(f"GRID,{n},,{x}.,{y}.,{z}.\n" for n, (x, y, z) in enumerate(CUBE, 1))
    grids += "".join(f"GRID,{n},,{x}.,{y}.,{z + 2}.\n" for n, (x, y, z) in enumerate(CUBE, 11))
    elements = "CHEXA,1,7,1,2,3,4,5,6\n,7,8\nCHEXA,2,9,11,12,13,14,15,16\n,17,18\n"
    path = tmp_path / "two.bdf"
    path.write_text(f"{grids}{elements}PSOLID,7,1\nPSOLID,9,1\n")
    assert body(path, "9").nodes[:, 2].min() == 2.0
    assert body(path, "7").nodes[:, 2].max() == 1.0


def test_a_new_scene_has_all_bodies(tmp_path: Path) -> None:
    path = tmp_path / "two.inp"
    path.write_text(PLAIN + SETS)
    folder, _ = write_deck_draft(str(path), 1.0, tmp_path / "new")
    scene = (folder / "scene.toml").read_text()
    assert [scene.count(f'part = "piece{k}"') for k in (1, 2)] == [1, 1]
    assert [scene.count(f"[body.piece{k}]") for k in (1, 2)] == [1, 1]
