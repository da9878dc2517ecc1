"""The gate through which every product enters the database: no NaN and no infinity leaves a stage."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from gudgeon.modaldb.stores.base import Store
from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.stages.base import Place
from gudgeon.pipeline.stages.keys.products import Product

UNKNOWN = ("impacts", "discretisation_errors", "probes", "potentials")
"""Fields in which NaN stands for what is unknown, by docs/format.md."""


def scene_name(job: Place) -> str:
    """Return folder and file of a scene, such as `piston/stroke`; of `scene.toml` the folder alone."""
    folder = job.path.resolve().parent.name
    return folder if job.path.name == "scene.toml" else f"{folder}/{job.path.stem}"


def keep(store: Store, product: Product, record: Any) -> None:
    """Write a record of a stage into the database; see `check_finite`."""
    check_finite(product, record)
    store.put(product.key, product.kind, record, product.inputs)


def keep_for(job: Place, product: Product, record: Any) -> None:
    """Write a record into the database of a job, and that its scene uses it; see `check_finite`."""
    keep(job.store, product, record)
    job.store.note(product.key, scene_name(job), product.name)


def check_finite(product: Product, record: Any) -> None:
    """Raise StageError where a number of a record is not finite."""
    if (field := next(not_finite(record), None)) is not None:
        raise StageError(
            f"{product.stage} of '{product.name}': {field} is not finite; numbers of the scene are too large, too"
            " small or too different in size for its model"
        )


def not_finite(value: Any, path: str = "") -> Iterator[str]:
    """Yield the fields of a record that hold a NaN or an infinity, as paths such as `contacts/wall/force`."""
    if isinstance(value, float | complex | np.number):
        if not (math.isfinite(value.real) and math.isfinite(value.imag)):
            yield path
    elif isinstance(value, np.ndarray):
        wrong = np.isinf if path.partition("/")[0] in UNKNOWN else _unsound
        if value.dtype.kind in "fc" and not _squares_finite(value) and wrong(value).any():
            yield path
    elif is_dataclass(value):
        for member in fields(value):
            yield from not_finite(getattr(value, member.name), f"{path}/{member.name}".lstrip("/"))
    elif isinstance(value, Mapping):
        for name, item in value.items():
            yield from not_finite(item, f"{path}/{name}".lstrip("/"))
    elif isinstance(value, list | tuple):
        for n, entry in enumerate(value):
            yield from not_finite(entry, f"{path}/{n}".lstrip("/"))


def _squares_finite(values: np.ndarray) -> bool:
    """Whether all numbers are finite, several times cheaper than a look at each; False where one's square is not."""
    if values.dtype.kind == "c":
        return False
    flat = values.reshape(-1)
    with np.errstate(over="ignore", invalid="ignore"):
        return bool(np.isfinite(np.dot(flat, flat)))


def _unsound(values: np.ndarray) -> np.ndarray:
    return ~np.isfinite(values)
