"""Materials and orientations of decks as those of a scene."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.drafts.deck_materials import material_table
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.mesh_file import MeshFile
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.stages.job import Job
from tests.pipeline.geometry.test_decks import BDF, NODES, SOLID
from tests.pipeline.geometry.test_relations import CDB

STEEL = "*MATERIAL, NAME=Steel\n*ELASTIC\n2.05e5, 0.29\n*DENSITY\n7.83e-9,\n"
WOOD = ("*MATERIAL, NAME=WOOD\n*DENSITY\n5e-10\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n"
        "11000., 800., 500., 0.37, 0.47, 0.43, 600., 700.\n40.\n")  # fmt: skip
TURNED = "*ORIENTATION, NAME=OR\n0, 2, 0, -1, 0, 0\n"
SECTION = "*SOLID SECTION, ELSET=body, MATERIAL={material}{more}\n"
TONNES = {"unit": 1e-3, "mass_unit": 1000.0}


def table(path: Path, text: str, **keys: Any) -> dict[str, Any]:
    path.write_text(text)
    geometry = MeshFile.model_validate({"kind": "file", "path": str(path), **keys})
    return material_table(geometry, "component.p.geometry.materials")


def test_an_isotropic_material_in_tonnes_and_mm(tmp_path: Path) -> None:
    text = NODES + SOLID + WOOD + STEEL + SECTION.format(material="STEEL", more="")
    constants = table(tmp_path / "part.inp", text, **TONNES)
    assert constants == pytest.approx({"E": 2.05e11, "nu": 0.29, "rho": 7830.0})


def test_an_orthotropic_material_with_its_directions(tmp_path: Path) -> None:
    text = NODES + SOLID + WOOD + TURNED + SECTION.format(material="wood", more=", ORIENTATION=or")
    constants = table(tmp_path / "part.inp", text, **TONNES)
    orthotropic = constants["orthotropic"]
    assert constants["rho"] == pytest.approx(500.0)
    assert orthotropic["E"] == pytest.approx([11e9, 0.8e9, 0.5e9])
    assert orthotropic["G"] == pytest.approx([0.6e9, 0.7e9, 0.04e9])
    np.testing.assert_allclose(orthotropic["axes"], [[0, 1, 0], [-1, 0, 0]], atol=1e-12)
    Material.model_validate(constants)


@pytest.mark.parametrize("turned", [False, True])
def test_stiffness_by_components(turned: bool, tmp_path: Path) -> None:
    """ORTHO of Abaqus and a MAT9 of Nastran of one stiffness, whose shears have other orders."""
    C = np.array([[10.0, 4, 3], [4, 8, 2], [3, 2, 6]])
    ortho = "*MATERIAL, NAME=O\n*DENSITY\n2000.\n*ELASTIC, TYPE=ORTHO\n10., 4., 8., 3., 2., 6., 1.2, 1.3\n2.3\n"
    text = NODES + SOLID + ortho + SECTION.format(material="O", more="")
    abaqus = table(tmp_path / "part.inp", text)["orthotropic"]
    S = np.linalg.inv(C)
    np.testing.assert_allclose(abaqus["E"], 1 / np.diag(S))
    np.testing.assert_allclose(abaqus["nu"], [-S[0, 1] / S[0, 0], -S[0, 2] / S[0, 0], -S[1, 2] / S[1, 1]])
    mat9 = (
        "PSOLID,1,7,{cord}\nMAT9,7,10.,4.,3.,0.,0.,0.,8.,+\n+,2.,0.,0.,0.,6.,0.,0.,0.,+\n+,1.2,0.,0.,2.3,0.,1.3,2000.\n"
    )
    system = "CORD2R,5,,0.,0.,0.,0.,0.,1.\n,0.,1.,0.\n"
    nastran = table(tmp_path / "part.bdf", BDF["plain"] + system + mat9.format(cord=5 if turned else ""))["orthotropic"]
    for key in ("E", "nu", "G"):
        np.testing.assert_allclose(nastran[key], abaqus[key], rtol=1e-12)
    assert abaqus["G"] == pytest.approx([1.2, 1.3, 2.3])
    np.testing.assert_allclose(nastran["axes"], [[0, 1, 0], [-1, 0, 0]] if turned else np.eye(3)[:2], atol=1e-12)


def test_mat1_by_its_property_and_wtmass(tmp_path: Path) -> None:
    text = BDF["plain"] + "PSOLID,1,7\nMAT1,6,1.,,0.1,1.\nMAT1,7,2.05+5,,0.29,7.83\nPARAM,WTMASS,1.-9\n"
    constants = table(tmp_path / "part.bdf", text, **TONNES)
    assert constants == pytest.approx({"E": 2.05e11, "nu": 0.29, "rho": 7830.0})


def test_materials_of_ansys(tmp_path: Path) -> None:
    data = "MPDATA,R5.0, 1,EX  ,       1, 1,  205000.0    ,\nMPDATA,R5.0, 1,NUXY,       1, 1, 0.29\nMP,DENS,1,7.83E-9\n"
    constants = table(tmp_path / "part.cdb", data + CDB.format(spring=""), **TONNES)
    assert constants == pytest.approx({"E": 2.05e11, "nu": 0.29, "rho": 7830.0})


@pytest.mark.parametrize(("text", "words"), [
    (NODES + SOLID, "gives no material to its solids"),
    (NODES + SOLID + STEEL + SECTION.format(material="STEEL", more=""), "geometry.mass_unit states the kg"),
    (NODES + SOLID + "*MATERIAL, NAME=A\n*ELASTIC\n1., 0.3\n", "has no density"),
    (NODES + SOLID + "*MATERIAL, NAME=A\n*DENSITY\n1000.\n", "has no E"),
    (NODES + SOLID + "*MATERIAL, NAME=A\n*DENSITY\n1000.\n*ELASTIC, TYPE=ANISO\n1., 2., 3., 4., 5., 6., 7., 8.\n9.\n",
     "line 8: the material of 'all' is neither isotropic nor orthotropic"),
    (NODES + SOLID + WOOD.replace("5e-10", "500.") + "*ORIENTATION, NAME=OR, SYSTEM=CYLINDRICAL\n0,0,0,0,0,1\n"
     + SECTION.format(material="WOOD", more=", ORIENTATION=OR"), "in Cartesian directions"),
])  # fmt: skip
def test_what_is_no_material_of_a_solid_is_refused(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=words):
        table(tmp_path / "part.inp", text)


SCENE = """
component.p.geometry = { kind = "file", path = "part.inp", unit = 0.001, mass_unit = 1000.0, materials = true }
body.b = { component = "p", velocity = [0, 0, 1] }
run = { duration = 1e-5 }
"""


def test_a_scene_takes_the_materials_of_its_deck(tmp_path: Path) -> None:
    second = "*NODE\n5, 1, 0, -4\n*ELEMENT, TYPE=C3D4, ELSET=LOW\n2, 1, 3, 2, 5\n"
    sections = SECTION.format(material="STEEL", more="") + "*SOLID SECTION, ELSET=LOW, MATERIAL=WOOD\n"
    (tmp_path / "part.inp").write_text(NODES + SOLID + second + STEEL + WOOD + sections)
    (tmp_path / "scene.toml").write_text(SCENE)
    job = open_job(tmp_path, db=tmp_path / "db", out=tmp_path / "out")
    assert isinstance(job, Job)
    material = job.scene.component["p"].material
    assert material is not None
    assert pytest.approx(2.05e11) == material.E
    assert material.volumes["LOW"].rho == pytest.approx(500.0)
    (tmp_path / "scene.toml").write_text(SCENE + "component.p.material = { E = 1e9, nu = 0.3, rho = 1000.0 }\n")
    with pytest.raises(InputError, match=r"true given with component\.p\.material"):
        open_job(tmp_path, db=tmp_path / "db", out=tmp_path / "out")
