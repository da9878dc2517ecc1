"""A finished study as a record of its database: the table, for the page, and the runs that `gudgeon db gc` leaves.

Its inputs name every run, so that these are in use as long as the record is there.
"""

import hashlib
import json
import math
from collections.abc import Mapping
from typing import Any

from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.records.report import ReportRecord
from gudgeon.modaldb.stores.base import Store
from gudgeon.modaldb.stores.upkeep import STUDY
from gudgeon.pipeline.stages.base import SceneJob
from gudgeon.pipeline.stages.keys.products import Product, made_by
from gudgeon.pipeline.stages.make import keep, scene_name
from gudgeon.pipeline.studies.table import Table
from gudgeon.pipeline.studies.task import LOST, MISSING, Row

ASKED = ("set", "parameters", "sampling", "designs")
"""What the inputs have of `study.json`: the texts of `--vary` do not matter beside the designs."""
MOST_DESIGNS = 10_000
"""Designs of a study that is kept: each names its run in the inputs, which every list of records reads."""


def keep_study(job: SceneJob, request: Mapping[str, Any], table: Table, rows: Mapping[int, Row]) -> str | None:
    """Put a study into its database and return the key; None where designs are missing, or are too many.

    Args:
        request: What `study.json` has.
        rows: Of the designs, by number.

    Raises:
        StoreUnusable, RecordNotWritten: nothing can be kept there.
    """
    results = {row.result for row in rows.values()}
    if len(rows) < len(table.rows) or results & {LOST, MISSING} or len(rows) > MOST_DESIGNS:
        return None
    document = {
        "stage": STUDY, "scene": job.name, "parameters": list(request["parameters"]), "heads": list(table.heads),
        "rows": [[_finite(value) for value in row] for row in table.rows],
    }  # fmt: skip
    text = json.dumps(document, sort_keys=True, allow_nan=False)
    runs = [rows[n].key for n in sorted(rows) if rows[n].key]
    inputs = {
        "stage": STUDY, "scene": job.name, **{name: request[name] for name in ASKED},
        "table": hashlib.sha256(text.encode()).hexdigest(),
        "runs": list(dict.fromkeys(runs)), **made_by("report"),
    }  # fmt: skip
    store: Store = job.store
    key = content_key(inputs)
    keep(store, Product(STUDY, job.name, "report", key, inputs), ReportRecord(document))
    store.note(key, scene_name(job), STUDY)
    return key


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
