"""F5 of the reference set as a sector: a chain of two-mass sectors, closed form when tuned, 50 digits when mistuned."""

import json
from pathlib import Path

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.cyclic import CyclicHarmonic
from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.applications.wheel.cyclic.harmonic import harmonic_modes
from gudgeon.pipeline.applications.wheel.cyclic.hermitian import lowest_pairs
from gudgeon.pipeline.applications.wheel.cyclic.sector import Sector, cyclic_sector
from gudgeon.pipeline.applications.wheel.cyclic.whole_wheel import Mistuning, wheel_problem
from gudgeon.pipeline.fem.model import FEModel, MassProperties
from gudgeon.pipeline.geometry.symmetry import CyclicSymmetry

F5 = json.loads((Path(__file__).parents[2] / "data/bladed-disk/F5_cyclic_chain.json").read_text())


def chain() -> tuple[Sector, Mistuning]:
    """Return a sector of three nodes that move along the axis, disk, blade, and the next disk without mass."""
    given = F5["parameters"]
    angle = 2 * np.pi / given["sectors"]
    nodes = np.array([[1.0, 0, 0], [2.0, 0, 0], [np.cos(angle), np.sin(angle), 0]])
    ends = {name: Surface(np.array([[node]]), {}) for name, node in (("low", 0), ("high", 2))}
    mesh = MeshRecord(nodes=nodes, cells=np.array([[0, 1, 2]]), cell_type="line3", surfaces=ends)
    blade, coupling = given["blade_stiffness"], given["disk_coupling"]
    part = blade * np.array([[1.0, -1, 0], [-1, 1, 0], [0, 0, 0]])
    K = part + coupling * np.array([[1.0, 0, -1], [0, 0, 0], [-1, 0, 1]])
    K[0, 0] += given["disk_ground_stiffness"]
    M = np.diag([given["disk_mass"], given["blade_mass"], 0.0])
    model = FEModel(
        sparse.csr_matrix(K), sparse.csr_matrix(M), mesh, np.array([[0.0, 0, 1]]), np.zeros((1, 3)),
        MassProperties(1.1, np.zeros(3), np.eye(3)), np.empty((0, 6)), np.zeros(3, bool),
    )  # fmt: skip
    sector = cyclic_sector(model, CyclicSymmetry(sectors=given["sectors"]))
    factors = 1 + np.array(given["mistuning_of_blade_stiffness"])
    return sector, Mistuning(sparse.csr_matrix(part), factors)


def tuned_modes(sector: Sector, count: int) -> list[CyclicHarmonic]:
    """Return the lowest `count` elastic modes of every harmonic 0…N/2."""
    return [harmonic_modes(sector, harmonic, count) for harmonic in sector.symmetry.harmonics()]


def wheel_frequencies(sector: Sector, count: int, mistuning: Mistuning | None = None) -> np.ndarray:
    """Return the lowest elastic frequencies of the whole wheel [rad/s], (count,)."""
    return np.sqrt(lowest_pairs(wheel_problem(sector, mistuning), count).values)
