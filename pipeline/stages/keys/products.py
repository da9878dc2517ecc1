"""The products of each stage, identified by a key of everything that they depend on. No arrays are computed here.

A key holds inputs, parameters, the schema version, the digest of the sources that shape the product, and the versions
of the libraries that affect it; the choice of the linear solver changes results by round-off only and is not
part of it.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from gudgeon.modaldb.keys import content_key, file_digest
from gudgeon.modaldb.records import SCHEMA_VERSION
from gudgeon.pipeline.geometry.decks.included import included_files
from gudgeon.pipeline.scenes.change import moved_surface
from gudgeon.pipeline.scenes.component import Component, Meshed
from gudgeon.pipeline.scenes.reading import find_file
from gudgeon.pipeline.stages.keys.sources import code_digests

STAGES = ("mesh", "modes", "morph", "solve", "plot")
FEM = ("numpy", "scipy", "scikit-fem")
LIBRARIES = {
    **dict.fromkeys(("modes", "morph", "sensitivity", "nodal", "cyclic", "wheel"), FEM),
    "mesh": ("gmsh", "meshio", "numpy"),
    "solve": ("numpy", "scipy"),
    "plot": ("pyvista", "matplotlib"),
    "measurement": ("numpy", "scipy", "gmsh"),
    "report": (),
    **dict.fromkeys(("field", "poses", "posegrid"), ("numpy", "scipy")),
}
DESIGNS = "designs"
"""Entry of the inputs of modes that are computed from those of stored designs: their keys."""
SHAPING = ("mesh", "material", "interface", "supports", "point_mass")
"""Inputs of modes on which full FE depends too."""


@dataclass(frozen=True)
class Product:
    """One record of a stage."""

    stage: str
    name: str
    """Component that it belongs to; the scene's name if it belongs to no component."""
    kind: str
    """Kind of record, see `modaldb.records.KINDS`."""
    key: str
    inputs: dict[str, Any]


def component_products(
    name: str,
    component: Component,
    folder: Path,
    rubbed: Sequence[str] = (),
    pulled: Sequence[tuple[float, ...]] = (),
    *,
    turns: bool = False,
    crossed: tuple[str, float] | None = None,
    held: Sequence[str] = (),
    stressed: bool = False,
) -> dict[str, Product]:
    """Return a component's products by step: `base-mesh`, `mesh`, `modes`, `morph`, and before `mesh` the meshes and
    modes of the designs that its modes are computed from, `designs.0 mesh`, `designs.0 modes` and so on.

    The modes are those of `mesh`: the base mesh on update `reuse`, else the moved one. Relative paths start at the
    scene's folder.

    Args:
        rubbed: Interfaces on which friction acts, sorted: the modes have tangential rows there.
        pulled: Directions of gravity in the component's axes, sorted: the modes have its static shapes.
        turns: Whether it deforms and bodies of it turn by any angle: the modes have tensors of the floating frame.
        crossed: Traction space that a moving force crosses, and where across [m]: the modes have bases of its places.
        held: Interfaces that motions and other forces hold, sorted: the modes have their static shapes.
        stressed: Whether loads or weight stress it in small motion: the modes have stiffness by stress.

    Raises:
        InputError: a file that the component names is missing.
    """
    base = mesh_product(name, component, folder)
    change = _profile(component, folder, name)
    change |= {"growth": component.change.growth} if component.change.growth else {}
    moves = bool(change) and component.change.update != "reuse"
    mesh = _moved_mesh(name, base, change) if moves else base
    requested = {
        "friction_on": list(rubbed), "gravity_along": [list(d) for d in pulled], "turns": turns,
        "crossed": list(crossed or ()), "held": list(held), "stressed": stressed,
        "point_mass": {key: item.model_dump(mode="json") for key, item in component.point_mass.items()},
    }  # fmt: skip
    shared = _shaping(component) | {key: value for key, value in requested.items() if value}
    stored, designs = {}, component.stored_designs if change else ()
    for n, design in enumerate(designs):
        stored_mesh = _moved_mesh(name, base, profile) if (profile := _profile(design, folder, name, n)) else base
        settings = {"modes": design.modes.model_dump(mode="json")}
        stored[f"{DESIGNS}.{n} mesh"] = stored_mesh
        stored[f"{DESIGNS}.{n} modes"] = product("modes", name, shared | settings | {"mesh": stored_mesh.key})
    settings = {"modes": component.modes.model_dump(mode="json")}
    if designs:
        keys = [stored[f"{DESIGNS}.{n} modes"].key for n in range(len(designs))]
        settings |= {DESIGNS: keys, "tolerance": component.change.tolerance}
    modes = product("modes", name, shared | settings | {"mesh": mesh.key})
    update = component.change.update if change else "none"
    morph = product("morph", name, {"modes": modes.key, "update": update, "profile": change})
    return {"base-mesh": base, **stored, "mesh": mesh, "modes": modes, "morph": morph}


def _moved_mesh(name: str, base: Product, profile: dict[str, Any]) -> Product:
    return product("mesh", name, {"base": base.key, "profile": profile, "morph": code_digests()["morph"]})


def _shaping(component: Component) -> dict[str, Any]:
    """Return what modes of a component depend on besides its mesh and the reduction, as JSON."""
    return {
        "material": component.material.model_dump(mode="json") if component.material is not None else None,
        "interface": {key: item.model_dump(mode="json") for key, item in component.interface.items()},
        "supports": _supports(component),
        "gauge": {key: item.model_dump(mode="json") for key, item in component.gauge.items()},
    }


def sensitivity_product(name: str, modes: Product) -> Product:
    """Return the derivatives of a component's modes with respect to the positions of its nodes."""
    return product("sensitivity", name, {"modes": modes.key})


def mesh_product(name: str, meshed: Meshed, folder: Path, table: str = "component") -> Product:
    """Return the mesh of a part of a scene; `table` is the scene's table of such parts.

    Raises:
        InputError: a file that it names is missing.
    """
    key = f"{table}.{name}.geometry"
    inputs: dict[str, Any] = {"geometry": _geometry(meshed, folder, key), "size": meshed.mesh.size}
    if meshed.geometry.kind == "cad":
        acted_on = meshed.places
        inputs |= {"places": None if acted_on is None else acted_on._asdict()}
        inputs |= {"nodes": meshed.mesh.nodes} if meshed.mesh.size is None else {}
    return product("mesh", name, inputs)


def nodal_product(
    name: str,
    dynamics: Mapping[str, Any],
    inputs: Mapping[str, tuple[Mapping[str, Any], Mapping[str, Any]]],
    step: float,
) -> Product:
    """Return a full-FE run with a step [s]; `inputs` are inputs of each component's modes and design.

    `dynamics` is the solver's part of the scene, as JSON.
    """
    shapes = {}
    for component, (modes, morph) in inputs.items():
        shapes[component] = {key: modes[key] for key in SHAPING if key in modes}
        shapes[component] |= {"profile": morph["profile"]}
    run = {key: dynamics["run"][key] for key in ("duration", "gravity", "frames")}
    return product("nodal", name, {"scene": dict(dynamics) | {"run": run}, "bodies": shapes, "step": step})


def plot_inputs(trajectory_key: str, compared: Mapping[str, str]) -> dict[str, Any]:
    """Return everything that the pictures depend on; `compared` has the keys of other trajectories that they show."""
    inputs = {"trajectory": trajectory_key, "code": code_digests()["plot"], "libraries": _versions("plot")}
    return inputs | ({"compare": dict(compared)} if compared else {})


def combined(keys: list[str]) -> str:
    """Return one key for several."""
    return keys[0] if len(keys) == 1 else content_key({"keys": keys})


def product(stage: str, name: str, parameters: dict[str, Any]) -> Product:
    """Return the product of a stage with these inputs, as JSON; its kind of record is `trajectory` for `solve`."""
    inputs = parameters | {"stage": stage} | made_by(stage)
    return Product(stage, name, "trajectory" if stage == "solve" else stage, content_key(inputs), inputs)


def made_by(stage: str) -> dict[str, Any]:
    """Return what the keys of a stage hold of the program itself."""
    return {"code": code_digests()[stage], "schema": SCHEMA_VERSION, "libraries": _versions(stage)}


def _supports(component: Component) -> list[Any]:
    """Return the supports of a component, sorted and without duplicates, so that their order does not matter."""
    entries = {json.dumps(item.as_inputs(), sort_keys=True): item.as_inputs() for item in component.supports}
    return [entries[key] for key in sorted(entries)]


def _geometry(meshed: Meshed, folder: Path, table: str) -> dict[str, Any]:
    described = meshed.geometry.model_dump(mode="json")
    for key, file in meshed.files.items():
        path = find_file(file, folder, f"{table}.{key}")
        described[key] = file_digest(path)
        if more := included_files(str(path)):
            described[f"{key} includes"] = {name: file_digest(Path(name)) for name in more}
    return described


def _profile(component: Component, folder: Path, name: str, design: int | None = None) -> dict[str, Any]:
    """Return a component's profile, or that of one of its stored designs by number, as inputs; empty without one."""
    key = "profile" if design is None else f"{DESIGNS}.{design}"
    if (moved := moved_surface(component, folder, name, key)) is None:
        return {}
    (surface, table), profile = moved, component.change.profile
    inputs = {"surface": surface, "offset": profile.offset}
    return inputs if table is None else inputs | {"table": file_digest(table), "scale": profile.scale}


def _versions(stage: str) -> dict[str, str]:
    return {library: _version(library) for library in LIBRARIES[stage]}


@cache
def _version(library: str) -> str:
    try:
        return version(library)
    except PackageNotFoundError:
        return "absent"
