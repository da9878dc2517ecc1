"""Small scenes one step beside those that are shipped, at pure defaults, against closed forms."""

import math
import tomllib
from pathlib import Path

import pytest

import gudgeon
from gudgeon.pipeline.stages.run_report import RunReport

E, NU, RHO, G0 = 210e9, 0.3, 7850.0, 9.81
L, B, H = 0.5, 0.02, 0.01
AREA, INERTIA, SHEAR = B * H, B * H**3 / 12, 5 / 6 * B * H * E / 2 / (1 + NU)
BEAM = """
component.b.geometry.section = {{ kind = "rectangle", width = 0.02, height = 0.01 }}
component.b.geometry.kind = "beam"
component.b.geometry.length = 0.5
{}
component.b.material = {{ E = 210e9, nu = 0.3, rho = 7850 }}
component.b.mesh.size = 0.025
component.b.interface.tip = {{ surface = "right", kind = "{}" }}
"""
SPACE = 'component.b.geometry.motion = "space"'
HELD = BEAM.format(SPACE, "mean") + 'component.b.supports = ["left"]\nbody.b.component = "b"\nrun.duration = 0.01\n'
TIED = (
    BEAM.format(SPACE, 'tie", tie = "rbe2')
    + 'component.b.supports = ["left"]\nbody.b.component = "b"\nrun.duration = 0.01\n'
)
TIP = 'body = "b", interface = "tip"'
BLOCK = 'component.a.geometry = {{ kind = "rigid", mass = {}, inertia = [{}, {}, {}] }}\nbody.a.component = "a"\n'
WEIGHT = "run.gravity = [0, 0, -9.81]\n"
FOOT = """
component.a.geometry = { kind = "rigid", mass = 2.0, points = { f = { at = [0, 0, 0], normal = [0, 0, -1] } } }
component.a.interface.f = { surface = "f" }
"""


def soft(k: float) -> float:
    """Return the deflection of the beam's tip per force with a spring of stiffness k beside it [m/N]."""
    return 1 / (1 / (L**3 / 3 / E / INERTIA + L / SHEAR) + k)


SLOW = math.sqrt(1.2 * G0 * 0.3 / ((0.05 + 1.2 * 0.09 - 0.004) * math.cos(0.5)))
"""Precession of the conical pendulum [rad/s]: ω² = m g a/((I − J) cos θ)."""
ACROSS, ALONG, OMEGA = 1e4, 4e4, 100.0
"""Stiffnesses of a spring that is pulled and pressed [N/m], and the frequency of the former."""
CASES: dict[str, tuple[str, dict[str, float], float]] = {
    "tip moment": (
        TIED + f'force.m = {{ kind = "wrench", {TIP}, moment = [0, -5, 0] }}\n'
        f'probe.r = {{ kind = "rotation", {TIP}, direction = [0, 1, 0] }}\n'
        f'probe.d = {{ kind = "displacement", {TIP}, direction = [0, 0, 1] }}\n',
        {"r.rotation_end": -5 * L / E / INERTIA, "d.displacement_end": 5 * L**2 / 2 / E / INERTIA}, 1e-6,
    ),
    "spring at a tip": (
        HELD + f'force.f = {{ kind = "force", {TIP}, direction = [0, 0, 1], expression = "3" }}\n'
        f'force.s = {{ kind = "spring", {TIP}, direction = [0, 0, 1], stiffness = 2000 }}\n'
        'probe.f = { kind = "force", of = "force.s" }\n',
        {"f.force_end": 2000 * 3 * soft(2000)}, 1e-6,
    ),
    "turned part": (
        HELD + "body.b.orientation = { axis = [0, 0, 1], angle = 90 }\n"
        f'force.f = {{ kind = "force", {TIP}, direction = [1, 0, 0], expression = "10" }}\n'
        f'probe.x = {{ kind = "displacement", {TIP}, direction = [1, 0, 0] }}\n',
        {"x.displacement_end": 10 * (L**3 / 3 / E / (H * B**3 / 12) + L / SHEAR)}, 1e-6,
    ),
    "spring of two stiffnesses": (
        BLOCK.format(1.0, 0, 0, 0) + "body.a.velocity = [0.5, 0, 0]\n"
        'force.s = { kind = "spring", body = "a", direction = [1, 0, 0], values = [[-1, -4e4], [0, 0], [1, 1e4]] }\n'
        'probe.p = { kind = "displacement", body = "a", direction = [1, 0, 0] }\n'
        f"run.duration = {math.pi / math.sqrt(ACROSS) + math.pi / math.sqrt(ALONG) + 0.4 * math.pi / OMEGA}\n",
        {"p.displacement_end": 0.5 / OMEGA * math.sin(0.4 * math.pi), "p.displacement_peak": 0.5 / OMEGA}, 1e-3,
    ),
    "force that begins between samples": (
        BLOCK.format(2.0, 0, 0, 0) + 'probe.p = { kind = "displacement", body = "a", direction = [1, 0, 0] }\n'
        'force.f = { kind = "force", body = "a", at = [0, 0, 0], direction = [1, 0, 0],'
        ' expression = "100*step(t-1.2345e-3)" }\nrun.duration = 5e-3\n',
        {"p.displacement_end": 25 * (5e-3 - 1.2345e-3) ** 2}, 1e-6,
    ),
    "conical pendulum": (
        BLOCK.format(1.2, 0.05, 0.05, 0.004)
        + f"body.a.position = [{0.3 * math.sin(0.5)}, 0, {-0.3 * math.cos(0.5)}]\n"
        f"body.a.orientation = {{ axis = [0, -1, 0], angle = {math.degrees(0.5)} }}\n"
        f"body.a.velocity = [0, {SLOW * 0.3 * math.sin(0.5)}, 0]\nbody.a.angular_velocity = [0, 0, {SLOW}]\n"
        'joint.j = { kind = "spherical", body = "a", at = [0, 0, 0.3] }\nrun.duration = 1.0\n' + WEIGHT,
        {"j.force_peak": math.hypot(1.2 * G0, 1.2 * SLOW**2 * 0.3 * math.sin(0.5)),
         "a.displacement_x": 0.3 * math.sin(0.5) * (math.cos(SLOW) - 1)}, 1e-8,
    ),
    "nut on a screw": (
        BLOCK.format(1.0, 2e-3, 2e-3, 1e-3) + "run.duration = 0.5\n" + WEIGHT
        + 'joint.j = { kind = "screw", body = "a", axis = [0, 0, 1], pitch = 0.02 }\n',
        {"a.displacement_z": -0.125 * G0 / (1 + 1e-3 * (2 * math.pi / 0.02) ** 2)}, 1e-8,
    ),
    "block on a plane joint": (
        BLOCK.format(3.0, 0.01, 0.01, 0.01) + 'joint.j = { kind = "planar", body = "a", axis = [1, 0, 2] }\n'
        "run.duration = 0.5\n" + WEIGHT,
        {"a.displacement_x": G0 / math.sqrt(5) * 0.125 * 2 / math.sqrt(5), "j.force_peak": 6 * G0 / math.sqrt(5)}, 1e-8,
    ),
    "worn foot on a belt": (
        FOOT + 'body.a.freedom = ["z"]\ncontact.c = { body = "a", interface = "f", friction.static = 0.3,'
        ' surface_stiffness = 1e8, wear = { coefficient = 1e-4, hardness = 1e9 },'
        ' against = { shape = "plane", point = [0, 0, 0], normal = [0, 0, 1], velocity = [0.5, 0, 0] } }\n'
        "run.duration = 0.05\n" + WEIGHT,
        {"c.wear_volume": 1e-13 * 2 * G0 * 0.025, "c.force_peak": 2 * G0}, 1e-6,
    ),
    "foot dragged over a floor": (
        FOOT + 'body.a.freedom = ["x", "z"]\ncontact.c = { body = "a", interface = "f", friction.static = 0.3,'
        ' surface_stiffness = 1e7, against = { shape = "plane", point = [0, 0, 0], normal = [0, 0, 1] } }\n'
        'motion.m = { kind = "translation", body = "a", direction = [1, 0, 0], expression = "0.01*sin(100*t)" }\n'
        'probe.f = { kind = "force", of = "motion.m" }\nrun.duration = 0.05\nrun.limits.offset = 1.0\n' + WEIGHT,
        {"c.force_peak": 2 * G0, "f.force_peak": -(2 * 0.01 * 1e4 + 0.3 * 2 * G0)}, 1e-3,
    ),
}  # fmt: skip


def solved(text: str, folder: Path) -> RunReport:
    report = gudgeon.run(tomllib.loads(text), db=folder / "db", out=folder / "out", until="solve")
    assert report.result == "FINISHED", report.reason
    return report


@pytest.mark.parametrize("name", CASES)
def test_a_scene_beside_the_shipped_ones_meets_its_closed_form(name: str, tmp_path: Path) -> None:
    text, exact, tolerance = CASES[name]
    report = solved(text, tmp_path)
    for quantity, value in exact.items():
        assert report.quantities[quantity]["value"] == pytest.approx(value, rel=tolerance), quantity


def test_a_part_at_rest_has_no_note_of_its_samples(tmp_path: Path) -> None:
    """Round-off of a static deformation is no vibration that samples miss."""
    force = f'force.f = {{ kind = "force", {TIP}, direction = [0, 0, 1], expression = "10" }}\n'
    probe = f'probe.z = {{ kind = "displacement", {TIP}, direction = [0, 0, 1] }}\n'
    block = """
    component.b.geometry = { kind = "box", lx = 0.1, ly = 0.02, lz = 0.01 }
    component.b.material = { E = 210e9, nu = 0.3, rho = 7850 }
    component.b.mesh.size = 0.01
    component.b.supports = ["left"]
    component.b.interface.tip = { surface = "right", kind = "mean" }
    body.b.component = "b"
    run.duration = 0.01
    """
    report = solved(block + force + probe, tmp_path)
    assert not [note for note in report.notes if "its history is that of samples" in note]


HANGING = BEAM.format(SPACE, "mean").replace("0.025", "0.0625") + """
component.b.interface.root = { surface = "left", kind = "tie", tie = "rbe2" }
component.b.modes.reduction = "row-craig-bampton"
body.b.orientation = { axis = [0, 1, 0], angle = 90 }
joint.j = { kind = "revolute", body = "b", interface = "root", axis = [0, 1, 0] }
run.duration = 2e-3
""" + WEIGHT  # fmt: skip


def test_a_beam_that_hangs_at_rest_has_no_errors_of_motions(tmp_path: Path) -> None:
    """A reduction by name needs no count: few rows have few coordinates. Its rotations are round-off."""
    report = solved(HANGING, tmp_path)
    assert report.quantities["j.force_peak"]["value"] == pytest.approx(RHO * AREA * L * G0, rel=1e-3)
    alarms = {name: error for name, error in report.estimates.items() if error > 0.1}
    assert not alarms
