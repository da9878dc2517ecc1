"""`gudgeon report` of a scene with `report.vectors`: the error of each kind and number of vectors under a moving force.

Its runs are bases at each number of vectors. The ordinary sweep has neither vectors that change along the path nor full
FE under a moving force. Here both use the same time steps, so that they differ by the truncation error only.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.measuring.clock import fastest
from gudgeon.pipeline.measuring.memory import peak_memory
from gudgeon.pipeline.modes.normal import largest_count
from gudgeon.pipeline.report.choice import choose
from gudgeon.pipeline.report.convergence import chain, settling
from gudgeon.pipeline.report.document import Document, Errors, Quantity, Run, StageSeconds, Table
from gudgeon.pipeline.report.effort import Effort, new_document
from gudgeon.pipeline.report.front import with_front
from gudgeon.pipeline.report.page.output import report_folder, write_report
from gudgeon.pipeline.report.reference import largest
from gudgeon.pipeline.report.vectors.bases import Price, Source, bases_of, price_table, prices
from gudgeon.pipeline.report.vectors.problem import problem_of
from gudgeon.pipeline.report.vectors.travelling import (
    History,
    Root,
    Travel,
    difference,
    nodal_history,
    reduced_history,
)
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.scenes.report import Vectors
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.run_report import Progress

SAMPLES = 20
"""Samples of the stress while the force passes one place."""
UNDER, ROOT = "displacement under the force", "stress at the root"
TIMING = (
    "CPU time from the assembled matrices to the last time step: factorisation of the stiffness and normal modes where"
    " a basis needs them, each measured once; vectors and time steps, least of {repeat} successive runs."
    " Warm: without factorisation and normal modes. Full FE is run once."
)


class Comparison(NamedTuple):
    """Runs of every basis at each number of vectors, and the CPU time of the vectors of one more place."""

    nodal: Run
    """Full FE; its time error is against half the step."""
    runs: list[Run]
    """`scheme` is the basis, `coordinates` the number of vectors."""
    apart: dict[str, Errors]
    """Name of a run → its difference from the largest number of vectors of its basis."""
    prices: list[Price]

    def errors(self, basis: str, count: int) -> Errors | None:
        """Return the errors of a number of vectors of a basis, None where the basis needs more."""
        found = [run.errors for run in self.runs if (run.scheme, run.coordinates) == (basis, count)]
        return found[0] if found else None


def vectors_report(job: Job, how: Effort, progress: Progress) -> Document:
    """Compare the bases and write `report.{json,csv,png,html}` into the job's folder.

    Raises:
        InputError: the scene has no such force, or its body is not fully supported.
    """
    settings, duration = job.scene.report.vectors, job.scene.run.duration
    assert settings is not None
    with report_folder(job.out, job.name):
        found = compare(job, how.repeat, progress)
        runs, steps = with_front([found.nodal, *found.runs]), steps_of(settings)
        source = f"full FE, {found.nodal.coordinates:,} dofs, the same {steps:,} time steps"
        document = replace(
            new_document(job, how),
            reference={"kind": "nodal", "source": source},
            quantities=[_quantity(name, unit, found) for name, unit in ((UNDER, "m"), (ROOT, "Pa"))],
            runs=runs,
            choice=choose(runs, how.tolerance),
            notes=[f"{settings.places} places, {steps:,} steps in {duration * 1e3:g} ms."],
            tables=[_table(found, settings.counts), price_table(found.prices)],
            timing=TIMING.format(repeat=how.repeat),
        )
        write_report(document, job.out)
    progress("report", 1.0)
    return document


def compare(job: Job, repeat: int, progress: Progress) -> Comparison:
    """Compare the bases with full FE at the same time steps.

    Args:
        repeat: Timed runs of each basis and of each CPU time of vectors.

    Raises:
        InputError: the scene has no such force, or its body is not fully supported.
    """
    with named(job.path, InputError):
        problem = problem_of(job)
        run_job(job, "mesh", progress)
        mesh = job.store.get(job.components()[problem.name]["mesh"].key, "mesh")
        travel, root, settings = problem.travel(mesh), problem.root(mesh), problem.settings
    if settings.counts[-1] > (most := largest_count(travel.model)):
        raise InputError(f"{job.path}: report.vectors.counts: {settings.counts[-1]} given, the mesh has {most} at most")
    nodal, reference = _nodal(travel, root, settings, lambda share: progress("full FE", share))
    runs, answers = _runs(travel, root, settings, reference, repeat, progress)
    last = {run.scheme: answer for run, answer in zip(runs, answers, strict=True)}
    apart = {run.name: _apart(root, answer, last[run.scheme]) for run, answer in zip(runs, answers, strict=True)}
    cost = prices(travel, settings, repeat)
    for number, size in enumerate(settings.meshes):
        progress(f"CPU time of vectors at {size:g} m", number / len(settings.meshes))
        cost += prices(problem.finer(size), settings, repeat)
    return Comparison(nodal, runs, apart, cost)


def steps_of(settings: Vectors) -> int:
    """Return the number of time steps of a run, a multiple of the places and the samples."""
    return SAMPLES * settings.places * math.ceil(settings.steps / (SAMPLES * settings.places))


def _nodal(travel: Travel, root: Root, settings: Vectors, tell: Callable[[float], None]) -> tuple[Run, History]:
    """Return full FE as a run, with its time error against half the step, and its results as the reference."""
    steps, samples = steps_of(settings), SAMPLES * settings.places
    with peak_memory() as peak:
        found, taken = fastest(lambda: nodal_history(travel, root, steps, samples, lambda x: tell(0.3 * x)), 1)
    finer = nodal_history(travel, root, 2 * steps, samples, lambda x: tell(0.3 + 0.6 * x))
    finer = History(finer.under[1::2], finer.root)
    run = Run(
        f"full FE, {steps:,} steps", "nodal", "full FE", {}, len(travel.model.free), "FINISHED",
        errors={}, truncation_against="full FE", time=_apart(root, found, finer),
        time_against=f"full FE, {2 * steps:,} steps", step=travel.duration / steps, steps=steps,
        cpu_seconds=taken.cpu, wall_seconds=taken.wall, stages={"solve": StageSeconds(taken, None)}, peak_mib=peak.mib,
    )  # fmt: skip
    return run, found


def _runs(
    travel: Travel, root: Root, settings: Vectors, reference: History, repeat: int, progress: Progress
) -> tuple[list[Run], list[History]]:
    """Return a run of each basis at each number of vectors that it can have, and its results."""
    runs, answers, steps, samples = [], [], steps_of(settings), SAMPLES * settings.places
    source, bases = Source.of(travel, settings.counts[-1]), bases_of(travel, settings.places)
    able = [(basis, count) for basis in bases for count in settings.counts if count >= basis.least]
    for number, (basis, count) in enumerate(able):
        progress("bases", number / len(able))
        with peak_memory() as peak:
            sets, made = fastest(lambda basis=basis, count=count: source.make(basis, count), repeat)
            ours, solved = fastest(lambda sets=sets: reduced_history(travel, root, sets, steps, samples), repeat)
        before, errors = source.before(basis, count), _apart(root, ours, reference)
        cold = before + made
        taken, (worst, size) = cold + solved, largest(errors, set(errors))
        run = Run(
            f"{basis.name}, {count} vectors", "reduced", basis.name, {}, count, "FINISHED", errors=errors,
            largest_error=size, largest_of=worst, truncation=errors,
            truncation_against="full FE at the same steps",
            time_against="the reference has the same steps", step=travel.duration / steps, steps=steps,
            cpu_seconds=taken.cpu, wall_seconds=taken.wall,
            stages={"modes": StageSeconds(cold, made), "solve": StageSeconds(solved, solved)}, peak_mib=peak.mib,
        )  # fmt: skip
        runs.append(run)
        answers.append(ours)
    source.ritz.free()
    return runs, answers


def _apart(root: Root, one: History, other: History) -> Errors:
    return {UNDER: difference(one.under, other.under), ROOT: root.difference(one.root, other.root)}


def _quantity(name: str, unit: str, found: Comparison) -> Quantity:
    chains = []
    for basis in dict.fromkeys(run.scheme for run in found.runs):
        runs = [run for run in found.runs if run.scheme == basis]
        if len(runs) > 1:
            values, apart = [run.errors[name] for run in runs], [found.apart[run.name][name] for run in runs]
            chains.append(chain("basis", [run.name for run in runs], [run.coordinates for run in runs], values, apart))
    settles, why = settling(name, chains)
    return Quantity(name, unit, "L2", None, counts=True, converges=settles, why=why, chains=chains)


def _table(found: Comparison, counts: Sequence[int]) -> Table:
    """Return the errors of each basis by number of vectors: under the force / at the root."""
    rows = [
        [basis, *(_cell(found.errors(basis, count)) for count in counts)]
        for basis in dict.fromkeys(run.scheme for run in found.runs)
    ]
    note = (
        f"Relative L2 error of the {UNDER} / of the {ROOT}, by number of vectors. Time error of the reference, from"
        f" half the step: {_cell(found.nodal.time)}."
    )
    return Table("Moving force", ["basis", *map(str, counts)], rows, note)


def _cell(errors: Errors | None) -> str:
    return "–" if errors is None else f"{errors[UNDER]:.1e} / {errors[ROOT]:.1e}"
