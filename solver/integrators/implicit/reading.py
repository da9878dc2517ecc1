"""What gauges and probes read of the implicit loop at the end of a step, by its coordinates and forces."""

import numpy as np

from gudgeon.solver.integrators.implicit.arrays import Loads, Masters, Modes, Points
from gudgeon.solver.ports.members import contact_ports, function_ports, ports_of, probe_ports
from gudgeon.solver.system.gauges import gauge_loads
from gudgeon.solver.system.system import System


class Readers:
    """The gauges and probes of a system."""

    def __init__(self, system: System) -> None:
        self._system, driving = system, system.driving
        self.present = bool(system.gauges or system.probes.names)
        self._pushed = gauge_loads(system.bodies, driving.places(), len(driving.rows))
        if not system.probes.names:
            return
        ports = ports_of(system)
        members = [f"joint.{joint.name}" for joint in driving.joints] + [f"force.{load.name}" for load in driving.given]
        masters = [contact for contact in system.contacts if contact.master is not None]
        none = np.empty(0, np.int64)
        normals = np.concatenate([none, *(contact_ports(ports, contact) for contact in system.contacts)])
        functions = np.concatenate([none, *(function_ports(ports, contact)[0] for contact in masters)])
        self._acting = np.concatenate([normals, ports.numbers(members), functions])
        self._per_force = probe_ports(system, ports)[:, self._acting]
        self._flexible = probe_ports(system, ports).any(axis=1)

    def gauged(self, modes: Modes, points: Points, time: float) -> np.ndarray:
        """Return the gauges at the end of a step [s], (G,)."""
        system = self._system
        moved = system.gauged(modes.q[None], modes.v[None])[0]
        return moved + system.gauge_residual @ points.multipliers + self._pushed @ self._given(time)

    def probed(self, modes: Modes, points: Points, masters: Masters, loads: Loads, time: float) -> np.ndarray:
        """Return the values of all probes at the end of a step [s], (P,); joints have the force of the step."""
        probes, count = self._system.probes, 2 * len(self._system.driving.joints)
        amounts = np.concatenate([loads.amount[:count], self._given(time)[count:]])
        forces = np.concatenate([points.multipliers, amounts, 2 * masters.function_forces[1]])
        by_forces = np.where(self._flexible, self._per_force @ forces, probes.pressed @ points.multipliers)
        return probes.values(modes.q[None], modes.v[None])[0] + by_forces

    def _given(self, time: float) -> np.ndarray:
        """Return the given loads at a time [s], (L,)."""
        return self._system.driving.loads(np.array([time]), 0.0)[0]
