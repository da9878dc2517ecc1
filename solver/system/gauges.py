"""Gauges compiled: rows and residuals of a scene's readings."""

from typing import Any

import numpy as np

from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.contact.rows import ContactRows


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


def sides_of(contact: ContactRows) -> list[tuple[str, str, np.ndarray]]:
    """Return body, interface and order of points on each side of a contact."""
    sides = [(contact.body, contact.interface, np.arange(len(contact.points)))]
    if contact.other is not None:
        sides.append((contact.other.body, contact.other.interface, contact.other.order))
    return sides
