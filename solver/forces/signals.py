"""Functions of time as the core reads them, with exact rates: expressions as lists of operations, and tables."""

import ast
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from gudgeon.solver import core
from gudgeon.solver.errors import SceneError

FUNCTIONS = {
    "sin": 1, "cos": 1, "tan": 1, "exp": 1, "log": 1, "sqrt": 1, "abs": 1, "min": 2, "max": 2, "step": 1,
}  # fmt: skip
"""Functions and how many arguments each needs; step(x) is 0 below x = 0 and 1 from there on."""
OPERATORS: dict[type[ast.AST], str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**",
}  # fmt: skip
OPERATIONS = (
    "constant", "t", "negative", *OPERATORS.values(), "sin", "cos", "tan", "exp", "log", "sqrt", "abs", "min", "max",
    "step", "table",
)  # fmt: skip
"""Kinds of operations, in the order of `core/signals.hpp`."""
RATES = ("", "the rate of ", "the second rate of ")


class Signal(NamedTuple):
    """A function of time: `core/signals.hpp`."""

    operations: np.ndarray
    """Kind and the numbers of its operands, or of its constant, (n, 3)."""
    constants: np.ndarray
    """(c,)"""
    knots: np.ndarray
    """Of a table [s], (k,)."""
    pieces: np.ndarray
    """Coefficients of the powers of the time behind a knot, from the constant on, (k − 1, 4)."""


@dataclass(frozen=True)
class Function:
    """A function of time with what a refusal of it names."""

    signal: Signal
    parts: tuple[str, ...] = ()
    """Text of each operation."""
    key: str = ""

    def read(self, times: np.ndarray, rates: int = 0) -> np.ndarray:
        """Return values and a number of rates at times [s], (t, 1 + rates).

        Raises:
            SceneError: one of them, or of a part of the expression, is not finite; it names key, part and time.
        """
        times = np.ascontiguousarray(times, float)
        values = np.empty((len(times), 1 + rates))
        if (bad := core.read_signal(self.signal, times, values)) is not None:
            operation, order, row = bad
            text = f"{RATES[order]}'{self.parts[operation]}'"
            raise SceneError(f"{self.key}: {text} is not a finite number at t = {times[row]:.6g} s")
        return values

    def plain(self, times: np.ndarray, rates: int = 0) -> np.ndarray:
        """Return values and a number of rates at times [s], finite or not, (t, 1 + rates)."""
        values = np.empty((len(times), 1 + rates))
        core.read_signal(self.signal, np.ascontiguousarray(times, float), values)
        return values


def of_tree(tree: ast.expr, text: str, key: str) -> Function:
    """Return the function of an expression whose parts are allowed."""
    operations: list[tuple[int, int, int]] = []
    constants: list[float] = []
    parts: list[str] = []

    def add(node: ast.expr, kind: str, first: int = 0, second: int = 0) -> int:
        operations.append((OPERATIONS.index(kind), first, second))
        parts.append(ast.get_source_segment(text, node) or text)
        return len(operations) - 1

    def constant(node: ast.expr, value: float) -> int:
        constants.append(value)
        return add(node, "constant", len(constants) - 1)

    def visit(node: ast.expr) -> int:
        match node:
            case ast.Constant(value):
                return constant(node, float(value))  # type: ignore[arg-type]
            case ast.Name(name):
                return add(node, "t") if name == "t" else constant(node, np.pi)
            case ast.BinOp(left, op, right):
                return add(node, OPERATORS[type(op)], visit(left), visit(right))
            case ast.UnaryOp(op, operand):
                return add(node, "negative", visit(operand)) if isinstance(op, ast.USub) else visit(operand)
            case ast.Call(ast.Name(name), arguments):
                return add(node, name, *map(visit, arguments))
        raise AssertionError(node)

    visit(tree)
    nothing = np.empty(0), np.empty((0, 4))
    signal = Signal(np.array(operations, np.int64), np.array(constants, float), *nothing)
    return Function(signal, tuple(parts), key)


def table(knots: np.ndarray, coefficients: np.ndarray) -> Function:
    """Return a function by its polynomials between knots [s], (k,), beyond which it stays as it is at the ends.

    Args:
        coefficients: Of powers of the time behind a knot, from the highest on, (degree + 1, k − 1).
    """
    pieces = np.zeros((len(knots) - 1, 4))
    pieces[:, : len(coefficients)] = coefficients[::-1].T
    operations = np.array([[OPERATIONS.index("table"), 0, 0]], np.int64)
    return Function(Signal(operations, np.empty(0), np.ascontiguousarray(knots, float), pieces))


@lru_cache(maxsize=100)
def lines(values: tuple[tuple[float, float], ...]) -> Function:
    """Return the function of a table of time and amount, linear between its rows, made once for the steps of a run."""
    knots, amounts = np.array(values, float).T
    return table(knots, np.array([np.diff(amounts) / np.diff(knots), amounts[:-1]]))


@lru_cache(maxsize=100)
def spline(values: tuple[tuple[float, float], ...]) -> Function:
    """Return the cubic spline of a table of time and motion, made once for the steps of a run."""
    from scipy.interpolate import CubicSpline

    curve = CubicSpline(*np.array(values, float).T)
    return table(curve.x, curve.c)
