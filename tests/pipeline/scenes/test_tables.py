"""Tables over the crank angle: the shipped one reads as it is written, and every mistake in one is named."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.tables import CLOSED, read_cycle

GAS = Path(__file__).resolve().parents[3] / "data/piston/gas-pressure.csv"
ONE_TURN = "angle,pressure\n0,1e5\n90,2e5\n180,4e5\n360,1e5\n"


def table(folder: Path, text: str) -> Path:
    path = folder / "table.csv"
    path.write_text(text)
    return path


def complaint(path: Path) -> str:
    """Return what is said of a table that is refused, without its path."""
    with pytest.raises(InputError) as caught:
        read_cycle(path)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path}: ")
    return line.removeprefix(f"{path}: ")


def test_shipped_table(tmp_path: Path) -> None:
    values = read_cycle(GAS)
    np.testing.assert_array_equal(values, np.loadtxt(GAS, delimiter=",", skiprows=1))
    written = "".join(f"{angle!r},{pressure!r}\n" for angle, pressure in values)
    assert read_cycle(table(tmp_path, f"again,\n{written}")) == values


@pytest.mark.parametrize(
    "text",
    [
        ONE_TURN,
        ONE_TURN.replace("\n", "\r\n"),
        ONE_TURN.replace("\n", "\n\n"),
        ONE_TURN.replace(",", " , "),
        ONE_TURN.rstrip("\n"),
        f"\ufeff{ONE_TURN}",
    ],
)
def test_one_turn_is_enough(text: str, tmp_path: Path) -> None:
    assert read_cycle(table(tmp_path, text)) == ((0, 1e5), (90, 2e5), (180, 4e5), (360, 1e5))


def test_cycle_may_begin_anywhere(tmp_path: Path) -> None:
    assert read_cycle(table(tmp_path, "a,p\n-180,1\n0,2\n100,3\n540,1\n"))[0] == (-180, 1)


@pytest.mark.parametrize(("share", "closes"), [(0.9, True), (1.1, False)])
def test_jump_is_measured_by_the_largest_value(share: float, closes: bool, tmp_path: Path) -> None:
    path = table(tmp_path, ONE_TURN.replace("360,1e5", f"360,{1e5 - share * CLOSED * 4e5}"))
    assert len(read_cycle(path)) == 4 if closes else "the table must close" in complaint(path)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "a table over the crank angle needs a header and at least four rows"),
        ("\n \n", "a table over the crank angle needs a header and at least four rows"),
        (ONE_TURN.replace("90,2e5\n", ""), "a table over the crank angle needs a header and at least four rows"),
        (ONE_TURN.replace(",", ";"), "row 2 has 1 cells, angle [deg] and value are needed"),
        (ONE_TURN.replace("90,2e5", "90,2e5,3"), "row 3 has 3 cells, angle [deg] and value are needed"),
        (ONE_TURN.replace("90,2e5", "90"), "row 3 has 1 cells, angle [deg] and value are needed"),
        (ONE_TURN.replace("90,2e5", "90,high"), "row 3 holds 'high', a number is needed"),
        (ONE_TURN.replace("90,2e5", "90,"), "row 3 holds '', a number is needed"),
        (ONE_TURN.replace("180,", "half,"), "row 4 holds 'half', a number is needed"),
        (ONE_TURN.replace("90,2e5", "90,nan"), "row 3 holds 'nan', a finite number is needed"),
        (ONE_TURN.replace("360,", "inf,"), "row 5 holds 'inf', a finite number is needed"),
        (ONE_TURN.replace("180,", "80,"), "row 4: the angle 80 must be above that of the row before"),
        (ONE_TURN.replace("180,", "90,"), "row 4: the angle 90 must be above that of the row before"),
        (
            ONE_TURN.replace("360,", "350,"),
            "angles reach from 0 to 350 degrees, 350 in all; a cycle must close over 720 (or 360)",
        ),
        (
            ONE_TURN.replace("360,", "1080,"),
            "angles reach from 0 to 1080 degrees, 1080 in all; a cycle must close over 720 (or 360)",
        ),
        (
            ONE_TURN.replace("360,1e5", "360,2e5"),
            "the first value is 100000 and the last 200000 at the same crank angle; the table must close",
        ),
    ],
)
def test_table_is_refused(text: str, expected: str, tmp_path: Path) -> None:
    assert complaint(table(tmp_path, text)) == expected


@pytest.mark.parametrize("content", [b"H\xf6he,p\n0,1\n", bytes(range(256)) * 4])
def test_table_that_is_no_text(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_bytes(content)
    assert complaint(path).startswith("table cannot be read (")


def test_table_that_is_not_there(tmp_path: Path) -> None:
    assert complaint(tmp_path / "none.csv") == "table cannot be read (No such file or directory)"
    assert complaint(tmp_path).startswith("table cannot be read (")
