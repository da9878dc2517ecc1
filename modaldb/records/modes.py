"""Records of a component's modes and of its designs."""

from dataclasses import dataclass, field

import numpy as np

from gudgeon.modaldb.records.gauges import GaugeModes
from gudgeon.modaldb.records.labelled import Labelled
from gudgeon.modaldb.records.types import Array, Json, rule


@dataclass(frozen=True)
class InterfaceModes:
    """Contact points of a named interface of a body, and their displacement rows; one row per point."""

    nodes: Array = field(metadata=rule("c'", "int", below="n", unit="1", name="node of each contact point"))
    """Node number of each contact point, (c,)."""
    points: Array = field(metadata=rule("c' 3", unit="m", name="contact points", columns="x, y, z"))
    """Contact points on the true surface [m], (c, 3)."""
    normals: Array = field(metadata=rule("c' 3", unit="1", name="outward unit normals", columns="x, y, z"))
    """Outward unit normals of the true surface, (c, 3)."""
    areas: Array = field(metadata=rule("c'", unit="m^2", name="tributary areas"))
    """Tributary areas [m^2], (c,)."""
    edge: Array = field(
        metadata=rule("c'", "bool", unit="1", name="whether a point borders on surface outside the interface")
    )
    """Whether a point borders on surface that is not part of the interface, (c,); contact may extend beyond it."""
    rows: Array = field(
        metadata=rule("c' m", unit="kg^-0.5", name="outward normal displacement per elastic coordinate")
    )
    """B Φ: outward normal displacement per unit of each elastic coordinate [kg^-½], (c, m)."""
    tangents: Array | None = field(
        default=None,
        metadata=rule("c' 2 3", unit="1", name="unit vectors t1, t2 across each normal", columns="x, y, z"),
    )
    """Unit vectors t1, t2 across each normal, right-handed with it, (c, 2, 3); see `records.tangents`. None where no
    friction acts."""
    tangential_rows: Array | None = field(
        default=None, metadata=rule("c' 2 m", unit="kg^-0.5", name="displacement along t1, t2 per elastic coordinate")
    )
    """Displacement along t1 and t2 per unit of each elastic coordinate [kg^-½], (c, 2, m)."""
    facets: Array | None = field(
        default=None, metadata=rule("f' 3", "int", unit="1", name="numbers of the contact points of each facet")
    )
    """Facets all of whose contact points belong to the interface, by the numbers of these points, (f, 3): the mid-side
    nodes of a triangle in the order of its edges, outward; the ends and the middle of an edge of a plane part. Empty
    where points are no nodes of facets."""
    outline: Array | None = field(
        default=None, metadata=rule("h' 3", unit="m", name="corners of the face of a patch", columns="x, y, z")
    )
    """Corners of the convex hull of the face that the one point of a patch stands for [m], (h, 3); None of points."""


@dataclass(frozen=True)
class SplineGrid:
    """Chart and knots of tensor products of uniform cubic B-splines on a surface, see `modaldb.records.traction`.

    Function a = i·counts[1] + j is the product of the i-th spline across and the j-th along, N_a.
    """

    chart: Json
    """What `across` and `along` mean: `{"kind": "cylinder", "axis", "origin", "radius", "middle"}` or
    `{"kind": "plane", "origin", "normal", "across", "along"}`, or of a patch, any smooth surface, the same with its
    height along the normal, `{"kind": "patch", …, "low", "step", "counts", "heights", "cover"}`."""
    start: Array = field(metadata=rule("2", unit="m", name="least coordinates of the space", columns="across, along"))
    """Least coordinates of the space, across and along [m], (2,)."""
    spacing: Array = field(metadata=rule("2", unit="m", name="knot spacing", columns="across, along"))
    """Knot spacing across and along [m], (2,)."""
    counts: Array = field(metadata=rule("2", "int", unit="1", name="number of splines", columns="across, along"))
    """Number of splines across and along, f = their product, (2,)."""

    @property
    def size(self) -> int:
        """Number of functions."""
        return int(self.counts.prod())


@dataclass(frozen=True)
class TractionModes(SplineGrid):
    """A smooth traction space on a surface that many points slide over; a traction is N_a / ∫ N_a dA, of unit
    resultant."""

    rows: Array = field(
        metadata=rule(
            "f' m",
            unit="kg^-0.5",
            name="mean outward normal displacement under each unit traction per elastic coordinate",
        )
    )
    """B Φ: mean outward normal displacement under each traction per unit of each elastic coordinate [kg^-½], (f, m)."""
    resultant: Array = field(
        metadata=rule(
            "f' 6", unit="1, m", name="force and moment of each unit traction", columns="Fx, Fy, Fz, Mx, My, Mz"
        )
    )
    """Force and moment about the component's origin of each unit traction along the outward normal [1, m], (f, 6)."""
    tangential_rows: Array | None = field(
        default=None,
        metadata=rule(
            "f' 2 m", unit="kg^-0.5", name="mean displacement along t1, t2 under each unit traction per coordinate"
        ),
    )
    """Mean displacement along t1, the chart's `along`, and t2 = normal × t1 under each unit traction along them, per
    unit of each elastic coordinate [kg^-½], (f, 2, m). None where no friction acts."""
    tangential_resultant: Array | None = field(
        default=None,
        metadata=rule(
            "f' 2 6", unit="1, m", name="force and moment of each unit traction along t1, t2",
            columns="Fx, Fy, Fz, Mx, My, Mz",
        ),
    )  # fmt: skip
    """Force and moment about the component's origin of each of these unit tractions [1, m], (f, 2, 6)."""


@dataclass(frozen=True)
class LoadModes:
    """A load, or a point held by a joint: k generalised forces and their displacements."""

    rows: Array = field(
        metadata=rule(
            "k' m",
            unit="conjugate to unit, per kg^0.5 m",
            name="displacement conjugate to each force per elastic coordinate",
        )
    )
    """B Φ: displacement conjugate to each force per unit of each elastic coordinate, (k, m)."""
    resultant: Array = field(
        metadata=rule(
            "k' 6", unit="per unit", name="force and moment of each unit force", columns="Fx, Fy, Fz, Mx, My, Mz"
        )
    )
    """Force and moment about the component's origin per unit, (k, 6)."""
    point: Array = field(metadata=rule("3", unit="m", name="point of action", columns="x, y, z"))
    """Its point of action: the mean of its surface, or the reference point of a tie [m], (3,)."""
    unit: str
    """Of the generalised force: `N` of a mean's three, `N, N m` on a tie's reference point, `Pa` of a pressure."""
    stress_stiffness: Array | None = field(
        default=None,
        metadata=rule("k' M M", unit="1/(kg m), kg^-0.5, m", name="stiffness by the static stress of each unit force"),
    )
    """Stiffness by the static stress of each unit force, balanced by supports and inertia [1/(kg m) of a force], over
    the m shapes and the unit rotations about x, y, z through the centre, (k, m + 3, m + 3); None where no body of the
    scene turns, and no load of it stresses one."""


@dataclass(frozen=True)
class StaticResponses:
    """Static displacement of a solid under k smooth pressures on its interfaces of contact and unit forces of its
    loads, balanced by inertia if the body is free: what a design change with unchanged modes is judged by."""

    shapes: Array = field(metadata=rule("n 3 k'", unit="m per unit", name="displacement under each smooth pressure"))
    """Y = G f, nodal displacement per unit of each pressure, (n, 3, k)."""
    compliance: Array = field(
        metadata=rule(
            "k' k'", unit="conjugate to unit", name="displacement conjugate to each pressure per unit of each"
        )
    )
    """fᵀ G f, displacement conjugate to each pressure per unit of each, (k, k)."""
    resultant: Array = field(
        metadata=rule(
            "k' 6", unit="N, N m per unit", name="force and moment of each pressure", columns="Fx, Fy, Fz, Mx, My, Mz"
        )
    )
    """Force and moment about the component's origin of each pressure, (k, 6)."""
    columns: Json
    """First and last + 1 pressure of each interface."""


@dataclass(frozen=True)
class InertiaCouplings:
    """Constant tensors of the nodal floating frame from the consistent mass (Zwölfer & Gerstmayr 2020)."""

    translation: Array = field(
        metadata=rule("3 m", unit="kg^0.5", name="coupling of translations and elastic coordinates")
    )
    """Tᵀ M Φ [kg^½], (3, m); zero for free-free modes."""
    rotation: Array = field(metadata=rule("3 m", unit="kg^0.5 m", name="coupling of rotations and elastic coordinates"))
    """x̃ᵀ M Φ about the centre of mass [kg^½ m], (3, m); zero for free-free modes."""
    rotation_gradient: Array = field(
        metadata=rule("3 m m", unit="1", name="gradient of the coupling of rotations and elastic coordinates")
    )
    """∂(ũᵀ M Φ)/∂q [1], (3, m, m), antisymmetric in the last two."""
    position_moments: Array | None = field(
        default=None, metadata=rule("3 3 m", unit="kg^0.5 m", name="first moments of positions and shapes")
    )
    """∫ ρ x_i φ_jk with x from the centre of mass [kg^½ m], (3, 3, m); None where no body of the scene turns."""
    shape_moments: Array | None = field(default=None, metadata=rule("3 3 m m", unit="1", name="moments of two shapes"))
    """∫ ρ φ_ik φ_jl [1], (3, 3, m, m)."""
    centrifugal_stiffness: Array | None = field(
        default=None,
        metadata=rule("3 3 M M", unit="1, kg^0.5 m, kg m^2", name="stiffness by the stress of centrifugal unit loads"),
    )
    """Stiffness by the static stress of the load ρ (x_i e_j + x_j e_i), over the m shapes [1] and the unit rotations
    about x, y, z through the centre, (3, 3, m + 3, m + 3)."""
    centrifugal_compliance: Array | None = field(
        default=None,
        metadata=rule("3 3 3 3", unit="kg m^2 s^2", name="twice the static strain energy of centrifugal loads"),
    )
    """D of the strain energy ½ C : D : C that the load ρ C x would cause as a static one [kg m² s²], (3, 3, 3, 3), with
    C = ω² 1 − ω ωᵀ of a rotation; all of it, what modes lack included."""


@dataclass(frozen=True)
class SwapModes:
    """Bases of a body between which a run changes as a force passes over a traction space: all of them have the normal
    modes, and each has Ritz vectors of the force at places of its own part of the space."""

    interface: str
    """The traction space."""
    number: Array = field(metadata=rule("m", "int", unit="1", name="number of the basis that has each coordinate"))
    """Number of the basis that has each coordinate, from 1 on, ascending; 0: all have it, (m,)."""
    borders: Array = field(metadata=rule("b'", unit="m", name="coordinates along at which the basis changes"))
    """Coordinates along the space at which the basis changes [m], ascending, (b − 1,)."""
    overlap: Array = field(metadata=rule("m m", unit="1", name="mass between the coordinates"))
    """Φᵀ M Φ [1], (m, m): the identity within a basis."""


SHAPE_ERRORS = "shape_errors"
"""Entry of `ModalRecord.quality`: (ω − ω')/ω of the last coordinates, those that are no proven normal modes, with ω'
of one inverse iteration. It is small where a Ritz vector is a mode, and large for static shapes."""
VOLUME_ERROR = "volume_error"
"""Entry of `ModalRecord.quality`: by how much the mesh has more volume, and mass, than is within its true surfaces."""
INERTIA_ERROR = "inertia_error"
"""Entry of `ModalRecord.quality`: the same of moments of inertia, or of its centre over its radius of gyration."""
COMPLIANCE_ERRORS = "compliance_errors"
"""Entry of `ModalRecord.quality`: estimated relative mesh error of the static compliance of each contact interface."""
LOAD_ERRORS = "load_errors"
"""Entry of `ModalRecord.quality`: the same for each row of a load, by interface."""
DESIGN = "design"
"""Entry of `ModalRecord.quality` of a design that stored ones may give: the way that was taken, its steps with the
stored factor, its estimated errors and the keys of the stored designs."""
MODE = 0.02
"""Largest of these of a coordinate that is a mode of the body."""


@dataclass(frozen=True)
class ModalRecord(Labelled):
    """Elastic coordinates of one component: Φᵀ M Φ = I, Φᵀ K Φ = diag(ω²)."""

    mesh_key: str
    reduction: str
    normal_count: int
    static_count: int
    angular_frequencies: Array = field(
        metadata=rule("m", unit="rad/s", name="angular frequencies of the elastic coordinates")
    )
    """ω [rad/s], (m,): normal modes first, then the static correction shapes' own."""
    mass: float
    """[kg]"""
    centre: Array = field(metadata=rule("3", unit="m", name="centre of mass", columns="x, y, z"))
    """Centre of mass [m], (3,)."""
    inertia: Array = field(
        metadata=rule("3 3", unit="kg m^2", name="inertia about the centre of mass", columns="x, y, z")
    )
    """Inertia about the centre of mass [kg m^2], (3, 3)."""
    rigid_twists: Array = field(
        metadata=rule(
            "r 6", unit="kg^-0.5, kg^-0.5 m^-1", name="mass-normalised rigid motions", columns="ux, uy, uz, rx, ry, rz"
        )
    )
    """Mass-normalised rigid motions (translation, rotation about the centre) [kg^-½, kg^-½ m^-1], (r, 6)."""
    interfaces: dict[str, InterfaceModes]
    interface_rows: Json
    """First and last + 1 row of each interface, traction space and load in the residual flexibility."""
    residual_flexibility: Array | None = field(
        metadata=rule("C C", unit="m/N", name="residual flexibility between the rows of all interfaces")
    )
    """R = B (G − Φ Λ⁻¹ Φᵀ) Bᵀ [m/N] over the rows of all interfaces, (C, C), symmetric positive semidefinite; first
    those of `interface_rows`, then the tangential ones. None where the reduction makes none."""
    shapes: Array | None = field(
        metadata=rule("n 3 m", unit="kg^-0.5", name="nodal displacement per elastic coordinate")
    )
    """Φ, nodal displacement per unit of each elastic coordinate, (n, 3, m)."""
    inertia_couplings: InertiaCouplings | None
    quality: Json
    """Checks of the extraction: residuals, orthogonality, inertia count, dropped shapes."""
    tractions: dict[str, TractionModes] = field(default_factory=dict)
    """Traction spaces by interface; `interface_rows` has their rows in R."""
    loads: dict[str, LoadModes] = field(default_factory=dict)
    """Loads by interface; `interface_rows` has their rows in R."""
    gauges: dict[str, GaugeModes] = field(default_factory=dict)
    residuals: Array | None = field(
        default=None, metadata=rule("m", finite=False, unit="1", name="relative residuals of the elastic coordinates")
    )
    """‖KΦ − MΦω²‖ / ‖KΦ‖ of each coordinate over the free dofs, (m,): round-off for a normal mode, larger for
    a Ritz vector."""
    algebraic_errors: Array | None = field(
        default=None,
        metadata=rule("m", finite=False, unit="1", name="bounds on the relative algebraic errors of the frequencies"),
    )
    """Bound on |δω|/ω of each coordinate against the nearest exact frequency of the same mesh, (m,)."""
    discretisation_errors: Array | None = field(
        default=None,
        metadata=rule("m", finite=False, unit="1", name="estimated relative discretisation errors of the frequencies"),
    )
    """Estimate of (ω − ω_exact)/ω of each normal mode, the discretisation error, (m,); NaN for static shapes
    and Ritz vectors; None where the elements have no estimate."""
    participation: Array | None = field(
        default=None,
        metadata=rule("3 m", unit="kg^0.5", name="participation of the elastic coordinates in unit translations"),
    )
    """Tᵀ M Φ with T the unit translations [kg^½], (3, m): the load of gravity on each coordinate; None without
    supports, since free modes take no part in translations."""
    weight_stiffness: Array | None = field(
        default=None,
        metadata=rule("3 M M", unit="s^2/m^2, kg^0.5", name="stiffness by the static stress of unit gravity"),
    )
    """Stiffness by the static stress of unit gravity along x, y, z on a body that supports hold [s²/m² of shapes], over
    shapes and rotations as `LoadModes.stress_stiffness`, (3, m + 3, m + 3); None without supports or gravity."""
    static_responses: StaticResponses | None = None
    """Static responses to forces on interfaces; None for rigid bodies, without an interface of contact, and for
    elements other than tet10."""
    swap: SwapModes | None = None
    """Second basis of coordinates; None where all are one basis. Else each basis is orthonormal, but not all
    coordinates together."""
    tangential_spans: Json = field(default_factory=dict)
    """First and last + 1 tangential row in the residual flexibility of each interface that has them: t1 and t2 of its
    first point or traction, of its second, and so on."""

    @property
    def frequencies(self) -> np.ndarray:
        """Frequencies of the normal modes, ω/2π [Hz], (normal_count,)."""
        return self.angular_frequencies[: self.normal_count] / (2 * np.pi)

    def curve(self) -> tuple[str, np.ndarray, np.ndarray] | None:
        """Return the frequencies of the normal modes over their numbers."""
        frequencies = self.frequencies
        title = f"frequencies of {len(frequencies)} normal modes" + (
            f", up to {frequencies[-1]:.4g} Hz" if len(frequencies) else ""
        )
        return title, np.arange(1.0, len(frequencies) + 1), frequencies

    @property
    def are_modes(self) -> np.ndarray:
        """Whether each coordinate is a mode of the body: a normal mode, or a Ritz vector that is close to one, (m,)."""
        are_modes = np.arange(len(self.angular_frequencies)) < self.normal_count
        if errors := self.quality.get(SHAPE_ERRORS):
            are_modes[len(are_modes) - len(errors) :] = np.array(errors) <= MODE
        return are_modes

    @property
    def row_count(self) -> int:
        """Number of rows of the residual flexibility, whether it is stored or not, C."""
        spans = [*self.interface_rows.values(), *self.tangential_spans.values()]
        return max((end for _, end in spans), default=0)


@dataclass(frozen=True)
class MorphRecord(Labelled):
    """Design of a component: its nodal positions and contact points, and the modes that it uses."""

    mesh_key: str
    modes_key: str
    update: str
    """`none`, `reuse`, `certified` or `recompute`."""
    points: dict[str, Array] = field(
        metadata=rule("c' 3", unit="m", name="contact points of this design", columns="x, y, z")
    )
    """Contact points of each interface in this design [m], (c, 3)."""
    mass: float
    centre: Array = field(metadata=rule("3", unit="m", name="centre of mass", columns="x, y, z"))
    inertia: Array = field(
        metadata=rule("3 3", unit="kg m^2", name="inertia about the centre of mass", columns="x, y, z")
    )
    rigid_twists: Array = field(
        metadata=rule(
            "r 6", unit="kg^-0.5, kg^-0.5 m^-1", name="mass-normalised rigid motions", columns="ux, uy, uz, rx, ry, rz"
        )
    )
    """Rigid twists as in ModalRecord, always recomputed for this design."""
    nodes: Array | None = field(
        metadata=rule("n 3", unit="m", name="nodal positions of this design", columns="x, y, z")
    )
    """Nodal positions of this design [m], (n, 3); None where no node moved."""
    quality: Json


@dataclass(frozen=True)
class SensitivityRecord(Labelled):
    """Derivatives of a body's eigenvalues and compliances with respect to the positions of its nodes.

    Of each movement of the nodes they give, to first order, what a design neglects that keeps the modes.
    """

    mesh_key: str
    modes_key: str
    eigenvalues: Array = field(metadata=rule("m", unit="s^-2", name="eigenvalues of the normal modes"))
    """ω² [1/s²] of the normal modes, (m,)."""
    pairs: Array = field(metadata=rule("a 2", "int", below="m", unit="1", name="pairs of modes, each with itself too"))
    """Modes with close frequencies, and each with itself, (a, 2)."""
    modal: Array = field(metadata=rule("n 3 a", unit="s^-2 m^-1", name="derivatives of the pairs' φᵀ(K − ω²M)φ"))
    """Derivatives of φᵀ(K − ω²M)φ of these pairs [1/(m s²)], (n, 3, a)."""
    compliances: dict[str, Array] = field(
        metadata=rule("k' k'", unit="m N^-1", name="compliance of each interface under its smooth pressures")
    )
    """Static compliance of each interface under its k smooth pressures [m/N], (k, k)."""
    static: dict[str, Array] = field(
        metadata=rule("n 3 t'", unit="N^-1", name="derivatives of the upper triangles of these")
    )
    """Derivatives of the upper triangles of these, row after row [1/N], (n, 3, k(k + 1)/2)."""
