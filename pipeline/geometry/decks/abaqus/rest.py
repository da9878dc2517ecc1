"""What decks of Abaqus and CalculiX say beside a mesh: masses, couplings, springs, materials, steps."""

import re
from collections.abc import Mapping, Sequence

import numpy as np

from gudgeon.pipeline.geometry.decks.abaqus.keywords import Keyword
from gudgeon.pipeline.geometry.decks.abaqus.materials import Materials
from gudgeon.pipeline.geometry.decks.abaqus.members import Stated
from gudgeon.pipeline.geometry.decks.model import Block, Omission, Source

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


class Rest:
    """What a body of a deck says beside its mesh, gathered keyword by keyword."""

    def __init__(self) -> None:
        self._omissions: list[Omission] = []
        self._faces: list[tuple[str, np.ndarray, Source]] = []
        self._sections: set[str] = set()
        """Names of sets of elements, folded."""
        self._step = False
        self.stated = Stated()
        self.materials = Materials()

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
        if name == "SURFACE SECTION" and "DENSITY" in keyword.options:
            self._omit(keyword, "a mass by area")
        self.materials.take(keyword)
        self.stated.take(keyword)
        if name in SECTIONS or (name == "SOLID SECTION"):
            self._sections.add(keyword.options.get("ELSET", "").casefold())

    def structural(self, keyword: Keyword, kind: str) -> list[int]:
        """Take elements of a type without cells; return their numbers."""
        if not PROPERTY_DRIVEN.fullmatch(kind):
            self._omit(keyword, f"elements of TYPE={kind}", name=kind)
        rows = [row for row in keyword.rows if row.text[:1].isdigit()]
        self.stated.add_elements(kind, rows)
        return [row._replace(text=row.words()[0]).integers()[0] for row in rows]

    def faces(self, keyword: Keyword, kind: str, labels: Sequence[int]) -> None:
        """Take faces or lines, which are structural if a section names a set of theirs."""
        if not PLANE.fullmatch(kind):
            self._faces.append((kind, np.array(labels, np.int64), keyword.source))

    def omissions(self, element_sets: Mapping[str, np.ndarray]) -> list[Omission]:
        """Return what is not taken over."""
        chosen = [members for name, members in element_sets.items() if name.casefold() in self._sections]
        members = np.concatenate([np.empty(0, np.int64), *chosen])
        structural = [
            Omission(kind, source, f"structural elements of TYPE={kind}, which a section names")
            for kind, labels, source in self._faces
            if np.isin(labels, members).any()
        ]
        return [*self._omissions, *structural]

    def _omit(self, keyword: Keyword, text: str, name: str = "", *, alters: bool = True) -> None:
        self._omissions.append(Omission(name or keyword.name, keyword.source, text, alters))


def joined(rests: Sequence[Rest]) -> Rest:
    """Return what several bodies of a deck say, of which the first is the chosen one."""
    total = Rest()
    for extras in rests:
        total._omissions += extras._omissions
        total._faces += extras._faces
        total._sections |= extras._sections
        total.materials.add(extras.materials)
    total.materials.assigned(rests[0].materials)
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
