"""Records of simulations."""

from dataclasses import dataclass, field

import numpy as np

from gudgeon.modaldb.records.labelled import Labelled
from gudgeon.modaldb.records.types import MOTION, Array, Json, rule

BEGINS, ENDS, IMPULSE, PEAK, PEAK_TIME, CLOSING, OPENING, WINDOWED, WINDOWED_TIME = range(9)
"""Columns of `Trajectory.impacts`."""
IMPACT_COLUMNS = 9
BASIS_REASON = "basis_reason"
"""Entry of `Trajectory.counts`: why the run that estimates the error of the modal basis failed, or `ONE_COORDINATE`."""
ONE_COORDINATE = "one elastic coordinate is kept"
"""Reason why there is no such run: half of the coordinates of a body would be none."""
NO_MODE = "no elastic coordinate is a mode of the body"
CHANGING = "the basis of a body changes as its force moves"
PATCH_POINTS = "patch_points"
"""Entry of `Trajectory.counts`: points of each contact's patch on a curved surface, where they resolve it poorly."""
COARSE_MESHES = "coarse_meshes"
"""Entry of `Trajectory.counts`: those of several components whose meshes have most of the mesh's error."""
FRICTION_NOTES = "friction_notes"
"""Entry of `Trajectory.counts`: what is to be said of the coefficients of friction and of the start of contacts, one
sentence a line."""
EDGE_NOTES = "edge_notes"
"""Entry of `Trajectory.counts`: what is to be said of points that came past an edge, one sentence a line."""

LINKAGE_NOTES = "linkage_notes"
"""Entry of `Trajectory.counts`: what is to be said of the start of a mechanism, one sentence a line."""
ROTATION_NOTES = "rotation_notes"
"""Entry of `Trajectory.counts`: what is to be said of bodies that turned beyond small motion, one sentence a line."""
SAMPLE_NOTES = "sample_notes"
"""Entry of `Trajectory.counts`: what is to be said of probes that vibrate between samples, one sentence a line."""
RECORD_NOTES = "record_notes"
"""Entry of `Trajectory.counts`: what the record says twice and not alike, in one sentence."""
NOT_ESTIMATED = "not_estimated"
"""Entry of `Trajectory.counts`: why errors are not estimated, by source: `step`, `basis`, `mesh`."""
NOTES = (FRICTION_NOTES, LINKAGE_NOTES, ROTATION_NOTES, EDGE_NOTES, SAMPLE_NOTES, RECORD_NOTES)

WEAR = "wear"
"""Entry of `Trajectory.counts`: by joint that wears, lists over evenly spaced angles from zero, one for each touching
section: `impulse` [N s] and `load_distance`, force times sliding distance [N m], over the bearing,
`journal_load_distance` over the journal. By contact that wears, `load_distance` of each point and
`against_load_distance` of each function of its traction space."""


@dataclass(frozen=True)
class ContactHistory:
    """Histories of one contact."""

    body: str
    interface: str
    force: Array = field(
        metadata=rule(
            "s 3",
            finite=False,
            unit="N",
            name="mean resultant on the body over each sample interval",
            columns="x, y, z",
        )
    )
    """Resultant on the body, mean over each sample interval, so that its sum × interval is the impulse [N], (s, 3)."""
    multipliers: Array = field(
        metadata=rule("f c'", finite=False, unit="N", name="contact force of each point at each frame")
    )
    """Contact force of each point at each frame [N], (f, c)."""
    areas: Array | None = field(metadata=rule("c'", finite=False, unit="m^2", name="tributary areas"))
    """Tributary areas [m^2], (c,); None where the scene does not use them."""
    points: Array = field(
        metadata=rule(
            "c' 3", finite=False, unit="m", name="contact points from the component's origin", columns="x, y, z"
        )
    )
    """Contact points from the component's origin, along the scene's axes [m], (c, 3)."""
    master: Array | None = field(
        default=None,
        metadata=rule(
            "f u'",
            finite=False,
            unit="m",
            name="mean outward normal displacement under each traction function at each frame",
        ),
    )
    """For a contact on another body's traction space: mean outward normal displacement under each of its functions at
    each frame [m], (f, functions)."""
    path: Array | None = field(
        default=None,
        metadata=rule(
            "s 1|2",
            finite=False,
            unit="m",
            name="displacement along the force at the contact point, own and other body's",
        ),
    )
    """Path of a contact of one point: displacement along the force on the body, of its point and of the other body's,
    at the end of each sample interval [m], (s, 1 or 2)."""
    peak_multipliers: Array | None = field(
        default=None,
        metadata=rule("p c'", finite=False, unit="N", name="contact force of each point at each of peak_times"),
    )
    """Contact force of each point at each of `Trajectory.peak_times` [N], (p, c)."""
    peak_master: Array | None = field(
        default=None,
        metadata=rule(
            "p u'",
            finite=False,
            unit="m",
            name="mean outward normal displacement under each traction function at each of peak_times",
        ),
    )
    """Displacements as in `master`, at each of `Trajectory.peak_times` [m], (p, functions)."""
    friction: Array | None = field(
        default=None,
        metadata=rule(
            "f c' 3", finite=False, unit="N", name="friction on the body at each point at each frame", columns="x, y, z"
        ),
    )
    """Friction on the body at each point at each frame [N], (f, c, 3); None where the run kept none."""
    peak_friction: Array | None = field(
        default=None,
        metadata=rule(
            "p c' 3",
            finite=False,
            unit="N",
            name="friction on the body at each point at each of peak_times",
            columns="x, y, z",
        ),
    )
    """Friction forces as in `friction`, at each of `Trajectory.peak_times` [N], (p, c, 3)."""


@dataclass(frozen=True)
class JointHistory:
    """Histories of one joint."""

    body: str
    interface: str
    """Empty for joints of two markers."""
    angle: Array = field(metadata=rule("s", finite=False, unit="rad", name="crank angle, or angle of a joint"))
    """Of a crank, from its upper dead centre, at the end of each sample interval [rad], (s,); of a joint of two markers
    since the start, 0 where it has none."""
    force: Array = field(metadata=rule("s 3", finite=False, unit="N", name="force on the body", columns="x, y, z"))
    """On the body, mean over each sample interval [N], (s, 3); of a joint of two markers at its end."""
    violation: Array = field(metadata=rule("s", finite=False, unit="m", name="length error"))
    """Length error at the end of each sample interval [m], (s,)."""


@dataclass(frozen=True)
class ProbeHistory:
    """History of one probe."""

    kind: str
    """`displacement`, `velocity`, `acceleration`, `rotation`, `distance`, `force` or `centre`."""
    values: Array = field(
        metadata=rule("s *", finite=False, unit="as the group's unit", name="probe values; columns as the group's")
    )
    """At the end of each sample interval; accelerations and forces of contacts and joints: the mean over it, (s, k)."""
    unit: str
    """Of the values; `N, N m` of force and moment."""
    columns: str
    """Names of the k columns, separated by a comma and a blank."""
    snapped: float
    """Distance of the point that was read from the one asked for [m]."""


@dataclass(frozen=True)
class Trajectory(Labelled):
    """The results of a simulation: histories, frames and quantities."""

    result: str
    """A member name of `solver.Result`."""
    bodies: dict[str, str]
    """Key of each body's MorphRecord."""
    coordinate_offsets: Json
    """First coordinate of each body: its rigid ones (as many as its rigid twists), then its elastic ones."""
    times: Array = field(metadata=rule("s", finite=False, unit="s", name="ends of the sample intervals"))
    """Ends of the sample intervals [s], (s,)."""
    energies: Array = field(
        metadata=rule(
            "s 5",
            finite=False,
            unit="J",
            name="energies",
            columns="kinetic, strain, contact, dissipated, work of loads",
        )
    )
    """Kinetic, strain, contact (½ λᵀCλ) and dissipated energy, and the work of loads and joints so far, at the end of
    each interval [J], (s, 5)."""
    contacts: dict[str, ContactHistory]
    frame_times: Array = field(metadata=rule("f", finite=False, unit="s", name="times of the frames"))
    """[s], (f,)"""
    frames: Array = field(metadata=rule("f q", finite=False, unit="m kg^0.5", name="all coordinates at each frame"))
    """All coordinates at each frame [m kg^½], (f, coordinates)."""
    velocities: Array = field(
        metadata=rule("f q", finite=False, unit="m kg^0.5/s", name="rates of all coordinates at each frame")
    )
    """All velocities at each frame [m kg^½/s], (f, coordinates)."""
    quantities: Json
    """name → {"value", "unit"}."""
    energy_drift: float
    momentum_residual: float
    counts: Json
    """Steps, substeps per given step, steps in contact, pivots, coordinates, bytes read; `reason`, with figures, where
    the run left the range of its model; `basis_reason` where the run that estimates the error of the basis failed."""
    joints: dict[str, JointHistory] = field(default_factory=dict)
    motion: dict[str, Array] = field(
        default_factory=dict,
        metadata=MOTION,
    )
    """Rigid motion of each body at the end of each sample interval: translation and rotation of the centre of mass
    since the start [m, rad], their rates [m/s, rad/s], (s, 12)."""
    impacts: dict[str, Array] = field(
        default_factory=dict,
        metadata=rule(
            "b' 9",
            finite=False,
            unit="s, N, m/s",
            name="impacts of each contact",
            columns="begin [s], end [s], impulse [N s], peak [N], peak time [s], approach speed [m/s],"
            " separation speed [m/s], windowed peak [N], its time [s]",
        ),
    )
    """Contact by contact, each impact: first and last time [s], impulse [N s], largest force [N], its time [s],
    approach speed at the first time and separation speed at the last [m/s], largest mean force over the window [N],
    middle of this window [s], (b, 9). NaN where unknown."""
    gauges: dict[str, Array] = field(
        default_factory=dict,
        metadata=rule("s or s *", finite=False, unit="as the gauge of the modes", name="gauge values"),
    )
    """`body.gauge` → value at the end of each sample interval, (s, k)."""
    probes: dict[str, ProbeHistory] = field(default_factory=dict)
    peaks: Json = field(default_factory=dict)
    """Number of each contact's own largest force among `peak_times`; without those that were open throughout."""
    peak_times: Array | None = field(
        default=None,
        metadata=rule("p", finite=False, unit="s", name="sample of the largest mean force of each contact"),
    )
    """End of the sample of the largest mean force of each contact that ever closed [s], (p,). Pictures show a contact
    at this time."""
    peak_frames: Array | None = field(
        default=None, metadata=rule("p q", finite=False, unit="m kg^0.5", name="all coordinates at each of peak_times")
    )
    """All coordinates at each of `peak_times` [m kg^½], (p, coordinates)."""
    peak_velocities: Array | None = field(
        default=None,
        metadata=rule("p q", finite=False, unit="m kg^0.5/s", name="rates of all coordinates at each of peak_times"),
    )
    """All velocities at each of `peak_times` [m kg^½/s], (p, coordinates)."""
    estimates: Json = field(default_factory=dict)
    """Estimated relative errors of the run by name, such as `step.impulse`; empty where none was made."""

    def curve(self) -> tuple[str, np.ndarray, np.ndarray] | None:
        """Return the force of the contact with the largest one over time."""
        sizes = {name: np.linalg.norm(c.force, axis=1) for name, c in self.contacts.items()}
        name = max(sizes, key=lambda contact: sizes[contact].max(initial=0.0), default=None)
        if name is None:
            return None
        title = f"force of {name}, up to {sizes[name].max(initial=0.0):.4g} N, over {self.times[-1]:.4g} s"
        return title, self.times, sizes[name]
