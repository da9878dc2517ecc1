"""Whether a scene has the keys that a study varies, and each value alone is one that its key allows."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.reading import check_scene, merged, nested
from gudgeon.pipeline.studies.parameters import Parameter
from gudgeon.solver.scene.refusals import suggestion

NO_RUN = ("report", "plot", "robustness", "sensor")
"""Tables of a scene that do not affect its motion; tasks are sent without them."""


def fitted(job: Any, parameters: Sequence[Parameter]) -> tuple[dict[str, Any], list[Parameter]]:
    """Return the tables that designs change, and the parameters with what the scene says of their values.

    Lists of which a parameter changes an item stand in the tables, with their defaults where the scene has none.

    Args:
        job: The scene as written, of any kind.

    Raises:
        InputError: the scene has no such key, or a value is none that the key allows.
    """
    tables: dict[str, Any] = {name: table for name, table in job.tables.items() if name not in NO_RUN}
    full = job.scene.model_dump(mode="json")
    for parameter in parameters:
        tables = _with_lists(tables, full, parameter)
    return tables, [_checked(job, tables, parameter) for parameter in parameters]


def _with_lists(tables: dict[str, Any], full: Mapping[str, Any], parameter: Parameter) -> dict[str, Any]:
    """Return tables with the list that a parameter changes; raises InputError where the scene has no such place."""
    keys = parameter.path.split(".")
    node: Any = full
    if keys[0] in NO_RUN:
        raise InputError(f"{parameter.source}: '{keys[0]}' does not affect the motion; vary keys of other tables")
    for depth, key in enumerate(keys):
        if isinstance(node, list):
            if not key.isdecimal() or int(key) >= len(node):
                raise InputError(f"{parameter.source}: no item '{key}'; allowed: 0 to {len(node) - 1}")
            tables = _defaults(tables, keys[:depth], node)
            node = node[int(key)]
        elif isinstance(node, Mapping) and key in node:
            node = node[key]
        elif isinstance(node, Mapping) and depth < 2:
            above = ".".join(keys[:depth]) or "the scene"
            have = ", ".join(name for name in node if name not in NO_RUN) or "nothing"
            raise InputError(f"{parameter.source}: no '{key}' in {above}; {suggestion(key, node)}it has {have}")
        else:
            break
    return tables


def _defaults(tables: dict[str, Any], keys: Sequence[str], items: list[Any]) -> dict[str, Any]:
    """Return tables with a list at a path, unless one is there."""
    node: Any = tables
    for key in keys:
        if isinstance(node, list):
            node = node[int(key)]
            continue
        if not isinstance(node, Mapping) or key not in node:
            return merged(tables, nested(keys, items))
        node = node[key]
    return tables


def _checked(job: Any, tables: dict[str, Any], parameter: Parameter) -> Parameter:
    """Return a parameter whose values its key allows; those of a range are whole numbers where it needs them."""
    for value in parameter.representatives():
        if (message := _refusal(job, tables, parameter.path, value)) is not None:
            raise InputError(f"{parameter.place(value)}: {message}")
    ends = (parameter.low, parameter.high)
    if parameter.values or not all(end.is_integer() for end in ends):
        return parameter
    inner = min(ends) + 0.5
    return replace(parameter, whole=_refusal(job, tables, parameter.path, inner) is not None)


def _refusal(job: Any, tables: dict[str, Any], path: str, value: Any) -> str | None:
    """Return why a key does not allow a value, None where it does; contradictions with other keys do not count.

    Where the scene has no such key yet, all that is wrong beside it counts, too.
    """
    changed = merged(tables, nested(path.split("."), value))
    try:
        check_scene(job.path, changed, type(job.scene))
    except InputError as error:
        for line in str(error).splitlines():
            key, _, text = line.removeprefix(f"{job.path}: ").partition(": ")
            if key == path:
                return text
            if path.startswith(f"{key}.") or (not _exists(job, path) and key.startswith(path.rpartition(".")[0])):
                return f"{key}: {text}"
    return None


def _exists(job: Any, path: str) -> bool:
    """Return whether a scene with its defaults has something at a path."""
    node: Any = job.scene.model_dump(mode="json")
    for key_text in path.split("."):
        items = dict(enumerate(node)) if isinstance(node, list) else node if isinstance(node, Mapping) else {}
        key: Any = int(key_text) if isinstance(node, list) and key_text.isdecimal() else key_text
        if key not in items:
            return False
        node = items[key]
    return True


def check_shown(job: Any, patterns: Sequence[str]) -> None:
    """Raise InputError where a pattern fits no quantity that runs of a scene may have."""
    possible = job.quantities() if patterns else ()
    for pattern in patterns if possible else ():
        if not any(fnmatchcase(name, pattern) for name in possible):
            have = ", ".join(dict.fromkeys(name.partition(".")[0] for name in possible))
            raise InputError(
                f"--quantity {pattern}: no run of the scene has it; {suggestion(pattern, possible)}it has"
                f" quantities of {have}"
            )
