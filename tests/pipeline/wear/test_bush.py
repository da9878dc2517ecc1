"""What wear changes of a bush's compliance: against Lamé's ring of another radius, and what is allowed."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.cli import main
from gudgeon.pipeline.kinds import run
from gudgeon.pipeline.wear.bush import compliance_change, moved_nodes
from tests.pipeline.wear.test_cycles import GAP, LENGTH, RADIUS, SHAFT
from tests.pipeline.wear.test_elastic_bearing import AROUND, AT_REST, NU, E, opened, written

BORE, OUTER = RADIUS + GAP, 0.02


def ring(radius: float) -> float:
    """Return the mean radial displacement per radial force on the whole bore of a ring held outside (Lamé) [m/N]."""
    even = (1 + NU) * (1 - 2 * NU) / E / (1 / OUTER**2 + (1 - 2 * NU) / radius**2)
    return even * (1 / radius - radius / OUTER**2) / (2 * np.pi * radius * LENGTH)


def test_even_wear_changes_the_bush_as_another_radius_does(tmp_path: Path) -> None:
    """Under an even pressure δC/C = h d log(u/f)/da to 1 %; of all waves no less, and less than four times that."""
    job = opened(tmp_path)
    run(written(tmp_path), until="morph", db=tmp_path / "db", out=tmp_path / "out")
    joint, depth = job.scene.joint["pin"], 2e-6
    wanted = (ring(BORE + depth) - ring(BORE - depth)) / 2 / ring(BORE)
    import gudgeon.pipeline.wear.bush as own

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(own, "WAVES", 0)
        found = compliance_change(job, "pin", joint, np.full(AROUND, depth))
        assert found == pytest.approx(abs(wanted), rel=0.01)
    largest = compliance_change(job, "pin", joint, np.full(AROUND, depth))
    assert found <= largest < 4 * found
    assert compliance_change(job, "pin", joint, np.full(AROUND, 10 * depth)) == pytest.approx(10 * largest, rel=1e-4)


def test_nodes_of_the_bore_move_by_the_depth() -> None:
    depths = np.array([1e-6, 2e-6, 3e-6, 2e-6])
    moved = moved_nodes(np.array([[0.01, 0.0], [0.0, 0.01], [-0.01, 0.0], [0.02, 0.0]]), 0.01, 720, depths)
    np.testing.assert_allclose(moved, [[1e-6, 0.0], [0.0, 2e-6], [-3e-6, 0.0], [0.0, 0.0]], atol=1e-18)


def test_a_bush_that_wears_too_much_ends_the_cycles(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The estimate is told within change.tolerance, else the command ends with it."""
    changes = SHAFT | {"run.duration": 0.004, "joint.pin.wear.after": 0.001, "body.shaft.position": [0.0, AT_REST, 0.0]}
    given = [f"--set={key}={value}" for key, value in changes.items()]
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    command = ["wear", str(written(tmp_path)), "--cycles", "30", "--at", "30", *given, *places]
    assert main(command) == 0
    told = capsys.readouterr().out
    assert "joint pin: the compliance of its bush is kept; wear is estimated to change it by up to 0." in told
    assert main([*command, "--set=component.bush.change.tolerance=1e-6"]) == 1
    error = capsys.readouterr().err.splitlines()[-1]
    assert "the compliance of component 'bush'" in error
    assert "change.tolerance = 0.00%" in error
