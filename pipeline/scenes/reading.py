"""Reading a scene: TOML, overrides of the command line, and errors that name the allowed keys."""

import contextlib
import json
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from itertools import takewhile
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from gudgeon.pipeline.errors import InputError, closest
from gudgeon.pipeline.files import is_file
from gudgeon.pipeline.scenes.reference.file_schema import UNSET
from gudgeon.pipeline.scenes.reference.table_text import ALIASES, home_text, table, table_text

Model = TypeVar("Model", bound=BaseModel)
SHOWN = 200
"""Characters of a wrong value in a message."""
DEEPEST = 40
"""Tables within each other in a scene, and files based on each other."""
DOT = re.compile(r"""\.(?=(?:[^"']|"[^"]*"|'[^']*')*$)""")
"""Between the parts of a path: not within a quoted part."""
IN_QUOTES = re.compile(r"""^(["'])(.*)\1$""")
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
CLOSED = re.compile(
    r"Cannot (?:declare|mutate immutable namespace) \((?P<table>[^)]*)\)(?: twice)? \((?P<place>at [^)]*)\)"
)
"""What `tomllib` says of a table that is declared twice or stands in braces."""
KEY = re.compile(
    r"(component|wheel|body|contact|joint|force|motion|probe|report|run|robustness|conductor|panels|half_space|poses)\."
)


def read_tables(path: Path, overrides: Sequence[str] = ()) -> dict[str, Any]:
    """Return a scene's tables with overrides `path.to.key=value` applied; a value that is not TOML is taken as text.

    A file may begin with `base = "other.toml"`: its tables then change those of the other file in the same folder.

    Raises:
        InputError: the file cannot be read or is not valid TOML, or an override has no `=`.
    """
    tables = _tables(path, ())
    for text in overrides:
        changes = parse_override(text)
        _refuse_misspelt(tables, changes, f"--set {text}")
        tables = merged(tables, changes)
    return tables


def _tables(path: Path, above: tuple[Path, ...]) -> dict[str, Any]:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or 'not UTF-8 text'})") from error
    tables = _parsed(text, str(path))
    base = tables.pop("base", None)
    if base is None:
        return tables
    if not isinstance(base, str) or not is_file(path.parent / base):
        raise InputError(f"{path}: base: no file {_shown(base)} beside it")
    if (path.parent / base).resolve() in (*above, path.resolve()):
        raise InputError(f"{path}: base: '{base}' is based on this file itself")
    if len(above) >= DEEPEST:
        raise InputError(f"{path}: base: more than {DEEPEST} files are based on each other")
    below = _tables(path.parent / base, (*above, path.resolve()))
    _refuse_misspelt(below, tables, str(path))
    return merged(below, tables)


def _parsed(text: str, source: str) -> dict[str, Any]:
    """Return the tables of a TOML text; errors name `source` it stands."""
    try:
        tables = tomllib.loads(text)
        if not _deeper(tables, DEEPEST):
            return tables
    except RecursionError:
        pass
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{source}: not valid TOML: {_explained(str(error))}") from error
    except ValueError as error:
        raise InputError(f"{source}: not valid TOML: a whole number has too many digits") from error
    raise InputError(f"{source}: tables or lists are nested too deeply; allowed: {DEEPEST} levels")


def _explained(error: str) -> str:
    """Return a message of the TOML reader; a table that cannot be added to is named as in the file, with what helps."""
    if (match := CLOSED.match(error)) is None:
        return error
    table = ".".join(word.strip(" '\"") for word in match["table"].split(",") if word.strip())
    return (
        f"[{table}] stands there twice, or a table around it is in braces {{…}}, which are complete: write that as a"
        f" table of its own, its keys in lines below its name ({match['place']})"
    )


def _deeper(value: Any, levels: int) -> bool:
    """Return whether tables and lists within each other have more levels than given."""
    below = value.values() if isinstance(value, Mapping) else value if isinstance(value, list) else ()
    return any(levels == 0 or _deeper(v, levels - 1) for v in below)


@contextlib.contextmanager
def named(path: Path, *kinds: type[Exception]) -> Iterator[None]:
    """Prefix errors of these kinds with the scene's file if they begin with a key of the scene."""
    try:
        yield
    except kinds as error:
        if KEY.match(str(error)) is None:
            raise
        raise type(error)(f"{path}: {error}") from error


def check_scene(path: Path, raw: Mapping[str, Any], model: type[Model]) -> Model:
    """Return the scene that tables of the file `path` describe.

    Raises:
        InputError: every mistake, one a line.
    """
    try:
        return model.model_validate(raw)
    except ValidationError as error:
        schema = _schema(model)
        entries = error.errors(include_url=False)
        wrong = {entry["loc"][:-1] for entry in entries}  # A list is not too short because of a wrong item.
        shown = [entry for entry in entries if not (entry["type"] == "too_short" and entry["loc"] in wrong)]
        lines = [_explain(path, entry, schema) for entry in _without_forms(shown, raw)]
        raise InputError("\n".join(dict.fromkeys(lines))) from None


@cache
def _schema(model: type[BaseModel]) -> dict[str, Any]:
    return model.model_json_schema()


def refuse(path: Path, lines: Sequence[str]) -> None:
    """Raise InputError with the file in front of each line, if there are any."""
    if lines:
        raise InputError("\n".join(f"{path}: {line}" for line in lines))


def parse_override(text: str) -> dict[str, Any]:
    """Turn `a.b.c=value` into nested tables.

    Raises:
        InputError: there is no `=`, or a part of the path is empty.
    """
    path, equals, value = text.partition("=")
    keys = [IN_QUOTES.sub(r"\2", k.strip()) for k in DOT.split(path)]
    shown = text if len(text) <= SHOWN else f"{text[:SHOWN]}…"
    if not equals or not all(keys):
        raise InputError(f"--set {shown}: expected path.to.key=value")
    if len(keys) > DEEPEST:
        raise InputError(f"--set {shown}: {len(keys)} parts of the path; allowed: {DEEPEST}")
    try:
        tables = tomllib.loads(f"value = {value}")
        leaf = tables["value"] if len(tables) == 1 else value.strip()
    except tomllib.TOMLDecodeError:
        leaf = value.strip()
    except (ValueError, RecursionError) as error:
        raise InputError(f"--set {shown}: the value has too many digits or levels") from error
    if _deeper(leaf, DEEPEST):
        raise InputError(f"--set {shown}: the value has more than {DEEPEST} levels")
    return nested(keys, leaf)


def override_texts(changes: Any) -> list[str]:
    """Return the overrides of a mapping of paths to values, of texts `path.to.key=value`, or of one such text.

    Raises:
        InputError: it is neither, or TOML has no such value.
    """
    if isinstance(changes, Mapping):
        return [override_text(key, value) for key, value in changes.items()]
    texts = [changes] if isinstance(changes, str) else list(changes) if isinstance(changes, Iterable) else [changes]
    for text in texts:
        if not isinstance(text, str):
            raise InputError(f"set: {_shown(text)} given; allowed: texts path.to.key=value, or a mapping of such paths")
    return texts


def override_text(key: str, value: Any) -> str:
    """Return the override `key=value` of a value of Python or numpy, written as TOML.

    Raises:
        InputError: TOML has no such value.
    """
    try:
        return f"{key}={_toml(value)}"
    except TypeError:
        kinds = "numbers, texts, truth values, and lists and mappings of these"
        raise InputError(f"set: {key}: {_shown(value)} given, a {type(value).__name__}; allowed: {kinds}") from None
    except (ValueError, RecursionError):
        raise InputError(f"set: {key}: the value has too many digits or levels; allowed: {DEEPEST} levels") from None


def _toml(value: Any) -> str:
    value = value.tolist() if hasattr(value, "tolist") else value  # Scalars and arrays of numpy.
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(str(key))} = {_toml(v)}" for key, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, float):
        return repr(value)
    if value is None:
        raise TypeError
    return json.dumps(str(value) if isinstance(value, Path) else value)


def nested(path: Sequence[str], value: Any) -> Any:
    """Return a value within nested tables, one for each key of its path."""
    for key in reversed(path):
        value = {key: value}
    return value


def merged(tables: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return nested tables with `changes` applied; the value `"unset"` removes a key.

    A list is changed item by item where the keys below its name are numbers, from 0 on.

    Raises:
        InputError: a list has no such item.
    """
    result = dict(tables)
    for name, value in changes.items():
        below = result.get(name)
        if value == UNSET:
            result.pop(name, None)
        elif isinstance(value, Mapping) and isinstance(below, list) and all(key.isdecimal() for key in value):
            result[name] = _with_items(name, below, value)
        elif isinstance(value, Mapping):
            result[name] = merged(below if isinstance(below, dict) else {}, value)
        else:
            result[name] = value
    return result


def _refuse_misspelt(tables: Mapping[str, Any], changes: Mapping[str, Any], source: str, *above: str) -> None:
    """Raise InputError where changes remove a key that tables do not have, but one whose name resembles it."""
    for name, value in changes.items():
        below = tables.get(name)
        if value == UNSET and name not in tables and (hint := _hint(name, list(tables))):
            raise InputError(
                f"{source}: {'.'.join((*above, name))} is not given, so that it cannot be unset; {hint.strip()}"
            )
        if isinstance(value, Mapping):
            _refuse_misspelt(below if isinstance(below, Mapping) else {}, value, source, *above, name)


def _with_items(name: str, items: list[Any], changes: Mapping[str, Any]) -> list[Any]:
    """Return a list with some items replaced; `changes` are numbers of items, as text, and their values."""
    result = list(items)
    for key, value in changes.items():
        if int(key) >= len(result):
            raise InputError(f"{name}.{key}: no such item; the list has items 0 to {len(result) - 1}")
        result[int(key)] = merged({"": result[int(key)]}, {"": value})[""]
    return result


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
        hint = _hint(keys[-1], allowed) or home_text(schema, keys[-1], keys[:-1])
        return f"{source}: unknown key; {hint}allowed here: {', '.join(allowed)}"
    if entry["type"] == "union_tag_invalid":
        key, tags = entry["ctx"]["discriminator"].strip("'"), entry["ctx"]["expected_tags"]
        tag = entry["ctx"]["tag"]
        return f"{source}.{key}: '{tag}' given; {_hint(tag, re.findall(QUOTED, tags))}input should be one of {tags}"
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
    shown = _shown(got)
    if entry["type"] in EXPECTED and (expected := _expected(node)):
        if expected == "a list" and isinstance(got, str) and len(got) < SHOWN:
            expected = f'a list, such as ["{got}"]'
        if expected == "a table":
            expected = table_text(schema, node, key, got)
        return f"{shown} given; allowed: {expected}"
    literal = entry["type"] == "literal_error"
    hint = _hint(got if isinstance(got, str) else shown, re.findall(QUOTED, message)) if literal else ""
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


def _shown(value: Any) -> str:
    """Return a value as text, cut to one short line."""
    if isinstance(value, int) and abs(value) >= 10**SHOWN:
        return "a whole number of more digits than are read"
    try:
        text = repr(value)
    except ValueError:
        return "whole numbers of more digits than are read"
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}…"


def _hint(name: str, allowed: Sequence[str]) -> str:
    """Return a question with the allowed name that replaces or resembles the given one; empty if there is none."""
    alias = ALIASES.get(name)
    return f"did you mean '{alias}'? " if alias in allowed else closest(name, allowed, NEAR)


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


def find_file(name: str, folder: Path, key: str) -> Path:
    """Return the path of a file that a scene names, in the scene's folder or the current one.

    Raises:
        InputError: it is in neither folder.
    """
    for candidate in (folder / name, Path(name)):
        if is_file(candidate):
            return candidate
    raise InputError(f"{key}: no file '{name}', neither in {folder} nor in the current folder")
