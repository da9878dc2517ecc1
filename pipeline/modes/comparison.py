"""Two modal bases: which mode of one is which of the other, by the modal assurance criterion."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from gudgeon.modaldb.stores.base import Store
from gudgeon.pipeline.errors import InputError

LEAST = 0.5
"""MAC below which two modes are not called the same: half of one is then something else."""


@dataclass(frozen=True)
class ModeComparison:
    """Two bases, the first of a modes and the second of b."""

    frequencies: tuple[np.ndarray, np.ndarray]
    """[Hz], (a,) and (b,)."""
    mac: np.ndarray
    """Modal assurance criterion, (a, b), 0 to 1."""
    distance: float
    """Largest distance of a node of the first basis from the node of the second that it is compared with [m]."""

    def rows(self) -> list[dict[str, Any]]:
        """Return each mode of the first basis with the most similar one of the second, numbered from 1.

        `other` and `change`, the relative change of the frequency, are None where no MAC reaches `LEAST`.
        """
        rows = []
        for mode, line in enumerate(self.mac):
            best = int(np.argmax(line)) if len(line) else -1
            same = best >= 0 and line[best] >= LEAST
            frequency = float(self.frequencies[0][mode])
            rows.append({
                "mode": mode + 1, "frequency": frequency, "other": best + 1 if same else None,
                "change": float(self.frequencies[1][best]) / frequency - 1 if same and frequency > 0 else None,
                "mac": float(line[best]) if len(line) else 0.0,
            })  # fmt: skip
        return rows

    def as_json(self) -> dict[str, Any]:
        """Return all of it as JSON."""
        return {"frequencies": [f.tolist() for f in self.frequencies], "mac": self.mac.tolist(),
                "distance": self.distance, "modes": self.rows()}  # fmt: skip


def modal_assurance(Phi: np.ndarray, Psi: np.ndarray) -> np.ndarray:
    """Return (φᵢᵀψⱼ)² / (φᵢᵀφᵢ ψⱼᵀψⱼ) of the columns of two matrices (n, a) and (n, b), (a, b).

    R. J. Allemang, D. L. Brown: A correlation coefficient for modal vector analysis, IMAC 1982. A column of zeros is
    like no other: 0.
    """
    products = Phi.T @ Psi
    sizes = np.einsum("na,na->a", Phi, Phi)[:, None] * np.einsum("nb,nb->b", Psi, Psi)
    return np.divide(products**2, sizes, out=np.zeros_like(products), where=sizes > 0)


def compare_modes(store: Store, first: str, second: str) -> ModeComparison:
    """Compare the normal modes of two records of kind `modes`, node by nearest node.

    Raises:
        InputError: one of them has no shapes.
        ModalDBError: a record cannot be read.
    """
    only = ["angular_frequencies", "shapes", "mesh_key", "normal_count"]
    records = [store.get(key, "modes", only=only) for key in (first, second)]
    for key, record in zip((first, second), records, strict=True):
        if record.shapes is None or not record.shapes.size or not record.normal_count:
            raise InputError(f"{store.place(key)}: no normal modes; it is a rigid body, or its reduction keeps none")
    nodes = [store.get(record.mesh_key, "mesh", only=["nodes"]).nodes for record in records]
    for key, record, points in zip((first, second), records, nodes, strict=True):
        if len(record.shapes) != len(points):
            raise InputError(f"{store.place(key)}: shapes at {len(record.shapes)} nodes, its mesh has {len(points)}")
    shapes = [record.shapes[:, :, : record.normal_count] for record in records]
    distance, nearest = 0.0, np.arange(len(nodes[0]))
    if records[0].mesh_key != records[1].mesh_key:
        from scipy.spatial import cKDTree

        distances, nearest = cKDTree(nodes[1]).query(nodes[0])
        distance = float(distances.max(initial=0.0))
    columns = [shape.reshape(-1, shape.shape[2]) for shape in (shapes[0], shapes[1][nearest])]
    spectra = [record.angular_frequencies[: record.normal_count] / (2 * np.pi) for record in records]
    return ModeComparison((spectra[0], spectra[1]), modal_assurance(*columns), distance)
