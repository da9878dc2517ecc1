"""The table of a study: a row for each design, with its parameters, result, quantities and their stated errors."""

import importlib
import importlib.util
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gudgeon.pipeline.files import csv_text, whole_file, write_text
from gudgeon.pipeline.studies.task import MISSING, Row

TABLE, PARQUET = "study.csv", "study.parquet"
SOURCES = ("step", "basis", "mesh")
STATED = {"impulse": [f"{s}.impulse" for s in SOURCES], "force_peak": [f"{s}.force" for s in SOURCES]}
"""Quantities of which estimates of a run are the relative errors, which add up; by the last part of their names."""
NOT_REACHED = "the study ended before it"
TEXTS = ("result", "reason", "notes", "key")
"""Heads of columns of text; the others have numbers, and parameters what they were given."""


@dataclass(frozen=True)
class Table:
    """Rows of values under heads."""

    heads: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]
    """In the order of the heads; None where a design has no such value."""

    def records(self) -> list[dict[str, Any]]:
        """Return the rows as mappings, without what is missing."""
        return [
            {head: value for head, value in zip(self.heads, row, strict=True) if value is not None} for row in self.rows
        ]


def table_of(paths: Sequence[str], designs: Sequence[Sequence[Any]], reached: Mapping[int, Row]) -> Table:
    """Return the table of a study.

    Args:
        designs: Values of each design in the order of `paths`; numbered from 1.
        reached: Rows of the designs that were reached.
    """
    rows = [reached.get(n) or Row(n, MISSING, NOT_REACHED) for n in range(1, len(designs) + 1)]
    quantities, errors = _merged([[*row.quantities] for row in rows]), _merged([[*row.errors] for row in rows])
    units = {name: q["unit"] for row in reversed(rows) for name, q in row.quantities.items()}
    stated = {name for row in rows for name in row.quantities if stated_error(row, name) is not None}
    heads = ["design", *paths, "result", "reason"]
    for name in quantities:
        heads += [f"{name} [{units[name]}]", *([f"{name} error [{units[name]}]"] if name in stated else [])]
    heads += [f"relative error by {name}" for name in errors]
    heads += ["energy drift", "momentum residual", "notes", "key"]
    columns = {name: name in stated for name in quantities}
    return Table(tuple(heads), tuple(_cells(*line, columns, errors) for line in zip(rows, designs, strict=True)))


def _cells(row: Row, values: Sequence[Any], quantities: Mapping[str, bool], errors: Sequence[str]) -> tuple[Any, ...]:
    """Return the line of a design; of quantities, whether they have a column of stated errors."""
    line: list[Any] = [row.design, *values, row.result, row.reason or None]
    for name, stated in quantities.items():
        line.append(row.quantities[name]["value"] if name in row.quantities else None)
        line += [stated_error(row, name)] if stated else []
    line += [row.errors.get(name) for name in errors]
    return (*line, row.energy_drift, row.momentum_residual, "; ".join(row.notes) or None, row.key or None)


def stated_error(row: Row, name: str) -> float | None:
    """Return the estimated error of a quantity by step and basis, in its unit; None where nothing is stated."""
    errors = [row.errors[s] for s in STATED.get(name.rpartition(".")[2], ()) if s in row.errors]
    return sum(errors) * abs(row.quantities[name]["value"]) if errors and name in row.quantities else None


def write_table(folder: Path, table: Table) -> list[str]:
    """Write a table as CSV, and as Parquet where pyarrow is installed; return the names of the files."""
    text = [["" if value is None else _text(value) for value in row] for row in table.rows]
    write_text(folder / TABLE, csv_text([table.heads, *text], "\n"))
    if importlib.util.find_spec("pyarrow") is None:
        (folder / PARQUET).unlink(missing_ok=True)
        return [TABLE]
    _write_parquet(folder / PARQUET, table)
    return [TABLE, PARQUET]


def _write_parquet(path: Path, table: Table) -> None:
    arrow, parquet = importlib.import_module("pyarrow"), importlib.import_module("pyarrow.parquet")
    columns = {}
    for column, head in enumerate(table.heads):
        values = [row[column] for row in table.rows]
        kinds = {type(value) for value in values if value is not None}
        if (not kinds <= {int, float} and len(kinds) > 1) or kinds & {list, dict}:
            values = [None if value is None else _text(value) for value in values]
        elif kinds == {int, float}:
            values = [None if value is None else float(value) for value in values]
        # A column without a value has the type that it has in other studies.
        columns[head] = arrow.array(values, None if kinds else arrow.string() if head in TEXTS else arrow.float64())
    with whole_file(path) as scratch:
        parquet.write_table(arrow.table(columns), scratch)


def _text(value: Any) -> str:
    """Return a value as `--over` reads it."""
    if isinstance(value, str):
        return value
    return repr(value) if isinstance(value, float) else json.dumps(value, ensure_ascii=False)


def _merged(lists: Sequence[Sequence[str]]) -> list[str]:
    """Return all names of some lists once, each after the one that it follows in the list that has it first."""
    names_once: list[str] = []
    seen: set[str] = set()
    for names in lists:
        if seen.issuperset(names):
            continue
        position = 0
        for name in names:
            if name in seen:
                position = names_once.index(name) + 1
            else:
                names_once.insert(position, name)
                seen.add(name)
                position += 1
    return names_once


def cell_text(value: Any) -> str:
    """Return a value of a table for a page: six digits of numbers, nothing for what is missing."""
    return "" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)
