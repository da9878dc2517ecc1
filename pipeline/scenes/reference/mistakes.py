"""Mistakes in the tables of a scene as text: the key, the value given, and what is allowed."""

import difflib
import re
from collections.abc import Mapping, Sequence
from itertools import takewhile
from pathlib import Path
from typing import Any

from gudgeon.pipeline.scenes.reference.table_text import ALIASES, home_text, table, table_text

SHOWN = 200
"""Characters of a wrong value in a message."""
QUOTED = r"'([^']*)'"
NEAR = 0.65
"""Least likeness of a name that is proposed for another: 'friction' is no 'orientation'."""
COUNTS = {2: "two", 3: "three", 4: "four"}
FORMS = {"number": "a number", "integer": "a whole number", "string": "a text", "boolean": "true or false",
         "array": "a list"}  # fmt: skip
EXPECTED = ("missing", "too_long", "tuple_type", "float_parsing", "float_type", "string_type", "int_type",
            "int_parsing", "int_from_float", "bool_type", "bool_parsing", "model_type", "dict_type",
            "model_attributes_type")  # fmt: skip
"""Types of error whose message names what the key takes."""
COUNTED = {"too_short": "at least", "too_long": "at most"}


def explained(path: Path, entries: Sequence[Any], raw: Mapping[str, Any], schema: dict[str, Any]) -> list[str]:
    """Return a line for each mistake that pydantic finds in the tables of a file, `raw`, by their schema."""
    wrong = {entry["loc"][:-1] for entry in entries}  # A list is not too short because of a wrong item.
    shown = [entry for entry in entries if not (entry["type"] == "too_short" and entry["loc"] in wrong)]
    return [_explain(path, entry, schema) for entry in _without_forms(shown, raw)]


def _without_forms(entries: Sequence[Any], raw: Mapping[str, Any]) -> list[Any]:
    """Return mistakes with one of each whole value that has none of several forms, such as numbers or rows of them."""
    mistakes, others = [], []
    for entry in entries:
        location = tuple(takewhile(lambda key: not str(key).startswith("tuple["), entry["loc"]))
        value: Any = raw
        if len(location) == len(entry["loc"]) or entry["type"] not in (*EXPECTED, *COUNTED):  # Its form is right.
            mistakes.append(entry | {"loc": location + entry["loc"][len(location) + 1 :]})
            continue
        for step in location:  # Others are tags of unions.
            if (isinstance(value, Mapping) and step in value) or (isinstance(value, list) and isinstance(step, int)):
                value = value[step]
        others.append(entry | {"type": "tuple_type", "loc": location, "input": value})
    return mistakes + [e for e in others if not any(each["loc"][: len(e["loc"])] == e["loc"] for each in mistakes)]


def _explain(path: Path, entry: Any, schema: dict[str, Any]) -> str:
    location = [step for step in entry["loc"] if step != "[key]"]
    if entry["type"] == "missing" and isinstance(location[-1], int):  # A list that is too short.
        location.pop()
    keys, allowed, node = _walk(schema, location)
    source = ": ".join(filter(None, (str(path), ".".join(keys))))
    if entry["type"] == "extra_forbidden":
        hint = hint_of(keys[-1], allowed) or home_text(schema, keys[-1], keys[:-1])
        return f"{source}: unknown key; {hint}allowed here: {', '.join(allowed)}"
    if entry["type"] == "union_tag_invalid":
        key, tags = entry["ctx"]["discriminator"].strip("'"), entry["ctx"]["expected_tags"]
        tag = entry["ctx"]["tag"]
        return f"{source}.{key}: '{tag}' given; {hint_of(tag, re.findall(QUOTED, tags))}input should be one of {tags}"
    if entry["type"] == "union_tag_not_found":
        kinds = ", ".join(f"'{k}'" for k in node.get("discriminator", {}).get("mapping", ()))
        return f"{source}.{entry['ctx']['discriminator'].strip(chr(39))}: is missing; allowed: {kinds}"
    if entry["type"] == "missing" and len(location) == len(entry["loc"]):
        form = _expected(node)
        form = table_text(schema, node, keys[-1]) if form == "a table" else form
        return f"{source}: is missing; give {form}" if form else f"{source}: is missing"
    return f"{source}: {_wrong_value(entry, schema, node, keys[-1] if keys else '')}"


def _wrong_value(entry: Any, schema: dict[str, Any], node: dict[str, Any], key: str) -> str:
    """Return what is wrong with the value of a key, whose schema is `node`, and what is allowed."""
    message = entry["msg"].removeprefix("Value error, ")
    got = entry["input"]
    if entry["type"] in COUNTED and "prefixItems" not in node:
        bound = f"{COUNTED[entry['type']]} {entry['ctx'].get('min_length', entry['ctx'].get('max_length'))}"
        return f"{len(got)} given; allowed: {bound}"
    if isinstance(got, Mapping) or entry["type"] == "value_error":
        return message
    shown = shown_text(got)
    if entry["type"] in EXPECTED and (expected := _expected(node)):
        if expected == "a list" and isinstance(got, str) and len(got) < SHOWN:
            expected = f'a list, such as ["{got}"]'
        if expected == "a table":
            expected = table_text(schema, node, key, got)
        return f"{shown} given; allowed: {expected}"
    literal = entry["type"] == "literal_error"
    hint = hint_of(got if isinstance(got, str) else shown, re.findall(QUOTED, message)) if literal else ""
    return f"{shown} given; {hint}{message[0].lower()}{message[1:]}"


def _expected(node: dict[str, Any]) -> str:
    """Return what a key takes, in words; empty where the form of its value says nothing."""
    if "anyOf" in node:
        return " or ".join(dict.fromkeys(text for n in node["anyOf"] if (text := _expected(n))))
    unit = f" in {node['unit']}" if isinstance(node.get("unit"), str) and node["unit"] != "1" else ""
    if (items := node.get("prefixItems")) is not None:
        names = " [x, y, z]" if len(items) == 3 else ""
        if "prefixItems" in items[0]:
            return f"{COUNTS.get(len(items))} rows of {_expected(items[0])}"
        below = _expected(items[0])
        return f"{COUNTS.get(len(items))} numbers{names}{below.removeprefix('a number')}" if "number" in below else ""
    if any(form in node for form in ("$ref", "additionalProperties", "discriminator")):
        return "a table"
    return FORMS.get(node.get("type", ""), "") + unit


def shown_text(value: Any) -> str:
    """Return a value as text, cut to one short line."""
    if isinstance(value, int) and abs(value) >= 10**SHOWN:
        return "a whole number of more digits than are read"
    try:
        text = repr(value)
    except ValueError:
        return "whole numbers of more digits than are read"
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}…"


def hint_of(name: str, allowed: Sequence[str]) -> str:
    """Return a question with the allowed name that replaces or resembles the given one; empty if there is none."""
    alias = [new for new in allowed if ALIASES.get(name) == new]
    matches = alias or difflib.get_close_matches(name, allowed, 1, NEAR)
    return f"did you mean '{matches[0]}'? " if matches else ""


def _walk(schema: dict[str, Any], location: Sequence[str | int]) -> tuple[list[str], list[str], dict[str, Any]]:
    """Return the location's keys as a user writes them, the keys allowed in its table, and the schema of its value."""
    node, keys, allowed = schema, [], list(schema.get("properties", {}))
    for step in location:
        node = table(schema, node)
        if (mapping := node.get("discriminator", {}).get("mapping")) is not None and step in mapping:
            node = {"$ref": mapping[str(step)]}
            allowed = list(table(schema, node).get("properties", {}))
            continue
        keys.append(str(step))
        allowed = list(node.get("properties", {}))
        items = dict(enumerate(node.get("prefixItems", ())))
        below = node.get("properties", items).get(step, node.get("additionalProperties", node.get("items")))
        node = below if isinstance(below, dict) else {}
    return keys, allowed, next((n for n in node.get("anyOf", ()) if "discriminator" in n), node)
