"""Free rotation, order, conservation, scale and interpolation of the integrator of mechanisms."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gudgeon.solver.capabilities import INTEGRATORS
from gudgeon.solver.scene.scene import Scene
from tests.solver.integrators.turning.scenes import DOWN, INERTIA, hinge, solved

SPIN = [0.01, 5.0, 0.02]
"""About the middle axis, which is unstable [rad/s]."""
BODIES: dict[str, Any] = {"part": {"position": [0.3, 0.1, 0]}, "mate": {"position": [0.8, 0.3, 0.1]}}
CHAIN = {
    "one": hinge("spherical", at=[-0.3, -0.1, 0]),
    "two": hinge("revolute", "mate", at=[-0.2, 0, 0], against="part", axis=[0.3, 1, 0]),
}
"""A double pendulum in space."""


def euler(times: np.ndarray) -> np.ndarray:
    """Return the angular velocity in body axes of free rotation [rad/s], (t, 3)."""
    J = np.array(INERTIA)
    found = solve_ivp(lambda t, w: np.cross(J * w, w) / J, (0, times[-1]), SPIN, t_eval=times, method="DOP853",
                      rtol=1e-13, atol=1e-13)  # fmt: skip
    return found.y.T


def test_free_rotation_about_the_middle_axis(tmp_path: Path) -> None:
    body = {"angular_velocity": SPIN, "velocity": [1.0, 0.0, -2.0]}
    found = solved(tmp_path, {"part": body}, {}, run={"duration": 6.0})
    wanted = euler(found.times)
    assert wanted[:, 1].min() < -4  # It turns over.
    assert np.linalg.norm(found.motion["part"][:, 9:], axis=1) == pytest.approx(
        np.linalg.norm(wanted, axis=1), rel=1e-7
    )
    kinetic = found.energies[:, 0]
    np.testing.assert_allclose(kinetic, kinetic[0], rtol=1e-9)
    np.testing.assert_allclose(found.motion["part"][:, :3], found.times[:, None] * [1, 0, -2], atol=1e-12)
    assert found.momentum_residual < 1e-14  # Spin along the scene's axes is a coordinate of the integrator.


def test_order_of_a_given_step(tmp_path: Path) -> None:
    """Of the positions of a double pendulum in space."""
    sizes = np.array([0.06, 0.05, 0.04, 0.03])
    run = {"duration": 1.2, "gravity": DOWN}
    exact = solved(tmp_path / "exact", BODIES, CHAIN, run=run | {"accuracy": 1e-12})
    errors = []
    for size in sizes:
        found = solved(tmp_path / str(size), BODIES, CHAIN, run=run | {"step": size})
        errors.append(np.abs(found.motion["mate"][-1, :6] - exact.motion["mate"][-1, :6]).max())
    assert min(errors) > 1e-12
    assert np.polyfit(np.log(sizes), np.log(errors), 1)[0] == pytest.approx(INTEGRATORS["turning"].order, abs=1.0)


@pytest.mark.parametrize("accuracy", [1e-4, 1e-6, 1e-8, 1e-10])
def test_errors_are_below_what_is_asked(accuracy: float, tmp_path: Path) -> None:
    run = {"duration": 3.0, "gravity": DOWN}
    exact = solved(tmp_path / "exact", BODIES, CHAIN, run=run | {"accuracy": 1e-12})
    found = solved(tmp_path / "own", BODIES, CHAIN, run=run | {"accuracy": accuracy})
    assert np.abs(found.motion["mate"][:, :6] - exact.motion["mate"][:, :6]).max() < accuracy
    assert found.energy_drift < accuracy


def test_samples_do_not_change_the_motion(tmp_path: Path) -> None:
    """States between steps are interpolated: a run with few samples takes the same steps."""
    run = {"duration": 2.0, "gravity": DOWN}
    few = solved(tmp_path / "few", BODIES, CHAIN, run=run | {"samples": 10})
    many = solved(tmp_path / "many", BODIES, CHAIN, run=run | {"samples": 1000})
    assert few.counts["steps_taken"] == many.counts["steps_taken"] < 200
    np.testing.assert_allclose(few.motion["mate"], many.motion["mate"][99::100], rtol=0, atol=1e-12)
    exact = solved(tmp_path / "exact", BODIES, CHAIN, run=run | {"samples": 1000, "accuracy": 1e-12})
    assert np.abs(many.motion["mate"][:, :3] - exact.motion["mate"][:, :3]).max() < 1e-8


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_lengths_do_not_matter(size: float, tmp_path: Path) -> None:
    """With all lengths times k and times √k, angles are the same to round-off of the steps."""
    scaled = {
        name: {"position": (size * np.array(body["position"])).tolist(),
               "inertia": tuple(size**2 * one for one in INERTIA)}
        for name, body in BODIES.items()
    }  # fmt: skip
    joints = {name: one | {"at": (size * np.array(one["at"])).tolist()} for name, one in CHAIN.items()}
    own = solved(tmp_path / "own", BODIES, CHAIN, run={"duration": 1.0, "gravity": DOWN})
    other = solved(tmp_path / "other", scaled, joints, run={"duration": 1.0 * np.sqrt(size), "gravity": DOWN})
    np.testing.assert_allclose(other.joints["two"].angle, own.joints["two"].angle, atol=1e-9)
    np.testing.assert_allclose(other.joints["two"].force, own.joints["two"].force, rtol=1e-6, atol=1e-7)


def test_probes_read_turning_points(tmp_path: Path) -> None:
    """A body that turns steadily: places, velocities and accelerations of a point at 0.5 m."""
    w = 3.0
    probe = {
        "place": {"kind": "displacement", "body": "part", "at": [0.5, 0, 0]},
        "speed": {"kind": "velocity", "body": "part", "at": [0.5, 0, 0]},
        "pull": {"kind": "acceleration", "body": "part", "at": [0.5, 0, 0], "direction": [1, 0, 0]},
        "turn": {"kind": "rotation", "body": "part", "direction": [0, 0, 2]},
        "apart": {"kind": "distance", "body": "part", "at": [0.5, 0, 0], "against": "mate"},
    }
    bodies = {"part": {"angular_velocity": [0, 0, w]}, "mate": {"position": [2.0, 0, 0]}}
    joints = {"pin": hinge("revolute"), "base": hinge("fixed", "mate")}
    found = solved(tmp_path, bodies, joints, probe=probe, run={"duration": 3.0})
    t, read = found.times, {name: one.values for name, one in found.probes.items()}
    circle = 0.5 * np.column_stack([np.cos(w * t), np.sin(w * t), 0 * t])
    np.testing.assert_allclose(read["place"], circle - [0.5, 0, 0], atol=1e-8)
    np.testing.assert_allclose(read["speed"], w * np.column_stack([-circle[:, 1], circle[:, 0], 0 * t]), atol=1e-8)
    ends = np.append(0.0, t)
    np.testing.assert_allclose(read["pull"][:, 0], np.diff(-0.5 * w * np.sin(w * ends)) / t[0], atol=1e-6)
    np.testing.assert_allclose(read["turn"][:, 0], w * t, rtol=1e-8)
    assert w * t[-1] > 2 * np.pi
    np.testing.assert_allclose(read["apart"][:, 0], np.linalg.norm(circle - [2, 0, 0], axis=1), atol=1e-8)
    quantities = {name: entry["value"] for name, entry in found.quantities.items()}
    assert quantities["place.displacement_end"] == pytest.approx(abs(np.sin(0.5 * w * t[-1])), abs=1e-8)
    assert quantities["turn.rotation_end"] == pytest.approx(w * t[-1], rel=1e-8)
    assert quantities["apart.distance_peak"] == read["apart"].max()


@pytest.mark.parametrize(("spin", "far"), [(2.0, True), (0.01, False)])
def test_a_free_body_that_turns_far_is_taken(spin: float, far: bool) -> None:
    scene = {"body": {"part": {"angular_velocity": [0, spin, 0]}}, "run": {"duration": 1.0}}
    assert (Scene.model_validate(scene).integrator == "turning") is far


@pytest.mark.parametrize(
    "force",
    [
        {"kind": "force", "at": [0, 0, 0.1], "direction": [0, 0, 1], "expression": "1"},
        {"kind": "wrench", "interface": "tip", "force": [0, 0, 1], "moment": [0, 0, 0], "expression": "1"},
        {"kind": "spring", "stiffness": 1.0},
    ],
    ids=lambda one: one["kind"],
)
def test_a_free_body_under_a_load_that_turns_far_is_taken(force: dict[str, Any]) -> None:
    scene = {
        "body": {"part": {"angular_velocity": [0, 2.0, 0]}}, "force": {"one": force | {"body": "part"}},
        "run": {"duration": 1.0},
    }  # fmt: skip
    assert Scene.model_validate(scene).integrator == "turning"


LAW = {"method": "penalty", "law": {"kind": "linear", "stiffness": 1e6}}
TURNS = r" \(joint\.pin\.kind is 'revolute', so bodies turn by any angle: integrator 'turning'\)"
NO_DASHPOT = r"contact\.floor\.dashpot: 'wave-guide' given; 'none' is allowed there"
NO_EDGES = r"contact\.floor\.against\.edges: given; planes there have none"
EDGED = {
    "shape": "plane",
    "point": [0, 0, 0],
    "normal": [0, 0, 1],
    "edges": [{"point": [0, 0, 0], "normal": [1, 0, 0]}],
}


@pytest.mark.parametrize("integrator", ["auto", "turning"])
@pytest.mark.parametrize(
    ("contact", "text"),
    [
        ({"dashpot": "wave-guide"}, NO_DASHPOT + TURNS),
        (LAW | {"against": EDGED}, NO_EDGES + TURNS),
        ({"dashpot": "wave-guide", "against": EDGED}, NO_EDGES + "; " + NO_DASHPOT + TURNS),
        (
            {"method": "impact", "restitution": 0.5},
            r"contact\.floor\.method: 'impact' given; contact there has method 'residual', or 'penalty' with a law of"
            + " kind [^;]*"
            + TURNS,
        ),
    ],
    ids=["dashpot", "edges", "both", "impact"],
)
def test_what_a_contact_of_a_mechanism_lacks_is_named(integrator: str, contact: dict[str, Any], text: str) -> None:
    """That key alone, with what is allowed: neither the joints nor what is carried."""
    plane = {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}
    scene = {
        "body": {"part": {"damping": {"ratio": 0.01}}}, "joint": {"pin": hinge("revolute"), "axle": hinge("spherical")},
        "contact": {"floor": {"body": "part", "interface": "foot", "against": plane} | contact},
        "run": {"duration": 1.0, "gravity": DOWN, "integrator": integrator},
    }  # fmt: skip
    with pytest.raises(ValueError, match=rf"Value error, {text} \["):
        Scene.model_validate(scene)


@pytest.mark.parametrize(
    ("elements", "text"),
    [
        (
            {"force": {"gas": {"kind": "pressure", "body": "part", "interface": "crown", "expression": "1"}}},
            r"force\.gas\.kind: 'pressure' given; forces there are of kind force, torque, wrench, spring, bushing; a"
            " force over time has the resultant",
        ),
        (
            {"force": {"line": {"kind": "spring", "body": "part", "direction": [0, 0, 1], "stiffness": 5.0}}},
            r"force\.line\.direction: given; springs there have a stiffness, along the line between their points",
        ),
        (
            {"motion": {"up": {"kind": "translation", "body": "part", "direction": [0, 0, 1],
                               "expression": "0"}}},
            r"motion\.up: given; a joint of kind 'driven' moves bodies there",
        ),
    ],
    ids=["pressure", "spring", "motion"],
)  # fmt: skip
def test_elements_that_a_mechanism_does_not_carry_are_named_alone(elements: dict[str, Any], text: str) -> None:
    scene = {
        "body": {"part": {"damping": {"ratio": 0.01}}}, "joint": {"pin": hinge("revolute")},
        "run": {"duration": 1.0, "gravity": DOWN},
    } | elements  # fmt: skip
    with pytest.raises(ValueError, match=rf"Value error, {text}{TURNS} \["):
        Scene.model_validate(scene)


@pytest.mark.parametrize(
    ("probe", "text"),
    [
        ({"kind": "force", "of": "contact.floor"}, r"probe\.p\.of: 'contact\.floor' given; a scene of integrator"),
        ({"kind": "centre", "of": "contact.floor"}, r"probe\.p\.of: 'contact\.floor' given; a scene of integrator"),
        ({"kind": "force", "of": "body.part"}, r"probe\.p\.of: 'body\.part' given; .* reads forces of joints, springs"),
        ({"kind": "rotation", "body": "part", "interface": "foot"}, r"probe\.p\.interface: given; .* leave it out"),
    ],
    ids=["force", "centre", "reaction", "rotation"],
)
def test_probes_of_what_a_mechanism_does_not_have_are_refused_with_the_scene(probe: dict[str, Any], text: str) -> None:
    """Before any mesh and any modes are made."""
    plane = {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}
    scene = {
        "body": {"part": {}}, "joint": {"pin": hinge("revolute")}, "run": {"duration": 1.0}, "probe": {"p": probe},
        "contact": {"floor": {"body": "part", "interface": "foot", "against": plane} | LAW},
    }  # fmt: skip
    with pytest.raises(ValueError, match=text):
        Scene.model_validate(scene)
    Scene.model_validate(scene | {"probe": {"p": {"kind": "force", "of": "joint.pin"}}})


def test_a_conflict_names_the_elements_that_rule_each_other_out() -> None:
    scene = {
        "body": {"part": {"damping": {"ratio": 0.01}}}, "run": {"duration": 1.0, "gravity": DOWN},
        "contact": {"floor": {"body": "part", "interface": "foot", "against": EDGED,
                              "friction": {"static": 0.3, "speed": 1e-3}}},
    }  # fmt: skip
    text = (
        r"no integrator supports the friction of contact\.floor with friction\.speed together with the edges of"
        r" contact\.floor; remove one of them \["
    )
    with pytest.raises(ValueError, match=text):
        Scene.model_validate(scene)


def test_a_named_integrator_that_makes_a_mechanism_is_not_said_to_be_the_only_way() -> None:
    """A spring along a direction and a bushing: others carry both."""
    scene = {
        "body": {"part": {}}, "run": {"duration": 1.0, "integrator": "turning"},
        "force": {
            "line": {"kind": "spring", "body": "part", "direction": [0, 0, 1], "stiffness": 5.0},
            "bush": {"kind": "bushing", "body": "part", "stiffness": [1.0, 1.0, 3.0]},
        },
    }  # fmt: skip
    with pytest.raises(ValueError, match=r"force\.line, which may be left out; use 'auto' or 'event'"):
        Scene.model_validate(scene).integrator  # noqa: B018


@pytest.mark.parametrize("spin", [0.0, 3.0])
def test_momentum_is_judged_where_it_cancels(spin: float, tmp_path: Path) -> None:
    """A body that hangs at rest, and one that turns about its centre: joints push back what gravity pushes."""
    body = {"position": [0.0, 0.0, -0.2 if spin == 0.0 else 0.0], "angular_velocity": [0.0, 0.0, spin]}
    pin = hinge("spherical" if spin == 0.0 else "revolute", at=[0.0, 0.0, 0.2 if spin == 0.0 else 0.0])
    found = solved(tmp_path, {"part": body}, {"pin": pin}, run={"duration": 0.3, "gravity": DOWN})
    assert 0.0 <= found.momentum_residual < 1e-13
