"""Second rates of expressions of time: exact, by the rules of each operator and function."""

import ast
from collections.abc import Callable

import numpy as np

from gudgeon.solver.forces.expression import FUNCTIONS, Told, evaluated, kept

Jet = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Values, rates and second rates."""


def motions_of(text: str, times: np.ndarray, key: str) -> np.ndarray:
    """Return values, rates and second rates of an expression at times [s], (t, 3); at a kink, those of the later side.

    Raises:
        SceneError: a value or rate is not finite; it names the key `key`, the part of the expression and the time.
    """
    tree, t = kept(text), np.asarray(times, float)
    return evaluated(lambda source: np.column_stack(_jet(tree, t, source)), Told(text.strip(), key))


def plain_motions(text: str, times: np.ndarray) -> np.ndarray:
    """Return values, rates and second rates of an expression at times [s], (t, 3), finite or not."""
    with np.errstate(all="ignore"):
        return np.column_stack(_jet(kept(text), np.asarray(times, float), None))


def _jet(node: ast.expr, t: np.ndarray, source: Told | None) -> Jet:
    zero = np.zeros(len(t))
    if isinstance(node, ast.Constant):
        return np.full(len(t), float(node.value)), zero, zero  # type: ignore[arg-type]
    if isinstance(node, ast.Name):
        return (t, np.ones(len(t)), zero) if node.id == "t" else (np.full(len(t), np.pi), zero, zero)
    if isinstance(node, ast.UnaryOp):
        u = _jet(node.operand, t, source)
        result = (-u[0], -u[1], -u[2]) if isinstance(node.op, ast.USub) else u
    elif isinstance(node, ast.BinOp):
        result = _BINARY[type(node.op)](_jet(node.left, t, source), _jet(node.right, t, source))
    else:
        assert isinstance(node, ast.Call)
        assert isinstance(node.func, ast.Name)
        jets = [_jet(a, t, source) for a in node.args]
        name = node.func.id
        result = _chosen(name, *jets) if len(jets) == 2 else _by_rule(name, jets[0])
    if source is not None:
        for quantity, values in zip(("", "the rate of ", "the second rate of "), result, strict=True):
            source.refuse(node, t, values, quantity)
    return result


def _chain(u: Jet, value: np.ndarray, f1: np.ndarray, f2: np.ndarray) -> Jet:
    """Return f(u) of the derivatives of f at u."""
    still = (u[1] == 0) & (u[2] == 0)
    rate = np.where(u[1] == 0, 0.0, f1 * u[1])
    return value, rate, np.where(still, 0.0, f2 * u[1] ** 2 + f1 * u[2])


def _by_rule(name: str, u: Jet) -> Jet:
    x, value = u[0], FUNCTIONS[name][0](u[0])
    if name == "abs":
        sign = np.where((x < 0) | ((x == 0) & (u[1] < 0)), -1.0, 1.0)
        return value, sign * u[1], sign * u[2]
    if name == "step":
        return value, np.zeros(len(x)), np.zeros(len(x))
    return _chain(u, value, *_DERIVATIVES[name](x, value))


def _chosen(name: str, a: Jet, b: Jet) -> Jet:
    """Return the smaller or larger of two, at equal values the one that will be."""
    sign = 1.0 if name == "min" else -1.0
    takes_a = np.zeros(len(a[0]), bool)
    for order in (2, 1, 0):
        takes_a = np.where(a[order] == b[order], takes_a, sign * a[order] < sign * b[order])
    return tuple(np.where(takes_a, x, y) for x, y in zip(a, b, strict=True))  # type: ignore[return-value]


def _quotient(a: Jet, b: Jet) -> Jet:
    q = a[0] / b[0]
    rate = (a[1] - q * b[1]) / b[0]
    return q, rate, (a[2] - 2 * rate * b[1] - q * b[2]) / b[0]


def _power(u: Jet, v: Jet) -> Jet:
    """Return u ** v; a constant power needs no logarithm."""
    if not (v[1].any() or v[2].any()):
        n = v[0]
        f1 = np.where(n == 0, 0.0, n * np.power(u[0], n - 1))
        f2 = np.where((n == 0) | (n == 1), 0.0, n * (n - 1) * np.power(u[0], n - 2))
        return _chain(u, np.power(u[0], n), f1, f2)
    exponent = _BINARY[ast.Mult](v, _by_rule("log", u))
    return _chain(exponent, np.power(u[0], v[0]), *(2 * [np.power(u[0], v[0])]))


_BINARY: dict[type[ast.operator], Callable[[Jet, Jet], Jet]] = {
    ast.Add: lambda a, b: (a[0] + b[0], a[1] + b[1], a[2] + b[2]),
    ast.Sub: lambda a, b: (a[0] - b[0], a[1] - b[1], a[2] - b[2]),
    ast.Mult: lambda a, b: (a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2 * a[1] * b[1] + a[0] * b[2]),
    ast.Div: _quotient,
    ast.Pow: _power,
}
_DERIVATIVES: dict[str, Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]] = {
    "sin": lambda x, f: (np.cos(x), -f),
    "cos": lambda x, f: (-np.sin(x), -f),
    "tan": lambda x, f: (1 + f**2, 2 * f * (1 + f**2)),
    "exp": lambda x, f: (f, f),
    "log": lambda x, f: (1 / x, -1 / x**2),
    "sqrt": lambda x, f: (0.5 / f, -0.25 / (f * x)),
}
