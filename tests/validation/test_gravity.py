"""A held body under gravity: it starts as its weight deforms it, and stays so."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.compile import compile_system

WIDTH, HEIGHT, LENGTH, DENSITY, G = 0.02, 0.03, 0.2, 7850.0, 9.81
SCENE = f"""
[component.arm]
geometry = {{ kind = "box", lx = {LENGTH}, ly = {WIDTH}, lz = {HEIGHT} }}
material = {{ E = 210e9, nu = 0.3, rho = {DENSITY} }}
mesh = {{ size = 0.01 }}
supports = ["left"]
modes = {{ reduction = "macneal", normal_count = 40 }}
gauge.middle = {{ point = [0.0, 0.0, {HEIGHT}] }}

[body.arm]
gauges = ["middle"]

[run]
duration = 1e-3
gravity = [0.0, 0.0, -{G}]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("gravity")


def solved(folder: Path, text: str = SCENE) -> tuple[np.ndarray, object]:
    (folder / "scene.toml").write_text(text)
    job = open_job(folder / "scene.toml", db=folder / "db", out=folder / "out")
    run_job(job, "morph")
    keys = {name: steps["morph"].key for name, steps in job.components().items()}
    system = compile_system(job.store, job.scene, keys)
    shapes = job.store.get(job.components()["arm"]["modes"].key, "modes").shapes
    return shapes @ system.position[-shapes.shape[2] :], simulate(system)


def test_a_cantilever_hangs_by_its_weight(folder: Path) -> None:
    """Bernoulli-Euler: q L⁴ / 8 E I at the tip; the box is 1 % softer by shear and stiffer by its clamp."""
    displacement, trajectory = solved(folder)
    weight, moment = DENSITY * G * WIDTH * HEIGHT, WIDTH * HEIGHT**3 / 12
    assert displacement[:, 2].min() == pytest.approx(-weight * LENGTH**4 / (8 * 210e9 * moment), rel=0.03)
    # Bending in the middle of the upper side, over all of the run.
    stress = weight * (LENGTH / 2) ** 2 / 2 * (HEIGHT / 2) / moment
    readings = trajectory.gauges["arm.middle"]  # type: ignore[attr-defined]
    np.testing.assert_allclose(readings[:, 0], stress, rtol=0.05)
    assert trajectory.energy_drift < 1e-9  # type: ignore[attr-defined]


def test_gravity_along_what_a_support_leaves_loads_no_mode(folder: Path) -> None:
    """Held in z alone, the box falls along x without deforming."""
    text = SCENE.replace('["left"]', '[{ surface = "left", hold = ["z"] }]').replace(
        f"[0.0, 0.0, -{G}]", f"[-{G}, 0.0, 0.0]"
    )
    displacement, _ = solved(folder, text)
    assert np.abs(displacement).max() < 1e-15


SLENDER = """
[component.arm]
geometry = {{kind="beam", theory="euler-bernoulli", length=1.0, section={{kind="rectangle", width=0.02, height=0.01}}}}
material = {{ E = 210e9, nu = 0.3, rho = 7850.0 }}
mesh = {{ size = 0.05 }}
supports = ["left"]
interface.tip = {{ surface = "right", kind = "mean" }}
modes = {{ reduction = "{reduction}", normal_count = 3 }}

[body.arm]
{orientation}

[probe.sag]
kind = "displacement"
body = "arm"
interface = "tip"

[run]
duration = 0.02
step = 1e-5
gravity = {gravity}
"""


@pytest.mark.parametrize("reduction", ["macneal", "normal+static"])
@pytest.mark.parametrize("turn", [0.0, 30.0])
def test_three_modes_and_the_static_shape_of_gravity_sag_exactly(reduction: str, turn: float, tmp_path: Path) -> None:
    """Bernoulli-Euler, q L⁴ / 8 E I, with gravity across a beam that is turned; it stays so."""
    orientation = f"orientation = {{ axis = [0, 1, 0], angle = {turn} }}"
    down = np.array([np.sin(np.radians(turn)), 0.0, np.cos(np.radians(turn))])
    text = SLENDER.format(reduction=reduction, orientation=orientation, gravity=(-G * down).tolist())
    (tmp_path / "scene.toml").write_text(text)
    job = open_job(tmp_path / "scene.toml", db=tmp_path / "db", out=tmp_path / "out")
    run_job(job, "morph")
    system = compile_system(job.store, job.scene, {n: s["morph"].key for n, s in job.components().items()})
    tip = reduction == "normal+static"  # It keeps the static shapes of loads and means: the row that the probe reads.
    assert len(system.position) == 4 + tip, "three modes and the static shape"
    found = simulate(system).probes["sag"].values
    sag = DENSITY * G * 0.01 * 0.02 / (8 * 210e9 * 0.02 * 0.01**3 / 12)
    np.testing.assert_allclose(found @ down, -sag, rtol=1e-6)


@pytest.mark.parametrize(("change", "extra"), [("", 1), ("gravity", 0), ("supports", 0), ("modes", 0)])
def test_static_shapes_of_gravity_are_made_where_it_deforms_a_body(change: str, extra: int, tmp_path: Path) -> None:
    """Neither without gravity nor of a free body nor beside 20 modes; gravity of another size finds the same modes."""
    text = SLENDER.format(reduction="macneal", orientation="", gravity=[0.0, 0.0, 0.0 if change == "gravity" else -G])
    text = text.replace('supports = ["left"]\n', "") if change == "supports" else text
    count = 20 if change == "modes" else 3
    text = text.replace("normal_count = 3", f"normal_count = {count}")
    (tmp_path / "scene.toml").write_text(text)
    job = open_job(tmp_path / "scene.toml", db=tmp_path / "db", out=tmp_path / "out")
    key = job.components()["arm"]["modes"].key
    run_job(job, "morph")
    assert len(job.store.get(key, "modes").angular_frequencies) == count + extra
    (tmp_path / "scene.toml").write_text(text.replace(str(-G), str(-2 * G)))
    assert open_job(tmp_path / "scene.toml", db=tmp_path / "db").components()["arm"]["modes"].key == key
