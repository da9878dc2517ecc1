"""Worn shapes of the joints of a scene, and runs with them."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from gudgeon.modaldb.records.trajectory import WEAR
from gudgeon.pipeline.applications.wear.bush import compliance_change, worn_profile
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.scenes.reading import merged
from gudgeon.pipeline.stages.run import solve_records
from gudgeon.pipeline.stages.run_report import Progress
from gudgeon.solver.joints.clearance import Clearance
from gudgeon.solver.joints.wear import JournalWear
from gudgeon.solver.laws.archard import DEEPEST
from gudgeon.solver.numbers import RANGES

SIDES = ("bearing", "journal")
SUMS = ("load_distance", "journal_load_distance")
"""Of `counts.wear`, by side."""
SLIGHT = 1e-12
"""Share of the largest depth below which a depth is none."""
Shapes = dict[str, np.ndarray]
"""Worn depth by joint: of each touching section's bearing and journal by cell [m], (sections, 2, cells)."""
Soft = dict[str, float]
"""Typical indentation by joint [m]."""


@dataclass(frozen=True)
class Wearing:
    """A scene whose joints wear."""

    job: Any
    joints: dict[str, Clearance]
    """Those with wear."""
    period: float
    """Of a cycle [s]."""
    estimates: dict[str, float] = field(default_factory=dict)
    """Largest estimated relative change by wear of the compliance of each bush where it was kept, by joint."""
    recomputed: dict[str, int] = field(default_factory=dict)
    """Runs for which the compliance of a bush was computed again, by joint."""

    def wear(self, name: str) -> JournalWear:
        """Return the table `wear` of a joint."""
        wear = self.joints[name].wear
        assert wear is not None
        return wear

    def start(self) -> Shapes:
        """Return the shapes that the scene gives; others are zero."""
        shapes = {}
        for name, joint in self.joints.items():
            wear = self.wear(name)
            shape = np.zeros((len(joint.sections), len(SIDES), wear.cells))
            for side, rows in enumerate((wear.bearing_depth, wear.journal_depth)):
                for section, row in enumerate(rows):
                    shape[section, side] = wear.on_cells(row)
            shapes[name] = shape
        return shapes

    def scales(self) -> dict[str, float]:
        """Return the clearances [m]."""
        return {name: joint.clearance for name, joint in self.joints.items()}

    def cycle(self, shapes: Shapes, soft: Soft, tell: Progress) -> "Cycle":
        """Run the scene with worn shapes, unless the database has this run, and return what a cycle wears off.

        Raises:
            Ended: the run failed.
        """
        return _cycle(self, shapes, soft, tell, self.worn_bushes(shapes, tell))

    def worn_bushes(self, shapes: Shapes, tell: Progress) -> dict[str, Any]:
        """Return the `change` of components whose compliance worn shapes change by more than its tolerance allows.

        What is within the tolerance is kept, and its estimate.

        Raises:
            Ended: such a component is the bearing of several joints.
        """
        changes = {}
        for name, joint in self.joints.items():
            component = None if joint.bearing is None else joint.bearing.component
            if component is None or not shapes[name][0, 0].any():
                continue
            solve_records(self.job, "morph", tell)
            change = compliance_change(self.job, name, joint, shapes[name][0, 0])
            if change > self.job.scene.component[component].change.tolerance:
                if [*self.job.scene.bearings().values()].count(component) > 1:
                    raise Ended(
                        f"wear changes the compliance of component '{component}' by an estimated {change:.2%}, and it"
                        " is the bearing of several joints; give each joint a component of its own"
                    )
                changes[component] = worn_profile(self.job, name, joint, shapes[name][0, 0])
                self.recomputed[name] = self.recomputed.get(name, 0) + 1
            else:
                self.estimates[name] = max(self.estimates.get(name, 0.0), change)
        return changes

    def deepest(self, name: str) -> tuple[float, str]:
        """Return the depth at which wear ends, and why."""
        thickness, bound = self.wear(name).thickness, DEEPEST * self.joints[name].radius
        if thickness is not None and thickness <= bound:
            return thickness, f"the wall of joint '{name}' is worn through, thickness = {thickness:g} m"
        return bound, f"joint '{name}' is worn by more than {DEEPEST:g} of its radius, beyond the model of its shape"


@dataclass(frozen=True)
class Cycle:
    """What a run with given shapes wears off in a cycle."""

    rate: Shapes
    """Depth of each cell in a cycle [m]."""
    soft: Soft
    quantities: dict[str, float]
    key: str
    """Of the run's record."""


class Worn(Protocol):
    """What wears over cycles: a scene with shapes by name."""

    def start(self) -> Shapes:
        """Return the shapes before the first cycle."""
        ...

    def scales(self) -> dict[str, float]:
        """Return lengths by name that differences of depths are measured by [m]."""
        ...

    def deepest(self, name: str) -> tuple[float, str]:
        """Return the depth at which wear ends, and why."""
        ...

    def cycle(self, shapes: Shapes, soft: Soft, tell: Progress) -> Cycle:
        """Return what a cycle wears off shapes; raises Ended where the run failed."""
        ...


class Ended(Exception):
    """A run failed physically; its argument is the reason."""


def wearing(job: Any, period: float | None) -> Wearing:
    """Return a scene's joints that wear.

    Args:
        period: Duration of a cycle [s]; default: the time of the run in which wear counts.

    Raises:
        InputError: no joint wears, or a cycle is longer than the run.
    """
    scene = getattr(job, "scene", None)
    hinges = scene.hinges() if scene is not None and hasattr(scene, "hinges") else {}
    joints = {n: h for n, h in hinges.items() if isinstance(h, Clearance) and h.wear is not None}
    if not joints:
        raise InputError(
            f"{job.path}: wear: no joint of the scene wears, and no contact; give a joint of kind 'clearance' a table"
            " [joint.NAME.wear], or a contact a table [contact.NAME.wear]"
        )
    cycle = asked_period(job, joints, period)
    if not any(j.wear.coefficient or j.wear.journal_coefficient for j in joints.values() if j.wear):
        raise InputError(f"{job.path}: wear: all coefficients of wear are zero; nothing wears")
    return Wearing(job, joints, cycle)


def asked_period(job: Any, worn: Mapping[str, Any], period: float | None) -> float:
    """Return the period of a cycle of a scene whose joints or contacts `worn` wear [s].

    Raises:
        InputError: a cycle is longer than the time of the run in which wear counts.
    """
    owner = "joint" if isinstance(next(iter(worn.values())), Clearance) else "contact"
    duration, latest = job.scene.run.duration, max(w.wear.after for w in worn.values())
    if latest >= duration:
        raise InputError(
            f"{job.path}: {owner}.NAME.wear.after: {latest:g} s given, but the run ends at run.duration ="
            f" {duration:g} s; nothing would wear"
        )
    if period is not None and period > (duration - latest) * (1 + 1e-9):
        raise InputError(
            f"--period {period:g} s: given, but wear counts over {duration - latest:g} s of the run; increase"
            f" run.duration, or reduce {owner}.NAME.wear.after"
        )
    return duration - latest if period is None else period


def _cycle(scene: Wearing, shapes: Shapes, soft: Soft, tell: Progress, bushes: dict[str, Any]) -> Cycle:
    job = worn_job(scene, shapes, soft, bushes)
    report = solve_records(job, "solve", tell)
    if report.reason is not None:
        raise Ended(report.reason)
    key = job.trajectory().key
    trajectory = scene.job.store.get(key, "trajectory", only=["counts", "quantities"])
    rates, softs = {}, {}
    for name, joint in scene.joints.items():
        wear, areas = scene.wear(name), joint.worn_areas()
        cycles = (job.scene.run.duration - wear.after) / scene.period
        per = [coefficient / wear.hardness / areas[side] / cycles
               for side, coefficient in enumerate((wear.coefficient, wear.journal_coefficient))]  # fmt: skip
        sums = [np.array(trajectory.counts[WEAR][name][term]) * per[side] for side, term in enumerate(SUMS)]
        rates[name] = np.maximum(np.stack(sums, axis=1), 0.0)
        mean = trajectory.quantities.get(f"{name}.wear_indentation")
        if wear.indentation is not None:
            softs[name] = wear.indentation
        elif mean is not None and mean["value"] > 0:
            softs[name] = mean["value"]
    numbers = {name: q["value"] for name, q in trajectory.quantities.items() if name.partition(".")[0] in scene.joints}
    return Cycle(rates, softs, numbers, key)


def worn_job(scene: Wearing, shapes: Shapes, soft: Soft, bushes: Mapping[str, Any]) -> Any:
    """Return the job of a scene with worn shapes.

    Args:
        bushes: The `change` of components whose modes are computed again.
    """
    scene_place = scene.job.place()
    joints = dict(scene_place.tables["joint"])
    for name, shape in shapes.items():
        worn = dict(joints[name]["wear"])
        for side, key in enumerate(SIDES):
            worn.pop(f"{key}_depth", None)
            if shape[:, side].any():
                depths = np.where(shape[:, side] > max(SLIGHT * shape.max(), RANGES["m"][0]), shape[:, side], 0.0)
                worn[f"{key}_depth"] = depths.tolist()
        if name in soft and shape.any():
            worn["indentation"] = soft[name]
        joints[name] = joints[name] | {"wear": worn}
    tables = merged(
        scene_place.tables, {"component": {component: {"change": change} for component, change in bushes.items()}}
    )
    try:
        return scene_place.kind.open(replace(scene_place, tables=tables | {"joint": joints}))
    except InputError as error:  # The scene itself is sound: a shape has left the model.
        raise StageError(str(error)) from error
