"""Bores of elastic bearings: places about an axis, and what they yield to static forces."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.modaldb.stores.base import Store
from gudgeon.solver.errors import SceneError
from gudgeon.solver.joints.clearance import Clearance
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.vectors import frame_along

ROUND = 0.02
"""Largest distance of a place from the bore's radius, over it: facets of curved meshes are closer."""
RADIAL = 0.98
"""Least scalar product of a place's normal and its radius."""
READ = ("angular_frequencies", "residual_flexibility", "interface_rows")


class ElasticBore(NamedTuple):
    """Places that press a journal, p of them."""

    angles: np.ndarray
    """About the bearing's axis, from the first axis of its marker, ascending [rad], (p,)."""
    areas: np.ndarray
    """[m²], (p,)"""
    compliance: np.ndarray
    """Displacement along the radius per force along it [m/N], (p, p)."""


def read_bores(store: Store, scene: Scene, morphs: Mapping[str, str]) -> dict[str, ElasticBore]:
    """Return the bores of the joints of a scene that have an elastic bearing.

    Raises:
        SceneError: the component is not held, or its interface is no bore about the joint's axis.
    """
    bores = {}
    for name, joint in scene.hinges().items():
        if not isinstance(joint, Clearance) or (bearing := joint.bearing) is None:
            continue
        if bearing.component is None:
            bores[name] = foundation(joint)
            continue
        design = store.get(morphs[bearing.component], "morph", only=["modes_key"])
        path = f"interfaces/{bearing.interface}"
        only = [*READ, *(f"{path}/{key}" for key in ("points", "normals", "areas", "rows"))]
        modal: ModalRecord = store.get(design.modes_key, "modes", only=only)
        bores[name] = _of_record(name, joint, modal)
    return bores


def foundation(joint: Clearance) -> ElasticBore:
    """Return the bore of a bed of springs."""
    bearing = joint.bearing
    assert bearing is not None
    assert bearing.foundation is not None
    assert bearing.length is not None
    step = 2 * np.pi / bearing.places
    areas = np.full(bearing.places, step * (joint.radius + joint.clearance) * bearing.length)
    return ElasticBore(step * np.arange(bearing.places), areas, np.diag(1 / (bearing.foundation * areas)))


def _of_record(name: str, joint: Clearance, modal: ModalRecord) -> ElasticBore:
    bearing = joint.bearing
    assert bearing is not None
    assert bearing.interface is not None
    key = f"joint.{name}.bearing"
    if (modal.angular_frequencies <= 0).any():
        raise SceneError(
            f"{key}.component: '{bearing.component}' is free; give it supports, where the bearing is held on its body"
        )
    face = modal.interfaces[bearing.interface]
    start, stop = modal.interface_rows.get(bearing.interface, (0, 0))
    if modal.residual_flexibility is None or stop - start != len(face.points):
        raise SceneError(
            f"{key}.interface: the modes of '{bearing.component}' have no residual flexibility of"
            f" '{bearing.interface}'; use a reduction that has it, such as macneal"
        )
    frame = frame_along(joint.axes[1])
    across = face.points @ frame[:, :2]
    distance, radius = np.linalg.norm(across, axis=1), joint.radius + joint.clearance
    if (worst := np.abs(distance / radius - 1).max()) > ROUND:
        odd = distance[np.abs(distance / radius - 1).argmax()]
        raise SceneError(
            f"{key}.interface: a point of '{bearing.interface}' is {odd:.4g} m from the joint's axis; the bore has a"
            f" radius of radius + clearance = {radius:.4g} m, and {worst:.2g} of it are allowed to be {ROUND:g}"
        )
    facing = np.abs((face.normals @ frame[:, :2] * across).sum(axis=1) / distance)
    if facing.min() < RADIAL:
        raise SceneError(f"{key}.interface: '{bearing.interface}' is no bore; a normal is not along its radius")
    angles = np.arctan2(across[:, 1], across[:, 0]) % (2 * np.pi)
    order = np.argsort(angles, kind="stable")
    C = face.rows / modal.angular_frequencies**2 @ face.rows.T + modal.residual_flexibility[start:stop, start:stop]
    return ElasticBore(angles[order], face.areas[order], C[np.ix_(order, order)])
