"""The worn shape under a journal: its depth averaged over the pressed angle, in a compiled function.

Cells at angles θ_i about a bearing or journal have worn depths h_i. With u_i their directions and e the offset of the
journal in the frame of the cells, weights p_i ∝ exp((e·u_i − h_i)/τ) fall to 37 % where a cell is indented by τ less: a
foundation whose pressure has, in a round bearing, the standard deviation √(τ/|e|) about the line of contact. The
averaged depth

    H(e) = −τ log( Σ exp((e·u_i − h_i)/τ) / Σ exp(e·u_i/τ) )

is exactly h where all depths are h, has the gradient −Σ (p_i − p⁰_i) u_i with p⁰ the weights without wear, and is
smooth however rough the depths are: where a groove conforms to the journal the contact is spread over the groove.
"""

import numpy as np

from gudgeon.solver.compiled import inner, larger


@inner
def soft_depth(model, i, side, x, y):  # type: ignore[no-untyped-def]
    """Return H of a section's bearing, 0, or journal, 1, at an offset (x, y) along the frame of its cells, and ∇H."""
    soft, cells = model.worn_soft[i], model.worn_cells[i, side]
    over = 1.0 / soft
    high, round_high = -np.inf, -np.inf
    for k in range(cells):
        along = x * model.worn_turn[i, k, 0] + y * model.worn_turn[i, k, 1]
        high = larger(high, along - model.worn_depth[i, side, k])
        round_high = larger(round_high, along)
    worn, wx, wy, bare, bx, by = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(cells):
        c, s = model.worn_turn[i, k, 0], model.worn_turn[i, k, 1]
        along = x * c + y * s
        p = np.exp((along - model.worn_depth[i, side, k] - high) * over)
        q = np.exp((along - round_high) * over)
        worn, wx, wy = worn + p, wx + p * c, wy + p * s
        bare, bx, by = bare + q, bx + q * c, by + q * s
    depth = round_high - high - soft * np.log(worn / bare)
    return depth, bx / bare - wx / worn, by / bare - wy / worn
