"""Point masses, rigid elements and couplings of decks as parts of the body."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.interfaces.point_mass import component_model
from gudgeon.pipeline.interfaces.tie import made_rigid, rigid_ties
from gudgeon.pipeline.scenes.component import Component
from tests.pipeline.geometry.test_decks import BASE, BDF, POINTS, read, refusal

ATTACHED: dict[str, tuple[str, str, str]] = {
    "MASS": ("part.inp", BASE + "*ELEMENT, TYPE=MASS, ELSET=M\n9, 4\n*MASS, ELSET=M\n0.3\n", "node_4"),
    "COUPLING": ("part.inp", BASE + "*COUPLING, REF NODE=9, SURFACE=FOOT\n*KINEMATIC\n", "rbe2_9"),
    "CONM2": ("part.bdf", BDF["plain"] + "CONM2,5,4,,0.3\n", "node_4"),
    "RBE2": ("part.bdf", BDF["plain"] + "RBE2,5,4,123456,1,2,3\n", "rbe2_4"),
}  # fmt: skip
"""What a body has of its deck, by the keyword that leaves it out: file, text, name."""


@pytest.mark.parametrize("keyword", ATTACHED)
def test_masses_and_couplings_are_taken_over(keyword: str, tmp_path: Path) -> None:
    name, text, label = ATTACHED[keyword]
    (tmp_path / name).write_text(text)
    mesh = read(tmp_path / name)
    (attachment,) = mesh.attachments.values()
    assert list(mesh.attachments) == [label]
    assert attachment.mass == (0.3 if label == "node_4" else 0.0)
    if label == "node_4":
        np.testing.assert_array_equal(mesh.nodes[attachment.nodes], [attachment.point])
    else:  # With the nodes in the middle of edges that the reader added.
        assert len(attachment.nodes) == {"rbe2_9": 6, "rbe2_4": 10}[label]
    assert any(note.startswith(f"{label} of the deck is part of the body") for note in mesh.remarks["notes"])
    assert not read(tmp_path / name, leave_out=[keyword]).attachments


MASS9 = "*ELEMENT, TYPE=MASS, ELSET=M\n9, 9\n*MASS, ELSET=M\n0.3\n"
TONNES = "*MATERIAL, NAME=S\n*DENSITY\n7.8e-9\n"
COUPLED = "*COUPLING, REF NODE=9, SURFACE=FOOT\n*DISTRIBUTING\n"


@pytest.mark.parametrize(("text", "words"), [
    (MASS9, "line 13: MASS: node 9 is of no solid, and no coupling leads it"),
    (COUPLED + "*COUPLING, REF NODE=9, SURFACE=FOOT\n*KINEMATIC\n", "line 11: COUPLING: node 9 leads several sets"),
    ("*NODE\n8, 0, 0, 8\n*RIGID BODY, NSET=FOOT, REF NODE=9\n*NSET, NSET=FOOT\n8\n", "1 of its 4 nodes are of no solid"),
    (MASS9 + "*NSET, NSET=LINE\n1, 2\n*RIGID BODY, NSET=LINE, REF NODE=9\n", "fewer than three or lie on a line"),
    (MASS9 + COUPLED + TONNES, "density of 7.8e-09 is not in kg/m^3; geometry.mass_unit"),
])  # fmt: skip
def test_what_cannot_be_attached_is_refused(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "part.inp").write_text(BASE + text)
    assert words in refusal(tmp_path / "part.inp")


def test_the_unit_of_a_mass(tmp_path: Path) -> None:
    (tmp_path / "part.inp").write_text(BASE + MASS9 + COUPLED + TONNES)
    (attachment,) = read(tmp_path / "part.inp", mass_unit=1000.0).attachments.values()
    assert (attachment.kind, attachment.mass) == ("rbe3", 300.0)


def test_a_body_has_the_mass_and_the_rigid_face_of_its_deck(tmp_path: Path) -> None:
    """A mass at the point of a coupling is exact in a rigid motion, and its face does not deform."""
    (tmp_path / "part.inp").write_text(BASE + MASS9 + "*COUPLING, REF NODE=9, SURFACE=FOOT\n*KINEMATIC\n")
    mesh = read(tmp_path / "part.inp")
    component = Component.model_validate({
        "geometry": {"kind": "file", "path": "part.inp"}, "material": {"E": 2e11, "nu": 0.3, "rho": 7800.0},
    })  # fmt: skip
    model, plain = component_model(mesh, component, "p"), component_model(replace(mesh, attachments={}), component, "p")
    added = model.properties.mass - plain.properties.mass
    np.testing.assert_allclose(added, 0.3, rtol=1e-9)
    motion = np.tile([1.0, 0.0, 0.0], len(mesh.nodes)) + np.cross([0.0, 1.0, 0.0], mesh.nodes).ravel()
    speed = np.array([1.0, 0, 0]) + np.cross([0.0, 1.0, 0.0], [0.0, 0.0, 9.0])
    energy = motion @ (model.M @ motion) - motion @ (plain.M @ motion)
    np.testing.assert_allclose(energy, 0.3 * speed @ speed, rtol=1e-9)
    (tie,) = rigid_ties(mesh, {}).values()
    free = made_rigid(model, {"foot": tie}, "p")[0].held
    assert int(free.sum()) == 3 * len(tie.nodes) - 6


RLBLOCK = "RLBLOCK,1,1,{count},7\n(2i8,6g16.9)\n(7g16.9)\n{head}{values}\n/GO\n"


@pytest.mark.parametrize(("option", "values", "mass"), [
    (2, (0.22,), 0.22), (0, (0.22, 0.22, 0.22), 0.22), (0, (0.22, 0.3, 0.22), None), (4, (0.22,), None),
])  # fmt: skip
def test_a_mass_of_ansys_by_its_option(
    option: int, values: tuple[float, ...], mass: float | None, tmp_path: Path
) -> None:
    nodes = "".join(f"{n:9}{0:9}{0:9}" + "".join(f"{x:21.13E}" for x in p) + "\n" for n, p in enumerate(POINTS, 1))
    element = "".join(f"{k:9}" for k in (1, 1, 1, 1, 0, 0, 0, 0, 8, 0, 1, 1, 2, 3, 3, 4, 4, 4, 4)) + "\n"
    point = "".join(f"{k:9}" for k in (1, 2, 1, 1, 0, 0, 0, 0, 1, 0, 2, 4)) + "\n"
    block = RLBLOCK.format(
        count=len(values), head=f"{1:8}{len(values):8}", values="".join(f"{x:16.9g}" for x in values)
    )
    path = tmp_path / "part.cdb"
    path.write_text("ET,1,185\nET,2,21\n" + f"KEYOPT,2,3,{option}\n" + f"NBLOCK,6,SOLID\n(3i9,6e21.13e3)\n{nodes}-1\n"
                    f"EBLOCK,19,SOLID\n(19i9)\n{element}{point}       -1\n{block}")  # fmt: skip
    if mass is None:
        assert "MASS21 is not taken over: a mass by direction or with inertia" in refusal(path)
    else:
        assert [item.mass for item in read(path).attachments.values()] == [mass]


def test_weights_of_an_rbe3(tmp_path: Path) -> None:
    """A point of equal weights has the mean motion of its nodes; unequal ones are no plain mean."""
    grid = "GRID,9,,0.,0.,9.\n"
    even, uneven = "RBE3,5,,9,123456,1.,123,1,2\n,3\n", "RBE3,5,,9,123456,1.,123,1,2\n,3,2.,123,4\n"
    path = tmp_path / "part.bdf"
    path.write_text(BDF["plain"] + grid + even + "CONM2,7,9,,0.3\n")
    assert [item.kind for item in read(path).attachments.values()] == ["rbe3"]
    path.write_text(BDF["plain"] + grid + uneven)
    assert "RBE3 is not taken over: a rigid element" in refusal(path)
