"""From tables to a scene whose names agree, whose tables are read and whose parts fit."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.cycle import check_closed, read_cycle
from pipeline.errors import InputError
from pipeline.preflight import misfits
from pipeline.products import find_file
from pipeline.scenefile import check_scene, named

if TYPE_CHECKING:
    from pipeline.stages import SceneFile


def checked(path: Path, tables: Mapping[str, Any], model: "type[SceneFile]") -> "SceneFile":
    """Return the scene that tables describe.

    Args:
        path: The scene's file, for messages and relative paths.

    Raises:
        InputError: every mistake of one kind, one a line.
    """
    scene = check_scene(path, tables, model)
    if lines := _wrong_names(scene):
        raise InputError("\n".join(f"{path}: {line}" for line in lines))
    with named(path, InputError):
        scene = _with_tables(scene, path.parent)
        lines = misfits(scene, path.parent)
    if lines:
        raise InputError("\n".join(f"{path}: {line}" for line in lines))
    return scene


def _wrong_names(scene: "SceneFile") -> list[str]:
    lines = []
    for body in scene.body:
        if (name := scene.component_of(body)) not in scene.component:
            lines.append(f"body.{body}.component: no component '{name}', there is {', '.join(scene.component)}")
    wanted = [(f"contact.{n}.interface", c.body, c.interface, "points") for n, c in scene.contact.items()]
    wanted += [(f"contact.{n}.against.interface", m.body, m.interface, "traction") for n, m in scene.masters().items()]
    wanted += [(f"joint.{n}.interface", j.body, j.interface, "mean") for n, j in scene.joint.items()]
    wanted += [(f"force.{n}.interface", f.body, f.interface, "pressure") for n, f in scene.force.items()]
    for where, body, interface, kind in wanted:
        component = scene.component.get(scene.component_of(body))
        if component is None:
            continue
        if interface not in component.interface:
            have = ", ".join(component.interface) or "none"
            lines.append(f"{where}: no interface '{interface}', the component has {have}")
        elif (got := component.interface[interface].kind) != kind:
            lines.append(f"{where}: interface '{interface}' is of kind '{got}', kind '{kind}' is needed")
    return lines


def _with_tables(scene: "SceneFile", folder: Path) -> "SceneFile":
    """Read the tables that forces name, so that the solver's part of the scene holds their values."""
    forces = {}
    for name, force in scene.force.items():
        if force.table is not None:
            values = read_cycle(find_file(force.table, folder, f"force.{name}.table"))
            force = force.model_copy(update={"values": values})
        else:
            check_closed(f"force.{name}.values", np.array(force.values))
        forces[name] = force
    return scene.model_copy(update={"force": forces}) if forces else scene
