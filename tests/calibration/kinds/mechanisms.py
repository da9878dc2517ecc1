"""Bodies on joints that turn by any angle, by own integrations and closed forms."""

import math

import numpy as np
from scipy.integrate import solve_ivp

from tests.calibration.case import STIFF, Case, Draw, probe

G = 9.81


def link(mass: float, inertia: float) -> dict:
    """Return a rigid link in the plane x, z."""
    return {"geometry": {"kind": "rigid", "mass": mass, "inertia": [inertia, inertia, inertia]}}


def pendulum(draw: Draw) -> Case:
    """A rigid pendulum of any swing: θ̈ = −(m g l / J) sin θ."""
    m, l = draw.between(0.1, 10), draw.between(0.05, 1.0)
    J = m * l * l * draw.between(0.05, 0.5)
    angle = draw.between(0.1, 2.5)
    omega2 = m * G * l / (J + m * l * l)
    T = draw.between(0.5, 3.0) * 2 * math.pi / math.sqrt(omega2)
    solved = solve_ivp(lambda t, y: (y[1], -omega2 * math.sin(y[0])), (0, T), (angle, 0.0), rtol=1e-12, atol=1e-13)
    theta = solved.y[0, -1]
    place = [l * math.sin(angle), 0.0, -l * math.cos(angle)]
    scene = {
        "component": {"p": link(m, J)},
        "body": {"p": {"position": place}},
        "joint": {"j": {"kind": "revolute", "body": "p", "at": [-place[0], 0, -place[2]], "axis": [0, 1, 0]}},
        "probe": {"d": probe("displacement", "p", [1, 0, 0])},
        "run": {"duration": T, "gravity": [0, 0, -G]},
    }
    exact = {"d.displacement_end": l * (math.sin(theta) - math.sin(angle))}
    times = np.linspace(0, T, 20001)
    dense = solve_ivp(lambda t, y: (y[1], -omega2 * math.sin(y[0])), (0, T), (angle, 0.0), rtol=1e-12, atol=1e-13,
                      t_eval=times)  # fmt: skip
    th, om = dense.y
    al = -omega2 * np.sin(th)
    ax = l * (np.cos(th) * al - np.sin(th) * om**2)
    az = l * (np.sin(th) * al + np.cos(th) * om**2)
    exact["j.force_peak"] = float(np.hypot(m * ax, m * (az + G)).max())
    return Case(scene, exact)


def double_pendulum(draw: Draw) -> Case:
    """Two point masses on massless rods, as rigid links whose inertia is small; against a run of higher accuracy."""
    m, M, l, L = (draw.between(0.2, 2) for _ in range(4))
    l, L = 0.3 * l, 0.3 * L
    angle = draw.between(0.2, 1.5)
    first = [l * math.sin(angle), 0.0, -l * math.cos(angle)]
    second = [first[0], 0.0, first[2] - L]
    T = draw.between(0.5, 2.0)
    scene = {
        "component": {"a": link(m, 0.1 * m * l * l), "b": link(M, 0.1 * M * L * L)},
        "body": {"a": {"position": first}, "b": {"position": second}},
        "joint": {
            "j": {"kind": "revolute", "body": "a", "at": [-first[0], 0, -first[2]], "axis": [0, 1, 0]},
            "k": {"kind": "revolute", "body": "b", "at": [0, 0, L], "against": "a", "axis": [0, 1, 0]},
        },
        "probe": {"d": probe("displacement", "b", [1, 0, 0])},
        "run": {"duration": T, "gravity": [0, 0, -G], "accuracy": draw.of([1e-8, 1e-6, 1e-4])},
    }
    return Case(scene, finer={"step": {"run.accuracy": 1e-11}}, read=["d.displacement_end", "j.force_peak"])


def spinning_bar(draw: Draw) -> Case:
    """An elastic bar on a pin turns and stretches from the start; against runs of more modes and accuracy."""
    material, length = draw.of(STIFF), draw.between(0.1, 1.0)
    side = length / draw.between(10, 30)
    c = math.sqrt(material["E"] / material["rho"])
    omega = draw.between(0.002, 0.01) * c / length
    component = {
        "geometry": {"kind": "beam", "length": length, "motion": "space",
                     "section": {"kind": "rectangle", "width": side, "height": side}},
        "material": material, "mesh": {"size": length / draw.count(6, 12)},
        "interface": {"root": {"surface": "left", "kind": "tie", "tie": "rbe2"},
                      "tip": {"surface": "right", "kind": "tie", "tie": "rbe2"}},
        "modes": {"reduction": "row-craig-bampton", "normal_count": 0, "fixed_count": draw.count(2, 8)},
    }  # fmt: skip
    scene = {
        "component": {"b": component},
        "body": {"b": {"angular_velocity": [0, omega, 0], "velocity": [0, 0, -omega * length / 2],
                       "damping": {"beta": 0.3 * length / c}}},
        "joint": {"j": {"kind": "revolute", "body": "b", "interface": "root", "axis": [0, 1, 0]}},
        "run": {"duration": 0.5 / omega},
    }  # fmt: skip
    finer = {"basis": {"component.b.modes.fixed_count": 14}, "step": {"run.accuracy": 1e-10}}
    return Case(scene, finer=finer, read=["j.force_peak"])


def slider_crank(draw: Draw) -> Case:
    """A slider on a massless rod and a crank of constant speed: exact kinematics, joint force m a along the rod."""
    r, l, m, speed = draw.between(0.02, 0.1), draw.between(0.15, 0.5), draw.between(0.1, 5), draw.between(5, 300)
    T = draw.between(0.3, 2.0) * 2 * math.pi / speed
    x = lambda t: r * math.cos(speed * t) + math.sqrt(l * l - (r * math.sin(speed * t)) ** 2)  # noqa: E731
    scene = {
        "component": {"s": link(m, 1e-3 * m)},
        "body": {"s": {"position": [r + l, 0, 0], "freedom": ["x"]}},
        "joint": {"j": {"kind": "slider-crank", "body": "s", "at": [0, 0, 0], "crank_radius": r, "rod_length": l,
                        "centre": [0, 0, 0], "along": [1, 0, 0], "lateral": [0, 0, 1], "speed": speed * 30 / math.pi}},
        "probe": {"d": probe("displacement", "s", [1, 0, 0])},
        "run": {"duration": T},
    }  # fmt: skip
    return Case(scene, {"d.displacement_end": x(T) - r - l})


KINDS = {
    "pendulum": pendulum,
    "double pendulum": double_pendulum,
    "spinning bar": spinning_bar,
    "slider-crank": slider_crank,
}
