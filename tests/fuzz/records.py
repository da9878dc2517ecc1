"""Hostile record files: sealed with a right digest, under the key of their inputs, but not as a writer makes them.

Each gives a record as its kind must be or one line; no file but its own is opened; none takes longer than `LONGEST`.
"""

import hashlib
import random
import struct
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from gudgeon import modaldb
from gudgeon.modaldb.errors import RecordDamaged, RecordMismatch
from gudgeon.modaldb.format import hdf5
from gudgeon.modaldb.format.blocks import USERBLOCK
from gudgeon.modaldb.format.seal import MAGIC
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.records import KINDS
from gudgeon.modaldb.records.types import ARRAY
from tests.modaldb.samples import INPUTS, SAMPLES

BRIEF, LONG = 150, 20_000
LONGEST = 10.0
"""CPU time of one file [s]: above what a file of these sizes takes on a slow machine by a factor of hundreds."""
KEY = content_key(INPUTS)
NUMBERS = (0, 1, 2, 7, 8, 255, 2**16 - 1, 2**31, 2**32 - 1, 2**40, 2**63, 2**64 - 1)


def sealed(body: bytes, kind: str) -> bytes:
    """Return a record file of a kind with a right digest."""
    digest = hashlib.sha256(kind.encode() + body).hexdigest()
    return MAGIC + digest.encode() + b"\n" + kind.encode() + b"\n" + b"\0" * (USERBLOCK - 83 - len(kind)) + body


def body_of(kind: str) -> bytes:
    """Return the HDF5 part of a sample."""
    return hdf5.record_bytes(kind, SAMPLES[kind](), INPUTS)[1]


def bytes_mutated(dice: random.Random, kind: str, folder: Path) -> bytes:
    """Return a sample with bytes, numbers or blocks changed, most of them in its structure."""
    body = bytearray(BODIES[kind])
    signatures = [place for mark in (b"OHDR", b"OCHK", b"GCOL", b"BTHD", b"BTLF", b"FRHP", b"FHDB", b"\x89HDF")
                  for place in _all(BODIES[kind], mark)]  # fmt: skip
    for _ in range(dice.choice((1, 1, 1, 2, 4, 16))):
        place = dice.choice(signatures) + dice.randrange(200) if dice.random() < 0.8 else dice.randrange(len(body))
        place = min(place, len(body) - 1)
        action = dice.randrange(7)
        if action == 0:
            body[place] ^= 1 << dice.randrange(8)
        elif action == 1:
            body[place] = dice.randrange(256)
        elif action == 2:
            number = dice.choice((*NUMBERS, dice.choice(signatures), len(body), dice.randrange(len(body))))
            body[place : place + 8] = struct.pack("<Q", number)
        elif action == 3:
            body[place : place + 4] = struct.pack("<I", dice.choice(NUMBERS) & 0xFFFFFFFF)
        elif action == 4:
            source, size = dice.randrange(len(body)), dice.randrange(1, 200)
            body[place : place + size] = body[source : source + size]
        elif action == 5:
            del body[place : place + dice.randrange(1, 40)]
        else:
            body[place:place] = dice.randbytes(dice.randrange(1, 40))
        if len(body) < 2:
            break
    return sealed(bytes(body), kind)


def fields_mutated(dice: random.Random, kind: str, folder: Path) -> bytes:
    """Return a sample with links, arrays and texts that HDF5 allows and records do not, or with other numbers."""
    path = folder / "mutated.h5"
    path.write_bytes(sealed(BODIES[kind], kind))
    change_field(dice, path)
    return sealed(path.read_bytes()[USERBLOCK:], kind)


def change_field(dice: random.Random, path: Path) -> None:
    """Change one link, array or attribute of a record file with HDF5's library; the file must be sealed again."""
    with h5py.File(path, "r+", libver=("v110", "v110")) as file:
        groups: list[Any] = [file]
        arrays: list[Any] = []
        file.visititems(lambda _, item: (arrays if isinstance(item, h5py.Dataset) else groups).append(item))
        if arrays and dice.random() < 0.7:
            chosen = dice.choice(arrays)
            dice.choice(ARRAY_CHANGES)(dice, chosen.parent, chosen.name.rpartition("/")[2])
        else:
            dice.choice(GROUP_CHANGES)(dice, dice.choice(groups))


def _instead(make: Callable[[random.Random, Any, str, np.ndarray], None]) -> Callable[[random.Random, Any, str], None]:
    def change(dice: random.Random, group: Any, name: str) -> None:
        old = group[name][()]
        del group[name]
        make(dice, group, name, old)

    return change


def _other_number(dice: random.Random, group: Any, name: str) -> None:
    dataset = group[name]
    if dataset.size:
        flat = dataset[()].reshape(-1)
        number = (
            dice.choice((np.nan, np.inf, 1e308, -1.0, 0.0)) if flat.dtype.kind == "f" else dice.choice((-1, 2**40, 9))
        )
        flat[dice.randrange(flat.size)] = number
        dataset[...] = flat.reshape(dataset.shape)


def _virtual(dice: random.Random, group: Any, name: str, old: np.ndarray) -> None:
    layout = h5py.VirtualLayout((4, 3), "<f8")
    layout[...] = h5py.VirtualSource(dice.choice((".", "/etc/passwd")), f"{group.name}/{name}", (4, 3))
    group.create_virtual_dataset(name, layout)


TYPES = (">f8", "<f4", "<i8", "<i2", "S5", "<c16")
SHAPES = ((0,), (3,), (7, 3), (2, 2, 2))
ARRAY_CHANGES: tuple[Callable[[random.Random, Any, str], None], ...] = (
    _other_number,
    _other_number,
    _instead(lambda dice, g, n, old: None),
    _instead(lambda dice, g, n, old: g.create_group(n) and None),
    _instead(lambda dice, g, n, old: g.__setitem__(n, h5py.SoftLink("/"))),
    _instead(lambda dice, g, n, old: g.__setitem__(n, h5py.ExternalLink("/etc/passwd", "/"))),
    _instead(lambda dice, g, n, old: g.__setitem__(n, g)),
    _instead(lambda dice, g, n, old: g.create_dataset(
        n, (64,), "u1", external=[("/etc/passwd", 0, 64)]) and None),
    _instead(_virtual),
    _instead(lambda dice, g, n, old: g.create_dataset(n, data=np.zeros(old.size + 1), compression="gzip") and None),
    _instead(lambda dice, g, n, old: g.create_dataset(n, (2**dice.randrange(1, 50), 3), "<f8") and None),
    _instead(lambda dice, g, n, old: g.create_dataset(n, data=np.zeros(old.shape, dice.choice(TYPES))) and None),
    _instead(lambda dice, g, n, old: g.create_dataset(n, data=np.zeros(dice.choice(SHAPES))) and None),
    _instead(lambda dice, g, n, old: g.create_dataset(n, data=h5py.Empty("<f8")) and None),
    _instead(lambda dice, g, n, old: g.create_dataset(n, data=g.ref, dtype=h5py.ref_dtype) and None),
    _instead(lambda dice, g, n, old: g.create_dataset(n, data=old[..., :-1] if old.ndim else old) and None),
)  # fmt: skip


def _new_attribute(dice: random.Random, group: Any) -> None:
    names = [*group.attrs, "new"]
    values = ("", "{", "{}", "[" * 3000, '{"a": 1e999}', '{"thrust": [0, 99]}', 3, -1, 2**62, 1.5, float("nan"),
              np.arange(3), h5py.Empty("<f8"), "x" * 70000)  # fmt: skip
    group.attrs[dice.choice(names)] = dice.choice(values)


GROUP_CHANGES: tuple[Callable[[random.Random, Any], None], ...] = (
    _new_attribute,
    _new_attribute,
    _new_attribute,
    lambda dice, group: group.attrs.__delitem__(dice.choice([*group.attrs])) if len(group.attrs) else None,
    lambda dice, group: group.__setitem__("loop", group.file["/"]),
    lambda dice, group: group.__setitem__("way out", h5py.ExternalLink("/etc/passwd", "/")),
    lambda dice, group: group.create_dataset("more", data=np.zeros(3)) and None,
    lambda dice, group: group.create_group("%2E%2E") and None,
    lambda dice, group: group.__setitem__("type", np.dtype("<f8")),
)  # fmt: skip
REFUSALS = (OSError, ValueError, TypeError, KeyError, RuntimeError)
"""What HDF5's library raises where it refuses to make a harm."""
BODIES = {kind: body_of(kind) for kind in KINDS}
MUTATIONS = (bytes_mutated, bytes_mutated, bytes_mutated, fields_mutated)


def check_read(root: Path, key: str, kind: str) -> str:
    """Read a record in all ways; return what came of it, or raise what must not come."""
    store, errors = modaldb.open(root), []
    begun = time.process_time()
    for use in (lambda: store.get(key, kind), lambda: store.sizes(key), lambda: store.provenance(key)):
        try:
            found = use()
        except (RecordDamaged, RecordMismatch) as error:
            if not str(error).isprintable():
                raise AssertionError(repr(error)) from error
            errors.append(type(error).__name__)
        else:
            if is_dataclass(found):
                _assert_sound(found)
    if (took := time.process_time() - begun) > LONGEST:
        raise AssertionError(f"{took:.1f} s")
    return errors[0] if errors else "read"


def _assert_sound(record: Any) -> None:
    """Assert that arrays hold numbers as their rules say, by another look than the reader's."""
    for entry in fields(record):
        value, rule = getattr(record, entry.name), entry.metadata.get(ARRAY)
        for item in value.values() if isinstance(value, dict) else (value,):
            if is_dataclass(item):
                _assert_sound(item)
            elif isinstance(item, np.ndarray) and rule.finite and rule.dtype == "float":
                assert np.isfinite(item).all(), entry.name
            if isinstance(item, np.ndarray):
                assert item.ndim in {len(shape.split()) for shape in rule.shape.split(" or ")}, entry.name


def _all(text: bytes, mark: bytes) -> list[int]:
    found, place = [], text.find(mark)
    while place >= 0:
        found.append(place)
        place = text.find(mark, place + 1)
    return found


def main(count: int, seed: int = 1) -> Counter[str]:
    """Read `count` hostile files; return how many were read, refused as damaged, and refused as no such record."""
    outcomes: Counter[str] = Counter()
    opened: list[str] = []
    watching = False

    def watch(event: str, arguments: tuple[Any, ...]) -> None:
        if watching and event == "open" and isinstance(arguments[0], str):
            opened.append(arguments[0])

    sys.addaudithook(watch)  # It stays until the process ends, but watches no longer.
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "db"
        path = modaldb.open(root).path(KEY)
        path.parent.mkdir(parents=True)
        for number in range(count):
            dice = random.Random(f"{seed} {number}")
            kind = dice.choice([*KINDS])
            try:
                whole = dice.choice(MUTATIONS)(dice, kind, Path(folder))
            except REFUSALS:
                outcomes["not made"] += 1
                continue
            path.write_bytes(whole)
            watching = True
            try:
                outcomes[check_read(root, KEY, kind)] += 1
            except BaseException as error:
                kept = Path(tempfile.gettempdir()) / f"record-{seed}-{number}.h5"
                kept.write_bytes(whole)
                raise AssertionError(f"case {number} of seed {seed}, kept as {kept}: {error!r}") from error
            finally:
                watching = False
            strange = [one for one in opened if not one.startswith(str(root)) and "site-packages" not in one]
            assert not strange, f"case {number} of seed {seed} opens {strange}"
            opened.clear()
    return outcomes
