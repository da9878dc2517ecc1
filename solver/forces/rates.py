"""Rates of expressions of time: their exact derivatives, by the rules of each operator and function."""

import ast
from collections.abc import Callable

import numpy as np

from gudgeon.solver.forces.expression import FUNCTIONS, OPERATORS, Told, evaluated, kept

Pair = tuple[np.ndarray, np.ndarray]
"""Values and rates."""


def rates_of(text: str, times: np.ndarray, key: str) -> np.ndarray:
    """Return the rates of an expression at times [s], (t,); at a kink, that of the later side.

    Raises:
        SceneError: a value or rate is not finite; it names the key `key`, the part of the expression and the time.
    """
    tree, t = kept(text), np.asarray(times, float)
    return evaluated(lambda source: _pair(tree, t, source)[1], Told(text.strip(), key))


def _pair(node: ast.expr, t: np.ndarray, source: Told | None) -> Pair:
    if isinstance(node, ast.Constant):
        return np.full(len(t), float(node.value)), np.zeros(len(t))  # type: ignore[arg-type]
    if isinstance(node, ast.Name):
        return (t, np.ones(len(t))) if node.id == "t" else (np.full(len(t), np.pi), np.zeros(len(t)))
    if isinstance(node, ast.UnaryOp):
        value, rate = _pair(node.operand, t, source)
        result = (-value, -rate) if isinstance(node.op, ast.USub) else (value, rate)
    elif isinstance(node, ast.BinOp):
        u, v = _pair(node.left, t, source), _pair(node.right, t, source)
        result = OPERATORS[type(node.op)](u[0], v[0]), _BINARY[type(node.op)](u, v)
    else:
        assert isinstance(node, ast.Call)
        assert isinstance(node.func, ast.Name)
        pairs = [_pair(a, t, source) for a in node.args]
        result = FUNCTIONS[node.func.id][0](*(value for value, _ in pairs)), _CALLS[node.func.id](*pairs)
    if source is not None:
        for quantity, values in zip(("", "the rate of "), result, strict=True):
            source.refuse(node, t, values, quantity)
    return result


def _power(base: Pair, exponent: Pair) -> np.ndarray:
    """Return the rate of u ** v; a constant power needs no logarithm."""
    (u, du), (v, dv) = base, exponent
    by_base = np.where(du == 0, 0.0, np.where(v == 0, 0.0, v * np.power(u, v - 1) * du))
    return by_base + np.where(dv == 0, 0.0, np.power(u, v) * np.log(u) * dv)


_BINARY: dict[type[ast.operator], Callable[[Pair, Pair], np.ndarray]] = {
    ast.Add: lambda a, b: a[1] + b[1],
    ast.Sub: lambda a, b: a[1] - b[1],
    ast.Mult: lambda a, b: a[1] * b[0] + a[0] * b[1],
    ast.Div: lambda a, b: (a[1] - a[0] / b[0] * b[1]) / b[0],
    ast.Pow: _power,
}
_CALLS: dict[str, Callable[..., np.ndarray]] = {
    "sin": lambda a: np.cos(a[0]) * a[1],
    "cos": lambda a: -np.sin(a[0]) * a[1],
    "tan": lambda a: a[1] / np.cos(a[0]) ** 2,
    "exp": lambda a: np.exp(a[0]) * a[1],
    "log": lambda a: a[1] / a[0],
    "sqrt": lambda a: np.where(a[1] == 0, 0.0, 0.5 * a[1] / np.sqrt(a[0])),
    "abs": lambda a: np.where(a[0] == 0, np.abs(a[1]), np.sign(a[0]) * a[1]),
    "min": lambda a, b: np.where(a[0] == b[0], np.minimum(a[1], b[1]), np.where(a[0] < b[0], a[1], b[1])),
    "max": lambda a, b: np.where(a[0] == b[0], np.maximum(a[1], b[1]), np.where(a[0] > b[0], a[1], b[1])),
    "step": lambda a: np.zeros(len(a[0])),
}
