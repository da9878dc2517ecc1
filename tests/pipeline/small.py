"""A skirt scene that runs in a second or two, for tests of the stages."""

from pathlib import Path

SCENE = """
[component.skirt]
geometry = { kind = "skirt", outer_radius = 0.04296, wall = 0.006, height = 0.040, crown = 0.008 }
material = { E = 72e9, nu = 0.33, rho = 2700.0 }
mesh = { size = 0.014 }
interface.thrust = { surface = "skirt", sector_deg = [-45.0, 45.0] }
modes = { reduction = "macneal", normal_count = 8, static_count = 4 }
change = { update = "reuse", profile = { surface = "skirt" } }

[body.skirt]
velocity = [0.2, 0.0, 0.0]
position = [38e-6, 0.0, 0.0]

[contact.bore]
body = "skirt"
interface = "thrust"
against = { shape = "bore", radius = 0.043 }
surface_stiffness = 1e14

[run]
duration = 3e-4
samples = 400
frames = 20
"""

BARREL = """height,0
0.00,-2e-5
0.01,-5e-6
0.02,0
0.03,-5e-6
0.04,-2e-5
"""

TABLE = "component.skirt.change.profile.table"
RUNG = "component.skirt.change.update"


def write_scene(folder: Path) -> Path:
    """Write the scene and its table into a folder and return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene.toml").write_text(SCENE)
    (folder / "barrel.csv").write_text(BARREL)
    return folder
