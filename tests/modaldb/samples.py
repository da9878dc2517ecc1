"""One small record of every kind, with fixed content: every field set, groups with several members."""

from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.modaldb.format import hdf5
from gudgeon.modaldb.format.seal import verify_open
from gudgeon.modaldb.records import KINDS
from gudgeon.modaldb.records.cyclic import CyclicHarmonic, CyclicRecord, WheelRecord
from gudgeon.modaldb.records.field import FieldRecord, PoseGridRecord, PoseRecord
from gudgeon.modaldb.records.mesh import Attachment, MeshRecord, Relation, Surface, SystemMatrices, Triangle
from gudgeon.modaldb.records.modes import (
    GaugeModes,
    InertiaCouplings,
    InterfaceModes,
    LoadModes,
    ModalRecord,
    MorphRecord,
    SensitivityRecord,
    StaticResponses,
    SwapModes,
    TractionModes,
)
from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.modaldb.records.report import MeasurementRecord, ReportRecord
from gudgeon.modaldb.records.trajectory import ContactHistory, JointHistory, ProbeHistory, Trajectory

INPUTS = {"stage": "sample", "size": 0.005, "nested": {"on": True, "nothing": None, "list": [1, 2.5, "ω"]}}


def write_record(path: Path, kind: str, record: Any, inputs: dict[str, Any]) -> None:
    """Write a record's file as a store does."""
    path.write_bytes(b"".join(hdf5.record_bytes(kind, record, inputs)))


def verify_record(path: Path) -> str:
    """Check a file against its digest and return its kind."""
    with path.open("rb") as raw:
        return verify_open(raw.fileno(), path)


def ramp(*shape: int, start: float = 0.0) -> np.ndarray:
    """Return an array whose every number is another one, so that a mix-up shows."""
    return start + np.arange(np.prod(shape), dtype=float).reshape(shape) / 8


def mesh() -> MeshRecord:
    """Return one tetrahedron with two surfaces, a set of nodes, and matrices of two of its degrees of freedom."""
    shape = {"kind": "cylinder", "radius": 0.043, "axis": [0.0, 0.0, 1.0], "origin": [0.0, 0.0, 0.0]}
    return MeshRecord(
        nodes=ramp(10, 3),
        cells=np.arange(10).reshape(1, 10),
        cell_type="tetra10",
        surfaces={
            "skirt": Surface(np.array([[0, 1, 2, 4, 5, 6]]), shape),
            "open_end": Surface(np.array([[0, 1, 3, 4, 8, 7]]), {}),
            "set": Surface(np.array([[3], [7]]), {}, ramp(2, start=1.0), ramp(2, 3)),
        },
        volumes={"core": np.array([0])},
        attachments={"rbe2_9": Attachment(np.array([0, 1, 2]), ramp(3), "rbe2", 0.25)},
        relations={
            "springs": Relation(
                "spring", np.array([0, 0]), np.array([1, 9]), np.array([0, 2]), ramp(2), ramp(1, start=5.0)
            )
        },
        system=SystemMatrices(
            nodes=np.array([0, 9]),
            directions=np.array([2, 5]),
            labels=np.arange(101, 111),
            stiffness=Triangle(np.array([0, 0, 1]), np.array([0, 1, 1]), ramp(3, start=2.0)),
            mass=Triangle(np.array([0, 1]), np.array([0, 1]), ramp(2, start=3.0)),
        ),
    )


def modes() -> ModalRecord:
    """Return three coordinates, two interfaces, friction on one of them, two traction spaces and two loads."""
    cylinder = {"kind": "cylinder", "axis": [0.0, 0.0, 1.0], "origin": [0.0, 0.0, 0.0], "radius": 0.043, "middle": 0.5}
    plane = {
        "kind": "plane",
        "origin": [0.0, 0.0, 0.06],
        "normal": [0.0, 0.0, 1.0],
        "across": [0.0, -1.0, 0.0],
        "along": [1.0, 0.0, 0.0],
    }
    return ModalRecord(
        mesh_key="ab" * 32,
        reduction="macneal",
        normal_count=2,
        static_count=1,
        angular_frequencies=np.array([1.0e4, 2.5e4, 3.0e5]),
        mass=0.15,
        centre=ramp(3, start=1.0),
        inertia=ramp(3, 3, start=2.0),
        rigid_twists=ramp(6, 6, start=3.0),
        interfaces={
            "thrust": InterfaceModes(
                nodes=np.array([4, 5]),
                points=ramp(2, 3),
                normals=ramp(2, 3, start=5.0),
                areas=ramp(2),
                edge=np.array([True, False]),
                rows=ramp(2, 3, start=7.0),
                tangents=ramp(2, 2, 3, start=27.0),
                tangential_rows=ramp(2, 2, 3, start=28.0),
                facets=np.array([[0, 1, 0]]),
            ),
            "anti": InterfaceModes(
                nodes=np.array([6]),
                points=ramp(1, 3),
                normals=ramp(1, 3, start=8.0),
                areas=ramp(1),
                edge=np.array([False]),
                rows=ramp(1, 3, start=9.0),
                facets=np.empty((0, 3), np.int64),
                outline=ramp(4, 3, start=29.0),
            ),
        },
        interface_rows={
            "anti": [0, 1],
            "bore": [1, 17],
            "gas": [17, 18],
            "pin": [18, 21],
            "plate": [21, 41],
            "thrust": [41, 43],
        },
        residual_flexibility=ramp(79, 79, start=10.0),
        shapes=ramp(10, 3, 3, start=20.0),
        inertia_couplings=InertiaCouplings(
            ramp(3, 3),
            ramp(3, 3, start=1.0),
            ramp(3, 3, 3, start=2.0),
            ramp(3, 3, 3, start=27.0),
            ramp(3, 3, 3, 3, start=28.0),
            ramp(3, 3, 6, 6, start=29.0),
            ramp(3, 3, 3, 3, start=31.0),
        ),
        quality={"residual": 1.5e-11, "dropped": ["thrust 3"], "modes_missed": 0},
        tractions={
            "bore": _traction(cylinder, (4, 4), start=11.0, rubs=True),
            "plate": _traction(plane, (4, 5), start=12.0),
        },
        loads={
            "pin": LoadModes(ramp(3, 3, start=13.0), ramp(3, 6, start=14.0), ramp(3, start=15.0), "N", ramp(3, 6, 6)),
            "gas": LoadModes(ramp(1, 3, start=16.0), ramp(1, 6, start=17.0), ramp(3, start=18.0), "Pa"),
        },
        gauges={
            "crown": GaugeModes(ramp(2, 3, start=19.0), ramp(2, 79, start=20.0), "Pa", weights=ramp(2, 3, start=27.0)),
            "skin": GaugeModes(
                ramp(12, 3), ramp(12, 79, start=23.0), "1", np.array([0, 3]), centrifugal=ramp(12, 3, 3, start=32.0)
            ),
        },
        static_responses=StaticResponses(
            ramp(10, 3, 2, start=24.0), ramp(2, 2, start=25.0), ramp(2, 6, start=26.0), {"thrust": [0, 2]}
        ),
        residuals=ramp(3, start=21.0),
        algebraic_errors=ramp(3, start=22.0),
        discretisation_errors=np.array([0.125, 0.25, np.nan]),
        participation=ramp(3, 3, start=3.0),
        swap=SwapModes("bore", np.array([0, 1, 2]), np.array([0.125]), ramp(3, 3, start=30.0)),
        tangential_spans={"bore": [47, 79], "thrust": [43, 47]},
    )


def _traction(chart: dict[str, Any], counts: tuple[int, int], start: float, *, rubs: bool = False) -> TractionModes:
    functions = int(np.prod(counts))
    return TractionModes(
        chart=chart,
        start=ramp(2, start=start),
        spacing=np.array([0.005, 0.004]),
        counts=np.array(counts),
        rows=ramp(functions, 3, start=start),
        resultant=ramp(functions, 6, start=-start),
        tangential_rows=ramp(functions, 2, 3, start=2 * start) if rubs else None,
        tangential_resultant=ramp(functions, 2, 6, start=-2 * start) if rubs else None,
    )


def morph() -> MorphRecord:
    """Return a design with moved nodes."""
    return MorphRecord(
        mesh_key="ab" * 32,
        modes_key="cd" * 32,
        update="reuse",
        points={"thrust": ramp(2, 3, start=4.0), "anti": ramp(1, 3, start=5.0)},
        mass=0.1501,
        centre=ramp(3),
        inertia=ramp(3, 3),
        rigid_twists=ramp(6, 6),
        nodes=ramp(10, 3, start=6.0),
        quality={"largest_shift": 2e-5},
    )


def sensitivity() -> SensitivityRecord:
    """Return the derivatives of two modes and of an interface with two smooth pressures."""
    return SensitivityRecord(
        mesh_key="ab" * 32,
        modes_key="cd" * 32,
        eigenvalues=ramp(2, start=1.0),
        pairs=np.array([[0, 0], [0, 1], [1, 1]]),
        modal=ramp(10, 3, 3),
        compliances={"thrust": ramp(2, 2, start=2.0)},
        static={"thrust": ramp(10, 3, 3, start=3.0)},
    )


def nodal() -> NodalRecord:
    """Return four steps."""
    return NodalRecord(
        step=1e-6,
        times=ramp(4, start=1.0),
        force=ramp(4, 3),
        energies=ramp(4, 3, start=2.0),
        energy_drift=1e-5,
        coordinates=30,
        newton_iterations=9,
        wall_seconds=0.25,
        cpu_seconds=0.5,
        forces={"bore": ramp(4, 3, start=3.0), "rod": ramp(4, 3, start=4.0)},
        motion={"skirt": ramp(4, 12, start=5.0)},
        frame_times=ramp(2, start=1.0),
        masters={"bore": ramp(2, 16)},
        quantities={"bore.start": {"value": 0.25, "unit": "s"}},
    )


def trajectory() -> Trajectory:
    """Return four samples, two frames, two contacts of which one has no areas and one no master, and a joint."""
    return Trajectory(
        result="FINISHED",
        bodies={"skirt": "ef" * 32},
        coordinate_offsets={"skirt": 0},
        times=ramp(4, start=1.0),
        energies=ramp(4, 5),
        contacts={
            "bore": ContactHistory(
                "skirt",
                "thrust",
                ramp(4, 3),
                ramp(2, 2),
                ramp(2),
                ramp(2, 3),
                path=ramp(4, 1),
                peak_multipliers=ramp(1, 2, start=12.0),
                friction=ramp(2, 2, 3, start=17.0),
                peak_friction=ramp(1, 2, 3, start=18.0),
            ),
            "back": ContactHistory(
                "skirt",
                "anti",
                ramp(4, 3, start=3.0),
                ramp(2, 1),
                None,
                ramp(1, 3),
                ramp(2, 16),
                peak_multipliers=ramp(1, 1),
                peak_master=ramp(1, 16, start=13.0),
            ),
        },
        frame_times=ramp(2, start=1.0),
        frames=ramp(2, 9),
        velocities=ramp(2, 9, start=5.0),
        quantities={"bore.impulse": {"value": 0.0625, "unit": "N s"}},
        energy_drift=1e-6,
        momentum_residual=2e-16,
        counts={"steps": 400, "step": 7.5e-7},
        joints={"rod": JointHistory("skirt", "pin", ramp(4), ramp(4, 3, start=1.0), ramp(4, start=2.0))},
        motion={"skirt": ramp(4, 12, start=6.0)},
        impacts={"bore": ramp(2, 9, start=7.0), "back": ramp(0, 9)},
        gauges={"skirt.crown": ramp(4, start=8.0)},
        probes={"tip": ProbeHistory("velocity", ramp(4, 3, start=14.0), "m/s", "x, y, z", 0.25)},
        peaks={"bore": 0},
        peak_times=ramp(1, start=0.5),
        peak_frames=ramp(1, 9, start=10.0),
        peak_velocities=ramp(1, 9, start=11.0),
        estimates={"step.impulse": 2.5e-4},
    )


def cyclic() -> CyclicRecord:
    """Return two harmonics of two modes each, one real and one complex."""
    quality = {"orthogonality": 1e-14, "shift": 5.0e7, "found": 2, "expected": 2}
    return CyclicRecord(
        mesh_key="ab" * 32,
        sectors=3,
        axis=np.array([0.0, 0.0, 1.0]),
        origin=ramp(3),
        harmonics={
            "0": CyclicHarmonic(0, 1, 2, ramp(2, start=1.0), ramp(2), ramp(10, 3, 2), None, quality),
            "1": CyclicHarmonic(
                1, 2, 2, ramp(2, start=2.0), ramp(2, start=3.0), ramp(10, 3, 2, start=4.0), ramp(10, 3, 2, start=5.0),
                quality,
            ),
        },
        quality={"sector_dofs": 30, "face_dofs": 6, "wheel_dofs": 72},
    )  # fmt: skip


def wheel() -> WheelRecord:
    """Return a reduced wheel of three blades with two modes at four frequencies."""
    return WheelRecord(
        modes_key="cd" * 32,
        model={"fixed_count": 2, "kept": ["rim"], "interface_count": 1},
        engine_order=1,
        loss_factor=2e-3,
        stiffness_changes=ramp(3),
        tuned_frequencies=ramp(2, start=1.0),
        mistuned_frequencies=ramp(2, start=2.0),
        blades=ramp(3, 2),
        excitation=ramp(4, start=3.0),
        tuned=ramp(4, 3, 2, start=4.0),
        mistuned=ramp(4, 3, 2, start=5.0),
        quantities={"magnification": {"value": 1.25, "unit": "1"}},
        counts={"coordinates": 12, "kept": 2, "interface_modes": 3},
    )


def measurement() -> MeasurementRecord:
    """Return what two stages took."""
    return MeasurementRecord(
        seconds={"mesh": {"wall": 0.5, "cpu": 0.75}, "modes": {"wall": 2.0, "cpu": 3.5}},
        peak_mib=412.5,
        counts={"factorisations": 2},
        machine={"cpu": "a processor", "cores": 2},
    )


def report() -> ReportRecord:
    """Return a report without runs."""
    return ReportRecord(document={"schema": 1, "scene": "skirt", "runs": [], "choice": None})


def field() -> FieldRecord:
    """Return two conductors of four panels on five facets."""
    return FieldRecord(
        conductors={"names": ["comb", "tip"], "mesh_keys": {"comb": "ab" * 32, "tip": "cd" * 32}},
        medium={"permittivity": 8.8e-12, "point": [0.0, 0.0, -1.0], "normal": [0.0, 0.0, 1.0], "image_factor": -1.0},
        facets=ramp(5, 3, 3),
        panel=np.array([0, 1, 2, 2, 3]),
        conductor=np.array([0, 0, 1, 1]),
        coarse=np.array([0, 0, 1, 1]),
        density=ramp(4, 2, start=1.0),
        capacitance=ramp(2, 2, start=2.0),
        panel_error=ramp(2, 2, start=3.0),
        shape_error=ramp(2, 2, start=4.0),
        potentials=ramp(2, start=5.0),
        charges=ramp(2, start=6.0),
        quantities={"comb.capacitance": {"value": 2.0, "unit": "F"}},
        counts={"panels": 4, "coarse_panels": 2, "cpu_seconds": 0.5},
    )


def poses() -> PoseRecord:
    """Return three poses of two conductors."""
    return PoseRecord(
        field_key="ab" * 32, moved={"names": ["tip"], "pivot": [0.0, 0.0, 1.0]}, poses=ramp(3, 6),
        capacitance=ramp(3, 2, 2, start=1.0), panel_error=ramp(3, 2, 2, start=2.0), counts={"iterations": 21},
    )  # fmt: skip


def posegrid() -> PoseGridRecord:
    """Return a grid of four values of two axes for two conductors, of which one floats."""
    return PoseGridRecord(
        field_key="ab" * 32,
        moved={"names": ["tip"], "pivot": [0.0, 0.0, 1.0]},
        axes={"x": ramp(4), "rz": ramp(4, start=1.0)},
        capacitance=ramp(16, 2, 2),
        panel_error=ramp(16, 2, 2, start=2.0),
        cell_errors=ramp(9),
        potentials=np.array([5.0, np.nan]),
        charges=np.array([0.0, 1e-12]),
        counts={"poses": 16},
    )


SAMPLES = {
    "mesh": mesh, "modes": modes, "morph": morph, "sensitivity": sensitivity, "nodal": nodal,
    "trajectory": trajectory, "cyclic": cyclic, "wheel": wheel,
    "measurement": measurement, "report": report, "field": field, "poses": poses, "posegrid": posegrid,
}  # fmt: skip
"""Maker of each kind's sample."""
WITHOUT_ARRAYS = {"measurement", "report"}
"""Kinds that hold json only."""
assert SAMPLES.keys() == KINDS.keys(), "a kind of record without a sample"


def same(one: Any, other: Any) -> bool:
    """Whether two records hold the same, to the last bit, dtype and shape."""
    if isinstance(one, np.ndarray):
        alike = isinstance(other, np.ndarray) and one.dtype == other.dtype and one.shape == other.shape
        return alike and one.tobytes() == other.tobytes()
    if type(one) is not type(other):
        return False
    if is_dataclass(one):
        return all(same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[name], other[name]) for name in one)
    return bool(one == other)
