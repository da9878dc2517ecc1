"""The commands on CAD files: `gudgeon faces` and `gudgeon new`."""

import argparse
import json
import math
import shlex
import sys
from pathlib import Path

from gudgeon.pipeline.errors import InputError

MESHES = (".msh", ".vtu", ".vtk", ".mesh", ".vol")
"""Endings of mesh files beside those of families of decks."""


def faces_command(options: argparse.Namespace) -> int:
    """List and draw the faces of a CAD part; list the sets and couplings of a model of another program."""
    from gudgeon.pipeline.geometry.decks.reading import DECKS

    if Path(options.file).suffix.lower() in DECKS:
        return _list_sets(options)
    from gudgeon.pipeline.drafts.faces import look_at

    for key in ("part", "instance"):
        if getattr(options, key):
            raise InputError(f"--{key}: given with {options.file}; allowed: with decks of several bodies (.inp)")
    picture = options.picture or Path(f"{Path(options.file).stem}-faces.png")
    look = look_at(options.file, _unit(options.unit), _solids(options.solid), picture)
    print(json.dumps(look.as_json(), indent=1) if options.json else look.as_text())
    if look.picture is not None and not options.json:
        print(f"\npicture: {look.picture}")
    for note in look.notes:
        print(f"gudgeon: {note}", file=sys.stderr)
    return 0


def _list_sets(options: argparse.Namespace) -> int:
    from gudgeon.pipeline.drafts.sets import look_at_sets
    from gudgeon.pipeline.geometry.decks.model import Scope

    for key in ("solid", "picture"):
        if getattr(options, key):
            raise InputError(f"--{key}: given with {options.file}; allowed: with STEP, IGES, BREP and .geo files")
    sets = look_at_sets(options.file, _unit(options.unit), Scope(options.part, options.instance))
    print(json.dumps(sets.as_json(), indent=1) if options.json else sets.as_text())
    return 0


def new_command(options: argparse.Namespace) -> int:
    """Write a scene of a part."""
    from gudgeon.pipeline.geometry.decks.reading import FAMILIES
    from gudgeon.pipeline.geometry.numbers import CAD_KINDS

    unit = _unit(options.unit)
    ending = Path(options.file).suffix.lower()
    if ending in FAMILIES or ending in MESHES:
        from gudgeon.pipeline.drafts.decks import write_deck_draft

        if options.solid:
            raise InputError(f"--solid: given with {options.file}; allowed: with {', '.join(CAD_KINDS)} and .geo")
        folder, notes = write_deck_draft(options.file, unit, options.folder)
    else:
        from gudgeon.pipeline.drafts.scene import write_draft

        folder, notes = write_draft(options.file, unit, _solids(options.solid), options.folder)
    for note in notes:
        print(f"gudgeon: {note}", file=sys.stderr)
    print(f"{folder / 'scene.toml'}: try `gudgeon run {shlex.quote(str(folder))}`")
    return 0


def _unit(text: str | None) -> float | None:
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 1e-9 <= value <= 1e4:
        raise InputError(f"--unit {text}: expected the metres per unit of length, 1e-9 to 1e4; 0.001 for mm")
    return value


def _solids(texts: list[str]) -> list[str | int]:
    return [int(text) if text.isdecimal() else text for text in texts]
