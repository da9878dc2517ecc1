"""One body in the full-FE run: the midpoint rule, its rigid motion apart, and its response at a few ports.

    S v̄ = M v − ½ h K u + ½ h f,   u⁺ = u + h v̄,   v⁺ = 2 v̄ − v,   S = M + α K,   α = ¼ h² + ½ h β

A rigid motion Φ_r q is independent of all else in this rule (K Φ_r = 0; p̄ = p + ½ h Φ_rᵀ f, p = q̇) and is integrated on
its own: the elastic part stays as small as it is beside a stroke of centimetres, so that its energy is not lost in
round-off. What is suppressed is projected out. A port is a row of displacements at which a force may act.
"""

import numpy as np
from scipy import sparse
from scipy.linalg.blas import daxpy

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.linalg import factorise
from gudgeon.pipeline.nodal.problem import NodalBody

RIGID_TOLERANCE = 1e-6
"""Of ΦᵀMΦ = 1 and of the strain energy of Φ per largest stiffness over mass; round-off of assembly is 1e-11."""
REFRESH = 256
"""Steps after which K u and M v, carried on by what the solution says, are multiplied out again."""
BLOCK = 128
"""Ports solved at once."""


class MovingBody:
    """State of a body and its constant matrices at one step size.

    Args:
        body: What it is made of.
        ports: Rows of displacements at which forces may act, (p, dofs).
        step: h [s].

    Raises:
        StageError: the rigid motions are none.
    """

    def __init__(self, body: NodalBody, ports: sparse.csr_matrix, step: float) -> None:
        self.K, self.M, self.step = body.K, body.M, step
        self.alpha, self.damping = step**2 / 4 + step * body.damping / 2, body.damping
        size = body.K.shape[0]
        none = np.zeros((size, 0))
        rigid = none if body.rigid is None else body.rigid
        held = none if body.suppressed is None else body.suppressed
        self.rigid_count = rigid.shape[1]
        self._Phi = np.column_stack([rigid, held])
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
        zero = np.zeros(self.K.shape[0])
        u, v = (zero if x is None else np.array(x, float) for x in (body.displacement, body.velocity))
        r = self.rigid_count
        self.q, self.p = (self._MPhi.T @ u)[:r], (self._MPhi.T @ v)[:r]
        self.u, self.v = self._elastic(u), self._elastic(v)
        self._Ku, self._Mv = self.K @ self.u, self.M @ self.v
        self._mean, self._rhs, self._mean_q = zero, zero, self.p
        self._count, self.dissipated, self.work = 0, 0.0, 0.0
        self._given = np.zeros(len(self._loads))

    @property
    def kinetic(self) -> float:
        """[J]"""
        return 0.5 * float(self.p @ self.p) + 0.5 * float(self.v @ self._Mv)

    @property
    def strain(self) -> float:
        """[J]"""
        return 0.5 * float(self.u @ self._Ku)

    def places(self) -> np.ndarray:
        """Return the displacement of the ports now [m], (p,)."""
        return self._ports @ self.u + self.ports_rigid @ self.q

    def rate(self, number: int) -> float:
        """Return the velocity of one port now [m/s]."""
        return float((self._ports[number] @ self.v)[0] + self.ports_rigid[number] @ self.p)

    def rates(self) -> np.ndarray:
        """Return the velocity of the ports now [m/s], (p,)."""
        return self._ports @ self.v + self.ports_rigid @ self.p

    def motion(self) -> np.ndarray:
        """Return displacements and velocities now, rigid motion included, (2, dofs)."""
        Phi = self._Phi[:, : self.rigid_count]
        return np.array([self.u + Phi @ self.q, self.v + Phi @ self.p])

    def predict(self, loads: np.ndarray) -> np.ndarray:
        """Begin a step under constant loads (l,); returns where the ports end without forces on them [m], (p,)."""
        h = self.step
        self._given = loads
        self._rhs = self._Mv - (h / 2) * self._Ku
        self._mean_q = self.p
        if len(loads):
            self._rhs += (h / 2) * (loads @ self._loads)
            self._mean_q = self.p + (h / 2) * (loads @ self._loads_all)[: self.rigid_count]
        self._mean = self._elastic(self._factor.solve(self._rhs))
        return self._ports @ (self.u + h * self._mean) + self.ports_rigid @ (self.q + h * self._mean_q)

    def advance(self, forces: np.ndarray) -> np.ndarray:
        """End the step with constant forces on the ports (p,); returns what q grew by, (r,)."""
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
        for load, row, rigid in zip(self._given, self._loads, self._loads_all, strict=True):
            self.work += float(load * (h * (row @ mean) + rigid[: self.rigid_count] @ growth))
        self.q, self.p = self.q + growth, 2 * self._mean_q - self.p
        self.u, self.v = self.u + h * mean, 2 * mean - self.v
        self._count += 1
        if self._count % REFRESH:
            self._Ku, self._Mv = self._Ku + h * K_mean, 2 * M_mean - self._Mv
        else:
            self._Ku, self._Mv = self.K @ self.u, self.M @ self.v
        return growth

    def free(self) -> None:
        """Give the factor's memory back."""
        self._factor.free()

    def _elastic(self, field: np.ndarray) -> np.ndarray:
        """Take rigid motions out of displacements (dofs, ...)."""
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
            raise StageError(f"nodal: body '{name}': rigid motions strain it or are not mass-orthonormal")
