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
    facets: Array = field(metadata=rule("F 3 3"))
    """Corners of the flat facets in the scene [m], (F, 3, 3)."""
    panel: Array = field(metadata=rule("F", "int", below="P"))
    """Panel of each facet, ascending, (F,)."""
    conductor: Array = field(metadata=rule("P", "int", below="k"))
    """Conductor of each panel, (P,)."""
    coarse: Array = field(metadata=rule("P", "int", below="P"))
    """Coarse panel of each panel, ascending, (P,)."""
    density: Array = field(metadata=rule("P k"))
    """Charge density of each panel with one conductor at 1 V, the others at 0 V [F/m^2], (P, k)."""
    capacitance: Array = field(metadata=rule("k k"))
    """Maxwell's capacitance matrix, charges over potentials [F], (k, k)."""
    panel_error: Array = field(metadata=rule("k k"))
    """Its estimated error by the size of the panels and by the rules of integration [F], (k, k)."""
    shape_error: Array = field(metadata=rule("k k"))
    """Its estimated error by the distance of the panels from the true surface [F], (k, k)."""
    potentials: Array = field(metadata=rule("k"))
    """Potentials of the scene, those of floating conductors found [V], (k,)."""
    charges: Array = field(metadata=rule("k"))
    """Charges of the scene [C], (k,)."""
    quantities: Json
    """name → {"value", "unit"}."""
    counts: Json
    """`panels` and `coarse_panels`, CPU seconds."""
