"""Checks of a scene of bodies: keys, names, tables and fit of the parts, before any stage runs."""

import difflib
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.fit import misfits, wrong_bearings
from gudgeon.pipeline.scenes.reading import check_scene, find_file, named, refuse
from gudgeon.pipeline.scenes.tables import check_closed, read_cycle, read_knots, read_pairs
from gudgeon.solver.joints.coupled import Driven
from gudgeon.solver.joints.markers import Distance, Spherical
from gudgeon.solver.registry import definition, names
from gudgeon.solver.scene.body import ALL_FREE

if TYPE_CHECKING:
    from gudgeon.pipeline.scenes.bodies import SceneFile
    from gudgeon.pipeline.scenes.gauge import Gauge


Model = TypeVar("Model", bound=BaseModel)
POINTS = ("points", "patch")
"""Kinds of interface for contacts."""
WITH_STATICS = (
    "row-craig-bampton",
    "rubin",
    "rubin-macneal",
    "craig-bampton",
    "interface",
    "partial-interface",
    "attachment",
)
"""Reductions whose modes hold the static shapes of interfaces."""
UNRESOLVED = ("bar", "beam", "frame", "rigid")
"""Geometries that do not resolve local compliance."""


def checked(path: Path, tables: Mapping[str, Any], model: "type[SceneFile]") -> "SceneFile":
    """Return the scene that tables of the file `path` describe.

    Raises:
        InputError: every mistake of one kind, one a line.
    """
    scene = check_scene(path, tables, model)
    refuse(path, _wrong_names(scene))
    with named(path, InputError):
        scene = _with_tables(scene, path.parent)
        lines = misfits(scene, path.parent)
    refuse(path, lines)
    return scene


def _wrong_names(scene: "SceneFile") -> list[str]:
    lines = []
    for body, settings in scene.body.items():
        if (name := scene.component_of(body)) not in scene.component:
            lines.append(f"body.{body}.component: no component '{name}'; the scene has {', '.join(scene.component)}")
            continue
        have = scene.component[name].gauge
        unknown = [gauge for gauge in settings.gauges if gauge not in have]
        lines += [f"body.{body}.gauges: no gauge '{g}', the component has {', '.join(have) or 'none'}" for g in unknown]
        wide = [gauge for gauge in settings.gauges if gauge in have and have[gauge].surface is not None]
        lines += [f"body.{body}.gauges: '{g}' is a surface, for pictures only; name stations and points" for g in wide]
    sliding = scene.masters()
    wanted: list[tuple[str, str, str, tuple[str, ...]]] = [
        (f"contact.{n}.interface", c.body, c.interface, POINTS) for n, c in scene.contact.items()
    ]
    wanted += [
        (f"contact.{n}.against.interface", o.body, o.interface, ("traction",) if n in sliding else POINTS)
        for n, o in scene.others().items()
    ]
    wanted += _held_interfaces(scene)
    wanted += [(f"force.{n}.interface", f.body, f.interface, ("pressure",)) for n, f in scene.gas().items()]
    wanted += [(f"force.{n}.interface", f.body, f.interface, ("traction",)) for n, f in scene.moving().items()]
    for name, force in scene.over_time().items():
        if (interface := getattr(force, "interface", None)) is not None and force.surface is not None:
            wanted.append((f"force.{name}.interface", force.body, interface, (force.surface,)))
    for name, spring in (scene.springs() | scene.fields()).items():
        able = ("mean", "tie", *(("points", "patch") if spring.kind == "spring" else ()))
        if spring.interface is not None:
            wanted.append((f"force.{name}.interface", spring.body, spring.interface, able))
        if spring.against is not None and spring.against_interface is not None:
            wanted.append((f"force.{name}.against_interface", spring.against, spring.against_interface, able))
    wanted += [(f"force.{n}.interface", f.body, f.interface, ("points",)) for n, f in scene.electrodes().items()]
    for name, motion in scene.motion.items():
        if motion.interface is not None:
            able = ("tie",) if motion.kind == "rotation" else ("mean", "tie")
            wanted.append((f"motion.{name}.interface", motion.body, motion.interface, able))
    for name, probe in scene.probe.items():
        read = ("mean", "tie", "points", "patch")
        if probe.kind in ("force", "centre"):
            continue
        for key, at in (("interface", "body"), ("against_interface", "against")):
            if (interface := getattr(probe, key, None)) is not None:
                wanted.append((f"probe.{name}.{key}", getattr(probe, at), interface, read))
    for where, body, interface, kinds in wanted:
        component = scene.component.get(scene.component_of(body))
        if component is None:
            continue
        if interface not in component.interface:
            have = ", ".join(component.interface) or "none"
            near = difflib.get_close_matches(interface, component.interface, 1)
            hint = f"did you mean '{near[0]}'? " if near else ""
            lines.append(f"{where}: no interface '{interface}', {hint}the component has {have}")
        elif (got := component.interface[interface].kind) not in kinds:
            needed = " or ".join(f"'{kind}'" for kind in kinds)
            lines.append(f"{where}: interface '{interface}' is of kind '{got}', kind {needed} is needed")
    lines += _wrong_sensors(scene) + wrong_bearings(scene)
    lines += _without_statics(scene) + _wrong_points(scene)
    return lines + _wrong_turning(scene) + _counted_twice(scene) + _unknown_quantities(scene)


def _held_interfaces(scene: "SceneFile") -> list[tuple[str, str, str, tuple[str, ...]]]:
    """Return key, body, name and kinds of the interfaces that joints of two markers and attachments name."""
    able: tuple[str, ...] = ("tie", "mean") if scene.capabilities.turns else ("mean",)
    wanted: list[tuple[str, str, str, tuple[str, ...]]] = [
        (f"joint.{n}.interface", j.body, j.interface, able) for n, j in scene.cranks().items() if j.interface
    ]
    for name, hinge in scene.hinges().items():
        able = ("tie", "mean") if isinstance(hinge, Distance | Spherical) else ("tie",)
        if hinge.interface is not None:
            wanted.append((f"joint.{name}.interface", hinge.body, hinge.interface, able))
        if hinge.against is not None and hinge.against_interface is not None:
            wanted.append((f"joint.{name}.against_interface", hinge.against, hinge.against_interface, able))
    for name, body in scene.body.items():
        if body.attached_to is not None:
            wanted.append((f"body.{name}.attached_to", name, body.attached_to, ("tie",)))
    return wanted


def _pressed_interfaces(scene: "SceneFile") -> list[tuple[str, str, str, tuple[str, ...]]]:
    """Return the same of the loads, springs and bushings of bodies that turn by any angle."""
    if not scene.turns_by_choice:
        return []
    wanted: list[tuple[str, str, str, tuple[str, ...]]] = []
    for name, load in scene.turning_loads().items():
        if (interface := getattr(load, "interface", None)) is not None and load.surface is not None:
            wanted.append((f"force.{name}.interface", load.body, interface, (load.surface,)))
    for name, spring in scene.springs().items():
        able = ("mean", "tie") if name in scene.point_springs() else ("tie",)
        if spring.interface is not None:
            wanted.append((f"force.{name}.interface", spring.body, spring.interface, able))
        if spring.against is not None and spring.against_interface is not None:
            wanted.append((f"force.{name}.against_interface", spring.against, spring.against_interface, able))
    return wanted


def _without_statics(scene: "SceneFile") -> list[str]:
    """List joints at interfaces whose static shapes the body's modes lack: residual flexibility does not act there."""
    if not (scene.capabilities.turns or scene.held()):
        return []
    lines = []
    for where, body, interface, _ in _held_interfaces(scene) + _pressed_interfaces(scene):
        component = scene.component.get(name := scene.component_of(body))
        if component is None or interface not in component.interface or not where.startswith(("joint.", "force.")):
            continue
        if component.modes.reduction in (*WITH_STATICS, "rigid"):
            continue
        lines.append(
            f"component.{name}.modes.reduction: '{component.modes.reduction}' has no static shape of interface"
            f" '{interface}', so that {where.rpartition('.')[0]} would act on a body that is too stiff; allowed:"
            f" {', '.join(WITH_STATICS)}"
        )
    return list(dict.fromkeys(lines))


def _wrong_points(scene: "SceneFile") -> list[str]:
    """List joints at points of bodies that deform."""
    points = [(f"joint.{n}.at", j.body, "mean") for n, j in scene.cranks().items() if j.at is not None]
    points += [(f"joint.{n}.at", j.body, "tie") for n, j in scene.hinges().items() if j.at is not None]
    for name, hinge in scene.hinges().items():
        if hinge.against is not None and hinge.against_at is not None:
            points.append((f"joint.{name}.against_at", hinge.against, "tie"))
    lines = []
    for where, body, kind in points:
        component = scene.component.get(scene.component_of(body))
        if component is not None and "rigid" not in (component.geometry.kind, component.modes.reduction):
            lines.append(
                f"{where}: body '{body}' deforms, and is held at interfaces; give one of kind '{kind}', or"
                f" component.{scene.component_of(body)}.modes.reduction = 'rigid'"
            )
    return lines


def _wrong_turning(scene: "SceneFile") -> list[str]:
    """List what a scene has that its bodies, which turn and which joints alone hold, cannot have."""
    lines = []
    if not scene.capabilities.turns:
        if scene.run.stepping != "auto":
            lines.append(
                f"run.stepping: '{scene.run.stepping}' given, but integrator '{scene.integrator}' has steps of its own;"
                " it is for bodies that turn by any angle (integrator 'mechanism')"
            )
        for name, body in scene.body.items():
            given = [key for key in ("attachment", "geometric_stiffness") if key in body.model_fields_set]
            lines += [
                f"body.{name}.{key}: given, but integrator '{scene.integrator}' has small rotations; it is for bodies"
                " that turn by any angle (integrator 'mechanism')"
                for key in given
            ]
        return lines
    for name, body in scene.body.items():
        component = scene.component.get(owner := scene.component_of(name))
        if component is None:
            continue
        if component.supports:
            lines.append(f"component.{owner}.supports: body '{name}' turns by any angle; hold it by a joint instead")
        if tuple(body.freedom) != ALL_FREE:
            lines.append(f"body.{name}.freedom: the body turns by any angle; hold it by a joint instead")
    return list(dict.fromkeys(lines))


def _unknown_quantities(scene: "SceneFile") -> list[str]:
    """List the names in `report.quantities` that no run of the scene can have, each with the names that are allowed,
    and the contacts, joints, moving forces and probes of forces that have the same quantities."""
    owners = _owners(scene)
    lines = [
        f"contact.{name}: a {other} '{name}' has quantities of the same names; give the contact another name"
        for name in scene.contact for other in ("joint", "force") if other in owners[name]
    ] + [
        f"probe.{name}: a contact or joint has '{name}.force_peak' too; give the probe another name"
        for name, probe in scene.probe.items() if probe.kind == "force" and {*owners[name]} & {"contact", "joint"}
    ]  # fmt: skip
    for name in scene.report.quantities:
        owner = next((one for one in owners if name.startswith(f"{one}.")), None)
        if owner is None:
            have = ", ".join(owners)
            lines.append(f"report.quantities: '{name}' belongs to nothing in the scene, which has {have}")
        elif definition(rest := name[len(owner) + 1 :], owners[owner]) is None:
            able = [one for kind in owners[owner] for one in names(kind)]
            near = difflib.get_close_matches(rest, able, 1)
            hint = f"; did you mean '{owner}.{near[0]}'?" if near else ";"
            kinds = " and ".join(owners[owner])
            lines.append(f"report.quantities: no {kinds} has '{rest}'{hint} allowed are {', '.join(able)}")
    return lines


def _wrong_sensors(scene: "SceneFile") -> list[str]:
    """List the sensors that name what the scene does not have, or gauges that are no strain gauges."""
    lines = []
    wrenches = [name for name, force in scene.force.items() if force.kind == "wrench"]
    for name, sensor in scene.sensor.items():
        where = f"sensor.{name}"
        if sensor.body not in scene.body:
            lines.append(f"{where}.body: no body '{sensor.body}'; the scene has {', '.join(scene.body)}")
            continue
        if sensor.force is not None and sensor.force not in wrenches:
            have = ", ".join(wrenches) or "none"
            lines.append(f"{where}.force: no force '{sensor.force}' of kind 'wrench'; the scene has {have}")
        own, part = scene.body[sensor.body].gauges, scene.component.get(scene.component_of(sensor.body))
        if not own:
            lines.append(f"{where}.body: body '{sensor.body}' names no gauges; list them in body.{sensor.body}.gauges")
        for channel, bridge in sensor.channels(tuple(own)).items():
            key = f"{where}.channel.{channel}.gauges"
            for gauge in bridge.gauges:
                if gauge not in own:
                    have = ", ".join(own) or "none"
                    lines.append(f"{key}: no '{gauge}' in body.{sensor.body}.gauges, which has {have}")
                elif part is not None and not _strains(part.gauge.get(gauge)):
                    lines.append(
                        f"{key}: '{gauge}' is no strain gauge; give it quantity = 'strain', at a point a direction"
                    )
    return list(dict.fromkeys(lines))


def _strains(gauge: "Gauge | None") -> bool:
    """Whether a gauge has one strain; also of one that is missing, which is said elsewhere."""
    if gauge is None:
        return True
    return gauge.quantity == "strain" and (gauge.point is None or gauge.direction is not None) and gauge.surface is None


def possible_quantities(scene: "SceneFile") -> list[str]:
    """Return the names of all quantities that a run of the scene may have, numbered ones from 1 to 20."""
    found = [f"{owner}.{name}" for owner, kinds in _owners(scene).items() for kind in kinds for name in names(kind)]
    numbered = [[re.sub(r"N(?=\.|$)", str(n), one) for n in range(1, 21)] for one in found]
    return list(dict.fromkeys(name for one in numbered for name in one))


def _owners(scene: "SceneFile") -> dict[str, list[str]]:
    """Return the kinds of each name that owns quantities, gauges before their bodies."""
    kinds = {
        "gauge": [f"{name}.{gauge}" for name, body in scene.body.items() for gauge in body.gauges],
        "contact": scene.contact,
        "body": scene.body,
        "force": scene.moving(),
        "joint": {**scene.hinges(), **(scene.cranks() if scene.capabilities.turns else {})},
        "probe": scene.probe,
        "component": scene.component,
    }
    found: dict[str, list[str]] = {}
    for kind, owners in kinds.items():
        for owner in owners:
            found.setdefault(owner, []).append(kind)
    return found


def _counted_twice(scene: "SceneFile") -> list[str]:
    """List contact laws with local compliance on solids, whose meshes resolve it themselves."""
    lines = []
    for name, contact in scene.contact.items():
        if contact.law is None or contact.method != "residual":
            continue
        other = scene.others().get(name)
        for body in (contact.body, *([other.body] if other is not None else [])):
            component = scene.component.get(scene.component_of(body))
            if component is not None and component.geometry.kind not in UNRESOLVED:
                lines.append(
                    f"contact.{name}.law: '{contact.law.kind}' and R of the solid '{scene.component_of(body)}' count"
                    " the local compliance twice; use method 'penalty' or remove the law"
                )
    return lines


def _with_tables(scene: "SceneFile", folder: Path) -> "SceneFile":
    """Return the scene with the values of the tables that its bodies and forces name."""
    bodies = dict(scene.body)
    for name, body in scene.body.items():
        if body.damping is not None and body.damping.table is not None:
            where = f"body.{name}.damping.table"
            path = find_file(body.damping.table, folder, where)
            values = read_pairs(path, "frequency [Hz] and damping ratio")
            bodies[name] = body.model_copy(update={"damping": _tabled(body.damping, path, values)})
    forces: dict[str, Any] = dict(scene.force)
    for name, force in scene.gas().items():
        if force.table is not None:
            values = read_cycle(find_file(force.table, folder, f"force.{name}.table"))
            force = force.model_copy(update={"values": values})
        else:
            check_closed(f"force.{name}.values", np.array(force.values))
        forces[name] = force
    motions, joints = dict[str, Any](scene.motion), dict[str, Any](scene.joint)
    drives = {name: one for name, one in scene.joint.items() if isinstance(one, Driven)}
    given = (("force", scene.over_time(), forces), ("motion", scene.motion, motions), ("joint", drives, joints))
    for table, amounts, found in given:
        for name, amount in amounts.items():
            found[name] = _over_time(amount, f"{table}.{name}", folder, scene.run.duration)
    for name, force in scene.springs().items():
        if force.kind == "spring" and force.table is not None:
            values = read_knots(find_file(force.table, folder, f"force.{name}.table"))
            forces[name] = force.model_copy(update={"values": values})
    return scene.model_copy(update={"force": forces, "body": bodies, "motion": motions, "joint": joints})


def _over_time(amount: Any, where: str, folder: Path, duration: float) -> Any:
    """Return an amount over time with the values of its table; refuse one that does not reach over a run [s]."""
    if amount.table is not None:
        path = find_file(amount.table, folder, f"{where}.table")
        amount = _tabled(amount, path, read_pairs(path, "time [s] and amount"))
    if (reason := amount.refusal(duration)) is not None:
        raise InputError(f"{where}.{reason}")
    return amount


def _tabled(model: Model, path: Path, values: tuple[tuple[float, float], ...]) -> Model:
    """Return a model with the values of the table that it names, checked as those of a scene; rows from 2 on."""
    try:
        return type(model).model_validate(model.model_dump() | {"values": values})
    except ValidationError as error:
        first = error.errors()[0]
        row, *column = [part for part in first["loc"] if isinstance(part, int)] or [0]
        given = f"{values[row][column[0]]:g} given; " if column else ""
        text = first["msg"].removeprefix("Value error, ").removeprefix(given)
        raise InputError(f"{path}: row {row + 2}: {given}{text[0].lower()}{text[1:]}") from None
