"""A reduced body as other programs take it: mass, stiffness, shapes, and every row with its name.

Coordinates are the r rigid motions, mass-normalised, then the m elastic ones: M = 1, K = diag(0, ω²). A force on row i
acts on the coordinates by B_i; the body answers with the displacement y = B q + R f.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import InterfaceModes, LoadModes, ModalRecord, MorphRecord, TractionModes
from gudgeon.modaldb.records.tangents import tangents
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.reduction.expansion import displacement
from gudgeon.pipeline.stages.job import Job
from gudgeon.solver.bodies.small_motion import FlexibleBody

MOTIONS = {6: ("x", "y", "z", "rx", "ry", "rz"), 3: ("x", "y", "rz")}
"""Motions of the reference point of a tie by their number."""
NO_PLACE = np.full(3, np.nan)


class Row(NamedTuple):
    """A generalised displacement of a body, and the force conjugate to it."""

    name: str
    """`INTERFACE/NODE/normal`, `INTERFACE/x`, `INTERFACE/ACROSS,ALONG`, …"""
    unit: str
    """Of the force: N, N m, Pa."""
    node: int
    """Number of the node, from 1 or that of the files of its matrices; 0 of a row over several nodes."""
    place: np.ndarray
    """[m], (3,); NaN of a spline function."""
    direction: np.ndarray
    """Unit vector, (3,); NaN of spline functions and pressures; of a rotation its axis."""


@dataclass(frozen=True)
class ReducedBody:
    """A body's reduced model, in its own axes."""

    name: str
    mesh: MeshRecord
    modal: ModalRecord
    morph: MorphRecord
    labels: np.ndarray
    """Number of each node, (n,)."""
    shapes: np.ndarray
    """Displacement of the nodes per unit of each coordinate [kg^-½], (n, 3, r + m)."""
    rows: tuple[Row, ...]
    B: np.ndarray
    """Displacement of each row per unit of each coordinate, (C, r + m)."""
    R: np.ndarray | None
    """Residual flexibility of the rows, (C, C)."""

    @property
    def nodes(self) -> np.ndarray:
        """Places of the nodes [m], (n, 3)."""
        return self.mesh.nodes if self.morph.nodes is None else self.morph.nodes

    @property
    def rigid_count(self) -> int:
        """Number of rigid motions, r."""
        return len(self.morph.rigid_twists)

    @property
    def stiffness(self) -> np.ndarray:
        """ω² of each coordinate [rad²/s²], zero of rigid motions, (r + m,)."""
        return np.concatenate([np.zeros(self.rigid_count), self.modal.angular_frequencies**2])


def reduced_body(job: Job, name: str) -> ReducedBody:
    """Return the reduced model of a body whose modes and design are in the database.

    Raises:
        InputError: the scene has no such body, or its record has no shapes.
    """
    if name not in job.scene.body:
        raise InputError(f"{job.path}: export: no body '{name}'; the scene has {', '.join(job.scene.body)}")
    steps = job.components()[job.scene.component_of(name)]
    mesh, modal, morph = (
        job.store.get(steps[step].key, kind)
        for step, kind in (("mesh", "mesh"), ("modes", "modes"), ("morph", "morph"))
    )
    if modal.shapes is None:
        raise InputError(f"{job.path}: export: body '{name}' has a record without shapes")
    labels = np.arange(1, len(mesh.nodes) + 1) if mesh.system is None else mesh.system.labels
    nodes = mesh.nodes if morph.nodes is None else morph.nodes
    count = len(morph.rigid_twists) + len(modal.angular_frequencies)
    units = (displacement(nodes, morph, modal, q) for q in np.eye(count))
    shapes = np.stack([*units, *([np.empty((len(nodes), 3))] if not count else [])], axis=2)[:, :, :count]
    body = FlexibleBody(
        name=name, morph_key="", morph=morph, modal=modal, twists=morph.rigid_twists, damping=None, first=0
    )
    rows, B = _rows(body, labels)
    return ReducedBody(
        name=name, mesh=mesh, modal=modal, morph=morph, labels=labels, shapes=shapes, rows=rows, B=B,
        R=modal.residual_flexibility,
    )  # fmt: skip


def _rows(body: FlexibleBody, labels: np.ndarray) -> tuple[tuple[Row, ...], np.ndarray]:
    """Return the rows in the order of the residual flexibility, and their displacements, (C, r + m)."""
    modal, morph = body.modal, body.morph
    groups: list[tuple[int, list[Row], np.ndarray]] = []
    for name, modes in {**modal.interfaces, **modal.tractions, **modal.loads}.items():
        start = modal.interface_rows[name][0]
        if isinstance(modes, InterfaceModes):
            points = morph.points[name]
            row_labels = labels[modes.nodes]
            rows = [
                Row(f"{name}/{n}/normal", "N", int(n), *position)
                for n, *position in zip(row_labels, points, modes.normals, strict=True)
            ]
            groups.append((start, rows, np.hstack([body.rigid_rows(points, modes.normals), modes.rows])))
            if name in modal.tangential_spans and modes.tangential_rows is not None:
                groups.append(_across(body, name, modes, row_labels))
        else:
            rows = _traction(name, modes) if isinstance(modes, TractionModes) else _load(name, modes)
            groups.append((start, rows, np.hstack([body.wrench_rows(modes.resultant), modes.rows])))
    groups.sort(key=lambda entry: entry[0])
    width = body.rigid_count + len(modal.angular_frequencies)
    return tuple(row for _, rows, _ in groups for row in rows), np.vstack(
        [np.empty((0, width)), *(B for *_, B in groups)]
    )


def _across(
    body: FlexibleBody, name: str, modes: InterfaceModes, row_labels: np.ndarray
) -> tuple[int, list[Row], np.ndarray]:
    """Return the tangential rows of an interface: t1 and t2 of its first point, of its second, …"""
    points = body.morph.points[name]
    along = tangents(modes.normals) if modes.tangents is None else modes.tangents
    rows = [
        Row(f"{name}/{n}/t{k + 1}", "N", int(n), point, pair[k])
        for n, point, pair in zip(row_labels, points, along, strict=True)
        for k in range(2)
    ]
    assert modes.tangential_rows is not None
    rigid = body.rigid_rows(np.repeat(points, 2, axis=0), along.reshape(-1, 3))
    elastic = modes.tangential_rows.reshape(len(rows), -1)
    return body.modal.tangential_spans[name][0], rows, np.hstack([rigid, elastic])


def _traction(name: str, modes: TractionModes) -> list[Row]:
    return [
        Row(f"{name}/{i},{j}", "N", 0, NO_PLACE, NO_PLACE)
        for i in range(modes.counts[0])
        for j in range(modes.counts[1])
    ]


def _load(name: str, load: LoadModes) -> list[Row]:
    if load.unit == "Pa":
        return [Row(f"{name}/pressure", "Pa", 0, load.point, NO_PLACE)]
    motions = ("x", "y", "z") if load.unit == "N" else MOTIONS[len(load.rows)]
    return [
        Row(f"{name}/{motion}", "N m" if motion[0] == "r" else "N", 0, load.point, np.eye(3)["xyz".index(motion[-1])])
        for motion in motions
    ]
