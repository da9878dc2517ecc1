"""A deck of Abaqus: matrices of the coordinates (*MATRIX INPUT) on nodes of their own, and the rows as equations.

Coordinate k is direction 1 of node k. Row i is direction 1 of node FIRST_ROW + i, tied to the coordinates by B
(*EQUATION), so that forces and contacts act on it; a set of nodes has its name. The residual flexibility is a file of
its own: a matrix assembly cannot put it in series.
"""

from pathlib import Path

import numpy as np

from gudgeon.pipeline.exporters.reduced import ReducedBody
from gudgeon.pipeline.files import write_text

FIRST_ROW = 1_000_001
"""Number of the node of the first row."""
TERMS = 4
"""Terms of an equation in a line."""


def write(body: ReducedBody, folder: Path) -> list[Path]:
    """Write `NAME.inp`, `NAME_STIF.mtx`, `NAME_MASS.mtx` and, if there is one, `NAME_R.mtx`, and return them."""
    count, deck = len(body.stiffness), folder / f"{body.name}.inp"
    files = {"STIF": np.diag(body.stiffness), "MASS": np.eye(count)}
    paths = [deck]
    for name, A in files.items():
        paths.append(folder / f"{body.name}_{name}.mtx")
        write_text(paths[-1], _entries(A, 1))
    if body.R is not None and len(body.rows):
        paths.append(folder / f"{body.name}_R.mtx")
        write_text(paths[-1], _entries(body.R, FIRST_ROW))
    write_text(deck, _deck(body))
    return paths


def _deck(body: ReducedBody) -> str:
    centre = ", ".join(f"{x:.17g}" for x in body.morph.centre)
    text = ["*HEADING", f"Body {body.name}, reduced, written by Gudgeon. SI units.", "*NODE, NSET=COORDINATES"]
    text += [f"{k}, {centre}" for k in range(1, len(body.stiffness) + 1)]
    for k, row in enumerate(body.rows, FIRST_ROW):
        position = np.where(np.isnan(row.place), body.morph.centre, row.place)
        text += [f'*NODE, NSET="{row.name}"', f"{k}, {', '.join(f'{x:.17g}' for x in position)}"]
    for k, line in enumerate(body.B):
        filled = np.flatnonzero(line)
        terms = [f"{FIRST_ROW + k}, 1, -1.0", *(f"{j + 1}, 1, {line[j]:.17g}" for j in filled)]
        text += ["*EQUATION", str(len(terms))]
        text += [", ".join(terms[i : i + TERMS]) for i in range(0, len(terms), TERMS)]
    for name in ("STIF", "MASS"):
        text.append(f"*MATRIX INPUT, NAME={name}, INPUT={body.name}_{name}.mtx")
    return "\n".join([*text, "*MATRIX ASSEMBLE, STIFFNESS=STIF, MASS=MASS"]) + "\n"


def _entries(A: np.ndarray, first_node: int) -> str:
    """Return the lower triangle as lines `node, 1, node, 1, value`, with the diagonal whole."""
    rows, columns = np.nonzero(np.tril(A) + np.eye(len(A)))
    return "".join(
        f"{first_node + i}, 1, {first_node + j}, 1, {A[i, j]:.17e}\n" for i, j in zip(rows, columns, strict=True)
    )
