"""Expressions that grow without bound between the times at which they are read."""

import numpy as np
import pytest

from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.given import GivenTorque
from gudgeon.solver.forces.jumps import pole_of
from gudgeon.solver.joints.coupled import Driven
from gudgeon.solver.scene.motion import Rotation

POLES = {
    "0.001/(0.0201234-t)": 0.0201234, "-t-0.01*tan(60*t)": np.pi / 120, "0.001/(t-0.0201234)": 0.0201234,
    "1e-6/(t-0.01231)": 0.01231, "1e-6/(t-0.01231)**2 + 1e3*t": 0.01231, "step(t-0.01)/(t-0.010001)": 0.010001,
    "tan(100*t+1000)": (318.5 * np.pi - 1000) / 100, "1/(t-1e-9)": 1e-9,
}  # fmt: skip
"""With the times of their poles [s], in runs of 50 ms."""
FINITE = (
    "0.01*(1-2/(exp(min(700,(t-0.02)/5e-6))+1))", "1/(1+((t-0.020003)/1e-9)**2)", "1e-3*exp(-((t-0.02)/1e-8)**2)",
    "1/(0.0500001-t)", "sin(50*(t-0.0201234))/(t-0.0201234)", "sin(1e4*t)", "exp(1e3*t)", "sqrt(t+1e-12)", "3", "-t",
    "max(0,t-0.0201)**2", "abs(t-0.01)**2.5", "0*t",
)  # fmt: skip


@pytest.mark.parametrize("text", POLES)
def test_poles_of_loads_and_drives_are_found(text: str) -> None:
    loads = {
        "acceleration": Driven(kind="driven", joint="a", expression=text),
        "velocity": Rotation(kind="rotation", body="b", direction=(0, 0, 1), expression=text),
        "load": GivenTorque(kind="torque", body="b", direction=(0, 0, 1), expression=text),
    }
    for what, one in loads.items():
        wanted = f"near t = {POLES[text]:.6g} s, which asks for an infinite {what}"
        assert one.refusal(0.05) == f"expression: grows without bound {wanted}"


@pytest.mark.parametrize("text", FINITE)
def test_what_is_steep_and_finite_has_none(text: str) -> None:
    assert Driven(kind="driven", joint="a", expression=text).refusal(0.05) is None
    assert GivenTorque(kind="torque", body="b", direction=(0, 0, 1), expression=text).refusal(0.05) is None


def test_velocities_without_bound_have_infinite_accelerations() -> None:
    """Of a root the value is finite, as a force it acts."""
    text = "sqrt(abs(t-0.0201234))"
    assert "near t = 0.0201234 s" in str(Driven(kind="driven", joint="a", expression=text).refusal(0.05))
    assert GivenTorque(kind="torque", body="b", direction=(0, 0, 1), expression=text).refusal(0.05) is None


@pytest.mark.parametrize("place", np.linspace(0.3, 0.4, 21))
@pytest.mark.parametrize("power", [0.5, 1.0, 3.0])
def test_it_does_not_matter_where_the_pole_lies(power: float, place: float) -> None:
    """On a time that is read but for round-off, too."""
    times = np.linspace(0.0, 1.0, 101)
    course = (lambda t: np.abs(t - place)[:, None] ** -power), (lambda t: 1 / (1e-7 + np.abs(t - place)[:, None]))
    with np.errstate(divide="ignore"):
        if np.isfinite(course[0](times)).all():
            assert pole_of(course[0], times) == pytest.approx(place, abs=1e-12)
    assert pole_of(course[1], times) is None


def test_a_pole_at_a_time_that_is_read_is_named() -> None:
    load = GivenTorque(kind="torque", body="b", direction=(0, 0, 1), expression="1/(t-0.025)")
    with pytest.raises(
        SceneError, match=r"force\.f\.expression: '1/\(t-0\.025\)' is not a finite number at t = 0\.025"
    ):
        load.check(0.05, "force.f")
