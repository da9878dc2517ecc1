"""Which stages are fresh or stale, and why; the inputs of each run are kept in `inputs.json` to name what changed."""

from collections.abc import Sequence
from typing import Any

from gudgeon.modaldb.errors import ModalDBError, RecordMissing
from gudgeon.modaldb.keys import content_key, differences, file_digest
from gudgeon.pipeline.files import read_sealed, write_sealed
from gudgeon.pipeline.stages.base import PLOT, SceneJob
from gudgeon.pipeline.stages.folder import PICTURES
from gudgeon.pipeline.stages.keys.products import Product, combined

INPUTS = "inputs.json"


def status(job: SceneJob) -> list[tuple[str, str, str, list[str]]]:
    """Return for each stage its name, `fresh` or `stale`, its key, and why it is stale."""
    noted, rows = _last_inputs(job), []
    for stage in job.stages[:-1]:
        products = job.products([stage])
        faults = {name: job.store.fault(product.key) for name, product in products.items()}
        missing = {name: fault for name, fault in faults.items() if fault is not None}
        reasons = (_reasons(noted.get(name), products[name], fault) for name, fault in missing.items())
        why = list(dict.fromkeys(text for texts in reasons for text in texts))
        keys = list(dict.fromkeys(product.key for product in products.values()))
        rows.append((stage, "stale" if missing else "fresh", combined(keys), why))
    key = content_key(job.pictures())
    fresh = rows[-1][1] == "fresh" and fresh_pictures(job, key) is not None
    why = [] if fresh else ["pictures are missing, or were drawn from another result"]
    return [*rows, (PLOT, "fresh" if fresh else "stale", key, why)]


def remember(job: SceneJob, stages: Sequence[str]) -> None:
    """Keep the inputs of the stages that are now fresh, so that `status` can name what has changed since."""
    noted = _last_inputs(job) | {key: product.inputs for key, product in job.products(stages).items()}
    if noted != _last_inputs(job):
        write_sealed(job.out / INPUTS, noted)


def fresh_pictures(job: SceneJob, key: str) -> list[str] | None:
    """Return the pictures in the job's folder if they were drawn for `key` and are undamaged, else None."""
    noted = read_sealed(job.out / PICTURES)
    if noted is None or noted["key"] != key or not noted["complete"]:
        return None
    paths = [job.out / name for name in noted["files"]]
    try:
        return [str(path) for path in paths] if [*map(file_digest, paths)] == [*noted["files"].values()] else None
    except OSError:
        return None


def _last_inputs(job: SceneJob) -> dict[str, Any]:
    return read_sealed(job.out / INPUTS) or {}


def _reasons(before: dict[str, Any] | None, product: Product, fault: ModalDBError) -> list[str]:
    """Return why a product's record cannot be used: what changed since the last run, or what is wrong with it."""
    if not isinstance(fault, RecordMissing):
        return [f"{product.name}: {fault}"]
    if before is None:
        return [f"{product.name}: not made yet"]
    changed = differences(before, product.inputs)
    if "code" in before and before["code"] != product.inputs["code"]:
        changed = [line for line in changed if not line.startswith("code: ")]
        changed.insert(0, f"code of stage {product.stage} changed")
    return [f"{product.name}: {line}" for line in changed] or [f"{product.name}: not in this database"]
