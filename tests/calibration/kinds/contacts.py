"""Contacts: bars, columns and masses against walls and each other, laws, rigid impacts, friction, wear."""

import math

import numpy as np
from scipy.integrate import solve_ivp

from tests.calibration.case import MATERIALS, STIFF, Case, Draw, plane, rigid, windowed_peak

MANY = 200
"""Modes whose error is small beside that of those drawn."""


def bar(length: float, area: float, material: dict, count: int, cells: int, **surfaces: str) -> dict:
    """Return a bar."""
    return {
        "geometry": {"kind": "bar", "length": length, "area": area},
        "material": material,
        "mesh": {"size": length / cells},
        "interface": {name: {"surface": surface} for name, surface in surfaces.items()},
        "modes": {"normal_count": count},
    }


def rod_on_wall(draw: Draw) -> Case:
    """A free rod strikes a rigid wall: d'Alembert."""
    material, length, area = draw.of(MATERIALS), draw.between(0.05, 2.0), draw.between(1e-5, 1e-3)
    count, cells = draw.count(12, 60), draw.count(120, 240)
    c = math.sqrt(material["E"] / material["rho"])
    speed = draw.between(1e-4, 1e-3) * c * 0.2
    Z, T = material["rho"] * c * area, length / c
    gap = draw.between(1e-3, 2e-2) * length
    contact = {"body": "rod", "interface": "tip", "against": plane([length + gap, 0, 0], [-1, 0, 0])}
    if draw.chance(0.3):
        contact["dashpot"] = "wave-guide"
    scene = {
        "component": {"rod": bar(length, area, material, count, cells, tip="right")},
        "body": {"rod": {"velocity": [speed, 0, 0]}},
        "contact": {"wall": contact},
        "run": {"duration": gap / speed + 3.2 * T, "window": 0.3 * T},
    }
    return Case(
        scene,
        {"wall.impulse": 2 * Z * speed * T, "wall.force_peak": Z * speed, "wall.rebound_velocity": speed},
        finer={
            "basis": {"component.rod.modes.normal_count": min(MANY, cells)},
            "mesh": {"component.rod.mesh.size": length / (4 * cells)},
        },
    )


def mass_on_rod(draw: Draw) -> Case:
    """A rigid mass strikes a free rod at rest: exponential force for one run of the wave to and fro."""
    material, length, area = draw.of(MATERIALS), draw.between(0.1, 2.0), draw.between(1e-5, 1e-3)
    count, cells = draw.count(16, 60), draw.count(100, 200)
    c = math.sqrt(material["E"] / material["rho"])
    T, Z, speed = length / c, material["rho"] * c * area, 2e-5 * c * draw.between(0.3, 3.0)
    m = material["rho"] * area * length * draw.between(0.3, 3.0)
    a, w = Z / m, 0.2 * T
    scene = {
        "component": {
            "rod": bar(length, area, material, count, cells, back="left"),
            "mass": rigid(m, face=([0, 0, 0], [1, 0, 0])),
        },
        "body": {"rod": {}, "mass": {"position": [-1e-6 * length, 0, 0], "velocity": [speed, 0, 0]}},
        "contact": {
            "pair": {
                "body": "mass",
                "interface": "face",
                "against": {"shape": "body", "body": "rod", "interface": "back"},
            }
        },
        "run": {"duration": 3.2 * T, "window": w},
    }
    return Case(
        scene,
        {
            "pair.impulse": m * speed * (1 - math.exp(-2 * a * T)),
            "pair.force_peak": lambda q: windowed_peak(
                lambda t: Z * speed * np.exp(-a * t), 2 * T, q["pair.force_window"]
            ),
        },
        finer={
            "basis": {"component.rod.modes.normal_count": min(MANY, cells)},
            "mesh": {"component.rod.mesh.size": length / (4 * cells)},
        },
    )


def column_on_floor(draw: Draw) -> Case:
    """A solid column without Poisson's contraction strikes a floor with its end: the rod's waves."""
    material = draw.of(STIFF) | {"nu": 0.0}
    side, slender = draw.between(0.005, 0.03), draw.between(3.0, 6.0)
    length, count = side * slender, draw.count(20, 60)
    c = math.sqrt(material["E"] / material["rho"])
    T, Z, speed = length / c, material["rho"] * c * side * side, draw.between(0.1, 2.0)
    scene = {
        "component": {
            "column": {
                "geometry": {"kind": "box", "lx": side, "ly": side, "lz": length},
                "material": material,
                "mesh": {"size": side * draw.between(0.5, 1.0)},
                "interface": {"foot": {"surface": "bottom"}},
                "modes": {"normal_count": count},
            }
        },
        "body": {"column": {"position": [0, 0, 1e-6], "velocity": [0, 0, -speed]}},
        "contact": {"floor": {"body": "column", "interface": "foot", "against": plane([0, 0, 0], [0, 0, 1])}},
        "run": {"duration": 1e-6 / speed + 4 * T, "window": 0.4 * T},
    }
    return Case(scene, {"floor.impulse": 2 * Z * speed * T, "floor.force_peak": Z * speed})


def mass_on_layer(draw: Draw) -> Case:
    """A rigid mass on a linear spring as contact: half a sine."""
    m, k, speed = draw.between(0.01, 10), draw.between(1e5, 1e8), draw.between(0.05, 2.0)
    omega = math.sqrt(k / m)
    law = {"kind": "linear", "stiffness": k}
    scene = mass_scene(m, speed, {"method": "penalty", "law": law}, 5.0 / omega)
    integrator = draw.of(["auto", "auto", "small"])
    scene["run"]["integrator"] = integrator
    exact = {
        "wall.impulse": 2 * m * speed,
        "wall.rebound_velocity": speed,
        "wall.force_peak": lambda q: (
            speed * math.sqrt(k * m) * np.sinc(omega * q["wall.force_window"] / 2 / np.pi) ** 2
        ),
    }
    return Case(scene, exact)


def mass_scene(m: float, speed: float, contact: dict, duration: float) -> dict:
    """Return a rigid mass that flies at a wall 1 µm ahead."""
    gap = 1e-6
    return {
        "component": {"ball": rigid(m, foot=([0, 0, 0], [1, 0, 0]))},
        "body": {"ball": {"velocity": [speed, 0, 0]}},
        "contact": {"wall": {"body": "ball", "interface": "foot", "against": plane([gap, 0, 0], [-1, 0, 0])} | contact},
        "run": {"duration": gap / speed + duration},
    }


def hertz(draw: Draw) -> Case:
    """A rigid mass on Hertz's law, m δ̈ = −K δ^1.5."""
    m, K, speed = draw.between(0.01, 2), draw.between(1e8, 5e10), draw.between(0.02, 2.0)
    depth = (1.25 * m * speed**2 / K) ** 0.4
    duration = 2.9432 * depth / speed
    scene = mass_scene(m, speed, {"method": "penalty", "law": {"kind": "hertz", "stiffness": K}}, 1.5 * duration)
    scene["run"]["integrator"] = draw.of(["auto", "auto", "small"])
    exact = {
        "wall.impulse": 2 * m * speed,
        "wall.rebound_velocity": speed,
        "wall.force_peak": lambda q: hertz_peak(q["wall.force_window"] / depth * speed) * K * depth**1.5,
    }
    return Case(scene, exact)


def hertz_peak(window: float) -> float:
    """Return the largest windowed force of Hertz's impact over its largest force, of a window over depth/speed."""

    def rates(_time: float, y: np.ndarray) -> tuple[float, float]:
        return y[1], -1.25 * max(y[0], 0.0) ** 1.5

    solved = solve_ivp(rates, (0.0, 3.0), (0.0, 1.0), rtol=1e-10, atol=1e-12, dense_output=True)
    return windowed_peak(lambda t: np.maximum(solved.sol(t)[0], 0.0) ** 1.5, 2.9432, window)


def hunt_crossley(draw: Draw) -> Case:
    """A rigid mass on Hunt and Crossley's law of a random loss, by an own integration."""
    m, K, speed, e = draw.between(0.01, 2), draw.between(1e8, 5e10), draw.between(0.05, 2.0), draw.between(0.6, 0.95)
    chi = 1.5 * (1 - e)  # over the approach speed, as Hunt and Crossley have it
    depth = (1.25 * m * speed**2 / K) ** 0.4
    law = {"kind": "hunt-crossley", "stiffness": K, "restitution": e}
    scene = mass_scene(m, speed, {"method": "penalty", "law": law}, 1.5 * 2.9432 * depth / speed / e)
    t = depth / speed

    def rates(_time: float, y: tuple[float, float]) -> tuple[float, float]:
        return y[1], -(max(y[0], 0.0) ** 1.5) * 1.25 * (1 + chi * y[1]) if y[0] > 0 else 0.0

    def out(_time: float, y: tuple[float, float]) -> float:
        return y[0] + (1.0 if _time < 0.5 else 0.0)

    out.terminal = True  # type: ignore[attr-defined]
    solved = solve_ivp(rates, (0.0, 20.0), (0.0, 1.0), rtol=1e-11, atol=1e-13, events=out)
    after = -solved.y[1, -1] * depth / t / speed
    return Case(scene, {"wall.restitution": after, "wall.impulse": m * speed * (1 + after)})


def newton(draw: Draw) -> Case:
    """Rigid restitution of one point."""
    m, speed, e = draw.between(0.01, 10), draw.between(0.05, 3.0), draw.between(0.2, 1.0)
    scene = mass_scene(m, speed, {"method": "impact", "restitution": e}, 1e-3)
    return Case(scene, {"wall.restitution": e, "wall.impulse": m * speed * (1 + e), "ball.velocity_x": -e * speed})


def bounces(draw: Draw) -> Case:
    """A ball that falls and bounces by Newton's law."""
    m, height, e = draw.between(0.01, 10), draw.between(0.01, 1.0), draw.between(0.4, 0.9)
    g, fall = 9.81, math.sqrt(2 * height / 9.81)
    v = g * fall
    scene = {
        "component": {"ball": rigid(m, foot=([0, 0, 0], [0, 0, -1]))},
        "body": {"ball": {"position": [0, 0, height]}},
        "contact": {
            "floor": {
                "body": "ball",
                "interface": "foot",
                "method": "impact",
                "restitution": e,
                "against": plane([0, 0, 0], [0, 0, 1]),
            }
        },
        "run": {"duration": fall + 2 * e * v / g + e * e * v / g, "gravity": [0, 0, -g]},
    }
    exact = {"floor.impulse": m * v * (1 + e) * (1 + e), "ball.displacement_z": (e * e * v) ** 2 / 2 / g - height}
    return Case(scene, exact)


def sliding(draw: Draw) -> Case:
    """A rigid block slides on a floor until friction stops it; half of them wear."""
    m, mu, speed = draw.between(0.1, 10), draw.between(0.1, 0.8), draw.between(0.1, 2.0)
    method = draw.of(["constraint", "residual"])
    contact = {
        "body": "block",
        "interface": "foot",
        "against": plane([0, 0, 0], [0, 0, 1]),
        "friction": {"static": mu},
        "method": method,
    }
    if method == "residual":
        contact["surface_stiffness"] = 1e8
        contact["method"] = "penalty"
        contact["law"] = {"kind": "linear", "stiffness": contact.pop("surface_stiffness")}
    stop = speed**2 / (2 * mu * 9.81)
    exact = {"block.displacement_x": stop}
    if draw.chance(0.5) and method != "constraint":
        contact["wear"] = {"coefficient": 1e-4, "hardness": 1e9}
        exact["floor.wear_volume"] = 1e-13 * m * 9.81 * stop
    scene = {
        "component": {"block": rigid(m, foot=([0, 0, 0], [0, 0, -1]))},
        "body": {"block": {"velocity": [speed, 0, 0], "freedom": ["x", "z"]}},
        "contact": {"floor": contact},
        "run": {"duration": 1.3 * speed / (mu * 9.81), "gravity": [0, 0, -9.81], "limits": {"offset": 1e9}},
    }
    return Case(scene, exact)


def bars(draw: Draw) -> Case:
    """A bar strikes a longer one of its section and material end on end: ρ c A v/2 for one run of the wave."""
    material, length, area = draw.of(MATERIALS), draw.between(0.05, 0.5), draw.between(1e-5, 1e-3)
    count, cells, ratio = draw.count(12, 30), draw.count(60, 100), draw.between(1.3, 2.5)
    c = math.sqrt(material["E"] / material["rho"])
    T, Z, speed = length / c, material["rho"] * c * area, 2e-5 * c * draw.between(0.3, 3.0)
    scene = {
        "component": {
            "a": bar(length, area, material, count, cells, front="right"),
            "b": bar(ratio * length, area, material, round(count * ratio), round(cells * ratio), back="left"),
        },
        "body": {"a": {"velocity": [speed, 0, 0]}, "b": {"position": [length * (1 + 1e-6), 0, 0]}},
        "contact": {
            "pair": {"body": "a", "interface": "front", "against": {"shape": "body", "body": "b", "interface": "back"}}
        },
        "run": {"duration": (2 * ratio + 2) * T, "window": 0.3 * T},
    }
    many = {"component.a.modes.normal_count": cells, "component.b.modes.normal_count": round(cells * ratio)}
    exact = {"pair.impulse": Z * speed * T, "pair.force_peak": Z * speed / 2}
    return Case(scene, exact, finer={"basis": many})


def block_on_layer(draw: Draw) -> Case:
    """An elastic block falls flat on a floor with a surface layer; against finer meshes and more modes."""
    material, side = draw.of(STIFF), draw.between(0.02, 0.06)
    scene = {
        "component": {
            "block": {
                "geometry": {
                    "kind": "box",
                    "lx": side,
                    "ly": side * draw.between(0.6, 1.0),
                    "lz": side * draw.between(0.4, 1.0),
                },
                "material": material,
                "mesh": {"size": side * draw.between(0.25, 0.4)},
                "interface": {"foot": {"surface": "bottom"}},
                "modes": {"normal_count": draw.count(10, 30)},
            }
        },
        "body": {"block": {"position": [0, 0, 1e-6], "velocity": [0, 0, -draw.between(0.1, 1.0)]}},
        "contact": {
            "floor": {
                "body": "block",
                "interface": "foot",
                "against": plane([0, 0, 0], [0, 0, 1]),
                "surface_stiffness": material["E"] / side * draw.between(0.01, 0.3),
            }
        },
    }
    m = material["rho"] * side**3 * 0.5
    stiffness = scene["contact"]["floor"]["surface_stiffness"] * side * side  # type: ignore[index]
    scene["run"] = {"duration": 1e-6 / 0.1 + 6 * math.sqrt(m / stiffness)}
    finer = {"basis": {"component.block.modes.normal_count": 90}, "mesh": {"component.block.mesh.size": 0.16 * side}}
    return Case(scene, finer=finer, read=["floor.impulse", "floor.force_peak", "floor.rebound_velocity"])


def ball_on_beam(draw: Draw) -> Case:
    """A rigid ball strikes the tip of a clamped beam over a Hertz law; against more modes and finer elements."""
    material, length = draw.of(STIFF), draw.between(0.2, 0.6)
    height = length / draw.between(15, 40)
    cells = draw.count(20, 60)
    scene = {
        "component": {
            "b": {
                "geometry": {
                    "kind": "beam",
                    "theory": "euler-bernoulli",
                    "length": length,
                    "section": {"kind": "rectangle", "width": height, "height": height},
                },
                "material": material,
                "mesh": {"size": length / cells},
                "supports": ["left"],
                "interface": {"tip": {"surface": "right-top"}},
                "modes": {"normal_count": draw.count(8, 20)},
            },
            "ball": rigid(material["rho"] * height**2 * length * draw.between(0.1, 1.0), foot=([0, 0, 0], [0, 0, -1])),
        },
        "body": {
            "b": {},
            "ball": {"position": [length, 0, 0.5 * height + 1e-6], "velocity": [0, 0, -draw.between(0.05, 0.5)]},
        },
        "contact": {
            "pair": {
                "body": "ball",
                "interface": "foot",
                "law": {"kind": "hertz", "stiffness": draw.between(1e8, 2e9)},
                "against": {"shape": "body", "body": "b", "interface": "tip"},
                "method": "residual",
            }
        },
        "run": {"duration": 3e-3},
    }
    finer = {
        "basis": {"component.b.modes.normal_count": 2 * cells - 4},
        "mesh": {"component.b.mesh.size": length / cells / 4},
    }
    return Case(scene, finer=finer, read=["pair.impulse", "pair.force_peak"])


KINDS = {
    "rod on wall": rod_on_wall,
    "mass on rod": mass_on_rod,
    "column on floor": column_on_floor,
    "mass on spring": mass_on_layer,
    "Hertz": hertz,
    "Hunt-Crossley": hunt_crossley,
    "Newton": newton,
    "bounces": bounces,
    "sliding": sliding,
    "bars": bars,
    "block on layer": block_on_layer,
    "ball on beam": ball_on_beam,
}
