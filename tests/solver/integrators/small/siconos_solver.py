"""Solves contact problems with Coulomb cones by siconos; run by an interpreter that has it: FILE.npz, OUT.npz.

Siconos: V. Acary et al., An introduction to Siconos, INRIA RT-0340. Its problem is u = q + W r with r in the cone
|r_t| ≤ μ r_n and u + μ |u_t| n in the dual cone.
"""

import sys

import numpy as np
import siconos.numerics as numerics  # type: ignore[import-not-found]  # pyright: ignore[reportMissingImports]


def main() -> None:
    """Solve all problems of a file by two solvers."""
    given, found = np.load(sys.argv[1]), {}
    for number in range(int(given["count"])):
        W, q, mu = (given[f"{name}{number}"] for name in ("W", "q", "mu"))
        for name, solver in (("gs", numerics.SICONOS_FRICTION_3D_NSGS), ("ac", numerics.SICONOS_FRICTION_3D_NSN_AC)):
            problem = numerics.FrictionContactProblem(3, len(mu), W, q, mu)
            options = numerics.SolverOptions(solver)
            options.dparam[0], options.iparam[0] = 1e-10, 100000
            r, u = np.zeros(len(q)), np.zeros(len(q))
            failed = numerics.fc3d_driver(problem, r, u, options)
            found[f"{name}{number}"] = np.full(len(q), np.nan) if failed else r
    np.savez(sys.argv[2], **found)


if __name__ == "__main__":
    main()
