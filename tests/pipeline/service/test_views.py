"""What the page is made of: skins, shapes, graphs and matrices, and the files that it loads."""

import base64
import io
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("fastapi", reason="the extra 'service' is not installed")

from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.report import ReportRecord
from gudgeon.modaldb.stores.folder import FolderStore, open_folder
from gudgeon.pipeline.geometry.cells import FLAT_TRIANGLES
from gudgeon.pipeline.gudgeon import run
from gudgeon.pipeline.service import skin, views
from gudgeon.pipeline.service.arrays import Wrong
from tests.modaldb.samples import mesh, modes
from tests.pipeline.service.serving import served
from tests.pipeline.service.test_service import Client, line_of
from tests.pipeline.small import write_scene

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], float)
SIDES = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]


def two_tets() -> MeshRecord:
    """Return two tet10 elements with a common face."""
    nodes, numbers, cells = [*CORNERS], dict[tuple[int, int], int](), []
    for corners in ([0, 1, 2, 3], [4, 2, 1, 3]):
        cell = [*corners]
        for a, b in SIDES:
            side = tuple(sorted((corners[a], corners[b])))
            if side not in numbers:
                numbers[side] = len(nodes)
                nodes.append(0.5 * (CORNERS[side[0]] + CORNERS[side[1]]))
            cell.append(numbers[side])
        cells.append(cell)
    return MeshRecord(np.array(nodes), np.array(cells), "tetra10", {})


def test_the_skin_of_a_solid_is_closed() -> None:
    """Six faces of four triangles, each side of which belongs to two; the common face is inside."""
    record = two_tets()
    found = skin.skin_of(record)
    assert len(found.triangles) == 4 * 6
    sides = Counter(frozenset(side) for t in found.triangles.tolist() for side in zip(t, t[1:] + t[:1], strict=True))
    assert set(sides.values()) == {2}
    points = record.nodes[found.nodes]
    normals = np.cross(*(points[found.triangles[:, n]] - points[found.triangles[:, 0]] for n in (1, 2)))
    # Gauss: of outward normals, a third of ∮ x · n dA is the volume of both.
    volume = (points[found.triangles].mean(axis=1) * normals).sum() / 6
    a, b = (np.abs(np.linalg.det(CORNERS[c[1:]] - CORNERS[c[0]])) / 6 for c in ([0, 1, 2, 3], [4, 2, 1, 3]))
    assert volume == pytest.approx(a + b)


def test_meshes_without_a_skin() -> None:
    with pytest.raises(Wrong, match="a mesh of line3 has no surface"):
        skin.skin_of(MeshRecord(np.zeros((3, 3)), np.array([[0, 2, 1]]), "line3", {}))


def test_a_plane_part_is_drawn_as_it_is() -> None:
    nodes = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 0, 0], [0.5, 0.5, 0], [0, 0.5, 0]], float)
    found = skin.skin_of(MeshRecord(nodes, np.arange(6).reshape(1, 6), "triangle6", {}))
    assert np.array_equal(found.triangles, FLAT_TRIANGLES)


def test_too_many_triangles(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(skin, "MOST", 23)
    with pytest.raises(Wrong, match="24 triangles are more than 23"):
        skin.skin_of(two_tets())


def put(store: FolderStore) -> tuple[str, str]:
    """Put the two elements and modes of them; return their keys."""
    record, made = two_tets(), {"stage": "mesh"}
    store.put(content_key(made), "mesh", record, made)
    shapes = np.random.default_rng(3).normal(size=(len(record.nodes), 3, 3))
    inputs = {"stage": "modes", "mesh": content_key(made)}
    modal = replace(modes(), mesh_key=content_key(made), shapes=shapes, static_responses=None)
    store.put(content_key(inputs), "modes", modal, inputs)
    return content_key(made), content_key(inputs)


def test_skin_and_shapes_are_sent(tmp_path: Path) -> None:
    with served(tmp_path / "db") as url:
        client, store = Client(url), open_folder(tmp_path / "db")
        first, second = put(store)
        found = client.json(f"/default/records/{second}/skin")
        assert found == client.json(f"/default/records/{first}/skin")
        nodes = skin.skin_of(two_tets()).nodes
        points = np.frombuffer(base64.b64decode(found["points"]), "<f4").reshape(-1, 3)
        assert np.array_equal(points, two_tets().nodes[nodes].astype("<f4"))
        status, _, body = client.get(f"/default/records/{second}/skin/1")
        shape = np.frombuffer(body, "<f4").reshape(-1, 3)
        expected = store.get(second, "modes").shapes[nodes, :, 1]
        expected = expected / np.sqrt((expected**2).sum(axis=1).max())
        assert status == 200
        assert shape == pytest.approx(expected, rel=1e-6)
        line_of(client.get(f"/default/records/{second}/skin/3"), 422, "QueryWrong")
        line_of(client.get(f"/default/records/{first}/skin/0"), 404, "RecordMissing")


def test_a_record_without_a_mesh(tmp_path: Path) -> None:
    with served(tmp_path / "db") as url:
        store = open_folder(tmp_path / "db")
        store.put(key := content_key({"n": 1}), "report", _report(), {"n": 1})
        assert "has no mesh" in line_of(Client(url).get(f"/default/records/{key}/skin"), 422, "QueryWrong")


def _report() -> object:
    from tests.modaldb.samples import report

    return report()


def test_the_graph_leads_from_mesh_to_run(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "skirt")
    report = run(scene, db=tmp_path / "db", out=tmp_path / "out", until="solve")
    keys = {name: report.stages[name].key for name in ("mesh", "modes", "morph", "solve")}
    open_folder(tmp_path / "db").put(other := content_key({"n": 1}), "mesh", mesh(), {"n": 1})
    with served(tmp_path / "db") as url:
        for name in keys:
            found = Client(url).json(f"/default/records/{keys[name]}/graph")
            assert {row["key"] for row in found["records"]} == set(keys.values())
            assert found["left_out"] == 0
            chain = [[keys["mesh"], keys["modes"]], [keys["modes"], keys["morph"]], [keys["morph"], keys["solve"]]]
            assert all(edge in found["edges"] for edge in chain)
        alone = Client(url).json(f"/default/records/{other}/graph")
        assert ([row["key"] for row in alone["records"]], alone["edges"]) == ([other], [])


def test_mac(tmp_path: Path) -> None:
    with served(tmp_path / "db") as url:
        _, key = put(open_folder(tmp_path / "db"))
        found = Client(url).json(f"/default/records/{key}/mac/{key}")
        basis = open_folder(tmp_path / "db").get(key, "modes")
        rigid = replace(basis, normal_count=0, static_count=len(basis.angular_frequencies))
        open_folder(tmp_path / "db").put(other := content_key({"n": 2}), "modes", rigid, {"n": 2})
        line_of(Client(url).get(f"/default/records/{key}/mac/{other}"), 422, "QueryWrong")
    assert np.diag(np.array(found["mac"])) == pytest.approx([1.0, 1.0])


@pytest.mark.parametrize(
    "change", [{"runs": 1}, {"runs": [1]}, {"runs": {"a": 1}}, {"runs": ["a"]}, {"choice": "a"}, {"choice": [1]}]
)
def test_a_report_of_another_form(change: dict[str, Any], tmp_path: Path) -> None:
    inputs = {"stage": "report"}
    with served(tmp_path / "db") as url:
        record = ReportRecord({"runs": [], "choice": {}} | change)
        open_folder(tmp_path / "db").put(key := content_key(inputs), "report", record, inputs)
        line_of(Client(url).get(f"/default/records/{key}/report"), 422, "QueryWrong")


def test_numbers_of_a_report_that_are_none(tmp_path: Path) -> None:
    inputs, row = {"stage": "report"}, {"name": "a", "cpu_seconds": float("inf"), "conservative_error": float("nan")}
    with served(tmp_path / "db") as url:
        record = ReportRecord({"runs": [row], "choice": {"run": [float("-inf"), 2.5]}, "scene": {"a": float("nan")}})
        open_folder(tmp_path / "db").put(key := content_key(inputs), "report", record, inputs)
        body = Client(url).json(f"/default/records/{key}/report")
    assert body["rows"] == [{"name": "a", "seconds": None, "note": "", "error": None}]
    assert (body["choice"], body["scene"]) == ([None, 2.5], {"a": None})


def test_no_other_site_frames_an_answer(tmp_path: Path) -> None:
    with served(tmp_path / "db") as url:
        for path in ("/page/", "/health", "/default/keys", "/nothing"):
            _, headers, _ = Client(url).get(path)
            assert (headers["x-frame-options"], headers["x-content-type-options"]) == ("DENY", "nosniff")
    assert "frame-ancestors 'none'" in views.POLICY


def test_the_page_loads_nothing_from_elsewhere() -> None:
    """Its policy forbids it, and its own files name no other place."""
    assert "default-src 'none'" in views.POLICY
    assert "unsafe" not in views.POLICY
    for name in ("index.html", "page.js", "view.js", "charts.js", "study-view.js", "tree.js", "page.css"):
        text = (views.PAGE / name).read_text()
        assert re.findall(r"https?://(?!www\.w3\.org/2000/svg)", text) == []
        assert " style=" not in text.partition("<body>")[2]


def test_the_page_is_served_and_nothing_beside_it(tmp_path: Path) -> None:
    with served(tmp_path / "db") as url:
        client = Client(url)
        status, headers, _ = client.get("/", Authorization="")
        assert (status, headers["location"]) == (307, "page/")
        for name in ("", *(path.relative_to(views.PAGE).as_posix() for path in views.PAGE.rglob("*.*"))):
            status, headers, body = client.get(f"/page/{name}", Authorization="")
            assert (status, headers["content-security-policy"]) == (200, views.POLICY)
            assert body == (views.PAGE / (name or "index.html")).read_bytes()
            unchanged = client.get(f"/page/{name}", Authorization="", If_None_Match=headers["etag"])
            assert (unchanged[0], unchanged[2]) == (304, b"")
            assert (name in ("", "index.html")) == headers["content-type"].startswith("text/html")
        for name in ("../run.py", "..%2frun.py", "vendor", "nothing.js"):
            assert client.get(f"/page/{name}", Authorization="")[0] == 404
        status, headers, _ = client.ask("POST", "/page/page.js", b"", Authorization="")
        assert (status, headers["allow"]) == (405, "GET, HEAD")


def test_numbers_of_a_page_are_those_of_numpy(tmp_path: Path) -> None:
    """float32 and uint32, little-endian, as typed arrays of a browser read them."""
    assert base64.b64decode(skin.packed(np.array([[1.5, -2.0]]), "<f4")) == bytes.fromhex("0000c03f000000c0")
    assert base64.b64decode(skin.packed(np.array([258]), "<u4")) == bytes([2, 1, 0, 0])
    assert io.BytesIO(skin.shape_bytes(np.zeros((2, 3)))).read() == bytes(24)
