"""Materials of components that take those of their decks (`geometry.materials`), as tables of a scene."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.decks.members.units import in_kilograms
from gudgeon.pipeline.geometry.decks.model import Deck, Section
from gudgeon.pipeline.geometry.mesh_file import MeshFile
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.base import Place

KEY = "materials"


def takes(component: Any) -> bool:
    """Return whether a component's table takes the materials of its deck."""
    geometry = component.get("geometry") if isinstance(component, dict) else None
    return isinstance(geometry, dict) and geometry.get("kind") == "file" and geometry.get(KEY) is True


def with_materials(scene_place: Place) -> Place:
    """Return a scene whose components have the materials of their decks where they take them.

    Raises:
        InputError: the scene states a material too, or the deck has none that a solid may have.
    """
    components, folder = dict(scene_place.tables["component"]), scene_place.path.parent
    with named(scene_place.path, InputError):
        for name, component in components.items():
            if takes(component):
                components[name] = component | {"material": _taken(f"component.{name}", component, folder)}
    return replace(scene_place, tables=scene_place.tables | {"component": components})


def _taken(key: str, component: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    if "material" in component:
        raise InputError(f"{key}.geometry.{KEY}: true given with {key}.material; allowed: one of them")
    try:
        geometry = MeshFile.model_validate(component["geometry"])
    except ValidationError:
        return {}  # The check of the whole scene lists all mistakes.
    path = folder / geometry.path
    return material_table(geometry.model_copy(update={"path": str(path)}), f"{key}.geometry.{KEY}")


def material_table(geometry: MeshFile, key: str) -> dict[str, Any]:
    """Return the `material` table of a deck, in SI units: the first section's, and the others' as volumes.

    Args:
        geometry: Of the deck.
        key: That asks for it, for messages.

    Raises:
        InputError: the deck has no material, or one that is not elastic and Cartesian.
    """
    deck = geometry.deck()
    sections = _of_solids(deck)
    if not sections:
        raise InputError(f"{key}: {geometry.path} gives no material to its solids; allowed: decks that do (*MATERIAL,"
                         " PSOLID, MPDATA), or component.NAME.material")  # fmt: skip
    mass_unit = in_kilograms(deck, geometry.mass_unit, key)
    tables = [_table(section, geometry.unit, mass_unit, key) for section in sections]
    volumes = {s.elements: t for s, t in zip(sections[1:], tables[1:], strict=True) if t != tables[0]}
    return tables[0] | ({"volumes": volumes} if volumes else {})


def _of_solids(deck: Deck) -> list[Section]:
    """Return the sections of sets that have solid elements; that of the most elements first."""
    solids = np.concatenate([np.empty(0, int), *(b.labels for b in deck.blocks if b.cell.dimension == 3)])
    counts = []
    for section in deck.sections:
        members = next(
            (m for name, m in deck.element_sets.items() if name.casefold() == section.elements.casefold()), None
        )
        spelled = next((n for n in deck.element_sets if n.casefold() == section.elements.casefold()), "")
        count = len(solids) if not section.elements else 0 if members is None else int(np.isin(solids, members).sum())
        if count:
            counts.append((count, section._replace(elements=spelled)))
    return [section for _, section in sorted(counts, key=lambda row: -row[0])]


def _table(section: Section, unit: float, mass_unit: float, key: str) -> dict[str, Any]:
    """Return the constants of a section in SI units."""
    modulus, density = mass_unit / unit, mass_unit / unit**3
    rho = section.constants.get("rho")
    if not rho:
        raise section.source.error(f"the material of '{section.elements or 'all'}' has no density; {key} needs one")
    if "anisotropic" not in section.constants:
        missing = [name for name in ("E", "nu") if name not in section.constants]
        if missing:
            raise section.source.error(f"the material of '{section.elements or 'all'}' has no {missing[0]}; {key} needs"
                                       " E and nu")  # fmt: skip
        return {"E": modulus * section.constants["E"], "nu": section.constants["nu"], "rho": density * rho}
    if section.orthotropic is None or section.axes is None:
        raise section.source.error(f"the material of '{section.elements or 'all'}' is neither isotropic nor orthotropic"
                                   f" in Cartesian directions; allowed with {key}: these")  # fmt: skip
    scaled = {name: [modulus * x for x in section.orthotropic[name]] for name in ("E", "G")}
    axes: Sequence[Sequence[float]] = section.axes.T[:2].tolist()
    orthotropic = {"E": scaled["E"], "nu": list(section.orthotropic["nu"]), "G": scaled["G"], "axes": axes}
    return {"rho": density * rho, "orthotropic": orthotropic}
