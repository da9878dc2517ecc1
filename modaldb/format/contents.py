"""What the texts and numbers of a record must say where programs use them to find their place in arrays."""

import math
from collections.abc import Callable, Collection, Mapping
from typing import Any

import numpy as np

from gudgeon.modaldb.format.blocks import Malformed
from gudgeon.modaldb.format.schema import Outline
from gudgeon.modaldb.records.cyclic import CyclicRecord, WheelRecord
from gudgeon.modaldb.records.field import POSE_AXES, FieldRecord, PoseGridRecord
from gudgeon.modaldb.records.mesh import GENERALISED, MeshRecord
from gudgeon.modaldb.records.modes import ModalRecord, MorphRecord, TractionModes
from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.modaldb.records.trajectory import Trajectory

CHARTS = {
    "cylinder": {"axis": 3, "origin": 3, "radius": 1, "middle": 1},
    "plane": {"origin": 3, "normal": 3, "across": 3, "along": 3},
    "patch": {"origin": 3, "normal": 3, "across": 3, "along": 3, "low": 2, "step": 2, "counts": 2},
}
"""Kinds of chart: how many numbers each of their entries has."""
SOLIDS = {"tetra": 4, "tetra10": 10, "hexahedron": 8, "hexahedron20": 20, "hexahedron27": 27, "wedge": 6, "wedge15": 15,
          "wedge18": 18, "pyramid": 5, "pyramid13": 13, "pyramid14": 14}  # fmt: skip
OTHERS = {"triangle6": 6, "line3": 3, "beam2": 2, "beam3": 3, "frame2": 2, "vertex": 1, "nodes": 1}
"""Nodes of the cells of each type."""
FACETS = (1, 3, 4, 6, 8, 9)
"""Nodes of a facet of a solid, 1 of a set."""
SHAPES = {
    "cylinder": {"axis": 3, "origin": 3, "radius": 1},
    "plane": {"normal": 3, "origin": 3},
    "sphere": {"radius": 1, "origin": 3},
    "point": {"normal": 3, "area": 1, "origin": 3},
}
"""Kinds of true surface, likewise; others are not looked into."""


def check_contents(record: Any, outline: Outline) -> None:
    """Raise Malformed where texts and numbers of a record contradict each other or its arrays' shapes."""
    if (check := CHECKS.get(type(record))) is not None:
        check(record, outline)


def _mesh(record: MeshRecord, outline: Outline) -> None:
    _cells(record, outline)
    for name, surface in record.surfaces.items():
        field = f"surfaces/{name}/shape"
        shape = dict(surface.shape)
        if not _number(thickness := shape.pop("thickness", 1.0), finite=True) or not thickness > 0:
            raise Malformed(f"{field}: thickness {thickness}, expected a number above 0")
        _entries(shape, SHAPES, field)
    if (system := record.system) is None or not len(system.directions):
        return
    _directions(system.directions)
    for name, half in (("stiffness", system.stiffness), ("mass", system.mass)):
        if len(half.rows) == len(half.columns) and (half.rows > half.columns).any():
            raise Malformed(f"system/{name}: an entry below the diagonal")


def _directions(directions: np.ndarray) -> None:
    """Check the directions of degrees of freedom, of which generalised coordinates are the last."""
    if directions.min() < 0 or directions.max() > GENERALISED:
        raise Malformed(f"system/directions: {directions.min()} to {directions.max()}, expected 0 to {GENERALISED}")
    if (np.diff((directions == GENERALISED).astype(int)) < 0).any():
        raise Malformed("system/directions: a generalised coordinate before a node, expected behind all")


def _cells(record: MeshRecord, outline: Outline) -> None:
    """Check the numbers of nodes of cells and facets."""
    width = outline.shapes["cells"][1]
    if (expected := (SOLIDS | OTHERS).get(record.cell_type, width)) != width:
        raise Malformed(f"cells: {width} nodes each, those of {record.cell_type} have {expected}")
    if record.cell_type == "mixed":
        _counts(record.cells, set(SOLIDS.values()), "cells")
    if record.cell_type == "mixed" or record.cell_type in SOLIDS:
        for name, surface in record.surfaces.items():
            _counts(surface.facets, FACETS, f"surfaces/{name}/facets")


def _counts(rows: np.ndarray, allowed: Collection[int], field: str) -> None:
    """Check how many nodes cells or facets (e, w) have, of which those of fewer repeat their last one to the end."""
    if rows.ndim < 2 or not rows.size:  # Not read.
        return
    repeats = np.cumprod(rows[:, ::-1] == rows[:, -1:], axis=1).sum(axis=1)
    for count in np.unique(rows.shape[1] - repeats + 1).tolist():
        if count not in allowed:
            raise Malformed(f"{field}: one of {count} nodes, expected {', '.join(map(str, sorted(allowed)))}")


def _modes(record: ModalRecord, outline: Outline) -> None:
    modes = outline.letters["m"]
    if min(record.normal_count, record.static_count) < 0 or record.normal_count + record.static_count != modes:
        counts = f"{record.normal_count} + {record.static_count}"
        raise Malformed(f"normal_count, static_count: {counts}, expected {modes} together")
    _positive_mass(record)
    end = outline.letters.get("C", math.inf)
    groups = ("interfaces", "tractions", "loads")
    rows = {
        path.split("/", 1)[1].removesuffix("/rows"): shape[0]
        for path, shape in outline.shapes.items()
        if path.startswith(groups) and path.endswith("/rows")
    }
    if "C" in outline.letters and (missing := rows.keys() - record.interface_rows.keys()):
        raise Malformed(f"interface_rows: '{min(missing)}' is missing")
    _ranges(record.interface_rows, rows, end, "interface_rows")
    _tangential(record, outline, end)
    for name, space in record.tractions.items():
        _traction(space, outline.shapes[f"tractions/{name}/rows"][0], f"tractions/{name}")
    _swap(record, outline)
    if record.static_responses is not None and "static_responses/shapes" in outline.shapes:
        columns = outline.shapes["static_responses/shapes"][2]
        _ranges(record.static_responses.columns, {}, columns, "static_responses/columns")


def _traction(space: TractionModes, count: int, path: str) -> None:
    """Check chart and grid of a traction space of `count` functions."""
    if not space.chart:
        raise Malformed(f"{path}/chart: empty")
    _entries(space.chart, CHARTS, f"{path}/chart")
    if space.chart["kind"] not in CHARTS:
        raise Malformed(f"{path}/chart: kind '{space.chart['kind']}', expected {', '.join(CHARTS)}")
    if space.chart["kind"] == "patch":
        _patch(space.chart, f"{path}/chart")
    if space.counts.size and (space.counts.min() < 4 or int(space.counts[0]) * int(space.counts[1]) != count):
        raise Malformed(f"{path}/counts: {space.counts.tolist()}, expected 4 or more, {count} in all")
    if space.spacing.size and not space.spacing.min() > 0:
        raise Malformed(f"{path}/spacing: {space.spacing.tolist()}, expected more than 0")


def _swap(record: ModalRecord, outline: Outline) -> None:
    """Check that each coordinate of bases that are swapped has a basis, and their traction space is there."""
    if (swap := record.swap) is None:
        return
    if f"tractions/{swap.interface}/rows" not in outline.shapes:
        raise Malformed(f"swap: interface '{swap.interface}' is no traction space")
    if (swap.borders[1:] <= swap.borders[:-1]).any():
        raise Malformed(f"swap/borders: {swap.borders.tolist()}, expected to ascend")
    if len(swap.number) and (swap.number.min() < 0 or swap.number.max() > len(swap.borders) + 1):
        raise Malformed(
            f"swap/number: {swap.number.min()} to {swap.number.max()}, expected 0 to {len(swap.borders) + 1}"
        )


def _tangential(record: ModalRecord, outline: Outline, end: float) -> None:
    """Check that tangential rows have their directions, and that R has them behind all other rows."""
    counts, spans = dict[str, int](), record.tangential_spans
    for group, beside in (("interfaces", "tangents"), ("tractions", "tangential_resultant")):
        row_counts: dict[str, dict[str, int]] = {beside: {}, "tangential_rows": {}}
        for path, shape in outline.shapes.items():
            group_path, _, field = path.rpartition("/")
            if field in row_counts and group_path.startswith(f"{group}/"):
                row_counts[field][group_path.removeprefix(f"{group}/")] = 2 * shape[0]
        if alone := row_counts["tangential_rows"].keys() ^ row_counts[beside].keys():
            raise Malformed(f"{group}/{min(alone)}: {beside} and tangential_rows, only one of them is there")
        counts |= row_counts["tangential_rows"]
    if unknown := spans.keys() - counts.keys():
        raise Malformed(f"tangential_spans: '{min(unknown)}' has no tangential rows")
    if "C" in outline.letters and (missing := counts.keys() - spans.keys()):
        raise Malformed(f"tangential_spans: '{min(missing)}' is missing")
    _ranges(spans, counts, end, "tangential_spans")
    normal_rows = max((stop for _, stop in record.interface_rows.values()), default=0)
    for name, (start, end_row) in spans.items():
        if start < end_row and start < normal_rows:
            raise Malformed(f"tangential_spans: {name}: [{start}, {end_row}], where other rows are")


def _morph(record: MorphRecord, outline: Outline) -> None:
    _positive_mass(record)


def _positive_mass(record: ModalRecord | MorphRecord) -> None:
    if not 0.0 < record.mass < math.inf:
        raise Malformed(f"mass: {record.mass}, expected more than 0")


def _cyclic(record: CyclicRecord, outline: Outline) -> None:
    if record.sectors < 1:
        raise Malformed(f"sectors: {record.sectors}, expected 1 or more")
    for name, modes in record.harmonics.items():
        if (
            name != str(modes.harmonic)
            or not 0 <= modes.harmonic <= record.sectors // 2
            or modes.multiplicity not in (1, 2)
        ):
            raise Malformed(f"harmonics/{name}: harmonic {modes.harmonic} of multiplicity {modes.multiplicity}")


def _trajectory(record: Trajectory, outline: Outline) -> None:
    _quantities(record, outline)
    for name, key in record.bodies.items():
        if not isinstance(key, str):
            raise Malformed(f"bodies: {name}: no key")
    for name, offset in record.coordinate_offsets.items():
        if not _whole(offset) or not 0 <= offset <= outline.letters["q"]:
            raise Malformed(f"coordinate_offsets: {name}: {offset}, expected 0 to {outline.letters['q']}")
    for name, peak in record.peaks.items():
        if not _whole(peak) or not 0 <= peak < outline.letters.get("p", 0):
            raise Malformed(f"peaks: {name}: {peak}, which is not in peak_times")


def _quantities(record: Trajectory | NodalRecord | WheelRecord | FieldRecord, outline: Outline) -> None:
    for name, entry in record.quantities.items():
        if not isinstance(entry, dict) or not _number(entry.get("value")) or not isinstance(entry.get("unit"), str):
            raise Malformed(f"quantities: {name}: expected value and unit")


def _field(record: FieldRecord, outline: Outline) -> None:
    _quantities(record, outline)
    names = record.conductors.get("names")
    if not isinstance(names, list) or len(names) != outline.letters["k"] or not all(isinstance(n, str) for n in names):
        raise Malformed(f"conductors: names: expected {outline.letters['k']} texts")
    if not _number(record.medium.get("permittivity"), finite=True):
        raise Malformed("medium: permittivity: expected a number")
    for name, order in (("panel", record.panel), ("coarse", record.coarse)):
        if len(order) and (order[0] != 0 or not set(map(int, order[1:] - order[:-1])) <= {0, 1}):
            raise Malformed(f"{name}: numbers that do not ascend one by one")


def _pose_grid(record: PoseGridRecord, outline: Outline) -> None:
    shapes = {path.removeprefix("axes/"): shape for path, shape in outline.shapes.items() if path.startswith("axes/")}
    if not shapes or not shapes.keys() <= set(POSE_AXES):
        raise Malformed(f"axes: {', '.join(shapes) or 'none'}, expected some of {', '.join(POSE_AXES)}")
    counts = [size for (size,) in shapes.values()]
    if min(counts) < 4:
        raise Malformed(f"axes: {min(counts)} values, expected four or more")
    for name, values in record.axes.items():
        if not (values[1:] > values[:-1]).all():
            raise Malformed(f"axes: {name}: expected values that ascend")
    for letter, points in (("p", math.prod(counts)), ("c", math.prod(n - 1 for n in counts))):
        if outline.letters[letter] != points:
            raise Malformed(f"axes: {points} points or cells, {outline.letters[letter]} in the arrays")


def _ranges(ranges: Mapping[str, Any], rows: Mapping[str, int], end: float, field: str) -> None:
    """Check ranges [first, last + 1] by name: within `end`, and as long as the rows of that name."""
    for name, span in ranges.items():
        if not isinstance(span, list) or len(span) != 2 or not all(map(_whole, span)):
            raise Malformed(f"{field}: {name}: expected [first, last + 1]")
        if not 0 <= span[0] <= span[1] <= end or rows.get(name, span[1] - span[0]) != span[1] - span[0]:
            raise Malformed(f"{field}: {name}: {span}, which are not its rows")


def _entries(description: Mapping[str, Any], kinds: Mapping[str, Mapping[str, int]], field: str) -> None:
    """Check the numbers of the description of a surface."""
    if not description:
        return
    kind = description.get("kind")
    if not isinstance(kind, str):
        raise Malformed(f"{field}: no kind")
    for name, count in kinds.get(kind, {}).items():
        entry = description.get(name)
        values = [entry] if count == 1 else entry
        if not isinstance(values, list) or len(values) != count or not all(_number(v, finite=True) for v in values):
            raise Malformed(f"{field}: {name}: expected {count} finite number{'s' * (count > 1)}")


def _patch(chart: Mapping[str, Any], field: str) -> None:
    """Check the height of a patch: splines over its cells, and which of these have surface."""
    counts, step = chart["counts"], chart["step"]
    if not all(map(_whole, counts)) or min(counts) < 4 or not min(step) > 0:
        raise Malformed(f"{field}: counts {counts} and step {step}, expected 4 or more, and more than 0")
    cells = (counts[0] - 3) * (counts[1] - 3)
    for name, count in (("heights", counts[0] * counts[1]), ("cover", cells)):
        values = chart.get(name)
        if not isinstance(values, list) or len(values) != count or not all(_number(v, finite=True) for v in values):
            raise Malformed(f"{field}: {name}: expected {count} finite numbers")


def _whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _number(value: Any, *, finite: bool = False) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return not finite or abs(value) < math.inf


CHECKS: dict[type, Callable[[Any, Outline], None]] = {
    MeshRecord: _mesh,
    ModalRecord: _modes,
    MorphRecord: _morph,
    CyclicRecord: _cyclic,
    NodalRecord: _quantities,
    Trajectory: _trajectory,
    WheelRecord: _quantities,
    FieldRecord: _field,
    PoseGridRecord: _pose_grid,
}
