"""Records of full-FE runs."""

from dataclasses import dataclass, field

from gudgeon.modaldb.records.types import MOTION, Array, Json, rule


@dataclass(frozen=True)
class NodalRecord:
    """A full-FE run of s steps."""

    step: float
    """[s]"""
    times: Array = field(metadata=rule("s", finite=False, unit="s", name="ends of the steps"))
    """Ends of the steps [s], (s,)."""
    force: Array = field(
        metadata=rule(
            "s 3", finite=False, unit="N", name="mean resultant on the body over each step", columns="x, y, z"
        )
    )
    """Mean resultant on the body over each step [N], (s, 3)."""
    energies: Array = field(
        metadata=rule("s 3", finite=False, unit="J", name="energies", columns="kinetic, strain, contact")
    )
    """Kinetic, strain, contact [J], (s, 3)."""
    energy_drift: float
    coordinates: int
    newton_iterations: int
    wall_seconds: float
    cpu_seconds: float
    forces: dict[str, Array] = field(
        default_factory=dict,
        metadata=rule(
            "s 3", finite=False, unit="N", name="mean resultant on the body over each step", columns="x, y, z"
        ),
    )
    """Mean resultant on the body over each step, by contact and joint [N], (s, 3); `force` is the contacts' sum."""
    motion: dict[str, Array] = field(
        default_factory=dict,
        metadata=MOTION,
    )
    """As in Trajectory, at the end of each step, (s, 12)."""
    frame_times: Array | None = field(
        default=None, metadata=rule("f", finite=False, unit="s", name="times of the frames")
    )
    """[s], (f,)"""
    masters: dict[str, Array] = field(
        default_factory=dict,
        metadata=rule(
            "f *",
            finite=False,
            unit="m",
            name="mean outward normal displacement under each traction function at each frame",
        ),
    )
    """As ContactHistory.master, by contact, (f, functions)."""
    quantities: Json = field(default_factory=dict)
    """As in Trajectory, where they have the same definition."""
