"""`gudgeon report` of a scene with `report.vectors`: how many vectors, of which kind, a force that moves needs.

Three cases of one force: static at the end of its way, suddenly applied there, and travelling. The reference is the
nodal model on the same mesh with the same time steps; what half the step changes of it is stated beside.
"""

import csv
import io
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from pipeline.errors import InputError
from pipeline.machine import machine
from pipeline.modes.normal import NormalModes, largest_count, normal_modes
from pipeline.recipes.reduction import lowest
from pipeline.recipes.ritz_vectors import RitzVectors
from pipeline.reporting import Vectors
from pipeline.scenefile import named
from pipeline.stages import Job, run_job
from pipeline.study.effort import Effort
from pipeline.textfile import write_text
from pipeline.vectors.cost import price
from pipeline.vectors.problem import problem_of
from pipeline.vectors.travelling import Root, Travel, difference, nodal_history, reduced_history, static_field

Tell = Callable[[str, float], None]
Sets = Callable[[int], Sequence[NormalModes]]
"""From a number of vectors to one set, or one for each place."""
OF_ALL = "normal + static of all places"
"""It has as many static shapes as there are places."""
SAMPLES = 20
"""Of the stress, in the time of one place."""
TITLES = {
    "static": "static, at the end of the way",
    "sudden": "suddenly applied at the end of the way",
    "moving": "travelling",
}


@dataclass(frozen=True)
class _Study:
    """What all cases share."""

    settings: Vectors
    travel: Travel
    root: Root
    source: RitzVectors
    normal: NormalModes


def vectors_report(job: Job, how: Effort, progress: Tell) -> dict[str, Any]:
    """Compare the bases and write `report.json`, `report.csv`, `cost.csv` and `report.png` into the job's folder.

    Args:
        how: Its timed runs are those of each price; the least CPU time counts.

    Returns:
        The document of `report.json`.

    Raises:
        InputError: the scene names no such force, or its body is not held.
    """
    with named(job.path, InputError):
        problem = problem_of(job)
        run_job(job, "mesh", progress)
        mesh = job.store.get(job.components()[problem.where.partition(".")[2]]["mesh"].key, "mesh")
        travel, root = problem.travel(mesh), problem.root(mesh)
    settings, model = problem.settings, travel.model
    if settings.counts[-1] > (most := largest_count(model)):
        raise InputError(f"{job.path}: report.vectors.counts: {settings.counts[-1]} given, the mesh has {most} at most")
    study = _Study(settings, travel, root, RitzVectors(model), normal_modes(model, settings.counts[-1]))
    rows, time_error = [], {}
    for case, title in TITLES.items():
        found, time_error[case] = _case(case, study, lambda share, title=title: progress(title, share))
        rows += found
    study.source.free()
    cost = price(travel, settings, how.repeat)
    for number, size in enumerate(settings.meshes):
        progress(f"price at {size:g} m", number / len(settings.meshes))
        cost += price(problem.finer(size), settings, how.repeat)
    document = {
        "scene": job.name,
        "kind": "vectors",
        "machine": machine(),
        "dofs": len(model.free),
        "counts": list(settings.counts),
        "places": settings.places,
        "steps": _steps(settings),
        "duration": travel.duration,
        "time_error": time_error,
        "rows": rows,
        "cost": cost,
    }
    write_text(job.out / "report.json", json.dumps(document, indent=1))
    write_text(job.out / "report.csv", _csv(rows))
    write_text(job.out / "cost.csv", _csv(cost))
    from pipeline.plots.vectors import draw

    draw(document, job.out / "report.png")
    progress("report", 1.0)
    return document


def vectors_text(document: dict[str, Any]) -> str:
    """Return a report as Markdown tables: errors of the displacement under the force / of the stress at the root."""
    lines = [
        f"{document['dofs']:,} dofs, {document['places']} places, {document['steps']:,} steps in"
        f" {document['duration'] * 1e3:g} ms; {document['machine']['cpu']}, {document['machine']['cores']} cores",
    ]
    for case, title in TITLES.items():
        half = document["time_error"][case]
        twice = "" if half is None else f" (half the step changes the reference by {_cell(half)})"
        lines += ["", f"| {title}{twice} | {' | '.join(map(str, document['counts']))} |"]
        lines.append("|---" * (len(document["counts"]) + 1) + "|")
        chosen = [row for row in document["rows"] if row["case"] == case]
        for basis in dict.fromkeys(row["basis"] for row in chosen):
            cells = {row["vectors"]: _cell(row) for row in chosen if row["basis"] == basis}
            lines.append(f"| {basis} | {' | '.join(cells.get(count, '–') for count in document['counts'])} |")
    lines += [
        "",
        "| dofs | vectors | factorisation | again, one place | again, places together | from scratch | share |"
        " normal modes |",
        "|---|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {row['dofs']:,} | {row['vectors']} | {row['factorisation']:.3g} s | {row['again']:.3g} s |"
        f" {row['together']:.3g} s | {row['scratch']:.3g} s | {row['again_share']:.2f}, {row['together_share']:.2f} |"
        f" {row['normal_modes']:.3g} s |"
        for row in document["cost"]
    ]
    return "\n".join(lines)


def _cell(row: dict[str, Any]) -> str:
    return f"{row['under']:.1e} / {row['root']:.1e}"


def _steps(settings: Vectors) -> int:
    return SAMPLES * settings.places * math.ceil(settings.steps / (SAMPLES * settings.places))


def _case(
    case: str, study: _Study, tell: Callable[[float], None]
) -> tuple[list[dict[str, Any]], dict[str, float] | None]:
    """Return the rows of a case, and what half the step changes of its reference."""
    travel, root, settings = study.travel, study.root, study.settings
    if case == "static":
        field = study.source.flexibility.solve(travel.loads([1.0]))[:, 0]
        exact = float(travel.loads([1.0])[:, 0] @ field)

        def fields(sets: Sequence[NormalModes]) -> dict[str, float]:
            under, ours = static_field(travel, sets[0])
            at_root = root.difference(ours[None, root.dofs], field[None, root.dofs])
            return {"under": abs(under / exact - 1), "root": at_root}

        return _rows(case, settings, _standing(study), fields), None
    travel = travel if case == "moving" else travel.standing(1.0)
    steps, samples = _steps(settings), SAMPLES * settings.places
    reference = nodal_history(travel, root, steps, samples, lambda share: tell(0.3 * share))
    finer = nodal_history(travel, root, 2 * steps, samples, lambda share: tell(0.3 + 0.6 * share))
    halved = {
        "under": difference(reference.under, finer.under[1::2]),
        "root": root.difference(reference.root, finer.root),
    }

    def histories(sets: Sequence[NormalModes]) -> dict[str, float]:
        ours = reduced_history(travel, root, sets, steps, samples)
        at_root = root.difference(ours.root, reference.root)
        return {"under": difference(ours.under, reference.under), "root": at_root}

    return _rows(case, settings, _travelling(study) if case == "moving" else _standing(study), histories), halved


def _standing(study: _Study) -> dict[str, Sets]:
    """Return the bases of a force at the end of its way."""
    load, aside, source, normal = study.travel.loads([1.0]), study.travel.loads([0.5]), study.source, study.normal
    return {
        "normal": lambda n: [lowest(normal, n)],
        "normal + static": lambda n: [source.generate(load, n, lowest(normal, n - 1))],
        "Ritz": lambda n: [source.generate(load, n)],
        "normal + Ritz, half each": lambda n: [source.generate(load, n, lowest(normal, n // 2))],
        "Ritz of half the way, kept": lambda n: [source.generate(aside, n)],
    }


def _travelling(study: _Study) -> dict[str, Sets]:
    """Return the bases of a force that travels: made again at each place, or once."""
    travel, places, source, normal = study.travel, study.settings.places, study.source, study.normal
    middles = [(number + 0.5) / places for number in range(places)]
    loads, together, half = [travel.loads([x]) for x in middles], travel.loads(middles), travel.loads([0.5])
    return {
        "normal": lambda n: [lowest(normal, n)],
        "normal + static, again at each place": lambda n: source.generate_all(loads, n, lowest(normal, n - 1)),
        "Ritz, again at each place": lambda n: source.generate_all(loads, n),
        "normal + Ritz, half each, again": lambda n: source.generate_all(loads, n, lowest(normal, n // 2)),
        OF_ALL: lambda n: [source.generate(together, n, lowest(normal, n - places))],
        "Ritz of all places": lambda n: [source.generate(together, n)],
        "Ritz of half the way, kept": lambda n: [source.generate(half, n)],
    }


def _rows(
    case: str, settings: Vectors, bases: dict[str, Sets], compared: Callable[[Sequence[NormalModes]], dict[str, float]]
) -> list[dict[str, Any]]:
    """Return the errors of each basis at each count that it can have."""
    least = {OF_ALL: settings.places + 1}
    return [
        {"case": case, "basis": basis, "vectors": count} | compared(sets(count))
        for basis, sets in bases.items()
        for count in settings.counts
        if count >= least.get(basis, 1)
    ]


def _csv(rows: list[dict[str, Any]]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]))
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
