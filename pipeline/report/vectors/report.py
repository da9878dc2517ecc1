"""`gudgeon report` of a scene with `report.vectors`: its runs are the bases under the force that travels; the standing
force and the price of vectors for another place are tables beside them."""

from collections.abc import Sequence
from importlib.metadata import version

from gudgeon.pipeline.measuring.clock import Seconds
from gudgeon.pipeline.measuring.machine import machine
from gudgeon.pipeline.report.choice import choose
from gudgeon.pipeline.report.document import Document, Errors, Quantity, Run, StageSeconds, Table
from gudgeon.pipeline.report.effort import Effort, command_text
from gudgeon.pipeline.report.front import with_front
from gudgeon.pipeline.report.page.output import report_folder, write_report
from gudgeon.pipeline.report.series import chain, settling
from gudgeon.pipeline.report.vectors.comparison import ROOT, TITLES, UNDER, Comparison, VectorRow, compare
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run_report import Progress

PICTURE = "vectors.png"
TIMING = (
    "CPU seconds from the assembled matrices to the last time step: factorisation of the stiffness and normal modes"
    " where a basis needs them, each taken once; its vectors and the time steps, least of {repeat} runs of each, one"
    " after the other. Warm: factor and normal modes at hand. All nodal degrees of freedom are run once."
)


def vectors_report(job: Job, how: Effort, progress: Progress) -> Document:
    """Compare the bases and write `report.{json,csv,png,html}` and `vectors.png` into the job's folder.

    Args:
        how: Its timed runs are those of each price and of each basis.

    Raises:
        InputError: the scene names no such force, or its body is not held.
    """
    with report_folder(job.out, job.name, PICTURE):
        return _report(job, how, progress)


def _report(job: Job, how: Effort, progress: Progress) -> Document:
    found = compare(job, how.repeat, progress)
    runs = with_front([_nodal_run(found), *(_run(found, row) for row in _moving(found))])
    document = Document(
        scene=job.name,
        command=command_text(job.path, job.overrides, how),
        reference={"kind": "nodal", "source": f"all {found.dofs:,} nodal dofs, the same {found.steps:,} time steps"},
        machine=machine(),
        version=version("gudgeon"),
        quantities=[_quantity(name, unit, found) for name, unit in ((UNDER, "m"), (ROOT, "Pa"))],
        runs=runs,
        left_out=[],
        changes=[],
        choice=choose(runs, how.tolerance),
        notes=[f"{found.settings.places} places, {found.steps:,} steps in {found.duration * 1e3:g} ms."],
        tables=[*(_case_table(found, case) for case in TITLES), _price_table(found)],
        timing=TIMING.format(repeat=how.repeat),
    )
    from gudgeon.pipeline.report.vectors.picture import draw

    draw(found, job.out / PICTURE)
    write_report(document, job.out, picture=(job.out / PICTURE).read_bytes())
    progress("report", 1.0)
    return document


def _moving(found: Comparison) -> list[VectorRow]:
    return [row for row in found.rows if row.case == "moving"]


def _name(row: VectorRow) -> str:
    return f"{row.basis}, {row.vectors} vectors"


def _nodal_run(found: Comparison) -> Run:
    finer = f"all nodal dofs, {2 * found.steps:,} steps"
    return _blank(
        f"all nodal dofs, {found.steps:,} steps", "nodal", "all nodal dofs", found, found.dofs, {},
        (None, "all nodal dofs"), (found.time_error["moving"], finer), {"solve": StageSeconds(found.nodal, None)},
        found.nodal_mib,
    )  # fmt: skip


def _run(found: Comparison, row: VectorRow) -> Run:
    taken = row.taken
    assert taken is not None
    cold = Seconds(taken.before.wall + taken.generation.wall, taken.before.cpu + taken.generation.cpu)
    return _blank(
        _name(row), "reduced", row.basis, found, row.vectors, row.errors,
        (row.errors, "all nodal dofs at the same steps"), (None, "the reference has the same steps"),
        {"modes": StageSeconds(cold, taken.generation), "solve": StageSeconds(taken.solution, taken.solution)},
        taken.peak_mib,
    )  # fmt: skip


def _blank(
    name: str, kind: str, scheme: str, found: Comparison, coordinates: int, errors: Errors,
    truncation: tuple[Errors | None, str], time: tuple[Errors | None, str], stages: dict[str, StageSeconds],
    peak_mib: float,
) -> Run:  # fmt: skip
    worst = max(errors, key=lambda key: errors[key], default=None)
    cold = [one.cold for one in stages.values() if one.cold is not None]
    return Run(
        name=name, kind=kind, scheme=scheme, settings={}, coordinates=coordinates, result="FINISHED", errors=errors,
        largest_error=None if worst is None else errors[worst], largest_of=worst, truncation=truncation[0],
        truncation_against=truncation[1], time=time[0], time_against=time[1], energy_drift=None,
        momentum_residual=None, step=found.duration / found.steps, steps=found.steps, factorisations=None,
        iterations=None, cpu_seconds=sum(one.cpu for one in cold), wall_seconds=sum(one.wall for one in cold),
        stages=stages, peak_mib=peak_mib, front=False,
    )  # fmt: skip


def _quantity(name: str, unit: str, found: Comparison) -> Quantity:
    chains = []
    for basis in dict.fromkeys(row.basis for row in _moving(found)):
        rows = [row for row in _moving(found) if row.basis == basis]
        if len(rows) > 1:
            values, apart = [row.errors[name] for row in rows], [row.apart[name] for row in rows]
            chains.append(chain("basis", [_name(row) for row in rows], [row.vectors for row in rows], values, apart))
    settles, why = settling(name, chains)
    return Quantity(name, unit, "L2", None, True, settles, why, chains)


def _case_table(found: Comparison, case: str) -> Table:
    """Return the errors of each basis by number of vectors: under the force / at the root."""
    half, counts = found.time_error[case], found.settings.counts
    twice = "" if half is None else f"; half the step changes the reference by {_cell(half)}"
    rows = []
    for basis in dict.fromkeys(row.basis for row in found.rows if row.case == case):
        cells = [found.row(case, basis, count) for count in counts]
        rows.append([basis, *("–" if cell is None else _cell(cell.errors) for cell in cells)])
    title = TITLES[case][0].upper() + TITLES[case][1:]
    note = f"Relative L2 error of the {UNDER} / of the {ROOT}, by number of vectors{twice}."
    return Table(title, ["basis", *map(str, counts)], rows, note)


def _cell(errors: Errors) -> str:
    return f"{errors[UNDER]:.1e} / {errors[ROOT]:.1e}"


def _price_table(found: Comparison) -> Table:
    columns = [
        "dofs", "vectors", "factorisation", "again, one place", "again, places together", "from scratch", "share",
        "normal modes",
    ]  # fmt: skip
    rows = [
        [f"{row['dofs']:,}", f"{row['vectors']}", *(f"{row[name]:.3g} s" for name in _PRICES),
         f"{row['again_share']:.2f}, {row['together_share']:.2f}", f"{row['normal_modes']:.3g} s"]
        for row in found.cost
    ]  # fmt: skip
    return Table("Price of vectors for one more place", columns, rows, "CPU time, assembly aside.")


_PRICES: Sequence[str] = ("factorisation", "again", "together", "scratch")
