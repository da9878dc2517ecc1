"""Readings of other rooms: fields between plates, strain gauges of solids and beams, wear."""

import math

import numpy as np
from scipy.integrate import solve_ivp

from tests.calibration.case import STIFF, Case, Draw, force, plane, probe, rigid
from tests.calibration.kinds.loads import beam, box_scene

EPSILON = 8.8541878128e-12
"""Of vacuum [F/m]."""


def charged_plates(draw: Draw) -> Case:
    """A plate on a spring under a voltage that begins suddenly, below attraction-in: m ẍ = −k x − ½ ε A V²/(g + x)²."""
    m, gap, side = draw.between(1e-10, 1e-7), draw.between(1e-6, 1e-5), draw.between(5e-5, 5e-4)
    omega = draw.between(1e4, 1e6)
    k, fraction = m * omega**2, draw.between(0.1, 0.6)
    voltage = math.sqrt(fraction * 8 * k * gap**3 / (27 * EPSILON * side**2))
    attraction, T = 0.5 * EPSILON * side**2 * voltage**2, draw.between(1.0, 5.0) * 2 * math.pi / omega

    def moved(t: np.ndarray) -> np.ndarray:
        def rates(_: float, state: np.ndarray) -> list[float]:
            return [state[1], -state[0] - attraction / (k * gap**3) / (1 + state[0]) ** 2]

        exact = solve_ivp(rates, (0.0, omega * T * 1.001), [0.0, 0.0], t_eval=omega * t, rtol=1e-11, atol=1e-13)
        return gap * exact.y[0]

    scene = {
        "component": {"p": rigid(m)},
        "body": {"p": {"freedom": ["z"]}},
        "force": {"s": {"kind": "spring", "body": "p", "direction": [0, 0, 1], "stiffness": k},
                  "e": {"kind": "parallel-plates", "body": "p", "area": side**2, "gap": gap, "potential": voltage}},
        "probe": {"d": probe("displacement", "p", [0, 0, 1])},
        "run": {"duration": T, "start": "undeformed"},
    }  # fmt: skip
    return Case(scene, histories={"d": moved})


def gauged_solid(draw: Draw) -> Case:
    """A strain gauge on a solid cantilever that a force across its end bends: against a fine mesh."""
    side = draw.between(0.01, 0.03)
    length = side * draw.between(2.5, 5.0)
    scene = box_scene(draw, draw.of(STIFF), side, side, length)
    position = [0.5 * side, 0.0, length * draw.between(0.3, 0.6)]
    scene["component"]["b"]["gauge"] = {"g": {"point": position, "direction": [0, 0, 1], "quantity": "strain"}}
    scene["body"]["b"] = {"gauges": ["g"]}
    scene["force"] = {"f": force("b", "end", [1, 0, 0], "100")}
    return Case(scene, finer={"mesh": {"component.b.mesh.size": 0.25 * side}}, read=["b.g.strain_peak"])


def gauged_beam(draw: Draw) -> Case:
    """A strain gauge on a cantilever under a force at its tip, at rest: F (L − x) z/E I."""
    component, d = beam(draw, 15.0, theory="euler-bernoulli")
    position = draw.between(0.1, 0.6) * d["L"]
    component["geometry"]["stations"] = {"g": position}
    component["gauge"] = {"top": {"station": "g", "fibre": "top", "quantity": "strain"}}
    F = 1e-3 * d["L"] * 3 * d["EI"] / d["L"] ** 3
    scene = {
        "component": {"b": component},
        "body": {"b": {"gauges": ["top"]}},
        "force": {"f": force("b", "tip", [0, 0, 1], repr(float(F)))},
        "run": {"duration": 1e-3},
    }
    return Case(scene, {"b.top.strain_peak": -F * (d["L"] - position) * d["h"] / 2 / d["EI"]})


def worn_foot(draw: Draw) -> Case:
    """A foot that a swelling force presses on a belt: V = k/H v ∫ F dt."""
    m, speed, F = draw.between(0.1, 5.0), draw.between(0.01, 1.0), draw.between(10.0, 1e3)
    T, coefficient = draw.between(0.01, 0.1), draw.between(1e-6, 1e-3)
    stiffness = m * draw.between(3e3, 3e4) ** 2
    contact = {
        "body": "p", "interface": "foot", "surface_stiffness": stiffness,
        "against": plane([0, 0, 0], [0, 0, 1]) | {"velocity": [speed, 0, 0]},
        "friction": {"static": draw.of([0.1, 0.3])}, "wear": {"coefficient": coefficient, "hardness": 1e9},
    }  # fmt: skip
    scene = {
        "component": {"p": rigid(m, foot=([0, 0, 0], [0, 0, -1]))},
        "body": {"p": {"freedom": ["z"]}},
        "contact": {"c": contact},
        "force": {"f": force("p", None, [0, 0, -1], f"{F!r} * (1.5 - 0.5*cos({2 * math.pi / T!r} * t))")},
        "run": {"duration": T},
    }
    return Case(scene, {"c.wear_volume": coefficient / 1e9 * speed * 1.5 * F * T})


KINDS = {
    "plates": charged_plates,
    "gauge, solid": gauged_solid,
    "gauge, beam": gauged_beam,
    "wear": worn_foot,
}
