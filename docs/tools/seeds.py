"""The comparison with published systems, made from the reports of the scenes that reproduce them."""

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tests.scenes import ROOT, scene_path

COLUMNS = (
    "system", "scene", "reference", "run", "error", "of", "its error budget", "CPU time", "full FE",
    "error of full FE", "CPU time of full FE", "ratio",
)  # fmt: skip
NOTHING = "–"


def read_seeds() -> dict[str, Any]:
    """Return the systems and the tolerance."""
    return tomllib.loads(Path(__file__).with_name("seeds.toml").read_text(encoding="utf-8"))


def seeds_table(scenes: Mapping[str, Mapping[str, Any]], seeds: Mapping[str, Any], link: str = "") -> str:
    """Return the table as Markdown.

    Of each scene: the run that its report selected for the tolerance, or the most accurate one, marked as missed; and
    the fastest full-FE run within the tolerance, or the most accurate one, marked as missed. A full-FE run that is the
    reference has no error.

    Args:
        scenes: Main figures of reports by scene, as in `docs/reports/report.json`.
        seeds: `tolerance`, and `system`, a list of names and reports.
        link: Relative path to the root of the repository.
    """
    return _table(COLUMNS, [_row(scenes, system, seeds["tolerance"], link) for system in seeds["system"]])


def _table(columns: Sequence[str], rows: list[list[str]]) -> str:
    head = f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}"
    return "\n".join([head, *(f"| {' | '.join(row)} |" for row in rows)])


def scene_link(name: str, link: str = "") -> str:
    """Return the name of a scene as a link to its file."""
    path = scene_path(f"{name}.toml" if "/" in name else f"{name}/scene.toml").relative_to(ROOT)
    return f"[`{name}`]({link}{path.as_posix()})"


def budget_text(scene: Mapping[str, Any], run: str | None) -> str:
    """Return the terms of the error budget of a run, the largest first; a dash if the report has none of this run."""
    budget = scene.get("budget")
    if budget is None or budget["run"] != run:
        return NOTHING
    terms = sorted(((size, source) for source, size in budget["terms"].items() if size is not None), reverse=True)
    return " > ".join(f"{source} {_percent(size)}" for size, source in terms) or NOTHING


def _row(scenes: Mapping[str, Mapping[str, Any]], system: dict[str, Any], tolerance: float, link: str) -> list[str]:
    name = system.get("report")
    if name is None:
        return [system["name"], "no scene yet", *[NOTHING] * (len(COLUMNS) - 2)]
    if "runs" not in (scene := scenes.get(name, {})):
        return [system["name"], f"`{name}`", "no report yet", *[NOTHING] * (len(COLUMNS) - 3)]
    runs = [run for run in scene["runs"] if run["result"] == "FINISHED"]
    reduced = [run for run in runs if run["kind"] == "reduced" and run["largest_error"] is not None]
    choice = scene["choice"] or {"run": None, "tolerance": tolerance}
    ours = next((run for run in reduced if run["name"] == choice["run"]), None) or _best(reduced, 0.0)
    nodal = _best([run for run in runs if run["kind"] == "nodal"], tolerance)
    cells = [system["name"], scene_link(name, link), scene["reference"]["source"]]
    met = tolerance if choice["run"] is not None and choice["tolerance"] <= tolerance else 0.0
    cells += [ours["name"], _error(ours, met), ours["largest_of"]] if ours else [NOTHING] * 3
    cells += [budget_text(scene, ours["name"]), _seconds(ours)] if ours else [NOTHING] * 2
    cells += [nodal["name"], _error(nodal, tolerance), _seconds(nodal)] if nodal else [NOTHING] * 3
    if ours is not None and nodal is not None and ours["cpu_seconds"] > 0:
        cells.append(f"{nodal['cpu_seconds'] / ours['cpu_seconds']:,.0f}")
    else:
        cells.append(NOTHING)
    return [cell.replace("|", "/") for cell in cells]


def _best(runs: list[dict[str, Any]], tolerance: float) -> dict[str, Any] | None:
    """Return the fastest run within the tolerance; if there is none, the most accurate one."""
    able = [run for run in runs if run["largest_error"] is None or run["largest_error"] <= tolerance]
    if able:
        return min(able, key=lambda run: run["cpu_seconds"])
    return min(runs, key=lambda run: run["largest_error"], default=None)


def _error(run: dict[str, Any], tolerance: float) -> str:
    error = run["largest_error"]
    if error is None:
        return "reference"
    text = _percent(error)
    return text if error <= tolerance else f"{text} (missed)"


def _percent(error: float) -> str:
    return f"{error:.2%}" if error >= 1e-4 else f"{error:.0e}"


def _seconds(run: dict[str, Any]) -> str:
    return f"{run['cpu_seconds']:.3g} s"
