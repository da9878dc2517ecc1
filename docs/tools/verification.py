"""`python -m docs.tools.verification`: solve every scene that has a reference, and write the verification manual.

A case is a scene of `data` or `tests/validation/scenes` whose `[report]` names a file of expected values. Values found
are kept in `docs/verification/results.json`; the pages follow from it, from the scenes and from their references.
`--pages` writes the pages alone; names of scenes solve these alone.
"""

import argparse
import json
import re
import tempfile
from functools import reduce
from pathlib import Path
from typing import Any

from docs.tools.gallery import sentence
from gudgeon.pipeline.files import write_text
from gudgeon.pipeline.kinds import run
from gudgeon.pipeline.scenes.reading import read_tables
from tests.scenes import scene_files

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "docs" / "verification"
RESULTS = FOLDER / "results.json"
HEAD = """# Verification manual

Every scene whose answer is known by other means, solved as its file is. `make verification` solves all of them and
writes this table and a page for each. The target is exact or computed to more digits than are shown; quantity and
relative error are the worst of the case, whose page lists all. Tests that assert the errors, and more than the
scene's own quantities, are in `tests/validation`; long ones in [validation](../validation.md).

| case | what is tested | source | quantity | target | found | error | command |
|---|---|---|---|---|---|---|---|
"""
CASE = """# {id}: {title}

{sentence}.

| | |
|---|---|
| scene | [`{scene}`](../../{scene}) |
| command | `gudgeon solve {command}` |
| expected values | [`{file}`](../../{folder}/{file}) |
| tests | {tests} |
| parameters | {parameters} |

**Where the target comes from.** {derivation}

{validation}## Results

| quantity | target | found | error | estimated error |
|---|---|---|---|---|
{rows}
{below}"""
Json = dict[str, Any]
GENERAL = ("test_plans.py", "test_turned_scenes.py")
"""Tests of all scenes, whatever they are."""
FREQUENCY = re.compile(r"(\w+)\.frequency(\d+)")
"""Names of quantities that modes give, without a run."""


def cases() -> dict[str, Path]:
    """Return the scenes that have a reference and quantities to compare with it, by name."""
    found = {}
    for name, path in scene_files().items():
        report = read_tables(path).get("report", {})
        if isinstance(report.get("reference"), str) and report.get("quantities"):
            found[name.removesuffix(".toml").removesuffix("/scene")] = path
    return found


def solved(path: Path, folder: Path) -> Json:
    """Return the quantities of a scene that have a reference, with their estimated errors."""
    wanted = read_tables(path)["report"]["quantities"]
    until = "modes" if all(FREQUENCY.fullmatch(name) for name in wanted) else "solve"
    report = run(path, db=folder / "db", out=folder / "out" / path.parent.name / path.stem, until=until)
    if until == "modes":
        return {
            "result": report.result,
            "energy_drift": None,
            "quantities": frequencies(path, wanted, report.frequencies),
        }
    quantities = {}
    for name, quantity in report.quantities.items():
        if quantity.get("reference") is None:
            continue
        parts = {source: estimate(report.estimates, source, name) for source in ("step", "basis", "mesh")}
        quantities[name] = {key: quantity[key] for key in ("value", "unit", "reference", "error")} | {
            "estimates": {source: size for source, size in parts.items() if size is not None}
        }
    return {"result": report.result, "energy_drift": report.energy_drift, "quantities": quantities}


def frequencies(path: Path, wanted: dict[str, str], found: dict[str, list[Json]]) -> Json:
    """Return the frequencies of components that have a reference, with the estimated error of their mesh."""
    quantities = {}
    for name, where in wanted.items():
        component, number = FREQUENCY.fullmatch(name).groups()  # type: ignore[union-attr]
        mode = found[component][int(number) - 1]
        target = reduce(lambda node, key: node[int(key)] if isinstance(node, list) else node[key], where.split("/"),
                        reference(path)["expected"])  # fmt: skip
        target = target["value"] if isinstance(target, dict) else target
        quantities[name] = {"value": mode["frequency"], "unit": "Hz", "reference": target,
                            "estimates": {"mesh": mode["estimated_error"]}}  # fmt: skip
    return quantities


def estimate(estimates: dict[str, float], source: str, quantity: str) -> float | None:
    """Return the estimated error of a quantity by a source, None if there is none."""
    kind = "impulse" if quantity.endswith("impulse") else "force" if "force" in quantity else ""
    return estimates.get(f"{source}.{quantity}", estimates.get(f"{source}.{kind}"))


def manual(results: dict[str, Json]) -> dict[str, str]:
    """Return the pages by file name."""
    pages, rows = {}, []
    for name, path in cases().items():
        file = read_tables(path)["report"]["reference"]
        page = f"{name.replace('/', '-')}.md"
        if not results.get(name, {}).get("quantities"):
            continue
        truth = reference(path)
        quantities = results[name]["quantities"]
        worst = max(quantities, key=lambda quantity: abs(relative(quantities[quantity])))
        scene = path.relative_to(ROOT).as_posix()
        command = scene.removesuffix("/scene.toml")
        title = cell(truth["title"])
        source = sentence(path.read_text(encoding="utf-8"))
        rows.append(
            f"| [{name}]({page}) | {source or title} | {title} ({cell(truth.get('id', ''))}) | `{worst}` |"
            f" {' | '.join(row(quantities[worst])[:3])} | `gudgeon solve {command}` |\n"
        )
        pages[page] = CASE.format(
            id=name, title=title, sentence=source or title, scene=scene, command=command,
            file=file, folder=path.parent.relative_to(ROOT).as_posix(),
            tests=tests_of(name, file), parameters=parameters(truth.get("parameters", {})),
            derivation=prose(truth.get("derivation", truth.get("source", ""))),
            validation=f"**How that was checked.** {prose(truth['validation'])}\n\n" if truth.get("validation") else "",
            rows="".join(f"| `{n}` | {' | '.join(row(q))} |\n" for n, q in quantities.items()),
            below=f"Energy drift {results[name]['energy_drift']:.1e}.\n" if results[name]["energy_drift"] else "",
        )  # fmt: skip
    return {"README.md": HEAD + "".join(rows)} | pages


def reference(path: Path) -> Json:
    """Return the document of expected values of a scene."""
    return json.loads((path.parent / read_tables(path)["report"]["reference"]).read_text(encoding="utf-8"))


def row(quantity: Json) -> list[str]:
    """Return target, found, error and estimated errors of a quantity as text."""
    unit = "" if quantity["unit"] == "1" else f" {quantity['unit']}"
    stated = ", ".join(f"{source} {size:.0e}" for source, size in quantity["estimates"].items())
    value, target = (f"{number:.6g}{unit}" for number in (quantity["value"], quantity["reference"]))
    error = relative(quantity)
    return [target, value, "0" if error == 0 else f"{error:+.1e}", stated or "–"]


def relative(quantity: Json) -> float:
    """Return the error over the target, or itself where that is zero."""
    difference = quantity["value"] - quantity["reference"]
    return difference / abs(quantity["reference"]) if quantity["reference"] else difference


def tests_of(name: str, file: str) -> str:
    """Return links to the tests of a scene: those that name its file, its expected values, or their number."""
    folder, _, stem = name.partition("/")
    number = re.match(r"[A-Z]\d+(?=_)", file)
    patterns = [re.escape(file), rf"{folder}/{stem or 'scene'}\b"] + ([rf"\b{number[0]}\b(?! norm)"] if number else [])
    tests = re.compile("|".join(patterns))
    paths = sorted((ROOT / "tests/validation").rglob("test_*.py"))
    named = [path for path in paths if path.name not in GENERAL and tests.search(path.read_text(encoding="utf-8"))]
    links = (f"[{path.name}](../../{path.relative_to(ROOT).as_posix()})" for path in named)
    return ", ".join(links) or "this page alone"


def parameters(table: Json) -> str:
    """Return the parameters of a reference that are single values."""
    single = {key: value for key, value in table.items() if isinstance(value, int | float | str)}
    texts = (f"{value:g}" if isinstance(value, float) else value for value in single.values())
    return cell(", ".join(f"{key} = {text}" for key, text in zip(single, texts, strict=True)))


def cell(text: str) -> str:
    """Return a text that divides no row of a table."""
    return text.replace("|", "/").replace("\n", " ")


def prose(text: Any) -> str:
    """Return a text in which nothing is taken for markup."""
    text = text if isinstance(text, str) else " ".join(map(str, text if isinstance(text, list) else text.values()))
    escaped = "".join(f"\\{c}" if c in "*_<[" else c for c in text.replace("\n", " "))
    return escaped if escaped.endswith(".") else f"{escaped}."


def main() -> None:
    """Solve, and write."""
    parser = argparse.ArgumentParser(prog="python -m docs.tools.verification", description=__doc__)
    parser.add_argument("scenes", nargs="*", help="names of scenes; default: all")
    parser.add_argument("--pages", action="store_true", help="write the pages of the results that are there")
    asked = parser.parse_args()
    results = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
    if not asked.pages:
        with tempfile.TemporaryDirectory() as folder:
            for name, path in cases().items():
                if asked.scenes and name not in asked.scenes:
                    continue
                results[name] = solved(path, Path(folder))
                print(name, results[name]["result"], len(results[name]["quantities"]), flush=True)
                lines = (f"{json.dumps(key)}: {json.dumps(results[key])}" for key in sorted(results))
                write_text(RESULTS, "{\n" + ",\n".join(lines) + "\n}\n")
    for page, text in manual(results).items():
        write_text(FOLDER / page, text)


if __name__ == "__main__":
    main()
