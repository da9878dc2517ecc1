"""The tasks of a study: one for each different design, after those that make what several designs share.

A mesh or a modal basis that several designs need and that is not in the database is a task of its own, on which they
wait: otherwise each worker would compute it.
"""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.studies.task import SOLVE, Source, Task

SHAPING = ("component", "wheel", "contact")
"""Tables that meshes and modes depend on: designs that differ in others only share them all."""


@dataclass(frozen=True)
class Step:
    """A task and the steps that must be done before it."""

    task: Task
    after: frozenset[int]
    """Numbers of these steps."""
    designs: tuple[int, ...] = ()
    """Numbers of the designs that it solves, which are equal; none where it makes what designs share."""


@dataclass
class _Group:
    """Designs that share all meshes and modes."""

    changes: tuple[tuple[str, Any], ...]
    """Of the first of them."""
    designs: list[int] = field(default_factory=list)
    after: set[int] = field(default_factory=set)
    """Steps that make what they share."""


def planned(
    source: Source, stages: tuple[str, ...], paths: Sequence[str], designs: Sequence[Sequence[Any]]
) -> list[Step]:
    """Return the steps of a study in an order in which they can be done.

    Args:
        stages: Of the kind of scene, without pictures.
        designs: Values of each design in the order of `paths`; designs are numbered from 1.
    """
    changes = [tuple(zip(paths, values, strict=True)) for values in designs]
    equal: dict[str, list[int]] = {}
    for design_number, changed in enumerate(changes, 1):
        equal.setdefault(json.dumps(changed), []).append(design_number)
    groups: dict[str, _Group] = {}
    group_of: dict[int, _Group] = {}
    for design, *_ in equal.values():
        shaping = [pair for pair in changes[design - 1] if pair[0].partition(".")[0] in SHAPING]
        group = groups.setdefault(json.dumps(shaping), _Group(changes[design - 1]))
        group.designs.append(design)
        group_of[design] = group
    steps = _shared_steps(source, stages, list(groups.values()))
    for text, numbers in equal.items():
        task = Task(source, numbers[0], text, stages)
        steps.append(Step(task, frozenset(group_of[numbers[0]].after), tuple(numbers)))
    return steps


def _shared_steps(source: Source, stages: tuple[str, ...], groups: list[_Group]) -> list[Step]:
    """Return the steps that make what several designs need, and note in each group those on which it waits."""
    early = stages[: stages.index(SOLVE)]
    missing = [_missing(source, early, group) for group in groups]
    needed: Counter[str] = Counter()
    for group, missing_keys in zip(groups, missing, strict=True):
        for keys in missing_keys.values():
            needed.update({key: len(group.designs) for key in keys})
    steps: list[Step] = []
    makers: dict[str, int] = {}
    for s, stage in enumerate(early):
        for group, missing_keys in zip(groups, missing, strict=True):
            shared = [key for key in missing_keys.get(stage, ()) if needed[key] > 1]
            if new_keys := [key for key in shared if key not in makers]:
                makers |= dict.fromkeys(new_keys, len(steps))
                after = frozenset(group.after | {makers[key] for key in shared} - {len(steps)})
                task = Task(source, group.designs[0], json.dumps(group.changes), stages[: s + 1])
                steps.append(Step(task, after))
            group.after |= {makers[key] for key in shared}
    return steps


def _missing(source: Source, stages: Sequence[str], group: _Group) -> dict[str, list[str]]:
    """Return the keys of the records of each stage that a group needs and the database lacks; none if it is refused."""
    try:
        job = source.job(group.changes)
        keys = {stage: [p.key for p in job.products([stage]).values()] for stage in stages}
    except InputError:  # Each of its designs says so.
        return {}
    return {
        stage: [key for key in dict.fromkeys(all_keys) if not job.store.has(key)] for stage, all_keys in keys.items()
    }
