"""One reader per family of formats, by the ending of a file's name; each returns a `Deck`."""

from collections.abc import Callable, Mapping
from pathlib import Path

from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.geometry.decks.abaqus.deck import read_abaqus
from gudgeon.pipeline.geometry.decks.ansys.archive import read_ansys
from gudgeon.pipeline.geometry.decks.ansys.substructure import read_substructure_deck
from gudgeon.pipeline.geometry.decks.by_gmsh import read_by_gmsh
from gudgeon.pipeline.geometry.decks.by_meshio import read_by_meshio
from gudgeon.pipeline.geometry.decks.exodus import read_exodus
from gudgeon.pipeline.geometry.decks.model import Deck, Scope
from gudgeon.pipeline.geometry.decks.nastran.deck import read_nastran
from gudgeon.pipeline.geometry.decks.separate import of_elements
from gudgeon.pipeline.geometry.decks.texts import refuse_packed
from gudgeon.pipeline.geometry.decks.unv import read_unv

READABLE = (
    "allowed: .inp, .bdf, .cdb, .msh (saved without Mesh.SaveAll), .unv, .med, .vtu, .e or another format of meshio"
)
Reader = Callable[[str, Scope], Deck]
DECKS: Mapping[str, Reader] = {
    ".inp": read_abaqus, **dict.fromkeys((".bdf", ".nas", ".dat", ".pch", ".asm", ".dmig"), read_nastran),
    ".cdb": read_ansys, ".sub": read_substructure_deck, ".nc4": read_exodus,
}  # fmt: skip
"""Readers of decks, which name more than a mesh."""
FAMILIES: Mapping[str, Reader] = {
    **DECKS, **dict.fromkeys((".unv", ".uff"), read_unv), ".med": read_by_gmsh,
    **dict.fromkeys((".e", ".exo", ".ex2", ".exii", ".g", ".gen"), read_exodus),
}  # fmt: skip
"""Readers by ending; meshio reads what is not here."""
BY_GMSH = (".mesh", ".msh", ".vtk", ".su2", ".cgns")
"""Endings that gmsh reads where meshio cannot."""
BODIES = (".inp",)
"""Endings of decks with parts and instances."""
WHOLE = Scope()


def _reader(path: str, ending: str) -> Reader:
    """Return the reader of a file; some programs write decks of Abaqus by the ending of gmsh's meshes."""
    if ending == ".msh":
        with Path(path).open("rb") as file:
            return read_abaqus if file.read(1) == b"*" else read_by_meshio
    return FAMILIES.get(ending, read_by_meshio)


def _of_set(path: str, scope: Scope) -> Deck:
    """Return one of several bodies of a file without parts."""
    if scope.part_name is None:
        raise InputError(f"{path}: geometry.instance given; allowed: with {', '.join(BODIES)}")
    return of_elements(read_deck(path), scope.part_name, path)


def read_deck(path: str, scope: Scope = WHOLE) -> Deck:
    """Return what a file says.

    Raises:
        InputError: it is missing, damaged, no mesh, or has several bodies of which `scope` names none.
    """
    if not Path(path).is_file():
        raise InputError(f"{path}: no such file; {READABLE}")
    refuse_packed(path)
    ending = Path(path).suffix.lower()
    if scope != WHOLE and ending not in BODIES:
        return _of_set(path, scope)
    reader = _reader(path, ending)
    try:
        return reader(path, scope)
    except InputError as error:
        if ending not in BY_GMSH or "damaged" not in str(error):
            raise
        failure: BaseException = error
    except (Exception, SystemExit) as error:  # meshio's readers raise anything, or end the process.
        failure = error
    if ending in BY_GMSH:
        try:
            deck = read_by_gmsh(path, scope)
        except (InputError, StageError, ValueError):  # What meshio says of it stands.
            deck = None
        if deck is not None and deck.blocks:
            return deck
    if isinstance(failure, InputError):
        raise failure
    reason = " ".join(str(failure).split()) if isinstance(failure, Exception) else "not what its name ends in"
    raise InputError(f"{path}: cannot be read as a mesh ({reason or type(failure).__name__}); {READABLE}") from failure
