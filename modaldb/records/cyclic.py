"""Records of wheels of equal sectors."""

from dataclasses import dataclass, field

from gudgeon.modaldb.records.types import Array, Json, rule

MESH_ERRORS = "discretisation_errors"
"""Entry of `CyclicHarmonic.quality`: estimated (ω − ω_exact)/ω of each mode by the mesh."""


@dataclass(frozen=True)
class CyclicHarmonic:
    """Elastic modes of one harmonic n of a wheel of N equal sectors: u_{j+1} = e^{2πi n/N} u_j in rotated axes."""

    harmonic: int
    multiplicity: int
    """How often the wheel has each frequency: 2 where n and N − n are two harmonics."""
    rigid: int
    """Rigid motions of this harmonic beside the elastic modes; the wheel has each `multiplicity` times."""
    angular_frequencies: Array = field(metadata=rule("m'", unit="rad/s", name="angular frequencies"))
    """ω [rad/s], (m,), ascending."""
    residuals: Array = field(metadata=rule("m'", unit="1", name="relative residuals"))
    """‖Kv − ω²Mv‖ / ‖Kv‖ of each mode over the sector's own dofs, (m,)."""
    real: Array = field(metadata=rule("n 3 m'", unit="kg^-0.5", name="real part of the shapes"))
    """Real part of each shape on the first sector, uᴴMu = 1 over it [kg^-½], (n, 3, m)."""
    imaginary: Array | None = field(metadata=rule("n 3 m'", unit="kg^-0.5", name="imaginary part of the shapes"))
    """Imaginary part, (n, 3, m); None where the harmonic is no pair and its shapes are real."""
    quality: Json
    """Orthogonality, and the inertia count: `shift` [rad²/s²], elastic modes `found` and `expected` below it."""


@dataclass(frozen=True)
class CyclicRecord:
    """Modes of a tuned wheel by cyclic symmetry, all harmonics 0…N/2."""

    mesh_key: str
    sectors: int
    """N"""
    axis: Array = field(metadata=rule("3", unit="1", name="unit vector of the wheel's axis", columns="x, y, z"))
    """Unit vector about which sector follows on sector, right-handed, (3,)."""
    origin: Array = field(metadata=rule("3", unit="m", name="a point of the axis", columns="x, y, z"))
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
    stiffness_changes: Array = field(metadata=rule("N", unit="1", name="relative change of each blade's stiffness"))
    """Relative change of each blade's stiffness, (N,)."""
    tuned_frequencies: Array = field(metadata=rule("t", unit="rad/s", name="lowest elastic frequencies, tuned"))
    """Lowest elastic frequencies of the tuned wheel in this model [rad/s], (m,)."""
    mistuned_frequencies: Array = field(metadata=rule("m", unit="rad/s", name="lowest elastic frequencies, mistuned"))
    """The same of the mistuned wheel [rad/s], (m,)."""
    blades: Array = field(metadata=rule("N m", unit="kg^-0.5", name="motion of each blade in each mistuned mode"))
    """Motion of each blade along the force in each mistuned mode [kg^-½], (N, m)."""
    excitation: Array = field(metadata=rule("s", unit="rad/s", name="frequencies of the force"))
    """Frequencies of the force [rad/s], (s,)."""
    tuned: Array = field(
        metadata=rule(
            "s N 2", unit="m/N", name="displacement of each blade per unit force, tuned", columns="real, imaginary"
        )
    )
    """Real and imaginary part of each blade's displacement along the force per unit force [m/N], (s, N, 2)."""
    mistuned: Array = field(
        metadata=rule(
            "s N 2", unit="m/N", name="displacement of each blade per unit force, mistuned", columns="real, imaginary"
        )
    )
    """The same of the mistuned wheel [m/N], (s, N, 2)."""
    quantities: Json
    """name → {"value", "unit"}."""
    counts: Json
    """Coordinates, physical dofs kept on a face, interface modes, CPU seconds of each part."""
