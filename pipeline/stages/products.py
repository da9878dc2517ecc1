"""What each stage makes of a scene, keyed by everything that it depends on. No array is touched here.

Keys hold inputs, parameters, the schema version and the versions of the libraries that shape the result; the choice
of linear solver changes nothing beyond round-off and stays out.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from gudgeon.modaldb.keys import content_key, file_digest
from gudgeon.modaldb.records import SCHEMA_VERSION
from gudgeon.pipeline.scenes.change import profile_surface, table_path
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.reading import find_file

STAGES = ("mesh", "modes", "morph", "solve", "plot")
CODE_VERSIONS = {"mesh": 2, "modes": 11, "morph": 2, "solve": 13, "plot": 5, "nodal": 3, "cyclic": 2, "wheel": 3,
                 "measurement": 1, "report": 2}  # fmt: skip
"""Raised whenever a stage's code changes what it makes of the same inputs."""
LIBRARIES = {
    "mesh": ("gmsh", "meshio", "numpy"),
    "modes": ("numpy", "scipy", "scikit-fem"),
    "morph": ("numpy", "scipy", "scikit-fem"),
    "solve": ("numpy", "scipy", "numba"),
    "plot": ("pyvista", "matplotlib"),
    "nodal": ("numpy", "scipy", "scikit-fem"),
    "cyclic": ("numpy", "scipy", "scikit-fem"),
    "wheel": ("numpy", "scipy", "scikit-fem"),
    "measurement": ("numpy", "scipy", "numba", "gmsh"),
    "report": (),
}


@dataclass(frozen=True)
class Product:
    """One record that a stage makes, or finds."""

    stage: str
    name: str
    """Component that it belongs to; the scene's own name for `solve` and `plot`."""
    kind: str
    """Kind of record, see `modaldb.records.KINDS`."""
    key: str
    inputs: dict[str, Any]


def component_products(name: str, component: Component, folder: Path) -> dict[str, Product]:
    """Return a component's products by step: `base-mesh`, `mesh`, `modes`, `morph`.

    `mesh` is the mesh that the modes are made of: the base mesh, or the moved one on update `recompute`.

    Args:
        folder: The scene's, from which relative paths count.

    Raises:
        InputError: a file that the component names is missing.
    """
    base = _product("mesh", name, "mesh", {"geometry": _geometry(component, folder, name), "size": component.mesh.size})
    change = _profile(component, folder, name)
    recompute = bool(change) and component.change.update == "recompute"
    moved = {"base": base.key, "profile": change, "morph": CODE_VERSIONS["morph"]}
    mesh = _product("mesh", name, "mesh", moved) if recompute else base
    modes = _product(
        "modes", name, "modes",
        {
            "mesh": mesh.key,
            "material": component.material.model_dump(mode="json") if component.material is not None else None,
            "interface": {key: item.model_dump(mode="json") for key, item in component.interface.items()},
            "supports": _supports(component),
            "gauge": {key: item.model_dump(mode="json") for key, item in component.gauge.items()},
            "modes": component.modes.model_dump(mode="json"),
        },
    )  # fmt: skip
    update = component.change.update if change else "none"
    morph = _product("morph", name, "morph", {"modes": modes.key, "update": update, "profile": change})
    return {"base-mesh": base, "mesh": mesh, "modes": modes, "morph": morph}


def solve_product(name: str, dynamics: Mapping[str, Any], morphs: Mapping[str, str]) -> Product:
    """Return the trajectory of a scene.

    Args:
        dynamics: The solver's part of the scene, as JSON.
        morphs: Key of each component's design.
    """
    return _product("solve", name, "trajectory", {"scene": dict(dynamics), "morphs": dict(morphs)})


def nodal_product(
    name: str,
    dynamics: Mapping[str, Any],
    parts: Mapping[str, tuple[Mapping[str, Any], Mapping[str, Any]]],
    step: float,
) -> Product:
    """Return a run of the full-FE run.

    Args:
        dynamics: The solver's part of the scene, as JSON.
        parts: Inputs of each component's modes and design; how they are reduced does not matter here.
        step: [s]
    """
    shapes = {}
    for component, (modes, morph) in parts.items():
        shapes[component] = {key: modes[key] for key in ("mesh", "material", "interface", "supports") if key in modes}
        shapes[component] |= {"profile": morph["profile"]}
    run = {key: dynamics["run"][key] for key in ("duration", "gravity", "frames")}
    return _product("nodal", name, "nodal", {"scene": dict(dynamics) | {"run": run}, "bodies": shapes, "step": step})


def cyclic_product(name: str, modes: Mapping[str, Any], symmetry: Mapping[str, Any], mode_count: int) -> Product:
    """Return the modes of a tuned wheel.

    Args:
        modes: Inputs of the sector's own modes, of which mesh, material and supports matter.
        symmetry: How the sector makes a wheel, as JSON.
    """
    sector = {key: modes[key] for key in ("mesh", "material", "supports")}
    return _product("cyclic", name, "cyclic", sector | {"symmetry": dict(symmetry), "mode_count": mode_count})


def wheel_product(name: str, cyclic_key: str, mistuned: Mapping[str, Any], model: Mapping[str, Any]) -> Product:
    """Return the forced response of a wheel.

    Args:
        cyclic_key: Of its modes.
        mistuned: Blades, force and number of modes, as JSON.
        model: How the wheel is reduced, as JSON; empty where it is not.
    """
    return _product("wheel", name, "wheel", {"modes": cyclic_key, "wheel": dict(mistuned), "model": dict(model)})


def measurement_product(name: str, of: str, how: Mapping[str, Any]) -> Product:
    """Return what a product took.

    Args:
        of: Its key.
        how: The machine, the code that was timed and how often it ran, as JSON.
    """
    return _product("measurement", name, "measurement", {"of": of, "how": dict(how)})


def report_product(name: str, stages: Mapping[str, Any], settings: Mapping[str, Any], number: int) -> Product:
    """Return the report of a scene.

    Args:
        stages: What its stages depend on, by place, as JSON.
        settings: The scene's `report` table, as JSON.
        number: Of reports of the same that were made before, perhaps on another machine.
    """
    return _product("report", name, "report", {"stages": dict(stages), "settings": dict(settings), "number": number})


def plot_inputs(trajectory_key: str, compared: Mapping[str, str]) -> dict[str, Any]:
    """Return everything that the pictures depend on.

    Args:
        compared: What else they show: keys of other trajectories by their names.
    """
    inputs = {"trajectory": trajectory_key, "code": CODE_VERSIONS["plot"], "libraries": _versions("plot")}
    return inputs | ({"compare": dict(compared)} if compared else {})


def combined(keys: list[str]) -> str:
    """Return one key for several."""
    return keys[0] if len(keys) == 1 else content_key({"keys": keys})


def _product(stage: str, name: str, kind: str, parameters: dict[str, Any]) -> Product:
    inputs = parameters | {
        "stage": stage,
        "code": CODE_VERSIONS[stage],
        "schema": SCHEMA_VERSION,
        "libraries": _versions(stage),
    }
    return Product(stage, name, kind, content_key(inputs), inputs)


def _supports(component: Component) -> list[Any]:
    """Return what holds a component, in an order and once each, whatever the scene's order is."""
    entries = {json.dumps(item.as_inputs(), sort_keys=True): item.as_inputs() for item in component.supports}
    return [entries[key] for key in sorted(entries)]


def _geometry(component: Component, folder: Path, name: str) -> dict[str, Any]:
    described = component.geometry.model_dump(mode="json")
    if component.geometry.kind == "file" or component.geometry.kind == "plane-file":
        described["path"] = file_digest(find_file(component.geometry.path, folder, f"component.{name}.geometry.path"))
    return described


def _profile(component: Component, folder: Path, name: str) -> dict[str, Any]:
    profile = component.change.profile
    path = table_path(profile, folder, name)
    if path is None and profile.offset == 0:
        return {}
    inputs = {"surface": profile_surface(component, name), "offset": profile.offset}
    return inputs if path is None else inputs | {"table": file_digest(path), "scale": profile.scale}


def _versions(stage: str) -> dict[str, str]:
    return {library: _version(library) for library in LIBRARIES[stage]}


@cache
def _version(library: str) -> str:
    try:
        return version(library)
    except PackageNotFoundError:
        return "absent"
