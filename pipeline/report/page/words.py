"""Texts of numbers, settings and verdicts of a report, for its page, its picture and its printed table."""

import math
import re
import shlex
from collections.abc import Iterator, Mapping
from typing import Any

from gudgeon.pipeline.report.convergence import TOO_FEW
from gudgeon.pipeline.report.document import Choice, Document, Quantity, Run, Table, Term
from gudgeon.pipeline.scenes.reference.toml import as_toml

NOTHING = "–"
METHODS = {"reduced": "gudgeon", "nodal": "full FE", "rival": "rival"}
"""Names of the methods of `Cost`."""
COST_PARTS = {
    "integration": "integration",
    "database": "with reading and set-up",
    "first": "first run",
    "ten": "ten runs",
    "hundred": "a hundred runs",
}
COST_NOTE = (
    "CPU time on the same mesh; in brackets, over that of the first line of the same error. Set-up: reading records"
    " and compiling the scene; of full FE, assembly and factors. First run: with mesh, modes and residual flexibility."
    " Ten and a hundred runs: of the same bodies, modes from the database; full FE keeps its factors. Each setting is"
    " the one of its method with the least integration time; settings are judged by the conservative error, full FE by"
    " the total one."
)
ORDERS = "In brackets: observed order; without: values that are not monotone, or an order below 0.5, taken as 0.5."
SHARE = "of_the_change"
"""Ending of the keys of a design change whose value is an error over the effect of the change."""
PERCENT = 1e-3
"""Relative errors from this size on are written in per cent."""
SETTLES = {
    True: "converges",
    False: "does not converge over this sweep: not fitted",
    None: TOO_FEW,
}


def error_text(value: float | None, measure: str = "relative", unit: str = "") -> str:
    """Return an error, with its sign unless it is an L2 norm."""
    if value is None or not math.isfinite(value):
        return NOTHING
    if value == 0:
        return "0"
    sign = "" if measure == "L2" else "+"
    if measure == "absolute":
        text = f"{value:{sign}.1e} {unit}".rstrip()
    else:
        text = f"{value:{sign}.2%}" if abs(value) >= PERCENT else f"{value:{sign}.1e}"
    return f"−{text[1:]}" if value < 0 else text


def size_text(value: float | None) -> str:
    """Return the absolute value of a relative error."""
    return error_text(None if value is None else abs(value), "L2")


def seconds_text(value: float | None) -> str:
    """Return a duration with three digits, in s, ms or µs."""
    if value is None:
        return NOTHING
    if value >= 99.95:
        return f"{value:,.0f} s"
    size, unit = (1.0, "s") if value >= 0.0999 else (1e-3, "ms") if value >= 0.999e-4 else (1e-6, "µs")
    return f"{value / size:.3g} {unit}"


def step_text(value: float) -> str:
    """Return a time step in µs."""
    return f"{value * 1e6:.4g} µs"


def count_text(value: float) -> str:
    """Return a whole number with commas between thousands."""
    return f"{value:,.0f}"


def tick_text(value: float) -> str:
    """Return a relative error as the label of an axis."""
    return f"{value * 100:g}%" if value >= 0.99e-4 else f"{value:.0e}"


def edge_text(value: float) -> str:
    """Return an edge length in mm."""
    return f"{value * 1e3:.3g} mm"


def run_lines(index: int, run: Run, error: float, quantity: str) -> list[str]:
    """Return the text of a point of the chart: number and name of its run, errors, times and sizes.

    Args:
        index: Number of the run, from 0.
        error: The error that is drawn.
        quantity: Quantity of that error; empty for the conservative error.
    """
    largest = f"{size_text(run.largest_error)} largest error, of {run.largest_of}"
    lines = [f"{index + 1}  {run.name}", f"{size_text(error)} {quantity}" if quantity else largest]
    if not quantity and run.largest_error is not None and error > run.largest_error:
        lines.append(f"{size_text(error)} conservative error")
    for label, errors in (("truncation", run.truncation), ("time", run.time)):
        if errors and (component := errors.get(quantity or run.largest_of or "")) is not None:
            lines.append(f"{label} error: {size_text(component)}")
    lines.append(f"CPU {seconds_text(run.cpu_seconds)}, wall {seconds_text(run.wall_seconds)}")
    steps = "" if run.steps is None else f", {count_text(run.steps)} steps"
    return [*lines, f"{count_text(run.coordinates)} coordinates{steps}", run.scheme]


def setting_texts(run: Run) -> list[str]:
    """Return the settings of a run in the form of `--set`."""
    return [f"{path}={as_toml(value)}" for path, value in _paths(run.settings)]


def run_settings(run: Run) -> list[str]:
    """Return the settings of a run, and with which runs its errors are computed."""
    components = (
        ("truncation error", run.truncation, run.truncation_against),
        ("time error", run.time, run.time_against),
    )
    against = [
        f"{label}: {NOTHING if errors is None else 'against'} {text}" for label, errors, text in components if text
    ]
    return setting_texts(run) + against


def flagged(document: Document) -> list[Quantity]:
    """Return the quantities that do not settle over the sweep."""
    return [quantity for quantity in document.quantities if quantity.converges is False]


def machine_text(document: Document) -> str:
    """Return processor, cores and versions in one line."""
    machine = document.machine
    words = [str(machine.get("cpu", "unknown processor"))]
    if "cores" in machine:
        words.append(f"{machine['cores']} cores")
    words += [f"{key} {value}" for key, value in machine.items() if key not in ("cpu", "cores")]
    return ", ".join(words)


def verdict(document: Document) -> str:
    """Return the run chosen for the tolerance, or the reason why there is none."""
    choice = document.choice
    if choice is None:
        return "No tolerance was given; with --tolerance 1% the fastest run of that accuracy is selected."
    if choice.run is None:
        return f"Tolerance {tick_text(choice.tolerance)}: {choice.why}"
    return (
        f"{choice.run} meets {tick_text(choice.tolerance)}: error {size_text(choice.error)} ({choice.of}),"
        f" {seconds_text(choice.cpu_seconds)} of CPU time; {choice.why}"
    )


def headline(document: Document) -> str:
    """Return in one line what was gained: the accuracy, its CPU time, how much less that is than full FE's, and what of
    the model itself is less certain than that.
    """
    choice = document.choice
    if choice is None:
        return f"{document.scene}: error against run time"
    tolerance = tick_text(choice.tolerance)
    if choice.run is None:
        return f"{document.scene}: no setting meets {tolerance}"
    text = f"{document.scene}: {tolerance} accuracy in {seconds_text(choice.cpu_seconds)}"
    costs = {c.method: c.integration for c in document.costs if c.tolerance == choice.tolerance}
    reduced, full = costs.get("reduced"), costs.get("nodal")
    if reduced and full:
        gained = f"{full / reduced:.3g} × less CPU time than full FE"
        text += f": {gained if full > reduced else f'full FE takes {seconds_text(full)}, nothing is gained'}"
    return text + _uncertain(document, choice)


def _uncertain(document: Document, choice: Choice) -> str:
    """Return the largest term of the chosen run's error budget, if it exceeds the tolerance."""
    budget = document.budget
    if budget is None or budget.run != choice.run:
        return ""
    uncertain = [(t.bound, t) for t in budget.terms if t.bound is not None and t.bound > choice.tolerance]
    size, term = max(uncertain, key=lambda item: item[0], default=(0.0, None))
    return "" if term is None else f"; but {term.source} ±{term_text(size)} ({term.of})"


def use_text(document: Document) -> str:
    """Return the command that runs the chosen setting; empty if there is none."""
    if document.choice is None or document.choice.run is None:
        return ""
    command = re.sub(r" --(tolerance|repeat) \S+", "", document.command).replace("gudgeon report", "gudgeon run", 1)
    if document.kind == "conductor":
        run = next(r for r in document.runs if r.name == document.choice.run)
        return " ".join([command, *(f"--set {shlex.quote(text)}" for text in setting_texts(run))])
    return f"{command} --tolerance {tick_text(document.choice.tolerance)}"


def reference_text(document: Document) -> str:
    """Return what the reference is, with the estimate of its own largest error where there is one."""
    uncertainties = [(q.uncertainty, q.name) for q in document.quantities if q.counts and q.uncertainty is not None]
    uncertainty = (
        ""
        if not uncertainties
        else f"; its own error is estimated as {size_text(max(uncertainties)[0])} ({max(uncertainties)[1]})"
    )
    return f"{document.reference['source']}{uncertainty}"


def budget_text(document: Document) -> str:
    """Return what dominates the error of the run of the budget; empty if the report has no budget."""
    if document.budget is None:
        return ""
    estimated = [(t.bound, t) for t in document.budget.terms if t.bound is not None]
    terms = sorted(estimated, key=lambda item: -item[0])
    unknown = [f"{t.source} {t.how}" for t in document.budget.terms if t.missing]
    words = [f"{t.source} {term_text(size)}" for size, t in terms] or ["no term is estimated"]
    if terms:
        words[0] += f" ({terms[0][1].of})"
    return f"Error budget of {document.budget.run}: {' > '.join(words)}{''.join(f'; {text}' for text in unknown)}"


def term_text(size: float) -> str:
    """Return the size of a term of an error budget; infinite where an impact is missing on one of the sides."""
    return size_text(size) if math.isfinite(size) else "infinite"


def budget_table(document: Document) -> Table | None:
    """Return the error budget as a table, quantity by quantity; None if the report has none."""
    if document.budget is None:
        return None
    terms = [t for t in document.budget.terms if t.errors]
    rows = [
        [q.name, *(_term_text(term, q.name) for term in terms), "yes" if q.counts else "no"]
        for q in document.quantities
        if any(q.name in term.errors for term in terms)
    ]
    note = " ".join(f"{t.source.capitalize()}: {t.how}." for t in document.budget.terms)
    columns = ["quantity", *(term.source for term in terms), "counts"]
    return Table(f"Error budget of {document.budget.run}", columns, rows, f"{note} {ORDERS}")


def _term_text(term: Term, name: str) -> str:
    order = term.orders.get(name)
    return size_text(term.errors.get(name)) + ("" if order is None else f" ({order:.1f})")


def tables_of(document: Document) -> list[Table]:
    """Return the further tables of a report: design changes, and those of the kind of scene."""
    columns = list(dict.fromkeys(key for row in document.changes for key in row))
    rows = [[change_text(key, row.get(key)) for key in columns] for row in document.changes]
    changes = Table("Design changes: reuse against recompute", [key.replace("_", " ") for key in columns], rows)
    return [*cost_tables(document), *([changes] if rows else []), *document.tables]


def cost_tables(document: Document) -> list[Table]:
    """Return the table of run times by method and tolerance, with ratios to the cheapest setting; [] without costs."""
    reduced = {c.tolerance: c for c in document.costs if c.method == "reduced"}
    rows = []
    for cost in document.costs:
        best = reduced.get(cost.tolerance)
        cells = [
            _cost_text(getattr(cost, component), getattr(best, component, None), cost is best)
            for component in COST_PARTS
        ]
        rows.append([f"≤ {tick_text(cost.tolerance)}", METHODS[cost.method], cost.run, size_text(cost.error), *cells])
    columns = ["error", "method", "setting", "conservative error", *COST_PARTS.values()]
    return [Table("CPU time for an accuracy", columns, rows, COST_NOTE)] if rows else []


def _cost_text(value: float | None, reduced: float | None, itself: bool) -> str:
    if value is None or not reduced or itself:
        return seconds_text(value)
    ratio = value / reduced
    return f"{seconds_text(value)} (× {ratio:,.0f})" if ratio >= 9.95 else f"{seconds_text(value)} (× {ratio:.2g})"


def change_text(key: str, value: Any) -> str:
    """Return an entry of a design change, written by the ending of its key."""
    if isinstance(value, dict):
        return ", ".join(f"{name}: {change_text('', entry)}" for name, entry in value.items())
    if isinstance(value, bool) or not isinstance(value, int | float):
        return NOTHING if value is None else str(value)
    if key.endswith("seconds"):
        return seconds_text(value)
    if key.endswith(SHARE):
        return size_text(value)
    if key.endswith(("error", "change")):
        return error_text(value)
    return count_text(value) if isinstance(value, int) else f"{value:.4g}"


def _paths(tables: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the dotted path of each value in nested tables."""
    for key, value in tables.items():
        if isinstance(value, dict):
            yield from ((f"{key}.{path}", item) for path, item in _paths(value))
        else:
            yield key, value
