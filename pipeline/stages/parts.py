"""Size and inertia of the meshed parts of a scene, from which a mistaken unit is seen at once."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.scenes.component import Component


def part_row(mesh: MeshRecord, component: Component, name: str) -> dict[str, Any]:
    """Return nodes, cells, extents along x, y, z [m], volume [m^3], mass [kg], centre [m] and principal inertia.

    The inertia is about the centre [kg m^2], (3,), ascending. A rigid body has no volume (None), and a line mesh no
    extent across its axis.

    Args:
        name: The component's name, for messages.
    """
    from gudgeon.pipeline.fem.assemble import build_model
    from gudgeon.pipeline.fem.elements.solid import mass_properties

    material = component.material
    if mesh.cell_type == "tetra10" and material is not None:
        properties = mass_properties(mesh, material.rho)
    else:
        properties = build_model(mesh, material, (), f"component.{name}", component.geometry).properties
    return {
        "nodes": len(mesh.nodes),
        "cells": len(mesh.cells),
        "extents": np.ptp(mesh.nodes, axis=0).tolist(),
        "volume": None if material is None else properties.mass / material.rho,
        "mass": properties.mass,
        "centre": properties.centre.tolist(),
        "principal_inertia": np.linalg.eigvalsh(properties.inertia).tolist(),
    }


def part_text(parts: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the rows of `part_row` as text."""
    lines = []
    for name, row in parts.items():
        lines += [
            "",
            f"component.{name}",
            f"nodes, cells        {row['nodes']}, {row['cells']}",
            f"extents             {_numbers(row['extents'])} m",
            *([] if row["volume"] is None else [f"volume              {row['volume']:.5g} m^3"]),
            f"mass                {row['mass']:.5g} kg",
            f"centre              {_numbers(row['centre'])} m",
            f"principal inertia   {_numbers(row['principal_inertia'])} kg m^2",
        ]
    return "\n".join(lines)


def _numbers(values: list[float]) -> str:
    size = max(map(abs, values), default=0.0)
    return ", ".join(f"{0.0 if abs(value) < 1e-12 * size else value:.5g}" for value in values)
