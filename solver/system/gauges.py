"""Compiled gauges: their rows over coordinates and contact forces."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from gudgeon.solver.bodies.holding import HELD
from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.contact.shares import shared_columns


def compile_gauges(
    bodies: dict[str, FlexibleBody], contacts: list[ContactRows], size: int, gravity: Sequence[float]
) -> dict[str, Any]:
    """Return names and rows of all gauges over the coordinates, (G, size), their rates, (G, size), and the contact
    forces, (G, c); what they show under gravity [m/s²] beside that, (G,)."""
    names, rows, residual = [], [np.empty((0, size))], [np.empty((0, sum(len(item.points) for item in contacts)))]
    rates, weighed = [np.empty((0, size))], [np.empty(0)]
    for name, body in bodies.items():
        for key, gauge in body.modal.gauges.items():
            k = len(gauge.rows)
            names += [f"{name}.{key}"] * k
            gauge_rows, per_force = np.zeros((k, size)), np.zeros((k, residual[0].shape[1]))
            gauge_rows[:, body.elastic] = gauge.rows
            rates.append(np.zeros((k, size)))
            if key.startswith(HELD):  # A joint bears what damps the modes.
                rates[-1][:, body.elastic] = gauge.rows * (body.damping_rates / body.stiffness)
            weighed.append(np.zeros(k) if gauge.weights is None else gauge.weights @ np.asarray(gravity, float))
            for contact in contacts:
                for owner, interface, weights, *_ in contact.sides:
                    if owner == name and gauge.residual.size:  # A mechanism reads none.
                        start, end = body.modal.interface_rows[interface]
                        # A contact force acts against the outward normal, R's rows along it.
                        per_force[:, contact.rows] -= shared_columns(weights, gauge.residual[:, start:end])
            rows.append(gauge_rows)
            residual.append(per_force)
    return {
        "gauges": names, "gauge_rows": np.vstack(rows), "gauge_residual": np.vstack(residual),
        "gauge_weights": np.concatenate(weighed), "gauge_rates": np.vstack(rates),
    }  # fmt: skip


def gauge_loads(
    bodies: dict[str, FlexibleBody], load_places: Iterable[tuple[str, str | None, np.ndarray, slice]], count: int
) -> np.ndarray:
    """Return the quasi-static values of all gauges per load, (G, L).

    Args:
        load_places: Of loads, see `Driving.places`.
        count: Number of loads, L.
    """
    members, blocks = list(load_places), [np.empty((0, count))]
    for name, body in bodies.items():
        for gauge in body.modal.gauges.values():
            values = np.zeros((len(gauge.rows), count))
            for owner, interface, mix, rows in members:
                if owner == name and interface is not None and gauge.residual.size:
                    values[:, rows] = gauge.residual[:, slice(*body.modal.interface_rows[interface])] @ mix.T
            blocks.append(values)
    return np.vstack(blocks)
