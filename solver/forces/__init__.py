"""Given loads: each is a generalised force over time. A new one is a file and a line here."""

from solver.forces.gas import GasPressure

FORCES = {"gas": GasPressure}

Force = GasPressure
