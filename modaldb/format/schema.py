"""What a record of each kind must have, checked on the structure of its file before any array is read."""

import types
import typing
from collections.abc import Collection, Iterator
from dataclasses import Field, dataclass, field, fields, is_dataclass
from functools import cache
from typing import Any
from urllib.parse import unquote

import numpy as np

from gudgeon.modaldb.format.blocks import Malformed
from gudgeon.modaldb.format.structure import Dataset, Group
from gudgeon.modaldb.records.types import ARRAY, ArrayRule

DTYPES = {"float": "<f8", "int": "<i8", "bool": "?"}
Letters = dict[str, int]
"""Dimensions by their letter, see `ArrayRule`."""


@dataclass(frozen=True)
class Outline:
    """What was found while a structure was checked."""

    letters: Letters = field(default_factory=dict)
    """Dimensions of the record."""
    shapes: dict[str, tuple[int, ...]] = field(default_factory=dict)
    """Shape of each array by its field path."""


def checked_outline(root: Group, cls: type, beside: set[str]) -> Outline:
    """Compare a structure with the record that it should have; see `Malformed` for what is raised.

    Args:
        root: The structure.
        cls: Dataclass of the record.
        beside: Attributes of the root that are no fields.
    """
    outline = Outline()
    rules = list(_walk(root, cls, "", beside))
    for path, dataset, rule, member_letters in rules:
        if dataset.dtype != DTYPES[rule.dtype]:
            raise Malformed(f"{path}: numbers of type {dataset.dtype}, expected {rule.dtype}")
        if not any(
            _fits(dataset.shape, shape.split(), outline.letters, member_letters) for shape in rule.shape.split(" or ")
        ):
            sizes = {**outline.letters, **member_letters}
            letters = ", ".join(f"{k} = {sizes[k]}" for k in dict.fromkeys(rule.shape.split()) if k in sizes)
            with_known = f" with {letters}" if letters else ""
            expected = rule.shape.replace(" or ", "; ").replace(" ", ", ").replace(";,", ") or (")
            raise Malformed(f"{path}: shape {dataset.shape}, expected ({expected}){with_known}")
        outline.shapes[path] = dataset.shape
    return outline


@cache
def type_hints(cls: type) -> dict[str, Any]:
    """Return the type of every field of a dataclass."""
    return typing.get_type_hints(cls)


def base_type(hint: Any) -> Any:
    """Return the type of a field; that of an optional one comes before None."""
    return typing.get_args(hint)[0] if isinstance(hint, types.UnionType) else hint


def member_type(hint: Any) -> Any:
    """Return the type of the named members of a group hint `dict[str, X]`, or None where X is plain JSON."""
    member = typing.get_args(hint)[1] if typing.get_origin(hint) is dict else None
    return member if is_dataclass(member) or member is np.ndarray else None


def check_paths(cls: type, paths: Collection[str]) -> None:
    """Raise Malformed where a field path leads to no field of a record; members of a group may have any name."""
    for path in paths:
        hint: Any = cls
        for name in path.split("/"):
            names = type_hints(hint) if is_dataclass(hint) else {name: member_type(hint)}
            if (below := names.get(name)) is None:
                have = f"; allowed: {', '.join(names)}" if is_dataclass(hint) else ""
                raise Malformed(f"no field '{path}'{have}")
            hint = base_type(below)


def check_values(array: np.ndarray, rule: ArrayRule, letters: Letters, path: str) -> None:
    """Raise Malformed where numbers are not what the rule says."""
    if rule.dtype == "float" and rule.finite:
        flat = array.reshape(-1)
        with np.errstate(over="ignore", invalid="ignore"):
            squares = np.dot(flat, flat)  # Several times cheaper than a look at every number.
        if not np.isfinite(squares):
            raise Malformed(f"{path}: not a number, infinite, or so large that its square is")
    if rule.below and array.size:
        end = letters.get(rule.below, np.iinfo(np.int64).max)
        if array.min() < 0 or array.max() >= end:
            raise Malformed(f"{path}: numbers {array.min()} to {array.max()}, expected 0 to {end - 1}")
    if rule.dtype == "bool" and array.view(np.uint8).max(initial=0) > 1:
        raise Malformed(f"{path}: neither true nor false")


Found = Iterator[tuple[str, Dataset, ArrayRule, Letters]]


def _walk(group: Group, cls: type, prefix: str, beside: set[str]) -> Found:
    """Yield every array of a record with its rule and the letters of its member, and check all else."""
    hints, expected, letters = type_hints(cls), set(beside), Letters()
    for entry in fields(cls):
        name, hint = entry.name, hints[entry.name]
        expected.add(name)
        path, base = prefix + name, base_type(hint)
        value = group.members.get(name, group.attributes.get(name))
        if value is None and base is hint:
            raise Malformed(f"{path}: missing")
        if value is not None:
            yield from _field(value, base, entry, path, letters)
    if unknown := (group.attributes.keys() | group.members.keys()) - expected:
        raise Malformed(f"{prefix}{unquote(min(unknown))}: no field of such a record")


def _field(value: Any, base: Any, entry: Field, path: str, letters: Letters) -> Found:
    member = member_type(base)
    kind = Dataset if base is np.ndarray else Group if is_dataclass(base) or member is not None else (str, int, float)
    if not isinstance(value, kind):
        expected = {Dataset: "an array", Group: "a group"}.get(kind, "a number or text")  # type: ignore[call-overload]
        raise Malformed(f"{path}: expected {expected}")
    if isinstance(value, Dataset):
        yield path, value, entry.metadata[ARRAY], letters
    elif isinstance(value, Group) and member is None:
        yield from _walk(value, typing.cast(type, base), f"{path}/", set())
    elif isinstance(value, Group):
        yield from _members(value, member, entry, path)
    elif not isinstance(value, str if base is str or typing.get_origin(base) is dict else (int, float)):
        raise Malformed(f"{path}: {type(value).__name__}, expected {getattr(base, '__name__', base)}")
    elif base is int and not isinstance(value, int):
        raise Malformed(f"{path}: {value}, expected a whole number")


def _members(group: Group, member: Any, entry: Field, path: str) -> Found:
    """Yield as `_walk` for a group of named members of one type."""
    if group.attributes:
        raise Malformed(f"{path}: attributes of a group of named members")
    names: set[str] = set()
    for name, below in group.members.items():
        names.add(unquote(name))
        yield from _field(below, member, entry, f"{path}/{unquote(name)}", Letters())
    if len(names) < len(group.members):
        raise Malformed(f"{path}: two members of one name")


def _fits(shape: tuple[int, ...], dimensions: list[str], letters: Letters, member_letters: Letters) -> bool:
    """Whether a shape has these dimensions; letters that it is the first to have are noted."""
    if len(shape) != len(dimensions):
        return False
    new: list[tuple[Letters, str, int]] = []
    for size, dimension in zip(shape, dimensions, strict=True):
        if dimension == "*":
            continue
        if dimension[0].isdigit():
            if str(size) not in dimension.split("|"):
                return False
            continue
        scope = member_letters if dimension.endswith("'") else letters
        expected = scope.get(
            dimension, next((s for table, name, s in new if table is scope and name == dimension), size)
        )
        if expected != size:
            return False
        new.append((scope, dimension, size))
    for scope, name, size in new:
        scope[name] = size
    return True
