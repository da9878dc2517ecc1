"""Kilograms per unit of mass of a deck, and whether its numbers are those of a solid."""

from collections.abc import Sequence
from typing import TypeVar

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.decks.model import Coupling, Deck, PointMass, RigidLink, Sum, TiedSurfaces
from gudgeon.pipeline.geometry.decks.naming import Omissible

DENSITIES = (10.0, 30_000.0)
"""Densities of solids [kg/m³]: a deck whose numbers are among them has its masses in kg."""
M = TypeVar("M", Coupling, RigidLink, PointMass, Sum, TiedSurfaces)
Member = Coupling | RigidLink | PointMass | Sum | TiedSurfaces


def kept(items: Sequence[M], leave_out: Sequence[str]) -> list[M]:
    """Return members whose keyword is not among those that are left out on purpose."""
    folded = {name.casefold() for name in leave_out}
    return [item for item in items if item.keyword.casefold() not in folded]


def mass_scale(deck: Deck, members: Sequence[PointMass | Sum], mass_unit: float | None) -> float:
    """Return the kilograms per unit of mass of a deck, whose time is in seconds.

    Args:
        members: What has a mass or a stiffness; without any, the unit does not matter.
        mass_unit: As the scene states it.

    Raises:
        InputError: it is not stated, and the deck's densities are none in kg/m³.
    """
    if mass_unit is not None or not members:
        return 1.0 if mass_unit is None else mass_unit
    if text := _other_density(deck):
        raise refused(members[0], text)
    return 1.0


def in_kilograms(deck: Deck, mass_unit: float | None, key: str) -> float:
    """Return the kilograms per unit of mass of a deck whose materials `key` asks for; errors as of `mass_scale`."""
    if mass_unit is None and (text := _other_density(deck)):
        raise InputError(f"{key}: {text}")
    return 1.0 if mass_unit is None else mass_unit


def _other_density(deck: Deck) -> str:
    """Return what is wrong with the densities of a deck, if they are in kg/m³; empty if nothing is."""
    densities = [constants["rho"] for _, constants in deck.materials if constants.get("rho")]
    wrong = [rho for rho in densities if not DENSITIES[0] <= rho <= DENSITIES[1]]
    if not wrong:
        return ""
    return (f"the deck's density of {wrong[0]:g} is not in kg/m^3; geometry.mass_unit states the kg per unit of mass,"
            " 1000 for tonnes")  # fmt: skip


def refused(item: Member, text: str) -> InputError:
    """Return the error of what cannot be taken over, with the key that leaves it out."""
    assert item.source is not None
    text = f'{item.keyword}: {text}; geometry.leave_out = ["{item.keyword}"] leaves it out'
    return Omissible(str(item.source.error(text)), (item.keyword,))
