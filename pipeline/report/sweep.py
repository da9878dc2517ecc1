"""The settings of a report: models of the scene, combined with its sweep, or a default sweep if it has neither.

A setting is a change of the scene. Its basis is `component.*.modes`, its step is `run.step` and `run.accuracy`, and its
scheme is all the rest: runs of one scheme differ by truncation and time error only.
"""

import copy
import itertools
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.reading import merged, nested
from gudgeon.pipeline.stages.job import Job, variant

FACTORS = (0.25, 0.5, 1.0, 2.0)
"""Numbers of modes of the default sweep, relative to that of the scene."""
REFINED = (2, 4)
"""Numbers of parts into which the step of a setting is divided for its time error."""
TIGHTER, OWN_ACCURACY, LEAST_ACCURACY = 1e-2, 1e-8, 1e-12
"""Accuracies: factor for the time error, default of the integrator, and least value."""
LOOSER = (1e-4, 1e-6)
"""Further accuracies of the default sweep."""
SIMILAR = ("macneal", "ritz")
"""Reductions of the default sweep, which have the same number of vectors."""
WORDS = {
    "normal_count": "{} modes",
    "static_count": "{} static",
    "accuracy": "accuracy {:g}",
    "fixed_count": "{} fixed",
}
"""Names of the values of a sweep by key; others are named by the value, or by key and value."""
NO_RUN = ("report", "plot", "robustness")
"""Tables of a scene that do not affect its motion."""
SELF_EXPLAINING = ("reduction", "method", "kind", "integrator", "dashpot")
UNITS = {"step": (1e6, "µs")}


@dataclass(frozen=True)
class Setting:
    """One point of a sweep."""

    name: str
    changes: dict[str, Any]
    """Changes of the scene, as nested tables."""
    named: bool = True
    """Whether the scene names it; a setting of the default sweep may be inadmissible."""
    model: str = ""
    """Name of its model in `report.models`."""


def settings_of(job: Job) -> list[Setting]:
    """Return the settings of the report of a scene.

    Raises:
        InputError: a path of the sweep is unknown, or its value does not affect the motion.
    """
    report = job.scene.report
    if not report.models and not report.sweep:
        return list(_default(job))
    models = report.models or {"": {}}
    named = [(f"models.{model}", table) for model, changes in models.items() for table in changes]
    for key, table in [*named, *(("sweep", path.partition(".")[0]) for path in report.sweep)]:
        if table in NO_RUN:
            raise InputError(f"{job.path}: report.{key}: '{table}' given, which does not affect the motion")
    axes = [[(path, value) for value in values] for path, values in report.sweep.items()]
    settings = []
    for (name, changes), point in itertools.product(models.items(), itertools.product(*axes)):
        tables: dict[str, Any] = changes
        for path, value in point:
            tables = merged(tables, _nested(job, path, value))
        words = [name, *(word_of(path, value) for path, value in point)]
        settings.append(Setting(", ".join(filter(None, words)), tables, named=not point, model=name))
    return settings


def finer(job: Job, setting: Setting, step: float) -> list[Setting]:
    """Return the settings of finer steps for the time error of a setting; none if its integrator has no time error.

    Args:
        job: The scene with the setting.
        step: Step of its run [s].
    """
    integrator = job.scene.capabilities
    if math.isinf(integrator.order):
        return []
    if integrator.own_steps:
        tight = max(LEAST_ACCURACY, (job.scene.run.accuracy or OWN_ACCURACY) * TIGHTER)
        runs = [(f"accuracy {tight:g}", {"accuracy": tight})]
    else:
        runs = [(f"step / {divisor}", {"step": step / divisor}) for divisor in REFINED]
    return [Setting(f"{setting.name}, {word}", merged(setting.changes, {"run": run})) for word, run in runs]


def scheme_of(job: Job) -> tuple[str, str]:
    """Return the scheme of a setting, as text that is equal for runs of one scheme, and its name."""
    tables = copy.deepcopy(job.tables)
    for name in NO_RUN:
        tables.pop(name, None)
    for component in tables.get("component", {}).values():
        component.pop("modes", None)
    for key in ("step", "accuracy", "checks", "samples", "frames"):
        tables.get("run", {}).pop(key, None)
    tables.setdefault("run", {})["integrator"] = job.scene.integrator
    contacts = job.scene.contact.values()
    words = [contact.method for contact in contacts]
    words += [contact.law.kind for contact in contacts if contact.law is not None]
    words += ["dashpot" for contact in contacts if contact.dashpot != "none"]
    return json.dumps(tables, sort_keys=True), ", ".join(dict.fromkeys([*words, job.scene.integrator]))


def basis_of(job: Job) -> str:
    """Return the basis of a setting, as text that is equal for runs of one basis."""
    return json.dumps({n: c.modes.model_dump(mode="json") for n, c in job.scene.component.items()}, sort_keys=True)


def word_of(path: str, value: Any) -> str:
    """Return the name of a value of a sweep."""
    key = path.rsplit(".", 1)[-1]
    if key in WORDS and isinstance(value, int | float):
        return WORDS[key].format(value)
    if key in UNITS and isinstance(value, int | float):
        factor, unit = UNITS[key]
        return f"{value * factor:g} {unit}"
    return str(value) if key in SELF_EXPLAINING else f"{key} {value}"


def _nested(job: Job, path: str, value: Any) -> dict[str, Any]:
    """Return the nested tables that set a value at every place of a path with stars."""
    tables: dict[str, Any] = {}
    for keys in _places(job.tables, path.split("."), []):
        tables = merged(tables, nested(keys, value))
    if not tables:
        raise InputError(f"{job.path}: report.sweep: no key '{path}' in this scene")
    return tables


def _places(tables: Any, keys: list[str], before: list[str]) -> Iterator[list[str]]:
    if len(keys) == 1 or not isinstance(tables, Mapping):
        yield [*before, *keys]
        return
    names = list(tables) if keys[0] == "*" else [keys[0]]
    for name in names:
        if _is_rigid(tables.get(name)) and "modes" in keys:
            continue
        yield from _places(tables.get(name, {}), keys[1:], [*before, name])


def _is_rigid(component: Any) -> bool:
    return isinstance(component, Mapping) and component.get("geometry", {}).get("kind") == "rigid"


def _default(job: Job) -> Iterator[Setting]:
    """Yield numbers of modes, then other reductions, integrators and methods at the number of modes of the scene."""
    scene, elastic = job.scene, elastic_modes(job.scene.component)
    yield from _mode_counts(elastic)
    yield from _reductions(elastic)
    for name in scene.alternatives():
        if name != scene.integrator:
            yield Setting(f"integrator {name}", {"run": {"integrator": name}}, named=False)
    residual = [name for name, contact in scene.contact.items() if contact.method == "residual"]
    if elastic and residual:
        yield Setting("penalty", {"contact": {name: {"method": "penalty"} for name in residual}}, named=False)
    integrator = scene.capabilities
    if integrator.own_steps and math.isfinite(integrator.order) and scene.run.accuracy is None:
        for accuracy in LOOSER:
            yield Setting(f"accuracy {accuracy:g}", {"run": {"accuracy": accuracy}}, named=False)


def elastic_modes(components: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of the modes of the components that deform."""
    return {
        name: component.modes
        for name, component in components.items()
        if component.geometry.kind != "rigid" and component.modes.reduction != "rigid"
    }


def _mode_counts(elastic: Mapping[str, Any]) -> Iterator[Setting]:
    """Yield other numbers of normal modes, of fixed-interface ones where a component has no others."""
    keys = {name: "normal_count" if modes.normal_count > 0 else "fixed_count" for name, modes in elastic.items()}
    counts = {name: getattr(elastic[name], key) for name, key in keys.items()}
    counts = {name: count for name, count in counts.items() if count > 0}
    if not counts:
        yield Setting("as in the scene", {})
        return
    for factor in FACTORS:
        scaled = {name: max(1, round(factor * count)) for name, count in counts.items()}
        changes = {"component": {name: {"modes": {keys[name]: count}} for name, count in scaled.items()}}
        numbers = " + ".join(dict.fromkeys(map(str, scaled.values())))
        yield Setting(f"{numbers} modes", changes, named=factor == 1.0)


def _reductions(elastic: Mapping[str, Any]) -> Iterator[Setting]:
    """Yield the other one of two similar reductions to normal modes."""
    similar = {n: m.reduction for n, m in elastic.items() if m.normal_count > 0 and m.reduction in SIMILAR}
    for reduction in SIMILAR:
        changed = [name for name, present in similar.items() if present != reduction]
        if changed:
            changes = {"component": {name: {"modes": {"reduction": reduction}} for name in changed}}
            yield Setting(f"reduction {reduction}", changes, named=False)


def able_settings(job: Job, settings: Sequence[Setting]) -> tuple[list[Setting], list[dict[str, str]]]:
    """Return the admissible settings, and `name` and `why` of the others.

    Raises:
        InputError: no setting is admissible, one of the scene is not, or a key is unknown.
    """
    able, left_out = [], []
    for setting in settings:
        try:
            variant(job, setting.changes)
        except InputError as error:
            if setting.named or "unknown key" in str(error):
                raise
            left_out.append({"name": setting.name, "why": reason(job, error)})
        else:
            able.append(setting)
    if not able:
        raise InputError(f"{job.path}: report: no setting is admissible; {left_out[0]['name']}: {left_out[0]['why']}")
    return able, left_out


def reason(job: Job, error: Exception) -> str:
    """Return the first line of an error without the path of the scene."""
    return str(error).splitlines()[0].removeprefix(f"{job.path}: ")
