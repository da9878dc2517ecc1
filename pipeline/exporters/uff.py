"""Universal files: nodes (2411), elements (2412), groups of interfaces (2477), mode shapes (55).

Units are SI (164). Elastic coordinates are real normal modes of modal mass 1, numbered from 1 with their frequency;
rigid motions come first, at 0 Hz.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.exporters.reduced import ReducedBody
from gudgeon.pipeline.files import write_text
from gudgeon.pipeline.geometry.cells import PYRAMID, Block, cell_blocks


def write(body: ReducedBody, folder: Path) -> list[Path]:
    """Write `NAME.uff` and return it."""
    path = folder / f"{body.name}.uff"
    sets = [_head(body), _units(), _nodes(body), _groups(body)]
    blocks = cell_blocks(body.mesh)
    unknown = {block.cell.name for block in blocks if block.cell.shape is PYRAMID}
    if unknown:
        raise InputError(f"export: body '{body.name}' given, its mesh has {', '.join(sorted(unknown))}; universal files"
                         " have no pyramids, use format 'npz', 'op4' or 'abaqus'")  # fmt: skip
    if any(block.cell.universal for block in blocks):
        sets.insert(3, _elements(body, blocks))
    modes = (_mode(body, k) for k in range(body.shapes.shape[2]))
    write_text(path, "".join(f"    -1\n{text}    -1\n" for text in (*sets, *modes)))
    return [path]


def _lines(values: Iterator[str] | list[str], each: int) -> str:
    """Return fields, so many a line."""
    words = list(values)
    return "".join("".join(words[k : k + each]) + "\n" for k in range(0, len(words), each))


def _head(body: ReducedBody) -> str:
    lines = [f"Body {body.name}, written by Gudgeon", "NONE", "Gudgeon"]
    blank = " " * 10 + " " * 10
    return f"{151:6}\n" + "".join(f"{line[:80]}\n" for line in [*lines, blank, blank, "", ""])


def _units() -> str:
    factors = "".join(f"{value:25.17E}".replace("E", "D") for value in (1.0, 1.0, 1.0))
    return f"{164:6}\n{1:10}{'SI: Meter (newton)':20}{2:10}\n{factors}\n{273.15:25.17E}\n".replace("E+", "D+")


def _nodes(body: ReducedBody) -> str:
    rows = (
        f"{label:10}{1:10}{1:10}{11:10}\n" + "".join(f"{x:25.16E}".replace("E", "D") for x in position) + "\n"
        for label, position in zip(body.labels, body.nodes, strict=True)
    )
    return f"{2411:6}\n" + "".join(rows)


def _elements(body: ReducedBody, blocks: Sequence[Block]) -> str:
    """Return the elements, numbered as in the mesh; nodes in the centres of faces and cells belong to none."""
    text = [f"{2412:6}\n"]
    for cell, rows, nodes in blocks:
        assert cell.universal is not None
        descriptor, order = cell.universal
        for row, cell_nodes in zip(rows, nodes, strict=True):
            text.append("".join(f"{x:10}" for x in (row + 1, descriptor, 1, 1, 7, len(order))) + "\n")
            if cell.dimension == 1:  # A record of its orientation.
                text.append("".join(f"{x:10}" for x in (0, 1, 1)) + "\n")
            text.append(_lines([f"{body.labels[cell_nodes[k]]:10}" for k in order], 8))
    return "".join(text)


def _groups(body: ReducedBody) -> str:
    """Return the nodes of each named surface as a group."""
    text = [f"{2477:6}\n"]
    for group_id, (name, surface) in enumerate(body.mesh.surfaces.items(), 1):
        members = body.labels[np.unique(surface.facets)]
        text.append("".join(f"{x:10}" for x in (group_id, 0, 0, 0, 0, 0, 0, len(members))) + f"\n{name[:40]}\n")
        text.append(_lines([f"{7:10}{label:10}{0:10}{0:10}" for label in members], 2))
    return "".join(text)


def _mode(body: ReducedBody, k: int) -> str:
    """Return one shape as data at nodes: a normal mode, real, three translations a node."""
    omega = float(np.sqrt(body.stiffness[k]))
    rigid = k < body.rigid_count
    name = f"rigid motion {k + 1}" if rigid else f"coordinate {k + 1}"
    lines = [f"{body.name}: {name}", "Gudgeon", "NONE", f"{omega / (2 * np.pi):.9g} Hz, modal mass 1 kg", "NONE"]
    head = "".join(f"{line[:80]}\n" for line in lines)
    head += "".join(f"{x:10}" for x in (1, 2, 2, 8, 2, 3)) + "\n"
    head += "".join(f"{x:10}" for x in (2, 4, 0, k + 1)) + "\n"
    head += "".join(f"{x:13.5E}" for x in (omega / (2 * np.pi), 1.0, 0.0, 0.0)) + "\n"
    rows = (
        f"{label:10}\n" + "".join(f"{x:13.5E}" for x in u) + "\n"
        for label, u in zip(body.labels, body.shapes[:, :, k], strict=True)
    )
    return f"{55:6}\n{head}" + "".join(rows)
