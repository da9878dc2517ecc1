"""Frequencies of a part from STEP against those of a mesh that gmsh makes of the same drawing, without a file between.

Both converge to the same values: the lowest six differ by less than 2e-3 on a coarse mesh and by less on a finer one.
"""

from pathlib import Path

import gmsh
import numpy as np
import pytest
from scipy.sparse.linalg import eigsh

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.geometry.mesh_file import MeshFile
from gudgeon.pipeline.scenes.material import Material
from tests.pipeline.geometry.cad_files import bracket, part, write_cad

STEEL = Material(E=210e9, nu=0.3, rho=7850.0)
SIZES = (0.008, 0.005)
ALIKE = (2e-3, 8e-4)
"""Relative difference of frequencies between two meshes of each of these sizes, of the discretisation error's order."""


def frequencies(mesh: MeshRecord) -> np.ndarray:
    """Return the lowest six elastic frequencies [Hz] by shift and invert."""
    model = build_model(mesh, STEEL)
    values = eigsh(model.K, 12, model.M, sigma=-((2 * np.pi * 1000) ** 2), return_eigenvectors=False)
    return np.sqrt(np.sort(values)[6:]) / (2 * np.pi)


def direct(path: Path, size: float) -> MeshRecord:
    """Mesh the drawing in gmsh, in mm, and read the mesh."""
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        bracket(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", 1e3 * size)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 14)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    return MeshFile(kind="file", path=str(path), unit=1e-3).build(None)


@pytest.mark.validation
def test_a_bracket_has_the_frequencies_of_its_drawing(tmp_path: Path) -> None:
    step = part(write_cad(tmp_path / "bracket.step", bracket))
    pairs = [(frequencies(step.build(size)), frequencies(direct(tmp_path / "bracket.msh", size))) for size in SIZES]
    for (by_file, drawn), rtol in zip(pairs, ALIKE, strict=True):
        np.testing.assert_allclose(by_file, drawn, rtol=rtol)
    coarse, fine = (pair[0] for pair in pairs)
    assert (coarse >= fine * (1 - 1e-4)).all()
    assert coarse == pytest.approx(fine, rel=1e-2)
