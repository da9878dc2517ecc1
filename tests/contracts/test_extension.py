"""A new contact law, force and joint each take one new file and one line of the list of their family.

The sources are copied, the files are added there, and scenes with the new members run in a process of its own.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
CUBIC = '''
"""A cubic law."""

from typing import Literal

from gudgeon.solver.laws.base import Coefficients, ContactLaw


class Cubic(ContactLaw):
    """F = K d³."""

    kind: Literal["cubic"]
    stiffness: float

    def coefficients(self) -> Coefficients:
        return Coefficients(self.stiffness, 3.0, 0.0, 0.0)
'''
PULSE = '''
"""A pulse of half a sine."""

from typing import Any, Literal

from pydantic import model_validator

from gudgeon.solver.forces.given import GivenForce


class Pulse(GivenForce):
    """Force that rises to `peak` and falls to zero at `length`."""

    kind: Literal["pulse"]
    peak: float
    length: float

    @model_validator(mode="before")
    @classmethod
    def _as_expression(cls, given: Any) -> Any:
        course = f"{given['peak']}*sin(pi*t/{given['length']})*step({given['length']}-t)"
        return {"expression": course} | dict(given)
'''
LIFTER = '''
"""A lifter: a point that moves up and down, with a rod to a body."""

from typing import Literal

import numpy as np

from gudgeon.solver.joints.slider_crank import SliderCrank


class Lifter(SliderCrank):
    """The driven point is at centre + radius cos θ along."""

    kind: Literal["lifter"]

    def crank_pin(self, time: np.ndarray) -> np.ndarray:
        pin = super().crank_pin(time)
        pin[:, 0], pin[:, 2] = np.asarray(self.centre) @ self.axes[1], 0.0
        return pin
'''
ADDED = {
    "solver/laws/cubic.py": CUBIC,
    "solver/forces/pulse.py": PULSE,
    "solver/joints/lifter.py": LIFTER,
}
CHANGED = {
    "solver/laws/__init__.py": (
        ("from gudgeon.solver.laws.base", "from gudgeon.solver.laws.cubic import Cubic\nfrom gudgeon.solver.laws.base"),
        ("Law = Annotated[Linear", "Law = Annotated[Cubic | Linear"),
    ),
    "solver/forces/__init__.py": (
        (
            "from gudgeon.solver.forces.spring",
            "from gudgeon.solver.forces.pulse import Pulse\nfrom gudgeon.solver.forces.spring",
        ),
        ("OverTime = GivenForce", "OverTime = Pulse | GivenForce"),
    ),
    "solver/joints/__init__.py": (
        (
            "Joint = Annotated[SliderCrank |",
            "from gudgeon.solver.joints.lifter import Lifter\nJoint = Annotated[Lifter | SliderCrank |",
        ),
    ),
}
MASS, SPEED, STIFFNESS = 2.0, 0.5, 1e14
RUN = """
import json, sys
from pathlib import Path
from gudgeon.solver.simulate import simulate
from tests.solver.systems import build, rigid_records
from tests.solver.features import records, keys_of, stored
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.system.compile import compile_system

folder, scenes = Path(sys.argv[1]), json.loads(sys.argv[2])
found = {}
for name, scene in scenes.items():
    if name == "joint":
        store = stored(folder / name, {"rigid": records(elastic=False)})
        system = compile_system(store, Scene.model_validate(scene), keys_of(("rigid",)))
    else:
        ball = rigid_records(2.0, {"pole": ([0.0, 0.0, -0.1], [0.0, 0.0, -1.0])})
        system = build(folder / name, ball, scene)
    run = simulate(system)
    found[name] = {
        "result": run.result, "drift": run.energy_drift, "motion": run.motion["part"].tolist(),
        "times": run.times.tolist(),
        "quantities": {key: value["value"] for key, value in run.quantities.items()},
    }
print(json.dumps(found))
"""


def scenes() -> dict[str, dict]:
    """Return a scene with each new member."""
    floor = {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}
    given = {"integrator": "small", "checks": False, "frames": 2}
    crank = {
        "kind": "lifter", "body": "part", "interface": "pin", "crank_radius": 0.002, "rod_length": 0.02,
        "speed": 3000.0, "centre": [1e-3, 0.0, -0.012],
    }  # fmt: skip
    return {
        "law": {
            "body": {"part": {"position": [0, 0, 0.1], "velocity": [0, 0, -SPEED]}},
            "contact": {"floor": {"body": "part", "interface": "pole", "against": floor, "method": "penalty",
                                  "law": {"kind": "cubic", "stiffness": STIFFNESS}}},
            "run": given | {"duration": 4e-3, "step": 5e-6, "samples": 50},
        },
        "force": {
            "body": {"part": {}},
            "force": {"push": {"kind": "pulse", "body": "part", "at": [0, 0, 0], "direction": [0, 1, 0],
                               "peak": 300.0, "length": 4e-4}},
            "run": given | {"duration": 1e-3, "step": 1e-5, "samples": 50},
        },
        "joint": {
            "body": {"part": {"component": "rigid", "freedom": ["z"]}}, "joint": {"lift": crank},
            "run": given | {"duration": 1e-2, "step": 5e-5, "samples": 50},
        },
    }  # fmt: skip


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict]:
    """Run the scenes with the copied and extended sources."""
    folder = tmp_path_factory.mktemp("extended")
    home = folder / "gudgeon"
    for name in ("modaldb", "pipeline", "solver"):
        shutil.copytree(ROOT / name, home / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pipeline/gudgeon/__init__.py", home / "__init__.py")
    for name, text in ADDED.items():
        assert not (home / name).exists()
        (home / name).write_text(text)
    for name, changes in CHANGED.items():
        text = (home / name).read_text()
        for old, new in changes:
            assert text.count(old) == 1, name
            text = text.replace(old, new)
        (home / name).write_text(text)
    paths = os.pathsep.join([str(folder), str(ROOT)])
    child = subprocess.run(
        [sys.executable, "-c", RUN, str(folder), json.dumps(scenes())], capture_output=True, text=True, check=False,
        env=os.environ | {"PYTHONPATH": paths}, cwd=folder,
    )  # fmt: skip
    assert child.returncode == 0, child.stderr
    return json.loads(child.stdout)


def test_each_family_has_one_new_and_one_changed_file() -> None:
    assert {Path(name).parent for name in ADDED} == {Path(name).parent for name in CHANGED}
    assert len(ADDED) == len(CHANGED) == 3


def test_a_new_law(found: dict[str, dict]) -> None:
    """½ m v² = K d⁴/4 at the largest depth."""
    run = found["law"]
    assert run["result"] == "FINISHED"
    deepest = (2 * MASS * SPEED**2 / STIFFNESS) ** 0.25
    assert run["quantities"]["floor.force_peak_raw"] == pytest.approx(STIFFNESS * deepest**3, rel=1e-3)
    assert run["quantities"]["floor.impulse"] == pytest.approx(2 * MASS * SPEED, rel=1e-6)
    assert run["drift"] < 1e-9


def test_a_new_force(found: dict[str, dict]) -> None:
    """Its impulse is 2 peak length / π."""
    run = found["force"]
    assert run["quantities"]["part.velocity_y"] == pytest.approx(2 * 300.0 * 4e-4 / np.pi / MASS, rel=1e-6)


def test_a_new_joint(found: dict[str, dict]) -> None:
    """The body goes up and down with the driven point, since its pin is above that."""
    run = found["joint"]
    assert run["result"] == "FINISHED"
    angle = 3000.0 * 2 * np.pi / 60 * np.array(run["times"])
    heights = np.array(run["motion"])[:, 2]
    assert heights - heights[-1] == pytest.approx(0.002 * (np.cos(angle) - np.cos(angle[-1])), abs=1e-9)
