"""`python -m docs.tools.report_listing FOLDER`: the list of all reports below a folder, with how long they took.

Reads `report.json`, `stress.json` and `seconds.csv` (scene, command, seconds) and writes `README.md` beside them.
"""

import csv
import json
import sys
from pathlib import Path
from typing import Any

from docs.tools.seeds import seeds_table
from gudgeon.pipeline.files import write_text

SECONDS = "seconds.csv"
HEAD = (
    "scene", "reference", "cheapest run within the tolerance", "largest error", "CPU time", "nodal FE", "stress: right",
    "refused", "wrong", "took",
)  # fmt: skip


def listing_text(folder: Path) -> str:
    """Return the list as Markdown: one line a scene."""
    taken = _taken(folder / SECONDS)
    found = sorted({path.parent for name in ("report.json", "stress.json") for path in folder.rglob(name)})
    rows = [_row(folder, path, taken.get(path.relative_to(folder).as_posix(), 0.0)) for path in found]
    total = sum(taken.values())
    lines = [
        "# Reports",
        "",
        "Error against run time and extremes of every scene, written by `make reports`"
        + (f", which took {total / 60:.0f} min on {_machine(folder)}." if total else "."),
        "",
        f"| {' | '.join(HEAD)} |",
        "|---" * len(HEAD) + "|",
        *(f"| {' | '.join(row)} |" for row in rows),
        "",
        *(["## Beside the systems to outdo", "", seeds_table(folder), ""] if (folder / "seeds.toml").is_file() else []),
    ]
    return "\n".join(lines)


def _row(folder: Path, path: Path, seconds: float) -> list[str]:
    name, report, stress = path.relative_to(folder).as_posix(), _read(path / "report.json"), _read(path / "stress.json")
    choice = report.get("choice") or {}
    nodal = [run["cpu_seconds"] for run in report.get("runs", []) if run["kind"] == "nodal"]
    verdicts = stress.get("counts", {})
    cells = [
        f"[{name}]({name}/report.html)" if report else name,
        report.get("reference", {}).get("source", "–"),
        choice.get("run") or choice.get("why") or "–",
        _number(choice.get("error"), "{:.1e}"),
        _number(choice.get("cpu_seconds"), "{:.3g} s"),
        f"{min(nodal):.3g} – {max(nodal):.3g} s" if nodal else "–",
        *(str(verdicts.get(verdict, "–")) for verdict in ("right", "refused", "wrong")),
        f"{seconds:.0f} s" if seconds else "–",
    ]
    return [cell.replace("|", "/") for cell in cells]


def _number(value: float | None, form: str) -> str:
    return "–" if value is None else form.format(value)


def _machine(folder: Path) -> str:
    for path in folder.rglob("report.json"):
        machine = _read(path)["machine"]
        return f"{machine['cpu']}, {machine['cores']} cores"
    return "an unknown machine"


def _read(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def _taken(path: Path) -> dict[str, float]:
    """Return the seconds of each scene, both commands together."""
    found: dict[str, float] = {}
    if path.is_file():
        with path.open(newline="", encoding="utf-8") as file:
            for scene, _, seconds in csv.reader(file):
                found[scene] = found.get(scene, 0.0) + float(seconds)
    return found


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    write_text(folder / "README.md", listing_text(folder))
