"""Exudyn's FEMinterface.ComputeEigenmodes: scipy's eigsh at shift 0 on matrices that it is given.

The matrices come from scikit-fem's vector forms. Its other way, ComputeEigenmodesNGsolve, calls ngsolve's PINVIT.
"""

import exudyn
import numpy as np
from exudyn.FEM import FEMinterface

from tests.benchmarks.modes.job import RIGID, Answer, Stopwatch, hertz, largest_residual, load_mesh, run
from tests.benchmarks.modes.vector_forms import assemble


def modes(path: str, count: int, watch: Stopwatch) -> Answer:
    """Extract `count` elastic modes."""
    K, M, positions = assemble(load_mesh(path))
    watch.lap("assembly")
    fem = FEMinterface()
    fem.nodes = {"Position": np.ascontiguousarray(positions)}
    fem.massMatrix, fem.stiffnessMatrix = M, K
    fem.ComputeEigenmodes(count, excludeRigidBodyModes=RIGID)
    watch.lap("factor and eigensolve")
    values, vectors = np.asarray(fem.eigenValues), np.asarray(fem.modeBasis["matrix"])
    verdict, residual = largest_residual(K, M, values, vectors)
    watch.lap("verification")
    return Answer(f"exudyn {exudyn.__version__}", verdict, hertz(values), residual)


if __name__ == "__main__":
    run(modes)
