"""Two solid rods strike each other end on end: meshes that do not match give what matching ones give, at any angle.

Round rods of equal meshes are turned against each other; a square rod meets one of finer elements, as it stands and
turned by a quarter. Truth is the same rods with points opposite each other.
"""

from pathlib import Path

import pytest

from gudgeon.pipeline.kinds import run

SHAPES = {
    "round": 'kind = "cylinder", radius = 0.01, length = 0.2',
    "square": 'kind = "box", lx = 0.02, ly = 0.02, lz = 0.2',
}
COMPONENT = """
[component.{name}]
geometry = {{ {shape} }}
material = {{ E = 210e9, nu = 0.3, rho = 7800.0 }}
mesh = {{ size = {size} }}
interface.front = {{ surface = "top", kind = "points" }}
interface.back = {{ surface = "bottom", kind = "points" }}
modes = {{ normal_count = 40 }}
"""
IMPACT = """
[body.one]
component = "rod"
velocity = [0.0, 0.0, 1.0]

[body.two]
component = "rod"
position = [0.0, 0.0, 0.2]

[contact.pair]
body = "one"
interface = "front"
against = { shape = "body", body = "two", interface = "back" }

[run]
duration = 1.4e-4
window = 2e-5
checks = false
"""
READ = ("impulse", "restitution", "force_peak")
BOUND = {"round": 2.5e-3, "square": 1e-3}


def struck(folder: Path, shape: str, component: str, angle: float) -> list[float]:
    """Return impulse, restitution and windowed force of a rod on one of a component, turned by an angle [degrees]."""
    scene = folder / f"{shape}.toml"
    parts = [
        COMPONENT.format(name=name, shape=SHAPES[shape], size=size) for name, size in (("rod", 9e-3), ("fine", 7e-3))
    ]
    scene.write_text("".join(parts) + IMPACT)
    turned = {"body.two.component": component, "body.two.orientation": {"axis": [0.0, 0.0, 1.0], "angle": angle}}
    found = run(scene, set=turned, db=folder / "db", out=folder / "out", until="solve").quantities
    return [found[f"pair.{name}"]["value"] for name in READ]


@pytest.mark.parametrize(
    ("shape", "others"),
    [("round", [("rod", 20.0), ("rod", 45.0), ("rod", 77.0)]), ("square", [("fine", 0.0), ("fine", 90.0)])],
)
def test_rods_strike_alike(shape: str, others: list[tuple[str, float]], tmp_path: Path) -> None:
    matching = struck(tmp_path, shape, "rod", 0.0)
    for component, angle in others:
        assert struck(tmp_path, shape, component, angle) == pytest.approx(matching, rel=BOUND[shape]), (
            component,
            angle,
        )
