"""Units of the keys of a scene by their paths, from the JSON schema of its model."""

from collections.abc import Iterator, Mapping
from typing import Any

from gudgeon.pipeline.scenes.reference.key_reference import unit_of

Schema = Mapping[str, Any]


def unit_at(schema: Schema, path: str) -> str:
    """Return the unit of a key, such as `component.bar.geometry.length` or `body.bar.velocity.0`.

    Args:
        schema: Of the model of the scene.

    Returns:
        Empty where it has none, or where kinds of its table have different ones.
    """
    definitions, nodes, parents = schema.get("$defs", {}), [schema], list[Schema]()
    for key in path.split("."):
        parents, nodes = nodes, [below for node in nodes for below in _below(definitions, node, key)]
    units = {unit for node in nodes if (unit := unit_of(node))}
    if not units and path.rpartition(".")[2].isdecimal():  # Items have the unit that stands beside their list.
        units = {unit for node in parents if (unit := unit_of(node))}
    return units.pop() if len(units) == 1 and ", " not in min(units) else ""


def _below(definitions: Schema, node: Schema, key: str) -> Iterator[Schema]:
    """Yield what a part of a path may name within a node."""
    if "$ref" in node:
        yield from _below(definitions, definitions[node["$ref"].rpartition("/")[2]], key)
    for form in (*node.get("anyOf", ()), *node.get("oneOf", ())):
        yield from _below(definitions, form, key)
    if key in node.get("properties", {}):
        yield node["properties"][key]
    elif isinstance(node.get("additionalProperties"), Mapping):
        yield node["additionalProperties"]
    elif key.isdecimal():
        if isinstance(node.get("items"), Mapping):
            yield node["items"]
        yield from node.get("prefixItems", ())[int(key) : int(key) + 1]
