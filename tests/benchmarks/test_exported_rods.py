"""The exported rod of rods-3d in Exudyn, as its script has it, strikes another one: the impulse is that of Gudgeon.

Both programs have the same shapes and the same contact spring, which is a penalty between the mean displacements of the
end faces. `python -m tests.benchmarks.test_exported_rods FOLDER` prints what was found.
"""

import runpy
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.cli import main
from gudgeon.pipeline.kinds import run
from tests.benchmarks.exudyn_rods import GAP, RADIUS, _settings

SCENE = Path(__file__).parents[2] / "data" / "rods-3d"
STIFFNESS = 1e9
"""Of the contact [N/m]."""
DURATION, STEP = 6e-4, 1e-7
SAME_IMPULSE = 1e-3
LENGTH = 1.0
"""Of a rod [m]."""


def impulses(folder: Path) -> tuple[float, float]:
    """Return the impulse [N s] that Gudgeon finds and that of the exported script in Exudyn."""
    own = [
        "contact.pair.method=penalty", "contact.pair.dashpot=none",
        f"contact.pair.law={{ kind = 'linear', stiffness = {STIFFNESS} }}",
    ]  # fmt: skip
    found = run(SCENE, set=own, db=folder / "db", out=folder / "out", until="solve")
    places = ["--db", str(folder / "db"), "--out", str(folder / "out")]
    assert main(["export", str(SCENE), "one", "--format", "exudyn", *places, *(f"--set={one}" for one in own)]) == 0
    return found.quantities["pair.impulse"]["value"], in_exudyn(
        runpy.run_path(str(folder / "out" / "parts" / "one.py"))
    )


def in_exudyn(script: dict[str, Any]) -> float:
    """Return the impulse [N s] of the first rod at 1 m/s on the second one."""
    import exudyn as exu
    from exudyn import itemInterface as items

    mbs, body = exu.SystemContainer().AddSystem(), script["reduced"]()
    one = script["add"](mbs, velocity=(0, 0, 1), body=body)
    two = script["add"](mbs, position=(0, 0, LENGTH + 2 * RADIUS + GAP), body=body)
    markers = [script["mean_marker"](mbs, one, "surface top"), script["mean_marker"](mbs, two, "surface bottom")]
    state = mbs.AddNode(items.NodeGenericData(initialCoordinates=[GAP, 0, 0, 0], numberOfDataCoordinates=4))
    spheres = items.ObjectContactSphereSphere(
        markerNumbers=markers, nodeNumber=state, spheresRadii=[RADIUS, RADIUS], contactStiffness=STIFFNESS
    )
    sensor = mbs.AddSensor(
        items.SensorObject(
            objectNumber=mbs.AddObject(spheres), storeInternal=True, outputVariableType=exu.OutputVariableType.Force
        )
    )
    mbs.Assemble()
    if not mbs.SolveDynamic(_settings(exu, STEP, DURATION)):
        raise ValueError("Exudyn did not finish")
    stored = np.array(mbs.GetSensorStoredData(sensor))
    return float(np.trapezoid(np.linalg.norm(stored[:, 1:4], axis=1), stored[:, 0]))


def test_the_impulse_is_the_same(tmp_path: Path) -> None:
    pytest.importorskip("exudyn", reason="exudyn is not installed")
    own, other = impulses(tmp_path)
    assert other == pytest.approx(own, rel=SAME_IMPULSE)


if __name__ == "__main__":
    print("impulse of Gudgeon {:.7g} N s, of the exported script {:.7g} N s".format(*impulses(Path(sys.argv[1]))))
