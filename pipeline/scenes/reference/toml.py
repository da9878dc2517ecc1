"""Tables of a scene as TOML, and values of Python as TOML has them."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel

BARE = re.compile(r"[A-Za-z0-9_-]+")
"""Keys without quotes."""
WIDE = 110
"""Characters of a line from which a table has lines of its own."""


def plain(value: Any) -> Any:
    """Return a value of Python, numpy or a model as the TOML reader returns one: mappings, lists, texts and numbers."""
    if isinstance(value, BaseModel):
        value = value.model_dump(mode="json", exclude_unset=True)
    value = value.tolist() if hasattr(value, "tolist") else value  # Scalars and arrays of numpy.
    if isinstance(value, Mapping):
        return {str(key): plain(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    return str(value) if isinstance(value, Path) else value


def as_toml(value: Any) -> str:
    """Return a value as it stands in a scene file; tables on one line, their entries without a value left out.

    Raises:
        TypeError: TOML has no such value.
    """
    value = plain(value)
    if isinstance(value, dict):
        entries = ", ".join(f"{key_text(key)} = {as_toml(v)}" for key, v in value.items() if v is not None)
        return f"{{ {entries} }}" if entries else "{}"
    if isinstance(value, list):
        return f"[{', '.join(map(as_toml, value))}]"
    if isinstance(value, float):
        return repr(value)
    if value is None:
        raise TypeError("None")
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def key_text(key: str) -> str:
    """Return a key, in quotes where TOML needs them."""
    return key if BARE.fullmatch(key) else json.dumps(key, ensure_ascii=False)


def toml_document(tables: Mapping[str, Any]) -> str:
    """Return the text of a TOML file of some tables; a short table within another one is one line of it."""
    return "\n\n".join(_sections((), plain(tables))) + "\n"


def _sections(path: tuple[str, ...], table: Mapping[str, Any]) -> list[str]:
    """Return the text of a table and of those within it that have lines of their own."""
    lines, below = [], []
    for key, value in table.items():
        if value is None:
            continue
        line = f"{key_text(key)} = {as_toml(value)}"
        if isinstance(value, dict) and value and (len(path) < 2 or len(line) > WIDE):
            below += _sections((*path, key), value)
        else:
            lines.append(line)
    head = [f"[{'.'.join(map(key_text, path))}]"] if path and (lines or not below) else []
    return ["\n".join(head + lines), *below] if head or lines else below
