"""Gudgeon: contact dynamics of flexible machine parts from a modal database.

The folders `pipeline`, `modaldb` and `solver` are installed as `gudgeon.pipeline`, `gudgeon.modaldb` and
`gudgeon.solver`; this module is the package's face:

    report = gudgeon.run("data/skirt", until="solve")      # mesh, modes, design, trajectory
    report.quantities["knock.impulse"]
"""
