"""Write the robot's scenes and joint tables: `python data/base-sensor/make_robot.py`.

A six-axis arm of the dimensions, masses and centres of mass that Universal Robots publishes for its UR5 ("DH parameters
for calculations of kinematics and dynamics"); inertias are those of solid cylinders. It starts with right angles at all
joints, its tool down, in a hole with clearance, and is mounted on three load cells: bushings (robot.toml), or elastic
posts of the database (robot-cells.toml); or on the plate of beams (robot-plate.toml) or the solid one
(robot-solid.toml).
"""

from pathlib import Path

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

HERE = Path(__file__).parent
A = (0.0, -0.425, -0.39225, 0.0, 0.0, 0.0)
D = (0.089159, 0.0, 0.0, 0.10915, 0.09465, 0.0823)
ALPHA = (np.pi / 2, 0.0, 0.0, np.pi / 2, -np.pi / 2, 0.0)
START = np.radians([0.0, -90.0, -90.0, -90.0, 90.0, 0.0])
MASS = (3.7, 8.393, 2.275, 1.219, 1.219, 0.1879)
CENTRE = ((0, -0.02561, 0.00193), (0.2125, 0, 0.11336), (0.15, 0, 0.0265), (0, -0.0018, 0.01634), (0, 0.0018, 0.01634),
          (0, 0, -0.001159))  # fmt: skip
CYLINDER = ((0.06, 0.15, 2), (0.055, 0.425, 0), (0.04, 0.392, 0), (0.04, 0.1, 2), (0.04, 0.1, 2), (0.037, 0.04, 2))
"""Radius and length [m] of each link's cylinder, and its axis among those of its DH frame."""
PEG, PEG_LENGTH, PEG_MASS = 0.010, 0.12, 0.5
CLEARANCE = 1e-4
TILT = 0.012
"""Of the peg while its tip is pushed to the side [rad]: 30 mm above the tip it then presses on the other side."""
FRICTION = "{ static = 0.15, speed = 1e-3 }"
CELLS, CELL_RADIUS, POST = 3, 0.12, 0.04
DURATION, KNOTS = 1.0, 101
RING = ("east", "north", "west", "south")


def frames(q):
    """Return the DH frames 0 to 6 at joint angles, (7, 4, 4)."""
    found = [np.eye(4)]
    for theta, a, d, alpha in zip(q, A, D, ALPHA, strict=True):
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        step = np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])
        found.append(found[-1] @ step)
    return np.array(found)


def tip(q):
    """Return place and axis of the peg's tip."""
    last = frames(q)[-1]
    return last[:3, 3] + PEG_LENGTH * last[:3, 2], last[:3, 2], last[:3, 0]


def task(t):
    """Return the way of the tip from its start [m] and the turn of the peg [rad].

    Down, to the side beyond the clearance and tilted until it wedges, on the ground, up.
    """

    def smooth(a, b):
        x = np.clip((t - a) / (b - a), 0, 1)
        return x**3 * (10 - 15 * x + 6 * x**2)

    down = -0.02 * smooth(0.05, 0.45) - 5e-5 * smooth(0.45, 0.55) + 0.015 * smooth(0.75, 0.95)
    aside = smooth(0.15, 0.35) - smooth(0.75, 0.95)
    side = (CLEARANCE + 1e-4) * aside
    return np.array([side, 0.6 * side, down]), np.array([0.0, -TILT * aside, 0.0])


def joints():
    """Return times and joint angles from the start, (t, 6), by inverse kinematics."""
    start, axis, across = tip(START)
    times, q, found = np.linspace(0, DURATION, KNOTS), START.copy(), []
    for t in times:

        def miss(x, t=t):
            place, line, turn = tip(x)
            moved, tilt = task(t)
            R = Rotation.from_rotvec(tilt)
            return np.concatenate([place - start - moved, 0.3 * (line - R.apply(axis)), 0.3 * (turn - R.apply(across))])

        q = least_squares(miss, q, xtol=1e-15, ftol=1e-15, gtol=1e-15).x
        found.append(q - START)
    return times, np.array(found)


def text(vector, digits=9):
    """Return a vector as TOML."""
    return "[" + ", ".join(repr(float(round(x, digits)) + 0.0) for x in vector) + "]"


def plate_tables(solid):
    """Return the plate of plate.toml or plate-beams.toml, without supports, its ring tied for joints, and its body."""
    text = (HERE / ("plate.toml" if solid else "plate-beams.toml")).read_text()
    text = text[text.index("[component.plate]") : text.index("[component.plate.modes]")]
    lines = [line for line in text.splitlines() if not line.startswith("supports")]
    text = "\n".join(lines).replace(', ring = ["far-east", "far-north", "far-west", "far-south"]', "")
    far = "" if solid else "far-"
    ties = "".join(f'{name} = {{ surface = "{far}{name}", kind = "tie", tie = "rbe2" }}\n' for name in RING)
    gauge = text.index("[component.plate.gauge]")
    names = ", ".join(f'"{side}{spoke}"' for spoke in range(4) for side in ("top", "side"))
    return [
        text[:gauge].rstrip() + "\n" + ties, text[gauge:].rstrip(), "",
        "[component.plate.modes]", 'reduction = "row-craig-bampton"', "normal_count = 0", "fixed_count = 0", "",
        "[body.plate]", "position = [0.0, 0.0, -0.02]", f"gauges = [{names}]", "damping = { beta = 1e-5 }", "",
        "[sensor.base]", 'body = "plate"', "gauge_factor = 2.0",
        "noise = 2e-8                                                  # V/V",
        "drift = 1e-8                                                  # V/V after one second",
        "resolution = 1e-9                                             # V/V", "",
    ]  # fmt: skip


def clamps():
    """Return the joints that hold the plate's ring, and the stand on its hub."""
    found = []
    for name in RING:
        found += [f"[joint.{name}]", 'kind = "fixed"', 'body = "plate"', f'interface = "{name}"', ""]
    return [*found, "[joint.foot]", 'kind = "fixed"', 'body = "stand"', 'against = "plate"',
            'against_interface = "hub"', ""]  # fmt: skip


def cell_places():
    """Return the places of the load cells from the middle of the stand [m]."""
    turn = 2 * np.pi / CELLS * np.arange(CELLS)
    return CELL_RADIUS * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(CELLS)])


def posts():
    """Return the component of the elastic load cells, their bodies, joints and probes."""
    component = [
        "[component.cell]", "material = { E = 210e9, nu = 0.3, rho = 7850.0 }", "mesh = { size = 0.01 }", "",
        "[component.cell.geometry]", 'kind = "frame"', 'theory = "euler-bernoulli"',
        'section = { kind = "rectangle", width = 0.012, height = 0.012 }', "",
        "[component.cell.geometry.nodes]", "foot = [0.0, 0.0, 0.0]", f"top = [0.0, 0.0, {POST}]", "",
        "[component.cell.geometry.members]", 'post = { start = "foot", end = "top", up = [1.0, 0.0, 0.0] }', "",
        "[component.cell.interface]", 'foot = { surface = "foot", kind = "tie", tie = "rbe2" }',
        'top = { surface = "top", kind = "tie", tie = "rbe2" }', "",
        "[component.cell.modes]", 'reduction = "row-craig-bampton"', "normal_count = 0", "fixed_count = 0", "",
    ]  # fmt: skip
    bodies, joints, probes = [], [], []
    for k, place in enumerate(cell_places(), 1):
        bodies += [f"[body.cell{k}]", 'component = "cell"', f"position = {text(place - [0, 0, 0.02 + POST])}",
                   "damping = { beta = 4e-5 }", ""]  # fmt: skip
        joints += [f"[joint.floor{k}]", 'kind = "fixed"', f'body = "cell{k}"', 'interface = "foot"', "",
                   f"[joint.foot{k}]", 'kind = "fixed"', 'body = "stand"', f"at = {text(place)}",
                   f'against = "cell{k}"', 'against_interface = "top"', ""]  # fmt: skip
        probes += [f"[probe.cell{k}]", 'kind = "force"', f'of = "joint.foot{k}"', ""]
    return component, bodies, joints, probes


def main():
    """Write the files."""
    at = frames(START)
    times, moved = joints()
    lines = [
        "# A six-axis robot arm that puts a peg into a hole and is mounted on three load cells.",
        "# Dimensions, masses and centres of mass of the UR5 (Universal Robots, DH parameters for calculations of",
        "# kinematics and dynamics), inertias of solid cylinders. Written by make_robot.py.",
        "",
        "[component.stand]",
        'geometry = { kind = "rigid", mass = 6.0, inertia = [0.03, 0.03, 0.05] }',
        "",
    ]
    bodies = ["[body.stand]", "position = [0.0, 0.0, -0.02]", ""]
    hinges = []
    for i in range(6):
        R = at[i + 1, :3, :3]
        mass, centre = MASS[i], at[i + 1, :3, 3] + R @ CENTRE[i]
        radius, length, axis = CYLINDER[i]
        own = np.full(3, mass * (3 * radius**2 + length**2) / 12)
        own[axis] = mass * radius**2 / 2
        inertia = R @ np.diag(own) @ R.T
        extra = ""
        if i == 5:  # With the peg.
            line = at[6, :3, 2]
            peg = at[6, :3, 3] + PEG_LENGTH / 2 * line
            long, thick = PEG_MASS * (3 * PEG**2 + PEG_LENGTH**2) / 12, PEG_MASS * PEG**2 / 2
            whole = mass + PEG_MASS
            both = (mass * centre + PEG_MASS * peg) / whole
            inertia = inertia + long * np.eye(3) + (thick - long) * np.outer(line, line)
            for m, c in ((mass, centre), (PEG_MASS, peg)):
                arm = c - both
                inertia += m * ((arm @ arm) * np.eye(3) - np.outer(arm, arm))
            mass, centre = whole, both
            end = tip(START)[0]
            points = {"end": (end, line)}
            for k, out in enumerate(([1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0])):
                points[f"low{k}"] = (end + PEG * np.array(out), out)
                points[f"high{k}"] = (end + PEG * np.array(out) - 0.03 * line, out)
            extra = (
                "points = { "
                + ", ".join(
                    f"{name} = {{ at = {text(p - centre)}, normal = {text(n)} }}" for name, (p, n) in points.items()
                )
                + " }"
            )
        lines += [f"[component.link{i + 1}.geometry]", 'kind = "rigid"', f"mass = {mass:.6g}",
                  f"inertia = {text(np.diag(inertia))}"]  # fmt: skip
        if extra:
            lines += [extra, "", "[component.link6.interface]"]
            lines += [f'{name} = {{ surface = "{name}" }}' for name in points]
        lines.append("")
        bodies += [f"[body.link{i + 1}]", f"position = {text(centre)}", ""]
        before = "stand" if i == 0 else f"link{i}"
        hinges += [f"[joint.axis{i + 1}]", 'kind = "revolute"', f'body = "link{i + 1}"',
                   f"at = {text(at[i, :3, 3] - centre)}", f'against = "{before}"', f"axis = {text(at[i, :3, 2])}", "",
                   f"[joint.drive{i + 1}]", 'kind = "driven"', f'joint = "axis{i + 1}"',
                   f'table = "robot-axis{i + 1}.csv"', ""]  # fmt: skip
        rows = "\n".join(f"{t:.3f},{x:.12f}" for t, x in zip(times, moved[:, i], strict=True))
        (HERE / f"robot-axis{i + 1}.csv").write_text("time [s],angle [rad]\n" + rows + "\n")
    cells, probes = [], []
    for k, place in enumerate(cell_places()):
        here = text(place)
        cells += [f"[force.cell{k + 1}]", 'kind = "bushing"', 'body = "stand"', f"at = {here}"]
        cells += ["stiffness = [5e7, 5e7, 1e8]                           # N/m", "damping = [2e4, 2e4, 4e4]", ""]
        probes += [f"[probe.cell{k + 1}]", 'kind = "force"', f'of = "force.cell{k + 1}"', ""]
    end = tip(START)[0]
    law = 'law = { kind = "linear", stiffness = 1e6 }'
    contacts = []
    for name in [f"{side}{k}" for side in ("low", "high") for k in range(4)]:
        bore = f'{{ shape = "bore", radius = {PEG + CLEARANCE!r}, origin = {text(end)} }}'
        contacts += [f"[contact.{name}]", 'body = "link6"', f'interface = "{name}"', 'method = "penalty"', law]
        contacts += [f"friction = {FRICTION}", f"against = {bore}", ""]
    ground = text(end - np.array([0, 0, 0.02]))
    contacts += ["[contact.ground]", 'body = "link6"', 'interface = "end"', 'method = "penalty"', law,
                 f"friction = {FRICTION}",
                 f'against = {{ shape = "plane", point = {ground}, normal = [0.0, 0.0, 1.0] }}', ""]  # fmt: skip
    tail = [
        "[run]",
        f"duration = {DURATION}",
        "samples = 4000",
        "frames = 100",
        "gravity = [0.0, 0.0, -9.81]",
        'integrator = "turning"',
    ]
    sagging = [
        'start = "undeformed"                         # the base sags from t = 0 on, and the arm rocks on it',
        "",
    ]
    for name, kind in (("robot-plate", "a plate"), ("robot-solid", "a solid plate")):
        on_plate = [
            *lines,
            *plate_tables(name == "robot-solid"),
            *bodies,
            *hinges,
            *clamps(),
            *contacts,
            *tail,
            *sagging,
        ]
        text_on_plate = "\n".join(on_plate).replace("three load cells", f"{kind} with strain gauges", 1)
        (HERE / f"{name}.toml").write_text(text_on_plate)
    component, posted, held, read = posts()
    on_posts = [*lines, *component, *bodies, *posted, *hinges, *held, *contacts, *read, *tail, *sagging]
    text_on_posts = "\n".join(on_posts).replace("three load cells", "three elastic load cells of the database", 1)
    (HERE / "robot-cells.toml").write_text(text_on_posts)
    (HERE / "robot.toml").write_text("\n".join([*lines, *bodies, *hinges, *cells, *contacts, *probes, *tail, ""]))


if __name__ == "__main__":
    main()
