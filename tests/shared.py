"""Records that tests share: what a test has computed, others of the session read, on all workers, in any database.

The key of a record covers all that it depends on, so that a record with the key of another is that record. Not shared
are: what tests compute that take `monkeypatch`, since a key does not cover what it changes; what depends on a record
that a test has put into its database itself; what takes less time than its file; and what tests compute that are marked
`own_records`, because they count, interrupt or compare computations.
"""

import fcntl
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gudgeon import modaldb
from gudgeon.modaldb.stores.base import Store
from gudgeon.modaldb.stores.folder import FolderStore
from gudgeon.pipeline.stages import run
from gudgeon.pipeline.stages.base import SceneJob, Stage
from gudgeon.pipeline.stages.keys.products import Product
from gudgeon.pipeline.stages.run_report import Progress, StageReport

WORTHWHILE = 0.1
"""CPU time from which a record is kept for other tests [s]; a smaller one is computed as fast as its file is read."""
WITH_RECORDS_BESIDES = "morph"
"""Stage that keeps a second record, which the design of another test does not bring along."""


class Records:
    """Records of a session by key, in a folder that all workers know.

    Args:
        folder: The folder.
        shares: Whether the test that runs shares records.
    """

    def __init__(self, folder: Path, shares: Callable[[], bool]) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._shares = shares
        self._folder, self._store, self._process = folder, modaldb.open(folder / "db"), os.getpid()
        self._computed: set[tuple[str, str]] = set()
        """Place of a database and key of each record that stages have computed from such records alone."""

    def make_stage(self, plain: Callable[..., StageReport], job: SceneJob, stage: Stage, tell: Progress) -> StageReport:
        """Compute the records of a stage, or read those that another test has computed."""
        if not self._shares() or os.getpid() != self._process:
            return plain(job, stage, tell)
        computed = set[str]()

        def make(of: SceneJob, product: Product, progress: Progress) -> Any:
            if not self._reproducible(of.store, product.inputs):
                return stage.make(of, product, progress)
            computed.add(product.key)
            return self._shared(stage, of, product, progress)

        report = plain(job, replace(stage, make=make), tell)
        self._computed |= {(job.store.place(key), key) for key in computed}
        return report

    def forget(self, store: Store, key: str) -> None:
        """Trust a record no more, which is written other than by a stage."""
        self._computed.discard((store.place(key), key))

    def _reproducible(self, store: Store, inputs: Any) -> bool:
        """Whether all records of a database that inputs name have been computed by stages."""
        if isinstance(inputs, dict | list | tuple):
            return all(self._reproducible(store, i) for i in (inputs.values() if isinstance(inputs, dict) else inputs))
        is_key = isinstance(inputs, str) and len(inputs) == 64 and inputs.isalnum()
        return not is_key or not store.has(inputs) or (store.place(inputs), inputs) in self._computed

    def _shared(self, stage: Stage, job: SceneJob, product: Product, tell: Progress) -> Any:
        if stage.name == WITH_RECORDS_BESIDES:
            return stage.make(job, product, tell)
        if self._store.has(product.key):
            return self._store.get(product.key, product.kind)
        with (self._folder / f"{product.key}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if self._store.has(product.key):
                return self._store.get(product.key, product.kind)
            start = time.process_time()
            record = stage.make(job, product, tell)
            if time.process_time() - start > WORTHWHILE:
                self._store.put(product.key, product.kind, record, product.inputs)
        return record


@contextmanager
def sharing(records: Records) -> Iterator[None]:
    """Have stages share their records."""
    make_stage, put = run._make_stage, FolderStore.put

    def shared(job: SceneJob, stage: Stage, tell: Progress) -> StageReport:
        return records.make_stage(make_stage, job, stage, tell)

    def written(store: FolderStore, key: str, kind: str, record: Any, inputs: dict[str, Any]) -> None:
        put(store, key, kind, record, inputs)
        records.forget(store, key)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run, "_make_stage", shared)
        patch.setattr(FolderStore, "put", written)
        yield
