"""Records of full-FE runs."""

from dataclasses import dataclass, field

from gudgeon.modaldb.records.types import Array, Json, rule


@dataclass(frozen=True)
class NodalRecord:
    """A full-FE run of s steps."""

    step: float
    """[s]"""
    times: Array = field(metadata=rule("s", finite=False))
    """Ends of the steps [s], (s,)."""
    force: Array = field(metadata=rule("s 3", finite=False))
    """Mean resultant on the body over each step [N], (s, 3)."""
    energies: Array = field(metadata=rule("s 3", finite=False))
    """Kinetic, strain, contact [J], (s, 3)."""
    energy_drift: float
    coordinates: int
    newton_iterations: int
    wall_seconds: float
    cpu_seconds: float
    forces: dict[str, Array] = field(default_factory=dict, metadata=rule("s 3", finite=False))
    """Mean resultant on the body over each step, by contact and joint [N], (s, 3); `force` is the contacts' sum."""
    motion: dict[str, Array] = field(default_factory=dict, metadata=rule("s 12", finite=False))
    """As in Trajectory, at the end of each step, (s, 12)."""
    frame_times: Array | None = field(default=None, metadata=rule("f", finite=False))
    """[s], (f,)"""
    masters: dict[str, Array] = field(default_factory=dict, metadata=rule("f *", finite=False))
    """As ContactHistory.master, by contact, (f, functions)."""
    quantities: Json = field(default_factory=dict)
    """As in Trajectory, where they have the same definition."""
