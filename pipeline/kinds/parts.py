"""Functions of the commands on files: faces of a part, a new scene, the keys of scenes, the scenes of the package."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gudgeon.pipeline.kinds import scene_tables
from gudgeon.pipeline.kinds import schema as schema_of_all
from gudgeon.pipeline.kinds.examples import copy_example

if TYPE_CHECKING:
    from gudgeon.pipeline.drafts.faces import Look
    from gudgeon.pipeline.drafts.sets import SetsLook


def faces(
    file: str | Path, *, unit: float | None = None, solids: Sequence[str | int] = (), picture: str | Path | None = None
) -> "Look | SetsLook":
    """List the faces of a part of CAD, or the sets and couplings of a deck; `print(look.as_text())` shows them.

    >>> import gudgeon
    >>> look = gudgeon.faces(gudgeon.example("fork") / "fork.geo", unit=1.0)
    >>> len(look.faces), round(look.volume * 1e6, 2)       # cm^3
    (10, 7.93)

    Args:
        file: STEP, IGES or BREP file, a script of gmsh, or a deck (.inp, .bdf, .cdb).
        unit: Metres per unit of length; needed for files without one of their own.
        solids: Numbers or names of solids to take; default: all, glued.
        picture: PNG to draw of the faces of a part.

    Raises:
        InputError: the file is missing, damaged or of another kind.
        StageError: gmsh failed.
    """
    from gudgeon.pipeline.drafts.faces import look_at
    from gudgeon.pipeline.drafts.sets import look_at_sets
    from gudgeon.pipeline.geometry.decks.reading import DECKS

    if Path(file).suffix.lower() in DECKS:
        return look_at_sets(str(file), unit)
    return look_at(str(file), unit, solids, None if picture is None else Path(picture))


def new(
    file: str | Path, *, unit: float | None = None, solids: Sequence[str | int] = (), folder: str | Path | None = None
) -> Path:
    """Write a scene in which a part of CAD is thrown at a plane, with comments, and return its folder.

    >>> import gudgeon
    >>> folder = gudgeon.new(gudgeon.example("fork") / "fork.geo", unit=1.0, folder="my-fork")
    >>> gudgeon.Scene.from_file(folder).run.duration > 0
    True

    Args:
        file, unit, solids: Part, metres per unit and chosen solids, as `faces` takes them.
        folder: New folder, which must not exist; default: the name of the file.

    Raises:
        InputError: the file is no part, or the folder exists or cannot be written.
        StageError: gmsh failed.
    """
    from gudgeon.pipeline.drafts.scene import write_draft

    return write_draft(str(file), unit, solids, None if folder is None else Path(folder))[0]


def example(name: str, folder: str | Path | None = None) -> Path:
    """Copy the folder of a scene of the package, and return the copy; `gudgeon example list` names them.

    >>> import gudgeon
    >>> sorted(file.name for file in gudgeon.example("rod-wall").iterdir())
    ['A1_rod_rigid_wall.json', 'scene.toml']

    Args:
        folder: New folder, which must not exist; default: the name of the scene.

    Raises:
        InputError: there is no such scene, or the folder exists or cannot be written.
    """
    return copy_example(name, None if folder is None else Path(folder))


def schema(key: str | None = None) -> Any:
    """Return the text that explains a table or key of scene files, or the JSON schema of all of them.

    >>> import gudgeon
    >>> print(gudgeon.schema("component.geometry.box").splitlines()[0])
    [component.NAME.geometry]
    >>> "run" in gudgeon.schema()["$defs"]["SceneFile"]["properties"]
    True

    Args:
        key: Without the names that a scene gives, such as `component.interface`; None: the schema.

    Raises:
        InputError: there is no such key.
    """
    if key is None:
        return schema_of_all()
    from gudgeon.pipeline.scenes.reference.key_reference import key_text

    return key_text(scene_tables(), key)
