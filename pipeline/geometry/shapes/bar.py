"""A straight bar along x on a line mesh, with axial motion only."""

from typing import Literal

import numpy as np
from pydantic import Field

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.geometry.cells import LINE3
from gudgeon.pipeline.geometry.mesh_estimate import refuse_large
from gudgeon.pipeline.geometry.surfaces import point_surface
from gudgeon.solver.numbers import Area, Length, Strict


class Bar(Strict):
    """Bar of constant section from x = 0 (`left`) to x = `length` (`right`)."""

    kind: Literal["bar"]
    length: Length = Field(description="Length")
    area: Area = Field(description="Cross-section [m^2]")

    def elements(self, size: float) -> int:
        """Return the number of elements no longer than `size` [m]."""
        return max(1, int(np.ceil(self.length / size * (1 - 1e-12))))

    def build(self, size: float) -> MeshRecord:
        """Divide the bar into quadratic line elements no longer than `size` [m]."""
        count = self.elements(size)
        refuse_large("line", count, size)
        nodes = np.zeros((2 * count + 1, 3))
        nodes[:, 0] = np.linspace(0.0, self.length, 2 * count + 1)
        start = 2 * np.arange(count)
        cells = np.column_stack([start, start + 2, start + 1])
        ends = {"left": (0, -1.0), "right": (2 * count, 1.0)}
        surfaces = {
            name: point_surface(node, np.array([sign, 0.0, 0.0]), self.area, nodes[node])
            for name, (node, sign) in ends.items()
        }
        return MeshRecord(nodes, cells, LINE3.name, surfaces)
