"""The piston skirt against an integration of all its dofs that shares only the mesh with our full FE.

Matrices are scikit-fem's own; contact points, their areas and gaps are found here. Time goes by the HHT-α method
(Hilber, Hughes & Taylor 1977, Improved numerical dissipation for time integration algorithms in structural dynamics,
Earthquake Eng. Struct. Dyn. 5, 283–292), −1/3 ≤ α ≤ 0:

    M a⁺ + (1 + α) r⁺ − α r = 0,    r = K u − Gᵀ λ,    λ_i = κ_i ⟨−g_i⟩,    κ_i = surface stiffness · area of point i
    u⁺ = u + h v + h² [(½ − β) a + β a⁺],    v⁺ = v + h [(1 − γ) a + γ a⁺],    β = ¼ (1 − α)²,    γ = ½ − α

Gaps are the points' true distances from the bore. Our full FE has gaps linear in the displacement (which is
3e-4 of the force with the scene's layer, 4e-4 with the soft one), the midpoint rule, and a mean force over the step
that keeps energy. In common are the scene's numbers, nodes and cells of the mesh, and that the mid-side nodes carry the
contact, because a uniform pressure loads no corner of a quadratic triangle.
"""

import tomllib
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu
from skfem import Basis, BilinearForm, ElementTetP2, ElementVector, FacetBasis, LinearForm, MeshTet2
from skfem.models.elasticity import lame_parameters, linear_elasticity

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.nodal.scene.problem import nodal_problem
from gudgeon.pipeline.nodal.sliding.loop import simulate_nodal
from gudgeon.pipeline.stages.run import run_job

pytestmark = pytest.mark.validation

SCENE = Path(__file__).parents[2] / "data/skirt/scene.toml"
NUMBERS: dict[str, Any] = tomllib.loads(SCENE.read_text(encoding="utf-8"))
STEP, DURATION = 1e-6, 6e-4
"""Of both runs [s]; the skirt touches from 200 µs to 560 µs."""
ALPHA = -0.02
"""Damps what the step does not resolve: at 0 the points of the stiff layer chatter from step to step. More damping
takes impulse: −0.08 up to 4e-4 of it, depending on the mesh."""
BETA, GAMMA = (1 - ALPHA) ** 2 / 4, 0.5 - ALPHA
FORCE, IMPULSE = 1e-3, 3e-4
"""Relative difference allowed: L2 norm of the force behind the scene's window, and impulse."""
SHIPPED = (0.008, NUMBERS["contact"]["bore"]["surface_stiffness"])
SOFT = (0.012, 1e12)
"""Edge length of the mesh [m] and stiffness of the surface layer [N/m³]. The scene's own mesh, 0.005 m, takes a minute.
The force hardly answers to the scene's layer, but to a soft one it does."""
ON_SURFACE = 1e-6
"""Distance from the skirt's outer surface over its radius, below which a node is on it."""
ROUND_OFF = 1e-9
BLOCK = 64
"""Columns solved at once."""


@dataclass(frozen=True)
class Skirt:
    """The skirt on its mesh. n dofs, c contact points."""

    K: sparse.csc_matrix
    """Stiffness [N/m], (n, n)."""
    M: sparse.csc_matrix
    """Consistent mass [kg], (n, n)."""
    points: np.ndarray
    """Contact points [m], (c, 3)."""
    areas: np.ndarray
    """∫ N_i dA of each point over the curved facets [m²], (c,)."""
    dofs: np.ndarray
    """Numbers of each point's dofs, (c, 3)."""

    @cached_property
    def inward(self) -> np.ndarray:
        """Unit vectors from the points to the axis, directions of the contact's forces, (c, 3)."""
        radial = self.points * [-1.0, -1.0, 0.0]
        return radial / np.linalg.norm(radial, axis=1, keepdims=True)

    @cached_property
    def G(self) -> sparse.csr_matrix:
        """∂g/∂u, (c, n)."""
        rows = np.repeat(np.arange(len(self.points)), 3)
        return sparse.csr_matrix((self.inward.ravel(), (rows, self.dofs.ravel())), (len(self.points), self.K.shape[0]))


@dataclass(frozen=True)
class Step:
    """What a step needs that does not change: S = M + (1 + α) β h² K and its answers to forces at the points."""

    factor: SuperLU
    """Of S."""
    answers: np.ndarray
    """Rows of G S⁻¹, (c, n)."""
    W: np.ndarray
    """Change of the gaps within a step by forces at its end, (1 + α) β h² G S⁻¹ Gᵀ [m/N], (c, c)."""


def skirt_of(mesh: MeshRecord) -> Skirt:
    """Assemble the skirt and find its contact points: mid-side nodes of the outer surface within the sector."""
    part = NUMBERS["component"]["skirt"]
    radius, low, high = part["geometry"]["outer_radius"], *np.radians(part["interface"]["thrust"]["sector_deg"])
    material, density = part["material"], part["material"]["rho"]
    tets = MeshTet2(mesh.nodes.T, mesh.cells.T)
    vector = Basis(tets, ElementVector(ElementTetP2()), intorder=4)
    scalar = Basis(tets, ElementTetP2(), intorder=6)
    K = linear_elasticity(*lame_parameters(material["E"], material["nu"])).assemble(vector)
    m = BilinearForm(lambda u, v, w: density * u * v).assemble(scalar)
    # Vertices come first, edges after them; the dofs of a node follow each other.
    x, corners = scalar.doflocs, len(np.unique(tets.t))
    on = np.abs(np.hypot(x[0], x[1]) / radius - 1) < ON_SURFACE
    outside = tets.boundary_facets()
    six = np.vstack([tets.facets[:, outside], corners + tets.f2e[:, outside]])
    facets = FacetBasis(tets, ElementTetP2(), facets=outside[on[six].all(axis=0)], intorder=4)
    areas = LinearForm(lambda v, w: v).assemble(facets)
    angle = np.arctan2(x[1], x[0])
    chosen = corners + np.flatnonzero((on & (angle >= low) & (angle <= high))[corners:])
    dofs = 3 * chosen[:, None] + np.arange(3)
    assert np.array_equal(vector.doflocs[:, dofs[:, 0]], x[:, chosen])
    return Skirt(K.tocsc(), sparse.kron(m, sparse.eye(3), format="csc"), x[:, chosen].T, areas[chosen], dofs)


def prepare(skirt: Skirt) -> Step:
    """Factorise S, (n, n), and solve for unit forces at all contact points, (n, c)."""
    S = sparse.csc_matrix(skirt.M + (1 + ALPHA) * BETA * STEP**2 * skirt.K)
    factor = splu(S, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    answers = np.empty(skirt.G.shape)
    for block in (slice(start, start + BLOCK) for start in range(0, len(answers), BLOCK)):
        answers[block] = factor.solve(skirt.G[block].T.toarray()).T
    return Step(factor, answers, (1 + ALPHA) * BETA * STEP**2 * (skirt.G @ answers.T))


def close(W: np.ndarray, stiffness: np.ndarray, free: np.ndarray, touching: np.ndarray) -> np.ndarray:
    """Solve g = free + W λ, λ = κ ⟨−g⟩ for all points by Newton's method on the active set.

    Args:
        W: [m/N], (c, c).
        stiffness: κ [N/m], (c,).
        free: Gaps without forces [m], (c,).
        touching: First guess of the active set, (c,).

    Returns:
        λ [N], (c,).
    """
    for _ in range(len(free)):
        active, force = np.flatnonzero(touching), np.zeros(len(free))
        layer = np.diag(1 / stiffness[active])
        force[active] = np.linalg.solve(W[np.ix_(active, active)] + layer, -free[active])
        gap = free + W @ force
        if np.array_equal(gap < 0, touching):
            np.testing.assert_allclose(force, stiffness * np.maximum(-gap, 0), atol=ROUND_OFF * (force.max() + 1))
            return force
        touching = gap < 0
    raise AssertionError("the active set does not settle")


def integrate(skirt: Skirt, step: Step, layer: float) -> np.ndarray:
    """Throw the skirt at the bore.

    Args:
        layer: Stiffness of the surface layer [N/m³].

    Returns:
        Mean force on the skirt over each step [N], (steps, 3): that by which the method changes its momentum.
    """
    bore, velocity = NUMBERS["contact"]["bore"]["against"]["radius"], NUMBERS["body"]["skirt"]["velocity"]
    count, stiffness, (c, n), h = round(DURATION / STEP), layer * skirt.areas, skirt.G.shape, STEP

    def gaps(u: np.ndarray) -> np.ndarray:  # (n,) → (c,), both [m]
        return bore - np.linalg.norm((skirt.points + u[skirt.dofs])[:, :2], axis=1)

    v, a, acting = np.tile(velocity, n // 3), np.zeros(n), np.zeros(c)
    first = int(gaps(np.zeros(n)).min() / np.linalg.norm(velocity) / h) - 1  # Until then it flies, which is exact.
    u, force, forces = first * h * v, np.zeros(c), np.zeros((count, c))
    for k in range(first, count):
        ahead = u + h * v + h**2 * (0.5 - BETA) * a
        v = v + h * (1 - GAMMA) * a
        a = step.factor.solve(skirt.K @ (ALPHA * u - (1 + ALPHA) * ahead) - ALPHA * (skirt.G.T @ force))
        new = close(step.W, stiffness, gaps(ahead + h**2 * BETA * a), force > 0)
        a += (1 + ALPHA) * (new @ step.answers)
        u, v = ahead + h**2 * BETA * a, v + h * GAMMA * a
        before, acting = acting, (1 + ALPHA) * new - ALPHA * force
        forces[k] = (1 - GAMMA) * before + GAMMA * acting
        force = new
    resultant = forces @ skirt.inward
    gained = (skirt.M @ (v - np.tile(velocity, n // 3))).reshape(-1, 3).sum(axis=0)
    np.testing.assert_allclose(h * resultant.sum(axis=0), gained, atol=ROUND_OFF * np.abs(gained).max())
    return resultant


def windowed(force: np.ndarray) -> np.ndarray:
    """Return a force (steps, 3) [N] behind a Hann window of the scene's width, (steps + 2 reach, 3)."""
    width = NUMBERS["report"]["window"] / STEP
    reach = int(width / 2)
    weights = 1 + np.cos(2 * np.pi / width * np.arange(-reach, reach + 1))
    return np.column_stack([np.convolve(one, weights / weights.sum()) for one in force.T])


def differences(force: np.ndarray, other: np.ndarray) -> tuple[float, float]:
    """Return the relative differences of two forces (steps, 3): behind the window over the contact, and of impulse."""
    pairs = (windowed(force), windowed(other)), (force.sum(axis=0), other.sum(axis=0))
    apart, impulse = (float(np.linalg.norm(one - two) / np.linalg.norm(two)) for one, two in pairs)
    return apart, impulse


@dataclass(frozen=True)
class Thrown:
    """The skirt on one mesh with one layer, and the force that our full FE finds."""

    skirt: Skirt
    layer: float  # [N/m³]
    step: Step
    nodal: np.ndarray
    """Mean force on the skirt over each step [N], (steps, 3)."""


def thrown(size: float, layer: float, folder: Path) -> Thrown:
    """Mesh the skirt with edges of `size` [m], throw it by full FE and prepare the same here."""
    changes = {
        "component.skirt.mesh.size": size,
        "component.skirt.modes.reduction": "rigid",  # No modes are needed.
        "contact.bore.surface_stiffness": layer,
        "run.duration": DURATION,
    }
    job = open_job(SCENE, set=changes, db=folder / "db", out=folder / "out")
    run_job(job, "morph")
    skirt = skirt_of(job.store.get(job.components()["skirt"]["base-mesh"].key, "mesh"))
    return Thrown(skirt, layer, prepare(skirt), simulate_nodal(nodal_problem(job), STEP).force)


@pytest.fixture(scope="module")
def soft(tmp_path_factory: pytest.TempPathFactory) -> Thrown:
    return thrown(*SOFT, tmp_path_factory.mktemp("soft"))


def check(one: Thrown) -> None:
    """Compare full FE with the integration here."""
    apart, impulse = differences(one.nodal, integrate(one.skirt, one.step, one.layer))
    assert apart < FORCE
    assert impulse < IMPULSE


def test_shipped_layer(tmp_path: Path) -> None:
    check(thrown(*SHIPPED, tmp_path))


def test_soft_layer(soft: Thrown) -> None:
    check(soft)


def test_areas_two_per_cent_wrong_are_seen(soft: Thrown) -> None:
    wrong = replace(soft.skirt, areas=1.02 * soft.skirt.areas)
    assert differences(soft.nodal, integrate(wrong, soft.step, soft.layer))[0] > FORCE
