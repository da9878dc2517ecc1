"""Checks of a scene of bodies: keys, names, tables and fit of the parts, before any stage runs."""

import difflib
import re
from collections.abc import Callable, Mapping
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
from gudgeon.solver.scene.refusals import suggestion

if TYPE_CHECKING:
    from gudgeon.pipeline.scenes.bodies import SceneFile
    from gudgeon.pipeline.scenes.gauge import Gauge


Model = TypeVar("Model", bound=BaseModel)
Named = tuple[str, str, str, tuple[str, ...]]
"""Key, body and name of an interface that a scene names, and the kinds that it may have."""
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
    lines = _wrong_gauges(scene)
    for key, body, interface, kinds in _named_interfaces(scene):
        component = scene.component.get(scene.component_of(body))
        if component is None:
            continue
        if interface not in component.interface:
            have = ", ".join(component.interface) or "none"
            hint = suggestion(interface, component.interface)
            lines.append(f"{key}: no interface '{interface}', {hint}the component has {have}")
        elif (got := component.interface[interface].kind) not in kinds:
            needed = " or ".join(f"'{kind}'" for kind in kinds)
            lines.append(f"{key}: interface '{interface}' is of kind '{got}', kind {needed} is needed")
    lines += _wrong_sensors(scene) + wrong_bearings(scene)
    lines += _without_statics(scene) + _wrong_points(scene)
    return lines + _wrong_turning(scene) + _counted_twice(scene) + _unknown_quantities(scene)


def _wrong_gauges(scene: "SceneFile") -> list[str]:
    """List the bodies whose component, or one of whose gauges, the scene does not have."""
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
    return lines


def _named_interfaces(scene: "SceneFile") -> list[Named]:
    """Return all interfaces that a scene names."""
    sliding, over_time = scene.masters(), {n: f for n, f in scene.over_time().items() if _surface_of(f) is not None}
    named: list[Named] = [(f"contact.{n}.interface", c.body, c.interface, POINTS) for n, c in scene.contact.items()]
    named += [
        (f"contact.{n}.against.interface", o.body, o.interface, ("traction",) if n in sliding else POINTS)
        for n, o in scene.others().items()
    ]
    named += _held_interfaces(scene)
    named += _ends("force", scene.gas(), lambda gas: ("pressure",))
    named += _ends("force", scene.moving(), lambda force: ("traction",))
    named += _ends("force", over_time, lambda force: (force.surface,))
    able = {"spring": ("mean", "tie", *POINTS)}
    named += _ends("force", scene.springs() | scene.fields(), lambda force: able.get(force.kind, ("mean", "tie")))
    named += _ends("force", scene.electrodes(), lambda force: ("points",))
    named += _ends("motion", scene.motion, lambda m: ("tie",) if m.kind == "rotation" else ("mean", "tie"))
    probes = {name: probe for name, probe in scene.probe.items() if probe.kind not in ("force", "centre")}
    return named + _ends("probe", probes, lambda probe: ("mean", "tie", *POINTS))


def _ends(table: str, members: Mapping[str, Any], kinds: Callable[[Any], tuple[str, ...]]) -> list[Named]:
    """Return the interfaces that members of a table of the scene name, of their body and of that they act against."""
    return [
        (f"{table}.{name}.{key}", getattr(member, side), interface, kinds(member))
        for name, member in members.items()
        for key, side in (("interface", "body"), ("against_interface", "against"))
        if (interface := getattr(member, key, None)) is not None
    ]


def _surface_of(force: Any) -> str | None:
    """Return the kind of interface on which a force over time acts, None where it names none."""
    return None if getattr(force, "interface", None) is None else force.surface


def _held_interfaces(scene: "SceneFile") -> list[Named]:
    """Return the interfaces that joints of two markers and attachments name."""
    able: tuple[str, ...] = ("tie", "mean") if scene.capabilities.turns else ("mean",)
    named = _ends("joint", scene.cranks(), lambda crank: able)
    named += _ends(
        "joint", scene.hinges(), lambda j: ("tie", "mean") if isinstance(j, Distance | Spherical) else ("tie",)
    )
    bodies = {name: body.attached_to for name, body in scene.body.items() if body.attached_to is not None}
    return named + [(f"body.{name}.attached_to", name, interface, ("tie",)) for name, interface in bodies.items()]


def _loaded_interfaces(scene: "SceneFile") -> list[Named]:
    """Return the interfaces that loads, springs and bushings of bodies name that turn by any angle."""
    if not scene.turns_by_choice:
        return []
    loads = {n: f for n, f in scene.turning_loads().items() if _surface_of(f) is not None}
    return _ends("force", loads | scene.springs(), lambda force: ())


def _without_statics(scene: "SceneFile") -> list[str]:
    """List joints at interfaces whose static shapes the body's modes lack: residual flexibility does not act there."""
    if not (scene.capabilities.turns or scene.held()):
        return []
    lines = []
    for key, body, interface, _ in _held_interfaces(scene) + _loaded_interfaces(scene):
        component = scene.component.get(name := scene.component_of(body))
        if component is None or interface not in component.interface or not key.startswith(("joint.", "force.")):
            continue
        if component.modes.reduction in (*WITH_STATICS, "rigid"):
            continue
        lines.append(
            f"component.{name}.modes.reduction: '{component.modes.reduction}' has no static shape of interface"
            f" '{interface}', so that {key.rpartition('.')[0]} would act on a body that is too stiff; allowed:"
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
    for key, body, kind in points:
        component = scene.component.get(scene.component_of(body))
        if component is not None and "rigid" not in (component.geometry.kind, component.modes.reduction):
            lines.append(
                f"{key}: body '{body}' deforms, and is held at interfaces; give one of kind '{kind}', or"
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
                " it is for bodies that turn by any angle (integrator 'turning')"
            )
        for name, body in scene.body.items():
            set_keys = [key for key in ("attachment",) if key in body.model_fields_set]
            lines += [
                f"body.{name}.{key}: given, but integrator '{scene.integrator}' has small rotations; it is for bodies"
                " that turn by any angle (integrator 'turning')"
                for key in set_keys
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
        f"contact.{name}: a {kind} '{name}' has quantities of the same names; give the contact another name"
        for name in scene.contact for kind in ("joint", "force") if kind in owners[name]
    ] + [
        f"probe.{name}: a contact or joint has '{name}.force_peak' too; give the probe another name"
        for name, probe in scene.probe.items() if probe.kind == "force" and {*owners[name]} & {"contact", "joint"}
    ]  # fmt: skip
    for name in scene.report.quantities:
        owner = next((o for o in owners if name.startswith(f"{o}.")), None)
        if owner is None:
            have = ", ".join(owners)
            lines.append(f"report.quantities: '{name}' belongs to nothing in the scene, which has {have}")
        elif definition(quantity := name[len(owner) + 1 :], owners[owner]) is None:
            able = [n for kind in owners[owner] for n in names(kind)]
            matches = difflib.get_close_matches(quantity, able, 1)
            hint = f"; did you mean '{owner}.{matches[0]}'?" if matches else ";"
            kinds = " and ".join(owners[owner])
            lines.append(f"report.quantities: no {kinds} has '{quantity}'{hint} allowed are {', '.join(able)}")
    return lines


def _wrong_sensors(scene: "SceneFile") -> list[str]:
    """List the sensors that name what the scene does not have, or gauges that are no strain gauges."""
    lines = []
    wrenches = [name for name, force in scene.force.items() if force.kind == "wrench"]
    for name, sensor in scene.sensor.items():
        table = f"sensor.{name}"
        if sensor.body not in scene.body:
            lines.append(f"{table}.body: no body '{sensor.body}'; the scene has {', '.join(scene.body)}")
            continue
        if sensor.force is not None and sensor.force not in wrenches:
            have = ", ".join(wrenches) or "none"
            lines.append(f"{table}.force: no force '{sensor.force}' of kind 'wrench'; the scene has {have}")
        gauges, component = scene.body[sensor.body].gauges, scene.component.get(scene.component_of(sensor.body))
        if not gauges:
            lines.append(f"{table}.body: body '{sensor.body}' names no gauges; list them in body.{sensor.body}.gauges")
        for channel, bridge in sensor.channels(tuple(gauges)).items():
            key = f"{table}.channel.{channel}.gauges"
            for gauge in bridge.gauges:
                if gauge not in gauges:
                    have = ", ".join(gauges) or "none"
                    lines.append(f"{key}: no '{gauge}' in body.{sensor.body}.gauges, which has {have}")
                elif component is not None and not _strains(component.gauge.get(gauge)):
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
    generic = [f"{owner}.{name}" for owner, kinds in _owners(scene).items() for kind in kinds for name in names(kind)]
    return list(dict.fromkeys(re.sub(r"N(?=\.|$)", str(n), name) for name in generic for n in range(1, 21)))


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
    kinds_of: dict[str, list[str]] = {}
    for kind, owners in kinds.items():
        for owner in owners:
            kinds_of.setdefault(owner, []).append(kind)
    return kinds_of


def _counted_twice(scene: "SceneFile") -> list[str]:
    """List contact laws with local compliance on solids, whose meshes resolve it themselves."""
    lines = []
    for name, contact in scene.contact.items():
        if contact.law is None or contact.method != "residual":
            continue
        partner = scene.others().get(name)
        for body in (contact.body, *([partner.body] if partner is not None else [])):
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
            key = f"body.{name}.damping.table"
            path = find_file(body.damping.table, folder, key)
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
    drives = {name: j for name, j in scene.joint.items() if isinstance(j, Driven)}
    over_time = (("force", scene.over_time(), forces), ("motion", scene.motion, motions), ("joint", drives, joints))
    for table, amounts, tabled in over_time:
        for name, amount in amounts.items():
            tabled[name] = _over_time(amount, f"{table}.{name}", folder, scene.run.duration)
    for name, force in scene.springs().items():
        if force.kind == "spring" and force.table is not None:
            values = read_knots(find_file(force.table, folder, f"force.{name}.table"))
            forces[name] = force.model_copy(update={"values": values})
    return scene.model_copy(update={"force": forces, "body": bodies, "motion": motions, "joint": joints})


def _over_time(amount: Any, key: str, folder: Path, duration: float) -> Any:
    """Return an amount over time with the values of its table; refuse one that does not reach over a run [s]."""
    if amount.table is not None:
        path = find_file(amount.table, folder, f"{key}.table")
        amount = _tabled(amount, path, read_pairs(path, "time [s] and amount"))
    if (reason := amount.refusal(duration)) is not None:
        raise InputError(f"{key}.{reason}")
    return amount


def _tabled(model: Model, path: Path, values: tuple[tuple[float, float], ...]) -> Model:
    """Return a model with the values of the table that it names, checked as those of a scene; rows from 2 on."""
    try:
        return type(model).model_validate(model.model_dump() | {"values": values})
    except ValidationError as error:
        mistake = error.errors()[0]
        row, *column = [item for item in mistake["loc"] if isinstance(item, int)] or [0]
        got = f"{values[row][column[0]]:g} given; " if column else ""
        text = mistake["msg"].removeprefix("Value error, ").removeprefix(got)
        raise InputError(f"{path}: row {row + 2}: {got}{text[0].lower()}{text[1:]}") from None
