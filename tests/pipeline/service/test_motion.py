"""Stress of modes and films of runs for the page, against what pictures and ParaView files take them from."""

import base64
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gudgeon
from gudgeon.pipeline.gudgeon import run
from gudgeon.pipeline.interfaces.stress_recovery import hooke, strain_rows, von_mises
from gudgeon.pipeline.reduction.expansion import displacement
from gudgeon.pipeline.scenes.material import Material
from tests.pipeline.service.serving import TOKEN, served
from tests.pipeline.small import block_on_floor

pytest.importorskip("fastapi", reason="the extra 'service' is not installed")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    """A database with a run of an elastic block, and the keys of its records by kind."""
    folder = tmp_path_factory.mktemp("motion")
    (folder / "block.toml").write_text(block_on_floor())
    run(folder / "block.toml", until="solve", db=folder / "db", out=folder / "out")
    return folder / "db", {one.kind: one.key for one in gudgeon.open(folder / "db").find()}


def ask(db: Path, path: str) -> tuple[int, Any]:
    import http.client
    import json

    with served(db) as url:
        server = http.client.HTTPConnection(url.removeprefix("http://"), timeout=30)
        server.request("GET", f"/default/records/{path}", headers={"Authorization": f"Bearer {TOKEN}"})
        answer = server.getresponse()
        body = answer.read()
    return answer.status, json.loads(body) if "json" in answer.getheader("content-type", "") else body


def floats(text: str, *shape: int) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), "<f4").reshape(shape)


def stress_of(store: Any, keys: dict[str, str], nodes: np.ndarray, u: np.ndarray) -> np.ndarray:
    mesh = store.get(keys["mesh"], "mesh")
    strain = (strain_rows(mesh, nodes) @ u.reshape(-1)).reshape(-1, 6)
    return von_mises(strain @ hooke(Material(E=210e9, nu=0.3, rho=7850.0)).T)


def test_a_film_is_the_displacement_of_the_run(made: tuple[Path, dict[str, str]]) -> None:
    db, keys = made
    store = gudgeon.open(db)
    found = store.get(keys["trajectory"], "trajectory")
    morph, modal, mesh = (store.get(keys[kind], kind) for kind in ("morph", "modes", "mesh"))
    status, film = ask(db, f"{keys['trajectory']}/film/block?colour=stress")
    assert status == 200
    points = floats(film["points"], -1, 3)
    count, frames = len(points), len(film["times"])
    assert frames == len(found.frames)
    nodes = np.array([int(np.argmin(np.linalg.norm(mesh.nodes - one, axis=1))) for one in points])
    moved, sizes = floats(film["moved"], frames, count, 3), floats(film["sizes"], frames, count)
    frame = frames // 2
    whole = displacement(mesh.nodes, morph, modal, found.frames[frame])
    twist = np.array(film["twists"][frame])
    rigid = twist[:3] + np.cross(twist[3:], mesh.nodes - film["centre"])
    assert moved[frame] + rigid[nodes] == pytest.approx(whole[nodes], rel=1e-5, abs=1e-12)
    assert sizes[frame] == pytest.approx(stress_of(store, keys, nodes, whole - rigid), rel=1e-4, abs=1.0)
    assert film["largest"] == pytest.approx(sizes.max())


def test_the_stress_of_a_mode(made: tuple[Path, dict[str, str]]) -> None:
    db, keys = made
    store = gudgeon.open(db)
    status, body = ask(db, f"{keys['modes']}/skin/2/stress")
    assert status == 200
    values = np.frombuffer(body, "<f4")
    points = floats(ask(db, f"{keys['modes']}/skin")[1]["points"], -1, 3)
    mesh, modal = (store.get(keys[kind], kind) for kind in ("mesh", "modes"))
    nodes = np.array([int(np.argmin(np.linalg.norm(mesh.nodes - one, axis=1))) for one in points])
    expected = stress_of(store, keys, nodes, modal.shapes[:, :, 2])
    assert values == pytest.approx(expected / expected.max(), abs=1e-5)
    assert values.max() == 1.0


@pytest.mark.parametrize(
    ("path", "status"),
    [("trajectory/film/nobody", 404), ("trajectory/film/block?colour=red", 422), ("modes/film/block", 409),
     ("modes/skin/99/stress", 422), ("mesh/skin/0/stress", 404)],
)  # fmt: skip
def test_what_is_not_there(made: tuple[Path, dict[str, str]], path: str, status: int) -> None:
    db, keys = made
    kind, _, rest = path.partition("/")
    assert ask(db, f"{keys[kind]}/{rest}")[0] == status
