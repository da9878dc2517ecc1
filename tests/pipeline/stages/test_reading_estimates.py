"""Estimated errors of what probes, joints and gauges read where nothing touches, against exact answers."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.run import run_job

WIRE = """
component.b.geometry.kind = "beam"
component.b.geometry.length = 1.0
component.b.geometry.motion = "space"
component.b.geometry.section = { kind = "rectangle", width = 0.0025, height = 0.0025 }
component.b.material = { E = 210e9, nu = 0.3, rho = 7850 }
component.b.mesh.size = 0.04
component.b.supports = ["left"]
component.b.modes.normal_count = 8
component.b.interface.tip = { surface = "right", kind = "mean" }
body.b = { }
probe.t = { kind = "displacement", body = "b", interface = "tip", direction = [1, 0, 0] }
run = { duration = 1e-3, start = "undeformed" }
"""
"""A clamped steel wire; modes bend it."""
SUDDEN = """
force.f = { kind = "force", body = "b", interface = "tip", direction = [1, 0, 0], expression = "100" }
probe.r = { kind = "force", of = "body.b" }
"""
SPRUNG = """
force.f = { kind = "spring", body = "b", interface = "tip", direction = [1, 0, 0], stiffness = 1e6, preload = 100 }
"""
TWISTED = """
component.b.interface.end = { surface = "right", kind = "tie", tie = "rbe2" }
force.f = { kind = "wrench", body = "b", interface = "end", force = [0, 0, 0], moment = [0.01, 0, 0] }
probe.turn = { kind = "rotation", body = "b", interface = "end", direction = [1, 0, 0] }
"""
STATIC = 100 / (210e9 * 0.0025**2)
"""Of the wire under 100 N [m]."""
HALF = 2.0 / (210e9 / 7850) ** 0.5
"""Half a period of its axial motion [s]."""
CUBE = """
component.b.geometry = { kind = "box", lx = 0.05, ly = 0.05, lz = 0.05, patch = [0.01, 0.01] }
component.b.material = { E = 210e9, nu = 0.3, rho = 7850 }
component.b.mesh.size = 0.0125
component.b.supports = ["bottom"]
component.b.interface.p = { surface = "patch", kind = "mean" }
component.b.modes = { normal_count = 5 }
body.b = { }
force.f = { kind = "force", body = "b", interface = "p", direction = [0, 0, -1], expression = "1000" }
probe.d = { kind = "displacement", body = "b", interface = "p", direction = [0, 0, 1] }
run = { duration = 1e-4 }
"""
PATCH = 402e-9
"""Its mean displacement [m], of 27-node hexahedra graded towards the patch's edge, 59 160 dofs."""
SPRUNG_MASS = """
component.p.geometry = { kind = "rigid", mass = 1.0, inertia = [0.01, 0.01, 0.01] }
body.p = { freedom = ["z"], velocity = [0, 0, 1.0] }
force.s = { kind = "spring", body = "p", direction = [0, 0, 1], stiffness = 394784.176 }
force.h = { kind = "force", body = "p", at = [0, 0, 0], direction = [0, 0, 1], expression = "0" }
probe.d = { kind = "displacement", body = "p", direction = [0, 0, 1] }
run.duration = 0.1
"""
ROD = """
component.p.geometry = { kind = "cylinder", radius = 0.01, length = 0.1 }
component.p.mesh.size = 0.01
component.p.material = { E = 210e9, nu = 0.3, rho = 7850 }
component.p.supports = ["bottom"]
component.p.interface.top = { surface = "top", kind = "mean" }
component.p.modes = { normal_count = 8 }
component.p.change = { update = "reuse", profile = { surface = "side", offset = 2e-4 } }
body.p = { }
force.f = { kind = "force", body = "p", interface = "top", direction = [1, 0, 0], expression = "100" }
probe.t = { kind = "displacement", body = "p", interface = "top", direction = [1, 0, 0] }
run = { duration = 1e-4 }
"""


def solved(folder: Path, scene: str, **changes: Any) -> Trajectory:
    (folder / "scene.toml").write_text(scene)
    settings = {key.replace("__", "."): value for key, value in changes.items()}
    job = open_job(folder, set=settings, db=folder / "db", out=folder / "out")
    run_job(job, "solve")
    return job.store.get(job.trajectory().key, "trajectory")


def test_a_wire_that_is_pulled_suddenly_has_waves_that_bending_modes_lack(tmp_path: Path) -> None:
    """Its tip moves to twice the static displacement and back at constant speed, one static shape as a cosine.
    Its wall bears none of the force and twice the force in turn."""
    found = solved(tmp_path, WIRE + SUDDEN)
    assert found.quantities["t.displacement_peak"]["value"] == pytest.approx(2 * STATIC, rel=0.01)
    times, rise = found.times, 2 * STATIC * found.times / HALF
    exact = np.where(times % (2 * HALF) < HALF, rise % (2 * STATIC), 2 * STATIC - rise % (2 * STATIC))
    true = np.abs(found.probes["t"].values[:, 0] - exact).max() / (2 * STATIC)
    assert true > 0.05
    assert 0.5 * true < found.estimates["basis.t.displacement"] < 20 * true
    assert found.estimates["basis.r.force"] > 0.25
    assert "basis.impulse" not in found.estimates


def test_what_is_slow_or_at_rest_has_no_error_of_the_basis(tmp_path: Path) -> None:
    """Against the first period of the wire's axial motion, 0.77 ms, a load at rest and one over 0.1 s are slow."""
    rest = solved(tmp_path, WIRE + SUDDEN, run__start="rest")
    assert rest.estimates["basis.t.displacement"] < 1e-9
    slow = solved(tmp_path, WIRE + SUDDEN.replace('"100"', '"1000*t"'), run__duration=0.1)
    assert slow.estimates["basis.t.displacement"] < 0.02


@pytest.mark.parametrize(("scene", "name"), [(SPRUNG, "t.displacement"), (TWISTED, "turn.rotation")])
def test_springs_and_moments_act_on_bodies_as_forces_do(tmp_path: Path, scene: str, name: str) -> None:
    found = solved(tmp_path, WIRE + scene, body__b__geometric_stiffness=False)  # Its spring presses the wire.
    assert found.estimates[f"basis.{name}"] > 0.25


def test_without_residual_flexibility_a_tie_has_its_static_answer(tmp_path: Path) -> None:
    """A shape of the tie is none of the wire's modes: at rest it is exact, in waves it is not."""
    pulled = TWISTED.replace("force = [0, 0, 0], moment = [0.01, 0, 0]", "force = [100, 0, 0], moment = [0, 0, 0]")
    pulled = pulled.replace(
        "probe.turn", 'probe.e = { kind = "displacement", body = "b", interface = "end" }\nprobe.turn'
    )
    found = solved(tmp_path, WIRE + pulled, component__b__modes__reduction="normal+static", run__start="rest")
    assert np.linalg.norm(found.probes["e"].values[-1]) == pytest.approx(STATIC, rel=1e-6)
    assert found.estimates["basis.e.displacement"] < 1e-9
    sudden = solved(tmp_path, WIRE + pulled, component__b__modes__reduction="normal+static")
    assert sudden.estimates["basis.e.displacement"] > 0.1


def test_the_mesh_error_of_a_load_is_that_of_its_compliance(tmp_path: Path) -> None:
    """The modes have hardly a share in it."""
    found = solved(tmp_path, CUBE)
    true = abs(found.quantities["d.displacement_end"]["value"]) / PATCH - 1
    assert true < -0.05
    assert 0.5 * abs(true) < found.estimates["mesh.d.displacement"] < 20 * abs(true)


def test_reused_modes_are_judged_by_the_compliance_to_loads(tmp_path: Path) -> None:
    """A radius of 2 % more is 8 % less compliance to a force across, and 2 % more in frequency."""
    with pytest.raises(InputError, match=r"compliance by up to -[78]\.\d+% \(interface 'top'\)"):
        solved(tmp_path, ROD)


@pytest.mark.parametrize("step", [None, 1e-5])
def test_the_error_of_steps_is_no_matter_of_samples(tmp_path: Path, step: float | None) -> None:
    """A mass on a spring of 100 Hz, all samples and frames of which are at zeros of its motion."""
    given = {} if step is None else {"run__step": step}
    few, many = (
        solved(tmp_path, SPRUNG_MASS, run__samples=samples, run__frames=frames, **given)
        for samples, frames in ((10, 2), (4000, 200))
    )
    assert few.result == many.result == "FINISHED"
    assert len(few.times) == 10
    assert few.estimates["step.motion"] == pytest.approx(many.estimates["step.motion"], rel=0.5)
