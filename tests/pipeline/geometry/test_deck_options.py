"""What files state beside nodes and elements: their unit of length, and how elements are integrated."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.modes.normal import normal_modes
from tests.fuzz.decks import UNV
from tests.pipeline.geometry.matrix_files import STEEL
from tests.pipeline.geometry.test_decks import POINTS, read, refusal

MM = (
    "    -1\n   164\n         5  mm (milli-newton)            2\n    1.0000000000000000D+03   1.0D+03   1.0D+00\n"
    "    2.7D+02\n    -1\n"
)


def universal(path: Path, units: str) -> Path:
    nodes = "".join(f"{n:10}         1         1        11\n" + "".join(f"{x:25.16E}" for x in p) + "\n"
                    for n, p in enumerate(POINTS.tolist(), 1))  # fmt: skip
    path.write_text(units + UNV.format(nodes=nodes))
    return path


def test_a_universal_file_states_its_unit_of_length(tmp_path: Path) -> None:
    path = universal(tmp_path / "part.unv", MM)
    assert refusal(path) == "part.unv: line 4: the file's unit of length is 0.001 m; geometry.unit = 0.001 is missing"
    assert "notes" not in read(path, unit=1e-3).remarks
    assert read(path, unit=2e-3).remarks["notes"] == [
        "line 4: the file's unit of length is 0.001 m, geometry.unit = 0.002 is used"
    ]
    assert "notes" not in read(universal(path, MM.replace("D+03   1.0D+03", "D+00   1.0D+03"))).remarks
    assert "a factor of lengths of 0; allowed: above 0" in refusal(
        universal(path, MM.replace("1.0000000", "0.0000000"))
    )


@pytest.mark.parametrize(("option", "formulations"), [(0, ["reduced"]), (1, [])])
def test_hexahedra_of_ansys_by_their_option(option: int, formulations: list[str], tmp_path: Path) -> None:
    """SOLID186 has 2 × 2 × 2 points, in full with KEYOPT(2) = 1."""
    assert list(read(archive(tmp_path / "part.cdb", 2, option)).formulations) == formulations


def test_a_single_hexahedron_of_reduced_integration_is_computed_in_full(tmp_path: Path) -> None:
    """2 × 2 × 2 points leave six of its motions without stiffness."""
    mesh = read(archive(tmp_path / "part.cdb", 1, 0))
    assert not mesh.formulations
    assert "1 hexahedra of reduced integration share no face" in mesh.remarks["notes"][0]


def test_short_rows_of_reduced_integration_have_modes(tmp_path: Path) -> None:
    """Their mass is positive: the lowest frequency is that of full integration within 3 %."""
    frequencies = []
    for option in (0, 1):
        mesh = read(archive(tmp_path / "part.cdb", 2, option))
        model = build_model(mesh, STEEL)
        frequencies.append(normal_modes(model, 5).angular_frequencies)
    np.testing.assert_allclose(frequencies[0][:3], frequencies[1][:3], rtol=0.03)


def archive(path: Path, count: int, option: int) -> Path:
    """Write a row of SOLID186 with KEYOPT(2)."""
    grid = [(x, y, z) for z in range(2 * count + 1) for y in range(3) for x in range(3) if x % 2 + y % 2 + z % 2 < 2]
    label = {point: n for n, point in enumerate(grid, 1)}
    corners = [(x, y, z) for z in (0, 2) for x, y in ((0, 0), (2, 0), (2, 2), (0, 2))]
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    points = [*corners, *(tuple((a + b) // 2 for a, b in zip(corners[i], corners[j], strict=True)) for i, j in edges)]
    nodes = "".join(f"{n:9}{0:9}{0:9}" + "".join(f"{x:21.13E}" for x in p) + "\n" for n, p in enumerate(grid, 1))
    rows = ""
    for k in range(count):
        members = [label[x, y, z + 2 * k] for x, y, z in points]
        rows += "".join(f"{n:9}" for n in [1, 1, 1, 1, 0, 0, 0, 0, 20, 0, k + 1, *members[:8]]) + "\n"
        rows += "".join(f"{n:9}" for n in members[8:]) + "\n"
    path.write_text(f"ET,1,186\nKEYOPT,1,2,{option}\nNBLOCK,6,SOLID\n(3i9,6e21.13e3)\n{nodes}-1\n"
                    f"EBLOCK,19,SOLID\n(19i9)\n{rows}       -1\n")  # fmt: skip
    return path
