"""The table of the systems that a folder of reports is measured against: nothing in it but what the reports hold."""

import json
import tomllib
from pathlib import Path
from typing import Any

COLUMNS = (
    "system",
    "scene",
    "reference",
    "run",
    "error",
    "of",
    "CPU time",
    "nodal FE",
    "its error",
    "CPU time",
    "ratio",
)
NOTHING = "–"


def seeds_table(folder: Path, link: str = "") -> str:
    """Return the table as Markdown, from `seeds.toml` and the reports below a folder; `link` leads to that folder.

    Of each report: the run that it chose for the tolerance, or the best, marked as missed; and the cheapest nodal run
    within the tolerance, or the finest, marked as missed. A nodal run that is the reference has no error of its own.
    """
    listed = tomllib.loads((folder / "seeds.toml").read_text(encoding="utf-8"))
    rows = [_row(folder, system, listed["tolerance"], link) for system in listed["system"]]
    head = f"| {' | '.join(COLUMNS)} |\n|{'---|' * len(COLUMNS)}"
    return "\n".join([head, *(f"| {' | '.join(row)} |" for row in rows)])


def _row(folder: Path, system: dict[str, Any], tolerance: float, link: str) -> list[str]:
    name = system.get("report")
    if name is None:
        return [system["name"], "no scene yet", *[NOTHING] * (len(COLUMNS) - 2)]
    path = folder / name / "report.json"
    if not path.is_file():
        return [system["name"], f"`{name}`", "no report yet", *[NOTHING] * (len(COLUMNS) - 3)]
    document = json.loads(path.read_text(encoding="utf-8"))
    runs = [run for run in document["runs"] if run["result"] == "FINISHED"]
    reduced = [run for run in runs if run["kind"] == "reduced" and run["largest_error"] is not None]
    choice = document["choice"] or {"run": None, "tolerance": tolerance}
    ours = next((run for run in reduced if run["name"] == choice["run"]), None) or _best(reduced, 0.0)
    nodal = _best([run for run in runs if run["kind"] == "nodal"], tolerance)
    cells = [system["name"], f"[`{name}`]({link}{name}/report.html)", document["reference"]["source"]]
    met = tolerance if choice["run"] is not None and choice["tolerance"] <= tolerance else 0.0
    cells += [ours["name"], _error(ours, met), ours["largest_of"], _seconds(ours)] if ours else [NOTHING] * 4
    cells += [nodal["name"], _error(nodal, tolerance), _seconds(nodal)] if nodal else [NOTHING] * 3
    if ours is not None and nodal is not None and ours["cpu_seconds"] > 0:
        cells.append(f"{nodal['cpu_seconds'] / ours['cpu_seconds']:,.0f}")
    else:
        cells.append(NOTHING)
    return [cell.replace("|", "/") for cell in cells]


def _best(runs: list[dict[str, Any]], tolerance: float) -> dict[str, Any] | None:
    """Return the cheapest run within the tolerance; where none is, the one nearest to it."""
    able = [run for run in runs if run["largest_error"] is None or run["largest_error"] <= tolerance]
    if able:
        return min(able, key=lambda run: run["cpu_seconds"])
    return min(runs, key=lambda run: run["largest_error"], default=None)


def _error(run: dict[str, Any], tolerance: float) -> str:
    error = run["largest_error"]
    if error is None:
        return "reference"
    text = f"{error:.2%}" if error >= 1e-4 else f"{error:.0e}"
    return text if error <= tolerance else f"{text} (missed)"


def _seconds(run: dict[str, Any]) -> str:
    return f"{run['cpu_seconds']:.3g} s"
