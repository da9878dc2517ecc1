"""`gudgeon family`: which designs to store so that modes of all others of a range come from them within a tolerance.

Greedy: of a few candidates, evenly spread over the range with its corners, that with the largest estimated error is
stored next, until the errors of all are within the tolerance. The first one is the middle.
"""

import itertools
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.records.report import ReportRecord
from gudgeon.pipeline.design_change import ways
from gudgeon.pipeline.design_change.family import Family
from gudgeon.pipeline.design_change.morph import moved_mesh
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import BODY, open_job
from gudgeon.pipeline.kinds.given import Given
from gudgeon.pipeline.kinds.progress import shown
from gudgeon.pipeline.reduction.designs import body_of, family_of
from gudgeon.pipeline.scenes.component import MOST_DESIGNS, Component
from gudgeon.pipeline.stages.bodies import make_mesh, make_modes
from gudgeon.pipeline.stages.job import Job, variant
from gudgeon.pipeline.stages.keys.products import DESIGNS, Product, made_by
from gudgeon.pipeline.stages.make import keep, keep_for, scene_name
from gudgeon.pipeline.stages.mesh import movement_of
from gudgeon.pipeline.stages.run_report import Progress
from gudgeon.pipeline.studies.parameters import Parameter, parse_parameters

FAMILY = "family"
"""Stage of the record of a family."""
KEY = re.compile(r"component\.([^.]+)\.change\.profile\.(offset|scale)")
CANDIDATES = ((9,), (5, 3))
"""Candidates along each parameter, of one and of two."""
MAKE = {"mesh": make_mesh, "modes": make_modes}


@dataclass(frozen=True)
class FamilyReport:
    """Stored designs of a range."""

    scene: str
    component: str
    tolerance: float
    designs: list[dict[str, Any]]
    """`change.designs` of the component, in the order in which they were stored."""
    errors: list[float]
    """Largest estimated error of all candidates with the first design, with the first two, and so on."""
    candidates: int
    modes: list[str]
    """Keys of the modes of the stored designs."""
    key: str
    """Of the family's record in the database."""

    def as_json(self) -> dict[str, Any]:
        """Return the document that `--json` prints."""
        return vars(self)

    def as_text(self) -> str:
        """Return the errors, and the lines that a scene takes."""
        count = len(self.designs)
        lines = [f"{'stored':>6}  {'estimated error':>15}  design"]
        for n, (design, error) in enumerate(zip(self.designs, self.errors, strict=True), 1):
            lines.append(f"{n:>6}  {error:>15.2e}  {_toml(design)}")
        lines += [
            "", f"{count} stored design{'s' if count > 1 else ''}, {self.candidates} candidates. For the scene:", "",
            f"[component.{self.component}.change]", 'update = "certified"', f"tolerance = {self.tolerance:g}",
            f"designs = [{', '.join(_toml(design) for design in self.designs)}]",
        ]  # fmt: skip
        return "\n".join(lines)


def family(
    scene: Given,
    vary: Sequence[str],
    *,
    tolerance: float = 1e-3,
    set: Sequence[str] | Mapping[str, Any] = (),
    db: Any = None,
    out: Any = None,
    progress: Progress | None = None,
) -> FamilyReport:
    """Find the designs to store for a range of a component's profile, and keep their modes in the database.

    >>> import gudgeon
    >>> few = {"component.skirt.mesh.size": 0.03, "component.skirt.modes.normal_count": 4}
    >>> found = gudgeon.family(gudgeon.example("skirt"), ["component.skirt.change.profile.offset=-2e-4:2e-4"],
    ...                        tolerance=0.01, set=few)
    >>> [design["offset"] for design in found.designs]
    [0.0, -0.0002]

    Args:
        scene: File, mapping or model as `kinds.open_job` takes it.
        vary: One or two texts `component.NAME.change.profile.KEY=LOW:HIGH`, KEY `offset` or `scale`.
        tolerance: Of the largest estimated relative error of a frequency and of a compliance at all candidates.
        set, db, out: See `kinds.open_job`.

    Raises:
        InputError: the scene or a parameter is wrong, a design inverts elements, or five stored designs do not meet
            the tolerance.
    """
    return find_family(open_job(scene, set=set, db=db, out=out), vary, tolerance, shown(progress))


def find_family(job: Any, vary: Sequence[str], tolerance: float, tell: Progress) -> FamilyReport:
    """Find the stored designs of a range of a job; see `family`."""
    if job.kind is not BODY:
        raise InputError(f"{job.path}: family: no such command for this scene; allowed: scenes of bodies")
    name, parameters = _ranges(job, vary)
    candidates = _candidates(job, name, parameters)
    search = _Greedy(job, name, tolerance, candidates)
    pending, errors = candidates, []
    stored = [candidates[len(candidates) // 2]]
    while True:
        tell(FAMILY, len(stored) / (MOST_DESIGNS + 1))
        pending = [profile for profile in pending if profile not in stored]
        stated = search.errors(stored, pending, tell)
        errors.append(max(stated, default=0.0))
        if errors[-1] <= tolerance:
            break
        worst = pending[int(np.argmax(stated))]
        if len(stored) == MOST_DESIGNS:
            raise InputError(
                f"{job.path}: family: {MOST_DESIGNS} stored designs leave an estimated error of {errors[-1]:.2g} at"
                f" {_toml(worst)}; allowed: --tolerance {tolerance:g}; give a narrower range or a larger tolerance"
            )
        pending = [profile for profile, error in zip(pending, stated, strict=True) if error > tolerance]
        stored.append(worst)
    return _kept(job, name, parameters, tolerance, (stored, errors, len(candidates), search.modes))


class _Greedy:
    """The search for stored designs of a component: errors of candidates with the designs that are stored."""

    def __init__(self, job: Job, name: str, tolerance: float, candidates: list[dict[str, Any]]) -> None:
        self._job, self._name, self._tolerance = job, name, tolerance
        moved = max(candidates, key=lambda profile: abs(profile["offset"]) + abs(profile.get("scale", 0.0)))
        self._change = {"update": "certified", "profile": moved, "tolerance": tolerance}
        self.modes: list[str] = []
        """Keys of the modes of the stored designs."""

    def errors(self, stored: list[dict[str, Any]], candidates: list[dict[str, Any]], tell: Progress) -> list[float]:
        """Return the largest estimated error of each candidate by `project` from stored designs."""
        job, name = self._job, self._name
        certified = variant(job, {"component": {name: {"change": self._change | {"designs": stored}}}})
        steps = certified.components()[name]
        for step in ("base-mesh", *(f"{DESIGNS}.{n} {kind}" for n in range(len(stored)) for kind in MAKE)):
            product = steps[step]
            if not job.store.has(product.key):
                keep_for(certified, product, MAKE[product.stage](certified, product, tell))
        pairs = ((steps[f"{DESIGNS}.{n} mesh"], steps[f"{DESIGNS}.{n} modes"]) for n in range(len(stored)))
        keys = [(moved.key, modes.key) for moved, modes in pairs]
        self.modes = [key for _, key in keys]
        requested = job.scene.reduced_with(name)
        members, base = family_of(job.store, keys, certified.scene.component[name], name, **requested)
        responses = base.static_responses
        columns = {} if responses is None else responses.columns
        mesh = job.store.get(steps["base-mesh"].key, "mesh")
        answers = []
        for profile in candidates:
            component = _moved(job.scene.component[name], profile)
            movement = movement_of(component, job.folder, name)
            target = body_of(mesh if movement is None else moved_mesh(mesh, movement), component, name, **requested)
            answers.append(self._error(members, target, columns, profile))
        return answers

    def _error(
        self, members: Family, target: Any, columns: Mapping[str, Sequence[int]], profile: dict[str, Any]
    ) -> float:
        if target.B.shape != members.base.B.shape:
            raise InputError(
                f"{self._job.path}: family: the design {_toml(profile)} has {target.B.shape[0]} rows of interfaces, the"
                f" first stored one {members.base.B.shape[0]}: it moves contact points across an edge of their sector;"
                " give a narrower range"
            )
        search = ways.Search(target, members, columns, self._tolerance)
        largest = ways.certified(search, ways.projected(search)).largest
        return largest if largest > self._tolerance or ways.complete(search) else float("inf")


def _ranges(job: Job, vary: Sequence[str]) -> tuple[str, list[Parameter]]:
    """Return the component, and its parameters."""
    parameters = parse_parameters(vary, drawn=True)
    allowed = "allowed: component.NAME.change.profile.offset=LOW:HIGH and .scale=LOW:HIGH of one component"
    names = set()
    for parameter in parameters:
        match = KEY.fullmatch(parameter.path)
        if match is None or parameter.values or parameter.count or parameter.log:
            raise InputError(f"{parameter.source}: {allowed}")
        names.add(match[1])
        if match[1] not in job.used():
            raise InputError(f"{parameter.source}: no component '{match[1]}'; the scene uses {', '.join(job.used())}")
        if match[2] == "scale" and job.scene.component[match[1]].change.profile.table is None:
            raise InputError(f"{parameter.source}: change.profile has no table that it scales")
    if len(names) != 1:
        raise InputError(f"{job.path}: family: {len(names)} components vary; {allowed}")
    return names.pop(), parameters


def _candidates(job: Job, name: str, parameters: Sequence[Parameter]) -> list[dict[str, Any]]:
    """Return the profiles of the candidates; the middle one is in the middle."""
    written = job.scene.component[name].change.profile
    profile = written.model_dump(mode="json", include=written.model_fields_set | {"offset"})
    shares = itertools.product(*(np.linspace(0, 1, count) for count in CANDIDATES[len(parameters) - 1]))
    keys = [parameter.path.rpartition(".")[2] for parameter in parameters]
    pairs = [[parameter.at(float(fraction)) for parameter, fraction in zip(parameters, s, strict=True)] for s in shares]
    return [profile | dict(zip(keys, values, strict=True)) for values in pairs]


def _moved(component: Component, profile: Mapping[str, Any]) -> Component:
    change = component.change
    return component.model_copy(
        update={"change": change.model_copy(update={"profile": change.profile.model_copy(update=dict(profile))})}
    )


def _kept(job: Job, name: str, parameters: Sequence[Parameter], tolerance: float, result: Any) -> FamilyReport:
    """Keep a family in the database, and return its report."""
    stored, errors, candidates, modes = result
    document = {
        "stage": FAMILY, "component": name, "tolerance": tolerance, "designs": stored, "errors": errors,
        "candidates": candidates, "ranges": {p.path: [p.low, p.high] for p in parameters},
    }  # fmt: skip
    inputs = document | {"runs": modes, **made_by("report")}
    key = content_key(inputs)
    keep(job.store, Product(FAMILY, name, "report", key, inputs), ReportRecord(document))
    job.store.note(key, scene_name(job), name)
    return FamilyReport(job.name, name, tolerance, stored, errors, candidates=candidates, modes=modes, key=key)


def _toml(profile: Mapping[str, Any]) -> str:
    return "{ " + ", ".join(f"{key} = {json.dumps(value)}" for key, value in profile.items()) + " }"
