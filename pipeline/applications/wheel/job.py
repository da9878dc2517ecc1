"""The job of a scene of a wheel, and its stages `mesh → modes → solve`: what each makes, and what a run reports."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gudgeon.modaldb.records.cyclic import MESH_ERRORS
from gudgeon.pipeline.applications.wheel.scene import KeptInterface, Wheel, WheelFile, reduction, wrong_names
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import csv_text, write_text
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.reading import check_scene, merged, named, refuse
from gudgeon.pipeline.stages.base import Place, SceneJob
from gudgeon.pipeline.stages.keys.products import Product, component_products, plot_inputs, product
from gudgeon.pipeline.stages.notes.facts import Parts
from gudgeon.pipeline.stages.notes.registry import NOTES
from gudgeon.pipeline.stages.parts import part_row
from gudgeon.pipeline.stages.run_report import Progress, RunReport
from gudgeon.pipeline.stages.summary import SUMMARY, read_summary, seal_summary

if TYPE_CHECKING:
    from gudgeon.modaldb.records.cyclic import CyclicRecord, WheelRecord
    from gudgeon.modaldb.records.mesh import MeshRecord
    from gudgeon.pipeline.applications.wheel.case import Case

RESPONSE = "response.csv"
NOTED = 0.01
"""Estimated relative error of mesh or modes above which a note is given."""
NOT_ESTIMATED = {"step": "a harmonic response has no step"}
"""Why errors of a wheel are not estimated."""
SYMMETRY = {"sectors", "low", "high", "axis", "origin"}
BLADES = {"count", "blade_radius", "response"}
"""Settings of a wheel that its modes depend on, and those that its response depends on besides."""
QUANTITIES = (
    "magnification", "amplitude.tuned", "amplitude.mistuned", "amplitude.mistuned.at", "amplitude.mistuned.blade",
    "reduction.frequency_error",
)  # fmt: skip
"""Names of the quantities of a run."""


@dataclass(frozen=True, kw_only=True)
class WheelJob(SceneJob):
    """A checked scene of a wheel, with the places where its products go."""

    scene: WheelFile
    changes: tuple[float, ...]
    """Relative change of each blade's stiffness, (N,)."""

    @property
    def wheel(self) -> Wheel:
        """Its only wheel."""
        return self.scene.only[1]

    @property
    def component(self) -> Component:
        """The sector."""
        return self.scene.component[self.wheel.component]

    def quantities(self) -> Sequence[str]:
        """See `SceneJob`."""
        return QUANTITIES

    def mesh(self) -> Product:
        """Return the sector's mesh."""
        return self._sector()["base-mesh"]

    def modes(self) -> Product:
        """Return the modes of the tuned wheel."""
        inputs = self._sector()["modes"].inputs
        symmetry = self.wheel.model_dump(mode="json", include=SYMMETRY)
        parameters = {key: inputs[key] for key in ("mesh", "material", "supports")}
        parameters |= {"symmetry": symmetry, "mode_count": self.wheel.mode_count}
        return product("cyclic", self.scene.only[0], parameters)

    def response(self, interface: KeptInterface | None) -> Product:
        """Return the response of the wheel reduced by a choice of kept interface, or of the full wheel for None."""
        model = {} if interface is None else reduction(self.wheel, interface)
        mistuned = self.wheel.model_dump(mode="json", include=BLADES) | {"changes": list(self.changes)}
        return product("wheel", self.scene.only[0], {"modes": self.modes().key, "wheel": mistuned, "model": model})

    def pictures(self) -> dict[str, Any]:
        return plot_inputs(self.response(self.wheel.interface).key, {})

    def case(self) -> "Case":
        """Return the wheel ready to be solved; its mesh must be in the database.

        Raises:
            InputError: the scene does not fit its mesh.
        """
        from gudgeon.pipeline.applications.wheel.response import case_of

        mesh = self.store.get(self.mesh().key, "mesh")
        return case_of(mesh, self.component, self.wheel, self.scene.only[0], np.array(self.changes))

    def tuned_frequencies(self) -> tuple[str, ...]:
        """Return the fields of the record of modes that hold the frequencies of each harmonic."""
        return tuple(f"harmonics/{n}/angular_frequencies" for n in self.wheel.harmonics())

    def changed(self, changes: Mapping[str, Any]) -> "WheelJob":
        """Return the job of the scene changed by nested tables; raises InputError as `wheel_job` does."""
        return wheel_job(self.place(tables=merged(self.tables, changes), overrides=()))

    def _sector(self) -> dict[str, Product]:
        return component_products(self.wheel.component, self.component, self.path.parent)


def wheel_job(scene_place: Place) -> WheelJob:
    """Return the job of a scene of a wheel; raises InputError with every mistake of one kind listed."""
    scene = check_scene(scene_place.path, scene_place.tables, WheelFile)
    refuse(scene_place.path, wrong_names(scene))
    name, wheel = scene.only
    with named(scene_place.path, InputError):
        changes = wheel.mistuning.changes(wheel.sectors, scene_place.path.parent, f"wheel.{name}.mistuning")
    return WheelJob(**vars(scene_place), scene=scene, changes=changes)


def mesh_products(job: WheelJob) -> dict[str, Product]:
    """Return the mesh of the sector."""
    return {f"{job.wheel.component}.mesh": job.mesh()}


def modes_products(job: WheelJob) -> dict[str, Product]:
    """Return the modes of the tuned wheel."""
    return {f"{job.scene.only[0]}.modes": job.modes()}


def response_products(job: WheelJob) -> dict[str, Product]:
    """Return the response of the reduced wheel."""
    return {"solve": job.response(job.wheel.interface)}


def make_mesh(job: WheelJob, product: Product, tell: Progress) -> "MeshRecord":
    """Return the mesh of the sector."""
    from gudgeon.pipeline.stages.mesh import build_mesh

    return build_mesh(job.component, job.path.parent, job.wheel.component)


def make_modes(job: WheelJob, product: Product, tell: Progress) -> "CyclicRecord":
    """Return the modes of the tuned wheel. Heavy libraries are imported here, where they are needed."""
    from gudgeon.pipeline.applications.wheel import response as solve

    name, wheel = job.scene.only
    sector = solve.sector_of(job.store.get(job.mesh().key, "mesh"), job.component, wheel, name)
    return solve.cyclic_record(sector, job.mesh().key, job.component, wheel, name, tell)


def make_response(job: WheelJob, product: Product, tell: Progress) -> "WheelRecord":
    """Return the response of the reduced wheel."""
    from gudgeon.pipeline.applications.wheel import response as solve
    from gudgeon.pipeline.applications.wheel.cyclic.synthesis import sector_parts
    from gudgeon.pipeline.applications.wheel.estimates import mesh_estimates

    name, wheel = job.scene.only
    case = job.case()
    choice = solve.kept_dofs(case.sector, wheel.interface, f"wheel.{name}.interface")
    reduced_sector = sector_parts(case.sector, wheel.fixed_count, f"wheel.{name}")
    tell("solve", 0.3)
    pair = (
        solve.reduced_modes(case, reduced_sector, choice, False),
        solve.reduced_modes(case, reduced_sector, choice, True),
    )
    record = solve.wheel_record(case, job.modes().key, wheel.interface, pair, reduced_sector.cpu_seconds)
    qualities = [path.replace("angular_frequencies", "quality") for path in job.tuned_frequencies()]
    tuned = job.store.get(job.modes().key, "cyclic", only=[*job.tuned_frequencies(), *qualities])
    error = {"value": solve.reduction_error(tuned, record.tuned_frequencies), "unit": "1"}
    estimates = record.counts["estimates"] | mesh_estimates(tuned, float(record.excitation[-1]))
    return replace(
        record,
        quantities=record.quantities | {"reduction.frequency_error": error},
        counts=record.counts | {"estimates": estimates},
    )


def solved(job: WheelJob) -> RunReport:
    """Return the report of a wheel by its record."""
    record = job.store.get(job.response(job.wheel.interface).key, "wheel", only=["excitation"])
    estimates = record.counts.get("estimates", {})
    return RunReport(job.name, "FINISHED", {}, record.quantities, estimates=estimates, not_estimated=NOT_ESTIMATED)


def _frequencies(job: WheelJob) -> dict[str, list[dict[str, Any]]]:
    """Return the modes of every harmonic with their residuals, as rows of `frequency_table`."""
    record = job.store.get(job.modes().key, "cyclic", only=["harmonics"])
    rows = {}
    for h in sorted(record.harmonics.values(), key=lambda h: h.harmonic):
        errors = h.quality.get(MESH_ERRORS, [None] * len(h.residuals))
        rows[f"{job.wheel.component}, harmonic {h.harmonic}"] = [
            {"mode": i + 1, "frequency": float(omega / (2 * np.pi)), "estimated_error": error,
             "algebraic_bound": None, "residual": float(residual)}
            for i, (omega, error, residual) in enumerate(zip(h.angular_frequencies, errors, h.residuals, strict=True))
        ]  # fmt: skip
    return rows


def results(job: WheelJob, until: str) -> RunReport:
    """Write summary and response unless they are up to date, and return the report."""
    name = job.wheel.component
    parts = Parts(job.store, {name: job.component}, {name: job.mesh().key})
    notes = [line for note in ("units", "extents") for line in NOTES[note].text(parts)]
    if until == "mesh":
        rows = {name: part_row(job.store.get(job.mesh().key, "mesh"), job.component, name)}
        return RunReport(job.name, None, out=str(job.out), notes=notes, parts=rows)
    if until == "modes":
        return RunReport(job.name, None, out=str(job.out), notes=notes, frequencies=_frequencies(job))
    key = job.response(job.wheel.interface).key
    summary = read_summary(job.out, key, RESPONSE)
    if summary is None:
        record: WheelRecord = job.store.get(key, "wheel")
        quantities = {name: q | {"reference": None, "error": None} for name, q in record.quantities.items()}
        write_text(job.out / RESPONSE, _response_table(record))
        summary = {"key": key, "quantities": quantities, "counts": record.counts}
        summary = seal_summary(job.out, summary, RESPONSE)
    return RunReport(
        job.name,
        "FINISHED",
        {},
        summary["quantities"],
        estimates=summary["counts"].get("estimates", {}),
        not_estimated=NOT_ESTIMATED,
        out=str(job.out),
        files=(SUMMARY, RESPONSE),
        notes=[*notes, *_coarse(job, summary["counts"])],
    )


def _coarse(job: WheelJob, counts: dict[str, Any]) -> Iterator[str]:
    """Yield a note where the mesh or the modes that are left out matter."""
    estimates = counts.get("estimates", {})
    if (error := estimates.get("mesh.frequency", 0.0)) > NOTED:
        size = job.component.mesh.size
        remedy = "refine the mesh in its file" if size is None else f"set component.{job.wheel.component}.mesh.size ="
        remedy = remedy if size is None else f"{remedy} {size / 2:.3g}"
        yield (
            f"the estimated error of the mesh is {error:.1%} in frequencies of the response, and"
            f" {estimates['mesh.amplitude']:.1%} in amplitudes; {remedy}"
        )
    largest = max((value for name, value in estimates.items() if name.startswith("basis.")), default=0.0)
    if largest > NOTED:
        yield (
            f"the estimated error of the modes is {largest:.1%} in amplitudes; set wheel.{job.scene.only[0]}.count ="
            f" {2 * job.wheel.count}"
        )


def draw(job: WheelJob, tell: Progress) -> tuple[list[Path], list[str]]:
    from gudgeon.pipeline.applications.wheel.pictures import WHEEL
    from gudgeon.pipeline.plots import render

    tell("plot", 0.0)
    return render(
        job.store.location, job.response(job.wheel.interface).key, job.out, job.name, pictures=WHEEL, tell=tell
    )


def _response_table(record: "WheelRecord") -> str:
    """Return amplitudes [m/N] over frequency: of any blade of the tuned wheel, and of each of the mistuned wheel."""
    tuned, mistuned = (np.hypot(*np.moveaxis(v, -1, 0)) for v in (record.tuned, record.mistuned))
    head = ["frequency [Hz]", "tuned [m/N]", *(f"blade {j} [m/N]" for j in range(mistuned.shape[1]))]
    rows = np.column_stack([record.excitation / (2 * np.pi), tuned[:, :1], mistuned])
    return csv_text([head, *([f"{value:.9g}" for value in row] for row in rows)])
