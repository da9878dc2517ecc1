"""Bodies that motions, bushings and cranks hold start undeformed, and probes of rates have what R carries.

A cantilever of steel under a force at its tip from t = 0 on: Euler-Bernoulli's modes, Σ 4 F/(m ω_k²)(1 − cos ω_k t).
"""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.kinds import run

BEAM = """
[component.b]
geometry.kind = "beam"
geometry.length = 0.5
geometry.motion = "space"
geometry.section = { kind = "rectangle", width = 0.02, height = 0.01 }
material = { E = 210e9, nu = 0.3, rho = 7850 }
mesh.size = 0.05
interface.root = { surface = "left", kind = "tie", tie = "rbe2" }
interface.tip = { surface = "right", kind = "mean" }
modes.normal_count = 12

[body.b]

[probe.tip]
kind = "displacement"
body = "b"
interface = "tip"
direction = [0, 0, 1]
"""
LOAD = """
[force.f]
kind = "force"
body = "b"
interface = "tip"
direction = [0, 0, 1]
expression = "10"
"""
HOLDS = {
    "motion": '[motion.m]\nkind = "translation"\nbody = "b"\ninterface = "root"\ndirection = [0, 0, 1]\nheld = true\n'
    'expression = "0"\n',
    "bushing": '[force.k]\nkind = "bushing"\nbody = "b"\ninterface = "root"\nstiffness = [1e9, 1e9, 1e9]\n'
    "rotational_stiffness = [1e7, 1e7, 1e7]\n",
}
RUN = '[run]\nduration = 0.02\nstart = "undeformed"\nchecks = false\nsamples = 1000\n'
ROOTS = np.array([1.875104068711961, 4.694091132974175, 7.854757438237613, *((np.arange(4, 30) - 0.5) * np.pi)])
MASS, FORCE = 7850 * 2e-4 * 0.5, 10.0
OMEGA = ROOTS**2 * np.sqrt(210e9 * (0.02 * 0.01**3 / 12) / (7850 * 2e-4 * 0.5**4))


@pytest.mark.parametrize("hold", HOLDS)
def test_a_beam_that_is_held_starts_undeformed(hold: str, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(BEAM + LOAD + HOLDS[hold] + RUN)
    report = run(tmp_path / "scene.toml", until="solve", db=tmp_path / "db", out=tmp_path / "out")
    rows = np.loadtxt(tmp_path / "out" / "probes.csv", delimiter=",", skiprows=1)
    exact = (4 * FORCE / (MASS * OMEGA**2) * (1 - np.cos(np.outer(rows[:, 0], OMEGA)))).sum(axis=1)
    assert abs(rows[0, 1]) < 1e-3 * np.abs(exact).max()
    assert report.quantities["tip.displacement_peak"]["value"] == pytest.approx(exact.max(), rel=0.01)


BLOCK = """
[component.p]
geometry = { kind = "box", lx = 0.03, ly = 0.03, lz = 0.1 }
material = { E = 2e9, nu = 0.3, rho = 1500 }
mesh.size = 0.015
interface.pin = { surface = "bottom", kind = "mean" }
interface.top = { surface = "top", kind = "mean" }
modes.normal_count = 6

[force.g]
kind = "force"
body = "p"
interface = "top"
direction = [0, 0, -1]
expression = "10000"

[probe.d]
kind = "displacement"
body = "p"
interface = "top"
direction = [0, 0, 1]

[run]
duration = 1e-4
start = "undeformed"
checks = false
samples = 200
"""
CRANK = """
[body.p]
position = [0, 0, 0.19]
freedom = ["z"]

[joint.c]
kind = "slider-crank"
body = "p"
interface = "pin"
crank_radius = 0.04
rod_length = 0.15
speed = 60.0
"""


def test_a_body_on_a_crank_starts_undeformed(tmp_path: Path) -> None:
    """10 kN shorten it by 0.6 mm at rest; the end has moved by 1e-3 of it after the first sample of 0.5 µs."""
    (tmp_path / "scene.toml").write_text(BLOCK + CRANK)
    run(tmp_path / "scene.toml", until="solve", db=tmp_path / "db", out=tmp_path / "out")
    assert abs(np.loadtxt(tmp_path / "out" / "probes.csv", delimiter=",", skiprows=1)[0, 1]) < 2e-6


DRIVEN = """
[motion.m]
kind = "translation"
body = "b"
interface = "root"
direction = [0, 0, 1]
held = true
expression = "1e-4*(1 - cos(2*pi*200*t))"

[probe.v]
kind = "velocity"
body = "b"
interface = "root"
direction = [0, 0, 1]

[probe.a]
kind = "acceleration"
body = "b"
interface = "root"
direction = [0, 0, 1]

[run]
duration = 0.01
checks = false
"""


def test_a_driven_interface_has_its_prescribed_acceleration(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(BEAM + DRIVEN)
    found = run(
        tmp_path / "scene.toml", until="solve", set={"component.b.modes.normal_count": 4}, db=tmp_path / "db",
        out=tmp_path / "out",
    ).quantities  # fmt: skip
    rate = 2 * np.pi * 200
    assert abs(found["v.velocity_peak"]["value"]) == pytest.approx(1e-4 * rate, rel=2e-3)
    assert abs(found["a.acceleration_peak"]["value"]) == pytest.approx(1e-4 * rate**2, rel=5e-3)


PRESSED = """
[component.b]
geometry = { kind = "box", lx = 0.05, ly = 0.05, lz = 0.05, patch = [0.02, 0.02] }
material = { E = 210e9, nu = 0.3, rho = 7850 }
mesh.size = 0.02
interface.p = { surface = "patch", kind = "mean" }
modes.normal_count = 10
HOLD

[body.b]
HELD

[force.f]
kind = "force"
body = "b"
interface = "p"
direction = [0, 0, -1]
expression = "1000*sin(2*pi*250*t)**4"

[probe.d]
kind = "displacement"
body = "b"
interface = "p"
direction = [0, 0, 1]

[probe.v]
kind = "velocity"
body = "b"
interface = "p"
direction = [0, 0, 1]

[probe.a]
kind = "acceleration"
body = "b"
interface = "p"
direction = [0, 0, 1]

[run]
duration = 4e-3
checks = false
"""
HELD_BY = {
    "supports": ('supports = ["bottom"]', ""),
    "freedom": ("", 'freedom = ["rx"]'),
    "damping": ('supports = ["bottom"]', "damping = { ratio = 1e-3 }"),
}


@pytest.mark.parametrize("hold", HELD_BY)
def test_velocity_and_acceleration_are_rates_of_the_displacement(hold: str, tmp_path: Path) -> None:
    """A load far below the first mode: displacement is flexibility times force, most of which R carries."""
    support, motion = HELD_BY[hold]
    (tmp_path / "scene.toml").write_text(PRESSED.replace("HOLD", support).replace("HELD", motion))
    found = run(tmp_path / "scene.toml", until="solve", db=tmp_path / "db", out=tmp_path / "out").quantities
    rows = np.loadtxt(tmp_path / "out" / "probes.csv", delimiter=",", skiprows=1)
    time, a, d, v = rows.T
    size = found["d.displacement_peak"]["value"]
    np.testing.assert_allclose(v[1:-1], ((d[2:] - d[:-2]) / (time[2:] - time[:-2])), atol=0.02 * np.abs(v).max())
    exact = size * 4 * (500 * np.pi) ** 2
    assert abs(a[np.abs(a).argmax()]) == pytest.approx(abs(exact), rel=0.1)
