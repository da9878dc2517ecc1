"""Static displacement of a tuned wheel under an engine order, of which modes alone have a part.

A force e^{iθ r j} on blade j, r the engine order, moves sector 0 by u = C v with C = C₀ + e^{iθr} C₁ and

  Cᴴ K C v = Cᴴ c,

of one sector, whatever their number. A wheel with rigid motions R in this harmonic has its elastic part, with
(Cᴴ M C R)ᴴ v = 0 and the force balanced by inertia.
"""

import numpy as np
from scipy import sparse

from gudgeon.pipeline.applications.wheel.cyclic.harmonic import at_phase, phase_of, rigid_motions
from gudgeon.pipeline.applications.wheel.cyclic.hermitian import orthonormal
from gudgeon.pipeline.applications.wheel.cyclic.sector import Sector
from gudgeon.pipeline.linalg import factorise


def static_response(sector: Sector, row: np.ndarray, engine_order: int) -> float:
    """Return the static displacement of each blade along a row per unit force along it on every blade [m/N].

    Args:
        row: c, over a sector's dofs, (dofs,).
    """
    harmonic = engine_order % sector.symmetry.sectors
    phase = phase_of(harmonic * sector.symmetry.angle)
    K, M = (sparse.csr_matrix(at_phase(sector.own, sector.next, A, phase)) for A in (sector.model.K, sector.model.M))
    load = np.asarray((sector.own + phase * sector.next).conj().T @ row, complex)
    M_rigid = sparse.csr_matrix(M @ orthonormal(rigid_motions(sector, harmonic), M))
    bordered = sparse.csr_matrix(sparse.bmat([[K, M_rigid], [M_rigid.conj().T, None]]) if M_rigid.shape[1] else K)
    A, B = bordered.real, bordered.imag
    f = np.concatenate([load, np.zeros(M_rigid.shape[1])])
    factor = factorise(sparse.csr_matrix(sparse.bmat([[A, -B], [B, A]])))
    answer = factor.solve(np.concatenate([f.real, f.imag]))
    factor.free()
    v = answer[: len(load)] + 1j * answer[len(f) : len(f) + len(load)]
    return float((load.conj() @ v).real)
