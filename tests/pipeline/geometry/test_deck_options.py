"""What files state beside nodes and elements: their unit of length, and how elements are integrated."""

from pathlib import Path

import numpy as np
import pytest

from tests.fuzz.decks import UNV
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
    corners = np.array([[x, y, z] for z in (0, 1) for y, x in ((0, 0), (0, 1), (1, 1), (1, 0))], float)
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    points = [*corners, *((corners[a] + corners[b]) / 2 for a, b in edges)]
    nodes = "".join(f"{n:9}{0:9}{0:9}" + "".join(f"{x:21.13E}" for x in p) + "\n" for n, p in enumerate(points, 1))
    row = [1, 1, 1, 1, 0, 0, 0, 0, 20, 0, 1, *range(1, 9)]
    element = "".join(f"{k:9}" for k in row) + "\n" + "".join(f"{k:9}" for k in range(9, 21)) + "\n"
    path = tmp_path / "part.cdb"
    path.write_text(f"ET,1,186\nKEYOPT,1,2,{option}\nNBLOCK,6,SOLID\n(3i9,6e21.13e3)\n{nodes}-1\n"
                    f"EBLOCK,19,SOLID\n(19i9)\n{element}       -1\n")  # fmt: skip
    assert list(read(path).formulations) == formulations
