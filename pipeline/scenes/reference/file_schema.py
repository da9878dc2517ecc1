"""The JSON schema of a scene file as an editor and a validator need it, from that of the models.

The models describe complete scenes. A file may write some tables in a short form, and one that begins with `base` holds
only what differs from another file, where the text "unset" removes a key.
"""

import copy
from collections.abc import Mapping
from typing import Any

UNSET = "unset"
"""Text that removes a key of the file that another is based on."""
Schema = dict[str, Any]
DIALECT = "https://json-schema.org/draft/2020-12/schema"
IDENTIFIER = "urn:gudgeon:scene"
CHANGES = "Changes"
"""Suffix of the definitions of tables that change those of a base."""
SHORT_FORM = "short_form"
"""Key of a definition with the schema of what a file may write in place of the table."""
BASE: Schema = {
    "type": "string",
    "description": 'File in the same folder whose tables this one changes; the value "unset" removes a key',
    "examples": ["scene.toml"],
}


def described(models: Mapping[str, Any]) -> Schema:
    """Return the schema of the models where every key has a description.

    A key that names the kind of its table has the description of that kind; a key that is a table, that of the table.
    """
    schema = copy.deepcopy(dict(models))
    for definition in schema["$defs"].values():
        text = _first_line(definition)
        for name, key_schema in definition.get("properties", {}).items():
            if "description" in key_schema:
                continue
            if "const" in key_schema:
                key_schema["description"] = text
            elif (below := _definition_of(key_schema)) is not None:
                key_schema["description"] = _first_line(schema["$defs"][below])
            else:
                raise ValueError(f"{definition['title']}.{name} has no description")
    return schema


def _first_line(definition: Mapping[str, Any]) -> str:
    return definition["description"].partition("\n")[0]


def _definition_of(node: Mapping[str, Any]) -> str | None:
    """Return the name of the definition that a key refers to, also where it may be null."""
    choices = [n for n in node.get("anyOf", [node]) if n.get("type") != "null"]
    return choices[0]["$ref"].rsplit("/", 1)[1] if len(choices) == 1 and "$ref" in choices[0] else None


def file_schema(models: Mapping[str, Any]) -> Schema:
    """Return the schema of a scene file: complete tables, or with `base` the changes of another file's tables.

    Args:
        models: As `described` returns them.
    """
    definitions, roots = models["$defs"], models["anyOf"]
    changes = {f"{name}{CHANGES}": _relaxed(d) for name, d in definitions.items()}
    tops = [{"$ref": f"{root['$ref']}{CHANGES}"} for root in roots]
    for top in tops:
        name = top["$ref"].rsplit("/", 1)[1]
        changes[name]["properties"] = {"base": BASE, **changes[name]["properties"]}
    return {
        "$schema": DIALECT,
        "$id": IDENTIFIER,
        "title": "Scene of Gudgeon",
        "if": {"required": ["base"]},
        "then": {"anyOf": tops},
        "else": {"anyOf": roots},
        "$defs": {name: _with_short_form(d) for name, d in (definitions | changes).items()},
    }


def _with_short_form(definition: Schema) -> Schema:
    """Return a definition that also accepts what a file may write in place of its table."""
    table = {key: v for key, v in definition.items() if key != SHORT_FORM}
    return {"anyOf": [table, definition[SHORT_FORM]]} if SHORT_FORM in definition else table


def _relaxed(definition: Mapping[str, Any]) -> Schema:
    """Return the schema of changes of a table: no key is needed, and each may be unset."""
    changes = _renamed(definition)
    changes.pop("required", None)
    changes.pop("anyOf", None)
    changes["properties"] = {name: _or_unset(p) for name, p in changes.get("properties", {}).items()}
    if changes.get("additionalProperties") is False:  # A key of the kind that the base has may be unset.
        changes["additionalProperties"] = {"const": UNSET}
    return changes


def _renamed(node: Any) -> Any:
    """Return a schema whose references lead to the definitions of changes, in which any number of keys is enough."""
    if isinstance(node, list):
        return [_renamed(n) for n in node]
    if not isinstance(node, Mapping):
        return node
    schema = {key: _renamed(n) for key, n in node.items() if key not in ("discriminator", "minProperties")}
    if "$ref" in schema:
        schema["$ref"] = f"{schema['$ref']}{CHANGES}"
    if "oneOf" in schema:  # Changes of a table need not name its kind.
        schema["anyOf"] = schema.pop("oneOf")
    if isinstance(schema.get("additionalProperties"), dict):
        schema["additionalProperties"] = _or_unset(schema["additionalProperties"])
    return schema


def _or_unset(node: Schema) -> Schema:
    described_as = {key: node[key] for key in ("description", "default", "unit") if key in node}
    return {**described_as, "anyOf": [node, {"const": UNSET}]}
