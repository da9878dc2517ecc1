"""The designs of a study: all combinations of values, random ones, a Latin hypercube, or the rows of a table."""

import csv
import io
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gudgeon.modaldb.keys import open_file
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.studies.parameters import MOST, Parameter, one_value, refuse_same

SHOWN = 80
"""Characters of a wrong cell in a message."""


@dataclass(frozen=True)
class Sampling:
    """How designs are taken from parameters."""

    kind: str = "full"
    """`full`: all combinations of values, the last parameter varying fastest; `random`: independent; `latin`: a Latin
    hypercube, each of `count` equal parts of every range taken once."""
    count: int = 0
    seed: int = 0


def sampled(parameters: Sequence[Parameter], how: Sampling) -> list[tuple[Any, ...]]:
    """Return the values of each design, in the order of the parameters.

    Raises:
        InputError: there are too many designs, or the seed is negative.
    """
    if how.kind == "full":
        lists = [p.listed() for p in parameters]
        count = math.prod(map(len, lists))
        if count > MOST:
            sizes = " × ".join(str(len(p)) for p in lists)
            raise InputError(
                f"--vary: {sizes} = {count} designs; allowed: up to {MOST}; --latin N takes N designs of them"
            )
        return list(itertools.product(*lists))
    if not 1 <= how.count <= MOST:
        raise InputError(f"--{how.kind} {how.count}: allowed: 1 to {MOST} designs")
    if how.seed < 0:
        raise InputError(f"--seed {how.seed}: allowed: 0 or more")
    return [
        tuple(parameter.at(float(fraction)) for parameter, fraction in zip(parameters, row, strict=True))
        for row in _shares(len(parameters), how)
    ]


def _shares(dimensions: int, how: Sampling) -> Any:
    """Return points of the unit cube, (count, dimensions)."""
    import numpy as np

    if how.kind == "random":
        return np.random.default_rng(how.seed).random((how.count, dimensions))
    from scipy.stats import qmc

    return qmc.LatinHypercube(dimensions, rng=how.seed).random(how.count)


def read_designs(path: Path) -> tuple[list[Parameter], list[tuple[Any, ...]]]:
    """Return the parameters of a table, with all values of their column, and the values of each design.

    The first row has paths of keys, each further row the values of a design.

    Raises:
        InputError: the file cannot be read, has no design, or a row or a cell is wrong.
    """
    rows = _rows(path)
    if not rows:
        raise InputError(f"{path}: is empty; the first row has the keys, such as body.part.velocity.2")
    paths, body = _paths(rows[0][1], path), rows[1:]
    if not body:
        raise InputError(f"{path}: has no designs below the keys in its first row")
    if len(body) > MOST:
        raise InputError(f"{path}: {len(body)} designs; allowed: up to {MOST}")
    designs, sources = [], [dict[str, str]() for _ in paths]
    for line, cells in body:
        if len(cells) != len(paths):
            raise InputError(f"{path}: row {line}: {len(cells)} cells; the first row has {len(paths)} keys")
        locations = [f"{path}: row {line}, column {n} '{name}'" for n, name in enumerate(paths, 1)]
        designs.append(tuple(_cell(cell, location) for cell, location in zip(cells, locations, strict=True)))
        for sources_of_column, value, location in zip(sources, designs[-1], locations, strict=True):
            sources_of_column.setdefault(repr(value), location)
    parameters = [
        Parameter(
            name, f"{path}: column '{name}'", tuple({repr(v): v for v in values}.values()), places=sources_of_column
        )
        for name, values, sources_of_column in zip(paths, zip(*designs, strict=True), sources, strict=True)
    ]
    return parameters, designs


def _paths(head: Sequence[str], path: Path) -> list[str]:
    """Return the keys in the first row of a table."""
    paths = [".".join(k.strip() for k in cell.split(".")) for cell in head]
    for column, key in enumerate(paths):
        if not all(key.split(".")) or ";" in key or "\t" in key:
            allowed = "path.to.key, separated by commas"
            raise InputError(f"{path}: row 1, column {column + 1}: {head[column][:SHOWN]!r} given; allowed: {allowed}")
    refuse_same(paths, f"{path}: row 1:")
    return paths


def _cell(text: str, location: str) -> Any:
    value = one_value(text)
    if value == "":
        raise InputError(f"{location}: is empty; every design needs a value ('unset' removes the key)")
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError(f"{location}: {value} given; allowed: finite numbers")
    return value


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """Return the rows of a table that are not blank, each with its number in the file."""
    try:
        with open_file(path) as file:
            text = file.read().decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or 'not UTF-8 text'})") from error
    reader = csv.reader(io.StringIO(text), strict=True)
    rows = []
    try:
        for cells in reader:
            if any(cell.strip() for cell in cells):
                rows.append((reader.line_num, cells))
    except csv.Error as error:
        raise InputError(f"{path}: row {reader.line_num}: {error}") from None
    return rows
