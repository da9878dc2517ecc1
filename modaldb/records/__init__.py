"""The records: the only vocabulary that pipeline and solver share.

Every record is a frozen dataclass of arrays, numbers, texts and named groups of these; `modaldb.format.hdf5` writes and
reads them field by field, so that a reader can ask for less than the whole. All quantities are SI. Shapes use:
n nodes, e cells, m elastic coordinates, c contact rows of an interface, s samples, f frames.
"""

from gudgeon.modaldb.records.cyclic import CyclicRecord, WheelRecord
from gudgeon.modaldb.records.field import FieldRecord, PoseGridRecord, PoseRecord
from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import ModalRecord, MorphRecord, SensitivityRecord
from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.modaldb.records.report import MeasurementRecord, ReportRecord
from gudgeon.modaldb.records.trajectory import Trajectory

SCHEMA_VERSION = 1
"""Version of the fields of all kinds, of their names, shapes and units: docs/format.md."""

KINDS: dict[str, type] = {
    "mesh": MeshRecord,
    "modes": ModalRecord,
    "morph": MorphRecord,
    "sensitivity": SensitivityRecord,
    "nodal": NodalRecord,
    "trajectory": Trajectory,
    "cyclic": CyclicRecord,
    "wheel": WheelRecord,
    "measurement": MeasurementRecord,
    "report": ReportRecord,
    "field": FieldRecord,
    "poses": PoseRecord,
    "posegrid": PoseGridRecord,
}
"""Kinds of record by their name in the file."""
