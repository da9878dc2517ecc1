"""The spoked plates of data/base-sensor under unit wrenches against reference J1."""

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon import modaldb
from gudgeon.pipeline.applications.sensing.standing import standing
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.pipeline.linear.analysis import Asked, analyse
from tests.scenes import reference, scene_path

EXPECTED = reference("base-sensor/J1_spoked_plate.json")
ORDER = [f"{side}{spoke}" for spoke in range(4) for side in ("top", "side")]
"""Gauges in the rows of the reference."""


def quiet(*told: Any) -> None:
    """Take progress and say nothing."""


def per_wrench(scene: str, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return strains of the gauges (8, 6) and motions of the hub (6, 6) per unit wrench, from linear-static.csv."""
    job = open_job(scene_path("base-sensor") / scene, db=folder / "db", out=folder / "out")
    analyse(job, Asked(static=True), quiet)
    rows = list(csv.reader((folder / "out" / "linear-static.csv").read_text().splitlines()))
    assert rows[0][2:] == [f"per force.wrench {c} [1/({'N' if c[0] == 'F' else 'N m'})]"
                           for c in ("Fx", "Fy", "Fz", "Mx", "My", "Mz")]  # fmt: skip
    found = {row[0]: np.array(row[2:], float) for row in rows[1:]}
    strains = np.array([found[f"gauge.plate.{name}"] for name in ORDER])
    return strains, np.array([found[f"force.wrench[{n}]"] for n in range(1, 7)])


def within(found: np.ndarray, expected: np.ndarray, share: float) -> None:
    """Compare each column with a share of its largest value."""
    np.testing.assert_array_less(np.abs(found - expected) / np.abs(expected).max(axis=0), share)


def test_spokes_as_beams(tmp_path: Path) -> None:
    """Asked: 1 %; cubic elements are exact under forces at their nodes, so that round-off is left."""
    strains, motions = per_wrench("plate-beams.toml", tmp_path)
    within(strains, np.array(EXPECTED["strain_per_wrench_8x6_euler_bernoulli"]), 1e-9)
    stiffness = np.linalg.inv(motions)
    np.testing.assert_allclose(np.diag(stiffness), np.diag(EXPECTED["hub_stiffness_6x6_euler_bernoulli"]), rtol=1e-9)
    np.testing.assert_allclose(motions, motions.T, atol=1e-12 * np.abs(motions).max())


@pytest.mark.validation
def test_spokes_as_a_solid(tmp_path: Path) -> None:
    """Asked: 1 % of the strains; the reference is sure to 0.4 %. The hub's stiffness by its own tolerance, 1 %."""
    strains, motions = per_wrench("plate.toml", tmp_path)
    expected = np.array(EXPECTED["strain_per_wrench_8x6_solid3D"])
    within(strains, expected, 0.01)
    large = np.abs(expected) > 0.02 * np.abs(expected).max(axis=0)
    assert strains[large] == pytest.approx(expected[large], rel=0.01)
    stiffness = np.diag(np.linalg.inv(motions))
    assert stiffness == pytest.approx(np.diag(EXPECTED["hub_stiffness_6x6_solid3D"]), rel=0.01)


SWINGING = """
[component.block]
geometry = { kind = "rigid", mass = 0.5, inertia = [1e-4, 1e-4, 1e-4] }

[component.arm]
geometry.kind = "beam"
geometry.theory = "euler-bernoulli"
geometry.length = 0.3
geometry.motion = "space"
geometry.section = { kind = "rectangle", width = 0.02, height = 0.006 }
material = { E = 2.1e11, nu = 0.3, rho = 7870.0 }
mesh.size = 0.03
modes = { reduction = "row-craig-bampton", normal_count = 0, fixed_count = 4 }
interface.root = { surface = "left", kind = "tie", tie = "rbe2" }
interface.tip = { surface = "right", kind = "tie", tie = "rbe2" }
gauge.top = { station = "left", fibre = "top", quantity = "strain" }
gauge.side = { station = "left", fibre = "left", quantity = "strain" }

[body.arm]
gauges = ["top", "side"]

[body.block]
position = [0.3, 0.0, 0.0]

[joint.root]
kind = "fixed"
body = "arm"
interface = "root"

[joint.tip]
kind = "fixed"
body = "block"
against = "arm"
against_interface = "tip"

[probe.clamp]
kind = "force"
of = "joint.root"

[run]
duration = 0.04
samples = 400
gravity = [0.0, 3.0, -9.81]
"""


def test_gauges_of_a_body_in_a_mechanism(tmp_path: Path) -> None:
    """At the root the strain is that of the joint's moment, M z / (E I), of bending in both planes, while it swings.

    By four modes to 0.1 % and 0.4 %.
    """
    path = tmp_path / "swinging.toml"
    path.write_text(SWINGING)
    report = run(path, db=tmp_path / "db", out=tmp_path / "out", until="solve")
    found = modaldb.open(tmp_path / "db").get(report.stages["solve"].key, "trajectory")
    moment = found.probes["clamp"].values[:, 3:]
    inertia = 0.02 * 0.006**3 / 12, 0.006 * 0.02**3 / 12
    top = -moment[:, 1] * 0.003 / (2.1e11 * inertia[0])
    side = moment[:, 2] * 0.01 / (2.1e11 * inertia[1])
    assert np.abs(top).max() > 5e-5  # It does not ring.
    for name, expected in (("arm.top", top), ("arm.side", side)):
        np.testing.assert_allclose(found.gauges[name], expected, atol=0.01 * np.abs(expected).max())


@pytest.mark.validation
def test_the_wrench_on_a_tool_is_felt_through_the_base(tmp_path: Path) -> None:
    """By the cells' wrench and exact parameters, with friction, to 0.5 %; with noise better than on a rigid base."""
    scene, set_ = scene_path("base-sensor") / "robot.toml", {"run.duration": 0.35, "run.samples": 1400}
    report = run(scene, set=set_, db=tmp_path / "db", out=tmp_path / "out", until="solve")
    found = modaldb.open(tmp_path / "db").get(report.stages["solve"].key, "trajectory")
    file = open_job(scene, set=set_, db=tmp_path / "db", out=tmp_path / "out").scene
    base, times = standing(file), np.asarray(found.times)
    arm, wrench = base.arm, base.measured(found)
    levels = np.array([0.5, 0.5, 0.5, 0.05, 0.05, 0.05])
    told = {"parameters": arm.chain.parameters(), "gravity": np.array(file.run.gravity)}
    true = arm.touched(found, file, times)
    later = times > 0.05
    inferred = arm.felt(times, wrench, base=base.yields(), levels=1e-3 * levels, **told).contact
    noisy = wrench + levels * np.random.default_rng(5).standard_normal(wrench.shape)
    compensated = arm.felt(times, noisy, base=base.yields(), levels=levels, **told).contact
    rigid = arm.felt(times, noisy, base=None, levels=levels, **told).contact
    for part in (slice(3), slice(3, 6)):
        size = np.linalg.norm(true[:, part], axis=1).max()
        assert size > 10
        error, with_noise, without = (
            np.sqrt((((one - true)[later][:, part]) ** 2).sum(axis=1).mean()) for one in (inferred, compensated, rigid)
        )
        assert error < 5e-3 * size
        assert with_noise < 0.8 * without


def test_arms_that_are_none_are_refused(tmp_path: Path) -> None:
    """A scene that is no chain on bushings is refused by what it lacks."""
    file = open_job(scene_path("four-bar"), db=tmp_path / "db", out=tmp_path / "out").scene
    with pytest.raises(InputError, match=r"joint: an arm needs revolute joints, each with a drive"):
        standing(file)


@pytest.mark.validation
def test_gauges_of_the_plate_feel_the_arm(tmp_path: Path) -> None:
    """The reaction of the joint on the hub against the strains of the plate by its calibration."""
    scene, set_ = (
        scene_path("base-sensor") / "robot-plate.toml",
        {"run.duration": 0.03, "run.samples": 120, "run.frames": 10},
    )
    report = run(scene, set=set_, db=tmp_path / "db", out=tmp_path / "out", until="solve")
    found = modaldb.open(tmp_path / "db").get(report.stages["solve"].key, "trajectory")
    strains = np.column_stack([found.gauges[f"plate.{name}"] for name in ORDER])
    felt = strains @ np.array(EXPECTED["calibration_6x8_euler_bernoulli"]).T
    force = -np.asarray(found.joints["foot"].force)  # That of the joint is on the stand.
    assert np.abs(force[:, 2]).max() > 200
    np.testing.assert_allclose(felt[:, :3], force, atol=0.02 * np.abs(force).max())
