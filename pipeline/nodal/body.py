"""One body of the full FE: the midpoint rule, its rigid motion apart, and its response at a few ports.

    S v̄ = M v − ½ h K u + ½ h f,   u⁺ = u + h v̄,   v⁺ = 2 v̄ − v,   S = M + α K,   α = ¼ h² + ½ h β

A rigid motion Φ_r q is decoupled in this rule (K Φ_r = 0; p̄ = p + ½ h Φ_rᵀ f, p = q̇) and is integrated separately:
beside a stroke of centimetres the small elastic part keeps its digits, and with them the strain energy. Suppressed
motions are projected out. A port is a row of displacements at which a force may act.
"""

import numpy as np
from scipy import sparse
from scipy.linalg.blas import daxpy

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.linalg import factorise
from gudgeon.pipeline.nodal.problem import NodalBody

RIGID_TOLERANCE = 1e-6
"""Error allowed of ΦᵀMΦ = 1, and of ΦᵀKΦ = 0 over the largest K_ii / M_ii; round-off of assembly is 1e-11."""
REFRESH = 256
"""Steps after which K u and M v, updated from the solution of each step, are multiplied out again."""
BLOCK = 128
"""Ports solved at once."""


class MovingBody:
    """State of a body and its constant matrices at one step size.

    Args:
        ports: Rows of displacements at which forces may act, (p, dofs).
        step: h [s].

    Raises:
        StageError: `rigid` or `suppressed` of the body are not its rigid motions.
    """

    def __init__(self, body: NodalBody, ports: sparse.csr_matrix, step: float) -> None:
        self.K, self.M, self.step = body.K, body.M, step
        self.alpha, self.damping = body.alpha(step), body.damping
        self.rigid_count = 0 if body.rigid is None else body.rigid.shape[1]
        self._Phi = body.all_rigid()
        self._MPhi = np.asarray(body.M @ self._Phi)
        self._check_rigid(body.name)
        self._factor = factorise(body.M + self.alpha * body.K, definite=True)
        self._ports, self._columns = ports, sparse.csr_matrix(ports.T)
        self._ports_all = np.asarray(ports @ self._Phi)
        self.ports_rigid = np.ascontiguousarray(self._ports_all[:, : self.rigid_count])
        self._Z = self._port_answers(ports)
        W = np.asarray(ports @ self._Z.T) + self.ports_rigid @ self.ports_rigid.T
        self.W = (step**2 / 4) * (W + W.T)
        """Displacement of the ports at the end of a step per constant force [m/N], (p, p)."""
        rows = body.load_rows()
        self._loads_all = rows @ self._Phi
        self._loads = rows - self._loads_all @ self._MPhi.T
        self._begin(body)

    def _begin(self, body: NodalBody) -> None:
        (u, v), r = body.start, self.rigid_count
        self.q, self.p = (self._MPhi.T @ u)[:r], (self._MPhi.T @ v)[:r]
        self.u, self.v = self._elastic(u), self._elastic(v)
        self._Ku, self._Mv = self.K @ self.u, self.M @ self.v
        self._count, self.dissipated, self.work = 0, 0.0, 0.0

    @property
    def kinetic(self) -> float:
        """[J]"""
        return 0.5 * float(self.p @ self.p) + 0.5 * float(self.v @ self._Mv)

    @property
    def strain(self) -> float:
        """[J]"""
        return 0.5 * float(self.u @ self._Ku)

    def places(self) -> np.ndarray:
        """Return the present displacement of the ports [m], (p,)."""
        return self._ports @ self.u + self.ports_rigid @ self.q

    def rates(self, ports: slice = slice(None)) -> np.ndarray:
        """Return the present velocity of the ports, or of some of them [m/s], (p,)."""
        return self._ports[ports] @ self.v + self.ports_rigid[ports] @ self.p

    def motion(self) -> np.ndarray:
        """Return present displacements [m] and velocities [m/s], rigid motion included, (2, dofs)."""
        Phi = self._Phi[:, : self.rigid_count]
        return np.array([self.u + Phi @ self.q, self.v + Phi @ self.p])

    def predict(self, loads: np.ndarray) -> np.ndarray:
        """Begin a step under constant loads (l,); returns the end of the ports without port forces [m], (p,)."""
        h = self.step
        self._given = loads
        self._rhs = self._Mv - (h / 2) * self._Ku
        self._mean_q = self.p
        acting = np.flatnonzero(loads)
        if len(acting):
            self._rhs += (h / 2) * (loads[acting] @ self._loads[acting])
            self._mean_q = self.p + (h / 2) * (loads[acting] @ self._loads_all[acting])[: self.rigid_count]
        self._mean = self._elastic(self._factor.solve(self._rhs))
        return self._ports @ (self.u + h * self._mean) + self.ports_rigid @ (self.q + h * self._mean_q)

    def advance(self, forces: np.ndarray) -> np.ndarray:
        """End the step under constant forces on the ports (p,) [N]; returns the change of q, (r,)."""
        h = self.step
        acting = np.flatnonzero(forces)
        if len(acting):
            for port in acting:
                daxpy(self._Z[port], self._mean, a=h / 2 * forces[port])
            along = forces[acting] @ self._ports_all[acting]
            self._rhs += (h / 2) * (self._columns @ forces - self._MPhi @ along)
            self._mean_q = self._mean_q + (h / 2) * along[: self.rigid_count]
        mean, growth = self._mean, h * self._mean_q
        M_mean = self.M @ mean
        K_mean = (self._rhs - M_mean) / self.alpha
        self.dissipated += h * self.damping * float(mean @ K_mean)
        for load in np.flatnonzero(self._given):
            displacement = h * (self._loads[load] @ mean) + self._loads_all[load, : self.rigid_count] @ growth
            self.work += float(self._given[load] * displacement)
        self.q, self.p = self.q + growth, 2 * self._mean_q - self.p
        self.u, self.v = self.u + h * mean, 2 * mean - self.v
        self._count += 1
        if self._count % REFRESH:
            self._Ku, self._Mv = self._Ku + h * K_mean, 2 * M_mean - self._Mv
        else:
            self._Ku, self._Mv = self.K @ self.u, self.M @ self.v
        return growth

    def free(self) -> None:
        """Release the factor's memory."""
        self._factor.free()

    def _elastic(self, field: np.ndarray) -> np.ndarray:
        """Project rigid motions out of displacements (dofs, ...)."""
        return field - self._Phi @ (self._MPhi.T @ field)

    def _port_answers(self, ports: sparse.csr_matrix) -> np.ndarray:
        """Z = S⁻¹ portsᵀ without rigid motions, (p, dofs)."""
        Z = np.empty(ports.shape)
        for start in range(0, len(Z), BLOCK):
            block = slice(start, start + BLOCK)
            Z[block] = self._elastic(self._factor.solve(ports[block].T.toarray())).T
        return Z

    def _check_rigid(self, name: str) -> None:
        if not self._Phi.shape[1]:
            return
        mass = self._Phi.T @ self._MPhi - np.eye(self._Phi.shape[1])
        scale = float((self.K.diagonal() / self.M.diagonal()).max())
        strain = np.abs(self._Phi.T @ (self.K @ self._Phi)).max() / (scale or 1.0)
        if max(np.abs(mass).max(), strain) > RIGID_TOLERANCE:
            raise StageError(f"full FE: body '{name}': its rigid motions strain it or are not mass-orthonormal")
