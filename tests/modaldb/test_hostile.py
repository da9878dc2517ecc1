"""Files made to harm, sealed with a right digest: each gives one line that names the file and what is wrong."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from gudgeon import modaldb
from gudgeon.modaldb.errors import RecordMismatch, StoreUnusable
from gudgeon.modaldb.format import blocks, contents, hdf5
from gudgeon.modaldb.format.source import FileSource
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.records import KINDS
from gudgeon.modaldb.stores.folder import FolderStore
from gudgeon.pipeline.geometry.cells import CELLS, FACETS, MIXED
from tests.fuzz.records import sealed
from tests.modaldb.samples import INPUTS, SAMPLES, mesh, modes, write_record

KEY = content_key(INPUTS)
Change = Callable[[Any], Any]


def replaced(name: str, make: Callable[[Any, str], Any]) -> Change:
    """Return a change that puts something else under the name of an array."""

    def change(file: Any) -> None:
        del file[name]
        make(file, name)

    return change


def numbers(name: str, place: Any, value: float) -> Change:
    """Return a change of one number of an array."""

    def change(file: Any) -> None:
        array = file[name][()]
        array[place] = value
        file[name][...] = array

    return change


def attribute(group: str, name: str, value: Any) -> Change:
    return lambda file: file[group].attrs.__setitem__(name, value)


RUBBED = '{"bore": [47, 79], "thrust": %s}'
"""Tangential spans of the sample, but for that of its points."""


def spans(text: str) -> Change:
    return attribute("/", "tangential_spans", text)


def virtual(file: Any, name: str) -> None:
    layout = h5py.VirtualLayout((3,), "<f8")
    layout[...] = h5py.VirtualSource(".", name, (3,))
    file.create_virtual_dataset(name, layout)


HARM: dict[str, tuple[Change, str]] = {
    "external link": (replaced("centre", lambda f, n: f.__setitem__(n, h5py.ExternalLink("/etc/passwd", "/"))),
                      "a soft or external link"),
    "soft link": (replaced("centre", lambda f, n: f.__setitem__(n, h5py.SoftLink("/inertia"))), "a soft or external"),
    "another file's bytes": (
        replaced("centre", lambda f, n: f.create_dataset(n, (3,), "<f8", external=[("/etc/passwd", 0, 24)])),
        "centre: external storage"),
    "an array that maps itself": (replaced("centre", virtual), "not contiguous"),
    "a filter": (replaced("centre", lambda f, n: f.create_dataset(n, (3,), float, compression="gzip")), "a filter"),
    "chunks": (replaced("centre", lambda f, n: f.create_dataset(n, data=np.zeros(3), chunks=(2,))), "not contiguous"),
    "references": (replaced("centre", lambda f, n: f.create_dataset(n, data=[f.ref] * 3, dtype=h5py.ref_dtype)),
                   "centre: numbers of another type"),
    "big-endian": (replaced("centre", lambda f, n: f.create_dataset(n, data=np.zeros(3, ">f8"))), "another type"),
    "strings": (replaced("centre", lambda f, n: f.create_dataset(n, data=[b"a", b"b", b"c"])), "another type"),
    "integers for floats": (replaced("centre", lambda f, n: f.create_dataset(n, data=np.zeros(3, int))),
                            "centre: numbers of type <i8, expected float"),
    "a shape": (replaced("centre", lambda f, n: f.create_dataset(n, data=np.zeros(4))),
                r"centre: shape \(4,\), expected \(3\)"),
    "a rank": (replaced("shapes", lambda f, n: f.create_dataset(n, data=np.zeros((10, 9)))), "shapes: shape"),
    "two counts of modes": (
        replaced("participation", lambda f, n: f.create_dataset(n, data=np.zeros((3, 4)))),
        r"participation: shape \(3, 4\), expected \(3, m\) with m = 3"),
    "more than the file has": (replaced("centre", lambda f, n: f.create_dataset(n, (2**40, 3), "<f8")), "centre: "),
    "a loop": (replaced("centre", lambda f, n: f.__setitem__(n, f["/"])), "two references to one block"),
    "an array twice": (replaced("centre", lambda f, n: f.__setitem__(n, f["gauges/crown/rows"])), "two references"),
    "a group": (replaced("centre", lambda f, n: f.create_group(n)), "centre: expected an array"),
    "a missing array": (lambda f: f.__delitem__("centre"), "centre: missing"),
    "a missing number": (lambda f: f.attrs.__delitem__("mass"), "mass: missing"),
    "a field too many": (lambda f: f.create_dataset("more", data=np.zeros(3)), "more: no field of such a record"),
    "not a number": (numbers("shapes", (0, 0, 0), np.nan), "shapes: not a number, infinite"),
    "a number that overflows": (numbers("shapes", (0, 0, 0), 1e200), "shapes: not a number, infinite, or so large"),
    "infinite": (numbers("residual_flexibility", (0, 0), np.inf), "residual_flexibility: not a number"),
    "a node that is not there": (numbers("interfaces/thrust/nodes", 0, 99), r"nodes: numbers 5 to 99, expected 0 to 9"),
    "a negative node": (numbers("interfaces/thrust/nodes", 0, -1), "nodes: numbers -1 to 5"),
    "a negative mass": (attribute("/", "mass", -1.0), "mass: -1.0, expected more than 0"),
    "a text for a number": (attribute("/", "mass", "heavy"), "mass: str, expected float"),
    "an array for a number": (attribute("/", "mass", np.zeros(3)), "mass: neither a number nor a text"),
    "rows beyond R": (attribute("/", "interface_rows", '{"thrust": [42, 44]}'), "interface_rows: "),
    "rows of another interface": (
        attribute("/", "interface_rows", str(modes().interface_rows | {"thrust": [0, 5]}).replace("'", '"')),
        r"interface_rows: thrust: \[0, 5\], which are not its rows"),
    "tangents alone": (lambda f: f.__delitem__("interfaces/thrust/tangential_rows"),
                       "interfaces/thrust: tangents and tangential_rows, only one of them is there"),
    "tangential rows alone": (lambda f: f.__delitem__("interfaces/thrust/tangents"),
                              "interfaces/thrust: tangents and tangential_rows, only one of them is there"),
    "one tangent": (replaced("interfaces/thrust/tangents", lambda f, n: f.create_dataset(n, data=np.zeros((2, 1, 3)))),
                    r"interfaces/thrust/tangents: shape \(2, 1, 3\), expected \(c', 2, 3\)"),
    "tangential rows of more points": (
        replaced("interfaces/thrust/tangential_rows", lambda f, n: f.create_dataset(n, data=np.zeros((3, 2, 3)))),
        "interfaces/thrust/tangential_rows: shape"),
    "tangential rows of more modes": (
        replaced("interfaces/thrust/tangential_rows", lambda f, n: f.create_dataset(n, data=np.zeros((2, 2, 4)))),
        "interfaces/thrust/tangential_rows: shape"),
    "a tangent that is not a number": (numbers("interfaces/thrust/tangents", (0, 0, 0), np.nan),
                                       "interfaces/thrust/tangents: not a number"),
    "tangential rows of nobody": (spans('{"thrust": [43, 47], "anti": [41, 43]}'),
                                  "tangential_spans: 'anti' has no tangential rows"),
    "tangential rows that R lacks": (spans('{"bore": [47, 79]}'), "tangential_spans: 'thrust' is missing"),
    "tractions across without rows": (lambda f: f.__delitem__("tractions/bore/tangential_rows"),
                                      "tractions/bore: tangential_resultant and tangential_rows, only one of them"),
    "tractions across that R lacks": (spans('{"thrust": [43, 47]}'), "tangential_spans: 'bore' is missing"),
    "tangential rows beyond R": (spans(RUBBED % "[77, 81]"), r"tangential_spans: thrust: \[77, 81\]"),
    "too few tangential rows": (spans(RUBBED % "[43, 45]"), "tangential_spans: thrust: .* not its rows"),
    "tangential rows on normal ones": (spans(RUBBED % "[39, 43]"), "tangential_spans: thrust: .* other rows"),
    "tangential spans that are none": (spans(RUBBED % "43"), "tangential_spans: thrust: expected"),
    "a basis that is not there": (numbers("swap/number", 2, 3), "swap/number: 0 to 3, expected 0 to 2"),
    "bases of no traction space": (attribute("swap", "interface", "anti"), "swap: interface 'anti' is no traction"),
    "JSON that is none": (attribute("/", "quality", "{"), "quality: no JSON object"),
    "JSON without end": (attribute("/", "quality", "[" * 100_000), "quality: no JSON object"),
    "provenance of another": (attribute("/", "provenance", '{"a":1}'), "holds the record of another key"),
    "provenance without a number": (attribute("/", "provenance", '{"a":NaN}'), "provenance: no JSON object"),
    "splines": (numbers("tractions/bore/counts", 0, 400), "tractions/bore/counts: "),
    "a chart": (attribute("tractions/bore", "chart", '{"kind": "cylinder"}'), "tractions/bore/chart: axis"),
    "deep groups": (lambda f: f.create_group("a/b/c/d/e/f"), "groups deeper than 4"),
}  # fmt: skip


@pytest.fixture
def store(tmp_path: Path) -> FolderStore:
    return modaldb.open(tmp_path / "db")


def put_changed(store: FolderStore, kind: str, change: Change) -> Path:
    """Put a sample, change its file and seal it again."""
    store.put(KEY, kind, SAMPLES[kind](), INPUTS)
    path = store.path(KEY)
    with h5py.File(path, "r+", libver=("v110", "v110")) as file:
        change(file)
    path.write_bytes(sealed(path.read_bytes()[blocks.USERBLOCK :], kind))
    return path


@pytest.mark.parametrize("harm", HARM)
def test_harm_is_one_line(harm: str, store: FolderStore) -> None:
    change, cause = HARM[harm]
    path = put_changed(store, "modes", change)
    with pytest.raises(RecordMismatch, match=cause) as caught:
        modaldb.open(store.root).get(KEY, "modes")
    assert str(caught.value).startswith(f"{path}: ")
    assert str(caught.value).isprintable()


IN_NUMBERS = {"not a number", "infinite", "a number that overflows", "a node that is not there", "a negative node",
              "a negative mass", "rows beyond R", "rows of another interface", "JSON that is none", "JSON without end",
              "splines", "a chart", "tangents alone", "tangential rows alone", "a tangent that is not a number",
              "tangential rows of nobody", "tangential rows that R lacks", "tangential rows beyond R",
              "too few tangential rows", "tangential rows on normal ones",
              "tangential spans that are none", "tractions across without rows",
              "tractions across that R lacks", "a basis that is not there", "bases of no traction space"}  # fmt: skip
"""What stands in the values and not in the structure."""


@pytest.mark.parametrize("harm", sorted(HARM.keys() - IN_NUMBERS))
def test_harm_is_found_before_any_array_is_read(harm: str, store: FolderStore, monkeypatch: pytest.MonkeyPatch) -> None:
    """The structure is checked first, by sizes and provenance as well."""
    put_changed(store, "modes", HARM[harm][0])
    monkeypatch.setattr(hdf5, "read_array", lambda *arguments: pytest.fail("an array was read"))
    fresh = modaldb.open(store.root)
    for use in (fresh.sizes, fresh.provenance):
        with pytest.raises(RecordMismatch):
            use(KEY)


@pytest.mark.parametrize("harm", sorted(HARM))
def test_export_of_harm(harm: str, store: FolderStore, tmp_path: Path) -> None:
    """What has another structure leaves no file; other numbers are carried as they are and refused by who reads."""
    place, target = put_changed(store, "modes", HARM[harm][0]), tmp_path / "exported.h5"
    try:
        modaldb.open(store.root).export(KEY, target)
    except RecordMismatch:
        assert not target.exists()
        return
    assert harm in IN_NUMBERS
    assert target.read_bytes() == place.read_bytes()


@pytest.mark.parametrize("thickness", ['"thin"', "0.0", "-1.0", "NaN", "Infinity", "true", "[1.0]"])
def test_a_thickness_that_is_none(thickness: str, store: FolderStore) -> None:
    put_changed(store, "mesh", attribute("surfaces/skirt", "shape", f'{{"thickness": {thickness}}}'))
    with pytest.raises(RecordMismatch, match="surfaces/skirt/shape: thickness"):
        modaldb.open(store.root).get(KEY, "mesh")


@pytest.mark.parametrize(
    ("cell_type", "cells", "cause"),
    [("tetra", mesh().cells, "cells: 10 nodes each, those of tetra have 4"),
     ("line3", mesh().cells, "those of line3 have 3"),
     ("vertex", mesh().cells, "those of vertex have 1"), ("hexahedron", mesh().cells, "those of hexahedron have 8"),
     ("mixed", np.minimum(np.arange(10), 8)[None], "cells: one of 9 nodes, expected 4, 5, 6, 8, 10")],
)  # fmt: skip
def test_cells_of_another_width_than_their_type(
    cell_type: str, cells: np.ndarray, cause: str, store: FolderStore
) -> None:
    def change(file: Any) -> None:
        attribute("/", "cell_type", cell_type)(file)
        replaced("cells", lambda f, n: f.create_dataset(n, data=cells))(file)

    put_changed(store, "mesh", change)
    with pytest.raises(RecordMismatch, match=cause):
        modaldb.open(store.root).get(KEY, "mesh")


def test_widths_are_those_of_the_cells() -> None:
    assert {name: cell.nodes for name, cell in CELLS.items() if cell.solid and cell is not MIXED} == contents.SOLIDS
    assert all(CELLS[name].nodes == width for name, width in contents.OTHERS.items())
    assert set(contents.FACETS) == {1, *FACETS}


def test_facets_that_are_none(store: FolderStore) -> None:
    put_changed(store, "mesh", replaced("surfaces/skirt/facets", lambda f, n: f.create_dataset(n, data=[[0, 1]])))
    with pytest.raises(RecordMismatch, match="surfaces/skirt/facets: "):
        modaldb.open(store.root).get(KEY, "mesh")


def test_a_sealed_sample_is_read(store: FolderStore) -> None:
    """The harm above is what is refused, not the sealing."""
    put_changed(store, "modes", lambda file: None)
    assert modaldb.open(store.root).fault(KEY) is None


def test_a_pipe_is_no_record(store: FolderStore) -> None:
    path = store.path(KEY)
    path.parent.mkdir(parents=True)
    os.mkfifo(path)
    assert not store.has(KEY)


@pytest.mark.parametrize("count", [8, 9, 60, 3000])
def test_many_members(count: int, tmp_path: Path) -> None:
    """Few stand in the group itself, more in a heap with a tree."""
    names = {f"surface {number * 7919}": number for number in range(count)}
    with h5py.File(tmp_path / "r.h5", "w", userblock_size=blocks.USERBLOCK, libver=("v110", "v110")) as file:
        for name, number in names.items():
            file.create_group(name).attrs["text"] = "a" * (number % 77)
            file.attrs[name] = number
    with (tmp_path / "r.h5").open("rb") as raw:
        found = hdf5.read_structure(FileSource(raw.fileno()))
    assert list(found.members) == sorted(names)
    assert found.attributes == names
    assert {name: len(group.attributes["text"]) for name, group in found.members.items()} == {
        name: number % 77 for name, number in names.items()
    }


@pytest.mark.parametrize("kind", KINDS)
def test_structure_is_what_hdf5_finds(kind: str, tmp_path: Path) -> None:
    """Against HDF5's own library, place by place."""
    path = tmp_path / "r.h5"
    write_record(path, kind, SAMPLES[kind](), INPUTS)
    with path.open("rb") as raw:
        head = hdf5.read_head(FileSource(raw.fileno()), path)
    theirs = {}
    with h5py.File(path, "r") as file:

        def note(name: str, item: Any) -> None:
            if isinstance(item, h5py.Dataset):
                theirs[name] = (item.dtype, item.shape, item.id.get_offset() if item.size else 0)
            else:
                theirs[name] = dict(item.attrs)

        note("/", file)
        file.visititems(note)
    ours = {}

    def walk(group: Any, path: str) -> None:
        ours[path or "/"] = group.attributes
        for name, member in group.members.items():
            below = f"{path}/{name}".lstrip("/")
            if isinstance(member, hdf5.Group):
                walk(member, below)
            else:
                ours[below] = (np.dtype(member.dtype), member.shape, member.offset)

    walk(head.root, "")
    assert ours == theirs


def test_a_file_that_cannot_be_read_does_not_hide_the_others(store: FolderStore) -> None:
    store.put(KEY, "mesh", mesh(), INPUTS)
    loop = store.path("00" + "1" * 62)
    loop.parent.mkdir()
    loop.symlink_to(loop)
    faults = [fault for _, fault in store.verify()]
    assert [type(fault) for fault in faults] == [StoreUnusable, type(None)]


@pytest.mark.parametrize("change", ["remove", "set_aside"])
def test_a_file_that_cannot_be_removed(change: str, store: FolderStore, monkeypatch: pytest.MonkeyPatch) -> None:
    store.put(KEY, "mesh", mesh(), INPUTS)

    def read_only(*arguments: object) -> None:
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr("gudgeon.modaldb.stores.local.scratch.remove", read_only)
    monkeypatch.setattr("gudgeon.modaldb.stores.folder.os.replace", read_only)
    with pytest.raises(StoreUnusable, match=r"cannot be renamed or removed \(Read-only file system\)"):
        getattr(store, change)(store.place(KEY) if change == "set_aside" else KEY)
    assert store.has(KEY)
