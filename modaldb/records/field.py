"""Records of electrostatic fields."""

from dataclasses import dataclass, field

from gudgeon.modaldb.records.types import Array, Json, rule


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
