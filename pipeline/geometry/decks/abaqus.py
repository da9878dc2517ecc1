"""Meshes of Abaqus and CalculiX decks: what meshio's reader leaves out is put right before and after it."""

import io
import re
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.pipeline.errors import InputError

MOST_MEMBERS = 10_000_000
"""Members of all sets of a deck that a line of it stands for."""
ABAQUS_TYPES = [
    (re.compile(r"D?C3D(4|10)[A-Z]*"), r"C3D\1"),
    (re.compile(r"(C3D\d+[A-Z]*)"), r"\1"),
    (re.compile(r"(CPS|CPE|CAX|M3D|SFM3D|R3D|STRI|S)3[A-Z]*"), "S3"),
    (re.compile(r"(CPS|CPE|CAX|M3D|SFM3D|S)6[A-Z]*|STRI65"), "STRI65"),
]
"""Solids and triangles of a deck by the name in meshio; other elements (springs, beams) are omitted."""


def read_abaqus(path: str) -> Any:
    """Read an Abaqus or CalculiX deck by meshio, rearranged to nodes, elements, sets.

    meshio keeps only the last *NODE block and the last part of a set, and assigns sets to the wrong elements where an
    *ELEMENT has no name (its issue 1530). So parts are joined, each *ELEMENT block gets a set, and its name afterwards.
    """
    import meshio

    deck: dict[str, list[str]] = {"*NODE": []}
    blocks: list[str] = []
    rows: list[str] | None = None
    header, part_count, generate, members = "", 0, False, 0
    for line in Path(path).read_text(errors="replace").splitlines():
        if line.startswith("**") or not line.strip():
            continue
        if line.startswith("*"):
            keyword, header = _abaqus_header(line, blocks)
            part_count += keyword == "PART"
            if keyword == "INCLUDE" or part_count > 1:
                raise InputError(f"{path}: has *INCLUDE or a second *PART; allowed: one mesh, wholly in this file")
            rows = deck.setdefault(header, []) if header else None
            generate = "GENERATE" in line.upper().replace(" ", "").split(",")
        elif rows is not None and generate:
            start, stop, *step = (int(word) for word in line.split(",") if word.strip())
            numbers = range(start, stop + 1, *step)
            members = _counted(members, max(0, (numbers.stop - numbers.start) // numbers.step), path)
            rows.append(",".join(map(str, numbers)))
        elif rows is not None and not line.strip()[0].isdigit():  # sets of sets
            kind = header.partition("=")[0]
            for members_of_set in (deck.get(f"{kind}={name.strip()}", []) for name in line.split(",")):
                if members_of_set is rows:
                    raise InputError(f"{path}: a set names itself: {header}")
                members = _counted(members, sum(row.count(",") + 1 for row in members_of_set), path)
                rows += members_of_set
        elif rows is not None:
            rows.append(line)
    rank = {"*NODE": 0, "*ELEMENT": 1, "*NSET": 2, "*ELSET": 3}
    headers = sorted(deck, key=lambda header: rank[header.partition(",")[0]])
    text = "".join(f"{line}\n" for header in headers for line in [header, *deck[header]])
    mesh = meshio.read(io.StringIO(text), file_format="abaqus")
    for k, name in enumerate(blocks):
        del mesh.cell_sets[f":{k}"]
        if name:
            sets = mesh.cell_sets.get(name) or [np.empty(0, int) for _ in blocks]
            sets[k] = np.arange(len(mesh.cells[k].data))
            mesh.cell_sets[name] = sets
    return mesh


def _counted(members: int, added: int, path: str) -> int:
    """Return the members of all sets that are written out, with `added` of them; a file must not name too many."""
    if members + added > MOST_MEMBERS:
        raise InputError(
            f"{path}: its sets have more than {MOST_MEMBERS:,} members, as GENERATE or sets of sets name them"
        )
    return members + added


def _abaqus_header(line: str, blocks: list[str]) -> tuple[str, str]:
    """Return a keyword and the line that replaces it, empty if it is omitted; add element blocks' names to `blocks`."""
    keyword = line.partition(",")[0].strip("* \t").upper()
    options = {key.upper(): value.strip() for key, value in re.findall(r",\s*(\w+)\s*=([^,]+)", line)}
    if keyword == "NODE":
        return keyword, "*NODE"
    if keyword in ("NSET", "ELSET"):
        return keyword, f"*{keyword}, {keyword}={options.get(keyword, '')}"
    if keyword == "ELEMENT":
        for pattern, replacement in ABAQUS_TYPES:
            if match := pattern.fullmatch(options.get("TYPE", "").upper()):
                blocks.append(options.get("ELSET", ""))
                return keyword, f"*ELEMENT, TYPE={match.expand(replacement)}, ELSET=:{len(blocks) - 1}"
    return keyword, ""
