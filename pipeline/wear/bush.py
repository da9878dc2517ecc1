"""What wear of an elastic bearing does to its compliance, which stays that of the unworn bush: an estimate.

Worn depths h(θ) move the nodes of the bore outwards along their radii, and those of the elements beside it the less
the further away they are. With Y = K⁻¹ F the answers to pressures cos nθ and sin nθ about the bore, whose nodal forces
stay, their compliance C = Fᵀ Y changes by δC = −Yᵀ δK Y, to first order in the movement. The largest |δC| over C of
all combinations is what the kept compliance neglects.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from scipy import linalg
from scipy.spatial import cKDTree

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.interfaces.point_mass import component_model
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.solver.joints.clearance import Clearance
from gudgeon.solver.vectors import frame_along

WAVES = 4
"""Highest n of the pressures."""
LAYERS = 4
"""Elements beside the bore over which the movement decays."""
STEP = 1e-3
"""Largest movement of the difference that stands for the derivative, over the size of an element."""
ON_NODE = 1e-6
"""Largest distance of a place of the bore from its node, over the radius."""


def compliance_change(job: Any, name: str, joint: Clearance, depths: np.ndarray) -> float:
    """Return the largest relative change of the compliance of a joint's bush by worn depths, (cells,).

    The mesh and the modes of the bush are in the database.
    """
    bearing, where = joint.bearing, f"joint.{name}.bearing"
    assert bearing is not None
    assert bearing.component is not None
    assert bearing.interface is not None
    component, mesh = job.scene.component[bearing.component], job.record(bearing.component, "mesh")
    face = job.record(bearing.component).interfaces[bearing.interface]
    across, radius = frame_along(joint.axes[1])[:, :2], joint.radius + joint.clearance
    off, nodes = cKDTree(mesh.nodes).query(face.points)
    if off.max() > ON_NODE * radius:
        raise StageError(f"{job.path}: {where}.interface: a place of the bore is {off.max():.2g} m from its node")
    model = component_model(mesh, component, f"component.{bearing.component}")
    out = face.points @ across
    angles = np.arctan2(out[:, 1], out[:, 0])
    normals = np.column_stack([np.cos(angles), np.sin(angles)]) @ across.T
    waves = [np.ones_like(angles), *(turn(n * angles) for n in range(1, WAVES + 1) for turn in (np.cos, np.sin))]
    forces = model.rows(nodes, normals).T @ (face.areas[:, None] * np.column_stack(waves))
    shapes = np.asarray(Flexibility(model).solve(forces))
    movement = moved_nodes(mesh.nodes @ across, radius, len(nodes), depths) @ across.T
    size = 4 * np.pi * radius / len(nodes)
    scale = min(1.0, STEP * size / float(np.abs(movement).max()))
    ends = [component_model(replace(mesh, nodes=mesh.nodes + side * scale * movement), component, where).K
            for side in (1, -1)]  # fmt: skip
    change = -shapes.T @ ((ends[0] - ends[1]) @ shapes) / (2 * scale)
    return float(np.abs(linalg.eigvalsh(0.5 * (change + change.T), forces.T @ shapes)).max())


def moved_nodes(places: np.ndarray, radius: float, count: int, depths: np.ndarray) -> np.ndarray:
    """Return the movement of nodes at places across the axis (n, 2) by worn depths, (n, 2).

    Args:
        radius: Of the bore [m].
        count: Number of its places, two to an element.
        depths: Of evenly spaced cells from angle zero [m].
    """
    apart, angles = np.linalg.norm(places, axis=1), np.arctan2(places[:, 1], places[:, 0]) % (2 * np.pi)
    cells = np.arange(len(depths) + 1) * 2 * np.pi / len(depths)
    height = np.interp(angles, cells, np.append(depths, depths[0]))
    reach = LAYERS * 4 * np.pi * radius / count
    height *= np.clip(1 - (apart - radius) / reach, 0.0, 1.0)
    return places / np.where(apart > 0, apart, 1.0)[:, None] * height[:, None]
