"""`python -m docs.tools.report_listing FOLDER`: write the lists of all reports below a folder, for `make reports`.

Puts the main figures of every `report.json` and `robustness.json`, and the seconds of `seconds.csv` (scene, command,
seconds), into `docs/reports/report.json`, which names every scene; those without a report in the folder keep theirs.
Writes `docs/reports/README.md` from that file, and copies the pictures of documents.
"""

import csv
import json
import sys
from pathlib import Path
from typing import Any

from docs.tools.seeds import budget_text, read_seeds, scene_link, seeds_table
from gudgeon.pipeline.files import write_text
from tests.scenes import scene_files

Scenes = dict[str, dict[str, Any]]
"""By name, the path below `data` or `tests/validation/scenes` without `scene.toml` or `.toml`."""
ROOT = Path(__file__).resolve().parents[2]
REPORTS = ROOT / "docs" / "reports"
STANDS_FOR = {"piston": "piston/stroke", "piston/coarse": "piston/stroke"}
"""Scenes that `make reports` leaves out, and the one that replaces each: full FE finishes there in minutes."""
SHOWN = ("piston/stroke/report.png", "beam-sphere/robustness.png")
"""Pictures of reports that documents show."""
KEPT = (
    "name", "kind", "scheme", "coordinates", "result", "largest_error", "largest_of", "conservative_error",
    "cpu_seconds", "wall_seconds", "front",
)  # fmt: skip
"""Keys of a run; errors by quantity, stages and chains are only in the report of the scene."""
VERDICTS = ("right", "refused", "wrong")
"""Of the robustness cases that apply."""
HEAD = (
    "scene", "reference", "fastest run within the tolerance", "largest error", "its error budget", "CPU time",
    "full FE",
    "robustness: right", "refused", "wrong", "wall time",
)  # fmt: skip


DEFAULTS = (
    (
        "[Default settings](defaults.md) of every scene against converged runs, written by `make defaults`.",
        "",
    )
    if (REPORTS / "defaults.md").is_file()
    else ()
)
"""Lines that lead to the table of `make defaults`, once it is there."""


def main_figures(folder: Path) -> Scenes:
    """Return the main figures of all reports below a folder: reference, choice, budget, runs, verdicts and seconds."""
    found: Scenes = {}
    for path in sorted(folder.rglob("report.json")):
        report = json.loads(path.read_text(encoding="utf-8"))
        entry = found.setdefault(path.parent.relative_to(folder).as_posix(), {})
        entry |= {key: report[key] for key in ("reference", "machine", "choice")}
        budget = report.get("budget")
        terms = {} if budget is None else {term["source"]: term["size"] for term in budget["terms"]}
        entry["budget"] = None if budget is None else {"run": budget["run"], "terms": terms}
        entry["costs"] = report.get("costs", [])
        entry["runs"] = [{key: run[key] for key in KEPT} for run in report["runs"]]
    for path in sorted(folder.rglob("robustness.json")):
        entry = found.setdefault(path.parent.relative_to(folder).as_posix(), {})
        entry["robustness"] = json.loads(path.read_text(encoding="utf-8"))["counts"]
    if (folder / "seconds.csv").is_file():
        with (folder / "seconds.csv").open(newline="", encoding="utf-8") as file:
            for name, command, seconds in csv.reader(file):
                found.setdefault(name, {}).setdefault("seconds", {})[command] = float(seconds)
    return found


def scene_names() -> list[str]:
    """Return the names of all scenes."""
    return sorted(name.removesuffix(".toml").removesuffix("/scene") for name in scene_files())


def scenes_text(scenes: Scenes) -> str:
    """Return the main figures as JSON, one line per scene."""
    lines = (f"{json.dumps(name)}: {json.dumps(scenes[name], ensure_ascii=False)}" for name in sorted(scenes))
    return "{\n" + ",\n".join(lines) + "\n}\n"


def listing_text(scenes: Scenes, seeds: dict[str, Any]) -> str:
    """Return the list as Markdown: one line per scene, then the comparison with published systems."""
    timed = [sum(scene["seconds"].values()) for scene in scenes.values() if scene.get("seconds")]
    total, which = sum(timed), "" if len(timed) == len(scenes) else f" for {len(timed)} of {len(scenes)} scenes"
    machine = next((scene["machine"] for scene in scenes.values() if "machine" in scene), None)
    cases = [scene["robustness"] for scene in scenes.values() if "robustness" in scene]
    counts = {verdict: sum(one[verdict] for one in cases) for verdict in VERDICTS}
    where = "an unknown machine" if machine is None else f"{machine['cpu']}, {machine['cores']} cores"
    lines = [
        "# Reports",
        "",
        "Error against run time and robustness cases of every scene, written by `make reports`"
        + (f" in {total / 60:.0f} min{which} on {where}." if total else "."),
        "`gudgeon report SCENE` makes the page, the picture and the tables of one scene, `gudgeon robustness SCENE` its"
        " robustness cases; [report.json](report.json) has the main figures of all of them. CPU times of a row are of"
        " one run; rows were measured at different times, some on a busy machine: compare within a row.",
        "",
        f"| {' | '.join(HEAD)} |",
        "|---" * len(HEAD) + "|",
        *(f"| {' | '.join(_row(name, scenes[name]))} |" for name in sorted(scenes)),
        "",
        f"Robustness cases of all scenes: {sum(counts.values())},"
        f" {', '.join(f'{count} {verdict}' for verdict, count in counts.items())}.",
        "",
        "## CPU time for an accuracy",
        "",
        "The cheapest setting of each scene with full FE on the same mesh, one thread; in brackets, how many times as"
        " long full FE takes at its interpolated step, and the fastest rival: another basis or contact method. First"
        " run: with mesh and modes; ten and a hundred runs of the same bodies.",
        "",
        *costs_lines(scenes),
        "",
        *DEFAULTS,
        "## Comparison with published systems",
        "",
        seeds_table(scenes, seeds, "../../"),
        "",
    ]
    return "\n".join(lines)


def costs_lines(scenes: Scenes) -> list[str]:
    """Return the table of run times for accuracies, one line per scene and tolerance."""
    parts = {
        "integration": "integration", "database": "with reading and set-up", "first": "first run", "ten": "ten runs",
        "hundred": "a hundred runs",
    }  # fmt: skip
    lines = [
        f"| {' | '.join(('scene', 'error', 'run', 'full FE', *parts.values()))} |",
        f"|{'---|' * (4 + len(parts))}",
    ]
    for name, scene in sorted(scenes.items()):
        costs = scene.get("costs", [])
        for own in (one for one in costs if one["method"] == "reduced"):
            alike = [one for one in costs if one["tolerance"] == own["tolerance"]]
            full = next((one for one in alike if one["method"] == "nodal"), None)
            rivals = [one for one in alike if one["method"] == "rival" and one["integration"] is not None]
            rival = min(rivals, key=lambda one: one["integration"], default=None)
            cells = [scene_link(name, "../../"), f"≤ {own['tolerance']:.1%}", own["run"], full["run"] if full else "–"]
            cells += [_beside(own[part], full and full[part], rival and rival[part]) for part in parts]
            lines.append(f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |")
    return lines


def _beside(own: float | None, full: float | None, rival: float | None) -> str:
    """Return seconds with those of full FE and a rival over them; a dash without either."""
    if own is None:
        return "–"
    beside = (("", full), ("rival ", rival))
    ratios = [f"{word}× {other / own:.3g}" for word, other in beside if other is not None and own > 0]
    return f"{own:.3g} s" + (f" ({'; '.join(ratios)})" if ratios else "")


def _row(name: str, scene: dict[str, Any]) -> list[str]:
    choice, verdicts = scene.get("choice") or {}, scene.get("robustness", {})
    nodal = [run["cpu_seconds"] for run in scene.get("runs", []) if run["kind"] == "nodal"]
    seconds = sum(scene.get("seconds", {}).values())
    cells = [
        scene_link(name, "../../"),
        scene.get("reference", {}).get("source", _unreported(name)),
        choice.get("run") or choice.get("why") or "–",
        _number(choice.get("error"), "{:.1e}"),
        budget_text(scene, choice.get("run")),
        _number(choice.get("cpu_seconds"), "{:.3g} s"),
        f"{min(nodal):.3g} – {max(nodal):.3g} s" if nodal else "–",
        *(str(verdicts.get(verdict, "–")) for verdict in VERDICTS),
        f"{seconds:.0f} s" if seconds else "–",
    ]
    return [cell.replace("|", "/") for cell in cells]


def _unreported(name: str) -> str:
    return f"see `{STANDS_FOR[name]}`" if name in STANDS_FOR else "no report yet"


def _number(value: float | None, form: str) -> str:
    return "–" if value is None else form.format(value)


def _copy_picture(source: Path, target: Path) -> None:
    """Copy a PNG with a palette of 256 colours, which reduces it to a third of its size."""
    from PIL import Image

    target.parent.mkdir(parents=True, exist_ok=True)
    Image.open(source).convert("RGB").quantize(256, dither=Image.Dither.NONE).save(target, optimize=True)


def main(folder: Path) -> None:
    """Update figures, lists and pictures from the reports below a folder."""
    kept: Scenes = json.loads((REPORTS / "report.json").read_text(encoding="utf-8"))
    new = main_figures(folder)
    scenes = {name: kept.get(name, {}) | new.get(name, {}) for name in scene_names()}
    write_text(REPORTS / "report.json", scenes_text(scenes))
    write_text(REPORTS / "README.md", listing_text(scenes, read_seeds()))
    for name in SHOWN:
        if (folder / name).is_file():
            _copy_picture(folder / name, REPORTS / name)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
