"""The page of a report: one HTML file that is complete without network and script; the script adds interaction.

Every text of a scene is escaped; a content security policy in the page forbids it to load any file.
"""

import base64
import json
from collections.abc import Callable, Sequence
from html import escape
from importlib.resources import files
from typing import Any

from gudgeon.pipeline.report.document import Chain, Document, Quantity, Table
from gudgeon.pipeline.report.page.picture import ERROR, FRAMES, LEAST, Look, chain_chart, error_chart, looks
from gudgeon.pipeline.report.page.tables import errors_table, kind_table, quantities_table, runs_table
from gudgeon.pipeline.report.page.words import (
    SETTLES,
    budget_table,
    budget_text,
    count_text,
    edge_text,
    flagged,
    headline,
    machine_text,
    reference_text,
    seconds_text,
    size_text,
    step_text,
    tables_of,
    use_text,
    verdict,
)

SIZES: dict[str, Callable[[float], str]] = {
    "coordinates": count_text,
    "edge length": edge_text,
    "step": step_text,
    "accuracy": "{:.1g}".format,
    "spacing": "× {:.3g}".format,
}
"""Writes the size of a run, by the quantity that measures it."""
WHAT = {"basis": "coordinates", "mesh": "edge length", "grid": "spacing"}
SIGNS = {"o": "●", "s": "■", "^": "▲", "D": "◆"}
"""Characters of the marks in the legend."""
POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:"


def page(document: Document, picture: bytes | None = None) -> str:
    """Return the page of a report.

    Args:
        picture: A further picture, as PNG.
    """
    folder = files("gudgeon.pipeline.report.page")
    style, script = ((folder / name).read_text(encoding="utf-8") for name in ("page.css", "page.js"))
    title = escape(headline(document))
    return "\n".join(
        [
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{title}</title>\n<style>\n{style}</style>\n</head>\n<body>\n<main>",
            _head(document, title),
            _first(document, picture),
            _facts(document),
            *(part for part in _sections(document) if part),
            f"</main>\n{_embedded('report-data', document.as_json())}",
            f"<script>\n{script}</script>\n</body>\n</html>\n",
        ]
    )


def _head(document: Document, title: str) -> str:
    unmet = " unmet" if document.choice is not None and document.choice.run is None else ""
    flags = flagged(document)
    warning = ""
    if flags:
        names = ", ".join(escape(one.name) for one in flags)
        warning = f'<p class="bad">Not converged over this sweep; no order is fitted: {names}.</p>'
    use = f'<p class="use">Use it: <code>{escape(text)}</code></p>' if (text := use_text(document)) else ""
    return f'<h1>{title}</h1>\n<div class="verdict{unmet}"><p>{escape(verdict(document))}</p>{use}{warning}</div>'


def _facts(document: Document) -> str:
    reference = document.reference
    facts = {
        "Reference": f"{escape(reference['kind'])}: {escape(reference_text(document))}",
        "Machine": escape(machine_text(document)),
        "Version": escape(document.version),
        "Command": f"<code>{escape(document.command)}</code>",
    }
    if document.window:
        facts["Forces"] = f"filtered with a Hann window of {document.window * 1e6:g} µs, both sides"
    if document.peak_window:
        facts["Peak forces"] = f"over a window of {document.peak_window * 1e6:.3g} µs in all runs, run.window"
    if document.until:
        facts["Compared"] = f"up to {document.until * 1e3:g} ms"
    rows = "".join(f"<dt>{key}</dt><dd>{value}</dd>" for key, value in facts.items())
    budget = f'<p class="budget">{escape(text)}</p>\n' if (text := budget_text(document)) else ""
    return f'{budget}<dl class="facts">{rows}</dl>'


def _first(document: Document, picture: bytes | None) -> str:
    """Return the forces and the errors side by side, the front and the words."""
    chart = _section("Error against run time", _chart(document))
    beside = f'<div class="beside">{_picture(document, picture)}{chart}</div>' if picture is not None else chart
    return f"{beside}\n{_section('Runs on the front', kind_table(front_table(document)))}\n{WORDS}"


def front_table(document: Document) -> Table:
    """Return the runs that no other run beats in both error and time, the fastest first."""
    runs = sorted((run for run in document.runs if run.front), key=lambda run: run.cpu_seconds)
    rows = [
        [run.name, size_text(run.conservative_error), run.largest_of or "", seconds_text(run.cpu_seconds),
         count_text(run.coordinates), "" if run.step is None else step_text(run.step)]
        for run in runs
    ]  # fmt: skip
    columns = ["run", "conservative error", "largest in", "CPU time", "coordinates", "step"]
    return Table("Runs on the front", columns, rows or [["none", "", "", "", "", ""]])


WORDS = """<details class="words"><summary>Six words</summary><dl class="glossary">
<dt>conservative error</dt><dd>the largest of total, truncation and time error, so that they cannot cancel</dd>
<dt>full FE</dt><dd>the mesh with all its degrees of freedom, with contact at its nodes</dd>
<dt>truncation error</dt><dd>the run against one with a larger basis and the same step</dd>
<dt>time error</dt><dd>the run against one with a finer step and the same basis</dd>
<dt>front</dt><dd>runs that no other run beats in both error and time</dd>
<dt>R</dt><dd>residual flexibility: how far contact points give way beyond the kept modes, per force</dd>
</dl></details>"""


def _sections(document: Document) -> list[str]:
    budget = budget_table(document)
    return [
        _section(budget.title, _paragraph(budget.note) + kind_table(budget)) if budget is not None else "",
        _folded(f"All {len(document.runs)} runs", _RUNS_NOTE + runs_table(document)),
        _folded("Error of each quantity", _ERRORS_NOTE + errors_table(document)) if document.quantities else "",
        _folded("Quantities", quantities_table(document)) if document.quantities else "",
        _convergence(document),
        *(_section(one.title, _paragraph(one.note) + kind_table(one)) for one in tables_of(document)),
        _listed("Omitted settings", [f"{one['name']}: {one['why']}" for one in document.left_out]),
        _listed("Notes", document.notes),
        _section("How times were measured", _paragraph(document.timing)) if document.timing else "",
    ]


_RUNS_NOTE = (
    "<p>A blue dot marks a run on the Pareto front. The truncation error and the time error are given for the quantity"
    " with the largest error. Select a name to see the settings of the run. Stages: CPU time with an empty database,"
    " and with all records present.</p>"
)
_ERRORS_NOTE = (
    "<p>Errors are relative to the reference and signed; where the reference is zero, they are absolute, with their"
    " unit. Errors of histories are relative L2 norms. Small print: truncation error and time error.</p>"
)


def _section(title: str, body: str) -> str:
    return f"<section>\n<h2>{escape(title)}</h2>\n{body}\n</section>"


def _folded(title: str, body: str) -> str:
    return f"<section><details><summary><h2>{escape(title)}</h2></summary>\n{body}\n</details></section>"


def _paragraph(text: str) -> str:
    return f"<p>{escape(text)}</p>" if text else ""


def _chart(document: Document) -> str:
    """Return the chart of the conservative errors, and that of each quantity, hidden until the script shows it."""
    names = {"": ERROR} | {one.name: one.name for one in document.quantities}
    options = "".join(f'<option value="{escape(value)}">{escape(name)}</option>' for value, name in names.items())
    charts = "".join(
        f'<div class="chart" data-quantity="{escape(name)}"{" hidden" if name else ""}>'
        + "".join(f'<div class="{frame}">{error_chart(document, name, frame)}</div>' for frame in FRAMES)
        + "</div>"
        for name in names
    )
    legend = "".join(_legend(scheme, look) for scheme, look in looks(document).items())
    largest = ""
    if document.reference["kind"] == "finest":
        largest = (
            " The largest basis is its own reference; its truncation error is estimated by that of the next smaller"
            " basis."
        )
    notes = (
        "The chart shows the conservative error: the largest of the total error, the truncation error and the time"
        f" error of a run. Errors of opposite sign therefore cannot cancel.{largest} The line is the Pareto front: for"
        " every run above it, a run on the front is faster and no less accurate. Grey squares are full-FE runs. Of"
        " gudgeon, full FE and the rival basis, the fastest run within the tolerance has its error and CPU time beside"
        " it, and so has the most accurate setting. Numbers are those of the table of runs; a ring marks the selected"
        " run. A hollow mark on the lower edge has an error"
        f" below {LEAST:.0e}; a dotted line marks the CPU time of the reference."
    )
    return (
        f'<figure><div class="controls"><label for="quantity">Shown:</label><select id="quantity">{options}</select>'
        f'<span class="faint">Select a mark to show its run. Select a scheme in the legend to show'
        f" or hide it.</span></div>"
        f'<div id="charts">{charts}</div><ul class="legend">{legend}</ul><figcaption>{notes}</figcaption></figure>'
    )


def _legend(scheme: str, look: Look) -> str:
    mark = f'<span class="mark" style="color:{look.colour}" aria-hidden="true">{SIGNS[look.mark]}</span>'
    return (
        f'<li><button type="button" disabled aria-pressed="true" data-hides="{escape(scheme)}">{mark}'
        f"{escape(scheme)}</button></li>"
    )


def _convergence(document: Document) -> str:
    cards = [_card(document, quantity) for quantity in document.quantities if quantity.chains]
    if not cards:
        return ""
    note = (
        "<p>Difference of each value from the finest one of its chain; each line is a chain of runs that differ in one"
        " setting only. Red: not converged. Grey: fewer than three runs, not tested.</p>"
    )
    return _section("Convergence over the sweep", f'{note}<div class="cards">{"".join(cards)}</div>')


def _card(document: Document, quantity: Quantity) -> str:
    axes = axes_of(document, quantity)
    plots = "".join(
        chain_chart(quantity, what, chains, SIZES.get(what, "{:.3g}".format)) for what, chains in axes.items()
    )
    orders = [
        f"order in {escape(what)}: {' to '.join(f'{order:.1f}' for order in found)}"
        for what, chains in axes.items()
        if (found := _orders(chains))
    ]
    flag = ' class="bad"' if quantity.converges is False else ""
    return (
        f'<div class="card"><h3>{escape(quantity.name)}</h3><p{flag}>{SETTLES[quantity.converges]}'
        f"{'; ' + '; '.join(orders) if orders else ''}</p>{plots}</div>"
    )


def axes_of(document: Document, quantity: Quantity) -> dict[str, list[Chain]]:
    """Return the chains of a quantity, by the kind of their sizes: coordinates, edge length, step or accuracy."""
    runs, found = {run.name: run for run in document.runs}, {}
    for one in quantity.chains:
        what = WHAT.get(one.axis, one.axis)
        if one.axis == "step":
            steps = [runs[name].step for name in one.runs if name in runs]
            what = "step" if any(size in steps for size in one.sizes) else "accuracy"
        found.setdefault(what, []).append(one)
    return found


def _orders(chains: Sequence[Chain]) -> list[float]:
    """Return the least and the greatest order of some chains, a single one if they agree."""
    found = [chain.order for chain in chains if chain.order is not None]
    return sorted({round(min(found), 1), round(max(found), 1)}) if found else []


def _picture(document: Document, picture: bytes) -> str:
    text = base64.b64encode(picture).decode("ascii")
    alt = escape(f"{document.scene}: its runs beside the reference; the tables have the numbers")
    return _section("Force beside the reference", f'<img alt="{alt}" src="data:image/png;base64,{text}">')


def _listed(title: str, lines: Sequence[str]) -> str:
    if not lines:
        return ""
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return _section(title, f'<ul class="plain">{items}</ul>')


def _embedded(name: str, value: Any) -> str:
    """Return data for the script, escaped so that no text in it ends the element or starts another."""
    text = json.dumps(value, allow_nan=False, ensure_ascii=False)
    for sign in "<>&\u2028\u2029":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return f'<script type="application/json" id="{name}">{text}</script>'
