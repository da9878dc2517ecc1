"""Joints that hold bodies on the ground where nothing turns: what makes small motion of a scene with joints."""

from typing import TYPE_CHECKING

from gudgeon.solver.joints.markers import Fixed, Marked
from gudgeon.solver.joints.slider_crank import SliderCrank
from gudgeon.solver.scene.probe import PointProbe

if TYPE_CHECKING:
    from gudgeon.solver.scene.scene import Scene


def turning_cause(scene: "Scene") -> str | None:
    """Return what makes the bodies of a scene with joints of two markers turn by any angle; None where each of them
    holds an interface of a body on the ground, and nothing asks for frames that turn."""
    for name, joint in scene.joint.items():
        if not isinstance(joint, SliderCrank | Fixed):
            return f"joint '{name}' of kind '{joint.kind}'" if isinstance(joint, Marked) else f"joint '{name}'"
    for name, joint in scene.hinges().items():
        if joint.against is not None:
            return f"joint '{name}' against body '{joint.against}'"
        if joint.interface is None or joint.against_at is not None:
            return f"joint '{name}' at a point" if joint.interface is None else f"joint '{name}' with against_at"
        if not scene.deforms(joint.body):
            return f"joint '{name}' on body '{joint.body}', which does not deform"
    held = {joint.body for joint in scene.hinges().values()}
    for name, crank in scene.cranks().items():
        if crank.body in held:
            return f"joint '{name}' on body '{crank.body}', which another joint holds"
    return _asked(scene, held)


def _asked(scene: "Scene", held: set[str]) -> str | None:
    """Return what of bodies that joints hold, by name, asks for frames that turn."""
    if scene.run.stepping != "auto":
        return f"run.stepping '{scene.run.stepping}'"
    for name in sorted(held):
        body = scene.body[name]
        if given := {"attachment", "geometric_stiffness"} & body.model_fields_set:
            return f"body.{name}.{min(given)}"
        if any(body.velocity) or any(body.angular_velocity):
            return f"the velocity of body '{name}', which a joint holds"
    for name, probe in scene.probe.items():
        framed = isinstance(probe, PointProbe) and probe.kind == "rotation" and probe.interface is None
        if framed and probe.body in held:
            return f"probe '{name}' of the rotation of a frame"
    return None
