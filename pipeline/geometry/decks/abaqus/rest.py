"""What decks of Abaqus and CalculiX say beside a mesh: masses, couplings, springs, materials, steps."""

import re
from collections.abc import Mapping, Sequence

import numpy as np

from gudgeon.pipeline.geometry.decks.abaqus.keywords import Keyword
from gudgeon.pipeline.geometry.decks.abaqus.links import Links
from gudgeon.pipeline.geometry.decks.abaqus.sets import Named, Sets
from gudgeon.pipeline.geometry.decks.model import Block, Coupling, Omission, PointMass, Source

ALTERING = {
    "MASS": "a point mass", "ROTARY INERTIA": "a rotary inertia", "NONSTRUCTURAL MASS": "a mass without volume",
    "SPRING": "a spring", "DASHPOT": "a damper", "JOINT": "a joint", "GAP": "a gap", "EQUATION": "an equation",
    "MPC": "a constraint of several points", "TIE": "a tie of two surfaces", "EMBEDDED ELEMENT": "embedded elements",
    "CONNECTOR SECTION": "a connector", "FASTENER": "fasteners", "SHELL TO SOLID COUPLING": "a coupling",
    "COUPLING": "a coupling", "KINEMATIC COUPLING": "a coupling", "DISTRIBUTING COUPLING": "a coupling",
    "DISTRIBUTED COUPLING": "a coupling", "RIGID BODY": "a rigid part", "PRE-TENSION SECTION": "a bolt's pretension",
    "CYCLIC SYMMETRY MODEL": "a sector's symmetry", "USER ELEMENT": "an element of another program",
    "UEL PROPERTY": "an element of another program", "MATRIX INPUT": "a matrix", "MATRIX ASSEMBLE": "a matrix",
    "SUBSTRUCTURE PROPERTY": "a substructure", "SYMMETRIC MODEL GENERATION": "nodes that no line lists",
    "REBAR": "reinforcement", "REBAR LAYER": "reinforcement", "IMPERFECTION": "moved nodes", "RELEASE": "a release",
    "COHESIVE SECTION": "cohesive elements", "GASKET SECTION": "gaskets", "INERTIA RELIEF": "inertia relief",
    "MODEL CHANGE": "elements that are removed", "GEOMETRIC STIFFNESS": "a stiffness of stress",
}  # fmt: skip
"""Keywords without which a body has another mass or stiffness, and what they are."""
LOADS = {"BOUNDARY", "INITIAL CONDITIONS", "STEP", "CONTACT PAIR", "CONTACT", "CLOAD", "DLOAD", "TEMPERATURE"}
"""Keywords of supports, loads, contact and steps, which a scene states itself."""
SILENT = {
    "ACOUSTIC MEDIUM", "AMPLITUDE", "ANISOTROPIC HYPERELASTIC", "ANNEAL TEMPERATURE", "ASSEMBLY",
    "BASELINE CORRECTION", "BEAM GENERAL SECTION", "BEAM SECTION", "BIAXIAL TEST DATA", "BULK VISCOSITY",
    "CAP PLASTICITY", "CAST IRON PLASTICITY", "CAVITY DEFINITION", "CHANGE FRICTION", "CLEARANCE",
    "COHESIVE BEHAVIOR", "COMBINED TEST DATA", "COMPRESSION HARDENING", "CONCRETE", "CONDUCTIVITY",
    "CONNECTOR BEHAVIOR", "CONNECTOR DAMPING", "CONNECTOR ELASTICITY", "CONSTRAINT CONTROLS", "CONTACT CONTROLS",
    "CONTACT CONTROLS ASSIGNMENT", "CONTACT DAMPING", "CONTACT EXCLUSIONS", "CONTACT FILE", "CONTACT FORMULATION",
    "CONTACT INCLUSIONS", "CONTACT INITIALIZATION ASSIGNMENT", "CONTACT INITIALIZATION DATA", "CONTACT OUTPUT",
    "CONTACT PRINT", "CONTACT PROPERTY ASSIGNMENT", "CONTACT STABILIZATION", "CORRELATION", "CREEP", "CRUSHABLE FOAM",
    "CRYSTAL", "CYCLIC HARDENING", "DAMAGE EVOLUTION", "DAMAGE INITIATION", "DAMPING", "DEFORMATION PLASTICITY",
    "DENSITY", "DEPVAR", "DESIGNVARIABLES", "DIFFUSIVITY", "DISCRETE SECTION", "DISPLAY BODY", "DISTRIBUTING",
    "DISTRIBUTION", "DISTRIBUTION TABLE", "DRUCKER PRAGER", "DRUCKER PRAGER HARDENING",
    "DYNAMIC TEMPERATURE-DISPLACEMENT", "EL FILE", "EL PRINT", "ELASTIC", "ELECTRICAL CONDUCTIVITY", "ELEMENT OUTPUT",
    "END ASSEMBLY", "END LOAD CASE", "END STEP", "ENERGY FILE", "ENERGY OUTPUT", "ENERGY PRINT", "EOS", "EXPANSION",
    "FAIL STRAIN", "FAIL STRESS", "FILE FORMAT", "FILE OUTPUT", "FILTER", "FLUID CONSTANTS", "FLUID SECTION",
    "FRICTION", "GAP CONDUCTANCE", "GAP HEAT GENERATION", "HCF", "HEADING", "HEAT GENERATION", "HOURGLASS STIFFNESS",
    "HYPERELASTIC", "HYPERFOAM", "HYSTERESIS", "INELASTIC HEAT FRACTION", "INTEGRATED OUTPUT",
    "INTEGRATED OUTPUT SECTION", "KINEMATIC", "LATENT HEAT", "MAGNETIC PERMEABILITY", "MAGNETIZATION", "MATERIAL",
    "MEMBRANE SECTION", "MODEL DEFINITION", "MOHR COULOMB", "MOHR COULOMB HARDENING", "MONITOR", "MULLINS EFFECT",
    "NO COMPRESSION", "NO TENSION", "NODAL THICKNESS", "NODE FILE", "NODE OUTPUT", "NODE PRINT", "NORMAL",
    "ORIENTATION", "OUTPUT", "PARTICLE GENERATOR", "PERMEABILITY", "PHYSICAL CONSTANTS", "PLANAR TEST DATA",
    "PLASTIC", "POROUS METAL PLASTICITY", "POTENTIAL", "PRE-TENSION", "PREPRINT", "PRINT", "PROBABILITY",
    "RATE DEPENDENT", "REFINE MESH", "REGULARIZATION", "RESTART", "SECTION", "SECTION CONTROLS", "SECTION FILE",
    "SECTION PRINT", "SHEAR FAILURE", "SHELL GENERAL SECTION", "SHELL SECTION", "SIMPLE SHEAR TEST DATA",
    "SOLID SECTION", "SOLUBILITY", "SPECIFIC GAS CONSTANT", "SPECIFIC HEAT", "SPECTRUM", "SURFACE BEHAVIOR",
    "SURFACE FLAW", "SURFACE INTERACTION", "SURFACE PROPERTY ASSIGNMENT", "SURFACE SECTION", "SURFACE TENSION",
    "SWELLING", "TENSILE FAILURE", "TENSION STIFFENING", "TIME POINTS", "TRANSFORM", "TRANSVERSE SHEAR",
    "TRANSVERSE SHEAR STIFFNESS", "TRS", "UNIAXIAL TEST DATA", "USER MATERIAL", "USER OUTPUT VARIABLES",
    "VALUES AT INFINITY", "VIEWFACTOR", "VISCO", "VISCOELASTIC", "VISCOUS", "VOLUMETRIC TEST DATA",
    "WAVEFRONT MINIMIZATION",
}  # fmt: skip
"""Keywords of materials, sections and output, which alter no mesh; materials are the scene's."""
PROPERTY_DRIVEN = re.compile(r"MASS|ROTARYI|SPRING\w*|DASHPOT\w*|CONN\w*|GAP\w*|DCOUP\w*|JOINT\w*|D?COUP\w*")
"""Types of elements whose keyword of properties says what they are."""
SECTIONS = {"SHELL SECTION", "SHELL GENERAL SECTION", "MEMBRANE SECTION", "BEAM SECTION", "BEAM GENERAL SECTION"}
"""Sections that make faces and lines structural."""
PLANE = re.compile(r"(CPS|CPE|CAX|SFM3D).*")
"""Faces that have no stiffness among solids."""
DIRECTIONS = 3
"""Translations that a kinematic coupling of solids has to carry along."""


class Rest:
    """What a body of a deck says beside its mesh, gathered keyword by keyword."""

    def __init__(self) -> None:
        self._omissions: list[Omission] = []
        self._faces: list[tuple[str, np.ndarray, Source]] = []
        self._sections: set[str] = set()
        self._step = False
        self._open: Keyword | None = None
        self._couplings: list[tuple[Coupling, str, Source]] = []
        self._listed: dict[str, list[str]] = {}
        self._equations: list[str] = []
        self._mass_nodes: dict[int, int] = {}
        self._masses: list[Keyword] = []
        self.links = Links()
        self.materials: list[tuple[Source, dict[str, float]]] = []

    def take(self, keyword: Keyword) -> None:
        """Take a keyword that is no node, element, set or surface.

        Raises:
            InputError: an option or a line of data is wrong.
        """
        name = keyword.name
        if self._step or name == "STEP":
            if name == "STEP" and not self._step:
                self._omit(keyword, "loads, supports and analyses are the scene's", alters=False)
            self._step = name != "END STEP"
            return
        if name == "CONTACT PAIR" and "TIED" in keyword.options:
            self._omit(keyword, "a tie of two surfaces", name="CONTACT PAIR, TIED")
        elif name in LOADS:
            self._omit(keyword, "supports, loads and contacts are the scene's", alters=False)
        elif name in ALTERING:
            self._omit(keyword, ALTERING[name])
        elif name not in SILENT:
            self._omit(keyword, "is not known here")
        self._material(keyword)
        self._couple(keyword)
        self.links.take(keyword)
        if name == "MASS" and "TYPE" not in keyword.options and keyword.rows:
            self._masses.append(keyword)
        if name in SECTIONS or (name == "SOLID SECTION"):
            self._sections.add(keyword.options.get("ELSET", "").casefold())

    def structural(self, keyword: Keyword, kind: str) -> list[int]:
        """Take elements of a type without cells; return their numbers."""
        if not PROPERTY_DRIVEN.fullmatch(kind):
            self._omit(keyword, f"elements of TYPE={kind}", name=kind)
        rows = [row.integers() for row in keyword.rows if row.text[:1].isdigit()]
        if kind == "MASS":
            self._mass_nodes |= {row[0]: row[1] for row in rows if len(row) > 1}
        self.links.add_elements(kind, rows)
        return [row[0] for row in rows]

    def faces(self, keyword: Keyword, kind: str) -> None:
        """Take faces or lines, which are structural if a section names their set."""
        if not PLANE.fullmatch(kind) and (name := keyword.options.get("ELSET")):
            self._faces.append((kind, np.array([name.casefold()]), keyword.source))

    def omissions(self, element_sets: Mapping[str, np.ndarray]) -> list[Omission]:
        """Return what is not taken over."""
        structural = [
            Omission(kind, source, f"structural elements of TYPE={kind}, which a section names")
            for kind, names, source in self._faces
            if self._sections & set(names.tolist())
        ]
        return [*self._omissions, *structural]

    def masses(self, element_sets: Mapping[str, np.ndarray]) -> list[PointMass]:
        """Return the masses of elements of TYPE=MASS."""
        labels = {name.casefold(): members.tolist() for name, members in element_sets.items()}
        return [
            PointMass(self._mass_nodes[label], keyword.rows[0].reals()[0], "MASS", keyword.source)
            for keyword in self._masses
            for label in labels.get(keyword.option("ELSET").casefold(), [])
            if label in self._mass_nodes
        ]

    def couplings(self, sets: Sets, flat: bool) -> tuple[list[Coupling], dict[str, list[str]]]:
        """Return couplings whose reference node has a number, and the nodes of those that list them."""
        if not flat:
            return [], {}
        couplings = []
        for coupling, reference, source in self._couplings:
            if not reference.isdigit():
                raise source.error(f"REF NODE={reference} of '{coupling.name}'; allowed: the number of a node")
            surface = sets.nodes.spelled(coupling.surface)
            couplings.append(coupling._replace(surface=surface, reference=int(reference)))
        return couplings, self._listed

    def dependent(
        self, nodes: Mapping[str, np.ndarray], sides: Mapping[str, np.ndarray], blocks: Sequence[Block],
        couplings: Sequence[Coupling],
    ) -> np.ndarray:  # fmt: skip
        """Return labels of the nodes that couplings and equations express by others."""
        labels = [np.array([int(word) for word in self._equations if word.isdigit()], np.int64)]
        labels += [nodes.get(word, np.empty(0, np.int64)) for word in self._equations if not word.isdigit()]
        for coupling in couplings:
            if coupling.tie == "rbe3":
                labels.append(np.array([coupling.reference]))
            elif coupling.surface in sides:
                labels.append(nodes_of_sides(sides[coupling.surface], blocks))
            else:
                labels.append(nodes.get(coupling.surface, np.empty(0, np.int64)))
        return np.unique(np.concatenate(labels))

    def _omit(self, keyword: Keyword, text: str, name: str = "", *, alters: bool = True) -> None:
        self._omissions.append(Omission(name or keyword.name, keyword.source, text, alters))

    def _material(self, keyword: Keyword) -> None:
        if keyword.name == "MATERIAL":
            self.materials.append((keyword.source, {}))
        elif self.materials and keyword.rows and keyword.name in ("ELASTIC", "DENSITY"):
            values, constants = keyword.rows[0].reals(), self.materials[-1][1]
            if keyword.name == "DENSITY":
                constants["rho"] = values[0]
            elif keyword.options.get("TYPE", "ISO").upper().startswith("ISO"):
                constants |= dict(zip(("E", "nu"), values, strict=False))
            else:
                constants["anisotropic"] = 1.0

    def _couple(self, keyword: Keyword) -> None:
        name, options = keyword.name, keyword.options
        if name == "COUPLING":
            self._open = keyword
        elif name in ("KINEMATIC", "DISTRIBUTING") and self._open is not None:
            self._close(keyword, self._open)
        elif name == "RIGID BODY":
            members = options.get("NSET") or options.get("TIE NSET") or options.get("ELSET")
            if members is not None and "REF NODE" in options:
                self._lead(members, members, options["REF NODE"], "rbe2", keyword)
        elif name == "KINEMATIC COUPLING":
            label = f"rbe2_{keyword.option('REF NODE')}"
            self._listed[label] = [row.words()[0] for row in keyword.rows]
            self._lead(label, label, options["REF NODE"], "rbe2", keyword, plain=_complete(keyword))
        elif name == "EQUATION":
            self._equations += _dependent(keyword)

    def _close(self, keyword: Keyword, coupling: Keyword) -> None:
        """Take a coupling with the keyword of its kind."""
        self._open = None
        surface, reference = coupling.option("SURFACE"), coupling.option("REF NODE")
        label = coupling.options.get("CONSTRAINT NAME", surface)
        if keyword.name == "DISTRIBUTING" or _whole(keyword):
            tie = "rbe2" if keyword.name == "KINEMATIC" else "rbe3"
            even = keyword.options.get("WEIGHTING METHOD", "UNIFORM").upper() == "UNIFORM"
            plain = even and _whole(keyword) and "INFLUENCE RADIUS" not in coupling.options
            self._lead(label, surface, reference, tie, coupling, plain=plain)

    def _lead(self, name: str, surface: str, reference: str, tie: str, keyword: Keyword, *, plain: bool = True) -> None:
        source = keyword.source if plain else None
        self._couplings.append((Coupling(name, surface, 0, tie, keyword.name, source), reference, keyword.source))


def joined(rests: Sequence[Rest]) -> Rest:
    """Return what several bodies of a deck say, of which the first is the chosen one."""
    total = Rest()
    for extras in rests:
        total._omissions += extras._omissions
        total._faces += extras._faces
        total._sections |= extras._sections
        total._couplings += extras._couplings
        total._listed |= extras._listed
        total._equations += extras._equations
        total.materials += extras.materials
    return total


def nodes_of_sides(sides: np.ndarray, blocks: Sequence[Block]) -> np.ndarray:
    """Return labels of the nodes of faces of elements, ascending.

    Args:
        sides: Pairs of an element's label and the number of its face from 0, (f, 2).
    """
    labels = [np.empty(0, np.int64)]
    for block in blocks:
        for face_id, face in enumerate(block.cell.faces):
            owners = sides[sides[:, 1] == face_id, 0]
            labels.append(block.nodes[np.isin(block.labels, owners)][:, face].ravel())
    return np.unique(np.concatenate(labels))


def _whole(keyword: Keyword) -> bool:
    """Return whether a kinematic coupling carries all translations: `first, last` or single directions a line."""
    carried: set[int] = set()
    for row in keyword.rows:
        ends = [int(word) for word in row.words() if word.isdigit()]
        carried |= set(range(ends[0], min(ends[-1], 6) + 1)) if ends else set()
    return not keyword.rows or carried >= set(range(1, DIRECTIONS + 1))


def _complete(keyword: Keyword) -> bool:
    """Return whether all lines of nodes and directions, `TOP, 1, 3`, carry all translations, which is the default."""
    return all(words[1:] in ([], ["1", "3"], ["1", "6"]) for words in (row.words() for row in keyword.rows))


def _dependent(keyword: Keyword) -> list[str]:
    """Return node or set of the leading term of each equation: number of terms, then node, direction, coefficient."""
    words, i, rows = [], 0, keyword.rows
    while i < len(rows):
        count = rows[i].words()[0]
        if not count.isdigit() or i + 1 >= len(rows):
            raise rows[i].source.error(f"*EQUATION: {rows[i].text[:60]!r}, expected the number of terms")
        words.append(rows[i + 1].words()[0])
        terms, i = 0, i + 1
        while i < len(rows) and terms < int(count):
            terms += len([word for word in rows[i].words() if word]) // 3
            i += 1
    return words


def members_of(named: Named, words: Sequence[str]) -> np.ndarray:
    """Return the labels of numbers and names of sets."""
    sets = {name.casefold(): members for name, members in named.resolved().items()}
    labels = [np.array([int(word) for word in words if word.isdigit()], np.int64)]
    return np.unique(np.concatenate([*labels, *(sets[w.casefold()] for w in words if w.casefold() in sets)]))
