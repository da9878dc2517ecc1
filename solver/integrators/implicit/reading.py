"""What gauges and probes read of the implicit loop at the end of a step, by its coordinates and forces."""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.integrators.outcome import Samples
from gudgeon.solver.ports.members import contact_ports, function_ports, ports_of, probe_ports
from gudgeon.solver.system.gauges import gauge_loads
from gudgeon.solver.system.system import System


class Ends(NamedTuple):
    """What stands at the ends of samples. Shapes: s samples, m coordinates, c contact rows, L loads."""

    q: np.ndarray
    """(s, m)"""
    v: np.ndarray
    """(s, m)"""
    contacts: np.ndarray
    """Forces of contacts [N], (s, c)."""
    amounts: np.ndarray
    """Of the loads; of joints the force of the step, (s, L)."""
    functions: np.ndarray
    """Half the forces of functions of traction spaces, (s, functions)."""

    @classmethod
    def of(cls, samples: int, arrays: tuple[np.ndarray, ...]) -> "Ends":
        """Return room for samples of arrays."""
        return cls(*(np.empty((samples, len(a))) for a in arrays))


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

    def read(self, ends: Ends, times: np.ndarray, out: Samples) -> None:
        """Set the gauges and probes of samples from what stood at their ends, at times [s], (s,)."""
        system, loads = self._system, self._system.driving.loads(times, 0.0)
        if system.gauges:
            moved = system.gauged(ends.q, ends.v)
            out.gauges[:] = moved + ends.contacts @ system.gauge_residual.T + loads @ self._pushed.T
        if probes := system.probes if system.probes.names else None:
            count = 2 * len(system.driving.joints)
            amounts = np.hstack([ends.amounts[:, :count], loads[:, count:]])
            forces = np.hstack([ends.contacts, amounts, 2 * ends.functions])
            rigid = ends.contacts @ probes.pressed.T
            by_forces = np.where(self._flexible, forces @ self._per_force.T, rigid)
            out.probes[:] = probes.values(ends.q, ends.v) + by_forces
