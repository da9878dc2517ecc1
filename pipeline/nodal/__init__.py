"""The full FE: all degrees of freedom, contact at the nodes. The reference of reports where no exact solution exists.

Midpoint rule for the elastic bodies, discrete gradient of the contact potential V(g) = ½ κ ⟨−g⟩², point by point:

    S v̄ = M v − ½ h K u + ½ h (Gᵀ λ̄ + f),   S = M + ¼ h² K + ½ h β K,   λ̄ = −(V(g⁺) − V(g)) / (g⁺ − g)
    u⁺ = u + h v̄,   v⁺ = 2 v̄ − v

Without loads and damping ½vᵀMv + ½uᵀKu + ΣV is constant to Newton's tolerance at any step: contact cannot create
energy. S of each body is factorised once; contact enters through the low-rank G S⁻¹ Gᵀ, and Newton's method runs on the
touching points only. `body` has the rule for one body, `sliding` contact where points slide or press a surface layer,
`points` contact at fixed points with any law or none, in native code where the bodies are bars, beams or rigid.
Nothing here is taken from the solver but formulas of contact laws, obstacles, the scene's models, and definitions of
quantities of given histories (`solver.results.contact_events`), so that a comparison has one definition of each.
"""
