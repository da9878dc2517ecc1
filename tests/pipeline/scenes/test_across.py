"""Loads along which a part does not move by its kind are refused; those along which it moves are not."""

from pathlib import Path

import pytest

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job

BEAM = "kind = 'beam', length = 1.0, section = { kind = 'rectangle', width = 0.02, height = 0.01 }"
BAR = "kind = 'bar', length = 1.0, area = 1e-4"
SHEET = "kind = 'rectangle', lx = 0.2, ly = 0.02, thickness = 0.01"
TURNED = "orientation = { axis = [1, 0, 0], angle = 90 }"
FORCE = "[force.f]\nkind = 'force'\nbody = 'b'\ninterface = 'tip'\nexpression = '1'\n"
WRENCH = "[force.f]\nkind = 'wrench'\nbody = 'b'\ninterface = 'tip'\n"
EXTERNAL = "[force.f]\nkind = 'external'\nbody = 'b'\ninterface = 'tip'\n"

SCENE = """
[component.b]
geometry = {{ {geometry} }}
material = {{ E = 210e9, nu = 0.3, rho = 7850 }}
mesh.size = 0.02
supports = ["left"]
interface.tip = {{ surface = "right", kind = "{kind}"{tie} }}
[body.b]
{body}
[run]
duration = 1e-3
gravity = {gravity}
{load}
"""


def opened(folder: Path, geometry: str, *, load: str = "", gravity: str = "[0, 0, 0]", body: str = "") -> None:
    tied = "wrench" in load
    text = SCENE.format(
        geometry=geometry, load=load, gravity=gravity, body=body, kind="tie" if tied else "mean",
        tie=", tie = 'rbe3'" if tied else "",
    )  # fmt: skip
    path = folder / "scene.toml"
    path.write_text(text)
    open_job(path)


@pytest.mark.parametrize(
    ("geometry", "load", "gravity", "body", "key"),
    [
        (BEAM, "", "[0, -9.81, 0]", "", "run.gravity"),
        (BEAM, "", "[-9.81, 0, 0]", "", "run.gravity"),
        (BEAM, "", "[0, 0, -9.81]", TURNED, "run.gravity"),
        (BEAM, FORCE + "direction = [0, 1, 1]", "[0, 0, 0]", "", "force.f.direction"),
        (BEAM, EXTERNAL + "direction = [1, 0, 0]", "[0, 0, 0]", "", "force.f.direction"),
        (BEAM, WRENCH + "moment = [0, 0, 1]", "[0, 0, 0]", "", "force.f"),
        (BAR, "", "[0, 0, -9.81]", "", "run.gravity"),
        (SHEET, "", "[0, 0, -9.81]", "", "run.gravity"),
        (SHEET, WRENCH + "moment = [1, 0, 0]", "[0, 0, 0]", "", "force.f"),
    ],
)
def test_a_load_across_a_part_is_refused_with_its_key(
    tmp_path: Path, geometry: str, load: str, gravity: str, body: str, key: str
) -> None:
    with pytest.raises(InputError, match=rf"{key}: \[.*\] given, of which .* body 'b' does not move: .*space"):
        opened(tmp_path, geometry, load=load, gravity=gravity, body=body)


@pytest.mark.parametrize(
    ("geometry", "load", "gravity", "body"),
    [
        (BEAM, WRENCH + "force = [0, 0, 1]\nmoment = [0, 1, 0]", "[0, 0, -9.81]", ""),
        (BEAM, FORCE + "direction = [0, 0, 1]", "[0, -9.81, 0]", TURNED),
        (BEAM + ", motion = 'space'", "", "[1, 2, 3]", ""),
        (BAR, FORCE + "direction = [1, 1e-9, 0]", "[9.81, 0, 0]", ""),
        (SHEET, FORCE + "direction = [1, 2, 0]", "[0, -9.81, 0]", ""),
    ],
)
def test_a_load_along_the_motions_of_a_part_is_read(
    tmp_path: Path, geometry: str, load: str, gravity: str, body: str
) -> None:
    if body:
        load = load.replace("[0, 0, 1]", "[0, 1, 0]")
    opened(tmp_path, geometry, load=load, gravity=gravity, body=body)
