"""Bodies of the full FE from FE models, with gravity, and their static deformation at the start."""

from dataclasses import replace

import numpy as np
from scipy import sparse
from scipy.linalg import qr

from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.linalg import factorise
from gudgeon.pipeline.nodal.problem import NodalBody, NodalLoad, NodalProblem, NodalRod


def _rigid_split(model: FEModel, twists: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
    """Return the rigid motions of mass-normalised twists (r, 6), (dofs, r), and all others that supports leave."""
    every, rigid = model.rigid_modes, replace(model, rigid_twists=twists).rigid_modes
    if rigid.shape[1] == every.shape[1]:
        return rigid, None
    if not len(twists):
        return rigid, every
    return rigid, every @ qr(every.T @ (model.M @ rigid))[0][:, len(twists) :]


def supported_body(
    name: str,
    model: FEModel,
    twists: np.ndarray,
    momentum: np.ndarray,
    *,
    damping: float,
    field: np.ndarray,
    deformed: bool = True,
) -> tuple[NodalBody, sparse.csr_matrix]:
    """Return a body with the dofs that its supports leave; a rigid one with its rigid coordinates.

    A supported body starts with the static deformation under its weight, if it starts deformed.

    Args:
        twists: Mass-normalised free rigid motions, (r, 6).
        momentum: Linear and angular about the centre at the start [kg m/s, kg m²/s], (6,).
        damping: β of C = β K [s].
        field: Gravity [m/s²], (3,).

    Returns:
        The body, and the displacement of the model's dofs per dof of the body, (dofs of the model, dofs).
    """
    rates = twists @ momentum
    if not model.K.nnz:
        r = len(twists)
        none, identity = sparse.csr_matrix((r, r)), sparse.csr_matrix(np.eye(r))
        loads = (_steady(model.properties.mass * (twists[:, :3] @ field)),) if field.any() else ()
        body = NodalBody(name, none, identity, rates, damping=damping, rigid=np.eye(r), twists=twists, loads=loads)
        return body, sparse.csr_matrix(replace(model, rigid_twists=twists).rigid_modes)
    free, (K, M), (motions, others) = model.free, model.free_matrices(), _rigid_split(model, twists)
    weight = model.M @ model.of_nodes(np.tile(model.directions @ field, (len(model.nodes), 1)))
    loads = (_steady(weight[free]),) if field.any() else ()
    body = NodalBody(
        name, K, M, (motions @ rates)[free], damping=damping, rigid=motions[free],
        suppressed=None if others is None else others[free], twists=twists, loads=loads,
    )  # fmt: skip
    if loads and model.held.any() and deformed:
        body = replace(body, displacement=_deformation(body, loads[0].rows[0]))
    return body, sparse.csr_matrix(sparse.eye(len(model.held), format="csr")[:, free])


def _steady(row: np.ndarray) -> NodalLoad:
    return NodalLoad(row[None], lambda times: np.ones((len(times), 1)))


def static_start(problem: NodalProblem, step: float, *, deformed: bool = True) -> NodalProblem:
    """Return the problem with the slave deformed statically by its loads, its inertia and the rod, without contact.

    K u = f − M a with a the rigid acceleration under loads and rod. Before and after, position and velocity of the
    slave along the stroke are set so that the rod has its length and the length has no rate.

    Args:
        step: Interval over which the loads' first mean and the crank pin's first acceleration are taken [s].
        deformed: Whether the slave starts deformed.
    """
    slave, rod, interval = problem.slave, problem.rod, np.array([0.0, step])
    displacement, velocity = slave.start
    force = slave.load_means(interval)[0] @ slave.load_rows()
    if rod is not None:
        displacement, velocity = _fit_rod(slave, rod, displacement, velocity)
        force += _rod_force(slave, rod, (displacement, velocity), force, interval) @ rod.rows
    if deformed:
        displacement = displacement + _deformation(slave, force)
    if rod is not None:
        displacement, velocity = _fit_rod(slave, rod, displacement, velocity)
    return replace(problem, slave=replace(slave, displacement=displacement, velocity=velocity))


def _rod_force(
    body: NodalBody, rod: NodalRod, start: tuple[np.ndarray, np.ndarray], force: np.ndarray, interval: np.ndarray
) -> np.ndarray:
    """Return the lateral and along force of the rod on the rigid body [N], (2,): |P − C| has no second derivative."""
    displacement, velocity = start
    pins = rod.crank(interval)
    arm = rod.point + rod.rows @ displacement - pins[0, :2]
    length = np.hypot(*arm)
    n, rate = arm / length, rod.rows @ velocity - pins[0, 2:]
    swing = (rate @ rate - (n @ rate) ** 2) / length
    Phi = np.zeros((len(force), 0)) if body.rigid is None else body.rigid
    pin_rows = rod.rows @ Phi
    along = n @ pin_rows
    pin_rate = np.diff(pins[:, 2:], axis=0)[0] / interval[1]
    missing = n @ (pin_rate - pin_rows @ (Phi.T @ force)) - swing
    return n * (missing / (along @ along))


def _deformation(body: NodalBody, force: np.ndarray) -> np.ndarray:
    """Solve K u = f − M a without rigid motion: k dofs are grounded, whose reactions are zero."""
    Phi = body.all_rigid()
    MPhi = body.M @ Phi
    free_dofs = np.ones(len(force), bool)
    if Phi.shape[1]:
        free_dofs[qr(Phi.T, mode="r", pivoting=True)[1][: Phi.shape[1]]] = False
    free = np.flatnonzero(free_dofs)
    factor = factorise(body.K[free][:, free], definite=True)
    u = np.zeros(len(force))
    u[free] = factor.solve((force - MPhi @ (Phi.T @ force))[free])
    factor.free()
    return u - Phi @ (MPhi.T @ u)


def _fit_rod(
    body: NodalBody, rod: NodalRod, displacement: np.ndarray, velocity: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return position and velocity, changed along the stroke until the rod has its length and the length no rate."""
    if body.rigid is None or body.twists is None:
        return displacement, velocity
    stroke = np.concatenate([rod.directions[1], np.zeros(3)])
    along = body.rigid @ np.linalg.lstsq(body.twists.T, stroke)[0]
    tangent, pin = rod.rows @ along, rod.crank(np.zeros(1))[0]
    arm = rod.point + rod.rows @ displacement - pin[:2]
    # The root nearest to zero of |arm + shift way|² = L².
    length, slope = np.hypot(*arm), arm @ tangent
    excess = (length - rod.length) * (length + rod.length)
    shift = -excess / (slope + np.copysign(np.sqrt(slope**2 - tangent @ tangent * excess), slope))
    arm = arm + shift * tangent
    speed = arm @ (rod.rows @ velocity - pin[2:]) / (arm @ tangent)
    return displacement + shift * along, velocity - speed * along
