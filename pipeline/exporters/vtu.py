"""VTK's unstructured grids for ParaView: mode shapes in one .vtu, a trajectory as one .vtu per frame and a .pvd."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import ModalRecord, MorphRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.files import whole_file, write_text
from gudgeon.pipeline.geometry.cells import PYRAMID13, PYRAMID14, WEDGE15, cell_blocks, cell_of
from gudgeon.pipeline.interfaces.stress_recovery import von_mises
from gudgeon.pipeline.reduction.expansion import displacement

ALIKE = 0.9
"""Cosine of the angle between two normals above which they are of one face."""


def write_modes(path: Path, mesh: MeshRecord, modal: ModalRecord) -> None:
    """Write the mesh with its mode shapes as point vectors `mode_001_1234.5Hz`.

    Raises:
        InputError: the file cannot be written.
        StageError: the modal record holds no shapes.
    """
    if modal.shapes is None:
        raise StageError(f"{path}: the modal record has no nodal shapes")
    hertz = modal.angular_frequencies / (2 * np.pi)
    shapes = {f"mode_{k + 1:03d}_{f:.1f}Hz": modal.shapes[:, :, k] for k, f in enumerate(hertz)}
    _write_grid(path, mesh, mesh.nodes, shapes)


class BodyRecords(NamedTuple):
    """The records of a body."""

    mesh: MeshRecord
    modal: ModalRecord
    morph: MorphRecord
    """With the rigid twists that are free in the scene."""
    position: np.ndarray = np.zeros(3)
    """Of the body's origin in the scene [m], (3,)."""
    number: int = 0
    """Of the body in the scene, from 0."""
    stress: Callable[[int], np.ndarray] | None = None
    """Returns the stress at the nodes in a frame [Pa], (n, 6), NaN where no gauge has it; None without such gauges."""
    truncated: Callable[[int], np.ndarray] | None = None
    """Returns the static displacement that the kept modes lack in a frame [m], (n, 3); None where it is not known, or
    nothing acts."""


def write_trajectory(folder: Path, records: BodyRecords, trajectory: Trajectory, body: str, every: int) -> list[Path]:
    """Write frames of one body as `frame_000.vtu`, … and their times as `frames.pvd`; return these files.

    Each file has the undeformed design where it stands in the scene, with `displacement` [m], `velocity` [m/s] of the
    kept coordinates alone, `contact_pressure` [Pa], on lines and rigid bodies `contact_force` [N], of the contacts that
    name the body as their `body`, zero except at contact points, `body_id`, and `stress` (xx, yy, zz, xy, yz, zx) and
    `von_mises` [Pa] where gauges record them, NaN elsewhere. Every `every`-th frame is written; a file has the number
    of its frame.

    Raises:
        InputError: the trajectory has no such body, `every` is not positive, or the folder cannot be written.
    """
    if body not in trajectory.coordinate_offsets:
        have = ", ".join(sorted(trajectory.coordinate_offsets)) or "none"
        raise InputError(f"{folder}: the trajectory has no body '{body}', it has {have}")
    if every < 1:
        raise InputError(f"{folder}: every = {every} given; allowed: 1 or more")
    mesh, modal, morph = records[:3]
    nodes = mesh.nodes if morph.nodes is None else morph.nodes
    start = trajectory.coordinate_offsets[body]
    span = slice(start, start + len(morph.rigid_twists) + len(modal.angular_frequencies))
    files, entries = [], []
    for frame in range(0, len(trajectory.frames), every):
        fields = {
            "displacement": displacement(nodes, morph, modal, trajectory.frames[frame, span]),
            "velocity": displacement(nodes, morph, modal, trajectory.velocities[frame, span]),
            **_contact_field(mesh, modal, trajectory, body, frame),
            "body_id": np.full(len(nodes), records.number),
        }
        if records.truncated is not None:
            fields["displacement"] = fields["displacement"] + records.truncated(frame)
        if records.stress is not None:
            stress = records.stress(frame)
            fields |= {"stress": stress, "von_mises": von_mises(stress)}
        files.append(folder / f"frame_{frame:03d}.vtu")
        _write_grid(files[-1], mesh, nodes + records.position, fields)
        entries.append((float(trajectory.frame_times[frame]), records.number, files[-1].name))
    _write_collection(folder / "frames.pvd", entries)
    return [*files, folder / "frames.pvd"]


def write_results(folder: Path, bodies: Mapping[str, BodyRecords], trajectory: Trajectory, every: int) -> list[Path]:
    """Write frames of all bodies, see `write_trajectory`, into a folder of each, and `results.pvd` with all of them.

    Raises:
        InputError: as `write_trajectory`.
    """
    files, entries = [], []
    for name, records in bodies.items():
        body_files = write_trajectory(folder / name, records, trajectory, name, every)
        files += body_files
        entries += [
            (float(trajectory.frame_times[frame]), records.number, f"{name}/{path.name}")
            for frame, path in zip(range(0, len(trajectory.frames), every), body_files, strict=False)
        ]
    _write_collection(folder / "results.pvd", sorted(entries))
    return [*files, folder / "results.pvd"]


def _write_collection(path: Path, entries: list[tuple[float, int, str]]) -> None:
    """Write a ParaView collection of files by time [s] and part."""
    lines = [f'<DataSet timestep="{time:.17g}" part="{body_id}" file="{file}"/>' for time, body_id, file in entries]
    head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1"><Collection>'
    write_text(path, "\n".join([head, *lines, "</Collection></VTKFile>\n"]))


def _contact_field(
    mesh: MeshRecord, modal: ModalRecord, trajectory: Trajectory, body: str, frame: int
) -> dict[str, np.ndarray]:
    """Return the pressure [Pa] of a body's contacts at its nodes, of one without a surface their force [N], (n,).

    Pressures on one face add up. At a node of two faces, on an edge, it is the larger of theirs.
    """
    spread = cell_of(mesh).dimension > 1 or mesh.system is not None
    faces: list[tuple[np.ndarray, np.ndarray]] = []
    for contact in trajectory.contacts.values():
        if contact.body == body:
            interface = modal.interfaces[contact.interface]
            areas = interface.areas if contact.areas is None else contact.areas
            values, normals = _face(faces, interface.nodes, interface.normals, len(mesh.nodes), spread=spread)
            np.add.at(values, interface.nodes, contact.multipliers[frame] / (areas if spread else 1.0))
            normals[interface.nodes] = interface.normals
    field = np.max([values for values, _ in faces], axis=0) if faces else np.zeros(len(mesh.nodes))
    return {"contact_pressure" if spread else "contact_force": field}


def _face(
    faces: list[tuple[np.ndarray, np.ndarray]], nodes: np.ndarray, normals: np.ndarray, count: int, *, spread: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return values, (n,), and outward normals, (n, 3), zero elsewhere, of the face that nodes with normals are on: of
    the first that has no other normal at one of them, or a new one; of a body without a surface, of all."""
    for values, of_face in faces:
        if not spread or (np.einsum("ci,ci->c", of_face[nodes], normals)[of_face[nodes].any(axis=1)] > ALIKE).all():
            return values, of_face
    faces.append((np.zeros(count), np.zeros((count, 3))))
    return faces[-1]


def _write_grid(path: Path, mesh: MeshRecord, nodes: np.ndarray, fields: dict[str, np.ndarray]) -> None:
    import meshio

    for name in (WEDGE15.name, PYRAMID13.name):  # Its writers know them, but its table of dimensions does not.
        meshio._mesh.topological_dimension.setdefault(name, 3)
    blocks = [(PYRAMID13, rows[:, :13]) if cell is PYRAMID14 else (cell, rows) for cell, _, rows in cell_blocks(mesh)]
    grid = meshio.Mesh(nodes, [(cell.meshio or cell.name, rows) for cell, rows in blocks], point_data={**fields})
    with whole_file(path) as scratch:
        meshio.write(scratch, grid, file_format="vtu")
