"""The full FE: full FE, implicit, contact at the same points. The reference where no exact answer is.

Midpoint rule for the elastic bodies, discrete gradient of the contact potential V(g) = ½ κ ⟨−g⟩², point by point:

    S v̄ = M v − ½ h K u + ½ h (Gᵀ λ̄ + f),   S = M + ¼ h² K + ½ h β K,   λ̄ = −(V(g⁺) − V(g)) / (g⁺ − g)
    u⁺ = u + h v̄,   v⁺ = 2 v̄ − v

so that without loads and damping ½vᵀMv + ½uᵀKu + ΣV keeps its value to Newton's tolerance at any step: contact can gain
no energy. S of each body is factorised once; contact enters through the low-rank G S⁻¹ Gᵀ, Newton runs on the touching
points only. `body` has the rule for one body, `sliding` what happens between them where points slide or press a layer.
Bodies that meet at fixed points, with any law or rigidly, have `points`, compiled where they are bars, beams or rigid.
Nothing here is taken from the solver but formulas of contact laws, obstacles, what a scene says, and definitions of
quantities of given histories (`solver.results.contact_events`), so that a comparison has one definition of each.
"""

from gudgeon.pipeline.nodal.problem import (
    NodalBody,
    NodalContact,
    NodalLoad,
    NodalProblem,
    NodalRod,
    PointContact,
    PointProblem,
    SlidingSurface,
)
from gudgeon.pipeline.nodal.sliding.loop import simulate_nodal
from gudgeon.pipeline.nodal.sliding.weights import SplineWeights
from gudgeon.pipeline.nodal.start import static_start, supported_body

__all__ = [
    "NodalBody",
    "NodalContact",
    "NodalLoad",
    "NodalProblem",
    "NodalRod",
    "PointContact",
    "PointProblem",
    "SlidingSurface",
    "SplineWeights",
    "simulate_nodal",
    "static_start",
    "supported_body",
]
