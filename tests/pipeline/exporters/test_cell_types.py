"""Files of solids of every type of cell."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import meshio
import numpy as np
import pytest

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.exporters import uff, vtu
from gudgeon.pipeline.geometry.cells import HEXAHEDRON27, PYRAMID14, SOLIDS, WEDGE15, cell_blocks
from tests.pipeline.solids import FAMILIES, box

KINDS = {cell.name: [cell] for cell in SOLIDS.values()} | FAMILIES
SIZES = (0.03, 0.02, 0.025)


@pytest.mark.parametrize("kind", KINDS)
def test_grids_have_the_cells_of_each_type(kind: str, tmp_path: Path) -> None:
    mesh = box(KINDS[kind], (3, 2, 1), SIZES)
    vtu._write_grid(tmp_path / "part.vtu", mesh, mesh.nodes, {"height": mesh.nodes[:, 2]})
    grid = meshio.read(tmp_path / "part.vtu")
    np.testing.assert_array_equal(grid.points, mesh.nodes)
    for cell, _, nodes in cell_blocks(mesh):
        name, count = ("pyramid13", 13) if cell is PYRAMID14 else (cell.name, cell.nodes)
        np.testing.assert_array_equal(grid.cells_dict[name], nodes[:, :count])


def test_universal_files_have_cells_of_several_types() -> None:
    """Elements 116 and 113; the nodes of a hexahedron's faces belong to none."""
    mesh = box([HEXAHEDRON27], (2, 1, 1), SIZES)
    body: Any = SimpleNamespace(mesh=mesh, labels=np.arange(len(mesh.nodes)) + 1)
    lines = uff._elements(body, [*cell_blocks(mesh), *cell_blocks(box([WEDGE15], (1, 1, 1), SIZES))]).splitlines()
    heads = [line.split() for line in lines[1:] if len(line.split()) == 6 and line.split()[4] == "7"]
    assert [(head[1], head[5]) for head in heads] == [("116", "20")] * 2 + [("113", "15")] * 2


def test_universal_files_have_no_pyramids(tmp_path: Path) -> None:
    mesh = box(FAMILIES["linear"], (3, 2, 1), SIZES)
    body: Any = SimpleNamespace(
        name="part",
        mesh=mesh,
        labels=np.arange(len(mesh.nodes)) + 1,
        nodes=mesh.nodes,
        rows=[],
        shapes=np.zeros((1, 3, 0)),
    )
    with pytest.raises(InputError, match="its mesh has pyramid; universal files have no pyramids"):
        uff.write(body, tmp_path)
    assert list(tmp_path.iterdir()) == []
