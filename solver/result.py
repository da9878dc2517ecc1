"""The ways in which a run can end, each with the message for its user."""

from enum import Enum


class RunStopped(Exception):
    """Raised by a progress callback to stop a run, whose frames so far become its result."""


class Result(Enum):
    """How a simulation ended."""

    FINISHED = "finished"
    DIVERGED = "the solution overflowed; check the masses, stiffnesses and velocities of the scene"
    DEPENDENT_ROWS = (
        "the contact forces are not unique: contact points coincide, or there are more points than independent"
        " coordinates; use fewer points, coarsen the interface, or set contact.NAME.surface_stiffness"
    )
    INCOMPLETE = (
        "the motion between two events has no modal decomposition: a dashpot is critically damped, or slip couples with"
        " a dashpot or drives the motion; remove one of them, or select another run.integrator"
    )
    CHATTER = (
        "the contacts open and close infinitely often within zero time; use method 'residual', which has no impact law"
    )
    IMPACTS = (
        "more than 65536 impacts ended within one frame; set run.window to count those that follow each other more"
        " closely as one, or increase run.frames"
    )
    NOT_CONVERGED = (
        "the iteration for the contact force of a step did not converge; reduce run.step where it is set, change the"
        " stiffness or the exponent of the contact law, or look for a joint or a motion that pushes into rigid contact"
    )
    INACCURATE = (
        "impulses, forces or the energy balance change by more than run.accuracy with the step, at every step tried;"
        " shorten run.duration, increase run.accuracy, or set run.step, whose error is then estimated, not limited"
    )
    ENERGY = (
        "the energy error exceeds 5 % of the energy exchanged, in contacts where there are; reduce the step where it"
        " has one, or set run.accuracy"
    )
    SURFACE_LEFT = (
        "points left the sliding surface that they pressed, and the energy of what they pressed in was lost; widen"
        " component.NAME.interface.NAME.extent or the part between heights and angles, or shorten run.duration"
    )
    ROTATION = (
        "a body turned or bent by more than run.limits.angle: motion is linear and gyroscopic terms are missing;"
        " shorten run.duration, set run.integrator to 'turning' for free bodies and joints of two markers, or raise"
        " run.limits.angle"
    )
    DEFLECTION = (
        "a body that turns deformed by more than run.limits.deflection: its deformation is of second order; check its"
        " material and loads, shorten run.duration, or raise run.limits.deflection"
    )
    OFFSET = (
        "the points of a contact moved aside by more than run.limits.offset; shorten run.duration, or raise"
        " run.limits.offset"
    )
    FACE_TURNED = (
        "the face of a patch turned into what it meets, whose one force does not hold it; set"
        " component.NAME.interface.NAME.kind to 'points'"
    )
    SLIP_ACROSS = (
        "a contact point moved across its line of friction: friction acts along contact.NAME.friction.direction only"
    )
    JAMMED = (
        "the steps of the mechanism became too short: its joints jam, or reach a position beyond which they cannot"
        " move, or a body of attachment 'fixed' deforms beyond its range (take 'mean-axis'); check lengths and drives,"
        " or shorten run.duration"
    )
    HALF_TURN = (
        "a bushing was turned by nearly a half turn, beyond which its rotation is not defined; hold the rotation by a"
        " joint, increase its rotational_stiffness, or shorten run.duration"
    )
    WORN_THROUGH = (
        "the wear of a joint went through its wall; increase joint.NAME.wear.thickness, or shorten run.duration or the"
        " number of cycles"
    )
    OVERLOADED = (
        "the force on an elastic bearing exceeded that which it is tabulated for; increase joint.NAME.bearing.load"
    )
    FIELD_LEFT = (
        "a body left the grid of poses of an electrostatic field, or plates touched; widen the grid, or stop the body"
        " before by a contact"
    )
    STOPPED = "the run was stopped; its results end with the last frame before"
    RESTITUTION = (
        "an impact would increase the energy: Newton's restitution is not admissible with this friction; reduce"
        " contact.NAME.restitution"
    )

    @property
    def ok(self) -> bool:
        """Whether the run finished, so that its results can be used."""
        return self is Result.FINISHED
