"""Checks of a scene before any stage runs: clearances, travel, the length of connecting rods, elastic bearings, bases
that change, and loads along which a part does not move."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gudgeon.pipeline.geometry.profile import ProfileTable
from gudgeon.pipeline.geometry.shapes.bar import Bar
from gudgeon.pipeline.geometry.shapes.beam import Beam
from gudgeon.pipeline.geometry.shapes.plane import PlanePart
from gudgeon.pipeline.scenes.change import deviation_of
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.solver.forces.external import ExternalForce
from gudgeon.solver.forces.given import GivenForce, GivenWrench
from gudgeon.solver.joints.clearance import Clearance
from gudgeon.solver.joints.slider_crank import SliderCrank

if TYPE_CHECKING:
    from gudgeon.pipeline.scenes.bodies import SceneFile
    from gudgeon.pipeline.scenes.component import Component

Shaped = tuple[Interface, dict[str, Any]]
"""An interface and the true shape of its surface."""
HEIGHTS, ANGLES = 121, 361
"""Points of the grid on which the least clearance of a skirt is searched."""
NEGLIGIBLE = 1e-6
"""Share of a load that may lie across: directions are given with some six digits."""


def misfits(scene: "SceneFile", folder: Path) -> list[str]:
    """List the misfits, one line each; of mesh files, which are unknown before meshing, and of turned bodies none.

    Raises:
        InputError: a profile table cannot be read.
    """
    lines = []
    for name, master in scene.masters().items():
        contact = scene.contact[name]
        slave = _surface(scene, contact.body, contact.interface)
        master_surface = _surface(scene, master.body, master.interface)
        if slave is None or master_surface is None or {slave[1]["kind"], master_surface[1]["kind"]} != {"cylinder"}:
            continue
        if any(scene.body[name].orientation is not None for name in (contact.body, master.body)):
            continue
        lines += _clearance(scene, folder, name, slave, master_surface)
        lines += _travel(scene, name, slave, master_surface)
    for name, joint in scene.cranks().items():
        pin = _rod_end(scene, joint)
        if pin is None:
            continue
        _, lateral = joint.axes
        body = scene.body[joint.body]
        turn = np.eye(3) if body.orientation is None else body.orientation.matrix()
        origin = turn @ pin + body.position
        offset = abs(float((origin - np.asarray(joint.centre)) @ lateral))
        if joint.rod_length <= joint.crank_radius + offset:
            lines.append(
                f"joint.{name}.rod_length: {joint.rod_length} m given; it must be above crank_radius plus the pin's"
                f" offset from the crank axis, {joint.crank_radius + offset:.6g} m"
            )
    return lines + wrong_swaps(scene) + dropped_loads(scene)


def wrong_swaps(scene: "SceneFile") -> list[str]:
    """Return a line for each component whose bases cannot change during the run."""
    lines = []
    for name, component in scene.component.items():
        if component.modes.swap is None:
            continue
        key = f"component.{name}.modes.swap"
        bodies = scene.bodies_of(name)
        forces = [force for force in scene.moving().values() if force.body in bodies]
        if len(bodies) != 1 or len(forces) != 1:
            lines.append(
                f"{key}: {len(bodies)} bodies and {len(forces)} forces of kind 'moving' are of component '{name}',"
                " needed: one of each, whose position determines the basis"
            )
        others = {"contact": scene.contact, "joint": scene.joint, "motion": scene.motion}
        others |= {"force": scene.fields() | scene.electrodes() | scene.external()}
        if excluded := [f"{table}.{n}" for table, members in others.items() for n in members]:
            lines.append(
                f"{key}: {excluded[0]} given; bases change in scenes of given forces, springs and bushings alone, leave"
                " out one of them"
            )
        if (integrator := scene.run.integrator) not in ("auto", "small"):
            lines.append(f"{key}: run.integrator '{integrator}' given, bases change with 'small'; use 'auto'")
    return lines


def _surface(scene: "SceneFile", body: str, interface: str) -> Shaped | None:
    """Return an interface with the shape of its surface; None for mesh files and faces without a true shape."""
    component = scene.component[scene.component_of(body)]
    shapes_of = getattr(component.geometry, "surface_shapes", None)
    if shapes_of is None:
        return None
    item = component.interface[interface]
    shape = shapes_of().get(item.surface)
    return None if shape is None else (item, shape)


def _rod_end(scene: "SceneFile", joint: SliderCrank) -> np.ndarray | None:
    """Return the point of a body that a rod holds, in the axes of the component [m], (3,); None where it is unknown."""
    if joint.interface is None:
        return np.asarray(joint.at or (0.0, 0.0, 0.0))
    end = _surface(scene, joint.body, joint.interface)
    return np.asarray(end[1]["origin"]) if end is not None and "origin" in end[1] else None


def _clearance(scene: "SceneFile", folder: Path, name: str, slave: Shaped, master: Shaped) -> list[str]:
    """Compare the largest radius of the sliding surface, profile included, with the bore."""
    contact = scene.contact[name]
    component = scene.component_of(contact.body)
    item = slave[0]
    owners = scene.component[component], scene.component[scene.component_of(scene.masters()[name].body)]
    radius, bore = (float(item[1]["radius"]) * (1 + owner.change.growth)
                    for item, owner in zip((slave, master), owners, strict=True))  # fmt: skip
    low, high = item.sector_deg or (-180.0, 180.0)
    theta = np.radians(np.linspace(low, high, ANGLES))
    moved = deviation_of(scene.component[component], folder, component)
    profile = moved[1] if moved is not None and moved[0] == item.surface else 0.0
    table = profile if isinstance(profile, ProfileTable) else None
    aside = np.asarray(scene.body[contact.body].position) - scene.body[scene.masters()[name].body].position
    deviation_max = float(profile.deviations.max() if isinstance(profile, ProfileTable) else profile)
    if bore - radius - deviation_max - float(np.hypot(aside[0], aside[1])) > 0:  # At any height and angle.
        return []
    bottom, top = item.height or (table.heights[[0, -1]] if table else (0.0, 0.0))
    z = np.linspace(bottom, top, HEIGHTS)
    deviation = profile.linear(z[:, None], theta) if isinstance(profile, ProfileTable) else profile
    out = aside[0] * np.cos(theta) + aside[1] * np.sin(theta)
    clearance = np.broadcast_to(bore - radius - deviation - out, (len(z), len(theta)))
    worst = np.unravel_index(np.argmin(clearance), clearance.shape)
    if clearance[worst] >= 0:
        return []
    fraction = float(np.mean(clearance < 0))
    height, angle, taken = z[worst[0]], theta[worst[1]], out[worst[1]]
    nearer = f"; {taken * 1e6:.3g} µm of it are taken by body.{contact.body}.position" if taken else ""
    there = bore - clearance[worst] - taken
    return [
        f"contact.{name}: the clearance is below zero on {f'{fraction:.0%}' if fraction >= 0.01 else 'under 1%'} of"
        f" '{contact.interface}', worst {clearance[worst] * 1e6:.3g} µm at height {height:.4g} m and"
        f" {np.degrees(angle):.0f} degrees, all along the stroke; the bore's radius is {bore} m, the"
        f" radius there {there:.7g} m{nearer}"
    ]


def _travel(scene: "SceneFile", name: str, slave: Shaped, master: Shaped) -> list[str]:
    """Check that the sliding surface stays within the height of the other one all along the stroke."""
    contact = scene.contact[name]
    rod, joint = next(((key, item) for key, item in scene.cranks().items() if item.body == contact.body), ("", None))
    pin_point = _rod_end(scene, joint) if joint is not None else None
    master_ends = scene.masters()[name]
    geometry = scene.component[scene.component_of(master_ends.body)].geometry
    length = getattr(geometry, "length", None)
    span = master[0].height or ((0.0, float(length)) if length is not None else None)
    if joint is None or pin_point is None or slave[0].height is None or span is None:
        return []
    along, lateral = joint.axes
    pin = pin_point + scene.body[contact.body].position
    turn = np.linspace(0.0, 2 * np.pi / joint.rate, 721)
    try:
        pin_path = joint.piston_pin(turn, float(pin @ lateral))[:, 0] - float(pin @ along)
    except ValueError:
        return []
    position, base = scene.body[contact.body].position, scene.body[master_ends.body].position
    shift = float((np.asarray(position) - base) @ along)
    low, high = slave[0].height[0] + pin_path.min() + shift, slave[0].height[1] + pin_path.max() + shift
    beyond = max(span[0] - low, high - span[1])
    if beyond <= 1e-9:
        return []
    return [
        f"contact.{name}: '{contact.interface}' travels from {low:.4g} to {high:.4g} m along '{master_ends.interface}',"
        f" which reaches from {span[0]:.4g} to {span[1]:.4g} m: {beyond * 1e3:.3g} mm too short; move"
        f" joint.{rod}.centre, or give a longer component.{scene.component_of(master_ends.body)}.geometry"
    ]


def wrong_bearings(scene: "SceneFile") -> list[str]:
    """Return what is wrong with the components of elastic bearings, a line each."""
    lines = []
    for name, owner in scene.bearings().items():
        joint, key = scene.hinges()[name], f"joint.{name}.bearing"
        assert isinstance(joint, Clearance)
        bearing = joint.bearing
        assert bearing is not None
        assert bearing.interface is not None
        if (component := scene.component.get(owner)) is None:
            lines.append(f"{key}.component: no component '{owner}'; the scene has {', '.join(scene.component)}")
        elif (interface := component.interface.get(bearing.interface)) is None:
            have = ", ".join(component.interface) or "none"
            lines.append(f"{key}.interface: no interface '{bearing.interface}', the component has {have}")
        elif interface.kind != "points":
            lines.append(
                f"{key}.interface: '{bearing.interface}' is of kind '{interface.kind}', kind 'points' is needed"
            )
        elif not component.supports:
            lines.append(f"{key}.component: '{owner}' has no supports; name where the bearing is held on its body")
        elif component.change.profile.table is not None and (joint.wear is None or not joint.wear.bearing_depth):
            lines.append(
                f"component.{owner}.change.profile.table: given, but the gap of joint '{name}' is round without its"
                f" depths in joint.{name}.wear.bearing_depth; give both, or none"
            )
    return lines


def dropped_loads(scene: "SceneFile") -> list[str]:
    """List the loads that act where a part of a plane or a line does not move by its kind, one line each.

    No support or joint bears them there, so that they would be dropped.
    """
    lines = []
    for name, settings in scene.body.items():
        component = scene.component.get(owner := scene.component_of(name))
        if component is None or component.modes.reduction == "rigid" or (able := _motions(component)) is None:
            continue
        Q = np.eye(3) if settings.orientation is None else settings.orientation.matrix()
        for key, force, moment in _loads(scene, name):
            for vector, axes in ((force, able[0]), (moment, able[1])):
                in_body = Q.T @ vector
                across = in_body - axes.T @ (axes @ in_body)
                size, dropped = float(np.linalg.norm(vector)), float(np.linalg.norm(across))
                if dropped > NEGLIGIBLE * size:
                    lines.append(
                        f"{key}: {vector.tolist()} given, of which {dropped / size:.3g} acts where"
                        f" body '{name}' does not move: {able[2]}; {_remedy(owner, component)}"
                    )
                    break
    return lines


def _motions(component: "Component") -> tuple[np.ndarray, np.ndarray, str] | None:
    """Return unit vectors of the displacements and the rotations of a part, (k, 3) each, and this in words."""
    geometry, axes = component.geometry, np.eye(3)
    if isinstance(geometry, Bar):
        return axes[:1], np.empty((0, 3)), "a bar moves along its axis alone"
    if isinstance(geometry, Beam) and geometry.motion == "plane":
        turn = np.cross(axes[2], geometry.axis)[None]
        return (
            axes[2:],
            turn,
            "a beam of motion 'plane' moves along z of its component alone, and turns across its axis",
        )
    if isinstance(geometry, PlanePart):
        return axes[:2], axes[2:], "a plane part moves in x and y of its component, and turns about z"
    return None


def _loads(scene: "SceneFile", body: str) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Yield the key of each load on a body with force and moment in the axes of the scene, (3,) each."""
    yield "run.gravity", np.asarray(scene.run.gravity, float), np.zeros(3)
    for name, force in scene.force.items():
        if getattr(force, "body", None) != body:
            continue
        if isinstance(force, GivenForce | ExternalForce) and force.direction is not None:
            yield f"force.{name}.direction", np.asarray(force.direction, float), np.zeros(3)
        elif isinstance(force, GivenWrench):
            yield f"force.{name}", np.asarray(force.force, float), np.asarray(force.moment, float)


def _remedy(owner: str, component: "Component") -> str:
    """Return what a part needs so that it moves in space."""
    if isinstance(component.geometry, Beam):
        return f"set component.{owner}.geometry.motion = 'space'"
    return f"turn the load, or make component '{owner}' a solid or a beam of motion 'space'"
