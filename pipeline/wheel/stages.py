"""The stages of a wheel, `mesh → modes → solve → plot`: what is fresh is not made again."""

import copy
import csv
import io
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gudgeon.modaldb.records.cyclic import WheelRecord
from gudgeon.modaldb.stores.folder import FolderStore
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.files import write_text
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.reading import check_scene, merge, named
from gudgeon.pipeline.stages.base import Place
from gudgeon.pipeline.stages.pictures import plot_stage
from gudgeon.pipeline.stages.products import Product, component_products, cyclic_product, plot_inputs, wheel_product
from gudgeon.pipeline.stages.run_report import Progress, RunReport, StageReport
from gudgeon.pipeline.stages.status import remember
from gudgeon.pipeline.wheel.scene import KeptInterface, Wheel, WheelFile, reduction, wrong_names

if TYPE_CHECKING:
    from gudgeon.pipeline.wheel.response import Case

STAGES = ("mesh", "modes", "solve", "plot")
SUMMARY, RESPONSE = "summary.json", "response.csv"
SYMMETRY = {"sectors", "low", "high", "axis", "origin"}
BLADES = {"count", "blade_radius", "response"}
"""Settings of a wheel by what depends on them."""


@dataclass(frozen=True)
class WheelJob:
    """A scene of a wheel with the places where its products go."""

    kind: ClassVar[str] = "wheel"

    name: str
    path: Path
    tables: dict[str, Any]
    scene: WheelFile
    changes: tuple[float, ...]
    """Relative change of each blade's stiffness, (N,)."""
    store: FolderStore
    out: Path
    overrides: tuple[str, ...] = ()
    """Changes of the scene's file, as `--set` takes them."""

    @property
    def stages(self) -> tuple[str, ...]:
        """Names of its stages, in order."""
        return STAGES

    @property
    def wheel(self) -> Wheel:
        """Its only wheel."""
        return self.scene.only[1]

    @property
    def component(self) -> Component:
        """The sector."""
        return self.scene.component[self.wheel.component]

    def mesh(self) -> Product:
        """Return the sector's mesh."""
        return self._sector()["base-mesh"]

    def modes(self) -> Product:
        """Return the modes of the tuned wheel."""
        symmetry = self.wheel.model_dump(mode="json", include=SYMMETRY)
        return cyclic_product(self.scene.only[0], self._sector()["modes"].inputs, symmetry, self.wheel.mode_count)

    def response(self, interface: KeptInterface | None) -> Product:
        """Return the response of the wheel reduced by a choice of kept interface, or of the full one for None."""
        model = {} if interface is None else reduction(self.wheel, interface)
        mistuned = self.wheel.model_dump(mode="json", include=BLADES) | {"changes": list(self.changes)}
        return wheel_product(self.scene.only[0], self.modes().key, mistuned, model)

    def products(self, stages: Sequence[str]) -> dict[str, Product]:
        """Return what some of the stages make, by place."""
        makers: dict[str, tuple[str, Callable[[], Product]]] = {
            "mesh": (f"{self.wheel.component}.mesh", self.mesh),
            "modes": (f"{self.scene.only[0]}.modes", self.modes),
            "solve": ("solve", lambda: self.response(self.wheel.interface)),
        }
        with named(self.path, InputError):
            return {place: make() for stage, (place, make) in makers.items() if stage in stages}

    def pictures(self) -> dict[str, Any]:
        """Return everything that the pictures depend on."""
        return plot_inputs(self.response(self.wheel.interface).key, {})

    def case(self) -> "Case":
        """Return the wheel ready to be solved; its mesh must stand in the database.

        Raises:
            InputError: the scene does not fit its mesh.
        """
        from gudgeon.pipeline.wheel.response import case_of

        mesh = self.store.get(self.mesh().key, "mesh")
        return case_of(mesh, self.component, self.wheel, self.scene.only[0], np.array(self.changes))

    def terms(self) -> list[tuple[str, bool, str, tuple[str, ...]]]:
        """List name, presence, reason and `record:path` of what is read."""
        wheel, interface, mesh = self.wheel, self.wheel.interface, ("mesh:nodes", "mesh:cells", "mesh:surfaces")
        whole, most, some = interface.kept == "all", interface.interface_count, sum(one != 0 for one in self.changes)
        held, response = [one.surface for one in self.component.supports], wheel.response
        others = "all of them" if most is None else f"{most} of each sector"
        return [
            ("tuned modes", True, f"{wheel.mode_count} of each harmonic 0…{wheel.sectors // 2}", mesh),
            ("supports", bool(held), f"hold {', '.join(held) or 'nothing'}", ()),
            ("reduced wheel", True, f"{wheel.count} lowest modes, tuned and mistuned", mesh),
            ("mistuning", some > 0, f"stiffness of {some} blades is changed", ()),
            ("kept dofs", bool(interface.kept), f"interface.kept is {_listed(interface.kept)}", ()),
            ("interface modes", not whole and most != 0, "all dofs are kept" if whole else others, ()),
            ("fixed-interface modes", wheel.fixed_count > 0, f"fixed_count is {wheel.fixed_count}", ()),
            ("response", True, f"engine order {response.engine_order}, loss factor {response.loss_factor:g}", ()),
            ("reduction error", True, "against the harmonics' frequencies", self._tuned_frequencies("cyclic:")),
            ("rotation", False, "the wheel stands still: neither gyroscopic nor centrifugal terms", ()),
            ("shapes of the sector", False, "needed for pictures only",
             tuple(f"cyclic:harmonics/{n}/{part}" for n in self._harmonics() for part in ("real", "imaginary"))),
        ]  # fmt: skip

    def _harmonics(self) -> range:
        return range(self.wheel.sectors // 2 + 1)

    def _tuned_frequencies(self, prefix: str = "") -> tuple[str, ...]:
        return tuple(f"{prefix}harmonics/{n}/angular_frequencies" for n in self._harmonics())

    def bytes(self, keys: dict[str, str], field: str) -> int:
        record, _, path = field.partition(":")
        sizes = self.store.sizes(keys[record])
        return sum(size for name, size in sizes.items() if name == path or name.startswith(f"{path}/"))

    def changed(self, changes: Mapping[str, Any]) -> "WheelJob":
        """Return the job with nested tables of changes put into its scene."""
        tables = copy.deepcopy(self.tables)
        merge(tables, changes)
        return wheel_job(Place(self.name, self.path, tables, self.store, self.out))

    def _sector(self) -> dict[str, Product]:
        return component_products(self.wheel.component, self.component, self.path.parent)

    def stage(self, stage: str, tell: Progress) -> StageReport:
        start = time.perf_counter()
        (product,) = self.products([stage]).values()
        if fresh := self.store.has(product.key):
            tell(stage, 1.0)
        else:
            tell(stage, 0.0)
            self.store.put(product.key, product.kind, self._make(stage, tell), product.inputs)
            tell(stage, 1.0)
        return StageReport("fresh" if fresh else "ran", time.perf_counter() - start, product.key)

    def _make(self, stage: str, tell: Progress) -> Any:
        """Make one record. Heavy imports live here, where they are needed."""
        name, wheel = self.scene.only
        if stage == "mesh":
            from gudgeon.pipeline.stages.mesh import build_mesh

            return build_mesh(self.component, self.path.parent, wheel.component)
        from gudgeon.pipeline.cyclic import sector_parts
        from gudgeon.pipeline.wheel import response as solve

        if stage == "modes":
            sector = solve.sector_of(self.store.get(self.mesh().key, "mesh"), self.component, wheel, name)
            return solve.cyclic_record(sector, self.mesh().key, wheel, name, tell)
        case = self.case()
        choice = solve.kept_dofs(case.sector, wheel.interface, f"wheel.{name}.interface")
        parts = sector_parts(case.sector, wheel.fixed_count, f"wheel.{name}")
        tell("solve", 0.3)
        pair = solve.reduced_modes(case, parts, choice, False), solve.reduced_modes(case, parts, choice, True)
        record = solve.wheel_record(case, self.modes().key, wheel.interface, pair, parts.cpu_seconds)
        tuned = self.store.get(self.modes().key, "cyclic", only=self._tuned_frequencies())
        error = {"value": solve.reduction_error(tuned, record.tuned_frequencies), "unit": "1"}
        return replace(record, quantities=record.quantities | {"reduction.frequency_error": error})

    def frequencies(self) -> dict[str, list[dict[str, Any]]]:
        """Return the modes of every harmonic with their residuals, as `frequency_table` has them."""
        record = self.store.get(self.modes().key, "cyclic", only=["harmonics"])
        return {
            f"{self.wheel.component}, harmonic {one.harmonic}": [
                {"mode": i + 1, "frequency": float(omega / (2 * np.pi)), "estimated_error": None,
                 "algebraic_bound": None, "residual": float(rest)}
                for i, (omega, rest) in enumerate(zip(one.angular_frequencies, one.residuals, strict=True))
            ]
            for one in sorted(record.harmonics.values(), key=lambda one: one.harmonic)
        }  # fmt: skip

    def results(self) -> dict[str, Any]:
        """Write summary and response beside each other unless they stand there, and return the quantities."""
        key = self.response(self.wheel.interface).key
        try:
            summary = json.loads((self.out / SUMMARY).read_text())
            if summary["key"] == key and (self.out / RESPONSE).is_file():
                return summary["quantities"]
        except (OSError, ValueError, KeyError):
            pass
        record: WheelRecord = self.store.get(key, "wheel")
        quantities = {name: one | {"reference": None, "error": None} for name, one in record.quantities.items()}
        write_text(self.out / RESPONSE, _response_table(record))
        write_text(
            self.out / SUMMARY, json.dumps({"key": key, "quantities": quantities, "counts": record.counts}, indent=1)
        )
        return quantities

    def draw(self, tell: Progress) -> tuple[list[Path], list[str]]:
        from gudgeon.pipeline.plots import render

        tell("plot", 0.0)
        key = self.response(self.wheel.interface).key
        return render(self.store.root, key, self.out, self.name, family="wheel")


def run_wheel(job: WheelJob, until: str = "plot", progress: Progress | None = None) -> RunReport:
    """Bring the products up to date, up to and including one stage.

    Raises:
        InputError: it has no such stage, or the scene does not fit its mesh.
        StageError: a numerical routine failed.
    """
    if until not in STAGES:
        raise InputError(f"{job.path}: a wheel has no stage '{until}', it has {', '.join(STAGES)}")
    tell = progress or (lambda stage, share: None)
    stages, wanted = {}, STAGES[: STAGES.index(until) + 1]
    for stage in wanted:
        if stage != "plot":
            with named(job.path, InputError, StageError):
                stages[stage] = job.stage(stage, tell)
    if "solve" not in wanted:
        remember(job, wanted)
        frequencies = job.frequencies() if until == "modes" else {}
        return RunReport(job.name, None, stages, out=str(job.out), frequencies=frequencies)
    quantities, pictures, notes = job.results(), [], []
    if "plot" in wanted:
        stages["plot"], pictures, notes = plot_stage(job, lambda: job.draw(tell), tell)
    remember(job, wanted)
    return RunReport(
        job.name, "FINISHED", stages, quantities, out=str(job.out), files=(SUMMARY, RESPONSE), pictures=pictures,
        notes=notes,
    )  # fmt: skip


def plan_wheel(job: WheelJob) -> dict[str, Any]:
    """Return what is read of the records, what is left out and why, and the bytes of both."""
    name, keys = job.scene.only[0], {"mesh": job.mesh().key, "cyclic": job.modes().key}
    rows = []
    for term, present, reason, fields in job.terms():
        known = all(job.store.has(keys[field.partition(":")[0]]) for field in fields)
        size = sum(job.bytes(keys, field) for field in fields) if known else None
        rows.append(
            {"body": name, "term": term, "present": present, "reason": reason, "fields": list(fields),
             "bytes": size}
        )  # fmt: skip
    sizes = [row["bytes"] for row in rows if row["present"]]
    return {"scene": job.name, "terms": rows, "bytes": None if None in sizes else sum(sizes)}


def wheel_job(place: Place) -> WheelJob:
    """Return the job of a scene of a wheel.

    Raises:
        InputError: the scene is wrong; every mistake of one kind is listed.
    """
    scene = check_scene(place.path, place.tables, WheelFile)
    if lines := wrong_names(scene):
        raise InputError("\n".join(f"{place.path}: {line}" for line in lines))
    name, wheel = scene.only
    with named(place.path, InputError):
        changes = wheel.mistuning.changes(wheel.sectors, place.path.parent, f"wheel.{name}.mistuning")
    return WheelJob(place.name, place.path, place.tables, scene, changes, place.store, place.out, place.overrides)


def _listed(kept: str | tuple[str, ...]) -> str:
    return f"'{kept}'" if isinstance(kept, str) else ", ".join(kept) or "empty"


def _response_table(record: WheelRecord) -> str:
    """Return amplitudes over frequency: of any blade of the tuned wheel, of each of the mistuned one."""
    text = io.StringIO()
    writer = csv.writer(text)
    tuned, mistuned = (np.hypot(*np.moveaxis(one, -1, 0)) for one in (record.tuned, record.mistuned))
    writer.writerow(["frequency [Hz]", "tuned [m/N]", *(f"blade {j} [m/N]" for j in range(mistuned.shape[1]))])
    rows = np.column_stack([record.excitation / (2 * np.pi), tuned[:, :1], mistuned])
    writer.writerows([f"{value:.9g}" for value in row] for row in rows)
    return text.getvalue()
