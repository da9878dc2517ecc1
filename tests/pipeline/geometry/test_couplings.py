"""Couplings of decks that other programs wrote: named sets with a reference point, ready as interfaces of a scene."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.decks.reading import read_deck
from gudgeon.pipeline.geometry.matrices.part import Matrices
from gudgeon.pipeline.scenes.interface import Interface
from tests.pipeline.geometry import matrix_files as files
from tests.pipeline.geometry.matrix_files import SIZE
from tests.pipeline.geometry.test_decks import TWO

REFERENCE = 9001
LID = ["*NODE, NSET=LEAD", f"{REFERENCE}, 0.001, 0.002, 0.06", "*SURFACE, NAME=LID, TYPE=NODE", "TOP,"]
KINEMATIC = [f"*COUPLING, CONSTRAINT NAME=GRIP, REF NODE={REFERENCE}, SURFACE=LID", "*KINEMATIC", "1, 6"]


def deck(path: Path, *lines: str, scale: float = 1.0) -> Path:
    nodes, cells = files.bricks("C3D8")
    sets = {"BOTTOM": np.flatnonzero(nodes[:, 2] < 1e-9), "TOP": np.flatnonzero(nodes[:, 2] > SIZE[2] - 1e-9)}
    return files.write_deck(path, scale * nodes, cells, "C3D8", sets, "\n".join([*LID, *lines]))


def top() -> np.ndarray:
    nodes, _ = files.bricks("C3D8")
    return np.flatnonzero(nodes[:, 2] > SIZE[2] - 1e-9) + 1


@pytest.mark.parametrize(("lines", "surface", "tie"), [
    (KINEMATIC, "LID", "rbe2"),
    ([*KINEMATIC[:2]], "LID", "rbe2"),
    ([KINEMATIC[0], "*DISTRIBUTING"], "LID", "rbe3"),
    ([f"*RIGID BODY, NSET=TOP, REF NODE={REFERENCE}"], "TOP", "rbe2"),
    ([f"*KINEMATIC COUPLING, REF NODE={REFERENCE}", "TOP, 1, 3"], f"rbe2_{REFERENCE}", "rbe2"),
])  # fmt: skip
def test_a_coupling_of_a_deck(tmp_path: Path, lines: list[str], surface: str, tie: str) -> None:
    model = read_deck(str(deck(tmp_path / "part.inp", *lines)))
    (found,) = model.couplings
    assert (found.surface, found.reference, found.tie) == (surface, REFERENCE, tie)
    np.testing.assert_array_equal(model.node_sets[surface], top())
    np.testing.assert_array_equal(model.dependent, [REFERENCE] if tie == "rbe3" else top())


@pytest.mark.parametrize("rows", [["1, 2"], ["3"], ["4, 6"]])
def test_a_coupling_of_some_directions_is_no_tie(tmp_path: Path, rows: list[str]) -> None:
    assert read_deck(str(deck(tmp_path / "part.inp", *KINEMATIC[:2], *rows))).couplings == ()


def test_the_command_lists_sets_and_couplings(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What it prints is a table of a scene, in metres whatever the file's unit."""
    path = deck(tmp_path / "part.inp", *KINEMATIC)
    assert main(["faces", str(path)]) == 0
    printed = capsys.readouterr().out
    assert "30 hexahedron, unit 1 m, 30 × 20 × 50 mm" in printed
    assert "plane" in next(line for line in printed.splitlines() if line.startswith("TOP"))
    table = tomllib.loads(printed[printed.index("[component") :])["component"]["NAME"]["interface"]
    interface = Interface.model_validate(table["GRIP"])
    assert (interface.surface, interface.tie, interface.point) == ("LID", "rbe2", (0.001, 0.002, 0.06))
    assert main(["faces", str(path), "--unit", "0.001", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["couplings"]["GRIP"]["point"] == [1e-6, 2e-6, 6e-5]
    bottom = document["sets"]["BOTTOM"]
    assert (bottom["nodes"], bottom["kind"]) == (12, "plane")
    assert main(["faces", str(path), "--solid", "1"]) == 2
    assert "--solid: given with" in capsys.readouterr().err


def test_matrices_without_the_coupled_nodes_are_refused(tmp_path: Path) -> None:
    """A program that eliminates them leaves no rows: held nodes have none either, and would be taken for these."""
    mesh, model = files.block()
    lid = np.unique(mesh.surfaces["top"].facets)
    sets = {"TOP": lid}
    path = files.write_deck(tmp_path / "part.inp", mesh.nodes, mesh.cells, "C3D10", sets, "\n".join([*LID, *KINEMATIC]))
    dofs = np.array([(n + 1, d + 1) for n in range(len(mesh.nodes)) for d in range(3)])
    whole = files.write_calculix(tmp_path, model.K, model.M, dofs, path)
    assert Matrices(kind="matrices", **whole).build(None).surfaces["LID"].shape["kind"] == "plane"
    free = np.flatnonzero(~np.isin(dofs[:, 0], lid + 1))
    given = files.write_calculix(tmp_path, model.K[free][:, free], model.M[free][:, free], dofs[free], path)
    with pytest.raises(InputError, match=f"has no row of {len(lid)} nodes that a coupling or equation"):
        Matrices(kind="matrices", **given).build(None)


def test_nodes_of_equations_depend_on_others(tmp_path: Path) -> None:
    first, second, third = top()[:3]
    lines = [
        "*EQUATION",
        "3",
        f"{first}, 1, 1., {second}, 1, -0.5",
        f"{third}, 1, -0.5",
        "2",
        f"{second}, 2, 1., 1, 2, -1.",
    ]
    model = read_deck(str(deck(tmp_path / "part.inp", *lines)))
    np.testing.assert_array_equal(model.dependent, sorted([first, second]))


@pytest.mark.parametrize(("lines", "said"), [
    (["*COUPLING, REF NODE=9001", "*KINEMATIC"], "*COUPLING without SURFACE"),
    (["*COUPLING, SURFACE=LID", "*KINEMATIC"], "*COUPLING without REF NODE"),
    (["*COUPLING, SURFACE=LID, REF NODE=77777", "*KINEMATIC"], "names node 77777, which the model does not have"),
    (["*COUPLING, SURFACE=LID, REF NODE=LEADS", "*KINEMATIC"], "REF NODE=LEADS of 'LID'; allowed: the number"),
    (["*EQUATION", "two", "1, 1, 1."], "'two', expected the number of terms"),
])  # fmt: skip
def test_a_damaged_coupling_is_one_line(tmp_path: Path, lines: list[str], said: str) -> None:
    with pytest.raises(InputError) as caught:
        read_deck(str(deck(tmp_path / "part.inp", *lines)))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_rigid_elements_of_nastran(tmp_path: Path) -> None:
    grids = [
        f"GRID,{k},,{x},{y},{z}" for k, (x, y, z) in enumerate([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)], 1)
    ]
    cards = ["GRID,9,,0.3,0.3,0.5", "RBE2,10,9,123456,1,2,3", "RBE2,11,9,12,1,2", "RBE2,13,9,123,1,THRU,3",
             "RBE3,12,,9,123456,1.0,123,1,2", ",3,2.0,123,3"]  # fmt: skip
    path = tmp_path / "part.bdf"
    path.write_text("\n".join(["BEGIN BULK", *grids, *cards, "ENDDATA"]) + "\n")
    model = read_deck(str(path))
    assert [(one.name, one.reference, one.tie) for one in model.couplings] == [
        ("rbe2_10", 9, "rbe2"), ("rbe2_13", 9, "rbe2"), ("rbe3_12", 9, "rbe3"),
    ]  # fmt: skip
    for name in ("rbe2_10", "rbe2_13"):
        np.testing.assert_array_equal(model.node_sets[name], [1, 2, 3])


def test_the_command_lists_one_of_several_bodies(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "two.inp").write_text(TWO)
    assert main(["faces", str(tmp_path / "two.inp"), "--part", "P"]) == 0
    assert "I-2.TIP" in capsys.readouterr().out
    assert main(["faces", str(tmp_path / "two.inp"), "--instance", "I-1"]) == 0
    assert "TIP" in capsys.readouterr().out
    assert main(["faces", str(tmp_path / "gone.step"), "--part", "P"]) == 2
    assert "--part: given with" in capsys.readouterr().err
