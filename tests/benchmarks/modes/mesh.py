"""The benchmark's part: a hollow stepped steel cylinder with a ring groove, meshed once for all contestants.

`python -m tests.benchmarks.modes.mesh FILE SIZE` writes straight-sided tet10 of edge length SIZE [m].
"""

import sys
from typing import Any

import numpy as np

HEIGHT, RADIUS = 0.060, 0.040
BORE, BORE_DEPTH = 0.030, 0.048
RECESS, RECESS_DEPTH = 0.020, 0.006
"""A narrower step at the end of the bore."""
GROOVE, GROOVE_FROM, GROOVE_WIDTH = 0.037, 0.050, 0.004
"""Radius of the bottom of the ring groove, where it begins, its width; all [m]."""
EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
"""Corners beside each mid-side node, in meshio's order."""


def make(path: str, size: float) -> None:
    """Mesh the part with edges of `size` [m] and write nodes, cells and the facets of the skirt (radius 40 mm)."""
    from gudgeon.pipeline.geometry.occ import Solid
    from gudgeon.pipeline.geometry.surfaces import SurfaceRule, cylinder

    class Part(Solid):
        def surface_shapes(self) -> dict[str, SurfaceRule]:
            return {"skirt": cylinder(RADIUS)}

        def draw(self, occ: Any) -> None:
            _draw(occ)

    mesh = Part().build(size)
    nodes = np.array(mesh.nodes)
    for middle, ends in enumerate(EDGES, start=4):
        nodes[mesh.cells[:, middle]] = nodes[mesh.cells[:, ends]].mean(axis=1)
    np.savez(path, nodes=nodes, cells=mesh.cells, skirt=mesh.surfaces["skirt"].facets)


def _draw(occ: Any) -> None:
    body = occ.addCylinder(0, 0, 0, 0, 0, HEIGHT, RADIUS)
    bore = occ.addCylinder(0, 0, 0, 0, 0, BORE_DEPTH, BORE)
    recess = occ.addCylinder(0, 0, BORE_DEPTH, 0, 0, RECESS_DEPTH, RECESS)
    hollow, _ = occ.cut([(3, body)], [(3, bore), (3, recess)])
    ring = occ.addCylinder(0, 0, GROOVE_FROM, 0, 0, GROOVE_WIDTH, 1.1 * RADIUS)
    core = occ.addCylinder(0, 0, GROOVE_FROM, 0, 0, GROOVE_WIDTH, GROOVE)
    ring, _ = occ.cut([(3, ring)], [(3, core)])
    occ.cut(hollow, ring)


if __name__ == "__main__":
    make(sys.argv[1], float(sys.argv[2]))
