"""Matrices for Nastran: OUTPUT4, binary, and the reduced body as DMIG on scalar points.

`KRED`, `MRED` are stiffness and mass of the coordinates, `BROW` the displacement of the rows per coordinate, `RRES` the
residual flexibility, `PHIG` the shapes with six directions a node, node after node. The bulk data have a scalar point
for each coordinate.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from gudgeon.pipeline.exporters.reduced import ReducedBody
from gudgeon.pipeline.files import whole_file, write_text

RECTANGULAR, SYMMETRIC = 2, 6
"""Forms of a matrix."""
DOUBLE = 2
"""Type of its numbers."""


def write(body: ReducedBody, folder: Path) -> list[Path]:
    """Write `NAME.op4` and `NAME.pch` and return them."""
    paths = [folder / f"{body.name}.op4", folder / f"{body.name}.pch"]
    K, M = np.diag(body.stiffness), np.eye(len(body.stiffness))
    phi = np.zeros((len(body.nodes), 6, len(body.stiffness)))
    phi[:, :3] = body.shapes
    matrices = [("KRED", K, SYMMETRIC), ("MRED", M, SYMMETRIC), ("PHIG", phi.reshape(-1, len(K)), RECTANGULAR)]
    if len(body.rows):
        matrices.append(("BROW", body.B, RECTANGULAR))
        if body.R is not None:
            matrices.append(("RRES", body.R, SYMMETRIC))
    with whole_file(paths[0]) as scratch, open(scratch, "wb") as file:
        for name, A, form in matrices:
            for record in _records(name, A, form):
                size = np.array([len(record)], "<i4").tobytes()
                file.write(size + record + size)
    write_text(paths[1], "".join(_bulk(K, M)))
    return paths


def _records(name: str, A: np.ndarray, form: int) -> Iterator[bytes]:
    """Yield the records of a matrix: its head, its columns from first to last entry, and the mark of its end."""
    rows, columns = A.shape
    yield np.array([columns, rows, form, DOUBLE], "<i4").tobytes() + f"{name:8}".encode()
    for column_number, column in enumerate(A.T, 1):
        filled = np.flatnonzero(column)
        if len(filled):
            values = column[filled[0] : filled[-1] + 1]
            head = np.array([column_number, filled[0] + 1, 2 * len(values)], "<i4")
            yield head.tobytes() + values.astype("<f8").tobytes()
    yield np.array([columns + 1, 1, 2], "<i4").tobytes() + np.array([1.0], "<f8").tobytes()


def _bulk(K: np.ndarray, M: np.ndarray) -> Iterator[str]:
    yield f"SPOINT  {1:8}{'THRU':8}{len(K):8}\n" if len(K) > 1 else f"SPOINT  {1:8}\n"
    for name, A in (("KRED", K), ("MRED", M)):
        yield f"DMIG    {name:8}{0:8}{SYMMETRIC:8}{DOUBLE:8}{0:8}\n"
        for j in range(len(A)):
            filled = [i for i in range(j, len(A)) if A[i, j] != 0]
            if filled:
                yield f"DMIG*   {name:16}{j + 1:16}{0:16}\n"
                yield from (f"*       {i + 1:16}{0:16}{_number(A[i, j])}\n" for i in filled)


def _number(value: float) -> str:
    """Return a number in sixteen columns with as many digits as fit."""
    for digits in range(12, 8, -1):
        if len(text := f"{value:.{digits}E}".replace("E", "D")) <= 16:
            return f"{text:>16}"
    return f"{value:16.8E}".replace("E", "D")
