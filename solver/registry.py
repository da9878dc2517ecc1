"""The quantities of a run: one definition each, whichever integrator or full-FE model ran."""

import re
from collections.abc import Iterable
from typing import NamedTuple

WINDOW = "mean over the window of the mean over the window, `force_window`"
APART = "`run.window`"
WHOLE = "not limited"
STEPS = "mean over one step of the integrator; the force itself where its motion is exact"


class Quantity(NamedTuple):
    """A quantity of one kind of owner, written `OWNER.name`; an N in the name is a number from 1."""

    owner: str
    """`contact`, `body`, `force`, `joint`, `gauge` or `component`: what the quantity belongs to."""
    name: str
    unit: str
    definition: str
    sign: str
    bandwidth: str = WHOLE


_NORMAL = "positive: away from the obstacle or the other body"
_SIZE = "not negative"

UNESTIMATED = {
    "times": ("an error of time is not relative to a size; histories have estimates",
              re.compile(r"(start|end|\w*_time|slip\d+|stick\d+|slip_period|impact\d+\.(start|end|force_time))")),
    "raw forces": ("they have the cut-off frequency of the modes and do not converge",
                   re.compile(r"(impact\d+\.)?force_peak_raw")),
    "speeds and impulses of single impacts": ("those of all impacts together have estimates",
                                              re.compile(r"impact\d+\.(impulse|force_peak|approach_speed|separation_speed)")),
    "places and areas of pressure": ("they are of points of the mesh",
                                     re.compile(r"pressure_(patch|x|y|z)|centre_[xyz]|contact_area|edge_share|sliver_share")),
    "least gaps": ("a distance that nothing is relative to", re.compile(r"least_gap")),
    "places of wear": ("they are of sections and points", re.compile(r"\w*wear_(depth|angle|indentation)")),
}  # fmt: skip
"""Quantities without an estimated error, by what they are: why, and their names without owner."""


def unestimated(names: Iterable[str]) -> dict[str, str]:
    """Return why quantities of a run have no estimated error, by what they are.

    Args:
        names: Of the quantities, `OWNER.name`.
    """
    ends = {name.partition(".")[2] for name in names}
    return {
        kind: reason for kind, (reason, pattern) in UNESTIMATED.items() if any(pattern.fullmatch(end) for end in ends)
    }


REGISTRY: tuple[Quantity, ...] = (
    Quantity("contact", "impulse", "N s", "Size of the integral over the run of the resultant of the normal forces.",
             _SIZE),
    Quantity("contact", "impacts", "1", "Number of impacts: times in which a normal force acts, those separated by less"
             " than `run.window` counted as one.", _SIZE, APART),
    Quantity("contact", "start", "s", "Start of the first impact: zero of the gap of the point that touches, linear"
             " within a step.", _SIZE),
    Quantity("contact", "end", "s", "End of the last impact: the normal force becomes zero; the end of the run where it"
             " still acts.", _SIZE),
    Quantity("contact", "duration", "s", "From `start` to `end`, separations included.", _SIZE),
    Quantity("contact", "force_peak", "N", "Largest mean over the window of the mean over the window of the resultant"
             " of the normal forces, a weight that rises and falls linearly over W each: max |I(t + W) − 2 I(t) +"
             " I(t − W)| / W² with I its double integral and W the window, without force before and after the impact."
             " Absent where impacts are jumps of velocity and there is no window.", _SIZE, WINDOW),
    Quantity("contact", "force_window", "s", "The window W of `force_peak`: `run.window`, by default a tenth of the"
             " hardest impact, at most `resolved_window`; 0: the force is not averaged.", _SIZE),
    Quantity("contact", "force_resolved", "N", "As `force_peak`, over `resolved_window`: the force that the modes"
             " resolve. Given where `force_window` follows an impact and is below the shortest kept period.", _SIZE,
             "mean over the window of the mean over the window, `resolved_window`"),
    Quantity("contact", "resolved_window", "s", "The window of `force_resolved`, 2.5 periods of the highest kept"
             " frequency; one period with laws that begin at no stiffness.", _SIZE),
    Quantity("contact", "force_peak_raw", "N", "Largest resultant of the normal forces. It contains the cut-off"
             " frequency of the modal basis, and does not converge with the number of modes. Absent where impacts are"
             " jumps of velocity.", _SIZE, STEPS),
    Quantity("contact", "peak_time", "s", "Time t of `force_peak`, at which the weight is largest; of several with the"
             " same force, the middle of the first and the last within a window.", _SIZE, WINDOW),
    Quantity("contact", "rebound_velocity", "m/s", "Velocity of the centre of mass of the contact's body at the end of"
             " the run, along the impulse on it. Absent of a body that is held.", _NORMAL),
    Quantity("contact", "rebound_velocity_other", "m/s", "The same of the other body, along the same direction.",
             "positive: along the impulse on the contact's body; negative: away from it"),
    Quantity("contact", "restitution", "1", "Newton's ratio −(w·v after) / (w·v before) of the normal velocities of"
             " the rigid-body motion at the contact point, w the impulse of the normal forces on the rigid coordinates:"
             " the mean over the points, weighted by their impulses. Absent with other contacts, slider-cranks, forces"
             " or gravity, without an approach, and while the contact still acts at the end of the run.",
             "negative: the points still approach"),
    Quantity("contact", "impactN.start", "s", "Start of impact N, of the first ten.", _SIZE),
    Quantity("contact", "impactN.end", "s", "End of impact N.", _SIZE),
    Quantity("contact", "impactN.impulse", "N s", "Size of the integral over the impact of the resultant of the normal"
             " forces.", _SIZE),
    Quantity("contact", "impactN.force_peak", "N", "As `force_peak`, of impact N.", _SIZE, WINDOW),
    Quantity("contact", "impactN.force_peak_raw", "N", "As `force_peak_raw`, of impact N.", _SIZE, STEPS),
    Quantity("contact", "impactN.force_time", "s", "As `peak_time`, of impact N.", _SIZE, WINDOW),
    Quantity("contact", "impactN.approach_speed", "m/s", "Normal speed at which the first point touches, of the free"
             " gap.", "positive: approach"),
    Quantity("contact", "impactN.separation_speed", "m/s", "Normal speed at which the last point parts; absent where"
             " it has not.", "positive: separation"),
    Quantity("contact", "edge_share", "1", "Fraction of the impulses of all points that acts at points on the edge of"
             " an interface that covers a part of its surface; absent of others.", _SIZE),
    Quantity("contact", "pressure_peak", "Pa", "Largest mean pressure over a patch of the surface, at the frames and at"
             " the largest forces of contacts: a short pressure between frames may be larger, `run.frames` sets"
             " their number. Points with a sliver of area do not determine it.", _SIZE, "of the frames"),
    Quantity("contact", "pressure_patch", "m^2", "Area of this patch.", _SIZE),
    Quantity("contact", "pressure_time", "s", "Time of this pressure.", _SIZE, "of the frames"),
    *(
        Quantity("contact", f"pressure_{axis}", "m", f"Position of this pressure along {axis}, in the axes of its"
                 " component, from its origin.", f"positive: along {axis}")
        for axis in "xyz"
    ),
    *(
        Quantity("contact", f"centre_{axis}", "m", f"Centre of pressure along {axis} at the largest force, in"
                 " the axes of its component, from its origin; absent of a single point.", f"positive: along {axis}",
                 "of the frames")
        for axis in "xyz"
    ),
    Quantity("contact", "contact_area", "m^2", "Area of the points in contact at the largest force; absent on an"
             " obstacle without `surface_stiffness` and `wear`.", _SIZE, "of the frames"),
    Quantity("contact", "sliver_share", "1", "Fraction of the impulses that acts at points with a sliver of area;"
             " absent where it is zero.", _SIZE),
    Quantity("contact", "least_gap", "m", "Smallest gap of a contact that does not touch.", _SIZE,
             "of the samples, of elastic bodies of the frames, and curves between them"),
    Quantity("contact", "least_gap_time", "s", "Time of this gap.", _SIZE, "as the gap"),
    Quantity("contact", "slipN", "s", "Time at which a point begins to slip for the Nth time, of the first three.",
             _SIZE),
    Quantity("contact", "stickN", "s", "Time at which a point begins to stick for the Nth time, of the first three.",
             _SIZE),
    Quantity("contact", "slip_period", "s", "Time between the last two begins of slip.", _SIZE),
    Quantity("contact", "load_distance", "N m", "Integral over the run of force times sliding speed of a contact with"
             " `wear`, over all points, from the time `wear.after` on.", _SIZE),
    Quantity("contact", "wear_volume", "m^3", "Volume that the run wears off the surface of the contact's body, k/H"
             " times `load_distance` (Archard).", _SIZE),
    Quantity("contact", "wear_depth", "m", "Largest depth at a point that it wears off, volume over the point's area.",
             _SIZE),
    Quantity("contact", "against_wear_volume", "m^3", "As `wear_volume`, of the traction space over which the points"
             " slide.", _SIZE),
    Quantity("contact", "friction_work", "J", "Energy that friction takes over the run: its force times the speed of"
             " sliding, impacts included.", _SIZE),
    *(
        Quantity("body", f"{name}_{axis}", unit, definition.format(axis), f"positive: {along} {axis}")
        for name, unit, definition, along in (
            ("velocity", "m/s", "Velocity of the centre of mass along {} at the end of the run.", "along"),
            ("displacement", "m", "Displacement of the centre of mass along {} since the start.", "along"),
            ("angular_velocity", "rad/s", "Angular velocity about {} at the end of the run.", "right-handed about"),
            ("rotation", "rad", "Rotation about {} since the start.", "right-handed about"),
        )
        for axis in "xyz"
    ),
    Quantity("body", "joint_truncation", "1", "Fraction of the strain energy that the forces of joints at the"
             " interfaces of a body that rotates and deforms would cause as static ones, which its modes do not"
             " represent.",
             _SIZE, "of the samples"),
    Quantity("body", "inertia_truncation", "1", "Fraction of the strain energy that the rotation of a body that rotates"
             " and deforms would cause as a static load, which its modes do not represent.", _SIZE, "of the samples"),
    Quantity("force", "deflection_peak", "m", "Displacement of the largest size under a moving force, along it, at"
             " frames.", "positive: along the force", "of the frames"),
    Quantity("force", "peak_time", "s", "Time of `deflection_peak`.", _SIZE, "of the frames"),
    Quantity("force", "basis_changes", "1", "How often the basis of a body changes as a moving force passes"
             " (`modes.swap`).", _SIZE),
    Quantity("force", "energy_jump", "1", "Largest jump of the energy at such a change, over the energy of deformation"
             " before.", _SIZE),
    Quantity("force", "deflection_end", "m", "Displacement under a moving force, along it, at the end of the run.",
             "positive: along the force"),
    *(
        Quantity("joint", f"{kind}_{name}", unit if name == "peak" else "s", text.format(kind), _SIZE,
                 "of the samples, and of steps in which contacts of mechanisms press harder than before")
        for kind, unit in (("force", "N"), ("moment", "N m"))
        for name, text in (
            ("peak", "Largest size of the {} of a joint of two markers, on its body, about its point."),
            ("peak_time", "Time of the largest {} of a joint."),
        )
    ),
    Quantity("joint", "angle_end", "rad", "Angle of a revolute, cylindrical or screw joint at the end of the run, since"
             " the start, full turns included.", "right-handed about the axis"),
    Quantity("joint", "impulse", "N s", "Integral over the run of the normal force in a joint with clearance, the sum"
             " of its sections.", _SIZE),
    Quantity("joint", "load_distance", "N m", "Integral over the run of this force times the sliding speed: times a"
             " coefficient of wear over a hardness it is the worn volume (Archard), times one of friction the work.",
             _SIZE),
    Quantity("joint", "wear_volume", "m^3", "Volume that the run wears off the bearing of a joint with `wear`, k/H"
             " times `load_distance` from the time `wear.after` on; with a length, of both ends.", _SIZE),
    Quantity("joint", "wear_depth", "m", "Largest depth over the angle that the run wears off the bearing, in addition"
             " to that of its start.", _SIZE),
    Quantity("joint", "wear_angle", "rad", "Its angle, from the bearing's first axis at the start about its axis: that"
             " axis of the scene, x before y before z, that is most nearly across it.", "right-handed about the axis"),
    Quantity("joint", "journal_wear_volume", "m^3", "As `wear_volume`, of the journal.", _SIZE),
    Quantity("joint", "journal_wear_depth", "m", "As `wear_depth`, of the journal.", _SIZE),
    Quantity("joint", "journal_wear_angle", "rad", "As `wear_angle`, on the journal, which turns.",
             "right-handed about the axis"),
    Quantity("joint", "wear_indentation", "m", "Mean indentation of a joint with `wear`, weighted by force times"
             " sliding speed: what `wear.indentation` is to be.", _SIZE),
    Quantity("joint", "impacts", "1", "Number of contacts of a joint with clearance, of each section by itself.",
             _SIZE),
    Quantity("joint", "start", "s", "Begin of its first contact.", _SIZE),
    Quantity("joint", "end", "s", "End of its last contact; the end of the run where it still acts.", _SIZE),
    Quantity("joint", "duration", "s", "From `start` to `end`, separations included.", _SIZE),
    Quantity("joint", "force_peak_raw", "N", "Largest normal force of a section of a joint with clearance.", _SIZE,
             "by parabolas through eight values a step"),
    Quantity("joint", "impactN.start", "s", "Begin of contact N of a joint with clearance, of the first ten.", _SIZE),
    Quantity("joint", "impactN.end", "s", "End of contact N.", _SIZE),
    Quantity("joint", "impactN.impulse", "N s", "Integral of its normal force.", _SIZE),
    Quantity("joint", "impactN.force_peak_raw", "N", "As `force_peak_raw`, of contact N.", _SIZE,
             "by parabolas through eight values a step"),
    Quantity("joint", "impactN.approach_speed", "m/s", "Rate of the indentation as contact N begins.",
             "positive: approach"),
    Quantity("joint", "impactN.separation_speed", "m/s", "The same as it ends; absent where it has not.",
             "positive: separation"),
    Quantity("gauge", "von_mises_peak", "Pa", "Largest von Mises stress of a gauge that records a stress tensor, at"
             " samples.", _SIZE, "of the samples"),
    *(
        Quantity("gauge", f"{name}_peak", unit, f"Value of the largest size of {text}, at samples.",
                 "as of the gauge", "of the samples")
        for name, unit, text in (
            ("stress", "Pa", "the stress at a fibre or along the direction of a gauge"),
            ("strain", "1", "the strain at a fibre or along the direction of a gauge"),
            ("bending_moment", "N m", "the bending moment of a section"),
            ("shear_force", "N", "the shear force of a section"),
        )
    ),
    Quantity("gauge", "peak_time", "s", "Time of the largest size of a gauge that records one number.", _SIZE,
             "of the samples"),
    *(
        Quantity("probe", f"{kind}_{name}", unit if name != "peak_time" else "s", text.format(kind), sign,
                 "of the samples")
        for kind, unit in (
            ("displacement", "m"), ("velocity", "m/s"), ("acceleration", "m/s^2"), ("rotation", "rad"),
            ("distance", "m"), ("force", "N"),
        )
        for name, text, sign in (
            ("peak", "Value of the largest size of the {} of a probe, of a vector its length.", "as of the probe"),
            ("peak_time", "Time of the largest {} of a probe.", _SIZE),
            ("end", "The {} of a probe at the end of the run, of a vector its length.", "as of the probe"),
        )
    ),
    Quantity("component", "frequencyN", "Hz", "Natural frequency N of a component, in scenes that compare frequencies.",
             _SIZE),
)  # fmt: skip
"""All quantities, in the order of the documentation."""


def names(owner: str) -> list[str]:
    """Return the names of the quantities of one kind of owner."""
    return [q.name for q in REGISTRY if q.owner == owner]


def definition(name: str, owners: Iterable[str]) -> Quantity | None:
    """Return the quantity of a name without its owner, such as `impact3.start`; None where no owner has it.

    Args:
        owners: Kinds of owners.
    """
    general = re.sub(r"^(impact|slip|stick|frequency)[1-9]\d*", r"\1N", name)
    return next((q for q in REGISTRY if q.owner in owners and q.name == general), None)
