"""Records of meshes."""

from dataclasses import dataclass, field

from gudgeon.modaldb.records.types import Array, Json, rule


@dataclass(frozen=True)
class Surface:
    """A named part of a mesh's boundary."""

    facets: Array = field(metadata=rule("f' 6|3|1", "int", below="n", unit="1", name="node numbers of each facet"))
    """Node numbers of each facet, corners first: (facets, 6) on tet10, (facets, 3) on triangles with the part on their
    left, (facets, 1) on a line or a rigid body."""
    shape: Json = field(default_factory=dict)
    """The true surface, `{"kind": "cylinder", "radius", "axis", "origin"}` or `{}` where only the nodes are known."""


@dataclass(frozen=True)
class MeshRecord:
    """Nodes, cells and named surfaces of one component."""

    nodes: Array = field(metadata=rule("n 3", unit="m", name="nodal positions", columns="x, y, z"))
    """Nodal positions [m], (n, 3)."""
    cells: Array = field(metadata=rule("e 10|6|3|2|1", "int", below="n", unit="1", name="node numbers of each cell"))
    """Node numbers of each cell in meshio's order, (e, 10), (e, 6), (e, 3), (e, 2) or (e, 1)."""
    cell_type: str
    """`tetra10`; `triangle6`, a plane part in z = 0; `line3`, a bar; `beam2` and `beam3`, a beam;
    `vertex`, a rigid body without mesh."""
    surfaces: dict[str, Surface]
