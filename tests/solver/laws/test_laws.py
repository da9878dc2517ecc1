"""Laws of compliant contact against closed forms: restitution and loss, impacts after Hertz, a spring with a dashpot.

Values of C1, C2, C3 in data/hertz; each names its source. Those of L7 stand with their test.
"""

import json
import subprocess
import sys
from dataclasses import dataclass
from decimal import Decimal, localcontext
from pathlib import Path

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError
from scipy.integrate import solve_ivp

from gudgeon.solver import core
from gudgeon.solver.laws import LAWS, Coefficients, Law
from gudgeon.solver.laws.restitution import SMALLEST, TOLERANCE, delivered_restitution, loss_of_restitution

ROOT = Path(__file__).parents[3]
LAW: TypeAdapter[Law] = TypeAdapter(Law)
TABLE = {
    "hunt_crossley": "hunt-crossley",
    "lankarani_nikravesh": "lankarani-nikravesh",
    "flores2011": "flores",
    "exact_coefficient": "exact",
}
"""Laws of C3 by their names there."""


def reference(name: str) -> dict:
    """Return a reference case."""
    return json.loads((ROOT / "data" / "hertz" / f"{name}.json").read_text())


@dataclass(frozen=True)
class Impact:
    """What a free mass does on a law."""

    restitution: float
    indentation: float
    """Largest [m]."""
    force: float
    """Largest [N]."""
    duration: float
    """Until the indentation is zero again [s]."""
    pressed: float
    """Until the force is zero [s]."""
    left: float
    """Indentation there [m]."""
    dissipated: np.ndarray
    """Work of all but the elastic part over time, as part of the energy at first."""


def impact(coefficients: Coefficients, mass: float, speed: float) -> Impact:
    """Integrate the impact of a mass [kg] at a speed [m/s], in units of its own depth and time."""
    row = np.array(coefficients)
    depth = (mass * speed**2 / row[0]) ** (1 / (row[1] + 1))
    unit = mass * speed**2 / depth

    def force(y: np.ndarray) -> np.ndarray:
        value, by_depth, by_rate = core.law_force(row, depth * y[0], speed * y[1], speed)
        return np.array([value, by_depth * depth, by_rate * speed]) / unit

    def motion(_: float, y: np.ndarray) -> list[float]:
        value = force(y)[0]
        return [y[1], -value, 2 * (value - max(y[0], 0.0) ** row[1]) * y[1]]

    def growth(_: float, y: np.ndarray) -> float:
        value, by_depth, by_rate = force(y)
        return by_depth * y[1] - by_rate * value

    def pull(_: float, y: np.ndarray) -> float:
        loss = y[0] ** row[1] * (1 + row[2] * y[1]) if y[0] > 0 else 0.0
        return loss + row[3] * speed / unit * y[1]

    def apart(_: float, y: np.ndarray) -> float:
        return y[0]

    def rest(_: float, y: np.ndarray) -> float:
        return y[1]

    for event in (growth, pull, apart, rest):
        event.direction = -1  # type: ignore[attr-defined]
    apart.terminal = True  # type: ignore[attr-defined]
    # Just inside: a dashpot's force begins with a jump.
    run = solve_ivp(
        motion, (0, 1e4), [1e-15, 1.0, 0.0], "DOP853", events=(growth, pull, apart, rest), rtol=1e-12, atol=1e-14
    )
    assert run.status == 1
    peaks = [force(y)[0] for y in run.y_events[0]] or [force(run.y[:, 0])[0]]
    end = 1 if len(run.t_events[1]) else 2
    return Impact(
        restitution=-run.y[1, -1],
        indentation=run.y_events[3][0][0] * depth,
        force=max(peaks) * unit,
        duration=run.t_events[2][0] * depth / speed,
        pressed=run.t_events[end][0] * depth / speed,
        left=run.y_events[end][0][0] * depth,
        dissipated=run.y[2],
    )


def exact_loss(restitution: float) -> Decimal:
    """Return χ by its definition from Langevin's function, with 60 digits or more."""
    with localcontext() as context:
        context.prec = 120
        e = Decimal(restitution)
        share = (1 - e) / (1 + e)
        h = Decimal(loss_of_restitution(restitution)) * (1 + e) / 2
        for _ in range(6):
            decay = (-2 * h).exp()
            coth = (1 + decay) / (1 - decay)
            h -= (coth - 1 / h - share) / (1 / h**2 - 4 * decay / (1 - decay) ** 2)
        return 2 * h / (1 + e)


RESTITUTIONS = [1 - 2.0**-53, 1 - 1e-12, 1 - 1e-6, 0.999, 0.5, 0.3, 0.29, 0.05, 1e-2, 1e-4, 1e-9, 1e-15]


@pytest.mark.parametrize("restitution", [*RESTITUTIONS, *np.random.default_rng(0).uniform(0, 1, 40).tolist()])
def test_loss_is_the_root_to_all_digits(restitution: float) -> None:
    loss = loss_of_restitution(restitution)
    # 16 eps is where the root's iteration ends.
    assert abs(float(Decimal(loss) / exact_loss(restitution) - 1)) < 1e-14
    assert delivered_restitution(loss) == pytest.approx(restitution, rel=1e-14, abs=0)


@pytest.mark.parametrize("restitution", [0.1, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95])
def test_loss_fulfils_the_relation_as_it_is_printed(restitution: float) -> None:
    loss = loss_of_restitution(restitution)
    relation = np.log((1 + loss) / (1 - loss * restitution))
    # 1 − χ e is 2e-4 at e = 0.1: four digits less.
    assert relation == pytest.approx(loss * (1 + restitution), rel=1e-11, abs=0)


def test_ends_of_restitution() -> None:
    assert loss_of_restitution(1.0) == 0
    assert delivered_restitution(0.0) == 1
    # χ = 1/e below e = 0.01, where the rest is exp(−1/e); 3/2 (1 − e) at 1.
    assert loss_of_restitution(SMALLEST) == pytest.approx(1 / SMALLEST, rel=1e-14)
    assert loss_of_restitution(1 - 2.0**-40) == pytest.approx(1.5 * 2.0**-40, rel=1e-11)
    assert delivered_restitution(1e308) == pytest.approx(1e-308, rel=1e-14, abs=0)
    assert delivered_restitution(5e-324) == 1


@pytest.mark.parametrize("restitution", [0.0, -0.1, 1.1, float("nan"), SMALLEST / 2])
def test_restitution_without_a_loss_is_refused(restitution: float) -> None:
    with pytest.raises(ValueError, match=r"restitution is .*, it must be above 0 and at most 1"):
        loss_of_restitution(restitution)


@pytest.mark.parametrize("loss", [-1e-9, float("inf"), float("nan")])
def test_loss_without_a_restitution_is_refused(loss: float) -> None:
    with pytest.raises(ValueError, match=r"loss is .*, it must be at least 0 and finite"):
        delivered_restitution(loss)


@pytest.mark.parametrize("name", ["C1_sphere_sphere_steel", "C2_sphere_halfspace_steel"])
def test_spheres_of_steel(name: str) -> None:
    case = reference(name)
    given, expected = case["parameters"], {key: entry["value"] for key, entry in case["expected"].items()}
    law = LAW.validate_python({"kind": "hertz", "radius": given["R_eff"], "modulus": given["E_star"]})
    assert law.coefficients().stiffness == pytest.approx(expected["K"], rel=1e-12)
    found = impact(law.coefficients(), given["m_eff"], given["v0"])
    # Closed forms against an integration to 1e-12.
    assert found.indentation == pytest.approx(expected["max_indentation"], rel=1e-9)
    assert found.force == pytest.approx(expected["max_force"], rel=1e-9)
    assert found.duration == pytest.approx(expected["contact_duration"], rel=1e-9)
    assert found.restitution == pytest.approx(1, rel=1e-9)
    assert core.law_energy(np.array(law.coefficients()), found.indentation) == pytest.approx(
        given["m_eff"] * given["v0"] ** 2 / 2, rel=1e-9
    )


C3 = reference("C3_damped_hertz_restitution")


@pytest.mark.parametrize("line", C3["expected"]["table"], ids=lambda line: f"{line['e_nominal']}")
@pytest.mark.parametrize("name", TABLE)
def test_laws_deliver_what_is_tabulated(line: dict, name: str) -> None:
    given, expected = C3["parameters"], line[name]
    law = LAW.validate_python({"kind": TABLE[name], "stiffness": given["K"], "restitution": line["e_nominal"]})
    coefficients = law.coefficients()
    assert coefficients.loss == pytest.approx(expected["lambda_times_v0"], rel=1e-9)
    # The table's own uncertainties: 1e-9, and 1e-6 of the force.
    assert delivered_restitution(coefficients.loss) == pytest.approx(expected["e_effective"], rel=1e-9)
    found = impact(coefficients, given["m_eff"], given["v0"])
    assert found.restitution == pytest.approx(expected["e_effective"], rel=1e-9)
    assert found.indentation == pytest.approx(expected["max_indentation"], rel=1e-9)
    assert found.duration == pytest.approx(expected["contact_duration"], rel=1e-9)
    assert found.force == pytest.approx(expected["max_force"], rel=1e-6)


@pytest.mark.parametrize(
    ("kind", "delivered"),
    [("hu-guo", (0.074, 0.271, 0.488, 0.697, 0.900)), ("gonthier", (0.101, 0.304, 0.488, 0.670, 0.876))],
)
def test_laws_beyond_that_table(kind: str, delivered: tuple[float, ...]) -> None:
    """Measured by integration; three digits."""
    for asked, value in zip((0.1, 0.3, 0.5, 0.7, 0.9), delivered, strict=True):
        law = LAW.validate_python({"kind": kind, "stiffness": 1.5e10, "restitution": asked})
        assert impact(law.coefficients(), 0.0329, 1.0).restitution == pytest.approx(value, abs=5e-4)


def test_spring_with_a_dashpot_leaves_when_its_force_vanishes() -> None:
    """L7: a damped half sine. Separation is where the force vanishes; where the gap opens, e would be 0.638394."""
    mass, speed = 2.0, 0.5
    law = LAW.validate_python({"kind": "linear", "stiffness": 1e8, "damping": 4000.0})
    row = np.array(law.coefficients())
    assert core.law_force(row, 1e-18, speed, speed)[0] == pytest.approx(2000.0, rel=1e-9)
    found = impact(law.coefficients(), mass, speed)
    assert found.restitution == pytest.approx(0.6648080444805237, rel=1e-9)
    assert found.pressed == pytest.approx(0.0004082569349116379, rel=1e-9)
    assert found.left == pytest.approx(1.3296160889610473e-05, rel=1e-9)


@pytest.mark.parametrize("depth", [1e-15, 1e-9, 1e-3])
@pytest.mark.parametrize("stiffness", [1e-3, 1e15])
def test_force_and_energy_at_extremes(stiffness: float, depth: float) -> None:
    row, approach = np.array([stiffness, 1.5, 0.5, 0.0]), 1e-9
    force, by_depth, by_rate = core.law_force(row, depth, approach / 2, approach)
    # Powers in Decimal: each of the few operations rounds once.
    power = float(Decimal(depth).sqrt() ** 3)
    assert force == pytest.approx(stiffness * power * 1.25, rel=1e-14, abs=0)
    assert by_depth == pytest.approx(1.5 * force / depth, rel=1e-14, abs=0)
    assert by_rate == pytest.approx(stiffness * power * 0.5 / approach, rel=1e-14, abs=0)
    assert core.law_energy(row, depth) == pytest.approx(0.4 * stiffness * power * depth, rel=1e-14, abs=0)


def test_contact_that_begins_at_rest_has_no_loss() -> None:
    row = np.array([1e9, 1.5, 0.5, 3.0])
    assert core.law_force(row, 1e-4, 2.0, 0.0) == pytest.approx((1e3 + 6, 1.5e7, 3.0), rel=1e-14)


def test_warning_names_what_is_delivered_and_where_the_law_holds() -> None:
    law = LAW.validate_python({"kind": "lankarani-nikravesh", "stiffness": 1e9, "restitution": 0.5})
    assert law.warning() == (
        'law "lankarani-nikravesh": restitution 0.5 given, 0.7252 delivered (+45 %); the law is accurate to 2 % for'
        ' 0.89 to 1, law "exact" for any'
    )
    nothing = LAW.validate_python({"kind": "hunt-crossley", "stiffness": 1e9, "restitution": 0.0}).warning()
    assert nothing is not None
    assert "restitution 0 given, 0.4877 delivered; the law is" in nothing


@pytest.mark.parametrize(
    ("kind", "ranges"),
    [
        ("hunt-crossley", [(0.86, 1)]),
        ("lankarani-nikravesh", [(0.89, 1)]),
        ("flores", [(0.74, 1)]),
        ("hu-guo", [(0.53, 1)]),
        ("gonthier", [(0.01, 0.15), (0.26, 0.47), (0.93, 1)]),
        ("exact", [(0.01, 1)]),
    ],
)
def test_warning_comes_where_the_restitution_is_not_delivered(kind: str, ranges: list[tuple[float, float]]) -> None:
    text = " and ".join(f"{first:g} to {last:g}" for first, last in ranges)
    for restitution in np.arange(1, 101) / 100:
        law = LAW.validate_python({"kind": kind, "stiffness": 1e9, "restitution": restitution})
        warning = law.warning()
        departure = abs(delivered_restitution(law.coefficients().loss) / restitution - 1)
        assert (warning is None) == (departure <= TOLERANCE) == any(a <= restitution <= b for a, b in ranges)
        assert warning is None or f"for {text}, law" in warning


@pytest.mark.parametrize("settings", [{"kind": "linear", "damping": 1e9}, {"kind": "hertz"}])
def test_laws_without_restitution_do_not_warn(settings: dict) -> None:
    assert LAW.validate_python({"stiffness": 1e9, **settings}).warning() is None


GIVEN = {"kind": "exact", "stiffness": 1e9, "restitution": 0.5}
REFUSED = [
    ({**GIVEN, "restitution": 0.0}, 'restitution is 0, .* use method "impact" for restitution 0'),
    ({**GIVEN, "kind": "flores", "restitution": 0.0}, 'use method "impact"'),
    ({**GIVEN, "kind": "hu-guo", "restitution": 0.0}, 'use method "impact"'),
    ({**GIVEN, "kind": "gonthier", "restitution": 0.0}, 'use method "impact"'),
    ({**GIVEN, "restitution": 1.01}, "less than or equal to 1"),
    ({**GIVEN, "restitution": -0.1}, "greater than or equal to 0"),
    ({**GIVEN, "stiffness": 0.0}, "greater than 0"),
    ({**GIVEN, "exponent": 0.0}, "greater than or equal to 0.1"),
    ({**GIVEN, "radius": 0.01, "modulus": 1e11}, "give either stiffness, or radius and modulus"),
    ({**GIVEN, "radius": 0.01}, "give either stiffness, or radius and modulus"),
    ({"kind": "hertz", "radius": 0.01}, "give either stiffness, or radius and modulus"),
    ({"kind": "hertz"}, "give either stiffness, or radius and modulus"),
    ({"kind": "hertz", "radius": 0.01, "modulus": 1e11, "exponent": 1.4}, "exponent is 1.4, it must be 1.5"),
    ({"kind": "hertz", "stiffness": float("inf")}, "finite"),
    ({"kind": "hertz", "stiffness": 1e9, "restitution": 0.5}, "Extra inputs"),
    ({"kind": "linear", "stiffness": 1e9, "damping": -1.0}, "greater than or equal to 0"),
    ({"kind": "linear", "stiffness": 1e9, "exponent": 1.5}, "Extra inputs"),
    ({"kind": "exact", "stiffness": 1e9}, "Field required"),
    ({"kind": "flubber", "stiffness": 1e9}, "does not match any of the expected tags"),
]


@pytest.mark.parametrize(("settings", "message"), REFUSED)
def test_wrong_settings_are_refused(settings: dict, message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        LAW.validate_python(settings)


def test_reading_a_law_loads_neither_compiler_nor_scipy() -> None:
    probe = (
        "import sys, gudgeon.solver.laws; print([name for name in ('numpy.linalg', 'scipy') if name in sys.modules])"
    )
    child = subprocess.run([sys.executable, "-c", probe], cwd=ROOT, capture_output=True, text=True, check=True)
    assert child.stdout.strip() == "[]"


def test_every_law_of_the_table_is_a_member() -> None:
    assert set(TABLE.values()) <= set(LAWS)
