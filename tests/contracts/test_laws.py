"""Every law: it never pulls, its derivatives are those of its force, it stores what it says and makes no energy."""

from decimal import Decimal, localcontext
from typing import get_args

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError
from scipy.integrate import quad

from gudgeon.solver import core
from gudgeon.solver.laws import LAWS, Law
from gudgeon.solver.laws.restitution import delivered_restitution
from tests.solver.laws.test_laws import impact

LAW: TypeAdapter[Law] = TypeAdapter(Law)
MEMBERS = sorted(LAWS)
DRAWS = 12
EPS = np.finfo(float).eps


def drawn(name: str) -> list[Law]:
    """Return members of a law with settings drawn over decades; fields a new law has beyond these it must default."""
    rng = np.random.default_rng(len(name))
    laws = []
    for _ in range(DRAWS):
        every = {
            "kind": name,
            "stiffness": 10 ** rng.uniform(3, 15),
            "exponent": rng.uniform(1, 3),
            "restitution": rng.uniform(0.05, 1),
            "damping": 10 ** rng.uniform(0, 6),
        }
        laws.append(LAW.validate_python({key: every[key] for key in every if key in LAWS[name].model_fields}))
    return laws


def states(rng: np.random.Generator) -> np.ndarray:
    """Return indentations [m], rates [m/s] and approach speeds [m/s], (n, 3), many of them in fast release."""
    approach = 10 ** rng.uniform(-6, 2, 200)
    rate = approach * rng.choice([-1, 1], 200) * 10 ** rng.uniform(-3, 2, 200)
    return np.column_stack([10 ** rng.uniform(-15, -2, 200), rate, approach])


def test_dictionary_and_union_hold_the_same_laws() -> None:
    assert set(LAWS.values()) == set(get_args(get_args(Law)[0]))


@pytest.mark.parametrize("name", MEMBERS)
def test_kind_picks_the_member_and_it_is_frozen(name: str) -> None:
    law = drawn(name)[0]
    assert type(law) is LAWS[name]
    assert law.kind == name
    with pytest.raises(ValidationError, match="frozen"):
        law.stiffness = 1.0  # type: ignore[misc]
    with pytest.raises(ValidationError, match="Extra inputs"):
        LAW.validate_python({**law.model_dump(exclude_none=True), "stifness": 1.0})


@pytest.mark.parametrize("name", MEMBERS)
def test_derivatives_are_those_of_the_force(name: str) -> None:
    rng = np.random.default_rng(1)
    pressing = 0
    for law in drawn(name):
        row = np.array(law.coefficients())
        for d, rate, approach in states(rng):
            force, by_depth, by_rate = core.law_force(row, d, rate, approach)
            h, k = 1e-5 * d, 1e-5 * abs(rate)
            depths = [core.law_force(row, d + step, rate, approach)[0] for step in (-h, h)]
            rates = [core.law_force(row, d, rate + step, approach)[0] for step in (-k, k)]
            if force == 0:
                assert (by_depth, by_rate) == (0, 0)
            elif min(*depths, *rates) > 0:
                pressing += 1
                # The terms of the force, which may nearly cancel: h² of the third derivative, and eps/h of round-off.
                size = row[0] * d ** row[1] * (1 + row[2] * abs(rate) / approach) + row[3] * abs(rate)
                assert by_depth * d == pytest.approx((depths[1] - depths[0]) / 2e-5, abs=1e-8 * size)
                assert by_rate * abs(rate) == pytest.approx((rates[1] - rates[0]) / 2e-5, abs=1e-8 * size)
    assert pressing > 100 * DRAWS


@pytest.mark.parametrize("name", MEMBERS)
def test_force_never_pulls(name: str) -> None:
    rng = np.random.default_rng(2)
    for law in drawn(name):
        row = np.array(law.coefficients())
        found = np.array([core.law_force(row, *state) for state in states(rng)])
        assert np.isfinite(found).all()
        assert (found[:, [0, 2]] >= 0).all()
        # States of fast release are among them: whatever dissipates lets go there.
        assert (found[:, 0] == 0).any() == (row[2] > 0 or row[3] > 0)


@pytest.mark.parametrize("name", MEMBERS)
def test_no_force_without_indentation(name: str) -> None:
    for law in drawn(name):
        row = np.array(law.coefficients())
        for d in (0.0, -0.0, -1e-15, -1.0):
            for rate in (-1.0, 0.0, 1.0):
                assert core.law_force(row, d, rate, 1.0) == (0, 0, 0)
            assert core.law_energy(row, d) == 0


@pytest.mark.parametrize("name", MEMBERS)
def test_power_beyond_the_elastic_part_is_lost_in_every_state(name: str) -> None:
    """K dⁿ does no work on a closed path, so none has a law that makes energy."""
    rng = np.random.default_rng(3)
    for law in drawn(name):
        row = np.array(law.coefficients())
        for d, rate, approach in states(rng):
            elastic = core.law_force(row, d, 0.0, approach)[0]
            lost = (core.law_force(row, d, rate, approach)[0] - elastic) * rate
            assert lost >= -4 * EPS * elastic * abs(rate)


@pytest.mark.parametrize("name", MEMBERS)
def test_impact_loses_energy_and_delivers_its_restitution(name: str) -> None:
    rng = np.random.default_rng(4)
    for law in drawn(name):
        coefficients = law.coefficients()
        mass, speed = 10 ** rng.uniform(-3, 3), 10 ** rng.uniform(-3, 1)
        if coefficients.damping > 0:
            # Damping ratios up to 1; far above it, a mass takes long to leave.
            critical = 2 * np.sqrt(coefficients.stiffness * mass)
            coefficients = coefficients._replace(damping=rng.uniform(0.01, 1) * critical)
        found = impact(coefficients, mass, speed)
        # Integrated to 1e-12 over a hundred steps.
        assert np.diff(found.dissipated).min() >= -1e-11
        assert found.dissipated[-1] == pytest.approx(1 - found.restitution**2, abs=1e-9)
        if coefficients.damping == 0:
            assert found.restitution == pytest.approx(delivered_restitution(coefficients.loss), rel=1e-8)
        else:
            assert found.restitution < 1


@pytest.mark.parametrize("name", MEMBERS)
def test_force_at_rest_has_the_declared_exponent(name: str) -> None:
    depths = np.logspace(-15, -1, 15)
    for law in drawn(name):
        coefficients = law.coefficients()
        row = np.array(coefficients)
        forces = [core.law_force(row, d, 0.0, 1.0)[0] for d in depths]
        slope, offset = np.polyfit(np.log(depths), np.log(forces), 1)
        # Round-off of logarithms near 40.
        assert slope == pytest.approx(coefficients.exponent, rel=1e-12)
        assert offset == pytest.approx(np.log(coefficients.stiffness), rel=1e-12)
        assert coefficients.exponent == getattr(law, "exponent", 1.0)
        assert coefficients.stiffness == law.stiffness


@pytest.mark.parametrize("name", MEMBERS)
def test_energy_is_the_integral_of_the_force(name: str) -> None:
    rng = np.random.default_rng(5)
    for law in drawn(name):
        row = np.array(law.coefficients())
        depth = 10 ** rng.uniform(-9, -1)
        end = core.law_force(row, depth, 0.0, 1.0)[0]
        share, _ = quad(lambda x, r=row, d=depth, f=end: core.law_force(r, d * x, 0.0, 1.0)[0] / f, 0, 1, epsabs=1e-12)
        # Claimed by the quadrature: 1e-12 absolute of a share near 0.4.
        assert core.law_energy(row, depth) == pytest.approx(share * depth * end, rel=1e-10, abs=0)
        stored = row[0] * depth ** (row[1] + 1) / (row[1] + 1)
        assert core.law_energy(row, depth) == pytest.approx(stored, rel=1e-13, abs=0)


def exact_mean(row: np.ndarray, before: float, after: float) -> float:
    """Return (V(d1) - V(d0)) / (d1 - d0) [N] of V = K d^(n+1) / (n+1), with 60 digits."""
    with localcontext() as context:
        context.prec = 60
        d0, d1, power = Decimal(before), Decimal(after), Decimal(row[1]) + 1
        V0, V1 = (max(d, Decimal(0)) ** power for d in (d0, d1))
        return float(Decimal(row[0]) / power * (V1 - V0) / (d1 - d0))


@pytest.mark.parametrize("name", MEMBERS)
def test_mean_force_of_a_step_is_the_change_of_energy_over_the_change_of_depth(name: str) -> None:
    """Of steps into the material and out of it, of steps that begin or end outside, and of any length."""
    rng = np.random.default_rng(6)
    for law in drawn(name):
        row = np.array(law.coefficients())
        for relative_width in (-2.0, -1.0, -0.3, -1e-3, -1e-4, -1e-8, 1e-12, 1e-6, 0.9e-3, 1.1e-3, 0.1, 5.0):
            before = 10 ** rng.uniform(-9, -2)
            after = before * (1 + relative_width)
            # Of V1 - V0: eps over the relative width, which is 1e-3 or more there; of shorter ones a Gauss sum.
            expected = pytest.approx(exact_mean(row, before, after), rel=1e-12, abs=0)
            assert core.quotient(row, before, after) == expected, relative_width
            assert core.quotient(row, after, before) == expected, relative_width
        assert core.quotient(row, -1e-6, -2e-6) == 0.0
        assert core.quotient(row, 1e-3, 1e-3) == pytest.approx(core.law_force(row, 1e-3, 0.0, 1.0)[0], rel=1e-14)


@pytest.mark.parametrize("name", MEMBERS)
def test_settings_are_described_with_their_units(name: str) -> None:
    fields = LAWS[name].model_json_schema()["properties"]
    for key in set(fields) - {"kind"}:
        assert "[" in fields[key]["description"], key
