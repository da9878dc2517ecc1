"""`gudgeon sensitivity`: how frequencies and quantities of a run depend on keys of its scene."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gudgeon.modaldb.records.modes import ModalRecord, MorphRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.sensitivity.components import designs_beside
from gudgeon.pipeline.sensitivity.modal import groups
from gudgeon.pipeline.sensitivity.parameters import Parameter, parameters_of
from gudgeon.pipeline.sensitivity.report import Derivative, SensitivityReport, written
from gudgeon.pipeline.stages.job import Job, variant
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.run_report import Progress
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.sensitivity.adjoint import WEIGHTS, Differentiated, differentiated, plan_of, prepared
from gudgeon.solver.sensitivity.readings import Read, reader
from gudgeon.solver.sensitivity.refusals import refuse_scene
from gudgeon.solver.system.compile import compile_system
from gudgeon.solver.system.system import System

ACCURACY = 1e-5
"""Default of the largest change of a derivative by the last halving of the step, over the largest of its quantity."""
HALVINGS = 14
"""Of the step, at most."""
MOST_STEPS = 2**18
"""Steps of a run, at most, where they are chosen."""


@dataclass(frozen=True)
class Asked:
    """What is asked for."""

    of: Sequence[str] = ()
    """Quantities; default: impulse and norm of the force of each contact."""
    by: Sequence[str] = ()
    """Keys; default: see `parameters.default_keys`."""
    accuracy: float = ACCURACY


class Overlay:
    """A database in which some records have others in their place."""

    def __init__(self, store: Any, records: Mapping[str, Any]) -> None:
        self._store, self._records = store, records

    def __getattr__(self, name: str) -> Any:
        return getattr(self._store, name)

    def get(self, key: str, kind: str, only: Sequence[str] | None = None) -> Any:
        """Return a record."""
        return self._records[key] if key in self._records else self._store.get(key, kind, only=only)


@dataclass(frozen=True)
class Varied:
    """A parameter with the systems beside its value."""

    parameter: Parameter
    systems: dict[int, System]
    base: System | None
    """At its value over other combinations of modes; None: the scene's own."""
    frequencies: np.ndarray | None
    """Derivatives of a component's frequencies [rad/s per unit]; None of keys of the scene's dynamics."""


def sense(job: Job, request: Asked, progress: Progress) -> SensitivityReport:
    """Return and write the derivatives of a scene's quantities; raises InputError with what they do not cover."""
    with named(job.path, InputError, SceneError):
        refuse_scene(job.scene)
    if not 0 < request.accuracy < 1:
        raise InputError(f"--accuracy {request.accuracy:g}: allowed: above 0 and below 1")
    parameters = parameters_of(job, request.by)
    run_job(job, "morph", progress)
    with named(job.path, InputError, SceneError, SolverError):
        system = prepared(compile_system(job.store, job.scene, job.morphs()))
        quantities = list(dict.fromkeys(request.of or _default_quantities(system)))
        reads = [reader(system, name) for name in quantities]
        varied = []
        for index, parameter in enumerate(parameters):
            progress("parameters", index / len(parameters))
            varied.append(_varied(job, parameter))
        progress("sensitivity", 0.0)
        slopes, errors, base = _settled(system, [read for read, _ in reads], varied, request.accuracy)
    progress("sensitivity", 1.0)
    values = [reading.value for reading in base.readings]
    rows = [
        Derivative(name, values[q], reads[q][1], varied_parameter.parameter, float(slopes[q, p]),
                   None if errors is None else float(errors[q, p]))
        for q, name in enumerate(quantities) for p, varied_parameter in enumerate(varied)
    ]  # fmt: skip
    report = SensitivityReport(
        scene=job.name, derivatives=rows, frequencies=_frequency_rows(job, varied), step=base.steps.dt,
        steps=len(base.steps.tape.mean), out=job.out, files=[],
    )  # fmt: skip
    return written(job, replace(report, notes=_notes(base, errors, request.accuracy, slopes, values, parameters)))


def _default_quantities(system: System) -> list[str]:
    if not system.contacts:
        return [f"{name}.energy" for name in system.bodies]
    return [f"{contact.name}.{name}" for contact in system.contacts for name in ("impulse", "force_norm")]


def _varied(job: Job, parameter: Parameter) -> Varied:
    """Return a parameter with the systems beside its value."""
    try:
        if (name := parameter.component) is None:
            systems = {
                k: prepared(compile_system(job.store, variant(job, parameter.moved(job.scene, k)).scene, job.morphs()))
                for k in WEIGHTS
            }
            return Varied(parameter, systems, None, None)
        designs = designs_beside(job, parameter)
        systems = {k: with_records(job, name, records) for k, records in designs.beside.items()}
        base = None if designs.base is None else with_records(job, name, designs.base)
        return Varied(parameter, systems, base, designs.frequencies)
    except SceneError as error:
        raise InputError(
            f"--by {parameter.key}: next to its value {parameter.value:g} the scene does not start: {error}"
        ) from None


def with_records(job: Job, name: str, records: tuple[ModalRecord, MorphRecord]) -> System:
    """Return the system with other records of a component."""
    keys, (modal, morph) = job.components()[name], records
    store: Any = Overlay(job.store, {keys["modes"].key: modal, keys["morph"].key: morph})
    return prepared(compile_system(store, job.scene, job.morphs()))


def _settled(
    system: System, reads: list[Read], varied: list[Varied], accuracy: float
) -> tuple[np.ndarray, np.ndarray | None, Differentiated]:
    """Return derivatives (q, p) by steps that are halved until they settle, their estimated errors, and the last run.

    With run.step they are those of its steps, without an estimate.
    """
    schedule = plan_of(system).schedule
    dt, count = schedule.dt, schedule.steps
    base = differentiated(system, reads, dt, count)
    slopes = _slopes(base, varied)
    if system.scene.run.step is not None:
        return slopes, None, base
    coarser = differentiated(system, reads, 2 * dt, count // 2) if 2 * count > MOST_STEPS else None
    # Where no step can be halved, the error is the change from twice the step.
    errors = np.abs(slopes - _slopes(coarser, varied)) if coarser is not None else np.full(slopes.shape, np.inf)
    for _ in range(HALVINGS):
        dt, count = dt / 2, 2 * count
        if count > MOST_STEPS:
            break
        base, before = differentiated(system, reads, dt, count), slopes
        slopes = _slopes(base, varied)
        errors = np.abs(slopes - before)
        sizes = np.array([abs(varied_parameter.parameter.value) or 1.0 for varied_parameter in varied])
        if (errors * sizes <= accuracy * np.abs(slopes * sizes).max(axis=1, keepdims=True)).all():
            break
    return slopes, errors, base


def _slopes(base: Differentiated, varied: list[Varied]) -> np.ndarray:
    """Return the derivatives of all quantities by all parameters, (q, p)."""
    steps, columns = base.steps, []
    for varied_parameter in varied:
        run = (
            base
            if varied_parameter.base is None
            else differentiated(varied_parameter.base, base.reads, steps.dt, len(steps.tape.mean))
        )
        columns.append(run.slopes(varied_parameter.systems, varied_parameter.parameter.step))
    return np.column_stack(columns) if columns else np.empty((len(base.reads), 0))


def _notes(
    base: Differentiated, errors: np.ndarray | None, accuracy: float, slopes: np.ndarray, values: list[float],
    parameters: list[Parameter],
) -> list[str]:  # fmt: skip
    if errors is None:
        return [f"run.step = {base.steps.dt:g} s is given: derivatives are those of a run with this step"]
    sizes = np.array([abs(varied_parameter.value) or 1.0 for varied_parameter in parameters])
    reached = float(
        (errors * sizes / np.abs(slopes * sizes).max(axis=1, keepdims=True, initial=1e-300)).max(initial=0.0)
    )
    if reached <= accuracy:
        return []
    return [f"derivatives change by {reached:.1g} of the largest with the last halving of the step: more than"
            f" --accuracy {accuracy:g}"]  # fmt: skip


def _frequency_rows(job: Job, varied: list[Varied]) -> list[dict[str, Any]]:
    """Return the derivative of the mean frequency of each group of close modes by the keys of its component."""
    rows = []
    for varied_parameter in varied:
        name = varied_parameter.parameter.component
        if name is None or varied_parameter.frequencies is None or not len(varied_parameter.frequencies):
            continue
        omega = job.record(name).angular_frequencies
        for group in groups(omega):
            mean = float(omega[group].mean()) / (2 * np.pi)
            slope = float(varied_parameter.frequencies[group].mean()) / (2 * np.pi)
            rows.append({
                "component": name, "modes": [int(i) + 1 for i in group], "frequency": mean,
                "parameter": varied_parameter.parameter.key,
                "parameter_unit": varied_parameter.parameter.unit, "derivative": slope,
                "relative": varied_parameter.parameter.value / mean * slope,
            })  # fmt: skip
    return rows
