"""Records that tests share: what one test has computed another one finds, in whatever database it works.

Their keys tell all that they depend on, so a record with the key of another one is that record. Files opt in by
`pytestmark = pytest.mark.usefixtures("shared_records")`, unless they compare records of two databases, or put meshes of
their own under a key, as cases of robustness do. A test that takes `monkeypatch` computes its own: what it changes is
in no key.
"""

import fcntl
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gudgeon import modaldb
from gudgeon.pipeline.kinds import BODY
from gudgeon.pipeline.stages import run
from gudgeon.pipeline.stages.base import SceneJob, Stage
from gudgeon.pipeline.stages.keys.products import Product
from gudgeon.pipeline.stages.run_report import Progress, StageReport


@contextmanager
def sharing(folder: Path) -> Iterator[None]:
    """Have stages look for their records in a folder before they compute them, and keep them there."""
    store, plain = modaldb.open(folder / "db"), run._make_stage

    def found(make: Callable[..., Any], job: SceneJob, product: Product, tell: Progress) -> Any:
        with (folder / f"{product.key}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not store.has(product.key):
                store.put(product.key, product.kind, make(job, product, tell), product.inputs)
        return store.get(product.key, product.kind)

    def shared(job: SceneJob, stage: Stage, tell: Progress) -> StageReport:
        if job.kind is BODY and stage.name == run.SOLVE:  # Each test runs its own motion.
            return plain(job, stage, tell)
        make = stage.make
        return plain(job, replace(stage, make=lambda *given: found(make, *given)), tell)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run, "_make_stage", shared)
        yield
