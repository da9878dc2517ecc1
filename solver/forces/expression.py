"""Expressions of time in scene files: numbers, t, pi, + - * / **, and a few functions. Nothing else can be named."""

import ast
from functools import lru_cache

import numpy as np

from gudgeon.solver.forces.signals import FUNCTIONS, OPERATORS, Function, of_tree

LONGEST = 1000
"""Characters of an expression."""
DEEPEST = 100
"""Levels of an expression."""
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
            needed = FUNCTIONS[name]
            if len(operands) != needed or keywords:
                raise ValueError(f"'{shown(node, text)}': {name} needs {needed} argument{'s' * (needed > 1)}")
        case _:
            column = node.col_offset + 1
            raise ValueError(f"'{shown(node, text)}' at character {column} is not allowed; allowed: {ALLOWED}")
    if level > DEEPEST:
        raise ValueError(f"'{text[:40]}…' has more than {DEEPEST} levels")
    for operand in operands:
        _check(operand, text, level + 1)


@lru_cache(maxsize=1000)
def function_of(text: str, key: str) -> Function:
    """Return the function of an expression, made once.

    Args:
        key: That refusals name.
    """
    return of_tree(kept(text), text.strip(), key)


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
