"""Joints that hold bodies on the ground where nothing turns: what makes small motion of a scene with joints."""

from collections.abc import Callable, Mapping

from gudgeon.solver.joints import Joint
from gudgeon.solver.joints.markers import Fixed, Marked
from gudgeon.solver.joints.slider_crank import SliderCrank
from gudgeon.solver.scene.body import Body
from gudgeon.solver.scene.probe import PointProbe, Probe
from gudgeon.solver.scene.run import Run


def turning_cause(
    joints: Mapping[str, Joint], bodies: Mapping[str, Body], probes: Mapping[str, Probe], run: Run,
    deforms: Callable[[str], bool],
) -> str | None:  # fmt: skip
    """Return what makes the bodies of a scene with joints of two markers turn by any angle; None where each of them
    holds an interface of a body on the ground, and nothing asks for frames that turn.

    Args:
        deforms: Whether a body may deform.
    """
    joined = {joint.body for joint in joints.values() if isinstance(joint, Marked)}
    for name, joint in joints.items():
        element = f"joint '{name}'"
        if isinstance(joint, SliderCrank):
            if joint.body in joined:
                return f"{element} on body '{joint.body}', which another joint holds"
        elif not isinstance(joint, Fixed):
            return f"{element} of kind '{joint.kind}'"
        elif joint.against is not None:
            return f"{element} against body '{joint.against}'"
        elif joint.interface is None:
            return f"{element} at a point"
        elif joint.against_at is not None:
            return f"{element} with against_at"
        elif not deforms(joint.body):
            return f"{element} on body '{joint.body}', which does not deform"
    return _asked({name: bodies[name] for name in sorted(joined)}, probes, run)


def _asked(joined: Mapping[str, Body], probes: Mapping[str, Probe], run: Run) -> str | None:
    """Return what of bodies that joints hold asks for frames that turn."""
    if run.stepping != "auto":
        return f"run.stepping '{run.stepping}'"
    for name, body in joined.items():
        if options := {"attachment", "geometric_stiffness"} & body.model_fields_set:
            return f"body.{name}.{min(options)}"
        if any(body.velocity) or any(body.angular_velocity):
            return f"the velocity of body '{name}', which a joint holds"
    for name, probe in probes.items():
        if (
            isinstance(probe, PointProbe)
            and (probe.kind, probe.interface) == ("rotation", None)
            and probe.body in joined
        ):
            return f"probe '{name}' of the rotation of a frame"
    return None
