"""`gudgeon report` of a wheel: error, size and run time of every choice of kept interface, against the full wheel."""

from dataclasses import replace

from gudgeon.modaldb.records.cyclic import WheelRecord
from gudgeon.pipeline.applications.wheel.budget import budget_of
from gudgeon.pipeline.applications.wheel.comparison import (
    FREQUENCY,
    FULL,
    MAGNIFICATION,
    RESPONSE,
    TUNED,
    Comparison,
    InterfaceRow,
    differences,
)
from gudgeon.pipeline.applications.wheel.cyclic.synthesis import SectorParts, sector_parts
from gudgeon.pipeline.applications.wheel.job import WheelJob
from gudgeon.pipeline.applications.wheel.response import (
    Case,
    full_modes,
    kept_dofs,
    reduced_modes,
    reduction_error,
    truncation_error,
    wheel_record,
)
from gudgeon.pipeline.applications.wheel.scene import KeptInterface
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.process.clock import Seconds, fastest
from gudgeon.pipeline.process.memory import peak_memory
from gudgeon.pipeline.report.choice import choose, judged, on_its_mesh
from gudgeon.pipeline.report.convergence import chain, settling
from gudgeon.pipeline.report.document import Document, Quantity, Run, StageSeconds, Table
from gudgeon.pipeline.report.effort import Effort, new_document
from gudgeon.pipeline.report.front import with_front
from gudgeon.pipeline.report.page.output import report_folder, write_report
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.folder import held
from gudgeon.pipeline.stages.make import keep
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.run_report import Progress

MEASURES = {FREQUENCY: "relative", TUNED: "relative", MAGNIFICATION: "relative", RESPONSE: "L2"}
UNITS = {FREQUENCY: "Hz", TUNED: "Hz", MAGNIFICATION: "1", RESPONSE: "m/N"}
PICTURE = "interfaces.png"
TIMING = (
    "CPU time from the sector's matrices to the modes and the response of the mistuned wheel, the shortest of {repeat}"
    " sequential runs of each choice; it includes the sector's own reduction, which is common to all choices. The full"
    " wheel is solved once and kept. Warm: without the sector's reduction."
)


def report_wheel(job: WheelJob, how: Effort, progress: Progress) -> Document:
    """Compare every choice and write `report.{json,csv,png,html}` and `interfaces.png` into the job's folder.

    Raises:
        InputError: a choice does not fit the mesh.
        StageError: a numerical routine failed.
    """
    from gudgeon.pipeline.applications.wheel.pictures.interfaces import draw

    with report_folder(job.out, job.name, PICTURE):
        comparison = compare(job, how, progress)
        runs = with_front(_runs(job, comparison))
        choice = choose(runs, how.tolerance)
        best = judged(runs, choice)
        row = next(r for r in comparison.rows[1:] if best is not None and r.name == best.name)
        budget = budget_of(job, comparison, row, _interface(job, row.name), progress)
        document = replace(
            new_document(job, how),
            reference={
                "kind": "nodal",
                "source": f"the mistuned wheel with all its {comparison.rows[0].coordinates:,} dofs",
            },
            quantities=_quantities(comparison),
            runs=runs,
            choice=on_its_mesh(choice, runs, budget, how.same_mesh),
            budget=budget,
            tables=[_table(comparison)],
            timing=TIMING.format(repeat=how.repeat),
        )
        with held(job.out):
            draw(comparison, job.out / PICTURE)
            write_report(document, job.out, picture=(job.out / PICTURE).read_bytes())
    progress("report", 1.0)
    return document


def compare(job: WheelJob, how: Effort, progress: Progress) -> Comparison:
    """Solve every choice, and the full wheel unless it is in the database; raises the errors of `report_wheel`."""
    run_job(job, "modes", progress)
    name, wheel = job.scene.only
    choices = job.scene.report.choices or {"as in the scene": wheel.interface}
    with named(job.path, InputError, StageError):
        case = job.case()
        # A mistake in a choice must be reported before the full wheel is solved.
        for key, choice_ in choices.items():
            kept_dofs(case.sector, choice_, f"report.choices.{key}")
        full = _full(job, case, progress)
        none = dict.fromkeys(MEASURES, 0.0)
        rows = [InterfaceRow(FULL, "full FE", full, none, 0.0, wall=full.counts["wall"])]
        reduced_sector, once = fastest(
            lambda: sector_parts(case.sector, wheel.fixed_count, f"wheel.{name}"), how.repeat
        )
        for n, (key, choice) in enumerate(choices.items()):
            progress(f"choice {n + 1} of {len(choices)}", n / len(choices))
            record, seconds = _solved(job, case, reduced_sector, (key, choice), how.repeat)
            errors = differences(record, full)
            rows.append(InterfaceRow(key, scheme_of(choice), record, errors, once.wall, wall=seconds))
    tuned = job.store.get(job.modes().key, "cyclic")
    return Comparison(
        scene=job.name,
        wheel=wheel,
        sector=tuned.quality,
        harmonics_against_full=reduction_error(tuned, full.tuned_frequencies),
        truncation_error=full.quantities["truncation_error"]["value"],
        rows=rows,
    )


def scheme_of(choice: KeptInterface) -> str:
    """Return the scheme of a choice, the same for choices that differ in the number of interface modes only."""
    return f"{choice.kept if choice.kept == 'all' else ', '.join(choice.kept) or 'none'} kept"


def _solved(
    job: WheelJob, case: Case, reduced_sector: SectorParts, choice: tuple[str, KeptInterface], repeat: int
) -> tuple[WheelRecord, float]:
    """Return the response by a choice, and the wall time of modes and response of its fastest run [s]."""
    key, interface = choice
    dofs = kept_dofs(case.sector, interface, f"report.choices.{key}")
    with peak_memory() as peak:
        mistuned, taken = fastest(lambda: reduced_modes(case, reduced_sector, dofs, True), repeat)
    pair = reduced_modes(case, reduced_sector, dofs, False), mistuned
    record = wheel_record(case, job.modes().key, interface, pair, reduced_sector.cpu_seconds)
    record.counts["peak_mib"] = peak.mib
    return record, taken.wall + record.counts["cpu_response"]


def _full(job: WheelJob, case: Case, progress: Progress) -> WheelRecord:
    """Return the response of the full wheel, from the database if it is there."""
    product = job.response(None)
    if not job.store.has(product.key):
        progress("full wheel, tuned", 0.0)
        tuned = full_modes(case, False)
        progress("full wheel, mistuned", 0.4)
        with peak_memory() as peak:
            mistuned, taken = fastest(lambda: full_modes(case, True), 1)
        progress("full wheel, direct", 0.8)
        record = wheel_record(case, job.modes().key, None, (tuned, mistuned), 0.0)
        record.quantities["truncation_error"] = {"value": truncation_error(case, record), "unit": "1"}
        record.counts["peak_mib"] = peak.mib
        record.counts["wall"] = taken.wall + record.counts["cpu_response"]
        keep(job.store, product, record)
    return job.store.get(product.key, "wheel")


def _series(comparison: Comparison) -> list[list[InterfaceRow]]:
    """Return the choices of each scheme, in the order of their number of coordinates."""
    schemes = dict.fromkeys(row.scheme for row in comparison.rows[1:])
    return [
        sorted((row for row in comparison.rows[1:] if row.scheme == scheme), key=lambda row: row.coordinates)
        for scheme in schemes
    ]


def _quantities(comparison: Comparison) -> list[Quantity]:
    quantities = []
    for name, measure in MEASURES.items():
        chains = []
        for rows in _series(comparison):
            if len(rows) > 1:
                differences_ = [differences(row.record, rows[-1].record)[name] for row in rows]
                values = [row.errors[name] for row in rows]
                names, sizes = [row.name for row in rows], [row.coordinates for row in rows]
                chains.append(chain("basis", names, sizes, values, differences_))
        settles, why = settling(name, chains)
        reference = comparison.rows[0].magnification if name == MAGNIFICATION else None
        quantities.append(Quantity(name, UNITS[name], measure, reference, True, settles, why=why, chains=chains))
    return quantities


def _runs(job: WheelJob, comparison: Comparison) -> list[Run]:
    largest = {row.name: rows[-1] for rows in _series(comparison) for row in rows}
    runs = []
    for row in comparison.rows:
        is_full = row.name == FULL
        best = None if is_full or largest[row.name] is row else largest[row.name]
        worst = max(row.errors, key=lambda name: abs(row.errors[name]))
        chosen = {"interface": _interface(job, row.name).model_dump(mode="json", exclude_none=True)}
        runs.append(
            Run(
                name=row.name, kind="nodal" if is_full else "reduced", scheme=row.scheme,
                settings={} if is_full else {"wheel": {job.scene.only[0]: chosen}}, coordinates=row.coordinates,
                result="FINISHED", errors={} if is_full else row.errors,
                largest_error=None if is_full else abs(row.errors[worst]), largest_of=None if is_full else worst,
                truncation=None if best is None else differences(row.record, best.record),
                truncation_against="all dofs" if is_full else best.name if best else "the largest basis of its scheme",
                time_against="modes have no time step", cpu_seconds=row.cpu,
                wall_seconds=row.wall_sector + row.wall, stages=_stages(row), peak_mib=row.record.counts["peak_mib"],
            )
        )  # fmt: skip
    return runs


def _interface(job: WheelJob, name: str) -> KeptInterface:
    """Return the choice of a name in the report."""
    return job.scene.report.choices.get(name) or job.wheel.interface


def _stages(row: InterfaceRow) -> dict[str, StageSeconds]:
    """Return the run time of the whole computation, and that without the sector's own reduction."""
    warm = row.record.counts["cpu_modes"] + row.record.counts["cpu_response"]
    return {"solve": StageSeconds(Seconds(row.wall_sector + row.wall, row.cpu), Seconds(row.wall, warm))}


def _table(comparison: Comparison) -> Table:
    size, wheel = comparison.sector, comparison.wheel
    note = (
        f"{wheel.sectors} sectors of {size['sector_dofs']:,} dofs, {size['face_dofs']} on a face, {wheel.fixed_count}"
        f" fixed-interface modes of each; the lowest {wheel.count} frequencies are compared, engine order"
        f" {wheel.response.engine_order}. Tuned wheel: frequencies of the harmonics and of the full wheel differ by at"
        f" most {comparison.harmonics_against_full:.1e}. Full wheel: the largest amplitude by these modes has an error"
        f" of {comparison.truncation_error:.1e} against a direct solution. The sector's own reduction takes"
        f" {comparison.rows[-1].record.counts['cpu_sector']:.2f} s of CPU time, once for all choices."
    )
    columns = [
        "kept interface", "dofs kept per face", "interface modes", "coordinates", "frequency error", "magnification",
        "its error", "response error (L2)", "CPU modes", "CPU response",
    ]  # fmt: skip
    rows = []
    for row in comparison.rows:
        errors, counts = row.errors, row.record.counts
        frequency, magnification, response = (
            f"{errors[FREQUENCY]:.1e}",
            f"{errors[MAGNIFICATION]:+.2%}",
            f"{errors[RESPONSE]:.2%}",
        )
        if row.name == FULL:
            frequency = magnification = response = "–"
        rows.append(
            [row.name, f"{row.kept}", f"{counts['interface_modes']}", f"{row.coordinates:,}", frequency,
             f"{row.magnification:.4f}", magnification, response, f"{counts['cpu_modes']:.2f} s",
             f"{counts['cpu_response']:.3f} s"]
        )  # fmt: skip
    return Table("Choices of kept interface", columns, rows, note)
