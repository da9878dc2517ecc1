"""Records of meshes."""

from dataclasses import dataclass, field

from gudgeon.modaldb.records.labelled import Labelled
from gudgeon.modaldb.records.types import Array, Json, rule


@dataclass(frozen=True)
class Surface:
    """A named part of a mesh's boundary."""

    facets: Array = field(
        metadata=rule("f' 9|8|6|4|3|1", "int", below="n", unit="1", name="node numbers of each facet")
    )
    """Node numbers of each facet, corners first: of solids triangles of 3 or 6 and quadrilaterals of 4, 8 or 9 nodes,
    in rows of 4 at least, smaller ones filled by their last node; (facets, 3) edges of triangles with the part on their
    left, (facets, 1) on a line or a rigid body, or the nodes of a set."""
    shape: Json = field(default_factory=dict)
    """The true surface, `{"kind": "cylinder", "radius", "axis", "origin"}` or `{}` where only the nodes are known."""
    areas: Array | None = field(default=None, metadata=rule("f'", unit="m^2", name="area of each node"))
    """Of a set of nodes, the part of the surface that each stands for [m^2], (facets,)."""
    normals: Array | None = field(
        default=None, metadata=rule("f' 3", unit="1", name="outward unit normals", columns="x, y, z")
    )
    """Outward unit normal at each of these nodes, zero where its area is, (facets, 3); None where it is unknown."""


@dataclass(frozen=True)
class Triangle:
    """Upper triangle, with the diagonal, of a sparse symmetric matrix over N degrees of freedom."""

    rows: Array = field(metadata=rule("k'", "int", below="N", unit="1", name="row of each entry"))
    """(k,)"""
    columns: Array = field(metadata=rule("k'", "int", below="N", unit="1", name="column of each entry"))
    """Not below the row, (k,)."""
    values: Array = field(metadata=rule("k'", unit="SI", name="entries of the matrix"))
    """(k,)"""


GENERALISED = 6
"""Direction of a degree of freedom that is a generalised coordinate."""


@dataclass(frozen=True)
class SystemMatrices:
    """Stiffness and mass of a body as another program assembled them, in SI units."""

    nodes: Array = field(metadata=rule("N", "int", below="n", unit="1", name="node of each degree of freedom"))
    """Node of each degree of freedom, (N,), 0 of a generalised coordinate. Those that a node with others lacks are held
    at zero."""
    directions: Array = field(metadata=rule("N", "int", unit="1", name="direction of each degree of freedom"))
    """Its direction, (N,): 0, 1, 2 are x, y, z [m], 3, 4, 5 rotations about them [rad], 6 a generalised coordinate of a
    superelement, such as the amplitude of a fixed-interface mode [1], which moves no node; these are the last ones."""
    labels: Array = field(metadata=rule("n", "int", unit="1", name="node numbers in the other program"))
    """Number of each node in the other program, (n,)."""
    stiffness: Triangle
    """[N/m], of rotations and generalised coordinates [N m]."""
    mass: Triangle
    """[kg], of rotations and generalised coordinates [kg m^2]."""


@dataclass(frozen=True)
class Attachment:
    """A point of another program's model that moves with nodes of a mesh, and its mass, which is not meshed."""

    nodes: Array = field(metadata=rule("k'", "int", below="n", unit="1", name="nodes that move with the point"))
    """(k,)"""
    point: Array = field(metadata=rule("3", unit="m", name="position of the point"))
    """[m], (3,)."""
    kind: str
    """`rbe2`: the nodes move with it as a rigid body; `rbe3`: it has their mean motion; `node`: it is the node."""
    mass: float
    """[kg]; zero if it has none."""
    weights: Array | None = field(default=None, metadata=rule("k'", unit="1", name="weights of the nodes"))
    """Of the nodes in the mean motion, (k,); None of equal ones."""
    inertia: Array | None = field(default=None, metadata=rule("3 3", unit="kg m^2", name="inertia about the point"))
    """About the point [kg m^2], (3, 3); None without one."""


@dataclass(frozen=True)
class Relation:
    """Sums Σ c u of displacements that another program's model states: those of constraints are zero."""

    kind: str
    """`spring` or `constraint`."""
    rows: Array = field(metadata=rule("t'", "int", unit="1", name="sum of each term"))
    """Number of its sum of each term, ascending, (t,)."""
    nodes: Array = field(metadata=rule("t'", "int", below="n", unit="1", name="node of each term"))
    """(t,)"""
    directions: Array = field(metadata=rule("t'", "int", unit="1", name="direction of each term"))
    """0, 1, 2 for x, y, z, (t,)."""
    coefficients: Array = field(metadata=rule("t'", unit="1", name="coefficient of each term"))
    """c, (t,)."""
    stiffness: Array = field(metadata=rule("j'", unit="N/m", name="stiffness of each sum"))
    """[N/m], zero of constraints, (j,)."""


@dataclass(frozen=True)
class MeshRecord(Labelled):
    """Nodes, cells and named surfaces of one component."""

    nodes: Array = field(metadata=rule("n 3", unit="m", name="nodal positions", columns="x, y, z"))
    """Nodal positions [m], (n, 3)."""
    cells: Array = field(
        metadata=rule(
            "e 27|20|18|15|14|13|10|8|6|5|4|3|2|1", "int", below="n", unit="1", name="node numbers of each cell"
        )
    )
    """Node numbers of each cell in meshio's order, (e, a); of `mixed`, cells of fewer nodes than others repeat their
    last one to the end: the number of nodes is the type."""
    cell_type: str
    """Solids: `tetra`, `tetra10`, `hexahedron`, `hexahedron20`, `hexahedron27`, `wedge`, `wedge15`, `wedge18`,
    `pyramid`, `pyramid13`, `pyramid14`, and `mixed` of several of them; `triangle6`, a plane part in z = 0; `line3`, a
    bar; `beam2` and `beam3`, a beam; `frame2`, one in space; `vertex`, a rigid body without mesh; only with a
    `system`: `nodes`, points without cells."""
    surfaces: dict[str, Surface]
    volumes: dict[str, Array] = field(
        default_factory=dict, metadata=rule("k'", "int", below="e", unit="1", name="cells of a named volume")
    )
    """Cells of each named part of a solid of several, (k,) each."""
    formulations: dict[str, Array] = field(
        default_factory=dict, metadata=rule("k'", "int", below="e", unit="1", name="cells of a formulation")
    )
    """Cells that are not integrated in full: `incompatible`, hexahedra of 8 nodes with incompatible modes; `reduced`,
    those of 20 nodes with 8 points for the stiffness, (k,) each."""
    remarks: Json = field(default_factory=dict)
    """`{"notes": [line, …]}`: what of a file the mesh does not have, or has otherwise; `{}` where there is nothing."""
    attachments: dict[str, Attachment] = field(default_factory=dict)
    """Point masses, rigid elements and couplings that a file states, by names as `rbe2_9001`, `node_59`."""
    relations: dict[str, Relation] = field(default_factory=dict)
    """Springs, equations and ties that a file states, by names as `springs`, `tie_SEAM`."""
    system: SystemMatrices | None = None
    """Matrices that were read, not assembled from the cells."""
