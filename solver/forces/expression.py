"""Expressions of time in scene files: numbers, t, pi, + - * / **, and a few functions. Nothing else can be named."""

import ast
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gudgeon.solver.errors import SceneError

LONGEST = 1000
"""Characters of an expression."""
DEEPEST = 100
"""Levels of an expression."""
FUNCTIONS: dict[str, tuple[Callable[..., np.ndarray], int]] = {
    "sin": (np.sin, 1), "cos": (np.cos, 1), "tan": (np.tan, 1), "exp": (np.exp, 1), "log": (np.log, 1),
    "sqrt": (np.sqrt, 1), "abs": (np.abs, 1), "min": (np.minimum, 2), "max": (np.maximum, 2),
    "step": (lambda x: np.where(x >= 0, 1.0, 0.0), 1),
}  # fmt: skip
"""Functions and how many arguments each needs; step(x) is 0 below x = 0 and 1 from there on."""
OPERATORS: dict[type[ast.operator], Callable[..., np.ndarray]] = {
    ast.Add: np.add, ast.Sub: np.subtract, ast.Mult: np.multiply, ast.Div: np.divide, ast.Pow: np.power,
}  # fmt: skip
ALLOWED = f"numbers, t, pi, + - * / **, parentheses, and {', '.join(FUNCTIONS)}"


def parsed(text: str) -> ast.expr:
    """Return the tree of an expression; raises ValueError, with the place, for anything that is not allowed."""
    if len(text) > LONGEST:
        raise ValueError(f"{len(text)} characters given; allowed: {LONGEST}")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
        _check(tree, text.strip())
    except SyntaxError as error:
        raise ValueError(f"'{text}' is no expression, at character {error.offset or 1}; allowed: {ALLOWED}") from None
    except (RecursionError, MemoryError):
        raise ValueError(f"'{text[:40]}…' has too many levels") from None
    return tree


@lru_cache(maxsize=1000)
def kept(text: str) -> ast.expr:
    """Return the tree of `parsed`, made once; it must not be changed."""
    return parsed(text)


def _check(node: ast.expr, text: str, level: int = 0) -> None:
    """Raise a ValueError for a node that is not allowed."""
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            operands = []
            if not abs(value) < float(np.finfo(float).max):
                raise ValueError(f"'{text}': a number is too large")
        case ast.Name(id="t" | "pi"):
            operands = []
        case ast.BinOp(left, op, right) if type(op) in OPERATORS:
            operands = [left, right]
        case ast.UnaryOp(ast.UAdd() | ast.USub(), operand):
            operands = [operand]
        case ast.Call(ast.Name(id=name), operands, keywords) if name in FUNCTIONS:
            needed = FUNCTIONS[name][1]
            if len(operands) != needed or keywords:
                raise ValueError(f"'{shown(node, text)}': {name} needs {needed} argument{'s' * (needed > 1)}")
        case _:
            column = node.col_offset + 1
            raise ValueError(f"'{shown(node, text)}' at character {column} is not allowed; allowed: {ALLOWED}")
    if level > DEEPEST:
        raise ValueError(f"'{text[:40]}…' has more than {DEEPEST} levels")
    for operand in operands:
        _check(operand, text, level + 1)


def values_of(text: str, times: np.ndarray, key: str) -> np.ndarray:
    """Return the values of an expression at times [s], (t,).

    Raises:
        SceneError: a value is not finite; it names the key `key`, the part of the expression and the first time.
    """
    tree, t = kept(text), np.asarray(times, float)
    return evaluated(lambda source: _value(tree, t, source), Told(text.strip(), key))


def plain_values(text: str, times: np.ndarray) -> np.ndarray:
    """Return the values of an expression at times [s], (t,), finite or not."""
    with np.errstate(all="ignore"):
        return _value(kept(text), np.asarray(times, float), None)


@dataclass(frozen=True)
class Told:
    """What the refusal of a value names."""

    text: str
    """Of the whole expression."""
    where: str
    """Its key."""

    def refuse(self, node: ast.expr, t: np.ndarray, values: np.ndarray, quantity: str = "") -> None:
        """Raise a SceneError for a part of the expression with a value that is not finite."""
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            term = f"{quantity}'{shown(node, self.text)}'"
            raise SceneError(f"{self.where}: {term} is not a finite number at t = {t[bad[0]]:.6g} s")


def evaluated(evaluate: Callable[[Told | None], np.ndarray], source: Told) -> np.ndarray:
    """Return the numbers of an expression, whose parts are looked at where one of them may not be finite: to look at
    each of them takes longer than to evaluate it."""
    try:
        with np.errstate(divide="raise", over="raise", invalid="raise", under="ignore"):
            result = evaluate(None)
        if np.isfinite(result).all():
            return result
    except FloatingPointError:
        pass
    with np.errstate(all="ignore"):
        return evaluate(source)


def _value(node: ast.expr, t: np.ndarray, source: Told | None) -> np.ndarray:
    if isinstance(node, ast.Constant):
        return np.full(len(t), float(node.value))  # type: ignore[arg-type]
    if isinstance(node, ast.Name):
        return t if node.id == "t" else np.full(len(t), np.pi)
    if isinstance(node, ast.BinOp):
        result = OPERATORS[type(node.op)](_value(node.left, t, source), _value(node.right, t, source))
    elif isinstance(node, ast.UnaryOp):
        result = _value(node.operand, t, source) * (-1.0 if isinstance(node.op, ast.USub) else 1.0)
    else:
        assert isinstance(node, ast.Call)
        assert isinstance(node.func, ast.Name)
        result = FUNCTIONS[node.func.id][0](*(_value(a, t, source) for a in node.args))
    if source is not None:
        source.refuse(node, t, result)
    return result


def shown(node: ast.expr, text: str) -> str:
    """Return the part of an expression's text that a node stands for."""
    return ast.get_source_segment(text, node) or text


class _Slower(ast.NodeTransformer):
    def __init__(self, time: float) -> None:
        self._time = time

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return ast.BinOp(node, ast.Div(), ast.Constant(self._time)) if node.id == "t" else node


def in_units(text: str, time: float, value: float) -> str:
    """Return an expression with its numbers in other units: `time` and `value` are the factors on t and on results."""
    tree = _Slower(time).visit(parsed(text))
    return ast.unparse(ast.fix_missing_locations(ast.BinOp(tree, ast.Mult(), ast.Constant(value))))
