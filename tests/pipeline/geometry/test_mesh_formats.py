"""Meshes in formats that gmsh reads and meshio does not, or without names; true surfaces fitted on mesh files."""

import re
from pathlib import Path

import gmsh
import numpy as np
import pytest

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.elements.solid import mass_properties
from gudgeon.pipeline.geometry.mesh_file import MeshFile
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.interfaces.traction_space import traction_space
from gudgeon.pipeline.scenes.interface import Interface

RADIUS, HEIGHT = 0.02, 0.05


def write_tube(path: Path, order: int) -> Path:
    """Mesh a tube with named faces by gmsh and write it in the format that the file's name ends in."""
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        occ = gmsh.model.occ
        occ.cut(
            [(3, occ.addCylinder(0, 0, 0, 0, 0, HEIGHT, RADIUS))], [(3, occ.addCylinder(0, 0, 0, 0, 0, HEIGHT, 0.012))]
        )
        occ.synchronize()
        names = {"mantle": [], "ends": [], "bore": []}
        for _, face in gmsh.model.getEntities(2):
            box = gmsh.model.getBoundingBox(2, face)
            flat = box[5] - box[2] < 1e-3
            names["ends" if flat else "mantle" if box[3] > 0.019 else "bore"].append(face)
        for name, faces in names.items():
            gmsh.model.addPhysicalGroup(2, faces, name=name)
        gmsh.model.addPhysicalGroup(3, [1], name="tube")
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.008)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 16)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(order)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    return path


@pytest.mark.parametrize("ending", ["unv", "med", "bdf", "msh"])
@pytest.mark.parametrize("order", [1, 2])
def test_formats_give_the_same_part(tmp_path: Path, ending: str, order: int) -> None:
    path = write_tube(tmp_path / f"tube.{ending}", order)
    mesh = MeshFile(kind="file", path=str(path)).build(None)
    volume = np.pi * (RADIUS**2 - 0.012**2) * HEIGHT
    assert mass_properties(mesh, 1.0).mass == pytest.approx(volume, rel={1: 3e-2, 2: 3e-3}[order])
    if ending == "bdf":  # has numbers of properties in place of names
        return
    mantle, bore = mesh.surfaces["mantle"].shape, mesh.surfaces["bore"].shape
    assert (mantle["kind"], mantle["radius"]) == ("cylinder", pytest.approx(RADIUS, rel=1e-6))
    assert (bore["kind"], bore["radius"]) == ("cylinder", pytest.approx(0.012, rel=1e-6))
    assert mesh.surfaces["ends"].shape == {}
    space = Interface(
        surface="mantle", kind="traction", sector_deg=(-40, 40), height=(0.01, 0.04), spacing=(0.01, 0.01)
    )
    assert traction_space(mesh, space, "here").size >= 16


def test_a_damaged_file_is_refused(tmp_path: Path) -> None:
    path = write_tube(tmp_path / "tube.unv", 1)
    path.write_text(path.read_text()[:3000])
    with pytest.raises(InputError, match=r"tube\.unv: "):
        MeshFile(kind="file", path=str(path)).build(None)


def write_cdb(path: Path, mesh: MeshRecord, eight: bool) -> Path:
    """Write an archive as CDWRITE does: SOLID187 of ten nodes, or SOLID185 with repeated corners."""
    lines = [
        "/COM,ANSYS RELEASE 19.2",
        f"ET,1,{185 if eight else 187}",
        f"NBLOCK,6,SOLID,{len(mesh.nodes)},{len(mesh.nodes)}",
        "(3i9,6e21.13e3)",
    ]
    for number, point in enumerate(mesh.nodes, 1):
        values = [f"{value:21.13E}" for value in point]
        while values and float(values[-1]) == 0.0:
            values.pop()
        lines.append(f"{number:9}{0:9}{0:9}" + "".join(values))
    lines += ["N,R5.3,LOC,       -1,", f"EBLOCK,19,SOLID,{len(mesh.cells)},{len(mesh.cells)}", "(19i9)"]
    for number, cell in enumerate(mesh.cells + 1, 1):
        i, j, k, m = cell[:4]
        nodes = [i, j, k, k, m, m, m, m] if eight else list(cell)
        head = [1, 1, 1, 1, 0, 0, 0, 0, len(nodes), 0, number]
        lines.append("".join(f"{value:9}" for value in [*head, *nodes[:8]]))
        if nodes[8:]:
            lines.append("".join(f"{value:9}" for value in nodes[8:]))
    lines += ["       -1"]
    for name, surface in mesh.surfaces.items():
        chosen = np.unique(surface.facets[:, :3] if eight else surface.facets) + 1
        starts = [int(one) for one in chosen if one - 1 not in chosen]
        ends = [int(one) for one in chosen if one + 1 not in chosen]
        values = [one for a, b in zip(starts, ends, strict=True) for one in ([a] if a == b else [a, -b])]
        lines += [f"CMBLOCK,{name:8},NODE,{len(values):8}  ! users", "(8i10)"]
        lines += ["".join(f"{one:10}" for one in values[row : row + 8]) for row in range(0, len(values), 8)]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("eight", [False, True])
def test_an_archive_of_ansys(tmp_path: Path, eight: bool) -> None:
    box = Box(kind="box", lx=0.04, ly=0.03, lz=0.02).build(0.012)
    mesh = MeshFile(kind="file", path=str(write_cdb(tmp_path / "box.cdb", box, eight))).build(None)
    assert mass_properties(mesh, 1.0).mass == pytest.approx(0.04 * 0.03 * 0.02, rel=1e-9)
    assert mesh.surfaces.keys() == box.surfaces.keys()
    for name, surface in box.surfaces.items():
        assert len(mesh.surfaces[name].facets) == len(surface.facets)
        assert mesh.surfaces[name].shape["normal"] == pytest.approx(surface.shape["normal"], abs=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("NBLOCK", "NXBLOCK", "has no block of nodes"),
        ("EBLOCK", "EXBLOCK", "has no solid elements"),
        ("ET,1,187", "ET,1,181", "has no solid elements"),
        ("(19i9)", "(19f9)", "a block has the format '(19f9)'"),
        ("EBLOCK,19,SOLID", "EBLOCK,19,", "is not in format SOLID"),
        ("        1        0        0", "    99999        0        0", "names node 1, which the model does not have"),
    ],
)
def test_archives_that_are_wrong_are_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    box = Box(kind="box", lx=0.04, ly=0.03, lz=0.02).build(0.02)
    path = write_cdb(tmp_path / "box.cdb", box, eight=False)
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(InputError, match=re.escape(words)) as caught:
        MeshFile(kind="file", path=str(path)).build(None)
    assert str(caught.value).startswith(f"{path}: ")


def test_tags_of_nodes_beyond_memory(tmp_path: Path) -> None:
    """A tag of a node takes no array of all tags below it, as meshio makes one: 24 GB here."""
    far = 3_000_000_000
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 2]])
    tags = "\n".join(str(far + k) for k in range(4))
    nodes = "\n".join(" ".join(map(str, p)) for p in points.tolist())
    path = tmp_path / "far.msh"
    path.write_text(
        f"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 4 {far} {far + 3}\n3 1 0 4\n{tags}\n{nodes}\n$EndNodes\n"
        f"$Elements\n1 1 1 1\n3 1 4 1\n1 {' '.join(str(far + k) for k in range(4))}\n$EndElements\n"
    )
    mesh = MeshFile(kind="file", path=str(path)).build(None)
    np.testing.assert_array_equal(mesh.nodes[mesh.cells[0, :4]], points)
