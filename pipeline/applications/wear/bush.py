"""What wear of an elastic bearing does to its compliance: an estimate, and the profile of the worn bush.

The compliance stays that of the unworn bush while the estimate is within the component's `change.tolerance`; above it,
the modes are computed again on the mesh whose bore is moved by the worn depths. Worn depths h(θ) move the nodes of the
bore outwards along their radii, and those of the elements beside it the less the further away they are. With Y = K⁻¹ F
the answers to pressures cos nθ and sin nθ about the bore, whose nodal forces stay, their compliance C = Fᵀ Y changes by
δC = −Yᵀ δK Y, to first order in the movement. The largest |δC| over C of all combinations is what the kept compliance
neglects.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from scipy import linalg
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from gudgeon.pipeline.applications.wear.profile import write_table
from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.geometry.surfaces import cylindrical
from gudgeon.pipeline.interfaces.point_mass import component_model
from gudgeon.pipeline.interfaces.tie import refuse_rigid
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.stages.folder import held
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
FLAT = 1e-3
"""Half the height of the table of a plane bore [m]."""


def compliance_change(job: Any, name: str, joint: Clearance, depths: np.ndarray) -> float:
    """Return the largest relative change of the compliance of a joint's bush by worn depths, (cells,).

    The mesh and the modes of the bush are in the database.

    Raises:
        InputError: a surface of the bush is rigid.
    """
    bearing, key = joint.bearing, f"joint.{name}.bearing"
    assert bearing is not None
    assert bearing.component is not None
    assert bearing.interface is not None
    component, mesh = job.scene.component[bearing.component], job.record(bearing.component, "mesh")
    refuse_rigid(component.interface, mesh, f"{job.path}: component.{bearing.component}", "the wear of a bearing")
    face = job.record(bearing.component).interfaces[bearing.interface]
    across, radius = frame_along(joint.axes[1])[:, :2], joint.radius + joint.clearance
    off, nodes = cKDTree(mesh.nodes).query(face.points)
    if off.max() > ON_NODE * radius:
        raise StageError(f"{job.path}: {key}.interface: a point of the bore is {off.max():.2g} m from its node")
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
    ends = [component_model(replace(mesh, nodes=mesh.nodes + side * scale * movement), component, key).K
            for side in (1, -1)]  # fmt: skip
    change = -shapes.T @ ((ends[0] - ends[1]) @ shapes) / (2 * scale)
    return float(np.abs(linalg.eigvalsh(0.5 * (change + change.T), forces.T @ shapes)).max())


def worn_profile(job: Any, name: str, joint: Clearance, depths: np.ndarray) -> dict[str, Any]:
    """Write the profile of a worn bush into the folder of results, and return the component's `change` that has it.

    The mesh of the bush is in the database. A table that the scene has is replaced: its depths are among `depths`.

    Args:
        depths: Of evenly spaced cells about the joint's axis [m], (cells,).

    Raises:
        StageError: the bore is no cylinder.
    """
    bearing = joint.bearing
    assert bearing is not None
    assert bearing.component is not None
    component, mesh = job.scene.component[bearing.component], job.record(bearing.component, "mesh")
    key, surface_name = f"{job.path}: component.{bearing.component}", component.interface[bearing.interface].surface
    surface = mesh.surfaces[surface_name]
    if surface.shape.get("kind") != "cylinder":
        raise StageError(
            f"{key}: wear moves its surface '{surface_name}', which is no cylinder; declare it in geometry"
        )
    nodes = mesh.nodes[np.unique(surface.facets)]
    _, around, heights = cylindrical(nodes, surface.shape)
    across = nodes @ frame_along(joint.axes[1])[:, :2]
    angles = np.arctan2(across[:, 1], across[:, 0])
    # Both count from axes of their own, perhaps in opposite directions: θ = ± φ + constant.
    turns = {sign: np.exp(1j * (angles - sign * around)).mean() for sign in (1.0, -1.0)}
    sign = max(turns, key=lambda s: abs(turns[s]))
    cell_angles = 2 * np.pi / len(depths) * np.arange(len(depths) + 1)
    shape = CubicSpline(cell_angles, np.append(depths, depths[0]), bc_type="periodic")
    columns = np.linspace(-np.pi, np.pi, len(nodes) + 1)
    row = np.maximum(shape((sign * columns + np.angle(turns[sign])) % (2 * np.pi)), 0.0)
    row[-1] = row[0]
    head = ["height [m]", *(f"{x:.12g}" for x in np.degrees(columns))]
    ends = (heights.min() - FLAT, heights.max() + FLAT)
    rows = [[f"{end:.12g}", *(f"{x:.15g}" for x in row)] for end in ends]
    with held(job.out):
        path = write_table(job.out, bearing.component, [head, *rows])
    return {"update": "recompute", "profile": {"surface": surface_name, "table": str(path.resolve()), "scale": 1.0}}


def moved_nodes(positions: np.ndarray, radius: float, count: int, depths: np.ndarray) -> np.ndarray:
    """Return the movement of nodes at places across the axis (n, 2) by worn depths, (n, 2).

    Args:
        radius: Of the bore [m].
        count: Number of its places, two to an element.
        depths: Of evenly spaced cells from angle zero [m].
    """
    distance, angles = np.linalg.norm(positions, axis=1), np.arctan2(positions[:, 1], positions[:, 0]) % (2 * np.pi)
    cells = np.arange(len(depths) + 1) * 2 * np.pi / len(depths)
    height = np.interp(angles, cells, np.append(depths, depths[0]))
    depth_of_decay = LAYERS * 4 * np.pi * radius / count
    height *= np.clip(1 - (distance - radius) / depth_of_decay, 0.0, 1.0)
    return positions / np.where(distance > 0, distance, 1.0)[:, None] * height[:, None]
