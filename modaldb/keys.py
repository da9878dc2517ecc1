"""Content keys: the SHA-256 of everything that a product depends on.

Two inputs have the same key if and only if their canonical JSON is the same: keys sorted, no white space, floats in
their shortest round-trip form, NaN and infinities refused.
"""

import errno
import hashlib
import json
import os
import re
import stat
from collections.abc import Mapping
from io import BufferedReader
from pathlib import Path
from typing import Any

KEY = re.compile(r"[0-9a-f]{64}")
"""What a key looks like."""
DEEPEST = 100
"""Levels of tables and lists in a JSON text of a record."""


def canonical_json(inputs: Mapping[str, Any]) -> str:
    """Return the canonical JSON text of `inputs`.

    Raises:
        ValueError: a float is not finite.
        TypeError: a value has no JSON form.
    """
    return json.dumps(inputs, sort_keys=True, separators=(",", ":"), allow_nan=False)


def content_key(inputs: Mapping[str, Any]) -> str:
    """Return the key of a product made from `inputs`, 64 hexadecimal digits."""
    return text_key(canonical_json(inputs))


def text_key(text: str) -> str:
    """Return the key of a product whose inputs have this canonical JSON text."""
    return hashlib.sha256(text.encode()).hexdigest()


def read_table(text: str) -> dict[str, Any]:
    """Return the table of a JSON text.

    Raises:
        ValueError: it is no table, has half of a letter, or more than `DEEPEST` levels, which others cannot repeat.
    """
    try:
        table = json.loads(text)
        json.dumps(table, ensure_ascii=False).encode()
    except (TypeError, RecursionError) as error:
        raise ValueError(str(error)) from None
    if not isinstance(table, dict) or _is_deeper(table, DEEPEST):
        raise ValueError(f"no table of at most {DEEPEST} levels")
    return table


def read_inputs(text: str) -> dict[str, Any]:
    """Return the inputs of a canonical JSON text; raise ValueError where it is none."""
    inputs = read_table(text)
    if canonical_json(inputs) != text:
        raise ValueError("not the canonical JSON of its inputs")
    return inputs


def _is_deeper(value: Any, levels: int) -> bool:
    """Return whether tables and lists are within each other more often than that."""
    members = value.values() if isinstance(value, dict) else value if isinstance(value, list) else None
    return members is not None and (levels == 0 or any(_is_deeper(member, levels - 1) for member in members))


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file's bytes, 64 hexadecimal digits; see `open_file`."""
    with open_file(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def open_file(path: Path) -> BufferedReader:
    """Open a file for reading.

    Raises:
        OSError: it cannot be read, or is a pipe or a device, which may have no end.
    """
    file = os.fdopen(os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK), "rb")
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise OSError(errno.EINVAL, "not a file", str(path))
    return file


def differences(old: Mapping[str, Any], new: Mapping[str, Any], prefix: str = "") -> list[str]:
    """List what changed between two inputs, one `path: old → new` a line, sorted by path."""
    lines = []
    for name in sorted({*old, *new}):
        path, before, after = f"{prefix}{name}", old.get(name), new.get(name)
        if isinstance(before, Mapping) and isinstance(after, Mapping):
            lines += differences(before, after, f"{path}.")
        elif before != after:
            lines.append(f"{path}: {_short(before)} → {_short(after)}")
    return lines


def _short(value: Any) -> str:
    text = "nothing" if value is None else json.dumps(value)
    return text if len(text) <= 48 else f"{text[:20]}…{text[-20:]}"
