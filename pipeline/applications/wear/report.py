"""`gudgeon wear`: files and text of wear over cycles."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.modaldb.records.trajectory import WEAR
from gudgeon.pipeline.applications.wear.cycles import Asked, History, run_cycles
from gudgeon.pipeline.applications.wear.shapes import SIDES, Cycle, Shapes, Wearing, asked_period, wearing
from gudgeon.pipeline.applications.wear.surface_report import (
    surface_pictures,
    surface_rows,
    surface_sizes,
    surface_words,
)
from gudgeon.pipeline.applications.wear.surfaces import Surfaces, surfaces, worn_contacts
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import csv_text, write_sealed, write_text
from gudgeon.pipeline.stages.folder import held
from gudgeon.pipeline.stages.run_report import Progress

DOCUMENT, TABLE, PICTURE = "wear.json", "wear.csv", "wear-{}.png"
TOLERANCE = 0.01
"""Default of the largest difference of an update over the clearance."""
DIGITS = 9


@dataclass(frozen=True)
class WearReport:
    """Worn depths, volumes and updates of a wear computation over many cycles."""

    document: dict[str, Any]
    out: Path
    files: list[str]
    reason: str | None


def marks_of(cycles: float, requested: list[float]) -> list[float]:
    """Return the numbers of cycles after which shapes are written, the last one included, ascending."""
    powers = [10.0**k for k in range(int(np.log10(cycles)) + 1)] if cycles >= 1 else []
    chosen = requested or [c for c in powers if c > 1]
    if beyond := [c for c in chosen if not 0 < c <= cycles]:
        raise InputError(f"--at {beyond[0]:g}: given; allowed: numbers of cycles above 0, up to --cycles {cycles:g}")
    return sorted({*chosen, cycles})


@dataclass(frozen=True)
class Told:
    """How a scene that wears is told."""

    owners: str
    """`joints` or `contacts`."""
    sizes: Callable[[Shapes], dict[str, Any]]
    """Volume, largest depth and its place of every surface, by joint or contact and side."""
    rows: Callable[[dict[float, Shapes]], list[list[str]]]
    """The table of depths after numbers of cycles."""
    pictures: Callable[[History], list[str]]
    """Draws pictures and returns their names."""
    after: float
    """Time from which all wear counts [s]."""
    more: Callable[[], dict[str, Any]]
    """Further entries of the document."""


def run_wear(job: Any, request: Asked, period: float | None, tell: Progress) -> WearReport:
    """Wear the joints or the contacts of a scene over cycles, and write table, document and pictures.

    Args:
        period: Duration of a cycle [s]; default: the time of the run in which wear counts.

    Raises:
        InputError: nothing of the scene wears, or the folder cannot be written.
    """
    tell("wear", 0.0)
    if contacts := worn_contacts(job):
        scene: Wearing | Surfaces = surfaces(job, asked_period(job, contacts, period), tell)
    else:
        scene = wearing(job, period)
    writing = _told(scene)

    def write(history: History) -> None:
        with held(job.out):
            _write(scene, writing, request, history)

    history = run_cycles(scene, request, tell, write)
    with held(job.out):
        document, files = _write(scene, writing, request, history)
        files += writing.pictures(history)
    return WearReport(document, job.out, files, history.reason)


def _told(scene: Wearing | Surfaces) -> Told:
    if isinstance(scene, Surfaces):
        return Told(
            "contacts", lambda shapes: surface_sizes(scene, shapes), lambda marks: surface_rows(scene, marks),
            lambda history: surface_pictures(scene, history), scene.after, lambda: surface_words(scene),
        )  # fmt: skip
    return Told(
        "joints", lambda shapes: {name: _sizes(scene, name, shapes) for name in scene.joints},
        lambda marks: _rows(scene, marks), lambda history: _pictures(scene, history),
        max(scene.wear(name).after for name in scene.joints),
        lambda: _bushes(scene),
    )  # fmt: skip


def _bushes(scene: Wearing) -> dict[str, Any]:
    """Return how often the compliance of each bush was kept or computed again, by joint."""
    names = sorted(scene.estimates | scene.recomputed)
    bushes = {n: {"estimate": scene.estimates.get(n, 0.0), "recomputed": scene.recomputed.get(n, 0)} for n in names}
    return {"bushes": bushes} if bushes else {}


def _write(
    scene: Wearing | Surfaces, writing: Told, request: Asked, history: History
) -> tuple[dict[str, Any], list[str]]:
    """Write document and table of what is done so far."""
    marks = dict(history.marks)
    if history.updates:
        marks.setdefault(history.updates[-1].cycles, history.updates[-1].shapes)
    updates = [
        {"cycles": u.cycles, "step": u.step, "difference": u.difference}
        | {writing.owners: writing.sizes(u.shapes)}
        | {"quantities": u.mean.quantities}
        for u in history.updates
    ]
    document = {
        "scene": scene.job.name, "set": list(scene.job.overrides), "period": scene.period,
        "cycles": history.updates[-1].cycles if history.updates else 0.0, "asked": list(request.marks),
        "tolerance": request.tolerance, "runs": history.runs, "rejected": history.rejected, "coarse": history.coarse,
        "simulated_cycles": history.runs * (scene.job.scene.run.duration - writing.after) / scene.period,
        "first": {} if history.first is None else history.first.quantities,
        "last": {} if history.last is None else history.last.quantities,
        "reason": history.reason, "updates": updates,
        "depths": {f"{cycles:.{DIGITS}g}": {name: shape.tolist() for name, shape in shapes.items()}
                   for cycles, shapes in sorted(marks.items())},
    } | writing.more()  # fmt: skip
    write_sealed(scene.job.out / DOCUMENT, document)
    write_text(scene.job.out / TABLE, csv_text(writing.rows(marks)))
    return document, [DOCUMENT, TABLE]


def _sizes(scene: Wearing, name: str, shapes: Shapes) -> dict[str, Any]:
    """Return volume, largest depth and its angle of bearing and journal of a joint."""
    sizes, areas = {}, scene.joints[name].worn_areas()
    for side, which in enumerate(SIDES):
        depths = shapes[name][:, side]
        section, cell = np.unravel_index(int(depths.argmax()), depths.shape)
        sizes[which] = {
            "volume": float(depths.sum()) * areas[side], "depth": float(depths.max()),
            "angle": float(cell) * scene.wear(name).step, "section": int(section),
        }  # fmt: skip
    return sizes


def _rows(scene: Wearing, marks: dict[float, Shapes]) -> list[list[str]]:
    """Return the table of depths: a row for each cell, as many as the joint with the most cells has."""
    columns: list[tuple[str, list[str]]] = []
    for name in scene.joints:
        step, cells = scene.wear(name).step, scene.wear(name).cells
        columns.append((f"{name}.angle [rad]", [f"{step * k:.{DIGITS}g}" for k in range(cells)]))
        for cycles, shapes in sorted(marks.items()):
            for section, of_section in enumerate(shapes[name]):
                for which, depths in zip(SIDES, of_section, strict=True):
                    end = f" {section + 1}" if len(shapes[name]) > 1 else ""
                    if which == "bearing" or depths.any():
                        head = f"{name}.{which}{end} after {cycles:.{DIGITS}g} cycles [m]"
                        columns.append((head, [f"{depth:.{DIGITS}g}" for depth in depths]))
    longest = max(len(values) for _, values in columns)
    filled = [values + [""] * (longest - len(values)) for _, values in columns]
    return [[head for head, _ in columns], *map(list, zip(*filled, strict=True))]


def _pictures(scene: Wearing, history: History) -> list[str]:
    """Draw a picture for each joint."""
    if history.first is None or not history.updates:
        return []
    from gudgeon.pipeline.applications.wear import picture

    names = []
    for name in scene.joints:
        ends = [_shown(scene, name, c) for c in (history.first, history.last) if c is not None]
        shown = picture.Shown(
            scene.job.name, name, scene.joints[name].clearance, ends, start=scene.start()[name],
            marks={cycles: shapes[name] for cycles, shapes in sorted(history.marks.items())},
            course=[(u.cycles, float(u.shapes[name].max()), u.difference) for u in history.updates],
        )  # fmt: skip
        names.append(PICTURE.format(name))
        picture.draw(scene.job.out / names[-1], shown)
    return names


def _shown(scene: Wearing, name: str, cycle: Cycle) -> tuple[np.ndarray, np.ndarray]:
    """Return the orbit of a joint's first section (s, 2) [m] and its mean force over the angle [N/rad], (cells,)."""
    trajectory = scene.job.store.get(cycle.key, "trajectory", only=["counts", "times", "probes"])
    wear = scene.wear(name)
    time = float(trajectory.times[-1]) - wear.after
    force = np.array(trajectory.counts[WEAR][name]["impulse"][0]) / (time * wear.step)
    return trajectory.probes[f"{name}.orbit"].values[trajectory.times >= wear.after, :2], force


def wear_text(report: WearReport) -> str:
    """Return updates, depths and files as text."""
    document = report.document
    owner = "contacts" if "components" in document else "joints"
    lines = [f"{'cycles':>10} {'difference':>11}   {owner[:-1]:10} side     volume        depth         at"]
    for update in document["updates"]:
        for name, sides in update[owner].items():
            for which, size in sides.items():
                if size["volume"]:
                    lines.append(
                        f"{update['cycles']:10.6g} {update['difference']:10.2%}   {name:10} {which:8}"
                        f" {size['volume'] * 1e9:.5g} mm³  {size['depth'] * 1e6:.5g} µm"
                        f"  {np.degrees(size['angle']):.4g}°"
                        + (f", {size['height'] * 1e3:.4g} mm" if "height" in size else "")
                    )
    cycles, simulated_cycles = document["cycles"], document["simulated_cycles"]
    runs = f"{document['runs']} runs, {simulated_cycles:.6g} cycles simulated"
    extrapolated = f", {cycles:.6g} by extrapolation from them" if cycles > simulated_cycles else ""
    lines.append(f"{runs}{extrapolated}; {document['rejected']} steps repeated with fewer cycles")
    lines.append(
        "difference is the error of an update; errors of its runs by step, basis and mesh are not in it: solve"
    )
    for name, component in document.get("components", {}).items():
        lines.append(
            f"component {name}: modes computed again for {component['recomputed']} runs; else they are kept, estimated"
            f" change of frequencies or compliance up to {component['estimate']:.2%}; the moved surface has the worn"
            f" depths to {component['mismatch']:.2%} of the largest"
        )
    for name, bush in document.get("bushes", {}).items():
        lines.append(
            f"joint {name}: modes of its bush computed again for {bush['recomputed']} runs; else they are kept, wear is"
            f" estimated to change its compliance by up to {bush['estimate']:.2%}"
        )
    if document["coarse"]:
        lines.append(
            f"{document['coarse']} updates of one cycle differ by more than the tolerance"
            f" {document['tolerance']:.2%}: the motion itself differs so from run to run"
        )
    lines.append(f"results in {report.out}: {', '.join(report.files)}")
    return "\n".join(lines)


def wear_json(report: WearReport) -> str:
    """Return the document, without depths over the angle, which `wear.csv` has."""
    return json.dumps({key: v for key, v in report.document.items() if key != "depths"}, indent=1)
