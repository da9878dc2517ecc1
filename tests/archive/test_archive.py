"""Files of every schema version ever released are still read, value by value.

What they hold is written down here and not taken from `tests.modaldb.samples`, which may follow the schema.
"""

from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.hdf5 import read_head, read_record
from gudgeon.modaldb.records import KINDS, SCHEMA_VERSION
from gudgeon.modaldb.seal import verify_record
from gudgeon.modaldb.source import FileSource
from tests.archive.make import main

ARCHIVE = Path(__file__).parent
FILES = sorted(ARCHIVE.glob("v*/*.h5"))


def ramp(*shape: int, start: float = 0.0) -> np.ndarray:
    return start + np.arange(np.prod(shape), dtype=float).reshape(shape) / 8


def front(names: Collection[str]) -> str:
    """Return the name of the contact beside `back`: `knock` up to version 5, `bore` since."""
    (name,) = {"knock", "bore"} & set(names)
    return name


def check_mesh(record: Any) -> None:
    assert record.cell_type == "tetra10"
    assert np.array_equal(record.nodes, ramp(10, 3))
    assert np.array_equal(record.cells, [[0, 1, 2, 3, 4, 5, 6, 7, 8, 9]])
    assert record.surfaces.keys() - {"set"} == {"skirt", "open_end"}
    assert np.array_equal(record.surfaces["skirt"].facets, [[0, 1, 2, 4, 5, 6]])
    assert record.surfaces["skirt"].shape["radius"] == 0.043
    assert record.surfaces["open_end"].shape == {}


def check_mesh_10(record: Any) -> None:
    """Version 10 has sets of nodes, and matrices of other programs."""
    assert np.array_equal(record.surfaces["set"].facets, [[3], [7]])
    assert np.array_equal(record.surfaces["set"].areas, ramp(2, start=1.0))
    assert np.array_equal(record.surfaces["set"].normals, ramp(2, 3))
    assert record.surfaces["skirt"].areas is None
    assert record.volumes["core"].tolist() == [0]
    system = record.system
    assert (system.nodes.tolist(), system.directions.tolist()) == ([0, 9], [2, 5])
    assert system.labels.tolist() == list(range(101, 111))
    assert (system.stiffness.rows.tolist(), system.stiffness.columns.tolist()) == ([0, 0, 1], [0, 1, 1])
    assert np.array_equal(system.stiffness.values, ramp(3, start=2.0))
    assert (system.mass.rows.tolist(), system.mass.columns.tolist()) == ([0, 1], [0, 1])
    assert np.array_equal(system.mass.values, ramp(2, start=3.0))


def check_modes(record: Any) -> None:
    assert (record.mesh_key, record.reduction) == ("ab" * 32, "macneal")
    assert (record.normal_count, record.static_count, record.mass) == (2, 1, 0.15)
    assert np.array_equal(record.angular_frequencies, [1.0e4, 2.5e4, 3.0e5])
    assert np.array_equal(record.centre, ramp(3, start=1.0))
    assert np.array_equal(record.inertia, ramp(3, 3, start=2.0))
    assert np.array_equal(record.rigid_twists, ramp(6, 6, start=3.0))
    thrust, anti = record.interfaces["thrust"], record.interfaces["anti"]
    assert np.array_equal(thrust.nodes, [4, 5])
    assert np.array_equal(thrust.points, ramp(2, 3))
    assert np.array_equal(thrust.normals, ramp(2, 3, start=5.0))
    assert np.array_equal(thrust.areas, ramp(2))
    assert thrust.edge.tolist() == [True, False]
    assert np.array_equal(thrust.rows, ramp(2, 3, start=7.0))
    assert np.array_equal(anti.rows, ramp(1, 3, start=9.0))
    assert np.array_equal(record.shapes, ramp(10, 3, 3, start=20.0))
    assert np.array_equal(record.inertia_couplings.translation, ramp(3, 3))
    assert np.array_equal(record.inertia_couplings.rotation, ramp(3, 3, start=1.0))
    assert np.array_equal(record.inertia_couplings.rotation_gradient, ramp(3, 3, 3, start=2.0))
    assert record.quality == {"residual": 1.5e-11, "dropped": ["thrust 3"], "modes_missed": 0}


def check_morph(record: Any) -> None:
    assert (record.mesh_key, record.modes_key, record.update) == ("ab" * 32, "cd" * 32, "reuse")
    assert np.array_equal(record.points["thrust"], ramp(2, 3, start=4.0))
    assert np.array_equal(record.points["anti"], ramp(1, 3, start=5.0))
    assert record.mass == 0.1501
    assert np.array_equal(record.centre, ramp(3))
    assert np.array_equal(record.inertia, ramp(3, 3))
    assert np.array_equal(record.rigid_twists, ramp(6, 6))
    assert np.array_equal(record.nodes, ramp(10, 3, start=6.0))
    assert record.quality == {"largest_shift": 2e-5}


def check_sensitivity(record: Any) -> None:
    assert (record.mesh_key, record.modes_key) == ("ab" * 32, "cd" * 32)
    assert np.array_equal(record.eigenvalues, ramp(2, start=1.0))
    assert record.pairs.tolist() == [[0, 0], [0, 1], [1, 1]]
    assert np.array_equal(record.modal, ramp(10, 3, 3))
    assert np.array_equal(record.compliances["thrust"], ramp(2, 2, start=2.0))
    assert np.array_equal(record.static["thrust"], ramp(10, 3, 3, start=3.0))


def check_nodal(record: Any) -> None:
    assert (record.step, record.energy_drift) == (1e-6, 1e-5)
    assert (record.coordinates, record.newton_iterations) == (30, 9)
    assert (record.wall_seconds, record.cpu_seconds) == (0.25, 0.5)
    assert np.array_equal(record.times, ramp(4, start=1.0))
    assert np.array_equal(record.force, ramp(4, 3))
    assert np.array_equal(record.energies, ramp(4, 3, start=2.0))


def check_trajectory(record: Any) -> None:
    assert (record.result, record.bodies) == ("FINISHED", {"skirt": "ef" * 32})
    assert record.coordinate_offsets == {"skirt": 0}
    assert np.array_equal(record.times, ramp(4, start=1.0))
    name = front(record.contacts)
    bore, back = record.contacts[name], record.contacts["back"]
    assert (bore.body, bore.interface, back.interface) == ("skirt", "thrust", "anti")
    assert np.array_equal(bore.force, ramp(4, 3))
    assert np.array_equal(bore.multipliers, ramp(2, 2))
    assert np.array_equal(bore.areas, ramp(2))
    assert np.array_equal(bore.points, ramp(2, 3))
    assert back.areas is None
    assert np.array_equal(back.force, ramp(4, 3, start=3.0))
    assert np.array_equal(record.frame_times, ramp(2, start=1.0))
    assert np.array_equal(record.frames, ramp(2, 9))
    assert np.array_equal(record.velocities, ramp(2, 9, start=5.0))
    assert record.quantities == {f"{name}.impulse": {"value": 0.0625, "unit": "N s"}}
    assert (record.energy_drift, record.momentum_residual) == (1e-6, 2e-16)
    assert record.counts == {"steps": 400, "step": 7.5e-7}


def check_cyclic(record: Any) -> None:
    assert (record.mesh_key, record.sectors) == ("ab" * 32, 3)
    assert np.array_equal(record.axis, [0.0, 0.0, 1.0])
    assert np.array_equal(record.origin, ramp(3))
    assert record.harmonics.keys() == {"0", "1"}
    real, pair = record.harmonics["0"], record.harmonics["1"]
    assert (real.harmonic, real.multiplicity, real.rigid, pair.harmonic, pair.multiplicity) == (0, 1, 2, 1, 2)
    assert np.array_equal(pair.angular_frequencies, ramp(2, start=2.0))
    assert np.array_equal(pair.residuals, ramp(2, start=3.0))
    assert np.array_equal(real.real, ramp(10, 3, 2))
    assert real.imaginary is None
    assert np.array_equal(pair.imaginary, ramp(10, 3, 2, start=5.0))
    assert pair.quality == {"orthogonality": 1e-14, "shift": 5.0e7, "found": 2, "expected": 2}
    assert record.quality == {"sector_dofs": 30, "face_dofs": 6, "wheel_dofs": 72}


def check_wheel(record: Any) -> None:
    assert record.modes_key == "cd" * 32
    assert record.model == {"fixed_count": 2, "kept": ["rim"], "interface_count": 1}
    assert (record.engine_order, record.loss_factor) == (1, 2e-3)
    assert np.array_equal(record.stiffness_changes, ramp(3))
    assert np.array_equal(record.tuned_frequencies, ramp(2, start=1.0))
    assert np.array_equal(record.mistuned_frequencies, ramp(2, start=2.0))
    assert np.array_equal(record.blades, ramp(3, 2))
    assert np.array_equal(record.excitation, ramp(4, start=3.0))
    assert np.array_equal(record.tuned, ramp(4, 3, 2, start=4.0))
    assert np.array_equal(record.mistuned, ramp(4, 3, 2, start=5.0))
    assert record.quantities == {"magnification": {"value": 1.25, "unit": "1"}}
    assert record.counts == {"coordinates": 12, "kept": 2, "interface_modes": 3}


def check_measurement(record: Any) -> None:
    assert record.seconds == {"mesh": {"wall": 0.5, "cpu": 0.75}, "modes": {"wall": 2.0, "cpu": 3.5}}
    assert record.counts == {"factorisations": 2}
    assert (record.peak_mib, record.machine) == (412.5, {"cpu": "a processor", "cores": 2})


def check_report(record: Any) -> None:
    assert record.document == {"schema": 1, "scene": "skirt", "runs": [], "choice": None}


def check_modes_1(record: Any) -> None:
    assert record.interface_rows == {"anti": [0, 1], "thrust": [1, 3]}
    assert np.array_equal(record.residual_flexibility, ramp(3, 3, start=10.0))
    assert (record.tractions, record.loads) == ({}, {})
    assert (record.residuals, record.algebraic_errors, record.discretisation_errors) == (None, None, None)


def check_nodal_1(record: Any) -> None:
    assert (record.forces, record.motion, record.masters, record.frame_times) == ({}, {}, {}, None)


def check_trajectory_1(record: Any) -> None:
    assert np.array_equal(record.energies, ramp(4, 4))
    assert (record.joints, record.motion) == ({}, {})
    assert [contact.master for contact in record.contacts.values()] == [None, None]


def check_modes_2(record: Any, rows_of_R: int = 43) -> None:
    rows = {"anti": [0, 1], "bore": [1, 17], "gas": [17, 18], "pin": [18, 21], "plate": [21, 41], "thrust": [41, 43]}
    assert record.interface_rows == rows
    assert np.array_equal(record.residual_flexibility, ramp(rows_of_R, rows_of_R, start=10.0))
    bore, plate = record.tractions["bore"], record.tractions["plate"]
    axis = {"axis": [0.0, 0.0, 1.0], "origin": [0.0, 0.0, 0.0], "radius": 0.043, "middle": 0.5}
    assert bore.chart == {"kind": "cylinder"} | axis
    frame = {"normal": [0.0, 0.0, 1.0], "across": [0.0, -1.0, 0.0], "along": [1.0, 0.0, 0.0]}
    assert plate.chart == {"kind": "plane", "origin": [0.0, 0.0, 0.06]} | frame
    assert np.array_equal(bore.start, ramp(2, start=11.0))
    assert np.array_equal(bore.spacing, [0.005, 0.004])
    assert plate.counts.tolist() == [4, 5]
    assert np.array_equal(bore.rows, ramp(16, 3, start=11.0))
    assert np.array_equal(plate.resultant, ramp(20, 6, start=-12.0))
    gas, pin = record.loads["gas"], record.loads["pin"]
    assert (gas.unit, pin.unit) == ("Pa", "N")
    assert np.array_equal(gas.rows, ramp(1, 3, start=16.0))
    assert np.array_equal(pin.resultant, ramp(3, 6, start=14.0))
    assert np.array_equal(pin.point, ramp(3, start=15.0))


def check_nodal_2(record: Any) -> None:
    assert np.array_equal(record.forces[front(record.forces)], ramp(4, 3, start=3.0))
    assert np.array_equal(record.forces["rod"], ramp(4, 3, start=4.0))
    assert np.array_equal(record.motion["skirt"], ramp(4, 12, start=5.0))
    assert np.array_equal(record.frame_times, ramp(2, start=1.0))
    assert np.array_equal(record.masters[front(record.masters)], ramp(2, 16))


def check_trajectory_2(record: Any) -> None:
    assert np.array_equal(record.energies, ramp(4, 5))
    assert record.contacts[front(record.contacts)].master is None
    assert np.array_equal(record.contacts["back"].master, ramp(2, 16))
    rod = record.joints["rod"]
    assert (rod.body, rod.interface) == ("skirt", "pin")
    assert np.array_equal(rod.angle, ramp(4))
    assert np.array_equal(rod.force, ramp(4, 3, start=1.0))
    assert np.array_equal(rod.violation, ramp(4, start=2.0))
    assert np.array_equal(record.motion["skirt"], ramp(4, 12, start=6.0))


def check_modes_3(record: Any, rows_of_R: int = 43) -> None:
    check_modes_2(record, rows_of_R)
    crown = record.gauges["crown"]
    assert (np.array_equal(crown.rows, ramp(2, 3, start=19.0)), crown.unit) == (True, "Pa")
    assert np.array_equal(crown.residual, ramp(2, rows_of_R, start=20.0))


def check_modes_4(record: Any, rows_of_R: int = 43) -> None:
    check_modes_3(record, rows_of_R)
    assert np.array_equal(record.residuals, ramp(3, start=21.0))
    assert np.array_equal(record.algebraic_errors, ramp(3, start=22.0))
    assert np.array_equal(record.discretisation_errors, [0.125, 0.25, np.nan], equal_nan=True)
    skin = record.gauges["skin"]
    assert (skin.nodes.tolist(), skin.unit) == ([0, 3], "1")
    assert np.array_equal(skin.rows, ramp(12, 3))
    assert np.array_equal(skin.residual, ramp(12, rows_of_R, start=23.0))
    assert record.gauges["crown"].nodes is None


def check_trajectory_3(record: Any) -> None:
    check_trajectory_2(record)
    impacts = record.impacts[front(record.impacts)]
    assert np.array_equal(impacts[:, :7], ramp(2, 7, start=7.0))
    assert impacts.shape == (2, 9)
    assert np.isnan(impacts[:, 7:]).all()
    assert record.impacts["back"].shape == (0, 9)
    assert record.estimates == {}
    assert np.array_equal(record.gauges["skirt.crown"], ramp(4, start=8.0))


def check_modes_7(record: Any, rows_of_R: int = 43) -> None:
    check_modes_4(record, rows_of_R)
    assert np.array_equal(record.participation, ramp(3, 3, start=3.0))


def check_without_friction(record: Any) -> None:
    """Up to version 7 no record has tangential rows."""
    assert record.tangential_spans == {}
    assert record.row_count == len(record.residual_flexibility)
    assert [(one.tangents, one.tangential_rows) for one in record.interfaces.values()] == [(None, None)] * 2


def check_modes_8(record: Any, rows_of_R: int = 47) -> None:
    check_modes_7(record, rows_of_R)
    thrust, anti = record.interfaces["thrust"], record.interfaces["anti"]
    assert record.tangential_spans["thrust"] == [43, 47]
    assert record.row_count == rows_of_R
    assert np.array_equal(thrust.tangents, ramp(2, 2, 3, start=27.0))
    assert np.array_equal(thrust.tangential_rows, ramp(2, 2, 3, start=28.0))
    assert (anti.tangents, anti.tangential_rows) == (None, None)


def check_without_moments(record: Any) -> None:
    """Up to version 10 no record has the moments of a floating frame."""
    found = record.inertia_couplings
    assert (found.position_moments, found.shape_moments, found.centrifugal_stiffness) == (None, None, None)
    assert [load.stress_stiffness for load in record.loads.values()] == [None] * len(record.loads)


def check_modes_11(record: Any, rows_of_R: int = 47) -> None:
    check_modes_8(record, rows_of_R)
    found = record.inertia_couplings
    assert np.array_equal(found.position_moments, ramp(3, 3, 3, start=27.0))
    assert np.array_equal(found.shape_moments, ramp(3, 3, 3, 3, start=28.0))
    assert np.array_equal(found.centrifugal_stiffness, ramp(3, 3, 6, 6, start=29.0))
    assert np.array_equal(record.loads["pin"].stress_stiffness, ramp(3, 6, 6))


def check_modes_12(record: Any, rows_of_R: int = 47) -> None:
    check_modes_11(record, rows_of_R)
    assert record.interfaces["thrust"].facets.tolist() == [[0, 1, 0]]
    assert record.interfaces["anti"].facets.shape == (0, 3)


def check_smooth_spaces(record: Any) -> None:
    """Up to version 12 no traction space has tractions across its normal."""
    found = [(one.tangential_rows, one.tangential_resultant) for one in record.tractions.values()]
    assert found == [(None, None)] * len(record.tractions)
    assert set(record.tangential_spans) <= {"thrust"}


def check_modes_13(record: Any) -> None:
    check_modes_12(record, rows_of_R=79)
    bore, plate = record.tractions["bore"], record.tractions["plate"]
    assert record.tangential_spans == {"bore": [47, 79], "thrust": [43, 47]}
    assert np.array_equal(bore.tangential_rows, ramp(16, 2, 3, start=22.0))
    assert np.array_equal(bore.tangential_resultant, ramp(16, 2, 6, start=-22.0))
    assert (plate.tangential_rows, plate.tangential_resultant) == (None, None)


def check_modes_14(record: Any) -> None:
    check_modes_13(record)
    assert record.swap.interface == "bore"
    assert record.swap.number.tolist() == [0, 1, 2]
    assert record.swap.borders.tolist() == [0.125]
    assert np.array_equal(record.swap.overlap, ramp(3, 3, start=30.0))


def check_modes_16(record: Any) -> None:
    """Version 16 has what centrifugal loads do to gauges, and their strain energy."""
    check_modes_14(record)
    assert record.gauges["crown"].centrifugal is None
    assert np.array_equal(record.gauges["skin"].centrifugal, ramp(12, 3, 3, start=32.0))
    assert np.array_equal(record.inertia_couplings.centrifugal_compliance, ramp(3, 3, 3, 3, start=31.0))


def check_modes_17(record: Any) -> None:
    """Version 17 has what gauges show under gravity."""
    check_modes_16(record)
    assert np.array_equal(record.gauges["crown"].weights, ramp(2, 3, start=27.0))
    assert record.gauges["skin"].weights is None


def check_trajectory_7(record: Any) -> None:
    check_trajectory_2(record)
    assert np.array_equal(record.impacts["bore"], ramp(2, 9, start=7.0))
    assert record.impacts["back"].shape == (0, 9)
    assert record.estimates == {"step.impulse": 2.5e-4}
    assert np.array_equal(record.gauges["skirt.crown"], ramp(4, start=8.0))


def check_trajectory_15(record: Any) -> None:
    """Version 15 has the friction of points."""
    check_trajectory_9(record)
    assert np.array_equal(record.contacts["bore"].friction, ramp(2, 2, 3, start=17.0))
    assert np.array_equal(record.contacts["bore"].peak_friction, ramp(1, 2, 3, start=18.0))
    assert record.contacts["back"].friction is None


def check_trajectory_9(record: Any) -> None:
    check_trajectory_7(record)
    tip = record.probes["tip"]
    assert np.array_equal(tip.values, ramp(4, 3, start=14.0))
    assert (tip.kind, tip.unit, tip.columns, tip.snapped) == ("velocity", "m/s", "x, y, z", 0.25)


def check_nodal_5(record: Any) -> None:
    check_nodal_2(record)
    assert record.quantities == {f"{front(record.forces)}.start": {"value": 0.25, "unit": "s"}}


def check_field(record: Any) -> None:
    assert record.conductors == {"names": ["comb", "tip"], "mesh_keys": {"comb": "ab" * 32, "tip": "cd" * 32}}
    assert (record.medium["permittivity"], record.medium["image_factor"]) == (8.8e-12, -1.0)
    assert np.array_equal(record.facets, ramp(5, 3, 3))
    assert record.panel.tolist() == [0, 1, 2, 2, 3]
    assert record.conductor.tolist() == record.coarse.tolist() == [0, 0, 1, 1]
    assert np.array_equal(record.density, ramp(4, 2, start=1.0))
    assert np.array_equal(record.capacitance, ramp(2, 2, start=2.0))
    assert np.array_equal(record.panel_error, ramp(2, 2, start=3.0))
    assert np.array_equal(record.shape_error, ramp(2, 2, start=4.0))
    assert np.array_equal(record.potentials, ramp(2, start=5.0))
    assert np.array_equal(record.charges, ramp(2, start=6.0))
    assert record.quantities == {"comb.capacitance": {"value": 2.0, "unit": "F"}}
    assert record.counts == {"panels": 4, "coarse_panels": 2, "cpu_seconds": 0.5}


def check_poses(record: Any) -> None:
    assert (record.field_key, record.moved) == ("ab" * 32, {"names": ["tip"], "pivot": [0.0, 0.0, 1.0]})
    assert np.array_equal(record.poses, ramp(3, 6))
    assert np.array_equal(record.capacitance, ramp(3, 2, 2, start=1.0))
    assert np.array_equal(record.panel_error, ramp(3, 2, 2, start=2.0))
    assert record.counts == {"iterations": 21}


def check_posegrid(record: Any) -> None:
    assert (record.field_key, record.moved) == ("ab" * 32, {"names": ["tip"], "pivot": [0.0, 0.0, 1.0]})
    assert record.axes.keys() == {"x", "rz"}
    assert np.array_equal(record.axes["rz"], ramp(4, start=1.0))
    assert np.array_equal(record.capacitance, ramp(16, 2, 2))
    assert np.array_equal(record.panel_error, ramp(16, 2, 2, start=2.0))
    assert np.array_equal(record.cell_errors, ramp(9))
    assert np.array_equal(record.potentials, [5.0, np.nan], equal_nan=True)
    assert record.charges.tolist() == [0.0, 1e-12]
    assert record.counts == {"poses": 16}


CHECKS: dict[str, Callable[[Any], None]] = {
    "mesh": check_mesh,
    "modes": check_modes,
    "morph": check_morph,
    "sensitivity": check_sensitivity,
    "nodal": check_nodal,
    "trajectory": check_trajectory,
    "cyclic": check_cyclic,
    "wheel": check_wheel,
    "measurement": check_measurement,
    "report": check_report,
    "field": check_field,
    "poses": check_poses,
    "posegrid": check_posegrid,
}
"""What the files of all versions hold."""
OWN: dict[str, dict[str, Callable[[Any], None]]] = {
    "v1": {"modes": check_modes_1, "nodal": check_nodal_1, "trajectory": check_trajectory_1},
    "v2": {"modes": check_modes_2, "nodal": check_nodal_2, "trajectory": check_trajectory_2},
    "v3": {"modes": check_modes_3, "nodal": check_nodal_2, "trajectory": check_trajectory_3},
    "v4": {"modes": check_modes_4, "nodal": check_nodal_2, "trajectory": check_trajectory_3},
    "v5": {"modes": check_modes_4, "nodal": check_nodal_5, "trajectory": check_trajectory_3},
    "v6": {"modes": check_modes_4, "nodal": check_nodal_5, "trajectory": check_trajectory_3},
    "v7": {"modes": check_modes_7, "nodal": check_nodal_5, "trajectory": check_trajectory_7},
    "v8": {"modes": check_modes_8, "nodal": check_nodal_5, "trajectory": check_trajectory_7},
    "v9": {"modes": check_modes_8, "nodal": check_nodal_5, "trajectory": check_trajectory_9},
    "v10": {"mesh": check_mesh_10, "modes": check_modes_8, "nodal": check_nodal_5, "trajectory": check_trajectory_9},
    "v11": {"mesh": check_mesh_10, "modes": check_modes_11, "nodal": check_nodal_5, "trajectory": check_trajectory_9},
    "v12": {"mesh": check_mesh_10, "modes": check_modes_12, "nodal": check_nodal_5, "trajectory": check_trajectory_9},
    "v13": {"mesh": check_mesh_10, "modes": check_modes_13, "nodal": check_nodal_5, "trajectory": check_trajectory_9},
    "v14": {"mesh": check_mesh_10, "modes": check_modes_14, "nodal": check_nodal_5, "trajectory": check_trajectory_9},
    "v15": {"mesh": check_mesh_10, "modes": check_modes_14, "nodal": check_nodal_5, "trajectory": check_trajectory_15},
    "v16": {"mesh": check_mesh_10, "modes": check_modes_16, "nodal": check_nodal_5, "trajectory": check_trajectory_15},
    "v17": {"mesh": check_mesh_10, "modes": check_modes_17, "nodal": check_nodal_5, "trajectory": check_trajectory_15},
}
"""What those of one version hold, or lack."""


def check(path: Path, version: str) -> None:
    record = read_record(path, path.stem)
    CHECKS[path.stem](record)
    if (own := OWN[version].get(path.stem)) is not None:
        own(record)
    if path.stem == "modes" and int(version.removeprefix("v")) < 8:
        check_without_friction(record)
    if path.stem == "modes" and int(version.removeprefix("v")) < 14:
        assert record.swap is None
    if path.stem == "modes" and int(version.removeprefix("v")) < 13:
        check_smooth_spaces(record)
    if path.stem == "modes" and int(version.removeprefix("v")) < 12:
        assert [one.facets for one in record.interfaces.values()] == [None] * len(record.interfaces)
    if path.stem == "modes" and int(version.removeprefix("v")) < 11:
        check_without_moments(record)


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_archived_file_is_read(path: Path) -> None:
    assert verify_record(path) == path.stem
    check(path, path.parent.name)
    with path.open("rb") as raw:
        assert read_head(FileSource(raw.fileno()), path).inputs["stage"] == "sample"


def test_archive_is_complete() -> None:
    """Every version up to the current one, and every kind of the current one."""
    assert {path.parent.name for path in FILES} == {f"v{version}" for version in range(1, SCHEMA_VERSION + 1)}
    assert {path.stem for path in FILES if path.parent.name == f"v{SCHEMA_VERSION}"} == KINDS.keys()


@pytest.mark.parametrize(
    ("kind", "group", "former", "name"),
    [
        ("modes", "/", "recipe", "reduction"),
        ("morph", "/", "rung", "update"),
        ("trajectory", None, "episodes/back", "impacts/back"),
    ],
)
def test_names_changed_with_version_6(kind: str, group: str | None, former: str, name: str) -> None:
    for version, own, other in (("v5", former, name), ("v6", name, former)):
        outline = _outline(ARCHIVE / version / f"{kind}.h5")
        names = outline if group is None else outline[group]
        assert own in names
        assert other not in names


def test_current_writer_still_writes_this_schema(tmp_path: Path) -> None:
    """Fields, names and dtypes of a released version do not drift: a change needs a new SCHEMA_VERSION."""
    for path in main(tmp_path):
        check(path, f"v{SCHEMA_VERSION}")
        old = ARCHIVE / f"v{SCHEMA_VERSION}" / path.name
        assert _outline(path) == _outline(old)


def _outline(path: Path) -> dict[str, Any]:
    """Return the dtype and shape of every dataset, and the attributes of every group, by path."""
    import h5py

    found: dict[str, Any] = {}

    def note(name: str, item: Any) -> None:
        found[name] = (str(item.dtype), item.shape) if isinstance(item, h5py.Dataset) else sorted(item.attrs)

    with h5py.File(path, "r") as file:
        found["/"] = sorted(file.attrs)
        file.visititems(note)
    return found
