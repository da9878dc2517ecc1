"""A contact that few points of a curved surface carry says so; flat faces and fine patches do not."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.kinds import run
from gudgeon.solver.checks.contact_points import patch_errors

SPHERE = """
component.ball.geometry = { kind = "cad", path = "cap.step", surfaces = { cap = { face = 3 } }, sizes = { cap = 1e-3 } }
component.ball.material = { E = 200e9, nu = 0.3, rho = 7800 }
component.ball.mesh.size = 0.004
component.ball.modes.normal_count = 10
component.ball.interface.shell.surface = "cap"
body.ball = { position = [0, 0, 0.010001], velocity = [0, 0, -0.2] }
contact.floor = { body = "ball", interface = "shell", against = { shape = "plane", point = [0, 0, 0], normal = [0, 0, 1] } }
run = { duration = 2e-4, window = 1e-5 }
"""  # noqa: E501
BLOCK = (
    SPHERE.replace(
        '{ kind = "cad", path = "cap.step", surfaces = { cap = { face = 3 } }, sizes = { cap = 1e-3 } }',
        '{ kind = "box", lx = 0.02, ly = 0.02, lz = 0.02 }',
    )
    .replace('"cap"', '"bottom"')
    .replace("0.010001", "1e-6")
)


def draw_ball(path: Path) -> None:
    """Write a sphere of 10 mm whose cap, up to 7 degrees from its lowest point, is a face of its own."""
    import gmsh

    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 0)
    occ = gmsh.model.occ
    ball, box = occ.addSphere(0, 0, 0, 10), occ.addBox(-20, -20, -30, 40, 40, 30 - 10 * np.cos(np.radians(7)))
    occ.fragment([(3, ball)], [(3, box)])
    occ.synchronize()
    for solid in gmsh.model.getEntities(3):
        if gmsh.model.getBoundingBox(*solid)[3] > 11:
            occ.remove([solid], recursive=True)
    occ.synchronize()
    gmsh.write(str(path))
    gmsh.finalize()


def solved(folder: Path, scene: str) -> Any:
    (folder / "scene.toml").write_text(scene)
    return run(folder / "scene.toml", db=folder / "db", out=folder / "out", until="solve")


def test_few_points_of_a_sphere_are_named(tmp_path: Path) -> None:
    draw_ball(tmp_path / "cap.step")
    found = solved(tmp_path, SPHERE)
    (note,) = [note for note in found.notes if "of a curved or tilted surface" in note]
    assert note.startswith("contact.floor: its largest force acts on ")
    assert (
        "component.ball.geometry.sizes.cap = 0.0005 or where curved, contact.floor.law.kind = 'hertz' with method"
        " 'penalty'" in note
    )
    assert found.estimates["mesh.force"] > 0.1


@pytest.mark.parametrize("tilt", [0.5, 4.0])
def test_a_tilted_face_that_presses_along_its_edge_is_named(tilt: float, tmp_path: Path) -> None:
    """A layer has the area of the row of points at the edge: the force depends on the size of the elements."""
    text = BLOCK.replace("body.ball = {", f"body.ball = {{ orientation = {{ axis = [0, 1, 0], angle = {tilt} }},")
    text = text.replace("1e-6]", f"{0.01 * np.sin(np.radians(tilt)) + 1e-6}]")
    text = text.replace('interface = "shell",', 'interface = "shell", surface_stiffness = 1e13,')
    found = solved(tmp_path, text)
    (note,) = [note for note in found.notes if "of a curved or tilted surface" in note]
    assert "component.ball.mesh.size = 0.002" in note
    assert found.estimates["mesh.force"] > 0.1


def test_a_flat_face_is_not(tmp_path: Path) -> None:
    found = solved(tmp_path, BLOCK)
    assert not [note for note in found.notes if "of a curved or tilted surface" in note]
    assert found.estimates["mesh.force"] < 0.1


def patch(
    radius: float, *, sag: float = 50.0, law: bool = False, line: bool = False, digits: int = 16, reach: float = 30.0
) -> dict[str, tuple[int, float]]:
    """Points 1 m apart on a paraboloid, of which those within a radius act, and those beyond `reach` meet nothing."""
    x = np.arange(-20.0, 21.0)
    grid = [one.ravel() for one in np.meshgrid(x, [0.0] if line else x)]
    at = np.column_stack([*grid, np.zeros(len(grid[0]))])
    size = np.hypot(at[:, 0], at[:, 1])
    at[:, 2] = size**2 / sag if np.isfinite(sag) else 0.1 * at[:, 0] / 1.3
    at = np.round(at, digits)
    gaps = np.where(size <= reach, at[:, 2], 1e3 * 40)
    contact = SimpleNamespace(
        name="one", points=at, directions=np.tile([0.0, 0.0, -1.0], (len(at), 1)), rows=slice(0, len(at)), master=None,
        edge=np.abs(at[:, :2]).max(axis=1) == 20,
    )  # fmt: skip
    forces = np.maximum(radius**2 - size**2, 0.0)
    scene = SimpleNamespace(contact={"one": SimpleNamespace(law=object() if law else None)})
    system: Any = SimpleNamespace(contacts=[contact], scene=scene, gap=gaps)
    found: Any = SimpleNamespace(contacts={"one": SimpleNamespace(peak_multipliers=np.array([0 * forces, forces]))})
    return patch_errors(system, found)


@pytest.mark.parametrize("line", [False, True])
def test_the_error_is_a_quarter_of_the_spacing_over_the_radius(line: bool) -> None:
    for radius in (5.5, 10.5):
        assert patch(radius, line=line)["one"][1] == pytest.approx(0.25 / radius, rel=0.25)
    assert patch(0.5, line=line)["one"] == (1, pytest.approx(0.25 / 0.56))
    assert patch(1.1, line=line)["one"][0] == (3 if line else 5)


def test_flat_faces_that_meet_a_smaller_one_or_have_six_digits_have_none() -> None:
    """Points beside the smaller face have the gap of what meets nothing; an inclined face is rounded in a mesh file."""
    assert not patch(2.5, sag=np.inf, reach=8.0)
    assert not patch(2.5, sag=np.inf, digits=4)
    assert patch(2.5, reach=8.0)
    assert patch(2.5, digits=4)


def test_flat_faces_and_laws_have_none() -> None:
    assert not patch(2.5, sag=np.inf)
    assert not patch(2.5, law=True)
    assert patch(2.5)
