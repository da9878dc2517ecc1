"""Reading a scene: TOML, overrides from the command line, and errors that say what to write instead."""

import contextlib
import difflib
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from gudgeon.pipeline.errors import InputError

Model = TypeVar("Model", bound=BaseModel)
SCENE_FILE = "scene.toml"
UNSET = "unset"
KEY = re.compile(r"(component|wheel|body|contact|joint|force|report|run|robustness)\.")


def scene_path(scene: str | Path) -> Path:
    """Return the TOML file of a scene given as a file or as its folder.

    Raises:
        InputError: neither is there.
    """
    path = Path(scene)
    path = path / SCENE_FILE if path.is_dir() else path
    if not path.is_file():
        raise InputError(f"{scene}: no scene here; give a folder with {SCENE_FILE} or a TOML file")
    return path


def read_tables(path: Path, overrides: Sequence[str] = ()) -> dict[str, Any]:
    """Return a scene's tables with overrides put in.

    A file may begin with `base = "other.toml"`: then its tables change those of the other file beside it.

    Args:
        overrides: `path.to.key=value` texts; values are TOML, and plain text where they are not.

    Raises:
        InputError: the file cannot be read or is no TOML, or an override has no `=`.
    """
    tables = _tables(path, ())
    for text in overrides:
        merge(tables, parse_override(text))
    return tables


def _tables(path: Path, above: tuple[Path, ...]) -> dict[str, Any]:
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or 'not UTF-8 text'})") from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not valid TOML: {error}") from error
    base = tables.pop("base", None)
    if base is None:
        return tables
    if not isinstance(base, str) or not (path.parent / base).is_file():
        raise InputError(f"{path}: base: no file {base!r} beside it")
    if (path.parent / base).resolve() in (*above, path.resolve()):
        raise InputError(f"{path}: base: '{base}' is based on this file itself")
    found = _tables(path.parent / base, (*above, path.resolve()))
    merge(found, tables)
    return found


@contextlib.contextmanager
def named(path: Path, *kinds: type[Exception]) -> Iterator[None]:
    """Begin errors of these kinds that are about a key of the scene with the scene's file."""
    try:
        yield
    except kinds as error:
        if KEY.match(str(error)) is None:
            raise
        raise type(error)(f"{path}: {error}") from error


def check_scene(path: Path, raw: Mapping[str, Any], model: type[Model]) -> Model:
    """Turn tables into the scene they describe.

    Args:
        path: The scene's file, for messages.
        model: What the scene must look like.

    Raises:
        InputError: every mistake, one a line.
    """
    try:
        return model.model_validate(raw)
    except ValidationError as error:
        schema = model.model_json_schema()
        lines = [_explain(path, entry, schema) for entry in error.errors(include_url=False)]
        raise InputError("\n".join(lines)) from None


def parse_override(text: str) -> dict[str, Any]:
    """Turn `a.b.c=value` into nested tables.

    Raises:
        InputError: there is no `=`, or a part of the path is empty.
    """
    path, equals, value = text.partition("=")
    parts = [part.strip() for part in path.split(".")]
    if not equals or not all(parts):
        raise InputError(f"--set {text}: expected path.to.key=value")
    try:
        leaf = tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        leaf = value.strip()
    tables: dict[str, Any] = {parts[-1]: leaf}
    for part in reversed(parts[:-1]):
        tables = {part: tables}
    return tables


def merge(tables: dict[str, Any], changes: Mapping[str, Any]) -> None:
    """Put `changes` into nested `tables`, in place; the value `"unset"` takes a key away."""
    for name, value in changes.items():
        if value == UNSET:
            tables.pop(name, None)
        elif isinstance(value, Mapping):
            below = tables.get(name)
            tables[name] = below if isinstance(below, dict) else {}
            merge(tables[name], value)
        else:
            tables[name] = value


def _explain(path: Path, entry: Any, schema: dict[str, Any]) -> str:
    keys, allowed = _walk(schema, entry["loc"])
    where = ": ".join([str(path), ".".join(keys)] if keys else [str(path)])
    if entry["type"] == "extra_forbidden":
        near = difflib.get_close_matches(keys[-1], allowed, 1)
        hint = f"did you mean '{near[0]}'? " if near else ""
        return f"{where}: unknown key; {hint}allowed here: {', '.join(allowed)}"
    if entry["type"] == "union_tag_invalid":
        key, tags = entry["ctx"]["discriminator"].strip("'"), entry["ctx"]["expected_tags"]
        near = difflib.get_close_matches(entry["ctx"]["tag"], re.findall(r"'([^']*)'", tags), 1)
        hint = f"did you mean '{near[0]}'? " if near else ""
        return f"{where}.{key}: '{entry['ctx']['tag']}' given; {hint}input should be one of {tags}"
    if entry["type"] == "union_tag_not_found":
        return f"{where}.{entry['ctx']['discriminator'].strip(chr(39))}: is missing"
    if entry["type"] == "missing":
        return f"{where}: is missing"
    message = entry["msg"].removeprefix("Value error, ")
    given = entry["input"]
    if isinstance(given, Mapping) or entry["type"] == "value_error":
        return f"{where}: {message}"
    return f"{where}: {given!r} given; {message[0].lower()}{message[1:]}"


def _walk(schema: dict[str, Any], location: Sequence[str | int]) -> tuple[list[str], list[str]]:
    """Return the location's keys as a user writes them, and the keys allowed in its table."""
    node, keys, allowed = schema, [], list(schema.get("properties", {}))
    for part in location:
        node = _resolve(schema, node)
        if (mapping := node.get("discriminator", {}).get("mapping")) is not None and part in mapping:
            node = {"$ref": mapping[str(part)]}
            allowed = list(_resolve(schema, node).get("properties", {}))
            continue
        keys.append(str(part))
        allowed = list(node.get("properties", {}))
        below = node.get("properties", {}).get(part, node.get("additionalProperties", node.get("items")))
        node = below if isinstance(below, dict) else {}
    return keys, allowed


def _resolve(schema: dict[str, Any], node: dict[str, Any]) -> dict[str, Any]:
    while "$ref" in node:
        node = schema["$defs"][node["$ref"].rsplit("/", 1)[1]]
    return node


def find_file(name: str, folder: Path, where: str) -> Path:
    """Find a file that a scene names, beside the scene or where the command runs.

    Raises:
        InputError: it is in neither place.
    """
    for candidate in (folder / name, Path(name)):
        if candidate.is_file():
            return candidate
    raise InputError(f"{where}: no file '{name}', neither in {folder} nor here")
