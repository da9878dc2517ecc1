"""How many vectors, of which kind, a force that moves needs.

Three cases of one force: static at the end of its way, suddenly applied there, and travelling. The reference is the
nodal model on the same mesh with the same time steps; what half the step changes of it is stated beside.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.measuring.clock import Seconds, fastest
from gudgeon.pipeline.measuring.memory import peak_memory
from gudgeon.pipeline.modes.normal import NormalModes, largest_count, normal_modes
from gudgeon.pipeline.reduction.recipes.reduction import lowest
from gudgeon.pipeline.reduction.recipes.ritz_vectors import RitzVectors
from gudgeon.pipeline.report.document import Errors
from gudgeon.pipeline.report.vectors.cost import price
from gudgeon.pipeline.report.vectors.problem import problem_of
from gudgeon.pipeline.report.vectors.travelling import (
    History,
    Root,
    Travel,
    difference,
    nodal_history,
    reduced_history,
    static_field,
)
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.scenes.report import Vectors
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.run_report import Progress

OF_ALL = "normal + static of all places"
"""It has as many static shapes as there are places."""
SAMPLES = 20
"""Of the stress, in the time of one place."""
TITLES = {
    "static": "static, at the end of the way",
    "sudden": "suddenly applied at the end of the way",
    "moving": "travelling",
}
UNDER, ROOT = "displacement under the force", "stress at the root"


@dataclass(frozen=True)
class Taken:
    """What a basis takes under the force that travels."""

    before: Seconds
    """For the factorisation and the normal modes that the vectors need."""
    generation: Seconds
    """For the vectors themselves."""
    solution: Seconds
    peak_mib: float


@dataclass(frozen=True)
class VectorRow:
    """A basis of so many vectors, in one case."""

    case: str
    basis: str
    vectors: int
    errors: Errors
    """Relative L2 norms against all nodal dofs at the same time steps."""
    apart: Errors
    """The same from the largest number of vectors of its basis; only of the force that travels."""
    taken: Taken | None
    """Only of the force that travels."""


@dataclass(frozen=True)
class Comparison:
    """Every basis in every case, and the price of vectors for another place."""

    scene: str
    dofs: int
    settings: Vectors
    steps: int
    duration: float
    """[s]"""
    time_error: dict[str, Errors | None]
    """By case, what half the step changes of the reference."""
    nodal: Seconds
    """For the reference of the force that travels."""
    nodal_mib: float
    rows: list[VectorRow]
    cost: list[dict[str, Any]]

    def row(self, case: str, basis: str, vectors: int) -> VectorRow | None:
        """Return a basis of so many vectors, None where it needs more."""
        found = [row for row in self.rows if (row.case, row.basis, row.vectors) == (case, basis, vectors)]
        return found[0] if found else None


@dataclass(frozen=True)
class Basis:
    """A kind of vectors."""

    make: Callable[[int], Sequence[NormalModes]]
    """From a number of vectors to one set, or one for each place."""
    normals: Callable[[int], int] = lambda n: 0
    """How many of so many are normal modes."""
    factorised: bool = True
    """Whether the stiffness is factorised for it."""


@dataclass(frozen=True)
class _Study:
    """What all cases share."""

    settings: Vectors
    travel: Travel
    root: Root
    source: RitzVectors
    normal: NormalModes
    factorisation: Seconds
    """For the factor that the source keeps."""
    extraction: Callable[[int], Seconds]
    """For so many normal modes."""

    def before(self, basis: Basis, count: int) -> Seconds:
        """Return what comes before so many vectors of a basis."""
        parts = [self.extraction(basis.normals(count))] + [self.factorisation] * basis.factorised
        return Seconds(sum(part.wall for part in parts), sum(part.cpu for part in parts))


@dataclass
class _Found:
    """What the dynamic cases add to their rows."""

    rows: list[VectorRow] = field(default_factory=list)
    time_error: dict[str, Errors | None] = field(default_factory=dict)
    nodal: dict[str, tuple[Seconds, float]] = field(default_factory=dict)


def compare(job: Job, repeat: int, progress: Progress) -> Comparison:
    """Compare the bases.

    Args:
        repeat: Timed runs of each price and of each basis under the force that travels.

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
    extracted: dict[int, Seconds] = {0: Seconds(0.0, 0.0)}

    def extraction(count: int) -> Seconds:
        if count not in extracted:
            extracted[count] = fastest(lambda: normal_modes(model, count), 1)[1]
        return extracted[count]

    normal = normal_modes(model, settings.counts[-1])
    source, taken = fastest(lambda: RitzVectors(model), 1)
    study, found = _Study(settings, travel, root, source, normal, taken, extraction), _Found()
    for case, title in TITLES.items():
        _case(case, study, found, repeat, lambda share, title=title: progress(title, share))
    study.source.free()
    cost = price(travel, settings, repeat)
    for number, size in enumerate(settings.meshes):
        progress(f"price at {size:g} m", number / len(settings.meshes))
        cost += price(problem.finer(size), settings, repeat)
    return Comparison(
        job.name, len(model.free), settings, steps_of(settings), travel.duration, found.time_error,
        *found.nodal["moving"], found.rows, cost,
    )  # fmt: skip


def steps_of(settings: Vectors) -> int:
    """Return the number of time steps of a run, a multiple of the places and the samples."""
    return SAMPLES * settings.places * math.ceil(settings.steps / (SAMPLES * settings.places))


def _case(case: str, study: _Study, found: _Found, repeat: int, tell: Callable[[float], None]) -> None:
    """Add the rows of a case, and what half the step changes of its reference."""
    travel, root, settings = study.travel, study.root, study.settings
    if case == "static":
        flow = study.source.flexibility.solve(travel.loads([1.0]))[:, 0]
        exact = float(travel.loads([1.0])[:, 0] @ flow)
        found.time_error[case] = None
        for name, count, basis in _bases(settings, _standing(study)):
            under, ours = static_field(travel, basis.make(count)[0])
            errors = {
                UNDER: abs(under / exact - 1),
                ROOT: root.difference(ours[None, root.dofs], flow[None, root.dofs]),
            }
            found.rows.append(VectorRow(case, name, count, errors, {}, None))
        return
    moving = case == "moving"
    travel = travel if moving else travel.standing(1.0)
    steps, samples = steps_of(settings), SAMPLES * settings.places
    with peak_memory() as peak:
        reference, taken = fastest(
            lambda: nodal_history(travel, root, steps, samples, lambda share: tell(0.3 * share)), 1
        )
    found.nodal[case] = taken, peak.mib
    finer = nodal_history(travel, root, 2 * steps, samples, lambda share: tell(0.3 + 0.6 * share))
    found.time_error[case] = {
        UNDER: difference(reference.under, finer.under[1::2]),
        ROOT: root.difference(reference.root, finer.root),
    }
    histories: dict[tuple[str, int], tuple[History, Taken]] = {}
    for name, count, basis in _bases(settings, _travelling(study) if moving else _standing(study)):
        with peak_memory() as peak:
            vectors, generation = fastest(lambda basis=basis, count=count: basis.make(count), repeat if moving else 1)
            ours, solution = fastest(
                lambda vectors=vectors: reduced_history(travel, root, vectors, steps, samples), repeat if moving else 1
            )
        histories[name, count] = ours, Taken(study.before(basis, count), generation, solution, peak.mib)
    last = {name: ours for (name, _), (ours, _) in histories.items()}
    for (name, count), (ours, taken) in histories.items():
        errors, apart = _apart(root, ours, reference), _apart(root, ours, last[name]) if moving else {}
        found.rows.append(VectorRow(case, name, count, errors, apart, taken if moving else None))


def _apart(root: Root, one: History, other: History) -> Errors:
    return {UNDER: difference(one.under, other.under), ROOT: root.difference(one.root, other.root)}


def _standing(study: _Study) -> dict[str, Basis]:
    """Return the bases of a force at the end of its way."""
    load, aside, source, normal = study.travel.loads([1.0]), study.travel.loads([0.5]), study.source, study.normal
    return {
        "normal": Basis(lambda n: [lowest(normal, n)], lambda n: n, False),
        "normal + static": Basis(lambda n: [source.generate(load, n, lowest(normal, n - 1))], lambda n: n - 1),
        "Ritz": Basis(lambda n: [source.generate(load, n)]),
        "normal + Ritz, half each": Basis(
            lambda n: [source.generate(load, n, lowest(normal, n // 2))], lambda n: n // 2
        ),
        "Ritz of half the way, kept": Basis(lambda n: [source.generate(aside, n)]),
    }


def _travelling(study: _Study) -> dict[str, Basis]:
    """Return the bases of a force that travels: made again at each place, or once."""
    travel, places, source, normal = study.travel, study.settings.places, study.source, study.normal
    middles = [(number + 0.5) / places for number in range(places)]
    loads, together, half = [travel.loads([x]) for x in middles], travel.loads(middles), travel.loads([0.5])
    return {
        "normal": Basis(lambda n: [lowest(normal, n)], lambda n: n, False),
        "normal + static, again at each place": Basis(
            lambda n: source.generate_all(loads, n, lowest(normal, n - 1)), lambda n: n - 1
        ),
        "Ritz, again at each place": Basis(lambda n: source.generate_all(loads, n)),
        "normal + Ritz, half each, again": Basis(
            lambda n: source.generate_all(loads, n, lowest(normal, n // 2)), lambda n: n // 2
        ),
        OF_ALL: Basis(lambda n: [source.generate(together, n, lowest(normal, n - places))], lambda n: n - places),
        "Ritz of all places": Basis(lambda n: [source.generate(together, n)]),
        "Ritz of half the way, kept": Basis(lambda n: [source.generate(half, n)]),
    }


def _bases(settings: Vectors, bases: dict[str, Basis]) -> list[tuple[str, int, Basis]]:
    """Return each basis at each count that it can have."""
    least = {OF_ALL: settings.places + 1}
    return [
        (name, count, basis)
        for name, basis in bases.items()
        for count in settings.counts
        if count >= least.get(name, 1)
    ]
