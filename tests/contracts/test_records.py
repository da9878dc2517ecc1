"""Every kind of record keeps the contract of the schema: frozen, documented, of types that the codec knows."""

import ast
import dataclasses
import inspect
import types
import typing
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records import KINDS, cyclic, field, mesh, modes, nodal, report, trajectory

SCALARS = (str, int, float)


def parts(cls: type) -> Iterator[type]:
    """Yield a record's class, those that it inherits from, and every dataclass below it."""
    yield from filter(dataclasses.is_dataclass, cls.__mro__)
    for hint in typing.get_type_hints(cls).values():
        for arm in (hint, *typing.get_args(hint)):
            if isinstance(arm, type) and dataclasses.is_dataclass(arm):
                yield from parts(arm)


def unknown_fields(cls: type) -> list[str]:
    """List the fields whose type `gudgeon.modaldb.format.hdf5` cannot write and read."""
    return [name for name, hint in typing.get_type_hints(cls).items() if not _known(hint)]


def _known(hint: Any) -> bool:
    if isinstance(hint, types.UnionType):
        arms = [arm for arm in typing.get_args(hint) if arm is not type(None)]
        # None is kept by leaving the item out, which an array or a group can be, an attribute cannot.
        return len(arms) == 1 and (arms[0] is np.ndarray or dataclasses.is_dataclass(arms[0]))
    if typing.get_origin(hint) is dict:
        key, value = typing.get_args(hint)
        return key is str and (value in (Any, str, np.ndarray) or dataclasses.is_dataclass(value))
    return hint in SCALARS or hint is np.ndarray or dataclasses.is_dataclass(hint)


def undocumented(cls: type) -> list[str]:
    """List the array fields without a docstring of their own, which must tell shape and, unless it is 1, the unit."""
    body = typing.cast(ast.ClassDef, ast.parse(inspect.getsource(cls)).body[0]).body
    documented = {
        one.target.id
        for one, other in pairwise(body)
        if isinstance(one, ast.AnnAssign) and isinstance(one.target, ast.Name)
        if isinstance(other, ast.Expr) and isinstance(other.value, ast.Constant)
    }
    hints = {name: hint for name, hint in typing.get_type_hints(cls).items() if name in cls.__annotations__}
    arrays = [name for name, hint in hints.items() if np.ndarray in (hint, *typing.get_args(hint))]
    return [name for name in arrays if name not in documented]


ALL = sorted({part for kind in KINDS.values() for part in parts(kind)}, key=lambda cls: cls.__name__)


@pytest.mark.parametrize("cls", ALL)
def test_fields_are_of_known_types(cls: type) -> None:
    assert unknown_fields(cls) == []


@pytest.mark.parametrize("cls", ALL)
def test_has_a_docstring(cls: type) -> None:
    assert cls.__doc__
    assert not cls.__doc__.startswith(f"{cls.__name__}(")  # what dataclass writes where there is none


@pytest.mark.parametrize("cls", ALL)
def test_arrays_are_documented(cls: type) -> None:
    # One docstring stands for the four fields that a design shares with ModalRecord.
    same_as_modes = {"centre", "inertia"} if cls is modes.MorphRecord else set()
    assert set(undocumented(cls)) <= same_as_modes


@pytest.mark.parametrize("cls", ALL)
def test_is_frozen(cls: type) -> None:
    record = object.__new__(cls)
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(record, dataclasses.fields(cls)[0].name, None)


@pytest.mark.parametrize("cls", ALL)
def test_lives_among_the_records(cls: type) -> None:
    """With all that it inherits from: a record has no methods of other packages."""
    assert all(one.__module__.startswith("gudgeon.modaldb.records.") for one in cls.__mro__[:-1])


def test_every_record_class_is_reached() -> None:
    """A dataclass of the schema that no kind holds is dead, unless a report writes it as rows."""
    families = (cyclic, field, mesh, modes, nodal, report, trajectory)
    held = [item for family in families for item in vars(family).values()]
    there = {item for item in held if isinstance(item, type) and dataclasses.is_dataclass(item)}
    assert there == set(ALL)


def test_kinds_are_plain_names() -> None:
    assert all(name.isidentifier() and name.islower() for name in KINDS)
    assert len(set(KINDS.values())) == len(KINDS)


@dataclass
class _Wrong:
    good: np.ndarray
    """[m]"""
    bare: np.ndarray
    number: complex
    names: list[str]
    optional: int | None
    either: int | str
    by_number: dict[int, np.ndarray]


def test_checks_of_this_file_can_fail() -> None:
    assert unknown_fields(_Wrong) == ["number", "names", "optional", "either", "by_number"]
    assert undocumented(_Wrong) == ["bare", "by_number"]
