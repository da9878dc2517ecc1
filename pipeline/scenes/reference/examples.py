"""Examples of the keys of scene files: the values that the shipped scenes give them."""

from collections.abc import Iterable, Mapping
from typing import Any

from gudgeon.pipeline.scenes.reference.example_values import BY_NAME, BY_TABLE
from gudgeon.pipeline.scenes.reference.toml import as_toml

Examples = Mapping[tuple[str, str], Any]
"""A value by definition of the schema and key."""
LONGEST = 60
"""Characters of an example as TOML; longer values are left out."""


def found_examples(schema: Mapping[str, Any], scenes: Iterable[Mapping[str, Any]]) -> Examples:
    """Return a value of every key: the first in some scenes' tables, or one of `example_values`, or the default."""
    examples: dict[tuple[str, str], Any] = {}
    for tables in scenes:
        for root in schema["anyOf"]:
            name = root["$ref"].rsplit("/", 1)[1]
            if set(tables) <= set(schema["$defs"][name]["properties"]):
                _collect(schema["$defs"], root, tables, examples)
    for name, definition in schema["$defs"].items():
        for key, node in definition.get("properties", {}).items():
            if (name, key) not in examples and (value := _own(definition["title"], key, node)) is not None:
                examples[name, key] = value
    return examples


def _own(title: str, key: str, node: Mapping[str, Any]) -> Any:
    """Return an example of a key that no scene has; None for tables."""
    if "const" in node:
        return node["const"]
    if key in BY_TABLE.get(title, {}):
        return BY_TABLE[title][key]
    table = any("$ref" in n or "discriminator" in n for n in (node, *node.get("anyOf", ())))
    if table or "additionalProperties" in node:
        return None
    if key in BY_NAME and not ("enum" in node and "default" in node):
        return BY_NAME[key]
    default = node.get("default", node["enum"][0] if "enum" in node else None)
    return None if isinstance(default, Mapping) else default


def _collect(definitions: Mapping[str, Any], node: Mapping[str, Any], value: Any, examples: dict[Any, Any]) -> None:
    if "$ref" in node and isinstance(value, Mapping):
        name = node["$ref"].rsplit("/", 1)[1]
        properties = definitions[name].get("properties", {})
        for key in filter(value.__contains__, properties):
            if len(as_toml(value[key])) <= LONGEST:
                examples.setdefault((name, key), value[key])
            _collect(definitions, properties[key], value[key], examples)
    elif "discriminator" in node and isinstance(value, Mapping):
        tag = value.get(node["discriminator"]["propertyName"])
        if (reference := node["discriminator"]["mapping"].get(tag)) is not None:
            _collect(definitions, {"$ref": reference}, value, examples)
    elif isinstance(below := node.get("additionalProperties"), dict) and isinstance(value, Mapping):
        for item in value.values():
            _collect(definitions, below, item, examples)
    elif isinstance(below := node.get("items"), dict) and isinstance(value, list):
        for item in value:
            _collect(definitions, below, item, examples)
    else:
        for form in node.get("anyOf", ()):
            _collect(definitions, form, value, examples)
