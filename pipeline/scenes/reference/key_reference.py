"""The reference of scene files: form, unit, default, range, meaning and example of every key, from the JSON schema."""

import difflib
import textwrap
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.reference.examples import Examples
from gudgeon.pipeline.scenes.reference.toml import as_toml

WIDTH = 110
"""Characters of a line of text."""
WIDE = 1e6
"""A limit of this magnitude and above only keeps numbers in range of floating point, and is not shown."""
FORMS = {"number": "number", "integer": "whole number", "string": "text", "boolean": "true or false", "object": "table",
         "array": "list"}  # fmt: skip


@dataclass(frozen=True)
class Key:
    """One key of a table."""

    name: str
    form: str
    """What its value is: a number, a text, a list of 3 numbers."""
    unit: str
    """Empty if it has none."""
    default: str
    """As TOML; `needed` if there is none, empty if the key is off by default."""
    allowed: str
    """Range or choices; empty if the form says all."""
    meaning: str
    example: str
    """A value as TOML."""
    tables: tuple[str, ...]
    """Paths of the tables that may be its value."""


@dataclass(frozen=True)
class Table:
    """One table of a scene file."""

    path: str
    """Keys without the names that the user gives, with the kind at the end where there are several."""
    header: str
    """As it stands in a file: `[component.NAME.mesh]`."""
    definition: str
    meaning: str
    keys: tuple[Key, ...]


def tables(schema: Mapping[str, Any], examples: Examples) -> list[Table]:
    """Return all tables of scene files, from the described schema of their models; see `file_schema.described`."""
    by_path: dict[str, Table] = {}
    for root in schema["anyOf"]:
        for table in _walk(schema["$defs"], root["$ref"].rsplit("/", 1)[1], "", "", {}, examples):
            original = by_path.setdefault(table.path, table)
            if original is not table and not table.path:  # The scene itself: keys of every kind of scene.
                names = {k.name for k in original.keys}
                new = [_of_its_kind(key) for key in table.keys if key.name not in names]
                by_path[""] = Table("", "", "", "", (*original.keys, *new))
    return list(by_path.values())


def _of_its_kind(key: Key) -> Key:
    return replace(key, default="needed in its kind of scene") if key.default == "needed" else key


def _walk(
    definitions: Mapping[str, Any], name: str, path: str, header: str, above: Mapping[str, str], examples: Examples
) -> Iterator[Table]:
    """Yield a table and those below it; `above` has the paths of the definitions that it stands in."""
    definition, within = definitions[name], {**above, name: path}
    keys, below = [], []
    for key, node in definition.get("properties", {}).items():
        inner = f"{path}.{key}" if path else key
        targets = [
            (
                within.get(target, f"{inner}{suffix}"),
                f"{header}.{key}{suffix_of_header}" if header else f"{key}{suffix_of_header}",
                target,
            )
            for suffix, suffix_of_header, target in _targets(node)
        ]
        below += [t for t in targets if t[2] not in within]
        needed = key in definition.get("required", ())
        keys.append(_key(key, node, needed, examples.get((name, key)), tuple(t[0] for t in targets)))
    yield Table(path, f"[{header}]" if header else "", name, " ".join(definition["description"].split()), tuple(keys))
    for inner, suffix_of_header, target in below:
        yield from _walk(definitions, target, inner, suffix_of_header, within, examples)


def _targets(node: Mapping[str, Any]) -> Iterator[tuple[str, str, str]]:
    """Yield for each table that a value may be what its kind adds to the path and to the header, and its definition."""
    if "$ref" in node:
        yield "", "", node["$ref"].rsplit("/", 1)[1]
    elif "discriminator" in node:
        names: dict[str, list[str]] = {}
        for tag, reference in node["discriminator"]["mapping"].items():
            names.setdefault(reference.rsplit("/", 1)[1], []).append(tag)
        for target, tags in names.items():
            yield f".{tags[0]}", "", target
    elif isinstance(node.get("additionalProperties"), dict):
        for suffix, header, target in _targets(node["additionalProperties"]):
            yield suffix, f".NAME{header}", target
    elif "items" in node and isinstance(node["items"], dict):
        yield from _targets(node["items"])
    else:
        for form in node.get("anyOf", ()):
            yield from _targets(form)


def _key(name: str, node: Mapping[str, Any], needed: bool, example: Any, below: tuple[str, ...]) -> Key:
    default = node.get("default")
    silent = default is None or isinstance(default, Mapping) or (isinstance(default, list) and not default)
    return Key(
        name=name,
        form=_form(node),
        unit=unit_of(node),
        default="needed" if needed else "" if silent else as_toml(default),
        allowed=_allowed(node),
        meaning=" ".join(node["description"].split()),
        example=as_toml(example) if example is not None else "",
        tables=below,
    )


def _form(node: Mapping[str, Any]) -> str:
    if "const" in node or "enum" in node:
        return "text"
    if "$ref" in node or "discriminator" in node:
        return "table"
    if isinstance(node.get("additionalProperties"), dict):
        below = _form(node["additionalProperties"])
        return "tables by name" if below == "table" else f"table of names, each with a {below}"
    if "prefixItems" in node:
        kinds = [_form(n) for n in node["prefixItems"]]
        return f"list of {len(kinds)}: {', '.join(dict.fromkeys(kinds))}"
    if isinstance(node.get("items"), dict):
        return f"list: {_form(node['items'])}"
    if "anyOf" in node:
        forms = [_form(n) for n in node["anyOf"] if n.get("type") != "null"]
        return " or ".join(dict.fromkeys(forms))
    return FORMS.get(node.get("type", ""), "any value")


def unit_of(node: Any) -> str:
    """Return the unit of a value, or those of the columns of rows."""
    if isinstance(node, Mapping):
        if "unit" in node:
            units = node["unit"]
            return "" if units == "1" else units if isinstance(units, str) else ", ".join(units)
        if isinstance(node.get("additionalProperties"), dict) or "$ref" in node:
            return ""
    below = node.values() if isinstance(node, Mapping) else node if isinstance(node, list) else ()
    return next((unit for v in below if (unit := unit_of(v))), "")


def _allowed(node: Mapping[str, Any]) -> str:
    if "enum" in node:
        return ", ".join(f'"{v}"' for v in node["enum"])
    if "const" in node:
        return f'"{node["const"]}"'
    if node.get("type") in ("number", "integer"):
        return _range(node)
    below = [*node.get("anyOf", ()), *node.get("prefixItems", ())]
    below += [node["items"]] if isinstance(node.get("items"), dict) else []
    texts = dict.fromkeys(text for n in below if "$ref" not in n and (text := _allowed(n)))
    return "; ".join(texts)


def _range(node: Mapping[str, Any]) -> str:
    above, from_, to = node.get("exclusiveMinimum"), node.get("minimum"), node.get("maximum")
    below = node.get("exclusiveMaximum")
    lowest = f"above {above:g}" if above is not None else f"from {from_:g}" if _shown(from_) else ""
    largest = f"below {below:g}" if below is not None else f"to {to:g}" if _shown(to) else ""
    return f"{lowest} {largest}".strip()


def _shown(limit: float | None) -> bool:
    return limit is not None and abs(limit) < WIDE


def markdown(all_tables: Iterable[Table]) -> str:
    """Return the reference as Markdown; a table that stands in several places is described at the first."""
    path_of: dict[str, str] = {}
    for table in all_tables:
        path_of.setdefault(table.definition, table.path)
    homes = {table.path: path_of[table.definition] for table in all_tables}
    return "\n".join(_section(table, homes) for table in all_tables if homes[table.path] == table.path)


def anchor(path: str) -> str:
    """Return the anchor of a table's heading."""
    return (path or "scene file").replace(".", "").replace(" ", "-").lower()


def _section(table: Table, homes: Mapping[str, str]) -> str:
    head = f"`{table.header}`: {table.meaning}\n" if table.header else "Its tables.\n"
    rows = ["| key | value | default | meaning | example |", "|---|---|---|---|---|"]
    for key in table.keys:
        form = key.form + (f" [{key.unit}]" if key.unit else "") + (f": {key.allowed}" if key.allowed else "")
        links = dict.fromkeys(homes[path] for path in key.tables)
        meaning = key.meaning + "".join(f" [{_short(path)}](#{anchor(path)})" for path in links)
        default = f"`{key.default}`" if key.default and not key.default.startswith("needed") else key.default
        example = f"`{key.example}`" if key.example else ""
        cells = (f"`{key.name}`", form, default, meaning, example)
        rows.append(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |")
    return "\n".join([f"## {table.path or 'Scene file'}\n", head, *rows, ""])


def _short(path: str) -> str:
    return path.rpartition(".")[2]


def key_text(all_tables: Iterable[Table], path: str) -> str:
    """Return the reference of a table or a key as text.

    Args:
        path: Keys without the names that the user gives: `component.interface`, `component.geometry.box`, `run.step`.

    Raises:
        InputError: there is no such table or key.
    """
    by_path = {table.path: table for table in all_tables}
    if path in by_path:
        return _table_text(by_path[path])
    outer, _, name = path.rpartition(".")
    keys = [(outer, k) for k in by_path[outer].keys if k.name == name] if outer in by_path else []
    if keys:
        return "\n\n".join([_key_text(keys[0][1]), *(f"{t}: {by_path[t].meaning}" for t in keys[0][1].tables)])
    paths = [*by_path, *(f"{table.path}.{key.name}".lstrip(".") for table in by_path.values() for key in table.keys)]
    matches = difflib.get_close_matches(path, dict.fromkeys(paths), 3)
    meant = f"did you mean {' or '.join(matches)}?" if matches else f"tables are {', '.join(filter(None, by_path))}"
    raise InputError(f"schema {path}: no such table or key; {meant}")


def _table_text(table: Table) -> str:
    head = f"{table.header}\n{table.meaning}\n\n" if table.header else "A scene file\n\n"
    return head + "\n\n".join(map(_key_text, table.keys))


def _key_text(key: Key) -> str:
    facts = [key.form + (f" [{key.unit}]" if key.unit else "")]
    facts += [f"allowed: {key.allowed}"] if key.allowed else []
    facts += [key.default if key.default.startswith("needed") else f"default: {key.default}"] if key.default else []
    lines = textwrap.wrap(key.meaning, WIDTH - 4) + textwrap.wrap("; ".join(facts), WIDTH - 4)
    if key.example:
        lines.append(f"example: {key.name} = {key.example}")
    if key.tables:
        lines += textwrap.wrap(f"tables: {', '.join(key.tables)}", WIDTH - 4)
    return "\n".join([key.name, *(f"    {line}" for line in lines)])
