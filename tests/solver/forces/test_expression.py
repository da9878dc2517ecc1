"""Expressions of time: values, refusals with the place, and no way out of the language."""

import numpy as np
import pytest

from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.expression import function_of, in_units, parsed

T = np.linspace(0.0, 2.0, 7)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("5", np.full(7, 5.0)),
        ("100*sin(2*pi*50*t)", 100 * np.sin(2 * np.pi * 50 * T)),
        ("-t**2 + 3/(1 + t)", -(T**2) + 3 / (1 + T)),
        ("step(t - 1) * exp(-t)", np.where(T >= 1, np.exp(-T), 0.0)),
        ("min(t, 1) + max(t, 1) + abs(t - 1) + sqrt(t) + log(1 + t) + cos(t) + tan(t)",
         T + 1 + np.abs(T - 1) + np.sqrt(T) + np.log(1 + T) + np.cos(T) + np.tan(T)),
        (" +1e3 ", np.full(7, 1e3)),
    ],
)  # fmt: skip
def test_values(text: str, expected: np.ndarray) -> None:
    np.testing.assert_allclose(function_of(text, "force.f.expression").read(T)[:, 0], expected, rtol=1e-14)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("__import__('os').system('true')", "is not allowed; allowed: numbers, t, pi"),
        ("2*x + 1", "'x' at character 3 is not allowed"),
        ("t.real", "'t.real' at character 1 is not allowed"),
        ("sin(t", "is no expression, at character 4"),
        ("", "is no expression"),
        ("sin(t, 2)", "'sin(t, 2)': sin needs 1 argument"),
        ("min(t)", "'min(t)': min needs 2 arguments"),
        ("[1, 2]", "is not allowed"),
        ("True", "'True' at character 1 is not allowed"),
        ("2 if t else 3", "is not allowed"),
        ("t < 1", "is not allowed"),
        ("lambda: 1", "is not allowed"),
        ("1e999", "a number is too large"),
        ("1" * 400, "a number is too large"),
        ("t" * 2000, "2000 characters given; allowed: 1000"),
        ("-" * 500 + "t", "has more than 100 levels"),
        ("(" * 400 + "t" + ")" * 400, ""),
        ("t; t", "is no expression"),
        ("t\x00", ""),
    ],
)
def test_what_is_no_expression_is_refused(text: str, line: str) -> None:
    with pytest.raises(ValueError, match=r".") as caught:
        parsed(text)
    assert line in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("3 + 1/(t - 1)", "force.f.expression: '1/(t - 1)' is not a finite number at t = 1 s"),
        ("sqrt(1 - t)", "force.f.expression: 'sqrt(1 - t)' is not a finite number at t = 1.33333 s"),
        ("2 + 1/(1/(t - 1))", "force.f.expression: '1/(t - 1)' is not a finite number at t = 1 s"),
        ("min(exp(1e4*t), 5)", "force.f.expression: 'exp(1e4*t)' is not a finite number at t = 0.333333 s"),
        ("1e300**t", "force.f.expression: '1e300**t' is not a finite number at t = 1.33333 s"),
    ],
)
def test_a_value_that_is_not_finite_names_part_and_time(text: str, line: str) -> None:
    with pytest.raises(SceneError) as caught:
        function_of(text, "force.f.expression").read(T)
    assert str(caught.value) == line


def test_other_units() -> None:
    text = in_units("3 + sin(2*pi*t) * t", 1e3, 7.0)
    found = function_of(text, "").read(1e3 * T)
    np.testing.assert_allclose(found, 7.0 * function_of("3 + sin(2*pi*t) * t", "").read(T), rtol=1e-12)
