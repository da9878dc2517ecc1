"""Records of electrostatic fields."""

from dataclasses import dataclass, field

from gudgeon.modaldb.records.types import Array, Json, rule

POSE_AXES = ("x", "y", "z", "rx", "ry", "rz")
"""Components of a pose: translation [m] and rotation vector [rad]."""


@dataclass(frozen=True)
class FieldRecord:
    """Charges and capacitances of k conductors in their places: P panels of uniform charge density on F facets."""

    conductors: Json
    """`names`: of the conductors in order; `mesh_keys`: of their meshes, by name."""
    medium: Json
    """`permittivity` [F/m]; with a half-space, `point` [m], `normal` into the medium, and `image_factor`."""
    facets: Array = field(metadata=rule("F 3 3", unit="m", name="corners of facets"))
    """Corners of the flat facets in the scene [m], (F, 3, 3)."""
    panel: Array = field(metadata=rule("F", "int", below="P", unit="1", name="panel of each facet"))
    """Panel of each facet, ascending, (F,)."""
    conductor: Array = field(metadata=rule("P", "int", below="k", unit="1", name="conductor of each panel"))
    """Conductor of each panel, (P,)."""
    coarse: Array = field(metadata=rule("P", "int", below="P", unit="1", name="coarse panel of each panel"))
    """Coarse panel of each panel, ascending, (P,)."""
    density: Array = field(metadata=rule("P k", unit="F/m^2", name="charge density of each panel per potential"))
    """Charge density of each panel with one conductor at 1 V, the others at 0 V [F/m^2], (P, k)."""
    capacitance: Array = field(metadata=rule("k k", unit="F", name="capacitance matrix"))
    """Maxwell's capacitance matrix, charges over potentials [F], (k, k)."""
    panel_error: Array = field(metadata=rule("k k", unit="F", name="its error by panels"))
    """Its estimated error by the size of the panels and by the rules of integration [F], (k, k)."""
    shape_error: Array = field(metadata=rule("k k", unit="F", name="its error by shape"))
    """Its estimated error by the distance of the panels from the true surface [F], (k, k)."""
    potentials: Array = field(metadata=rule("k", unit="V", name="potentials"))
    """Potentials of the scene, those of floating conductors found [V], (k,)."""
    charges: Array = field(metadata=rule("k", unit="C", name="charges"))
    """Charges of the scene [C], (k,)."""
    quantities: Json
    """name → {"value", "unit"}."""
    counts: Json
    """`panels` and `coarse_panels`, CPU seconds."""


@dataclass(frozen=True)
class PoseRecord:
    """Capacitances of k conductors at p poses of those that move, a part of a grid."""

    field_key: str
    """Key of the FieldRecord in whose places the poses begin."""
    moved: Json
    """`names` of the conductors that move, and the `pivot` about which they rotate [m]."""
    poses: Array = field(metadata=rule("p 6", unit="m, rad", name="poses", columns="x, y, z, rx, ry, rz"))
    """Translation [m] and rotation vector [rad] of each pose, (p, 6)."""
    capacitance: Array = field(metadata=rule("p k k", unit="F", name="capacitance matrices"))
    """Maxwell's capacitance matrix [F], (p, k, k)."""
    panel_error: Array = field(metadata=rule("p k k", unit="F", name="their errors by panels"))
    """Its estimated error by the size of the panels and by the rules of integration [F], (p, k, k)."""
    counts: Json
    """Iterations in all, CPU seconds."""


@dataclass(frozen=True)
class PoseGridRecord:
    """Capacitances of k conductors on a grid of p poses of those that move."""

    field_key: str
    """Key of the FieldRecord in whose places the poses begin."""
    moved: Json
    """`names` of the conductors that move, and the `pivot` about which they rotate [m]."""
    axes: dict[str, Array] = field(metadata=rule("a'", unit="m or rad", name="positions along an axis"))
    """Values of each axis of the grid, ascending, by name of `x`, `y`, `z` [m], `rx`, `ry`, `rz` [rad] in this order,
    (n,)."""
    capacitance: Array = field(metadata=rule("p k k", unit="F", name="capacitance matrices"))
    """Maxwell's capacitance matrix [F] at the points of the grid, the last axis running fastest, (p, k, k)."""
    panel_error: Array = field(metadata=rule("p k k", unit="F", name="their errors by panels"))
    """Its estimated error by the size of the panels and by the rules of integration [F], (p, k, k)."""
    cell_errors: Array = field(metadata=rule("c", unit="1", name="error of each cell"))
    """Estimated error of interpolation in each cell, relative to the largest |C|, the last axis running fastest,
    (cells,)."""
    potentials: Array = field(metadata=rule("k", finite=False, unit="V", name="potentials"))
    """Given potentials of the scene, NaN for a floating conductor [V], (k,)."""
    charges: Array = field(metadata=rule("k", unit="C", name="charges"))
    """Given charges of floating conductors [C], (k,)."""
    counts: Json
    """Poses, iterations in all, CPU seconds."""

    def __post_init__(self) -> None:
        """Order the axes as a pose's components, in which the points run: a file has them by name."""
        object.__setattr__(self, "axes", {name: self.axes[name] for name in POSE_AXES if name in self.axes})
