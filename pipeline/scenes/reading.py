"""Reading a scene: TOML, overrides of the command line, and errors that name the allowed keys."""

import contextlib
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import is_file
from gudgeon.pipeline.scenes.reference.file_schema import UNSET
from gudgeon.pipeline.scenes.reference.mistakes import SHOWN, explained, hint_of, shown_text
from gudgeon.pipeline.scenes.reference.toml import as_toml, plain

Model = TypeVar("Model", bound=BaseModel)
DEEPEST = 40
"""Tables within each other in a scene, and files based on each other."""
DOT = re.compile(r"""\.(?=(?:[^"']|"[^"]*"|'[^']*')*$)""")
"""Between the parts of a path: not within a quoted part."""
IN_QUOTES = re.compile(r"""^(["'])(.*)\1$""")
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
    return changed_tables(_tables(path, ()), overrides)


def given_tables(tables: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Return the tables of a mapping of Python as those of a file; `source` is its name in messages.

    Raises:
        InputError: they are nested too deeply.
    """
    try:
        plain_tables = plain(tables)
        if not _deeper(plain_tables, DEEPEST):
            return plain_tables
    except RecursionError:
        pass
    raise InputError(f"{source}: tables or lists are nested too deeply; allowed: {DEEPEST} levels")


def changed_tables(tables: dict[str, Any], overrides: Sequence[str]) -> dict[str, Any]:
    """Return tables with overrides `path.to.key=value` applied; see `read_tables`."""
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
        raise InputError(f"{path}: base: no file {shown_text(base)} next to it")
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
        f"[{table}] is declared twice, or a table around it is in braces {{…}}, which are complete: write that as a"
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
        lines = explained(path, error.errors(include_url=False), raw, _schema(model))
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
            raise InputError(
                f"set: {shown_text(text)} given; allowed: texts path.to.key=value, or a mapping of such paths"
            )
    return texts


def override_text(key: str, value: Any) -> str:
    """Return the override `key=value` of a value of Python or numpy, written as TOML.

    Raises:
        InputError: TOML has no such value.
    """
    try:
        return f"{key}={as_toml(value)}"
    except TypeError:
        kinds = "numbers, texts, truth values, and lists and mappings of these"
        raise InputError(f"set: {key}: {shown_text(value)} given, a {type(value).__name__}; allowed: {kinds}") from None
    except (ValueError, RecursionError):
        raise InputError(f"set: {key}: the value has too many digits or levels; allowed: {DEEPEST} levels") from None


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
        if value == UNSET and name not in tables and (hint := hint_of(name, list(tables))):
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


def find_file(name: str, folder: Path, key: str) -> Path:
    """Return the path of a file that a scene names, in the scene's folder or the current one.

    Raises:
        InputError: it is in neither folder.
    """
    for candidate in (folder / name, Path(name)):
        if is_file(candidate):
            return candidate
    raise InputError(f"{key}: no file '{name}', neither in {folder} nor in the current folder")
