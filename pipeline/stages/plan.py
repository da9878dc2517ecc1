"""What the solver reads of each record, what it leaves out, and why."""

from typing import Any

from gudgeon.modaldb.stores.folder import FolderStore
from gudgeon.pipeline.stages.job import Job

PLACES = {
    "points": "interfaces", "patch": "interfaces", "traction": "tractions",
    "mean": "loads", "pressure": "loads", "tie": "loads",
}  # fmt: skip
"""Group of a modal record in which an interface of each kind stands."""


def plan(job: Job) -> dict[str, Any]:
    """Return what the solver will read of each record, what it leaves out and why, and the bytes of both."""
    from gudgeon.solver.system.requirements import Stock, scene_terms

    rows, read, seen, components = [], 0, {}, job.components()
    stocks = {}
    for body in job.scene.body:
        component = job.scene.component[job.scene.component_of(body)]
        places = [f"{PLACES[item.kind]}/{name}" for name, item in component.interface.items()]
        places += [f"gauges/{name}" for name in component.gauge]
        stocks[body] = Stock(component.geometry.kind != "rigid", bool(component.supports), tuple(places))
    for term in scene_terms(job.scene, stocks):
        steps = components[job.scene.component_of(term.body)]
        keys = {"mesh": steps["mesh"].key, "modes": steps["modes"].key, "morph": steps["morph"].key}
        sizes = [_field_bytes(job.store, keys, path) for path in term.fields]
        size = None if None in sizes else sum(size for size in sizes if size is not None)
        rows.append(
            {"body": term.body, "term": term.name, "present": term.present, "reason": term.reason,
             "fields": list(term.fields), "bytes": size}
        )  # fmt: skip
        if term.present:
            seen |= {(term.body, path): size for path, size in zip(term.fields, sizes, strict=True)}
    read = None if None in seen.values() else sum(size for size in seen.values() if size is not None)
    return {"scene": job.name, "terms": rows, "bytes": read}


def _field_bytes(store: FolderStore, keys: dict[str, str], path: str) -> int | None:
    record, _, field_path = path.partition(":")
    if not store.has(keys[record]):
        return None
    sizes = store.sizes(keys[record])
    return sum(size for name, size in sizes.items() if name == field_path or name.startswith(f"{field_path}/"))
