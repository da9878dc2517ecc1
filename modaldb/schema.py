"""The records: the only vocabulary that pipeline and solver share.

Every record is a frozen dataclass of arrays, numbers, texts and named groups of these; `modaldb.hdf5` writes and
reads them field by field, so that a reader can ask for less than the whole. All quantities are SI. Shapes use:
n nodes, e cells, m elastic coordinates, c contact rows of an interface, s samples, f frames.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

SCHEMA_VERSION = 5
READABLE_VERSIONS = (1, 2, 3, 4, 5)
"""A field that an older version lacks takes its default."""

Array = np.ndarray
Json = dict[str, Any]


@dataclass(frozen=True)
class Surface:
    """A named part of a mesh's boundary."""

    facets: Array
    """Node numbers of each facet, corners first: (facets, 6) on tet10, (facets, 3) on triangles with the part on their
    left, (facets, 1) on a line or a rigid body."""
    shape: Json = field(default_factory=dict)
    """The true surface, `{"kind": "cylinder", "radius", "axis", "origin"}` or `{}` where the nodes are all there is."""


@dataclass(frozen=True)
class MeshRecord:
    """Nodes, cells and named surfaces of one component."""

    nodes: Array
    """Nodal positions [m], (n, 3)."""
    cells: Array
    """Node numbers of each cell in meshio's order, (e, 10), (e, 6), (e, 3), (e, 2) or (e, 1)."""
    cell_type: str
    """`tetra10`; `triangle6`, a plane part in z = 0; `line3`, a bar; `beam2` and `beam3`, a beam;
    `vertex`, a rigid body without mesh."""
    surfaces: dict[str, Surface]


@dataclass(frozen=True)
class InterfaceModes:
    """What a contact needs of a body: one row per contact point of a named interface."""

    nodes: Array
    """Node number of each contact point, (c,)."""
    points: Array
    """Contact points on the true surface [m], (c, 3)."""
    normals: Array
    """Outward unit normals of the true surface, (c, 3)."""
    areas: Array
    """Tributary areas [m^2], (c,)."""
    edge: Array
    """Whether a point borders on surface that is not part of the interface, (c,); contact there may go on beyond."""
    rows: Array
    """B Φ: outward normal displacement per unit of each elastic coordinate [kg^-½], (c, m)."""


@dataclass(frozen=True)
class TractionModes:
    """A smooth traction space on a surface that many points slide over: tensor products of uniform cubic B-splines.

    Function a = i·counts[1] + j is the product of the i-th spline across and the j-th along, N_a; its traction is
    N_a / ∫ N_a dA, of unit resultant. See `modaldb.traction` for chart and splines.
    """

    chart: Json
    """What `across` and `along` mean: `{"kind": "cylinder", "axis", "origin", "radius", "middle"}` or
    `{"kind": "plane", "origin", "normal", "across", "along"}`."""
    start: Array
    """Least coordinates of the space, across and along [m], (2,)."""
    spacing: Array
    """Knot spacing across and along [m], (2,)."""
    counts: Array
    """Number of splines across and along, f = their product, (2,)."""
    rows: Array
    """B Φ: mean outward normal displacement under each traction per unit of each elastic coordinate [kg^-½], (f, m)."""
    resultant: Array
    """Force and moment about the component's origin of each unit traction along the outward normal [1, m], (f, 6)."""


@dataclass(frozen=True)
class LoadModes:
    """A load that is no contact, or a point that a joint holds: k generalised forces and their displacements."""

    rows: Array
    """B Φ: displacement conjugate to each force per unit of each elastic coordinate, (k, m)."""
    resultant: Array
    """Force and moment about the component's origin per unit, (k, 6)."""
    point: Array
    """Where it acts: the mean of its surface, or the reference point of a tie [m], (3,)."""
    unit: str
    """Of the generalised force: `N` of a mean's three, `N, N m` on a tie's reference point, `Pa` of a pressure."""


@dataclass(frozen=True)
class GaugeModes:
    """A place where stress or strain is read: value = rows q + residual λ, k values.

    k = 1 is the bending stress of a beam; k = 6 are the components xx, yy, zz, xy, yz, zx of a tensor at a point, shear
    strain as ε_xy and not γ_xy; k = 6 s are these at s nodes of a surface, node by node.
    """

    rows: Array
    """Value per unit of each elastic coordinate, (k, m)."""
    residual: Array
    """Quasi-static value per unit force of each row of R, what the kept coordinates lack, (k, C); (k, 0) of a surface
    where the recipe makes no R."""
    unit: str
    """Of the value, `Pa` or `1`."""
    nodes: Array | None = None
    """Node numbers of a surface, (s,), ascending; None of a place."""


@dataclass(frozen=True)
class InertiaCouplings:
    """Constant tensors of the nodal floating frame from the consistent mass (Zwölfer & Gerstmayr 2020)."""

    translation: Array
    """Tᵀ M Φ [kg^½], (3, m); zero for free-free modes."""
    rotation: Array
    """x̃ᵀ M Φ about the centre of mass [kg^½ m], (3, m); zero for free-free modes."""
    rotation_gradient: Array
    """∂(ũᵀ M Φ)/∂q [1], (3, m, m), antisymmetric in the last two."""


@dataclass(frozen=True)
class ModalRecord:
    """Elastic coordinates of one component: Φᵀ M Φ = I, Φᵀ K Φ = diag(ω²)."""

    mesh_key: str
    recipe: str
    normal_count: int
    static_count: int
    angular_frequencies: Array
    """ω [rad/s], (m,): normal modes first, then the static correction shapes' own."""
    mass: float
    """[kg]"""
    centre: Array
    """Centre of mass [m], (3,)."""
    inertia: Array
    """Inertia about the centre of mass [kg m^2], (3, 3)."""
    rigid_twists: Array
    """Mass-normalised rigid motions (translation, rotation about the centre) [kg^-½, kg^-½ m^-1], (r, 6)."""
    interfaces: dict[str, InterfaceModes]
    interface_rows: Json
    """First and last + 1 row of each interface, traction space and load in the residual flexibility."""
    residual_flexibility: Array | None
    """R = B (G − Φ Λ⁻¹ Φᵀ) Bᵀ [m/N] over the rows of all interfaces, (C, C), symmetric positive semidefinite; None
    where the recipe makes none."""
    shapes: Array | None
    """Φ, nodal displacement per unit of each elastic coordinate, (n, 3, m)."""
    inertia_couplings: InertiaCouplings | None
    quality: Json
    """What the extraction verified of itself: residuals, orthogonality, inertia count, dropped shapes."""
    tractions: dict[str, TractionModes] = field(default_factory=dict)
    """Traction spaces by interface; their rows in R stand in `interface_rows`."""
    loads: dict[str, LoadModes] = field(default_factory=dict)
    """Loads by interface; their rows in R stand in `interface_rows`."""
    gauges: dict[str, GaugeModes] = field(default_factory=dict)
    residuals: Array | None = None
    """‖KΦ − MΦω²‖ / ‖KΦ‖ of each coordinate over the free dofs, (m,): round-off of a normal mode, what a Ritz
    vector lacks of being one; None in records before version 4."""
    algebraic_errors: Array | None = None
    """Bound on |δω|/ω of each coordinate against the nearest exact frequency of the same mesh, (m,)."""
    discretisation_errors: Array | None = None
    """Estimate of (ω − ω_exact)/ω of each normal mode, what a finer mesh would take off, (m,); NaN for static shapes
    and Ritz vectors; None where the elements have no estimate."""
    participation: Array | None = None
    """Tᵀ M Φ with T the unit translations [kg^½], (3, m): what gravity does to each coordinate; None where nothing is
    held, as free modes take no part in translations."""


@dataclass(frozen=True)
class MorphRecord:
    """One design of a component: where its nodes and contact points stand, and which modes serve it."""

    mesh_key: str
    modes_key: str
    rung: str
    """`none`, `reuse` or `recompute`."""
    points: dict[str, Array]
    """Contact points of each interface in this design [m], (c, 3)."""
    mass: float
    centre: Array
    inertia: Array
    rigid_twists: Array
    """As in ModalRecord, always recomputed for this design."""
    nodes: Array | None
    """Nodal positions of this design [m], (n, 3); None where nothing moved."""
    quality: Json


@dataclass(frozen=True)
class ContactHistory:
    """One contact over time."""

    body: str
    interface: str
    force: Array
    """Resultant on the body, mean over each sample interval, so that its sum × interval is the impulse [N], (s, 3)."""
    multipliers: Array
    """Contact force of each point at each frame [N], (f, c)."""
    areas: Array | None
    """Tributary areas [m^2], (c,); None where the scene did not need them."""
    points: Array
    """Contact points in the body's own design position [m], (c, 3)."""
    master: Array | None = None
    """Where another body's traction space is touched: mean outward normal displacement under each of its functions at
    each frame [m], (f, functions)."""


@dataclass(frozen=True)
class JointHistory:
    """One joint over time."""

    body: str
    interface: str
    angle: Array
    """Of the crank, from its upper dead centre, at the end of each sample interval [rad], (s,)."""
    force: Array
    """On the body, mean over each sample interval [N], (s, 3)."""
    violation: Array
    """Length error at the end of each sample interval [m], (s,)."""


@dataclass(frozen=True)
class Trajectory:
    """What a simulation found."""

    result: str
    """A member name of `solver.Result`."""
    bodies: dict[str, str]
    """Key of each body's MorphRecord."""
    coordinate_offsets: Json
    """First coordinate of each body: its rigid ones (as many as its rigid twists), then its elastic ones."""
    times: Array
    """Ends of the sample intervals [s], (s,)."""
    energies: Array
    """Kinetic, strain, contact (½ λᵀCλ) and dissipated energy, and the work of loads and joints so far, at the end of
    each interval [J], (s, 5); without the work in version 1, (s, 4)."""
    contacts: dict[str, ContactHistory]
    frame_times: Array
    """[s], (f,)"""
    frames: Array
    """All coordinates at each frame [m kg^½], (f, coordinates)."""
    velocities: Array
    """All velocities at each frame [m kg^½/s], (f, coordinates)."""
    quantities: Json
    """name → {"value", "unit"}."""
    energy_drift: float
    momentum_residual: float
    counts: Json
    """Steps, substeps per given step, steps in contact, pivots, coordinates, bytes read."""
    joints: dict[str, JointHistory] = field(default_factory=dict)
    motion: dict[str, Array] = field(default_factory=dict)
    """Rigid motion of each body at the end of each sample interval: translation and rotation of the centre of mass
    since the start [m, rad], their rates [m/s, rad/s], (s, 12)."""
    episodes: dict[str, Array] = field(default_factory=dict)
    """Contact by contact, each blow: first and last time [s], impulse [N s], largest force [N], its time [s], closing
    speed at the first time and opening speed at the last [m/s], (b, 7); empty where the integrator locates none."""
    gauges: dict[str, Array] = field(default_factory=dict)
    """`body.gauge` → value at the end of each sample interval, (s, k)."""


@dataclass(frozen=True)
class NodalRecord:
    """A run of the nodal synthesis. s: steps."""

    step: float
    """[s]"""
    times: Array
    """Ends of the steps [s], (s,)."""
    force: Array
    """Mean resultant on the body over each step [N], (s, 3)."""
    energies: Array
    """Kinetic, strain, contact [J], (s, 3)."""
    energy_drift: float
    coordinates: int
    newton_iterations: int
    wall_seconds: float
    cpu_seconds: float
    forces: dict[str, Array] = field(default_factory=dict)
    """Mean resultant on the body over each step, by contact and joint [N], (s, 3); `force` is the contacts' sum."""
    motion: dict[str, Array] = field(default_factory=dict)
    """As in Trajectory, at the end of each step, (s, 12)."""
    frame_times: Array | None = None
    """[s], (f,)"""
    masters: dict[str, Array] = field(default_factory=dict)
    """As ContactHistory.master, by contact, (f, functions)."""
    quantities: Json = field(default_factory=dict)
    """As in Trajectory, where they have the same definition."""


@dataclass(frozen=True)
class CyclicHarmonic:
    """Elastic modes of one harmonic n of a wheel of N equal sectors: u_{j+1} = e^{2πi n/N} u_j in turning axes."""

    harmonic: int
    multiplicity: int
    """How often the wheel has each frequency: 2 where n and N − n are two harmonics."""
    rigid: int
    """Rigid motions of this harmonic beside the elastic modes; the wheel has each `multiplicity` times."""
    angular_frequencies: Array
    """ω [rad/s], (m,), ascending."""
    residuals: Array
    """‖Kv − ω²Mv‖ / ‖Kv‖ of each mode over the sector's own dofs, (m,)."""
    real: Array
    """Real part of each shape on the first sector, uᴴMu = 1 over it [kg^-½], (n, 3, m)."""
    imaginary: Array | None
    """Imaginary part, (n, 3, m); None where the harmonic is no pair and its shapes are real."""
    quality: Json
    """Orthogonality, and the inertia count: `shift` [rad²/s²], elastic modes `found` and `expected` below it."""


@dataclass(frozen=True)
class CyclicRecord:
    """Modes of a tuned wheel by cyclic symmetry, all harmonics 0…N/2."""

    mesh_key: str
    sectors: int
    """N"""
    axis: Array
    """Unit vector about which sector follows on sector, right-handed, (3,)."""
    origin: Array
    """A point of the axis [m], (3,)."""
    harmonics: dict[str, CyclicHarmonic]
    """By the harmonic's number as text."""
    quality: Json
    """Dofs of a sector, of its face and of the whole wheel."""


@dataclass(frozen=True)
class WheelRecord:
    """Forced response of a wheel, tuned and mistuned, to an engine order r: unit forces e^{2πi r j/N} on blade j."""

    modes_key: str
    """Key of the CyclicRecord of the same sector."""
    model: Json
    """How the wheel was reduced: `fixed_count`, `kept`, `interface_count`; `{}` where it was not."""
    engine_order: int
    loss_factor: float
    """η of K (1 + iη)."""
    stiffness_changes: Array
    """Relative change of each blade's stiffness, (N,)."""
    tuned_frequencies: Array
    """Lowest elastic frequencies of the tuned wheel in this model [rad/s], (m,)."""
    mistuned_frequencies: Array
    """The same of the mistuned wheel [rad/s], (m,)."""
    blades: Array
    """Motion of each blade along the force in each mistuned mode [kg^-½], (N, m)."""
    excitation: Array
    """Frequencies of the force [rad/s], (s,)."""
    tuned: Array
    """Real and imaginary part of each blade's displacement along the force per unit force [m/N], (s, N, 2)."""
    mistuned: Array
    """The same of the mistuned wheel [m/N], (s, N, 2)."""
    quantities: Json
    """name → {"value", "unit"}."""
    counts: Json
    """Coordinates, physical dofs kept on a face, interface modes, CPU seconds of each part."""


@dataclass(frozen=True)
class MeasurementRecord:
    """What a product took, alone on one machine."""

    seconds: Json
    """Part → {"wall", "cpu"} [s]: stages in an empty database, or a solution and what surrounds it."""
    peak_mib: float
    """Largest resident memory of the process meanwhile."""
    counts: Json
    """Work that was done, `factorisations` of it."""
    machine: Json


@dataclass(frozen=True)
class ReportRecord:
    """What a sweep over a scene found: the document of `report.json`."""

    document: Json


KINDS: dict[str, type] = {
    "mesh": MeshRecord,
    "modes": ModalRecord,
    "morph": MorphRecord,
    "nodal": NodalRecord,
    "trajectory": Trajectory,
    "cyclic": CyclicRecord,
    "wheel": WheelRecord,
    "measurement": MeasurementRecord,
    "report": ReportRecord,
}
"""Kinds of record that a store holds, by the name that stands in the file."""
