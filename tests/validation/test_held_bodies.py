"""Bodies that fixed joints hold on the ground, in small motion: against mechanisms, supports and closed forms."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon import modaldb
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.reduction.expansion import displacement
from gudgeon.pipeline.stages.plan import plan
from gudgeon.solver.system.compile import compile_system
from gudgeon.solver.system.gauges import gauge_loads
from gudgeon.solver.system.system import System

LENGTH, SIDE, DENSITY, MODULUS = 0.5, 0.03, 7800.0, 2.1e11
MASS = DENSITY * LENGTH * SIDE**2
TIE = {"kind": "tie", "tie": "rbe2"}
SCENE = """
[component.bar]
geometry = { kind = "box", lx = 0.03, ly = 0.03, lz = 0.5 }
material = { E = 2.1e11, nu = 0.3, rho = 7800.0 }
mesh = { size = 0.03 }
interface.end = { surface = "top", kind = "tie", tie = "rbe2" }
gauge.root = { point = [0.015, 0.0, 0.1], quantity = "strain", direction = [0.0, 0.0, 1.0] }
modes = { reduction = "row-craig-bampton", normal_count = 0, fixed_count = 12 }

[body.bar]
gauges = ["root"]

[force.pull]
kind = "wrench"
body = "bar"
interface = "end"
force = [1.0, 0.5, 0.2]
moment = [0.0, 0.0, 0.02]
expression = "100*sin(2000*t)**2"

[probe.tip]
kind = "displacement"
body = "bar"
interface = "end"

[run]
duration = 0.01
samples = 200
frames = 10
"""
CLAMPED: dict[str, Any] = {
    "component.bar.interface.foot": {"surface": "bottom"} | TIE,
    "joint.clamp": {"kind": "fixed", "body": "bar", "interface": "foot"},
    "probe.reaction": {"kind": "force", "of": "joint.clamp"},
}
SUPPORTED: dict[str, Any] = {"component.bar.supports": [{"surface": "bottom"}]}
WHOLE: dict[str, Any] = {"probe.whole": {"kind": "force", "of": "body.bar"}}
BOTH: dict[str, Any] = CLAMPED | {"joint.top": {"kind": "fixed", "body": "bar", "interface": "end"}}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("held")


def solved(folder: Path, name: str, changes: dict[str, Any]) -> Trajectory:
    path = folder / f"{name}.toml"
    path.write_text(SCENE)
    report = run(path, set=changes, db=folder / "db", out=folder / name, until="solve")
    assert report.result == "FINISHED"
    found: Trajectory = modaldb.open(folder / "db").get(report.stages["solve"].key, "trajectory")
    return found


def compiled(folder: Path, name: str, changes: dict[str, Any]) -> System:
    path = folder / f"{name}.toml"
    path.write_text(SCENE)
    run(path, set=changes, db=folder / "db", out=folder / name, until="morph")
    job = open_job(path, set=changes, db=folder / "db", out=folder / name)
    return compile_system(modaldb.open(folder / "db"), job.scene, job.morphs())


def test_it_runs_in_small_motion_as_the_mechanism_moves(folder: Path) -> None:
    """Second-order terms are those of a slope of 1e-4; forces have the ringing of the stiffest shapes; of strain the
    modes lack 2 %, which follow the loads here, and loads and reactions there."""
    small = solved(folder, "small", CLAMPED | {"run.step": 1e-6})
    turning = solved(folder, "turning", CLAMPED | {"run.integrator": "turning", "run.accuracy": 1e-8})
    assert small.counts["integrator"] == "small"
    assert turning.counts["integrator"] == "turning"
    for name, bound in (("tip", 1e-3), ("reaction", 1e-2)):
        one, other = (found.probes[name].values for found in (small, turning))
        assert small.probes[name].columns == turning.probes[name].columns
        size = np.abs(other[:, :3]).max()
        np.testing.assert_allclose(one[:, :3], other[:, :3], atol=bound * size)
    one, other = (found.probes["reaction"].values[:, 3:] for found in (small, turning))
    np.testing.assert_allclose(one, other, atol=1e-2 * np.abs(other).max())
    np.testing.assert_allclose(small.gauges["bar.root"], turning.gauges["bar.root"],
                               atol=0.03 * np.abs(turning.gauges["bar.root"]).max())  # fmt: skip
    for key in ("force_peak", "moment_peak"):
        own, other_one = (found.quantities[f"clamp.{key}"]["value"] for found in (small, turning))
        assert own == pytest.approx(other_one, rel=1e-2)


@pytest.mark.parametrize(
    ("more", "bound"),
    [({}, 1e-5), ({"run.gravity": [1.0, 2.0, -9.81]}, 2e-3), ({"body.bar.damping": {"ratio": 0.02}}, 1e-5)],
)
def test_it_moves_as_on_supports(more: dict[str, Any], bound: float, folder: Path) -> None:
    """Shapes with held rows make the basis of Craig and Bampton: but for a shape of the weight both bases are equal."""
    name = "-".join(more).replace(".", "-") or "plain"
    held, supported = (solved(folder, f"{name}-{kind}", more | {"run.step": 2e-6} | WHOLE | changes)
                       for kind, changes in (("held", CLAMPED), ("supported", SUPPORTED)))  # fmt: skip
    for key in ("tip", "whole"):
        one, other = (found.probes[key].values for found in (held, supported))
        np.testing.assert_allclose(one, other, atol=bound * np.abs(other).max())
    one, other = (found.gauges["bar.root"] for found in (held, supported))
    np.testing.assert_allclose(one, other, atol=bound * np.abs(other).max())
    np.testing.assert_allclose(held.energies, supported.energies, atol=bound * np.abs(supported.energies).max())


def test_joints_bear_the_change_of_momentum(folder: Path) -> None:
    """At any state and load, a joint's force is the rate of the momentum Tᵀ M ẋ less load and weight, damped or not."""
    damped = {"body.bar.damping": {"alpha": 50.0, "beta": 1e-6}, "run.gravity": [1.0, 2.0, -9.81]}
    system, random = compiled(folder, "momentum", CLAMPED | damped), np.random.default_rng(1)
    body, driving = system.bodies["bar"], system.driving
    q, v, loads = (random.standard_normal(k) for k in (len(system.stiffness), len(system.stiffness), 6))
    q, v, loads = q / system.stiffness, v / np.sqrt(system.stiffness), 100 * loads
    found = system.gauged(q[None], v[None])[0] + gauge_loads(system.bodies, driving.places(), 6) @ loads
    own = [number for number, name in enumerate(system.gauges) if name == "bar.joint.clamp"]
    rates = driving.rows.T @ loads + driving.gravity - system.stiffness * q - system.damping * v
    (pull, _) = next(driving.given_rows())
    forces = loads @ pull.resultant[:, :3] + MASS * np.array([1.0, 2.0, -9.81])
    assert body.modal.participation is not None
    np.testing.assert_allclose(found[own[:3]], body.modal.participation @ rates - forces, rtol=1e-6)


def test_pictures_show_all_of_its_displacement(folder: Path) -> None:
    """Of a free body they leave the rigid part out; this one moves by deformation alone, and its foot stays."""
    path = folder / "drawn.toml"
    path.write_text(SCENE)
    report = run(path, set=CLAMPED | {"run.step": 1e-6}, until="solve", db=folder / "db", out=folder / "drawn")
    key = report.stages["solve"].key
    drawing = Drawing(modaldb.open(folder / "db"), key, "drawn", folder, folder, print)
    body = drawing.body("bar")
    moved = np.linalg.norm(body.elastic(5), axis=1)
    foot = body.nodes[:, 2] < 1e-9
    assert moved[foot].max() < 1e-9 * moved.max()
    assert not body.rigid(5).any()


def test_frames_are_over_the_coordinates_of_records(folder: Path) -> None:
    """Pictures and exports read them with the shapes of the free body, its rigid motions included."""
    found, store = solved(folder, "frames", CLAMPED | {"run.step": 1e-6}), modaldb.open(folder / "db")
    morph = store.get(found.bodies["bar"], "morph")
    modal = store.get(morph.modes_key, "modes")
    assert found.frames.shape == (10, 6 + len(modal.angular_frequencies))
    moved = displacement(store.get(morph.mesh_key, "mesh").nodes, morph, modal, found.frames[-1])
    nodes = store.get(morph.mesh_key, "mesh").nodes
    foot, end = np.isclose(nodes[:, 2], 0.0), np.isclose(nodes[:, 2], LENGTH)
    size = np.abs(moved).max()
    np.testing.assert_allclose(moved[foot], 0.0, atol=1e-9 * size)
    np.testing.assert_allclose(moved[end].mean(axis=0), found.probes["tip"].values[-1], atol=1e-2 * size)


def test_a_turned_body_moves_with_its_axes(folder: Path) -> None:
    turned = {"body.bar.orientation": {"axis": [0.0, 1.0, 0.0], "angle": 90.0}}
    pull = {"force.pull.force": [0.2, 0.5, -1.0], "force.pull.moment": [0.02, 0.0, 0.0]}
    plain, other = solved(folder, "upright", CLAMPED), solved(folder, "turned", CLAMPED | turned | pull)
    for key in ("tip", "reaction"):
        one, two = plain.probes[key].values, other.probes[key].values
        for here in range(0, one.shape[1], 3):
            expected = one[:, [here + 2, here + 1, here]] * [1.0, 1.0, -1.0]
            np.testing.assert_allclose(two[:, here : here + 3], expected, atol=1e-6 * np.abs(one).max())


def test_modes_are_those_on_supports(folder: Path) -> None:
    """Of bases with all rows held, which are one space; low frequencies keep their digits beside the highest."""
    held, supported = (np.sort(compiled(folder, f"modes-{name}", changes).stiffness)
                       for name, changes in (("held", CLAMPED), ("supported", SUPPORTED)))  # fmt: skip
    np.testing.assert_allclose(held, supported, rtol=1e-9)
    assert held[-1] > 1e4 * held[0]


def test_statics_are_exact_with_any_modes(folder: Path) -> None:
    """Answers to forces on the end: those of a body on supports, whatever the modes lack of joint or load."""
    end = []
    for name, changes in (("statics-held", CLAMPED), ("statics-supported", SUPPORTED)):
        for modes in ({"fixed_count": 2}, {"reduction": "rubin", "normal_count": 8, "fixed_count": None}):
            body = compiled(folder, f"{name}-{len(end)}", changes | {
                f"component.bar.modes.{key}": value for key, value in modes.items() if value is not None
            }).bodies["bar"]  # fmt: skip
            own = slice(*body.modal.interface_rows["end"])
            rows = body.modal.loads["end"].rows
            assert body.rigid_count == 0
            assert body.modal.residual_flexibility is not None
            end.append((rows / body.stiffness) @ rows.T + body.modal.residual_flexibility[own, own])
    size = np.sqrt(np.outer(end[0].diagonal(), end[0].diagonal()))
    for one in end[1:]:
        np.testing.assert_allclose(one / size, end[0] / size, atol=1e-7)


@pytest.mark.parametrize(("count", "tie"), [(2, "rbe2"), (12, "rbe2"), (6, "rbe3")])
def test_at_rest_the_joint_bears_load_and_weight(count: int, tie: str, folder: Path) -> None:
    """Force and moment at the foot balance the wrench on the end, 0.5 m above, and the weight 0.25 m above."""
    force, moment, g = np.array([30.0, -20.0, 10.0]), np.array([1.0, 2.0, 3.0]), np.array([1.0, 2.0, -9.81])
    found = solved(folder, f"rest-{count}", CLAMPED | {
        "component.bar.interface.foot.tie": tie,
        "force.pull.force": force.tolist(), "force.pull.moment": moment.tolist(), "force.pull.expression": "1",
        "run.gravity": g.tolist(), "component.bar.modes.fixed_count": count,
    })  # fmt: skip
    up = np.array([0.0, 0.0, LENGTH])
    expected = -np.concatenate([force + MASS * g, moment + np.cross(up, force) + np.cross(up / 2, MASS * g)])
    values = found.probes["reaction"].values
    np.testing.assert_allclose(values, np.tile(expected, (len(values), 1)), rtol=1e-6, atol=1e-6)


def test_joints_at_both_ends_share_a_load(folder: Path) -> None:
    """Gravity along the bar and across: each end bears one half but for the mesh, with the moments of a beam that is
    clamped twice. The same interface held twice changes nothing but that both joints bear one half of it."""
    changes = {key: value for key, value in BOTH.items() if key != "probe.reaction"} | {
        "run.gravity": [9.0, 0.0, -3.0], "force.pull": "unset", "probe.tip": "unset",
        "probe.low": {"kind": "force", "of": "joint.clamp"}, "probe.high": {"kind": "force", "of": "joint.top"},
    }  # fmt: skip
    found = solved(folder, "both", changes)
    low, high = found.probes["low"].values[-1], found.probes["high"].values[-1]
    expected = -MASS * np.array([9.0, 0.0, -3.0]) / 2
    np.testing.assert_allclose(low[:3] + high[:3], 2 * expected, atol=1e-9 * MASS * 9)
    np.testing.assert_allclose(low[:3], expected, atol=1e-3 * MASS * 9)
    assert low[4] == pytest.approx(-MASS * 9.0 * LENGTH / 12, rel=2e-2)
    twin = solved(folder, "twin", changes | {"joint.twin": {"kind": "fixed", "body": "bar", "interface": "foot"}})
    np.testing.assert_allclose(twin.probes["low"].values[-1], low / 2, atol=1e-6 * MASS * 9)
    np.testing.assert_allclose(twin.probes["high"].values[-1], high, atol=1e-6 * MASS * 9)


def test_a_contact_presses_as_on_supports(folder: Path) -> None:
    """A load draws the end of the bar, which is rigid by its tie, onto a layer; its checks run with fewer modes."""
    more = {
        "force.pull.force": [0.0, 0.0, 3000.0], "force.pull.moment": [0.0, 0.0, 0.0],
        "force.pull.expression": "min(t/0.001, 1)", "run.duration": 0.002,
        "component.bar.interface.face": {"surface": "top"},
        "contact.wall": {"body": "bar", "interface": "face", "surface_stiffness": 1e12,
                         "against": {"shape": "plane", "point": [0.0, 0.0, 0.500002], "normal": [0.0, 0.0, -1.0]}},
    }  # fmt: skip
    held, supported = (solved(folder, f"wall-{kind}", more | changes)
                       for kind, changes in (("held", CLAMPED), ("supported", SUPPORTED)))  # fmt: skip
    one, other = (found.contacts["wall"].force[:, 2] for found in (held, supported))
    assert np.abs(other).max() > 10.0
    np.testing.assert_allclose(one, other, atol=1e-3 * np.abs(other).max())
    assert held.quantities["wall.impulse"]["value"] == pytest.approx(supported.quantities["wall.impulse"]["value"],
                                                                    rel=1e-4)  # fmt: skip


STRUCK: dict[str, Any] = {
    "component.bar.interface.face": {"surface": "top"},
    "component.block": {
        "geometry": {"kind": "box", "lx": 0.03, "ly": 0.03, "lz": 0.1}, "mesh": {"size": 0.03},
        "material": {"E": 2.1e11, "nu": 0.3, "rho": 7800.0}, "interface": {"low": {"surface": "bottom"}},
        "modes": {"normal_count": 8},
    },
    "body.block": {"position": [0.0, 0.0, 0.500001], "velocity": [0.02, 0.0, -0.5]},
    "run.duration": 4e-4,
}  # fmt: skip
HIT = {"body": "block", "interface": "low", "against": {"shape": "body", "body": "bar", "interface": "face"}}
STEP = 5e-7
STRIKES: dict[str, dict[str, Any]] = {
    "small": {"surface_stiffness": 1e13, "friction": {"static": 0.2}},
    "event": {"method": "penalty", "law": {"kind": "linear", "stiffness": 1e8}},
}


@pytest.mark.parametrize("integrator", STRIKES)
def test_a_block_strikes_it_as_on_supports(integrator: str, folder: Path) -> None:
    """By every integrator, with the same estimates of basis, mesh and layer; the joint bears what supports bear."""
    path = folder / f"{integrator}.toml"
    path.write_text(SCENE[: SCENE.index("[force.pull]")] + SCENE[SCENE.index("[run]") :])
    more = STRUCK | {"contact.hit": HIT | STRIKES[integrator], "run.integrator": integrator}
    if integrator == "small":
        more |= {"run.step": STEP}  # A search for one may end at another by round-off.
    found = []
    for name, changes in (("held", CLAMPED), ("supported", SUPPORTED)):
        own = {key: value for key, value in (more | changes).items() if key != "probe.reaction"}
        report = run(path, set=own, db=folder / "db", out=folder / f"{integrator}-{name}", until="solve")
        found.append(modaldb.open(folder / "db").get(report.stages["solve"].key, "trajectory"))
    held, supported = found
    forces = [one.contacts["hit"].force for one in found]
    assert np.abs(forces[1]).max() > 1e3
    np.testing.assert_allclose(*forces, atol=1e-7 * np.abs(forces[1]).max())
    assert supported.estimates == pytest.approx(
        {name: error for name, error in held.estimates.items() if ".clamp." not in name}, rel=1e-3, abs=1e-7
    )
    assert {"basis.clamp.force", "mesh.clamp.force"} <= set(held.estimates)
    assert held.quantities["clamp.force_peak"]["value"] > 1e3
    np.testing.assert_allclose(held.gauges["bar.root"], supported.gauges["bar.root"],
                               atol=1e-7 * np.abs(supported.gauges["bar.root"]).max())  # fmt: skip


def test_plans_say_what_decided(folder: Path) -> None:
    (folder / "plan.toml").write_text(SCENE)

    def planned(changes: dict[str, Any]) -> dict[str, Any]:
        return plan(open_job(folder / "plan.toml", set=changes, db=folder / "db", out=folder / "plan"))

    found = planned(CLAMPED)
    assert found["integrator"] == "small"
    assert found["turning"].startswith("small motion: joint 'clamp' holds what deforms on the ground")
    assert [(row["kind"], row["number"], row["rows"]) for row in found["ports"] if row["member"] == "joint.clamp"] == [
        ("bilateral", 6, "constant")
    ]
    other = planned(CLAMPED | {"body.bar.geometric_stiffness": True})
    assert other["integrator"] == "turning"
    assert other["turning"] == "any angle: joint 'clamp' of two markers, by body.bar.geometric_stiffness"
    rotation = {"probe.turn": {"kind": "rotation", "body": "bar"}}
    assert planned(CLAMPED | rotation)["integrator"] == "turning"
    assert planned(CLAMPED | {"body.bar.velocity": [0.1, 0.0, 0.0]})["integrator"] == "turning"


def test_modes_without_static_shapes_are_refused(folder: Path) -> None:
    with pytest.raises(InputError, match=r"'macneal' has no static shape of interface 'foot', so that joint\.clamp"):
        compiled(folder, "macneal", CLAMPED | {"component.bar.modes.reduction": "macneal",
                                               "component.bar.modes.normal_count": 5})  # fmt: skip


def test_a_body_without_motion_is_refused(folder: Path) -> None:
    changes = BOTH | {"component.bar.modes.fixed_count": 0, "probe.tip": "unset", "body.bar.gauges": []}
    with pytest.raises((StageError, InputError, Exception), match="all motions of body 'bar' are held"):
        compiled(folder, "still", changes)
