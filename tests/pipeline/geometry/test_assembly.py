"""Parts that an assembly places: names of their faces, and two components from one file, each at its place."""

import re
from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.cli import main
from gudgeon.pipeline.geometry.cad.part import opened
from gudgeon.pipeline.geometry.cad.step_text import corners_of, instances_of, labels_of
from tests.pipeline.geometry.cad_files import ASSEMBLY, part

BOLT, FIRST_BRACKET, SECOND_BRACKET = 4, 10, 18


@pytest.fixture(scope="module")
def named(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the assembly of 18 solids with a name for each of the 53 faces that its file has."""
    path = tmp_path_factory.mktemp("assembly") / "named.stp"
    text = re.sub(r"ADVANCED_FACE\('#(\d+)'", r"ADVANCED_FACE('F\1'", ASSEMBLY.read_text())
    path.write_text(text)
    return path


def middles(path: Path, solid: int) -> dict[str, np.ndarray]:
    """Return the middle of the corners of each named face of a solid [mm]."""
    with opened(part(path, solids=[solid])) as found:
        gmsh, middle = found.gmsh, {}
        for face in found.faces:
            points = gmsh.model.getBoundary([(2, face.number)], combined=False, oriented=False, recursive=True)
            middle[face.name] = np.mean([gmsh.model.getValue(0, tag, []) for _, tag in points], axis=0)
    return middle


@pytest.mark.parametrize("solid", [BOLT, FIRST_BRACKET, SECOND_BRACKET])
def test_faces_of_placed_parts_have_the_names_of_the_file(named: Path, solid: int) -> None:
    """Up to three assemblies deep: distances between named faces are those of the part in its own axes."""
    found = middles(named, solid)
    instances = instances_of(named.read_text())
    labels = {name: number for number, name in labels_of(instances).items()}
    own = {name: np.unique(corners_of(labels[name], instances).round(6), axis=0).mean(axis=0) for name in found}
    placed = {name: found[name] for name in found}
    assert "" not in found
    assert len(found) == {BOLT: 7}.get(solid, 16)
    names = sorted(found)
    for one in names:
        for other in names:
            apart = np.linalg.norm(placed[one] - placed[other])
            assert apart == pytest.approx(np.linalg.norm(own[one] - own[other]), abs=0.05)
    assert np.abs(np.array([placed[name] - own[name] for name in names])).max() > 1.0, "the part is where it was drawn"


def test_a_named_face_of_a_placed_part_is_a_surface(named: Path) -> None:
    mesh = part(named, solids=[BOLT], surfaces={"end": {"name": "F705"}}).build(0.005)
    assert len(mesh.surfaces["end"].facets)


SCENE = """
[component.plate]
geometry = {{ kind = "cad", path = "{file}", solids = ["plate"] }}
material = {{ E = 210e9, nu = 0.3, rho = 7850.0 }}
mesh = {{ size = 0.03 }}
modes = {{ reduction = "rigid" }}

[component.bracket]
geometry = {{ kind = "cad", path = "{file}", solids = [10] }}
material = {{ E = 70e9, nu = 0.33, rho = 2700.0 }}
mesh = {{ size = 0.02 }}
modes = {{ reduction = "rigid" }}

[body.plate]

[body.bracket]

[run]
duration = 1e-6
"""


def test_two_components_from_one_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Each is at its place in the assembly: the bracket stands on the plate."""
    (tmp_path / "scene.toml").write_text(SCENE.format(file=ASSEMBLY))
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    assert main(["mesh", str(tmp_path), *places]) == 0
    said = capsys.readouterr().out
    assert "component.plate" in said
    assert "component.bracket" in said
    plate, bracket = (part(ASSEMBLY, solids=one).build(0.03) for one in (["plate"], [FIRST_BRACKET]))
    assert bracket.nodes[:, 2].min() == pytest.approx(plate.nodes[:, 2].max(), abs=1e-9)
    low, high = plate.nodes.min(axis=0), plate.nodes.max(axis=0)
    assert ((bracket.nodes[:, :2] > low[:2] - 1e-9) & (bracket.nodes[:, :2] < high[:2] + 1e-9)).all()
    for mass in (7850 * 530574.7e-9, 2700 * 96858.2e-9):
        printed = [float(value) for value in re.findall(r"^mass\s+(\S+) kg", said, re.MULTILINE)]
        assert min(abs(value / mass - 1) for value in printed) < 1e-3
