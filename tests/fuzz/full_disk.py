"""Writes that fail: records that are put, each with one failing call.

A call of the operating system fails as on a full disk, over a quota, or on a broken disk. There is one line, and
either a sound record or none; what is put next is there.
"""

import errno
import os
import random
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from gudgeon import modaldb
from gudgeon.modaldb.errors import RecordMissing, RecordNotWritten
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.records import KINDS
from tests.modaldb.samples import SAMPLES

BRIEF, LONG = 60, 1000
CALLS = ("write", "fsync", "replace", "open", "mkdir", "fchmod", "preadv", "pread")
CAUSES = (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EFBIG)


@contextmanager
def failing(name: str, after: int, cause: int, partly: bool) -> Iterator[list[int]]:
    """Let one call of `os` fail: the one after `after` others of that name. A write may write a part before.

    Yields:
        The calls so far.
    """
    whole: Callable[..., Any] = getattr(os, name)
    calls: list[int] = []

    def call(*arguments: Any, **options: Any) -> Any:
        calls.append(len(calls))
        if len(calls) - 1 == after:
            if name == "write" and partly:
                return whole(arguments[0], bytes(arguments[1])[: len(arguments[1]) // 2])
            raise OSError(cause, os.strerror(cause))
        if name == "write" and partly and len(calls) - 1 > after:
            raise OSError(cause, os.strerror(cause))
        return whole(*arguments, **options)

    setattr(os, name, call)
    try:
        yield calls
    finally:
        setattr(os, name, whole)


def main(count: int, seed: int = 1) -> Counter[str]:
    """Put `count` records with one failure each; return how many were written, not written, and not reached."""
    outcomes: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            dice = random.Random(f"{seed} {number}")
            kind, name, after = dice.choice([*KINDS]), dice.choice(CALLS), dice.randrange(4)
            inputs = {"seed": seed, "number": number}
            key = content_key(inputs)
            root = Path(folder) / f"db{number % 7}"
            store = modaldb.open(root)
            where = f"case {number} of seed {seed}: {name} {after}"
            refused: modaldb.ModalDBError | None = None
            with failing(name, after, dice.choice(CAUSES), dice.random() < 0.5) as calls:
                try:
                    store.put(key, kind, SAMPLES[kind](), inputs)
                except modaldb.ModalDBError as error:
                    refused = error
            fault = modaldb.open(root).fault(key)
            if refused is None:
                outcomes["written" if len(calls) > after else "not reached"] += 1
                assert fault is None, f"{where}: {fault}"
            else:
                outcomes["not written"] += 1
                assert str(refused).isprintable(), f"{where}: {refused!r}"
                assert isinstance(refused, RecordNotWritten) or name in ("open", "pread"), f"{where}: {refused!r}"
                # A record whose folder was not flushed may be there, then as a whole.
                whole = fault is None and name in ("fsync", "open")
                assert whole or isinstance(fault, RecordMissing), f"{where}: {fault}"
            assert not [*root.glob("??/.writing-*")], where
            store.put(key, kind, SAMPLES[kind](), inputs)
            assert store.has(key), where
            assert modaldb.open(root).has(key), where
    return outcomes
