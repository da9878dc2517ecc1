"""Bulk data of Nastran (.bdf, .nas, .dat): grid points in their systems, solids, sets, rigid elements.

Own reading. meshio 5 skips coordinate systems, INCLUDE, large fields and continuations by blank fields without a word;
pyyeti, which reads matrices, knows neither INCLUDE nor chains of systems.
"""

import re
from collections.abc import Mapping, Sequence, Set

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import CELLS
from gudgeon.pipeline.geometry.decks.constants import engineering_constants
from gudgeon.pipeline.geometry.decks.model import (
    MISSING,
    Block,
    Deck,
    Omission,
    Scope,
    Section,
    Source,
    deck_of,
)
from gudgeon.pipeline.geometry.decks.nastran.bulk import Card, chosen_equations, read_cards
from gudgeon.pipeline.geometry.decks.nastran.grids import Grids
from gudgeon.pipeline.geometry.decks.nastran.masses import mass_factor, read_masses
from gudgeon.pipeline.geometry.decks.nastran.retained import with_retained
from gudgeon.pipeline.geometry.decks.nastran.rigid import rigid_elements
from gudgeon.pipeline.geometry.decks.nastran.sums import read_sums

HEXA20 = (*range(12), *range(16, 20), *range(12, 16))
WEDGE15 = (*range(9), *range(12, 15), *range(9, 12))
Choice = tuple[str, int, tuple[int, ...]]
CARDS: Mapping[str, tuple[Choice, ...]] = {
    "CTETRA": (("tetra", 4, ()), ("tetra10", 10, ())),
    "CHEXA": (("hexahedron", 8, ()), ("hexahedron20", 20, HEXA20)),
    "CPENTA": (("wedge", 6, ()), ("wedge15", 15, WEDGE15)),
    "CPYRAM": (("pyramid", 5, ()), ("pyramid13", 13, ())),
    "CPYRA": (("pyramid", 5, ()), ("pyramid13", 13, ())),
    "CTRIA3": (("triangle", 3, ()),), "CTRIA6": (("triangle6", 6, ()),), "CTRIAR": (("triangle", 3, ()),),
    "CQUAD4": (("quad", 4, ()),), "CQUAD8": (("quad8", 8, ()),), "CQUADR": (("quad", 4, ()),),
    "CROD": (("line", 2, ()),),
}  # fmt: skip
"""Cells by card: name, nodes, and their order where it differs: Nastran numbers upright edges before upper ones."""
TWO_POINTS, BUBBLES = ", IN = TWO", ", ISOP = REDUCED"
"""Of hexahedra: two points each way, and reduced shear, with bubble functions on eight nodes, which is the default."""
SAME = 1e-9
"""Entries of a stiffness, over the largest one, that are zero."""
SHELLS = ("CTRIA3", "CTRIA6", "CTRIAR", "CQUAD4", "CQUAD8", "CQUADR", "CROD")
"""Faces and lines, structural only with a property."""
HARMLESS = re.compile(
    r"CORD\d[A-Z]|CSET\d?|CYSYM|CREEP|CLOAD|CONV\w*|CONTRLT|CAERO\d|CSSCHD|CYAX|CYJOIN|CNVPEL|CYSUP|CHBDY\w|"
    r"RLOAD\d|RAD\w*|RANDPS|RANDT1|RFORCE\d?|RELEASE|RVDOF\d?|RCROSS|RESVEC"
)
"""Cards that begin as elements and rigid elements do and alter no matrix."""
ALTERING = {"MPC": "an equation", "GENEL": "a general element", "BGSET": "glued surfaces", "BGADD": "glued surfaces",
            "DMIG": "a matrix", "NSM": "a mass without volume", "NSML": "a mass without volume",
            "NSM1": "a mass without volume", "NSML1": "a mass without volume", "BCONP": "contact"}  # fmt: skip
RIGID = ("RBE", "RBAR", "RROD", "RSPLINE", "RSSCON", "RTRPLT", "RJOINT")
SHELL_PROPERTIES = ("PSHELL", "PCOMP", "PCOMPG", "PSHEAR", "PROD", "PLPLANE")
LOADS = re.compile(r"SPC[D1R]?|SPCADD|SUPORT\d?|FORCE\d?|MOMENT\d?|PLOAD\d?|GRAV|LOAD|TEMP\w*|BCTABLE|BCTSET|BSURFS?")
"""Cards of supports, loads and contact, which a scene states itself."""


def read_nastran(path: str, scope: Scope) -> Deck:
    """Read the bulk data of a file.

    Raises:
        InputError: a file is missing, a card is wrong, or a coordinate system is not there.
    """
    by_name: dict[str, list[Card]] = {}
    for card in read_cards(path):
        by_name.setdefault(card.name, []).append(card)
    if not by_name.get("GRID"):
        raise InputError(f"{path}: has no GRID cards; allowed: bulk data of Nastran")
    grids = Grids(path, by_name)
    labels, points = grids.positions()
    blocks, properties = _elements(by_name)
    node_sets: dict[str, np.ndarray] = {}
    element_sets = {str(property_id): np.array(members) for property_id, members in properties.items()}
    for card in by_name.get("SET1", []):
        name = f"set{card.integer(0)}"
        members = np.array(card.listed(1), np.int64)
        node_sets[name] = np.intersect1d(np.concatenate([node_sets.get(name, members[:0]), members]), labels)
    for card in by_name.get("SET3", []):
        name, members = f"set{card.integer(0)}", np.array(card.listed(2), np.int64)
        if card.text(1).upper().startswith("GRID"):
            node_sets[name] = np.intersect1d(members, labels)
        elif card.text(1).upper().startswith("ELEM"):
            element_sets[name] = members
    couplings, links, coupled = rigid_elements(by_name)
    directions = grids.directions()
    chosen = chosen_equations(path)
    masses, sums = read_masses(by_name, grids), read_sums(by_name, grids, chosen)
    idle = (
        []
        if chosen is None or by_name.get("MPCADD")
        else [c for c in by_name.get("MPC", []) if c.integer(0) not in chosen]
    )
    by_name["MPC"] = [card for card in by_name.get("MPC", []) if card not in idle]
    dependent = [n for name in coupled if name.startswith("rbe2") for n in coupled[name]]
    node_sets |= {name: np.intersect1d(np.array(m, np.int64), labels) for name, m in coupled.items()}
    passive = [
        Omission("MPC", card.source, "a set of equations that no case chooses", alters=False) for card in idle[:1]
    ]
    deck = deck_of(
        labels, points, blocks, path, node_sets=node_sets, element_sets=element_sets, couplings=couplings,
        links=links, masses=masses, sums=sums, directions=directions, dependent=np.array(dependent, np.int64),
        materials=_materials(by_name), sections=_sections(by_name, grids),
        omissions=[*_omissions(by_name, {item.source for item in (*couplings, *links, *masses, *sums)}), *passive],
    )  # fmt: skip
    return with_retained(deck, by_name)


def _elements(by_name: Mapping[str, list[Card]]) -> tuple[list[Block], dict[int, list[int]]]:
    """Return the elements, and those of each property; mid-edge nodes may be blank."""
    blocks: list[Block] = []
    properties: dict[int, list[int]] = {}
    integrated = {card.integer(0): _integration(card) for card in by_name.get("PSOLID", [])}
    for name, choices in CARDS.items():
        rows: dict[tuple[str, str], list[list[int]]] = {}
        for card in by_name.get(name, []):
            cell, row = _element(card, choices)
            label = card.integer(1, row[0])
            kind = integrated.get(label, BUBBLES) if name == "CHEXA" else ""
            rows.setdefault((cell, f"{name}{kind}"), []).append(row)
            properties.setdefault(label, []).append(row[0])
        for (cell, kind), table in rows.items():
            data = np.array(table, np.int64)
            blocks.append(Block(CELLS[cell], data[:, 0], data[:, 1:], kind))
    return blocks, properties


def _integration(card: Card) -> str:
    """Return how hexahedra of a PSOLID are integrated: by its fields IN and ISOP."""
    points, shear = card.text(3).upper(), card.text(5).upper()
    if points in ("2", "TWO"):
        return TWO_POINTS
    return "" if shear in ("1", "FULL") else BUBBLES


def _element(card: Card, choices: Sequence[Choice]) -> tuple[str, list[int]]:
    """Return the cell of an element, its number and its nodes."""
    label, nodes = card.integer(0), card.fields[2 : 2 + choices[-1][1]]
    cell, count, order = next((c for c in choices if len(nodes) <= c[1]), choices[-1])
    corners, solid = CELLS[cell].shape.corners, card.name not in SHELLS
    if len(nodes) < corners or (solid and any(card.fields[2 + count :])):
        allowed = " or ".join(str(c[1]) for c in choices)
        raise card.source.error(f"{card.name} {label} has {max(len(card.fields) - 2, 0)} nodes, allowed: {allowed}")
    if not all(nodes[:corners]):
        raise card.source.error(f"{card.name} {label} has a blank among its corners")
    numbers = [card.integer(k + 2, MISSING) for k in range(len(nodes))] + [MISSING] * (count - len(nodes))
    return cell, [label, *([numbers[k] for k in order] if order else numbers)]


def _omissions(by_name: Mapping[str, list[Card]], taken: Set[Source | None]) -> list[Omission]:
    """Return what is not taken over, by the card where each kind begins; `taken` are the lines that are."""
    omissions = []
    structural = {card.integer(0, 0) for name in SHELL_PROPERTIES for card in by_name.get(name, [])}
    for name, cards in by_name.items():
        used = [card for card in cards if card.integer(1, 0) in structural] if name in SHELLS else cards
        used = [card for card in used if card.source not in taken]
        text = "structural elements" if name in SHELLS else _omitted(name)
        if text and used:
            many = f", {len(used)} cards" if len(used) > 1 else ""
            omissions.append(Omission(name, used[0].source, f"{text}{many}"))
        elif LOADS.fullmatch(name):
            text = "supports, loads and contacts are the scene's"
            omissions.append(Omission(name, cards[0].source, text, alters=False))
    return omissions


def _omitted(name: str) -> str:
    """Return what cards of a name are that alter a body and are not read; empty of others."""
    if name in CARDS or HARMLESS.fullmatch(name):
        return ""
    if name.startswith(RIGID):
        return "a rigid element"
    if name.startswith(("CONM", "CMASS")):
        return "a mass"
    return ALTERING.get(name, "elements that are no solids" if name[0] == "C" else "")


def _isotropic(by_name: Mapping[str, list[Card]]) -> list[tuple[Card, dict[str, float]]]:
    """Return the constants of each MAT1."""
    materials = []
    for card in by_name.get("MAT1", []):
        E, G, nu, rho = (card.real(k) if card.text(k) else None for k in (1, 2, 3, 4))
        if nu is None and E and G:
            nu = E / (2 * G) - 1
        constants = {"E": E, "nu": nu, "rho": None if rho is None else rho * mass_factor(by_name)}
        materials.append((card, {key: value for key, value in constants.items() if value is not None}))
    return materials


def _materials(by_name: Mapping[str, list[Card]]) -> list[tuple[Source, dict[str, float]]]:
    materials = [(card.source, constants) for card, constants in _isotropic(by_name)]
    materials += [(card.source, {"anisotropic": 1.0}) for n in ("MAT9", "MAT11") for card in by_name.get(n, [])]
    return materials


def _sections(by_name: Mapping[str, list[Card]], grids: Grids) -> list[Section]:
    """Return the material of the elements of each PSOLID, of MAT1 or of an orthotropic MAT9."""
    isotropic = {card.integer(0): constants for card, constants in _isotropic(by_name)}
    anisotropic = {card.integer(0): card for card in by_name.get("MAT9", [])}
    sections = []
    for card in by_name.get("PSOLID", []):
        material, system = card.integer(1, 0), card.integer(2, 0)
        name = str(card.integer(0))
        if material in isotropic:
            sections.append(Section(name, card.source, isotropic[material], None, np.eye(3)))
        elif material in anisotropic:
            rho = anisotropic[material].real(22) * mass_factor(by_name)
            plain = system >= 0 and grids.rectangular(system)
            axes = grids.axes_at(system, np.zeros(3), card.source) if plain else None
            sections.append(Section(name, card.source, {"rho": rho, "anisotropic": 1.0},
                                    _orthotropic(anisotropic[material]), axes))  # fmt: skip
    return sections


def _orthotropic(card: Card) -> dict[str, tuple[float, ...]] | None:
    """Return the constants of a MAT9 whose shears are shears; its directions are 11, 22, 33, 12, 23, 31."""
    G = np.zeros((6, 6))
    upper = zip(*np.triu_indices(6), strict=True)
    for k, (i, j) in enumerate(upper):
        G[i, j] = G[j, i] = card.real(1 + k)
    shears = G.copy()
    shears[:3, :3] = 0.0
    if np.abs(shears - np.diag(np.diag(shears))).max() > SAME * np.abs(G).max():
        return None
    return engineering_constants(G[:3, :3], (G[3, 3], G[5, 5], G[4, 4]))
