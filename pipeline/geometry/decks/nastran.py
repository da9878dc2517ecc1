"""Bulk data of Nastran (.bdf, .nas, .dat): grid points in their systems, solids, sets, rigid elements.

Own reading. meshio 5 skips coordinate systems, INCLUDE, large fields and continuations by blank fields without a word;
pyyeti, which reads matrices, knows neither INCLUDE nor chains of systems.
"""

import re
from collections.abc import Mapping, Sequence, Set

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import CELLS
from gudgeon.pipeline.geometry.decks.axes import Axes, from_z_x
from gudgeon.pipeline.geometry.decks.bulk import Card, read_cards
from gudgeon.pipeline.geometry.decks.members.bulk_sums import read_sums
from gudgeon.pipeline.geometry.decks.model import (
    MISSING,
    Block,
    Coupling,
    Deck,
    Omission,
    PointMass,
    Scope,
    Source,
    deck_of,
)

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
    labels, points = _Grids(path, by_name).positions()
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
    couplings, coupled = _rigid_elements(by_name)
    masses, sums = _masses(by_name), read_sums(by_name)
    dependent = [n for name in coupled if name.startswith("rbe2") for n in coupled[name]]
    node_sets |= {name: np.intersect1d(np.array(m, np.int64), labels) for name, m in coupled.items()}
    return deck_of(
        labels, points, blocks, path, node_sets=node_sets, element_sets=element_sets, couplings=couplings,
        masses=masses, sums=sums, dependent=np.array(dependent, np.int64), materials=_materials(by_name),
        omissions=_omissions(by_name, {item.source for item in (*couplings, *masses, *sums)}),
    )  # fmt: skip


class _Grids:
    """Grid points and coordinate systems, which may be defined by each other."""

    def __init__(self, path: str, by_name: Mapping[str, list[Card]]) -> None:
        self._path = path
        self._grids: dict[int, Card] = {}
        for card in by_name["GRID"]:
            label = card.integer(0)
            if label in self._grids and card.fields != self._grids[label].fields:
                raise card.source.error(f"GRID {label} is given twice")
            self._grids[label] = card
        default = by_name.get("GRDSET", [])
        self._default = default[0].integer(1, 0) if default else 0
        self._cards: dict[int, tuple[Card, int]] = {}
        for name, cards in by_name.items():
            if not re.fullmatch(r"CORD[12][RCS]", name):
                continue
            for card in cards:
                for start in (0, 4) if name[4] == "1" else (0,):
                    if card.text(start):
                        self._cards[card.integer(start)] = (card, start)
        self._axes: dict[int, Axes] = {0: Axes()}
        self._open: list[int] = []

    def positions(self) -> tuple[np.ndarray, np.ndarray]:
        """Return labels and positions in the basic system of all grid points."""
        labels = np.array(list(self._grids), np.int64)
        raw = np.array([[card.real(k) for k in (2, 3, 4)] for card in self._grids.values()])
        systems = np.array([card.integer(1, self._default) for card in self._grids.values()], np.int64)
        points = np.empty_like(raw)
        for system in np.unique(systems).tolist():
            rows = systems == system
            points[rows] = self._placed(system, raw[rows], next(iter(self._of(system))))
        return labels, points

    def _of(self, system: int) -> list[Source]:
        return [c.source for c in self._grids.values() if c.integer(1, self._default) == system]

    def _placed(self, system: int, points: np.ndarray, source: Source) -> np.ndarray:
        """Return points of a system in the basic one."""
        axes = self._system(system, source)
        kind = self._cards[system][0].name[5] if system else "R"
        if kind == "R":
            return axes.placed(points)
        r, a, b = points[:, 0], np.radians(points[:, 1]), points[:, 2]
        if kind == "C":
            return axes.placed(np.column_stack([r * np.cos(a), r * np.sin(a), b]))
        around = np.radians(b)
        off = r * np.sin(a)
        return axes.placed(np.column_stack([off * np.cos(around), off * np.sin(around), r * np.cos(a)]))

    def _system(self, system: int, source: Source) -> Axes:
        if system in self._axes:
            return self._axes[system]
        if system not in self._cards:
            raise source.error(f"names coordinate system {system}, which the deck does not have (CORD1 or CORD2)")
        card, start = self._cards[system]
        if system in self._open:
            raise card.source.error(f"{card.name} {system} is defined by itself")
        self._open.append(system)
        if card.name[4] == "2":
            corners = np.array([card.real(k) for k in range(2, 11)]).reshape(3, 3)
            a, b, c = self._placed(card.integer(1, 0), corners, card.source)
        else:
            a, b, c = (self._grid(card.integer(start + k), card.source) for k in (1, 2, 3))
        self._open.pop()
        self._axes[system] = from_z_x(a, b - a, c - a, card.source)
        return self._axes[system]

    def _grid(self, label: int, source: Source) -> np.ndarray:
        if label not in self._grids:
            raise source.error(f"names grid point {label}, which the deck does not have")
        card = self._grids[label]
        raw = np.array([[card.real(k) for k in (2, 3, 4)]])
        return self._placed(card.integer(1, self._default), raw, card.source)[0]


def _elements(by_name: Mapping[str, list[Card]]) -> tuple[list[Block], dict[int, list[int]]]:
    """Return the elements, and those of each property; mid-edge nodes may be blank."""
    blocks: list[Block] = []
    properties: dict[int, list[int]] = {}
    for name, choices in CARDS.items():
        rows: dict[str, list[list[int]]] = {}
        for card in by_name.get(name, []):
            cell, row = _element(card, choices)
            rows.setdefault(cell, []).append(row)
            properties.setdefault(card.integer(1, row[0]), []).append(row[0])
        for cell, table in rows.items():
            data = np.array(table, np.int64)
            blocks.append(Block(CELLS[cell], data[:, 0], data[:, 1:], name))
    return blocks, properties


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


def _materials(by_name: Mapping[str, list[Card]]) -> list[tuple[Source, dict[str, float]]]:
    materials: list[tuple[Source, dict[str, float]]] = []
    for card in by_name.get("MAT1", []):
        E, G, nu, rho = (card.real(k) if card.text(k) else None for k in (1, 2, 3, 4))
        if nu is None and E and G:
            nu = E / (2 * G) - 1
        constants = {"E": E, "nu": nu, "rho": rho}
        materials.append((card.source, {key: value for key, value in constants.items() if value is not None}))
    materials += [(card.source, {"anisotropic": 1.0}) for n in ("MAT9", "MAT11") for card in by_name.get(n, [])]
    return materials


def _rigid_elements(by_name: Mapping[str, list[Card]]) -> tuple[list[Coupling], dict[str, list[int]]]:
    """Return RBE2 and RBE3 cards as couplings, and their grid points by names `rbe2_EID` and `rbe3_EID`.

    An RBE2 that does not carry all translations is none.
    """
    couplings, sets = [], {}
    for card in by_name.get("RBE2", []):
        if {"1", "2", "3"} <= set(card.text(2)):
            name = f"rbe2_{card.integer(0)}"
            members = [f for f in card.fields[3:] if "." not in f]
            sets[name] = card._replace(fields=members).listed(0)
            couplings.append(Coupling(name, name, card.integer(1), "rbe2", "RBE2", card.source))
    for card in by_name.get("RBE3", []):
        name, members, weights, k = f"rbe3_{card.integer(0)}", list[int](), set[tuple[float, str]](), 4
        while k < len(card.fields) and "." in card.text(k):
            weights.add((card.real(k), card.text(k + 1)))
            k += 2  # A weight and its directions, then the grid points.
            while k < len(card.fields) and (not card.text(k) or card.text(k).isdigit()):
                members += [card.integer(k)] if card.text(k) else []
                k += 1
        sets[name] = members
        couplings.append(
            Coupling(name, name, card.integer(2), "rbe3", "RBE3", card.source if _mean(card, weights) else None)
        )
    return couplings, sets


def _mean(card: Card, weights: Set[tuple[float, str]]) -> bool:
    """Return whether the point of an RBE3 has the plain mean motion of its grid points, by their translations."""
    return len(weights) == 1 and all({"1", "2", "3"} <= set(text) for text in (card.text(3), *(t for _, t in weights)))


def _masses(by_name: Mapping[str, list[Card]]) -> list[PointMass]:
    """Return the masses of CONM2 cards without offset and inertia; none where WTMASS scales them."""
    if any(card.text(0).upper() == "WTMASS" for card in by_name.get("PARAM", [])):
        return []
    return [
        PointMass(card.integer(1), card.real(3), "CONM2", card.source)
        for card in by_name.get("CONM2", [])
        if not any(card.real(k) for k in range(2, len(card.fields)) if k != 3 and card.text(k))
    ]
