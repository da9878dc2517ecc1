"""The nodal synthesis: all nodal dofs, implicit, contact at the same points. The reference where no exact answer is.

Midpoint rule for the elastic bodies, discrete gradient of the contact potential V(g) = ½ κ ⟨−g⟩², point by point:

    S v̄ = M v − ½ h K u + ½ h (Gᵀ λ̄ + f),   S = M + ¼ h² K + ½ h β K,   λ̄ = −(V(g⁺) − V(g)) / (g⁺ − g)
    u⁺ = u + h v̄,   v⁺ = 2 v̄ − v

so that without loads and damping ½vᵀMv + ½uᵀKu + ΣV keeps its value to Newton's tolerance at any step: contact can gain
no energy. S of each body is factorised once; contact enters through the low-rank G S⁻¹ Gᵀ, Newton runs on the touching
points only. `body` has the rule for one body, `coupling` what happens between them where points slide or press a layer,
`simulate` the loop. Bodies that meet at fixed points, with any law or rigidly, have `points` and the loop of `meeting`,
compiled in `narrow` where bodies are bars, beams or rigid.
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
    Weights,
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
    "Weights",
    "simulate_nodal",
    "static_start",
    "supported_body",
]
