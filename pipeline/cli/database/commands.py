"""The commands on a database: `gudgeon db …` and `gudgeon serve`."""

import argparse
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gudgeon.modaldb.stores.base import Leftover

DAY = 86400.0
"""Age [s] above which unfinished pictures are nobody's."""


def verify_command(options: argparse.Namespace) -> int:
    """Read every record; list those that cannot be used."""
    from gudgeon import modaldb
    from gudgeon.modaldb.errors import StoreUnusable

    store, count, bad = modaldb.open(options.db), 0, []
    for path, fault in store.verify():
        count += 1
        if fault is not None:
            # What cannot be read now may be sound.
            aside = store.set_aside(path) if options.repair and not isinstance(fault, StoreUnusable) else None
            bad.append({"file": path, "reason": str(fault), "set_aside": aside})
    if options.json:
        print(json.dumps({"records": count, "faults": bad}, indent=1))
    else:
        for record in bad:
            print(record["reason"] + (f"; renamed to {record['set_aside']}" if record["set_aside"] else ""))
        print(f"{store.location}: {count} records, {len(bad)} cannot be used")
    return 1 if any(b["set_aside"] is None for b in bad) else 0


def gc_command(options: argparse.Namespace) -> int:
    """List what can be removed, and remove it on request."""
    from gudgeon import modaldb
    from gudgeon.modaldb.stores.local import scratch
    from gudgeon.modaldb.stores.upkeep import unreferenced

    store = modaldb.open(options.db)
    unused = unreferenced(store, _is_current, studies=options.studies)
    removable, pictures = [*store.leftovers(), *unused], list(_unfinished_pictures(options.out))
    if options.delete:
        for entry in removable:
            store.remove(entry.place)
        for picture in pictures:
            scratch.remove(Path(picture.place))
    unused_files = [*removable, *pictures]
    if options.json:
        rows = [{"path": f.place, "bytes": f.size, "reason": f.why} for f in unused_files]
        print(json.dumps({"removed": options.delete, "files": rows}, indent=1))
        return 0
    for file in unused_files:
        print(f"{file.place}: {file.size / 1e6:.3g} MB, {file.why}")
    total = sum(f.size for f in unused_files) / 1e6
    done = "removed" if options.delete else "can be removed with --delete"
    print(f"{store.location}: {len(unused_files)} files of {total:.3g} MB {done}")
    return 0


def serve_command(options: argparse.Namespace) -> int:
    """Serve databases until Ctrl-C."""
    from gudgeon.pipeline.service.run import Settings, serve

    serve(
        Settings(
            options.db or (".gudgeon",), options.host, options.port, options.tokens, options.name,
            largest=options.largest, audit=options.audit,
        )
    )  # fmt: skip
    return 0


def _is_current(inputs: dict[str, Any]) -> bool:
    """Whether this release makes keys of such inputs."""
    from gudgeon.pipeline.stages.keys.products import LIBRARIES, made_by

    stage = inputs.get("stage")
    return stage in LIBRARIES and made_by(stage).items() <= inputs.items()


def _unfinished_pictures(out: Path) -> "Iterator[Leftover]":
    from gudgeon.modaldb.stores.base import Leftover

    for path in sorted(out.rglob(".drawing-*")):
        if time.time() - path.stat().st_mtime > DAY:
            size = sum(p.stat().st_size for p in path.rglob("*") if p.is_file())
            yield Leftover(str(path), size, "pictures of a run that was killed")
