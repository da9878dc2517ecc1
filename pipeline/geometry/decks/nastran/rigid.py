"""Rigid elements of bulk data of Nastran: RBE2, RBAR and RBE3."""

from collections.abc import Mapping, Sequence

from gudgeon.pipeline.geometry.decks.model import Coupling, RigidLink
from gudgeon.pipeline.geometry.decks.nastran.bulk import Card

ALL = set("123456")
TRANSLATIONS = set("123")


def rigid_elements(
    by_name: Mapping[str, Sequence[Card]],
) -> tuple[list[Coupling], list[RigidLink], dict[str, list[int]]]:
    """Return RBE2 and RBE3 as couplings, RBAR as links, and the grid points of couplings by names as `rbe2_EID`.

    None of an RBE2 that does not carry all translations, and of an RBAR whose ends share some directions alone.
    """
    couplings: list[Coupling] = []
    sets: dict[str, list[int]] = {}
    for card in by_name.get("RBE2", []):
        carried = set(card.text(2))
        if carried >= TRANSLATIONS:
            name = f"rbe2_{card.integer(0)}"
            members = [f for f in card.fields[3:] if "." not in f]
            sets[name] = card._replace(fields=members).listed(0)
            couplings.append(Coupling(name, name, card.integer(1), "rbe2", "RBE2", card.source, turns=carried >= ALL))
    couplings += [_mean(card, sets) for card in by_name.get("RBE3", [])]
    links = [RigidLink((card.integer(1), card.integer(2)), card.name, card.source)
             for card in by_name.get("RBAR", []) if _firm(card)]  # fmt: skip
    return couplings, links, sets


def _firm(card: Card) -> bool:
    """Return whether one end of an RBAR has all directions, by which all those of the other one are expressed."""
    first_free, second_free, first_led, second_led = (set(card.text(k)) for k in (3, 4, 5, 6))
    if first_free >= ALL and not second_free:
        return not second_led or second_led >= ALL
    return second_free >= ALL and not first_free and (not first_led or first_led >= ALL)


def _mean(card: Card, sets: dict[str, list[int]]) -> Coupling:
    """Return an RBE3, whose grid points are added to sets; it has no source where directions are left out.

    A weight and its directions are followed by grid points, then by the next weight.
    """
    name, k = f"rbe3_{card.integer(0)}", 4
    weights: dict[int, float] = {}
    plain = set(card.text(3)) >= TRANSLATIONS
    while k < len(card.fields) and "." in card.text(k):
        weight = card.real(k)
        plain &= set(card.text(k + 1)) >= TRANSLATIONS
        k += 2
        while k < len(card.fields) and (not card.text(k) or card.text(k).isdigit()):
            if card.text(k):
                plain &= card.integer(k) not in weights
                weights[card.integer(k)] = weight
            k += 1
    sets[name] = list(weights)
    source = card.source if plain else None
    return Coupling(name, name, card.integer(2), "rbe3", "RBE3", source, weights=weights)
