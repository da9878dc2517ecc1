"""`gudgeon new` of decks, mesh files and assemblies: a component a part, a body an instance, and a scene that opens."""

from pathlib import Path

import gmsh
import numpy as np
import pytest

from gudgeon.pipeline.cli import main
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.job import Job
from gudgeon.solver.bodies.placing import rotation
from tests.pipeline.geometry.test_decks import BDF, POINTS, TWO, write_included
from tests.pipeline.geometry.test_decks import INP as DECKS

STEEL = "*MATERIAL, NAME=S\n*ELASTIC\n2.1e5, 0.3\n*DENSITY\n7.85e-9\n"


def draft(path: Path, folder: Path, *options: str) -> Job:
    """Write a draft of a file and open it."""
    assert main(["new", str(path), "--folder", str(folder), *options]) == 0
    job = open_job(folder, db=folder / "db", out=folder / "out")
    assert isinstance(job, Job)
    return job


def test_a_body_for_each_instance(tmp_path: Path) -> None:
    """Where the assembly has it, in metres; the assembly's sets by the names of their instances."""
    deck = TWO.replace("0, 0, 7\n", "0, 0, 7\n0, 0, 0, 0, 0, 1, 90\n") + STEEL
    (tmp_path / "part.inp").write_text(deck)
    scene = draft(tmp_path / "part.inp", tmp_path / "new").scene
    geometry = scene.component["P"].geometry
    assert (geometry.part, geometry.unit, geometry.mass_unit, geometry.materials) == ("P", 1e-3, 1000.0, True)
    assert pytest.approx(2.1e11) == scene.component["P"].material.E
    assert {name: body.component for name, body in scene.body.items()} == {"I-1": "P", "I-2": "P"}
    np.testing.assert_allclose(scene.body["I-2"].position, [0, 0, 7e-3], atol=1e-12)
    turned = rotation(scene.body["I-2"])
    assert turned is not None
    np.testing.assert_allclose(turned, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-9)
    assert scene.contact["I-1"].interface in scene.component["P"].interface
    assert "I-1" in scene.contact


def test_what_the_body_does_not_have_is_left_out_and_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """By as many kinds as there are; and what a deck includes is copied."""
    write_included(tmp_path / "sub")
    members = "*ELEMENT, TYPE=MASS, ELSET=M\n7, 9\n*MASS, ELSET=M\n1.\n*PRE-TENSION SECTION, NODE=9\n"
    (tmp_path / "part.inp").write_text(DECKS["included"] + "*NODE\n9, 0, 0, 9\n" + members)
    job = draft(tmp_path / "part.inp", tmp_path / "new", "--unit", "0.01")
    geometry = job.scene.component["part"].geometry
    assert geometry.leave_out == ("PRE-TENSION SECTION", "MASS")
    assert geometry.unit == 0.01
    assert (tmp_path / "new" / "sub" / "more.inc").is_file()
    assert "has nothing in place of PRE-TENSION SECTION, MASS (leave_out)" in capsys.readouterr().err


def test_units_of_other_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "part.bdf").write_text(BDF["plain"])
    assert main(["new", str(tmp_path / "part.bdf"), "--folder", str(tmp_path / "a")]) == 2
    assert "neither the file nor its materials tell its unit of length; --unit" in capsys.readouterr().err
    scene = draft(tmp_path / "part.bdf", tmp_path / "b", "--unit", "0.001").scene
    assert scene.component["part"].material.rho == 7850.0
    assert main(["new", str(tmp_path / "part.bdf"), "--folder", str(tmp_path / "c"), "--solid", "1"]) == 2
    assert main(["new", str(tmp_path / "gone.bdf"), "--folder", str(tmp_path / "d")]) == 2
    assert main(["new", str(tmp_path / "part.bdf"), "--folder", str(tmp_path / "b")]) == 2
    err = capsys.readouterr().err
    assert all(words in err for words in ("--solid: given with", "gone.bdf: no such file", "exists; name another"))


def test_the_plane_is_where_all_bodies_can_stand(tmp_path: Path) -> None:
    """On the largest flat face that has nothing beyond it."""
    (tmp_path / "part.inp").write_text(DECKS["plain"])
    scene = draft(tmp_path / "part.inp", tmp_path / "new", "--unit", "1").scene
    contact = scene.contact["part"]
    np.testing.assert_allclose(contact.against.normal, [0, 0, 1], atol=1e-9)
    assert POINTS[:, 2].min() - contact.against.point[2] == pytest.approx(1e-5, rel=1e-6)
    np.testing.assert_allclose(scene.body["part"].velocity, [0, 0, -1], atol=1e-12)


def test_an_assembly_of_cad(tmp_path: Path) -> None:
    """Each solid by its number or its name, where the file has it; together they are thrown at one plane."""
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addBox(0, 0, 0, 20, 20, 10)
        gmsh.model.occ.addBox(5, 5, 11, 10, 10, 10)
        gmsh.model.occ.synchronize()
        gmsh.write(str(tmp_path / "pair.step"))
    finally:
        gmsh.finalize()
    scene = draft(tmp_path / "pair.step", tmp_path / "new").scene
    assert len(scene.component) == len(scene.body) == 2
    assert len({component.geometry.solids for component in scene.component.values()}) == 2
    (contact,) = scene.contact.values()
    assert -1e-5 <= contact.against.point[2] < 0
