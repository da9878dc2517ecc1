"""Columns of steel under loads along their axis: w = Q (tan kL/kL − 1) L/P, k² = P/(E I), up to Euler's load."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import run
from gudgeon.solver.errors import SceneError

LENGTH, E_MODULUS, WIDTH, HEIGHT = 0.5, 210e9, 0.02, 0.01
BENDING = E_MODULUS * WIDTH * HEIGHT**3 / 12
EULER = np.pi**2 * BENDING / (4 * LENGTH**2)
BEAM = """
[component.b]
geometry.kind = "beam"
geometry.length = 0.5
geometry.motion = "space"
geometry.section = { kind = "rectangle", width = 0.02, height = 0.01 }
mesh.size = 0.05
"""
BOX = """
[component.b]
geometry = { kind = "box", lx = 0.5, ly = 0.02, lz = 0.01 }
mesh.size = 0.02
"""
SCENE = """
material = { E = 210e9, nu = 0.0, rho = 7850 }
interface.tip = { surface = "right", kind = "mean" }
modes = { reduction = "rubin-macneal", normal_count = 12 }
SUPPORTS

[body.b]

HOLD

[force.p]
kind = "force"
body = "b"
interface = "tip"
direction = [-1, 0, 0]
expression = "LOAD"

[force.q]
kind = "force"
body = "b"
interface = "tip"
direction = [0, 0, 1]
expression = "1"

[probe.t]
kind = "displacement"
body = "b"
interface = "tip"
direction = [0, 0, 1]

[run]
duration = 0.002
checks = false
samples = 100
frames = 10
"""
ROOT = 'interface.root = { surface = "left", kind = "tie", tie = "rbe2" }'
HOLDS = {
    "supports": ('supports = ["left"]', ""),
    "joint": (ROOT, '[joint.j]\nkind = "fixed"\nbody = "b"\ninterface = "root"\n'),
    "motion": (ROOT, '[motion.m]\nkind = "translation"\nbody = "b"\ninterface = "root"\ndirection = [0, 0, 1]\n'
               'held = true\nexpression = "0"\n'),
}  # fmt: skip


def deflection(folder: Path, part: str, hold: str, fraction: float, **settings: object) -> float:
    """Return the displacement of the tip [m] under a fraction of Euler's load and 1 N across."""
    supports, holding = HOLDS[hold]
    text = (part + SCENE).replace("SUPPORTS", supports).replace("HOLD", holding).replace("LOAD", str(fraction * EULER))
    (folder / "scene.toml").write_text(text)
    report = run(folder / "scene.toml", until="solve", set=settings, db=folder / "db", out=folder / "out")
    return float(report.quantities["t.displacement_end"]["value"])


def exact(fraction: float) -> float:
    P = fraction * EULER
    k = np.sqrt(abs(P) / BENDING)
    turn = np.tan(k * LENGTH) if P > 0 else np.tanh(k * LENGTH)
    return (turn / k - LENGTH) / P


@pytest.mark.parametrize(("part", "hold", "fraction"), [
    (BEAM, "supports", 0.8), (BEAM, "supports", -2.0), (BEAM, "joint", 0.8), (BEAM, "motion", 0.8),
    (BOX, "supports", 0.5),
])  # fmt: skip
def test_a_load_along_softens_a_column(part: str, hold: str, fraction: float, tmp_path: Path) -> None:
    assert deflection(tmp_path, part, hold, fraction) == pytest.approx(exact(fraction), rel=0.01)


def test_without_stiffness_of_loads_a_column_is_linear(tmp_path: Path) -> None:
    found = deflection(tmp_path, BEAM, "supports", 0.8, **{"body.b.geometric_stiffness": False})
    assert found == pytest.approx(LENGTH**3 / (3 * BENDING), rel=0.01)


def test_a_buckled_column_is_refused_with_its_load_factor(tmp_path: Path) -> None:
    with pytest.raises((InputError, SceneError), match=r"body.b: it buckles .*load factor 0\.(5|4999)"):
        deflection(tmp_path, BEAM, "supports", 2.0)
