"""Gauges of a modal record: what they show per unit of each coordinate and of loads."""

from dataclasses import dataclass, field

from gudgeon.modaldb.records.types import Array, rule


@dataclass(frozen=True)
class GaugeModes:
    """A point or surface where stress or strain is recorded: value = rows q + residual λ + weights g, k values.

    k = 1 is the bending stress of a beam; k = 6 are the components xx, yy, zz, xy, yz, zx of a tensor at a point, shear
    strain as ε_xy and not γ_xy; k = 6 s are these at s nodes of a surface, node by node.
    """

    rows: Array = field(metadata=rule("k' m", unit="unit per kg^0.5 m", name="gauge value per elastic coordinate"))
    """Value per unit of each elastic coordinate, (k, m)."""
    residual: Array = field(
        metadata=rule(
            "k' C or k' 0",
            unit="unit per N",
            name="quasi-static gauge value per force of each row of the residual flexibility",
        )
    )
    """Quasi-static value per unit force of each row of R, the part of the truncated modes, (k, C); (k, 0) of a surface
    where the reduction makes no R."""
    unit: str
    """Of the value, `Pa` or `1`."""
    nodes: Array | None = field(
        default=None, metadata=rule("s'", "int", below="n", unit="1", name="nodes of the gauge's surface")
    )
    """Node numbers of a surface, (s,), ascending; None for a point."""
    weights: Array | None = field(
        default=None, metadata=rule("k' 3", unit="unit per m/s^2", name="gauge value under gravity", columns="x, y, z")
    )
    """Value under unit gravity along x, y, z that the coordinates lack, (k, 3); None where none deforms the body."""
    centrifugal: Array | None = field(
        default=None, metadata=rule("k' 3 3", unit="unit s^2", name="quasi-static gauge value under centrifugal loads")
    )
    """T, by which the load ρ C x with a symmetric C adds Σ C_ij T_ij, what the coordinates lack of its static answer,
    (k, 3, 3); x is from the centre of mass. None where no body of the scene turns."""
