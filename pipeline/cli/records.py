"""The commands on records: `gudgeon db ls`, `show`, `diff`, `tag` and `export`."""

import argparse
import json
import re
import sys
import time
from collections.abc import Iterator, Mapping
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gudgeon.modaldb.stores.query import Entry

AGO = re.compile(r"(\d{1,6})([hdw])")
SPANS = {"h": 3600.0, "d": 86400.0, "w": 604800.0}
LONGEST = 100
"""Characters of a value of the inputs."""
MODES = 12
"""Frequencies that are printed."""


def ls_command(options: argparse.Namespace) -> int:
    """List records, newest first."""
    from gudgeon import modaldb
    from gudgeon.modaldb.stores.query import Query, condition

    store = modaldb.open(options.db)
    entries = store.find(
        Query(
            kind=options.kind, scene=options.scene, component=options.component, tag=options.tag, key=options.key,
            text=options.text, since=options.since, until=options.until, where=tuple(map(condition, options.where)),
            limit=options.limit,
        )
    )  # fmt: skip
    if options.json:
        print(json.dumps([e.as_json() for e in entries], indent=1))
        return 0
    for line in _table([("key", "kind", "date", "size", "used", "scene", "component", "tags"), *map(_cells, entries)]):
        print(line)
    size = sum(e.size for e in entries) / 1e6
    print(f"{store.location}: {len(entries)} records of {size:.3g} MB")
    return 0


def _cells(entry: "Entry") -> tuple[str, ...]:
    scenes, components = (", ".join(dict.fromkeys(use[n] for use in entry.uses)) for n in (0, 1))
    return (entry.key[:12], entry.kind, date_text(entry.made), size_text(entry.size), str(entry.referred), scenes,
            components, ", ".join(entry.tags))  # fmt: skip


def _table(rows: list[tuple[str, ...]]) -> Iterator[str]:
    rows = [tuple(map(_printable, row)) for row in rows]
    widths = [min(max(len(row[n]) for row in rows), 40) for n in range(len(rows[0]))]
    for row in rows:
        yield "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()


def _printable(text: str) -> str:
    """Return a text without letters that move a terminal's cursor: others may have given names in a database."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)


def date_text(seconds: float) -> str:
    """Return a time of the local clock to the minute."""
    return time.strftime("%Y-%m-%d %H:%M", time.localtime(seconds))


def size_text(size: int) -> str:
    """Return a number of bytes in a unit that suits it."""
    return f"{size / 1e3:.3g} kB" if size < 1e6 else f"{size / 1e6:.3g} MB" if size < 1e9 else f"{size / 1e9:.3g} GB"


def moment(text: str) -> float:
    """Return a time [s since 1970] that a user gave: a date, a date with a time, or `7d`, `12h`, `2w` ago."""
    if match := AGO.fullmatch(text):
        return time.time() - int(match[1]) * SPANS[match[2]]
    try:
        return datetime.fromisoformat(text).timestamp()
    except (ValueError, OverflowError):
        raise argparse.ArgumentTypeError(
            f"{text} given; expected a date such as 2026-11-22, 2026-11-22T18:30, or 7d, 12h, 2w ago"
        ) from None


def show_command(options: argparse.Namespace) -> int:
    """Print what a record is, what it was made from, and what it holds."""
    from gudgeon import modaldb
    from gudgeon.modaldb.stores.lookup import find_one

    store = modaldb.open(options.db)
    entry = find_one(store, options.record)
    sizes = store.sizes(entry.key)
    modes = _modes(store, entry) if entry.kind == "modes" else []
    if options.json:
        print(json.dumps(entry.as_json() | {"fields": sizes, "modes": modes}, indent=1))
        return 0
    print(f"{entry.kind} {entry.key}\n{date_text(entry.made)}, {size_text(entry.size)}, {store.place(entry.key)}")
    for scene, component in entry.uses:
        print(f"used by     {_printable(scene)}, {_printable(component)}")
    for tag in entry.tags:
        print(f"tag         {tag}")
    for key in entry.refers:
        print(f"made from   {key}")
    print(f"referred to by {entry.referred} records\n\ninputs")
    for path, value in flat(entry.inputs):
        print(f"  {path} = {value}")
    print("\narrays")
    for path, size in sizes.items():
        print(f"  {path:48} {size_text(size):>10}")
    if modes:
        print("\nmode    frequency [Hz]   estimated error")
        for row in modes[:MODES]:
            error = "" if row["error"] is None else f"{row['error']:.2g}"
            print(f"{row['mode']:4} {row['frequency']:16.6g}   {error}".rstrip())
        if len(modes) > MODES:
            print(f"     and {len(modes) - MODES} more up to {modes[-1]['frequency']:.6g} Hz; all of them with --json")
    return 0


def _modes(store: Any, entry: "Entry") -> list[dict[str, Any]]:
    import math

    modes = store.get(entry.key, "modes", only=["angular_frequencies", "discretisation_errors", "normal_count"])
    rows = []
    for mode in range(modes.normal_count):
        error = None if modes.discretisation_errors is None else float(modes.discretisation_errors[mode])
        is_known = error is not None and math.isfinite(error)
        frequency = float(modes.angular_frequencies[mode]) / (2 * math.pi)
        rows.append({"mode": mode + 1, "frequency": frequency, "error": error if is_known else None})
    return rows


def flat(inputs: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield the path of every value of some inputs, as `--where` takes it, and the value as text."""
    for name, value in inputs.items():
        if isinstance(value, Mapping) and value:
            yield from flat(value, f"{prefix}{name}.")
        else:
            text = json.dumps(value, ensure_ascii=False)
            yield f"{prefix}{name}", text if len(text) <= LONGEST else f"{text[:LONGEST]}…"


def diff_command(options: argparse.Namespace) -> int:
    """Print in which inputs two records differ; of two modal bases also which mode is which, by MAC."""
    from gudgeon import modaldb
    from gudgeon.modaldb.keys import differences
    from gudgeon.modaldb.stores.lookup import find_one
    from gudgeon.pipeline.errors import InputError

    store = modaldb.open(options.db)
    a, b = (find_one(store, name) for name in (options.record, options.other))
    lines = differences(a.inputs, b.inputs)
    both = a.kind == b.kind == "modes"
    if options.picture is not None and not both:
        raise InputError(f"--picture: the MAC matrix is of two modes records; these are {a.kind} and {b.kind}")
    comparison = None
    if both and a.key != b.key:
        from gudgeon.pipeline.modes.comparison import compare_modes

        comparison = compare_modes(store, a.key, b.key)
        if options.picture is not None:
            typed = zip((a, b), (options.record, options.other), strict=True)
            labels = [r.key[:12] if r.key.startswith(name) else f"{name} ({r.key[:12]})" for r, name in typed]
            _draw(comparison, (labels[0], labels[1]), options.picture)
    if options.json:
        document = {"records": [a.key, b.key], "kinds": [a.kind, b.kind], "inputs": lines,
                 "modes": None if comparison is None else comparison.as_json()}  # fmt: skip
        print(json.dumps(document, indent=1))
        return 0
    if a.kind != b.kind:
        print(f"kind: {a.kind} → {b.kind}")
    print("\n".join(lines) or "the inputs are the same")
    if comparison is not None:
        _print_modes(comparison)
    if options.picture is not None:
        print(options.picture, file=sys.stderr)
    return 0


def _print_modes(comparison: Any) -> None:
    distance = f"(nodes {comparison.distance:.3g} m apart at most)"
    print(f"\nmode    frequency [Hz]   other     change      MAC   {distance}")
    for row in comparison.rows():
        matched = "–" if row["other"] is None else str(row["other"])
        change = "" if row["change"] is None else f"{row['change']:+.3%}"
        print(f"{row['mode']:4} {row['frequency']:16.6g} {matched:>7} {change:>10}   {row['mac']:.4f}")


def _draw(comparison: Any, names: tuple[str, str], path: Path) -> None:
    from gudgeon.pipeline.errors import InputError

    try:
        from gudgeon.pipeline.plots.mac import draw_mac

        draw_mac(comparison, names, path)
    except ModuleNotFoundError as error:
        raise InputError(f"--picture: {error.name} is not installed; pip install 'gudgeon[plots]'") from None
    except OSError as error:
        raise InputError(f"--picture {path}: cannot be written ({error.strerror or error})") from error


def tag_command(options: argparse.Namespace) -> int:
    """Give a name to a record, or take it away."""
    from gudgeon import modaldb
    from gudgeon.modaldb.stores.lookup import find_one
    from gudgeon.pipeline.errors import InputError

    store = modaldb.open(options.db)
    if options.delete == (options.record is not None):
        raise InputError("db tag: give NAME RECORD, or NAME --delete")
    key = None if options.delete else find_one(store, options.record).key
    store.tag(options.name, key)
    if options.json:
        print(json.dumps({"tag": options.name, "key": key}))
    else:
        print(f"{options.name}: taken away" if key is None else f"{options.name}: {key}")
    return 0


def export_command(options: argparse.Namespace) -> int:
    """Write a record's file."""
    from gudgeon import modaldb
    from gudgeon.modaldb.stores.lookup import find_one
    from gudgeon.pipeline.files import whole_file

    store = modaldb.open(options.db)
    entry = find_one(store, options.record)
    path = options.path or Path(f"{entry.kind}-{entry.key[:12]}.h5")
    with whole_file(path) as scratch:
        store.export(entry.key, scratch)
    print(json.dumps({"file": str(path), "key": entry.key, "bytes": entry.size}) if options.json else path)
    return 0
