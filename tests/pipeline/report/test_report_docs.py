"""docs/report.md lists the keys of a report, no more and no fewer, and what the CSV adds."""

import csv
import io
import json
import re
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from gudgeon.pipeline.report.document import SCHEMA, Budget, Chain, Choice, Document, Quantity, Run, Term, csv_text
from tests.pipeline import documents

TEXT = (Path(__file__).resolve().parents[3] / "docs" / "report.md").read_text(encoding="utf-8")
SECTIONS: list[tuple[str, Any]] = [
    ("## `report.json`", Document),
    ("### `runs`", Run),
    ("### `quantities`", Quantity),
    ("### `chains`", Chain),
    ("### `choice`", Choice),
    ("### `budget`", Budget),
    ("### `terms`", Term),
]


@pytest.mark.parametrize(("heading", "kind"), SECTIONS)
def test_every_key_is_listed(heading: str, kind: Any) -> None:
    section = re.split(r"^#", TEXT.partition(heading + "\n")[2], maxsplit=1, flags=re.MULTILINE)[0]
    listed = [
        name for row in re.findall(r"^\| (`.*?) \|", section, re.MULTILINE) for name in re.findall(r"`(.+?)`", row)
    ]
    assert sorted(listed) == sorted(field.name for field in fields(kind))


def test_version() -> None:
    assert TEXT.startswith(f"# The report, schema version {SCHEMA}\n")


def test_a_document_is_read_as_it_was_written() -> None:
    document = documents.large()
    assert Document.from_json(json.loads(json.dumps(document.as_json()))) == document
    assert any(run.conservative_error for run in document.runs)


def test_columns_of_the_csv() -> None:
    """Plain keys, then errors by quantity, then seconds by stage; one line a run."""
    document = documents.large()
    header, *rows = csv.reader(io.StringIO(csv_text(document)))
    plain = [field.name for field in fields(Run)]
    first = [name for name in header if ":" not in name and " " not in name]
    assert first == header[: len(first)]
    assert set(first) < set(plain)
    names = [quantity.name for quantity in document.quantities]
    errors = [f"{part}: {name}" for part in ("error", "truncation", "time") for name in names]
    assert header[len(first) :][: len(errors)] == errors
    budget = [f"budget {source}: {name}" for source in ("mesh", "basis", "step") for name in names]
    assert header[len(first) + len(errors) :][: len(budget)] == budget
    errors += budget
    seconds = [
        f"{s} {state} {clock}" for s in ("mesh", "solve") for state in ("cold", "warm") for clock in ("wall", "cpu")
    ]
    assert header[len(first) + len(errors) :] == seconds
    assert [row[0] for row in rows] == [run.name for run in document.runs]
    mesh = [row[header.index("budget mesh: force")] for row in rows]
    assert [value for value in mesh if value] == ["0.031"]
    assert document.budget is not None
    assert rows[mesh.index("0.031")][0] == document.budget.run
    failed = next(row for row, run in zip(rows, document.runs, strict=True) if run.result != "FINISHED")
    assert failed[header.index("error: force")] == ""
