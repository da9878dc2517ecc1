"""Two solids whose meshes do not match, face to face: the patch test, by their records."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.checks.placing import adjusted_notes, overhang_notes
from gudgeon.solver.contact.facets import Facets, paired
from gudgeon.solver.errors import SceneError
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.compile import compile_system
from gudgeon.solver.system.system import System

SCENE = """
[component.upper]
geometry = {{ kind = "box", lx = 0.03, ly = 0.03, lz = 0.02 }}
material = {{ E = 210e9, nu = 0.3, rho = 7850.0 }}
mesh = {{ size = {upper} }}
supports = [{{ surface = "top", hold = ["z"] }}]
interface.face = {{ surface = "bottom" }}
modes = {{ normal_count = 10 }}

[component.lower]
geometry = {{ kind = "box", lx = 0.03, ly = 0.03, lz = 0.02 }}
material = {{ E = 210e9, nu = 0.3, rho = 7850.0 }}
mesh = {{ size = {lower} }}
supports = [{{ surface = "bottom", hold = ["z"] }}]
interface.face = {{ surface = "top" }}
modes = {{ normal_count = 10 }}

[body.upper]
position = [0.0, 0.0, 0.02]

[body.lower]

[contact.faces]
body = "upper"
interface = "face"
against = {{ shape = "body", body = "lower", interface = "face" }}

[run]
duration = 1e-4
"""
CHANGED = {
    "position": "position = [0.0, 0.0, 0.02]",
    "shape": 'shape = "body"',
    "own": 'surface = "bottom" }',
    "interface": 'interface = "face"\nagainst',
}
STIFFNESS = 210e9 / 0.04
"""Pressure per approach of the two ends [Pa/m]."""


def compiled(folder: Path, upper: float, lower: float, **changes: str) -> tuple[Any, System]:
    """Return the scene with element sizes [m] and parts of its text changed, and its system."""
    path, text = folder / "scene.toml", SCENE.format(upper=upper, lower=lower)
    for old, new in changes.items():
        text = text.replace(CHANGED[old], new)
    path.write_text(text)
    job = open_job(path, db=folder / "db", out=folder / "out")
    run_job(job, "morph")
    return job, compile_system(job.store, job.scene, job.morphs())


@pytest.mark.parametrize(("upper", "lower"), [(0.007, 0.0095), (0.0095, 0.007)])
def test_patch_test(tmp_path: Path, upper: float, lower: float) -> None:
    """Blocks pressed together have a uniform pressure, E times the strain, to round-off."""
    job, system = compiled(tmp_path, upper, lower)
    elastic = system.stiffness > 0
    rows = system.rows.dense()[:, elastic]
    compliance = rows / system.stiffness[elastic] @ rows.T + system.residual.dense()
    assert system.gap == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.eigvalsh(compliance)[0] > 0
    forces = np.linalg.solve(compliance, np.full(len(compliance), 1e-6))
    areas = job.record("upper").interfaces["face"].areas
    # Without a layer, too, the run has pressures.
    np.testing.assert_allclose(system.contacts[0].areas, areas, rtol=1e-12)  # The faces cover each other.
    assert len(areas) != len(job.record("lower").interfaces["face"].areas)
    assert forces / areas == pytest.approx(1e-6 * STIFFNESS, rel=1e-9)
    assert forces.sum() == pytest.approx(1e-6 * STIFFNESS * 0.03**2, rel=1e-11)
    moment = np.cross(system.contacts[0].points, [0.0, 0.0, 1.0]).T @ forces
    assert moment == pytest.approx(0.0, abs=1e-9 * forces.sum() * 0.03)


@pytest.mark.parametrize(("upper", "lower"), [(0.007, 0.0095), (0.0095, 0.007)])
def test_facets_that_overhang_have_the_area_that_is_covered(tmp_path: Path, upper: float, lower: float) -> None:
    """A third of the upper face is beside the lower one: two thirds of 30 mm x 30 mm press, and a note says so."""
    _, system = compiled(tmp_path, upper, lower, position="position = [0.01, 0.0, 0.02]")
    contact = system.contacts[0]
    assert contact.other is not None
    meets = system.gap[contact.rows] < 1e-3  # Others are far.
    assert contact.other.met[1] == pytest.approx(6e-4, rel=1e-9)
    assert contact.areas[meets].sum() == pytest.approx(6e-4, rel=1e-9)
    (note,) = overhang_notes(system)
    assert note.startswith("contact.faces: facets overhang: 0.0006 m^2 of them is covered by the other face, and")
    assert overhang_notes(compiled(tmp_path, upper, lower)[1]) == []


def test_shape_surface_meets_contact_points_too(tmp_path: Path) -> None:
    gaps = [
        compiled(tmp_path, 0.0095, 0.007, shape=f'shape = "{shape}"', position="position = [0.0, 0.002, 0.0201]")[1].gap
        for shape in ("body", "surface")
    ]
    assert np.array_equal(*gaps)
    assert gaps[0].min() == pytest.approx(1e-4, rel=1e-9)


def test_interpenetration_is_refused_and_adjusted(tmp_path: Path) -> None:
    """The complaint says by how much and where; `adjust` moves the points and says so."""
    inside = "position = [0.0, 0.0, 0.0199]"
    message = (
        r"^contact\.faces: \d+ of \d+ points start inside the obstacle, the worst by 0\.0001 m at \(.*, 0\.0199\) m; "
    )
    with pytest.raises(SceneError, match=message + r".* or set contact\.faces\.adjust to true$"):
        compiled(tmp_path, 0.0095, 0.007, position=inside)
    _, system = compiled(
        tmp_path, 0.0095, 0.007, position=inside, interface='interface = "face"\nadjust = true\nagainst'
    )
    assert np.array_equal(system.gap, np.zeros(len(system.gap)))
    count = len(system.gap)
    assert adjusted_notes(system) == [
        f"contact.faces.adjust moved {count} of {count} points out of what they touch, by up to 0.0001 m"
    ]


@pytest.mark.parametrize(
    "change", [{"position": "position = [0.1, 0.0, 0.02]"}, {"own": 'surface = "top" }'}], ids=["beside", "backwards"]
)
def test_faces_that_do_not_meet_are_refused(tmp_path: Path, change: dict[str, str]) -> None:
    with pytest.raises(SceneError, match=re.escape("contact.faces.against: interface 'face' does not face 'face'")):
        compiled(tmp_path, 0.0095, 0.007, **change)


def test_flexibility_does_not_ripple_across_facets(tmp_path: Path) -> None:
    """A small face on a large one: its flexibility under a uniform pressure varies smoothly, to 0.3 %."""
    blocks = Path(__file__).resolve().parents[3] / "data/two-blocks/non-matching.toml"
    few = {f"component.{name}.modes.normal_count": 10 for name in ("hammer", "anvil")}
    job = open_job(blocks, set=few, db=tmp_path / "db", out=tmp_path / "out")
    run_job(job, "morph")
    modes = job.record("anvil")
    own, other = job.record("hammer").interfaces["face"], modes.interfaces["face"]
    here = slice(*modes.interface_rows["face"])
    assert modes.residual_flexibility is not None
    residual, shares = modes.residual_flexibility[here, here], own.areas / own.areas.sum()
    master, found = Facets.of(other.facets, other.points, other.normals), []
    places = np.linspace(-0.005, 0.005, 11)
    for place in places:
        slave = Facets.of(own.facets, own.points + np.array([place, 0.3 * place, 0.0401]), own.normals)
        load = paired(slave, master).weights.T @ shares
        found.append(load @ residual @ load)
    smooth = np.polyval(np.polyfit(places, found, 2), places)
    assert np.array(found) == pytest.approx(smooth, rel=3e-3)


def test_impacts_without_restitution_at_many_points_come_to_an_end(tmp_path: Path) -> None:
    """More points than coordinates: each impact closes one and parts another, at speeds that shrink with each."""
    blocks = Path(__file__).resolve().parents[3] / "data/two-blocks/non-matching.toml"
    changes = {
        "contact.faces.surface_stiffness": "unset", "contact.faces.method": "impact", "contact.faces.restitution": 0.0,
        "component.hammer.mesh.size": 0.012, "component.anvil.mesh.size": 0.015, "run.duration": 1.058e-4,
    }  # fmt: skip
    few = {f"component.{name}.modes.normal_count": 6 for name in ("hammer", "anvil")}
    job = open_job(blocks, set=changes | few, db=tmp_path / "db", out=tmp_path / "out")
    run_job(job, "morph")
    found = simulate(system_of(job))
    assert found.result == "FINISHED"
    assert found.energy_drift < 1e-9
    assert found.momentum_residual < 1e-12
