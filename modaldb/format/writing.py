"""A record's fields written to an HDF5 file that is open.

Records have many attributes and small arrays, which h5py's classes take twice as long to write as the functions of the
HDF5 library below them.
"""

import json
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

import numpy as np
from h5py import h5a, h5d, h5g, h5p, h5s, h5t, string_dtype

from gudgeon.modaldb.format.schema import check_values, member_type, type_hints
from gudgeon.modaldb.format.structure import LABELS, escaped
from gudgeon.modaldb.records.types import ARRAY

TEXT, SINGLE = string_dtype(), h5s.create_simple(())


def _new_types(dtype: np.dtype) -> tuple[Any, Any]:
    """Return the HDF5 type of numbers or texts in the file and that in memory."""
    return h5t.py_create(dtype, logical=True), h5t.py_create(dtype)


_types_of = cache(_new_types)
TEXT_TYPES = _new_types(TEXT)
"""Apart, since numpy takes all types of objects for equal."""


def write_fields(group: Any, record: Any, prefix: str = "") -> None:
    """Write the fields of a dataclass.

    Args:
        group: A group of `h5py.h5g`.
        prefix: Path of the group, for messages.

    Raises:
        Malformed: a number is not what its field allows.
    """
    hints = type_hints(type(record))
    for entry in fields(record):
        rule = entry.metadata.get(ARRAY)
        _write_field(group, entry.name, getattr(record, entry.name), (hints[entry.name], rule, prefix + entry.name))


def _write_field(group: Any, name: str, value: Any, field: tuple[Any, Any, str]) -> None:
    """Write a value under a name; `field` has its type, the rule of its arrays and its path."""
    hint, rule, path = field
    if isinstance(value, np.ndarray):
        array = np.ascontiguousarray(value)
        if value.dtype.kind in "iu":
            array = array.astype(float if rule.dtype == "float" else np.int64)
        check_values(array, rule, {}, path)
        dataset = _write_array(group, name, array)
        for attribute, text in zip(LABELS, (rule.unit, rule.name, rule.columns), strict=True):
            if text:
                write_attribute(dataset, attribute, text)
    elif is_dataclass(value):
        write_fields(_new_group(group, name), value, f"{path}/")
    elif (member := member_type(hint)) is not None:
        below = _new_group(group, name)
        for item, member_value in value.items():
            _write_field(below, escaped(item), member_value, (member, rule, f"{path}/{item}"))
    elif value is not None:
        write_attribute(group, name, json.dumps(value) if isinstance(value, dict) else value)


def write_attribute(owner: Any, name: str, value: Any) -> None:
    """Write a number, a truth value or a text as an attribute of a group or dataset."""
    array = np.array(value, TEXT if isinstance(value, str) else None)
    kind, memory_type = TEXT_TYPES if isinstance(value, str) else _types_of(array.dtype)
    h5a.create(owner, name.encode(), kind, SINGLE).write(array, memory_type)


def _new_group(group: Any, name: str) -> Any:
    return h5g.create(group, name.encode(), gcpl=NEW_GROUP)


def _write_array(group: Any, name: str, array: np.ndarray) -> Any:
    """Write an array and return its dataset."""
    (kind, memory_type), space = _types_of(array.dtype), h5s.create_simple(array.shape)
    dataset = h5d.create(group, name.encode(), kind, space, NEW_ARRAY)
    if array.size:
        dataset.write(h5s.ALL, h5s.ALL, array, memory_type)
    return dataset


def _without_times(kind: Any) -> Any:
    """Return properties by which a new group or dataset does not hold when it was made."""
    properties = h5p.create(kind)
    properties.set_obj_track_times(False)
    return properties


NEW_GROUP, NEW_ARRAY = _without_times(h5p.GROUP_CREATE), _without_times(h5p.DATASET_CREATE)
