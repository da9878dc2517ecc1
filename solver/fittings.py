"""What stands beside contacts: springs between bodies, and gauges that are read; and R across the sides of contacts."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from modaldb.schema import Json
from solver.body import FlexibleBody
from solver.contacts import ContactRows
from solver.errors import SceneError
from solver.scene import Scene

if TYPE_CHECKING:
    from solver.system import System


@dataclass(frozen=True)
class Springs:
    """Springs between bodies and to the ground, b of them."""

    rows: np.ndarray
    """Elongation per coordinate, (b, m)."""
    stiffness: np.ndarray
    """[N/m], (b,)"""
    damping: np.ndarray
    """[N s/m], (b,)"""
    stretch: np.ndarray
    """Elongation at q = 0 [m], (b,)."""


def compile_gauges(
    bodies: dict[str, FlexibleBody], offsets: dict[str, int], contacts: list[ContactRows], size: int
) -> dict[str, Any]:
    """Return what gauges read of coordinates and contact forces."""
    names, rows, residual = [], [np.empty((0, size))], [np.empty((0, sum(len(item.points) for item in contacts)))]
    for name, body in bodies.items():
        for key, gauge in body.modal.gauges.items():
            k = len(gauge.rows)
            names += [f"{name}.{key}"] * k
            over, pressed = np.zeros((k, size)), np.zeros((k, residual[0].shape[1]))
            first = offsets[name] + body.rigid_count
            over[:, first : first + gauge.rows.shape[1]] = gauge.rows
            for contact in contacts:
                for owner, interface, order in sides_of(contact):
                    if owner == name and gauge.residual.shape[1]:
                        begin, end = body.modal.interface_rows[interface]
                        # A contact pushes against the outward normal, along which R's rows count.
                        pressed[:, contact.rows] -= gauge.residual[:, begin:end][:, order]
            rows.append(over)
            residual.append(pressed)
    return {"gauges": names, "gauge_rows": np.vstack(rows), "gauge_residual": np.vstack(residual)}


def recorded_gauges(system: "System", values: np.ndarray) -> dict[str, np.ndarray]:
    """Return the readings of each gauge of values (s, G), (s,) or (s, k)."""
    names = np.array(system.gauges[: values.shape[1]])
    columns = {name: np.flatnonzero(names == name) for name in dict.fromkeys(names.tolist())}
    return {name: values[:, own[0] if len(own) == 1 else own].copy() for name, own in columns.items()}


def gauge_quantities(system: "System", readings: dict[str, np.ndarray]) -> Json:
    """Return the largest equivalent stress after von Mises of each gauge that reads a stress tensor."""
    found: Json = {}
    for name, values in readings.items():
        body, _, gauge = name.partition(".")
        if values.ndim < 2 or not len(values) or system.bodies[body].modal.gauges[gauge].unit != "Pa":
            continue
        xx, yy, zz, xy, yz, zx = values.T
        normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
        largest = np.sqrt(0.5 * normal + 3 * (xy**2 + yz**2 + zx**2)).max()
        found[f"{name}.von_mises_peak"] = {"value": float(largest), "unit": "Pa"}
    return found


def sides_of(contact: ContactRows) -> list[tuple[str, str, np.ndarray]]:
    """Return body, interface and order of points on each side of a contact."""
    sides = [(contact.body, contact.interface, np.arange(len(contact.points)))]
    if contact.other is not None:
        sides.append((contact.other.body, contact.other.interface, contact.other.order))
    return sides


def compile_springs(scene: Scene, bodies: dict[str, FlexibleBody], offsets: dict[str, int], size: int) -> Springs:
    """Build the springs.

    Raises:
        SceneError: a spring on an elastic body, or one that cannot stretch.
    """
    springs = scene.springs()
    rows = np.zeros((len(springs), size))
    for number, (name, spring) in enumerate(springs.items()):
        line = np.asarray(spring.direction, float)
        line /= np.linalg.norm(line)
        place = np.asarray(scene.body[spring.body].position) + spring.at
        for owner, sign in ((spring.body, 1.0), (spring.against, -1.0)):
            if owner is None:
                continue
            body = bodies[owner]
            if len(body.modal.angular_frequencies):
                raise SceneError(f"force.{name}: body '{owner}' is elastic; a spring acts on a rigid body")
            point = place - np.asarray(scene.body[owner].position)
            part = sign * body.rigid_rows(point[None], line[None])[0]
            rows[number, offsets[owner] : offsets[owner] + len(part)] += part
        if not np.any(rows[number]):
            raise SceneError(f"force.{name}.direction: the body cannot move along it")
    values = [(spring.stiffness, spring.damping, spring.stretch) for spring in springs.values()]
    stiffness, damping, stretch = np.array(values).reshape(-1, 3).T
    return Springs(rows, stiffness, damping, stretch)
