"""Size and inertia of the meshed parts of a scene, from which a mistaken unit is seen at once, and their elements."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.stores.base import Store
from gudgeon.pipeline.geometry.cells import HEXAHEDRON, PYRAMID, TETRAHEDRON, WEDGE, Block, cell_blocks, cell_of
from gudgeon.pipeline.geometry.surfaces import distance
from gudgeon.pipeline.scenes.bodies import SceneFile
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.material import Material

NUMBERED, SKIN = re.compile(r"face\d+"), "skin"
"""Names of surfaces that every CAD part has."""
REGULAR = {
    TETRAHEDRON: [[0, 0, 0], [1, 0, 0], [0.5, 0.75**0.5, 0], [0.5, 12**-0.5, (2 / 3) ** 0.5]],
    HEXAHEDRON: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
    WEDGE: [[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (0.5, 0.75**0.5))],
    PYRAMID: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0.5**0.5]],
}
"""Corners of regular elements, all edges of length 1."""


def part_row(mesh: MeshRecord, component: Component, name: str) -> dict[str, Any]:
    """Return nodes, cells, extents along x, y, z [m], volume [m^3], mass [kg], centre [m] and principal inertia.

    The inertia is about the centre [kg m^2], (3,), ascending. A rigid body has no volume (None), and a line mesh no
    extent across its axis.

    Args:
        name: The component's name, for messages.
    """
    from gudgeon.pipeline.fem.elements.materials import densities
    from gudgeon.pipeline.fem.elements.solid import mass_properties
    from gudgeon.pipeline.interfaces.point_mass import free_model, with_point_masses

    material = component.material
    solid = cell_of(mesh).solid and mesh.system is None
    key = f"component.{name}"
    if solid and material is not None:
        mesh_properties = properties = mass_properties(mesh, densities(mesh, material))
        if component.point_mass or mesh.attachments:
            properties = with_point_masses(free_model(mesh, component, key), component, key).properties
    else:
        model = free_model(mesh, component, key)
        mesh_properties, properties = model.properties, with_point_masses(model, component, key).properties
    return {
        "nodes": len(mesh.nodes),
        "cells": len(mesh.cells),
        "extents": np.ptp(mesh.nodes, axis=0).tolist(),
        "volume": _volume(mesh, material, mesh_properties.mass),
        "mass": properties.mass,
        "centre": properties.centre.tolist(),
        "principal_inertia": np.linalg.eigvalsh(properties.inertia).tolist(),
        "quality": element_quality(mesh) if solid else None,
        "surfaces": surface_rows(mesh) if solid and component.path is not None else {},
    }


def _volume(mesh: MeshRecord, material: Material | None, mass: float) -> float | None:
    """Return the volume [m^3]; None of a rigid body and of matrices."""
    from gudgeon.pipeline.fem.elements.solid import mass_properties

    if material is None or mesh.system is not None:
        return None
    return mass_properties(mesh, 1.0).mass if material.volumes else mass / material.rho


def element_quality(mesh: MeshRecord) -> dict[str, float]:
    """Return figures of solid elements, 1 for a regular straight one: least mean ratio, its 1 % quantile, Jacobian.

    The mean ratio is the least of 3 det(T)^(2/3) / ‖T‖² at the corners with three edges, T from those of the regular
    element to these (Knupp, SIAM J. Sci. Comput. 23 (2001) 193); of a tetrahedron 12 (3 V)^(2/3) / Σ l² (Liu and Joe,
    BIT 34 (1994) 268). The Jacobian is the least over the largest one at an element's nodes, which says how much it is
    curved or skewed.
    """
    from gudgeon.pipeline.fem.elements.reference import nodal_jacobians

    ratios = np.concatenate([_mean_ratios(mesh.nodes, block) for block in cell_blocks(mesh)])
    jacobians = nodal_jacobians(mesh)
    return {
        "least": float(ratios.min()),
        "low": float(np.quantile(ratios, 0.01)),
        "jacobian": float((jacobians[:, 0] / jacobians[:, 1]).min()),
    }


def _mean_ratios(nodes: np.ndarray, block: Block) -> np.ndarray:
    """Return the mean ratio of each cell, (e,)."""
    shape, regular = block.cell.shape, np.array(REGULAR[block.cell.shape])
    ratios = np.full(len(block.rows), np.inf)
    for corner in range(shape.corners):
        ends = shape.edges[(shape.edges == corner).any(axis=1)].sum(axis=1) - corner
        if len(ends) == 3:
            edges = nodes[block.nodes[:, ends]] - nodes[block.nodes[:, [corner]]]
            T = np.linalg.solve(regular[ends] - regular[corner], edges)
            volumes = np.maximum(np.linalg.det(T), 0.0)
            ratios = np.minimum(ratios, 3 * np.cbrt(volumes) ** 2 / (T**2).sum(axis=(1, 2)))
    return ratios


def surface_rows(mesh: MeshRecord) -> dict[str, dict[str, Any]]:
    """Return kind, radius [m] and largest distance of the nodes [m] from the true shape of each named surface.

    Faces of CAD that have only a number are left out.
    """
    rows = {}
    for name, surface in mesh.surfaces.items():
        if NUMBERED.fullmatch(name) or name == SKIN:
            continue
        has_shape = "kind" in surface.shape
        off = distance(mesh.nodes[np.unique(surface.facets)], surface.shape) if has_shape else np.zeros(1)
        rows[name] = {
            "facets": len(surface.facets),
            "kind": surface.shape.get("kind"),
            "radius": surface.shape.get("radius"),
            "off": float(off.max(initial=0.0)) if has_shape else None,
        }
    return rows


def refuse_probes_off(store: Store, scene: SceneFile, keys: Mapping[str, str]) -> None:
    """Refuse probes of points off the meshed rigid parts of a scene.

    Args:
        keys: Key of the mesh of each component.

    Raises:
        InputError: there is one.
    """
    for name, probe in scene.probe.items():
        sides = ("at", "interface", "body"), ("against_at", "against_interface", "against")
        for key, interface, owner in sides:
            point = getattr(probe, key, None)
            if point is None or getattr(probe, interface, None) is not None:
                continue
            component = scene.component_of(getattr(probe, owner))
            if component in keys:
                from gudgeon.pipeline.interfaces.strain_gauges import refuse_far  # Here: it loads scipy.

                mesh = store.get(keys[component], "mesh", only=["nodes", "cells", "cell_type"])
                refuse_far(mesh, np.array(point), f"probe.{name}.{key}")


def part_sizes(
    store: Store, components: Mapping[str, Component], keys: Mapping[str, tuple[str, str]]
) -> dict[str, dict[str, Any]]:
    """Return extents along x, y, z [m] and mass [kg] of each meshed part, without the cost of its inertia.

    Args:
        components: Components by name.
        keys: Keys of the records of mesh and morph of each.
    """
    return {
        name: {
            "extents": np.ptp(store.get(keys[name][0], "mesh", only=["nodes"]).nodes, axis=0).tolist(),
            "mass": store.get(keys[name][1], "morph", only=["mass"]).mass,
        }
        for name, component in components.items()
        if component.material is not None
    }
