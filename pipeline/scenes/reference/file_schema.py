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
    found = copy.deepcopy(dict(models))
    for definition in found["$defs"].values():
        text = _first_line(definition)
        for name, one in definition.get("properties", {}).items():
            if "description" in one:
                continue
            if "const" in one:
                one["description"] = text
            elif (below := _definition_of(one)) is not None:
                one["description"] = _first_line(found["$defs"][below])
            else:
                raise ValueError(f"{definition['title']}.{name} has no description")
    return found


def _first_line(definition: Mapping[str, Any]) -> str:
    return definition["description"].partition("\n")[0]


def _definition_of(node: Mapping[str, Any]) -> str | None:
    """Return the name of the definition that a key refers to, also where it may be null."""
    choices = [one for one in node.get("anyOf", [node]) if one.get("type") != "null"]
    return choices[0]["$ref"].rsplit("/", 1)[1] if len(choices) == 1 and "$ref" in choices[0] else None


def file_schema(models: Mapping[str, Any]) -> Schema:
    """Return the schema of a scene file: complete tables, or with `base` the changes of another file's tables.

    Args:
        models: As `described` returns them.
    """
    definitions, roots = models["$defs"], models["anyOf"]
    changes = {f"{name}{CHANGES}": _relaxed(one) for name, one in definitions.items()}
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
        "$defs": {name: _with_short_form(one) for name, one in (definitions | changes).items()},
    }


def _with_short_form(definition: Schema) -> Schema:
    """Return a definition that also accepts what a file may write in place of its table."""
    table = {key: one for key, one in definition.items() if key != SHORT_FORM}
    return {"anyOf": [table, definition[SHORT_FORM]]} if SHORT_FORM in definition else table


def _relaxed(definition: Mapping[str, Any]) -> Schema:
    """Return the schema of changes of a table: no key is needed, and each may be unset."""
    found = _renamed(definition)
    found.pop("required", None)
    found.pop("anyOf", None)
    found["properties"] = {name: _or_unset(one) for name, one in found.get("properties", {}).items()}
    if found.get("additionalProperties") is False:  # A key of the kind that the base has may be unset.
        found["additionalProperties"] = {"const": UNSET}
    return found


def _renamed(node: Any) -> Any:
    """Return a schema whose references lead to the definitions of changes, in which any number of keys is enough."""
    if isinstance(node, list):
        return [_renamed(one) for one in node]
    if not isinstance(node, Mapping):
        return node
    found = {key: _renamed(one) for key, one in node.items() if key not in ("discriminator", "minProperties")}
    if "$ref" in found:
        found["$ref"] = f"{found['$ref']}{CHANGES}"
    if "oneOf" in found:  # Changes of a table need not name its kind.
        found["anyOf"] = found.pop("oneOf")
    if isinstance(found.get("additionalProperties"), dict):
        found["additionalProperties"] = _or_unset(found["additionalProperties"])
    return found


def _or_unset(node: Schema) -> Schema:
    kept = {key: node[key] for key in ("description", "default", "unit") if key in node}
    return {**kept, "anyOf": [node, {"const": UNSET}]}
