"""Scenes that run in a second or two: a skirt at its bore, a rod on a wall, a piston without elasticity."""

import shutil
from pathlib import Path

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job

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
UPDATE = "component.skirt.change.update"


def write_scene(folder: Path) -> Path:
    """Write the scene and its table into a folder and return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene.toml").write_text(SCENE)
    (folder / "barrel.csv").write_text(BARREL)
    return folder


def rod_scene(size: float, count: int, samples: int, frames: int) -> str:
    """Return the scene of a steel bar on a rigid wall, with elements of a size [m] and `count` modes."""
    return f"""
[component.rod]
geometry = {{ kind = "bar", length = 1.0, area = 3.1416e-4 }}
material = {{ E = 210e9, nu = 0.3, rho = 7850.0 }}
mesh = {{ size = {size} }}
interface.tip = {{ surface = "right" }}
modes = {{ reduction = "macneal", normal_count = {count} }}

[body.rod]
velocity = [1.0, 0.0, 0.0]

[contact.wall]
body = "rod"
interface = "tip"
against = {{ shape = "plane", point = [1.0, 0.0, 0.0], normal = [-1.0, 0.0, 0.0] }}

[run]
duration = 6e-4
samples = {samples}
frames = {frames}
"""


DATA = Path(__file__).resolve().parents[2] / "data"
PISTON, PULL_IN = DATA / "piston", DATA / "pull-in"


def rigid_piston(folder: Path) -> Job:
    """Run the piston without elasticity on the coarsest meshes up to the morph stage; return its job."""
    coarse = {
        "component.piston.mesh.size": 0.02,
        "component.liner.mesh.size": 0.03,
        "component.piston.modes.reduction": "rigid",
        "component.liner.modes.reduction": "rigid",
        "component.liner.interface.thrust.spacing": 0.03,
        "component.liner.interface.anti.spacing": 0.03,
    }
    job = open_job(PISTON, set=coarse, db=folder / "db", out=folder / "out")
    run_job(job, "morph")
    return job


def pull_in(folder: Path, strips: int, corner_divisions: int) -> Path:
    """Write `data/pull-in` with fewer panels into a folder and return its scene; as shipped its grid takes a minute."""
    shutil.copytree(PULL_IN, folder, dirs_exist_ok=True)
    with (folder / "field.toml").open("a") as file:
        file.write(f"\n[panels]\nstrips = {strips}\ncorner_divisions = {corner_divisions}\n")
    return folder / "scene.toml"


def block_on_floor() -> str:
    """Return the scene of an elastic steel block that is thrown at a rigid floor."""
    return """
[component.block]
geometry = { kind = "box", lx = 0.06, ly = 0.04, lz = 0.02 }
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
mesh = { size = 0.015 }
interface.foot = { surface = "bottom" }
modes = { normal_count = 6 }

[body.block]
position = [0.0, 0.0, 1e-5]
velocity = [0.0, 0.0, -0.5]

[contact.floor]
body = "block"
interface = "foot"
against = { shape = "plane", point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }
surface_stiffness = 1e12

[run]
duration = 1e-4
samples = 400
frames = 20
checks = false
"""
