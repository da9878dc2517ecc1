"""Records as files: what is written is what is read, in full or in part; every changed byte is noticed."""

import contextlib
import json
import os
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from gudgeon.modaldb.errors import RecordDamaged, RecordMismatch
from gudgeon.modaldb.format import hdf5
from gudgeon.modaldb.format.seal import verify_open
from gudgeon.modaldb.format.source import FileSource
from gudgeon.modaldb.records import KINDS, SCHEMA_VERSION
from gudgeon.modaldb.records.mesh import Surface
from gudgeon.modaldb.records.modes import ModalRecord
from tests.modaldb.samples import (
    INPUTS,
    SAMPLES,
    WITHOUT_ARRAYS,
    mesh,
    modes,
    morph,
    nodal,
    same,
    trajectory,
    verify_record,
    write_record,
)

LARGE = 200_000
"""Characters of a text above the 64 KiB that an attribute may have in old HDF5 formats."""


def written(path: Path, kind: str, record: Any) -> Path:
    write_record(path, kind, record, INPUTS)
    return path


def head_of(path: Path) -> hdf5.Head:
    with path.open("rb") as raw:
        return hdf5.read_head(FileSource(raw.fileno()), path)


def arrays(record: Any) -> list[np.ndarray]:
    """Return all arrays of a record, at any depth."""
    if isinstance(record, np.ndarray):
        return [record]
    if isinstance(record, dict):
        return [array for item in record.values() for array in arrays(item)]
    if is_dataclass(record):
        return [array for field in fields(record) for array in arrays(getattr(record, field.name))]
    return []


def without_modes() -> ModalRecord:
    """Return a body with neither coordinates nor rows."""
    none = dict.fromkeys(("inertia_couplings", "residuals", "algebraic_errors", "discretisation_errors"))
    bare = replace(
        modes(), normal_count=0, static_count=0, angular_frequencies=np.empty(0), shapes=np.empty((10, 3, 0))
    )
    bare = replace(
        bare, interfaces={}, tractions={}, loads={}, gauges={}, interface_rows={}, tangential_spans={},
        participation=None, **none,
    )  # fmt: skip
    return replace(bare, residual_flexibility=np.empty((0, 0)), static_responses=None, swap=None)


@pytest.fixture
def touched(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the datasets that are read, in order."""
    names: list[str] = []
    whole = hdf5.read_array

    def noted(source: Any, dataset: Any, path: str) -> np.ndarray:
        names.append(path)
        return whole(source, dataset, path)

    monkeypatch.setattr(hdf5, "read_array", noted)
    return names


@pytest.mark.parametrize("kind", KINDS)
def test_round_trip(kind: str, tmp_path: Path) -> None:
    record = SAMPLES[kind]()
    read = hdf5.read_record(written(tmp_path / "r.h5", kind, record), kind)
    assert same(read, record)


@pytest.mark.parametrize(
    ("kind", "record"),
    [
        ("modes", replace(modes(), residual_flexibility=None, shapes=None, inertia_couplings=None)),
        (
            "modes",
            replace(
                modes(),
                swap=None,
                tractions={},
                tangential_spans={"thrust": [43, 47]},
                loads={},
                rigid_twists=np.empty((0, 6)),
            ),
        ),
        ("modes", replace(modes(), interfaces={}, tangential_spans={"bore": [47, 79]}, quality={})),
        ("modes", without_modes()),
        ("morph", replace(morph(), nodes=None, points={})),
        ("mesh", replace(mesh(), surfaces={})),
        ("mesh", replace(mesh(), surfaces={"edge": Surface(np.array([[0, 1, 2]]), {"thickness": 0.02})})),
        ("trajectory", replace(trajectory(), contacts={}, quantities={}, bodies={"ωβ piston-1": "ef" * 32})),
        ("nodal", replace(nodal(), energy_drift=float("inf"))),
    ],
)
def test_round_trip_of_what_may_be_absent_or_empty(kind: str, record: Any, tmp_path: Path) -> None:
    read = hdf5.read_record(written(tmp_path / "r.h5", kind, record), kind)
    assert same(read, record)


def test_comparison_of_this_file_can_fail() -> None:
    record = modes()
    assert not same(record, replace(record, mass=0.15000001))
    assert not same(record, replace(record, shapes=None))
    assert not same(record, replace(record, centre=record.centre.astype(np.float32)))
    assert not same(record, replace(record, interfaces={"thrust": record.interfaces["thrust"]}))


def test_whole_numbers_are_written_with_64_bits(tmp_path: Path) -> None:
    narrow = replace(mesh(), cells=np.arange(10, dtype=np.int32).reshape(1, 10))
    assert same(hdf5.read_record(written(tmp_path / "r.h5", "mesh", narrow), "mesh"), mesh())


def test_strided_arrays_are_written_as_they_look(tmp_path: Path) -> None:
    turned = np.arange(30.0).reshape(3, 10).T
    read = hdf5.read_record(written(tmp_path / "r.h5", "mesh", replace(mesh(), nodes=turned)), "mesh")
    assert np.array_equal(read.nodes, turned)


def test_long_texts_fit(tmp_path: Path) -> None:
    record = replace(modes(), quality={"dropped": ["x" * LARGE]})
    path = tmp_path / "r.h5"
    write_record(path, "modes", record, INPUTS | {"note": "y" * LARGE})
    assert hdf5.read_record(path, "modes").quality == record.quality
    assert head_of(path).inputs["note"] == "y" * LARGE


@pytest.mark.parametrize("name", ["a/b", ".", "..", "with space", "Ωβ", "a.b", "50%", "a%2Fb"])
def test_any_name_of_a_surface_survives(name: str, tmp_path: Path) -> None:
    """Names come from users' mesh files; a slash is a path to HDF5."""
    surface = Surface(np.array([[0, 1, 2, 4, 5, 6]]), {"kind": "cone"})
    record = replace(mesh(), surfaces={name: surface}, volumes={}, attachments={}, relations={}, system=None)
    path = written(tmp_path / "r.h5", "mesh", record)
    assert same(hdf5.read_record(path, "mesh"), record)
    assert hdf5.dataset_bytes(head_of(path)).keys() == {"nodes", "cells", f"surfaces/{name}/facets"}


@pytest.mark.parametrize("kind", sorted(KINDS.keys() - WITHOUT_ARRAYS))
def test_arrays_are_read_only(kind: str, tmp_path: Path) -> None:
    read = hdf5.read_record(written(tmp_path / "r.h5", kind, SAMPLES[kind]()), kind)
    found = arrays(read)
    assert found
    assert not any(array.flags.writeable for array in found)
    with pytest.raises(ValueError, match="read-only"):
        found[0][...] = 0


def test_only_reads_what_is_asked(tmp_path: Path, touched: list[str]) -> None:
    path = written(tmp_path / "r.h5", "modes", modes())
    read = hdf5.read_record(path, "modes", only=["interfaces/thrust/rows", "angular_frequencies"])
    assert sorted(touched) == ["angular_frequencies", "interfaces/thrust/rows"]
    assert same(read.interfaces["thrust"].rows, modes().interfaces["thrust"].rows)
    assert same(read.angular_frequencies, modes().angular_frequencies)
    assert read.interfaces.keys() == {"thrust"}
    assert read.interfaces["thrust"].points.size == 0
    assert read.residual_flexibility is None
    assert read.shapes is None
    assert read.inertia_couplings is None
    assert read.centre.size == 0
    assert read.mass == modes().mass  # attributes cost nothing


def test_only_reads_all_below_a_path(tmp_path: Path, touched: list[str]) -> None:
    path = written(tmp_path / "r.h5", "modes", modes())
    read = hdf5.read_record(path, "modes", only=["interfaces/anti", "inertia_couplings"])
    assert sorted(touched) == sorted(
        [
            f"interfaces/anti/{name}"
            for name in ("areas", "edge", "facets", "nodes", "normals", "outline", "points", "rows")
        ]
        + [
            f"inertia_couplings/{name}"
            for name in (
                "rotation",
                "rotation_gradient",
                "translation",
                "position_moments",
                "shape_moments",
                "centrifugal_stiffness",
                "centrifugal_compliance",
            )
        ]
    )
    assert same(read.interfaces, {"anti": modes().interfaces["anti"]})
    assert same(read.inertia_couplings, modes().inertia_couplings)


def test_only_reads_one_field_of_a_traction_space(tmp_path: Path, touched: list[str]) -> None:
    path = written(tmp_path / "r.h5", "modes", modes())
    read = hdf5.read_record(path, "modes", only=["tractions/bore/resultant", "loads/gas"])
    assert sorted(touched) == ["loads/gas/point", "loads/gas/resultant", "loads/gas/rows", "tractions/bore/resultant"]
    assert same(read.tractions["bore"].resultant, modes().tractions["bore"].resultant)
    assert read.tractions["bore"].chart == modes().tractions["bore"].chart
    assert same(read.loads, {"gas": modes().loads["gas"]})


def test_only_does_not_take_a_name_for_its_beginning(tmp_path: Path, touched: list[str]) -> None:
    record = replace(morph(), points={"thrust": np.ones((1, 3)), "thrust2": np.zeros((1, 3))})
    read = hdf5.read_record(written(tmp_path / "r.h5", "morph", record), "morph", only=["points/thrust"])
    assert touched == ["points/thrust"]
    assert read.points.keys() == {"thrust"}


def test_only_nothing_reads_no_dataset(tmp_path: Path, touched: list[str]) -> None:
    path = written(tmp_path / "r.h5", "trajectory", trajectory())
    assert hdf5.read_record(path, "trajectory", only=[]).quantities == trajectory().quantities
    assert touched == []


def test_sizes_and_provenance(tmp_path: Path) -> None:
    path = written(tmp_path / "r.h5", "nodal", nodal())
    assert hdf5.dataset_bytes(head_of(path)) == {
        "times": 32,
        "force": 96,
        "energies": 96,
        "forces/bore": 96,
        "forces/rod": 96,
        "motion/skirt": 384,
        "frame_times": 16,
        "masters/bore": 256,
    }
    assert head_of(path).inputs == INPUTS


def test_header_is_as_documented(tmp_path: Path) -> None:
    block = written(tmp_path / "r.h5", "nodal", nodal()).read_bytes()[:512]
    magic, digest, kind, padding = block.split(b"\n")
    assert (magic, len(digest), kind, padding.strip(b"\0")) == (b"GUDGEON-RECORD 1", 64, b"nodal", b"")
    with h5py.File(tmp_path / "r.h5", "r") as file:
        assert file.userblock_size == 512
        assert file.attrs["encoding-type"] == "gudgeon-nodal"
        assert file.attrs["encoding-version"] == SCHEMA_VERSION
        assert json.loads(file.attrs["provenance"]) == INPUTS


def test_verify_tells_the_kind(tmp_path: Path) -> None:
    assert verify_record(written(tmp_path / "r.h5", "morph", morph())) == "morph"


def test_every_flipped_byte_is_noticed(tmp_path: Path) -> None:
    path, missed = written(tmp_path / "flipped.h5", "nodal", nodal()), []
    sound = path.read_bytes()
    with path.open("r+b", buffering=0) as file:
        for offset, byte in enumerate(sound):
            os.pwrite(file.fileno(), bytes([byte ^ 1]), offset)
            with contextlib.suppress(RecordDamaged):
                verify_open(file.fileno(), path)
                missed.append(offset)
            os.pwrite(file.fileno(), bytes([byte]), offset)
        verify_open(file.fileno(), path)
    assert missed == [], f"{len(missed)} of {len(sound)} bytes can change unnoticed, the first at {missed[:1]}"


@pytest.mark.parametrize(
    "cut",
    [lambda n: 0, lambda n: 10, lambda n: 511, lambda n: 512, lambda n: n // 2, lambda n: n - 1],
    ids=["empty", "magic", "header", "no data", "half", "last byte"],
)
def test_every_cut_is_noticed(cut: Callable[[int], int], tmp_path: Path) -> None:
    path = written(tmp_path / "r.h5", "mesh", mesh())
    sound = path.read_bytes()
    path.write_bytes(sound[: cut(len(sound))])
    with pytest.raises(RecordDamaged, match=r"r\.h5"):
        verify_record(path)


def test_bytes_added_at_the_end_are_noticed(tmp_path: Path) -> None:
    path = written(tmp_path / "r.h5", "mesh", mesh())
    path.write_bytes(path.read_bytes() + b"\0")
    with pytest.raises(RecordDamaged):
        verify_record(path)


@pytest.mark.parametrize("content", [b"hello", b"\x89HDF\r\n\x1a\n" + b"\0" * 1000, b"\0" * 600])
def test_foreign_files_are_no_records(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "r.h5").write_bytes(content)
    with pytest.raises(RecordDamaged, match="not a gudgeon record"):
        verify_record(tmp_path / "r.h5")


def test_wrong_kind_is_named(tmp_path: Path) -> None:
    path = written(tmp_path / "r.h5", "morph", morph())
    with pytest.raises(RecordMismatch, match=r"r\.h5: holds gudgeon-morph, expected gudgeon-mesh"):
        hdf5.read_record(path, "mesh")


@pytest.mark.parametrize("version", [SCHEMA_VERSION - 1, SCHEMA_VERSION + 1])
def test_another_schema_is_named(version: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(hdf5, "SCHEMA_VERSION", version)
        path = written(tmp_path / "r.h5", "mesh", mesh())
    verify_record(path)
    message = rf"r\.h5: schema version {version}, this release reads {SCHEMA_VERSION}$"
    with pytest.raises(RecordMismatch, match=message):
        hdf5.read_record(path, "mesh")


def test_equal_records_are_equal_files(tmp_path: Path) -> None:
    """No time of writing inside: the same record has the same bytes."""
    one, other = (written(tmp_path / name, "modes", modes()) for name in ("a.h5", "b.h5"))
    assert one.read_bytes() == other.read_bytes()


@pytest.mark.parametrize("kind", KINDS)
def test_every_array_tells_unit_and_name(kind: str, tmp_path: Path) -> None:
    """To programs that know HDF5 only; the names of columns are as many as the columns, unless old files have fewer."""
    seen = []

    def look(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset):
            return
        seen.append(name)
        assert set(item.attrs) <= {"units", "long_name", "columns"}
        assert item.attrs["units"]
        assert len(item.attrs["long_name"]) > 3
        if "columns" in item.attrs:
            assert len(item.attrs["columns"].split(", ")) == item.shape[-1], name

    with h5py.File(written(tmp_path / "r.h5", kind, SAMPLES[kind]())) as file:
        file.visititems(look)
    assert bool(seen) == (kind not in WITHOUT_ARRAYS)


@pytest.mark.parametrize(("name", "value"), [("colour", "red"), ("units", 3), ("units", np.zeros(2))])
def test_other_attributes_of_arrays_are_refused(name: str, value: Any, tmp_path: Path) -> None:
    path = written(tmp_path / "r.h5", "mesh", mesh())
    with h5py.File(path, "r+", libver=("v110", "v110")) as file:
        file["nodes"].attrs[name] = value
    with pytest.raises(RecordMismatch, match="nodes"):
        head_of(path)
