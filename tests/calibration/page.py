"""docs/calibration.md: stated over true errors by kind of scene and by source, as a table and a picture."""

import json
from collections import defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from gudgeon.pipeline.files import write_text
from gudgeon.pipeline.plots.base import style
from tests.calibration.judged import FLOOR, LARGEST, Row
from tests.calibration.kinds import TURNS

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE, PICTURE = "calibration.md", "calibration.png"
LOW, HIGH, LEAST = 0.5, 20.0, 0.3
"""Ratios of stated to true errors that are wanted, and the one below which none is."""
SOURCES = ("step", "basis", "mesh", "total")
HEAD = """# Stated and true errors

`make calibration` draws scenes at random, over bodies, materials, loads, contacts, meshes and modes, whose answers are
known: in closed form, by a small computation of their own, or by runs that converged in one respect, whose step is an
eighth, whose modes are several times as many or whose elements are a quarter as long. It compares the error that a
default run states with the true one. `step`, `basis` and `mesh` are single sources, `total` is the sum of all against
the exact answer. Errors of probes are those of whole histories over their largest size. Errors below {floor:g} count as
that, those by a single source also below a tenth of what the figure states by another source, and errors above
{largest:.0%} count as that. A ratio of 1 is a statement that is exact.

`pytest tests/calibration` runs 30 of them with a fixed seed.

![Stated over true errors by source]({picture})

{summary}

| scenes | error | figures | least | 5 % | median | 95 % | largest | {low:g} to {high:g} |
|---|---|---|---|---|---|---|---|---|
"""


def read_rows(paths: Iterable[Path]) -> tuple[list[Row], list[dict[str, Any]], int]:
    """Return the rows of a calibration, the entries of scenes that failed, and the number of scenes."""
    entries = [json.loads(line) for path in paths for line in path.read_text(encoding="utf-8").splitlines()]
    rows = [Row(**row) for e in entries for row in e.get("rows", ())]
    order = list(dict.fromkeys(TURNS))
    rows.sort(key=lambda row: (order.index(row.kind), row.number, SOURCES.index(row.source)))
    return rows, [e for e in entries if "failed" in e], len(entries)


def write_page(rows: Sequence[Row], failed: Sequence[dict[str, Any]], count: int, folder: Path = DOCS) -> None:
    """Write page and picture of rows from a number of scenes."""
    text = HEAD.format(
        floor=FLOOR,
        largest=LARGEST,
        picture=PICTURE,
        low=LOW,
        high=HIGH,
        summary=_summary(rows, failed, count),
    )
    groups: dict[tuple[str, str], list[Row]] = defaultdict(list)
    for row in rows:
        groups[row.kind, row.source].append(row)
    lines = [_line(kind, source, group) for (kind, source), group in groups.items()]
    lines += [_line("all", source, [r for r in rows if r.source == source]) for source in SOURCES]
    write_text(folder / PAGE, text + "\n".join([*lines, "", *_outside(rows), ""]))
    draw(rows, folder / PICTURE)


def within(rows: Iterable[Row]) -> float:
    """Return the share of rows whose ratio is wanted."""
    return float(np.mean([LOW <= row.ratio <= HIGH for row in rows]))


def _summary(rows: Sequence[Row], failed: Sequence[dict[str, Any]], count: int) -> str:
    below, unstated = sum(row.ratio < LEAST for row in rows), sum(row.stated is None for row in rows)
    words = [
        f"{count} scenes, {len(rows)} errors: {within(rows):.1%} between {LOW:g} and {HIGH:g}, {below} below"
        f" {LEAST:g}.",
        f"{unstated} have no number but a reason, such as the exact motion between events; their true errors are below"
        f" {max([row.true for row in rows if row.stated is None], default=0.0):.1g}.",
    ]
    if failed:
        words.append(
            f"{len(failed)} scenes had no result: {'; '.join(sorted({e['failed'][:120] for e in failed})[:3])}."
        )
    return " ".join(words)


def _line(kind: str, source: str, rows: Sequence[Row]) -> str:
    if not rows:
        return f"| {kind} | {source} | 0 | | | | | | |"
    ratios = np.array([row.ratio for row in rows])
    numbers = [f"{value:.2g}" for value in np.quantile(ratios, [0.0, 0.05, 0.5, 0.95, 1.0])]
    return f"| {kind} | {source} | {len(rows)} | {' | '.join(numbers)} | {within(rows):.0%} |"


def _outside(rows: Sequence[Row]) -> list[str]:
    """Return the lines of all errors outside of what is wanted."""
    outside = sorted((row for row in rows if not LOW <= row.ratio <= HIGH), key=lambda row: row.ratio)
    if not outside:
        return []
    lines = [
        f"## Outside of {LOW:g} to {HIGH:g}",
        "",
        "| scene | figure | error | stated | true | ratio |",
        "|---|---|---|---|---|---|",
    ]
    for row in outside:
        stated = "–" if row.stated is None else f"{row.stated:.1e}"
        lines.append(
            f"| {row.kind} {row.number} | `{row.figure}` | {row.source} | {stated} | {row.true:.1e} | {row.ratio:.2g} |"
        )
    return lines


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw stated over true errors, a picture for each source."""
    with style.styled():
        title = "each point a figure of a scene; shaded: from half to twenty times the true error"
        figure = style.new_figure("Stated and true errors", title, width=2100, height=900)
        axes = figure.subplots(
            1,
            len(SOURCES),
            sharey=True,
            gridspec_kw={"left": 0.07, "right": 0.98, "bottom": 0.14, "top": 0.82, "wspace": 0.08},
        )
        for axis, source in zip(axes, SOURCES, strict=True):
            _draw_source(axis, source, [row for row in rows if row.source == source])
        axes[0].set_ylabel("stated relative error")
        style.save(figure, path)


def _draw_source(axis: Axes, source: str, rows: Sequence[Row]) -> None:
    limits = FLOOR / 2, 1.0
    true = np.array([min(max(row.true, FLOOR), LARGEST) for row in rows])
    stated = np.array([min(max(row.stated or 0.0, FLOOR), LARGEST) for row in rows])
    line = np.array(limits)
    axis.fill_between(line, LOW * line, HIGH * line, color=style.GROUND)
    axis.loglog(line, line, color=style.FAINT, lw=0.8)
    axis.loglog(true, stated, ".", color=style.BLUE, ms=4)
    axis.set_xlim(limits)
    axis.set_ylim(limits)
    axis.set_xlabel("true relative error")
    axis.set_title(source)
