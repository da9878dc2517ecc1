"""Medians, ratios and targets from the runs that were kept."""

import csv
import io
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from statistics import median
from typing import Any

OURS = "gudgeon"
PEERS = ("scipy", "ngsolve", "exudyn", "calculix")
REFERENCES = ("scipy", "ngsolve", "exudyn", OURS)
"""Those with our discretisation: the first that ran is what frequencies are compared with."""
LARGEST_DIFFERENCE = {"exudyn": 1e-3, "calculix": 1e-3}
"""Of frequencies where it is not `EQUAL`. Exudyn factorises the singular K and starts at random: at 109 k dofs two runs
left residuals of 3e-4 and 3e-2; CalculiX integrates the mass by four points and prints seven digits."""
EQUAL = 1e-10
LEAST_RATIO = 4.0
"""CPU seconds of the best peer over ours for the whole job, at 109 k dofs."""
MOST_MEMORY = 4096.0
"""Peak memory at 318 k dofs [MiB]."""


@dataclass(frozen=True)
class Row:
    """One contestant on one mesh, with one number of threads: medians over its runs."""

    size: str
    dofs: int
    contestant: str
    version: str
    threads: int
    runs: int
    job_wall: float
    """From after the imports to the verified modes [s]."""
    job_cpu: float
    process_wall: float
    """Of the whole process, interpreter and imports included [s]."""
    process_cpu: float
    peak: float
    """Memory of the whole process [MiB]."""
    base_cpu: float
    """Of the imports [s]."""
    base_memory: float
    """After the imports [MiB]."""
    cpu_ratio: float | None
    """Its CPU seconds of the job over ours in one thread."""
    memory_ratio: float | None
    difference: float | None
    """Largest relative difference of its frequencies from the reference's."""
    solves: int | None
    factorisations: int | None
    residual: float | None
    verified: str
    load: float
    """Average before the runs, the largest."""
    commit: str
    """Of all runs, where they differ."""


def rows(kept: Sequence[dict[str, Any]]) -> list[Row]:
    """Return a row for each size, contestant and number of threads that ran."""
    groups: dict[tuple[str, str, int], list[dict[str, Any]]] = {}
    for run in kept:
        if "answer" in run:
            groups.setdefault((run["size"], run["contestant"], run["threads"]), []).append(run)
    found = []
    for (size, contestant, threads), runs in groups.items():
        answers = [run["answer"] for run in runs]
        ours = groups.get((size, OURS, 1))
        reference = next((groups[key] for name in REFERENCES if (key := (size, name, 1)) in groups), None)
        job = [_job(answer) for answer in answers]
        peak = median(answer["process"]["memory"] for answer in answers)
        cpu = median(cpu for _, cpu in job)
        first = answers[0]
        found.append(
            Row(
                size, runs[0]["dofs"], contestant, first["version"], threads, len(runs),
                job_wall=median(wall for wall, _ in job), job_cpu=cpu,
                process_wall=median(answer["process"]["wall"] for answer in answers),
                process_cpu=median(answer["process"]["cpu"] for answer in answers),
                peak=peak,
                base_cpu=median(answer["base"][0] for answer in answers),
                base_memory=median(answer["base"][1] for answer in answers),
                cpu_ratio=cpu / median(_job(run["answer"])[1] for run in ours) if ours else None,
                memory_ratio=peak / median(r["answer"]["process"]["memory"] for r in ours) if ours else None,
                difference=_difference(first, reference[0]["answer"]) if reference else None,
                solves=first["solves"], factorisations=first["factorisations"], residual=first["residual"],
                verified=first["verified"], load=max(answer["load"] for answer in answers),
                commit=" ".join(dict.fromkeys(answer.get("commit", "") for answer in answers)),
            )
        )  # fmt: skip
    return sorted(found, key=lambda row: (row.dofs, row.job_cpu))


def disagreements(found: Sequence[Row]) -> list[str]:
    """Return a line for each row whose frequencies are not those of the reference."""
    return [
        f"{row.size}, {row.contestant}: frequencies differ by {row.difference:.1e}, allowed {allowed:g}"
        for row in found
        if row.difference is not None and row.difference > (allowed := LARGEST_DIFFERENCE.get(row.contestant, EQUAL))
    ]


def targets(found: Sequence[Row]) -> list[str]:
    """Return a line for each target: fastest everywhere, a quarter of the best peer at 109 k, memory."""
    lines = []
    for size in dict.fromkeys(row.size for row in found):
        here = [row for row in found if row.size == size]
        ours = next((row for row in here if row.contestant == OURS and row.threads == 1), None)
        peers = [row for row in here if row.contestant != OURS]
        if ours is None:
            continue
        absent = sorted({*PEERS} - {row.contestant for row in peers})
        if absent:
            lines.append(f"{size}: not among those compared: {', '.join(absent)}")
        if not ours.commit or " " in ours.commit or "dirty" in ours.commit:
            commit = ours.commit or "no commit"
            lines.append(f"{size}: our runs are of code that was not committed or changed between them ({commit})")
        if peers:
            best = min(peers, key=lambda row: row.job_cpu)
            ratio, least = best.job_cpu / ours.job_cpu, LEAST_RATIO if size == "109k" else 1.0
            lines.append(
                _target(size, f"{ratio:.2f} times less CPU than {best.contestant}", f"{least:g}", ratio >= least)
            )
            swift = min(peers, key=lambda row: row.job_wall)
            quickest = min(row.job_wall for row in here if row.contestant == OURS)
            ratio = swift.job_wall / quickest
            text = f"{ratio:.2f} times less wall time than {swift.contestant}"
            lines.append(_target(size, text, "1", ratio >= 1))
            if size == "109k":
                ratio = ours.peak / best.peak
                lines.append(_target(size, f"{ratio:.2f} of the memory of {best.contestant}", "at most 1", ratio <= 1))
        if size == "318k":
            lines.append(_target(size, f"{ours.peak:.0f} MiB", f"at most {MOST_MEMORY:.0f}", ours.peak <= MOST_MEMORY))
    return lines


def text(found: Sequence[Row]) -> str:
    """Return the rows as a table to read."""
    heads = (
        "size", "contestant", "threads", "runs", "wall s", "CPU s", "process CPU s", "peak MiB", "base MiB",
        "CPU / ours", "memory / ours", "frequencies", "solves", "load", "verified",
    )  # fmt: skip
    body = [
        (
            row.size, row.contestant, str(row.threads), str(row.runs), f"{row.job_wall:.2f}", f"{row.job_cpu:.2f}",
            f"{row.process_cpu:.2f}", f"{row.peak:.0f}", f"{row.base_memory:.0f}", _optional(row.cpu_ratio, ".2f"),
            _optional(row.memory_ratio, ".2f"), _optional(row.difference, ".0e"), _optional(row.solves, "d"),
            f"{row.load:.1f}", row.verified,
        )
        for row in found
    ]  # fmt: skip
    widths = [max(len(line[column]) for line in [heads, *body]) for column in range(len(heads))]
    left = {0, 1, len(heads) - 1}
    return "\n".join(
        "  ".join(
            cell.ljust(width) if column in left else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in [heads, *body]
    )


def phases(kept: Sequence[dict[str, Any]]) -> str:
    """Return CPU seconds of the phases of each first run."""
    lines = {}
    for run in kept:
        if "answer" in run:
            parts = (f"{name} {cpu:.2f}" for name, (_, cpu) in run["answer"]["phases"].items())
            lines.setdefault((run["size"], run["contestant"], run["threads"]), ", ".join(parts))
    return "\n".join(
        f"{size} {name}, {threads} thread(s), CPU s: {line}" for (size, name, threads), line in lines.items()
    )


def floors(found: Sequence[Row], floor: dict[str, dict[str, Any]]) -> list[str]:
    """Return our CPU seconds over the floor: one factorisation and the solves used, as matrix products in double."""
    lines = []
    for row in found:
        if row.contestant != OURS or row.threads != 1 or row.solves is None or row.size not in floor:
            continue
        counted = floor[row.size]
        flops = counted["flops"], 4.0 * counted["nonzeros"] * row.solves
        seconds = sum(flops) / counted["rates"]["double"]
        lines.append(
            f"{row.size}: {flops[0] / 1e9:.1f} Gflop in one factorisation, {flops[1] / 1e9:.1f} in {row.solves} solves,"
            f" at {counted['rates']['double'] / 1e9:.1f} Gflop/s {seconds:.2f} s;"
            f" the job takes {row.job_cpu:.2f} CPU s, {row.job_cpu / seconds:.1f} times the floor"
        )
    return lines


def statics(found: dict[str, dict[str, Any]]) -> list[str]:
    """Return the cost of static shapes for each size."""
    lines = []
    for size, answer in found.items():
        rows, (wall, factor), (whole, cpu) = (
            answer["solves"], answer["phases"]["factor"], answer["phases"]["factor and rows"],
        )  # fmt: skip
        lines.append(
            f"{size}: {rows} contact rows, {1e3 * (cpu - factor) / rows:.2f} CPU ms a row"
            f" ({1e3 * (whole - wall) / rows:.2f} wall), beside one factorisation of {factor:.2f} CPU s; peak"
            f" {answer['process']['memory']:.0f} MiB"
        )
    return lines


def to_csv(found: Sequence[Row]) -> str:
    """Return the rows as CSV."""
    file = io.StringIO()
    writer = csv.DictWriter(file, [field.name for field in fields(Row)], lineterminator="\n")
    writer.writeheader()
    writer.writerows(asdict(row) for row in found)
    return file.getvalue()


def _job(answer: dict[str, Any]) -> tuple[float, float]:
    walls, cpus = zip(*answer["phases"].values(), strict=True)
    return sum(walls), sum(cpus)


def _difference(answer: dict[str, Any], reference: dict[str, Any]) -> float:
    pairs = zip(answer["frequencies"], reference["frequencies"], strict=True)
    return max(abs(found / exact - 1) for found, exact in pairs)


def _target(size: str, found: str, wanted: str, met: bool) -> str:
    return f"{size}: {found}, wanted {wanted}: {'met' if met else 'NOT MET'}"


def _optional(value: float | None, style: str) -> str:
    return "-" if value is None else format(value, style)
