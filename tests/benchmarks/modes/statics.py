"""Static shapes for 600 contact rows: the residual flexibility of mid-side nodes of the skirt under 30 normal modes.

`python -m tests.benchmarks.modes.statics MESH COUNT`; phases: what comes before, one factorisation without rows, and
another with the rows, all of their statics included.
"""

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.modes.normal import normal_modes
from gudgeon.pipeline.modes.static import residual_shapes
from gudgeon.pipeline.scenes.material import Material
from tests.benchmarks.modes.job import DENSITY, POISSON, YOUNG, Answer, Stopwatch, load_mesh, run

ROWS = 600


def statics(path: str, count: int, watch: Stopwatch) -> Answer:
    """Solve the static shapes of the first 600 mid-side nodes of the skirt, pushed along its normal."""
    mesh = load_mesh(path)
    model = build_model(MeshRecord(mesh.nodes, mesh.cells, "tetra10", {}), Material(E=YOUNG, nu=POISSON, rho=DENSITY))
    normal = normal_modes(model, count)
    nodes = np.unique(mesh.skirt[:, 3:])[:ROWS]
    normals = mesh.nodes[nodes] * [1, 1, 0]
    B = model.rows(nodes, normals / np.linalg.norm(normals, axis=1)[:, None])
    watch.lap("model and modes")
    Flexibility(model).free()
    watch.lap("factor")
    residual = residual_shapes(model, B, normal, np.empty((ROWS, 0)))
    watch.lap("factor and rows")
    if not np.linalg.eigvalsh(residual.flexibility)[0] > 0:
        raise ArithmeticError("the residual flexibility is not positive definite")
    return Answer("", "symmetry", solves=len(nodes), factorisations=1)


if __name__ == "__main__":
    run(statics)
