"""Point masses, rigid elements and couplings of decks as parts of the body."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.interfaces.point_mass import component_model
from gudgeon.pipeline.interfaces.tie import attached_tie, made_rigid, rigid_ties
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
    ("*NODE\n8, 0, 0, 8\n*RIGID BODY, NSET=FOOT, REF NODE=9\n*NSET, NSET=FOOT\n8\n", "1 of its 4 nodes are of no"),
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
        "geometry": {"kind": "file", "path": "part.inp", "unit": 1.0},
        "material": {"E": 2e11, "nu": 0.3, "rho": 7800.0},
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
    """A point has the mean motion of its nodes by their weights."""
    grid = "GRID,9,,0.,0.,9.\nCONM2,7,9,,0.3\n"
    even, uneven = "RBE3,5,,9,123456,1.,123,1,2\n,3\n", "RBE3,5,,9,123456,1.,123,1,2\n,3,2.,123,4\n"
    path = tmp_path / "part.bdf"
    path.write_text(BDF["plain"] + grid + even)
    (attachment,) = read(path).attachments.values()
    assert (attachment.kind, attachment.weights) == ("rbe3", None)
    path.write_text(BDF["plain"] + grid + uneven)
    mesh = read(path)
    (attachment,) = mesh.attachments.values()
    weights = dict(zip(mesh.nodes[attachment.nodes][:, 2].tolist(), attachment.weights.tolist(), strict=True))
    assert weights == {0.0: 1.0, 4.0: 2.0}
    shares = attached_tie(mesh, replace(attachment, point=np.zeros(3))).weights
    centre = attachment.weights @ mesh.nodes[attachment.nodes] / attachment.weights.sum()
    at_centre = attached_tie(mesh, replace(attachment, point=centre)).weights
    np.testing.assert_allclose(at_centre[0, :, 0], attachment.weights / attachment.weights.sum(), rtol=1e-9)
    assert not np.allclose(shares[0, :, 0], at_centre[0, :, 0])
    path.write_text(BDF["plain"] + grid + even.replace("1.,123", "1.,12"))
    assert "RBE3 is not taken over: a rigid element" in refusal(path, leave_out=["CONM2"])


INERTIA = np.array([[4e-3, 1e-3, 0.0], [1e-3, 5e-3, 0.0], [0.0, 0.0, 6e-3]])
LEVER = "GRID,9,,0.,0.,9.\n{led}CONM2,7,9,,0.3,0.5,0.,1.\n,4.-3,-1.-3,5.-3,0.,0.,6.-3\n"
RIGID = {
    "RBE2": "RBE2,5,9,123456,1,2,3\n", "RBE3": "RBE3,5,,9,123456,1.,123,1,2\n,3,4\n",
    "RBAR": "RBAR,5,9,1,123456\nRBAR,6,2,9,,123456\nRBAR,8,9,3,123456,,,123456\n",
    "RBE2, RBAR": "GRID,8,,0.,0.,8.\nRBE2,5,8,123456,1,2,3\nRBAR,6,8,9,123456\n",
    "RBE3, RBAR": "GRID,8,,0.,0.,8.\nRBE3,5,,8,123456,1.,123,1,2\n,3,4\nRBAR,6,8,9,123456\n",
    "two RBE2": "RBE2,5,9,123456,1,2\nRBE2,6,9,123,3\n",
}  # fmt: skip
"""Rigid elements that lead grid point 9."""


@pytest.mark.parametrize("name", RIGID)
def test_a_mass_beside_a_led_point_has_its_energy(name: str, tmp_path: Path) -> None:
    """1/2 m v_c² + 1/2 ω J ω in any rigid motion, its centre beside the grid point."""
    (tmp_path / "part.bdf").write_text(BDF["plain"] + LEVER.format(led=RIGID[name]))
    check_lever(read(tmp_path / "part.bdf"), np.array([0.5, 0.0, 10.0]), 0.3, INERTIA)


def check_lever(mesh: MeshRecord, centre: np.ndarray, mass: float, inertia: np.ndarray) -> None:
    component = Component.model_validate({
        "geometry": {"kind": "file", "path": "part.inp", "unit": 1.0},
        "material": {"E": 2e11, "nu": 0.3, "rho": 7800.0},
    })  # fmt: skip
    model, plain = component_model(mesh, component, "p"), component_model(replace(mesh, attachments={}), component, "p")
    for t, omega in (([1.0, 0, 0], [0, 0, 0]), ([0, 1.0, 2.0], [0.3, -0.2, 0.7]), ([0, 0, 0], [1.0, 2.0, 0.5])):
        u = (np.array(t) + np.cross(omega, mesh.nodes)).ravel()
        speed = np.array(t) + np.cross(omega, centre)
        energy = u @ (model.M @ u) - u @ (plain.M @ u)
        np.testing.assert_allclose(energy, mass * speed @ speed + omega @ inertia @ omega, rtol=1e-8)


def test_the_matrix_of_a_conm1(tmp_path: Path) -> None:
    """The same mass as a matrix of six by six at the grid point."""
    c, m = np.array([0.5, 0.0, 1.0]), 0.3
    skew = np.array([[0, -c[2], c[1]], [c[2], 0, -c[0]], [-c[1], c[0], 0]])
    M = np.block([[m * np.eye(3), -m * skew], [m * skew, INERTIA - m * skew @ skew]])
    values = [f"{M[i, j]:.6E}" for i in range(6) for j in range(i + 1)]
    lines = [["CONM1", "7", "9", "", *values[:5]], *(["", *values[k : k + 8]] for k in (5, 13))]
    conm1 = "".join(",".join(line) + "\n" for line in lines)
    text = BDF["plain"] + "GRID,9,,0.,0.,9.\n" + RIGID["RBE2"] + conm1
    (tmp_path / "part.bdf").write_text(text)
    check_lever(read(tmp_path / "part.bdf"), np.array([0.5, 0.0, 10.0]), m, INERTIA)


TURNED = "CORD2R,5,,0.,0.,0.,0.,0.,1.\n,0.,1.,0.\n"


def test_offset_and_inertia_in_a_system_of_their_own(tmp_path: Path) -> None:
    """Its x is y of the basic system, its y is −x; CID −1 states the centre in the basic system."""
    turned = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    relative = LEVER.format(led=RIGID["RBE2"]).replace("CONM2,7,9,,0.3", "CONM2,7,9,5,0.3")
    (tmp_path / "part.bdf").write_text(BDF["plain"] + TURNED + relative)
    check_lever(read(tmp_path / "part.bdf"), np.array([0.0, 0.5, 10.0]), 0.3, turned @ INERTIA @ turned.T)
    absolute = LEVER.format(led=RIGID["RBE2"]).replace("9,,0.3,0.5,0.,1.", "9,-1,0.3,0.5,0.,10.")
    (tmp_path / "part.bdf").write_text(BDF["plain"] + absolute)
    check_lever(read(tmp_path / "part.bdf"), np.array([0.5, 0.0, 10.0]), 0.3, INERTIA)


def test_units_of_an_inertia(tmp_path: Path) -> None:
    """mm and t: its centre in mm, its inertia in t mm²; WTMASS scales masses to t."""
    text = BDF["plain"] + LEVER.format(led=RIGID["RBE2"])
    for card, mass_unit in (("", 1000.0), ("PARAM,WTMASS,1000.\n", 1.0)):
        (tmp_path / "part.bdf").write_text(text + card)
        mesh = read(tmp_path / "part.bdf", unit=1e-3, mass_unit=mass_unit)
        check_lever(mesh, np.array([5e-4, 0.0, 0.01]), 300.0, 1e-3 * INERTIA)


ROTARY = (BASE + "*COUPLING, REF NODE=9, SURFACE=FOOT\n*KINEMATIC\n*ELEMENT, TYPE=MASS, ELSET=M\n8, 9\n*MASS, ELSET=M\n"
          "0.3\n*ELEMENT, TYPE=ROTARYI, ELSET=R\n9, 9\n*ROTARY INERTIA, ELSET=R\n4e-3, 5e-3, 6e-3, 1e-3\n")  # fmt: skip


def test_a_rotary_inertia_of_abaqus(tmp_path: Path) -> None:
    (tmp_path / "part.inp").write_text(ROTARY)
    check_lever(read(tmp_path / "part.inp"), np.array([0.0, 0.0, 9.0]), 0.3, INERTIA)


@pytest.mark.parametrize(("text", "words"), [
    ("CONM2,7,4,,0.3,0.5\n", "CONM2: a mass with offset or inertia on node 4 of a solid, which has no rotation"),
    ("RBE2,5,1,123,2,3\nRBE2,6,2,123,4\n", "its node 2 is of another rigid element too, whose rotation"),
    ("GRID,9,,0.,0.,9.\nRBAR,5,9,1,123456\nRBAR,6,9,2,123456\nCONM2,7,9,,1.\n", "fewer than three or lie on a line"),
    ("GRID,9,,0.,0.,9.\nRBAR,5,9,1,123,456\n", "RBAR is not taken over"),
    ("GRID,9,,0.,0.,9.\nRBE2,5,9,123456,1,2,3\nCONM2,7,9,,1.\n,-1.\n", "inertia is negative about an axis"),
    ("GRID,9,,0.,0.,9.\nRBE3,5,,9,123456,0.,123,1,2\n,3,1.,123,4\nCONM2,7,9,,1.\n", "a weight of 0 given"),
    ("GRID,9,,0.,0.,9.\nRBE2,5,9,123456,1,2,3\nRBE3,6,,9,123456,1.,123,1,2\n,3,4\nCONM2,7,9,,1.\n", "leads several"),
])  # fmt: skip
def test_rigid_elements_that_leave_a_motion_open_are_refused(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "part.bdf").write_text(BDF["plain"] + text)
    assert words in refusal(tmp_path / "part.bdf")


GRID9 = "GRID,9,,0.,0.,9.\n"
COUPLED9 = "*COUPLING, REF NODE=9, SURFACE=FOOT\n*KINEMATIC\n"
LEFT_OUT: dict[str, tuple[str, str]] = {
    "RIGID BODY": ("part.inp", BASE + "*RIGID BODY, NSET=FOOT, REF NODE=9\n"),
    "KINEMATIC COUPLING": ("part.inp", BASE + "*KINEMATIC COUPLING, REF NODE=9\nFOOT, 1, 3\n"),
    "MPC": ("part.inp", BASE + "*MPC\nBEAM, 1, 9\nBEAM, 2, 9\nBEAM, 3, 9\n"),
    "RBE3": ("part.bdf", BDF["plain"] + GRID9 + RIGID["RBE3"]),
    "RBAR": ("part.bdf", BDF["plain"] + GRID9 + RIGID["RBAR"]),
    "RROD": ("part.bdf", BDF["plain"] + "RROD,5,1,4\n"),
    "CBUSH": ("part.bdf", BDF["plain"] + "PBUSH,7,K,5.\nCBUSH,9,7,1,,,,,0\n"),
    "CONM1": ("part.bdf", BDF["plain"] + "CONM1,5,4,,0.3,,0.3\n,0.3\n"),
}  # fmt: skip
"""What a body has of its deck, by the keyword that leaves it out."""


@pytest.mark.parametrize("keyword", LEFT_OUT)
def test_every_kind_is_left_out_on_request(keyword: str, tmp_path: Path) -> None:
    name, text = LEFT_OUT[keyword]
    (tmp_path / name).write_text(text)
    mesh = read(tmp_path / name)
    assert mesh.attachments or mesh.relations or keyword == "RBE3"
    plain = read(tmp_path / name, leave_out=[keyword])
    assert not plain.attachments
    assert not plain.relations
    assert any(f"{keyword} is left out" in note for note in plain.remarks["notes"])


def test_a_coupling_and_its_mass_are_left_out_together(tmp_path: Path) -> None:
    (tmp_path / "part.inp").write_text(BASE + MASS9 + COUPLED9)
    assert "node 9 is of no solid, and no coupling leads it" in refusal(tmp_path / "part.inp", leave_out=["COUPLING"])
    assert not read(tmp_path / "part.inp", leave_out=["COUPLING", "MASS"]).attachments
